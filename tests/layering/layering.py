#!/usr/bin/env python3
"""Checks the tree against tests/layering/rules.ini: which folder may include and link which, and which words stay out of where.

usage: layering.py [ROOT]           tells what breaks a rule, one a line with the rule's name; fails if anything does
       layering.py --edges [ROOT]   prints the table of edges as the tree has them now
"""
import configparser
import fnmatch
import functools
import pathlib
import posixpath
import re
import sys

sys.dont_write_bytecode = True
from build_files import OPTIONS, Build
from source_files import HEADERS, Words, project_folder, read_units

RULES = {  # every name that a complaint can have, beside the sections of words and headers in rules.ini
    "include": "an include, or a declaration of a type, that the table does not allow",
    "link": "a link, or a file built, that the table does not allow",
    "unlinked": "an include without the link that it needs, or with a PRIVATE one in a header",
    "unneeded link": "a link that no include needs, or PUBLIC where no header needs it",
    "unneeded edge": "an edge of the table that no include needs",
    "order": "an edge that points up in the table, or folders added to the build in another order",
    "unknown folder": "a folder that the table does not know, or that is no more",
    "unknown header": "an include that is neither a file of ours that is read nor any that rules.ini knows",
    "target name": "a library that is not called after its folder",
    "spelling": "an include that does not name its file from the root of the tree, or code that could hide one or a word",
    "build": "what a folder's CMakeLists.txt says in a way that is not understood here",
    "atomic wait": "a wait for an atomic's value, which has no deadline",
    "unneeded exception": "an exception in rules.ini that nothing needs any more",
}


class Rules:
    def __init__(self, path):
        ini = configparser.ConfigParser(interpolation=None, delimiters=("=",), comment_prefixes=("#",), strict=True)
        ini.optionxform = str
        ini.read_string(path.read_text(), str(path))
        self.edges = {folder: allowed.split() for folder, allowed in ini["edges"].items()}
        self.packages = {package: headers.split() for package, headers in ini["packages"].items()}
        self.outside = " ".join(ini["headers of the language and the system"].values()).split()
        self.not_read = set(ini["build files that are not read"])
        self.linked_for_more = {k: v.split() for k, v in ini["linked for more than includes"].items()}
        self.sections = {name: {k: v.split() for k, v in ini[name].items() if k != "because"}
                         for name in ini.sections() if re.match(r"(words|headers): ", name)}

    def row(self, folder):
        """The row that speaks of the folder: its own, or one that ends in /* and stands for all folders below it."""
        if folder in self.edges:
            return folder
        return next((row for row in self.edges if row.endswith("/*") and (folder + "/").startswith(row[:-1])), None)

    def allows(self, folder, other):
        row = self.row(folder)
        return folder == other or row is not None and any(
            other == edge or edge.endswith("/*") and (other + "/").startswith(edge[:-1]) for edge in self.edges[row])

    @functools.cache
    def package(self, include):
        return next((p for p, headers in self.packages.items() if any(fnmatch.fnmatchcase(include, h) for h in headers)), None)


class Check:
    def __init__(self, root):
        self.rules = Rules(root / "tests/layering/rules.ini")
        self.units = read_units(root)
        self.build = Build(root, self.rules.not_read)
        self.targets, self.added = self.build.targets, self.build.added
        self.not_alone = {path for t in self.targets.values() for path in t.not_alone}
        self.library_of = {t.folder: t for t in self.targets.values() if t.kind == "library" and t.folder != "."}
        self.told = []

    def tell(self, rule, place, what):
        self.told.append(f"{place}: [{rule}] {what}")

    def edges(self):
        found = {}
        for unit in self.units.values():
            found.setdefault(unit.folder, set())
            for _, name, _ in unit.includes:
                other = project_folder(name)
                if other and other != unit.folder:
                    found[unit.folder].add(other)
        return found

    def run(self):
        self.check_table()
        self.check_includes()
        self.check_types()
        self.check_spelling()
        self.check_atomics()
        self.check_build()
        self.check_targets()
        for name, section in self.rules.sections.items():
            self.check_section(name, section)
        return self.told

    def check_table(self):
        place = "tests/layering/rules.ini"
        edges, rows = self.edges(), list(self.rules.edges)
        for folder in edges:
            if self.rules.row(folder) is None:
                self.tell("unknown folder", folder, "has no row in tests/layering/rules.ini")
        for i, row in enumerate(rows):
            if not row.endswith("/*") and row not in edges:
                self.tell("unknown folder", place, f"has a row for {row}, where no file is")
            below = [r for r in rows[:i] if not r.endswith("/*")]
            for edge in self.rules.edges[row]:
                if edge.endswith("/*"):
                    continue
                if edge not in below:
                    self.tell("order", place, f"{row} = ... {edge}: only a folder whose row stands above may be named")
                elif not row.endswith("/*") and row in edges and edge not in edges[row]:
                    self.tell("unneeded edge", place, f"{row} = ... {edge}: no file of {row} includes anything of it")
        built = [f for f in self.added if f in self.library_of or any(t.folder == f for t in self.targets.values())]
        built = [f for f in built if not f.startswith("tests")]
        listed = [r for r in rows if r in built]
        for one, other in zip(built, listed):
            if one != other:
                self.tell("order", place, f"the build adds {one} where the table has {other}")
                break

    def check_includes(self):
        for unit in self.units.values():
            for line, name, quoted in unit.includes:
                place = f"{unit.path}:{line}"
                other = project_folder(name)
                if name is None or quoted and other is None or name != posixpath.normpath(name) or name[0] == "/":
                    self.tell("spelling", place, f'includes {name or "by a macro"}: write "folder/file.hpp", from the root')
                elif other and not self.rules.allows(unit.folder, other):
                    self.tell("include", place, f"includes {name}, which {unit.folder} may not")
                elif other and name not in self.units:
                    self.tell("unknown header", place, f"includes {name}, which is not there, or not called as code is")
                elif not other and not self.rules.package(name) and not matches(name, self.rules.outside):
                    self.tell("unknown header", place, f"includes <{name}>, of which rules.ini knows no package")

    def check_types(self):
        """A type of another folder is that folder's also where it is only declared."""
        folders = {}
        for unit in self.units.values():
            for name in unit.defined if not unit.folder.startswith("tests") else ():
                folders.setdefault(name, set()).add(unit.folder)
        for unit in self.units.values():
            for line, name in unit.declared:
                if name in folders and not any(self.rules.allows(unit.folder, folder) for folder in folders[name]):
                    self.tell("include", f"{unit.path}:{line}",
                              f"declares {name}, of {min(folders[name])}, which {unit.folder} may not")

    def check_spelling(self):
        """A namespace whose name some rule's words have is always named."""
        words = [w for section in self.rules.sections.values() for w in section.get("words", [])]
        spaces = "|".join(sorted({w.split("::")[0] for w in words if "::" in w} - {""}))
        hidden = spaces and re.compile(rf"\b(?:using\s+namespace|namespace\s+\w+\s*=)\s+(?:::\s*)?(?:{spaces})\s*;")
        for unit in self.units.values():
            for line, what in unit.odd:
                self.tell("spelling", f"{unit.path}:{line}", f"has {what}: write it plainly")
            for found in hidden.finditer(unit.code) if hidden else ():
                self.tell("spelling", f"{unit.path}:{unit.line(found)}", f"has {found[0]} Name it where it is used")

    def check_atomics(self):
        """Nothing but its name tells whether what is waited for is an atomic: so the name of one is of none else's."""
        declared = re.compile(r"\batomic(?:_\w+)?\s*(?:<[^;{}()]*>)?[\s&*]+(?=\w)([^;(){}]*)")
        names = {name for u in self.units.values() if "atomic" in u.code for m in declared.finditer(u.code)
                 for name in re.findall(r"(?:^|,)\s*(\w+)", m[1])}
        waits = re.compile(r"\b(\w+)(?:\[[^]]*\])*\s*(?:\.|->)\s*wait\s*\(")
        for unit in self.units.values():
            if unit.folder != "drivers/system" and not unit.folder.startswith("tests"):
                for found in waits.finditer(unit.code):
                    if found[1] in names:
                        place = f"{unit.path}:{unit.line(found)}"
                        self.tell("atomic wait", place, f"waits for {found[1]}: use drivers/system's Condition")

    def check_build(self):
        for place, what in self.build.told:
            self.tell("build", place, what)
        for path in sorted(self.rules.not_read - self.build.passed_over):
            self.tell("unneeded exception", "tests/layering/rules.ini", f"{path}: no CMakeLists.txt of a folder includes it")

    def needs(self, path, seen):
        """The targets and packages that a file's includes ask for: also through headers of its own folder, of no target, and
        through those whose includers link what they need (NOT_ALONE)."""
        unit = self.units.get(path)
        if unit is None or path in seen:
            return set()
        seen.add(path)
        found = set()
        for _, name, _ in unit.includes:
            other = project_folder(name)
            if other and (other == unit.folder or other not in self.library_of or name in self.not_alone):
                found |= self.needs(name, seen)
            if other and other != unit.folder and other in self.library_of:
                found.add(self.library_of[other].name)
            elif name and not other:
                found.add(self.rules.package(name))
        return found - {None}

    def check_targets(self):
        known = {t.name for t in self.library_of.values()} | set(self.rules.packages)
        for target in self.targets.values():
            place = f"{target.folder}/CMakeLists.txt"
            if target.folder == ".":
                continue
            if target.kind == "library":
                expected = "birdseye_" + re.sub(r"^hw-sim/", "sim/", target.folder).replace("/", "_")
                if target.name != expected:
                    self.tell("target name", place, f"{target.name} should be called {expected}")
            self.check_sources(target, place)
            public, private = set(), set()
            if target.kind == "library":
                seen = set()
                for path, unit in self.units.items():
                    if unit.folder == target.folder and path.endswith(HEADERS) and path not in self.not_alone:
                        public |= self.needs(path, seen)
            for source in target.sources:
                private |= self.needs(source, set())
            own = self.library_of.get(target.folder)
            if own and target is not own:  # a program stands on its folder's library, and that library brings what it needs
                private -= {n for n in private if n in own.links and own.links[n] == "PUBLIC"} - set(target.links)
                private.add(own.name)
            public.discard(target.name)
            private -= public | {target.name}
            more = self.rules.linked_for_more.get(target.name, [])
            for name in sorted(public | private):
                if name not in target.links:
                    self.tell("unlinked", place, f"{target.name} includes headers of {name} and does not link it")
                elif name in public and target.links[name] == "PRIVATE":
                    self.tell("unlinked", place, f"{target.name} links {name} PRIVATE, and headers of its folder include it")
            for name, kind in target.links.items():
                other = self.targets.get(name)
                if name not in known | {OPTIONS}:
                    self.tell("build", place, f"{target.name} links {name}, which is neither a folder's library nor in [packages]")
                elif other and other.folder != "." and not self.rules.allows(target.folder, other.folder):
                    self.tell("link", place, f"{target.name} links {name}, which {target.folder} may not")
                elif name not in known or name in more:
                    continue
                elif name not in public | private:
                    self.tell("unneeded link", place, f"{target.name} links {name}, and no include needs it")
                elif kind == "PUBLIC" and name not in public and target.kind == "library":
                    self.tell("unneeded link", place, f"{target.name} links {name} PUBLIC, and no header needs it")
            for name in more:
                if name not in target.links or name in public | private:
                    self.tell("unneeded exception", "tests/layering/rules.ini", f"{target.name} = {name}")

    def check_sources(self, target, place):
        for source in target.sources + target.not_alone:
            folder = posixpath.dirname(source)
            if source not in self.units:
                self.tell("build", place, f"{target.name} is built of {source}, which is no file of the tree that is read")
            elif folder != target.folder and not (target.folder.startswith("tests") and (
                    folder.startswith(target.folder + "/") or self.rules.allows(target.folder, folder))):
                self.tell("link", place, f"{target.name} is built of {source}, which {target.folder} may not")

    def check_section(self, name, section):
        rule = name.partition(": ")[2]
        words, headers = Words(section.get("words", [])), section.get("headers", [])
        exceptions = section.get("but not in", []) + section.get("not yet in", [])
        excepted = set()
        for unit in self.units.values():
            if not matches(unit.path, section["in"]):
                continue
            found = [(line, f"<{include}>") for line, include, _ in unit.includes if include and matches(include, headers)]
            found += words.find(unit)
            place = [p for p in exceptions if fnmatch.fnmatchcase(unit.path, p)]
            if found and place:
                excepted.update(place)
            elif found:
                for line, word in sorted(found):
                    self.tell(rule, f"{unit.path}:{line}", f"has {word}")
        for path in exceptions:
            if path not in excepted:
                self.tell("unneeded exception", "tests/layering/rules.ini", f"[{name}] {path}: nothing there breaks the rule")


def matches(name, patterns):
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


def main(arguments):
    edges = "--edges" in arguments
    roots = [a for a in arguments if a != "--edges"]
    root = pathlib.Path(roots[0] if roots else ".")
    check = Check(root)
    if edges:
        rows = [*check.rules.edges, *sorted(set(check.edges()) - set(check.rules.edges))]
        for row in rows:
            if not row.startswith("tests") and row in check.edges():
                above = sorted(check.edges()[row], key=lambda f: rows.index(f) if f in rows else len(rows))
                print(f"{row} = {' '.join(above)}")
        return 0
    told = check.run()
    for line in told:
        print(line)
    return 1 if told else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
