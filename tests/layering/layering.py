#!/usr/bin/env python3
"""Checks the tree against tests/layering/rules.ini: which folder may include and link which, and which words stay out of where.

usage: layering.py [ROOT]           tells what breaks a rule, one a line with the rule's name; fails if anything does
       layering.py --edges [ROOT]   prints the table of edges as the tree has them now
"""
import configparser
import fnmatch
import pathlib
import posixpath
import re
import sys

TOPS = ("calibration", "drivers", "device", "host", "hw-sim", "tests")
CODE = (".hpp", ".cpp", ".h", ".hh", ".hxx", ".inl", ".ipp", ".c", ".cc", ".cxx")
HEADERS = (".hpp", ".h", ".hh", ".hxx", ".inl", ".ipp")
RULES = {  # every name that a complaint can have, beside the sections of words and headers in rules.ini
    "include": "an include that the table does not allow",
    "link": "a link that the table does not allow",
    "unlinked": "an include without the link that it needs, or with a PRIVATE one in a header",
    "unneeded link": "a link that no include needs, or PUBLIC where no header needs it",
    "unneeded edge": "an edge of the table that no include needs",
    "order": "an edge that points up in the table, or folders added to the build in another order",
    "unknown folder": "a folder that the table does not know, or that is no more",
    "target name": "a library that is not called after its folder",
    "spelling": "an include that does not name its file from the root of the tree",
    "unneeded exception": "an exception in rules.ini that nothing needs any more",
}

# Comments go; strings are kept apart, because an include's name is one and a word in a message is no use of it.
TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|R"([^(\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9A-Fa-f])\'(?:\\.|[^\'\\\n])*\'', re.S)
INCLUDE = re.compile(r'^[ \t]*#[ \t]*(?:include|include_next|import)\b[ \t]*(.*)$', re.M)


class Unit:
    """One file: what it includes, by line, and its text without comments and strings."""

    def __init__(self, root, path):
        self.path = path
        self.folder = path.rpartition("/")[0]
        text = (root / path).read_text()
        self.includes = []  # (line, name, quoted); the name is None where a macro stands for it
        bare = TOKEN.sub(lambda m: m[0] if m[0][0] == '"' else blank(m[0]), text)
        for found in INCLUDE.finditer(bare):
            line = bare.count("\n", 0, found.start()) + 1
            name = re.match(r'"([^"]+)"|<([^>]+)>', found[1])
            self.includes.append((line, name and (name[1] or name[2]), bool(name and name[1])))
        self.code = TOKEN.sub(lambda m: blank(m[0]), text).split("\n")


def blank(text):
    return "\n" * text.count("\n") or " "


def project_folder(name):
    return name.rpartition("/")[0] if name and name.partition("/")[0] in TOPS else None


def read_units(root):
    paths = (p for top in TOPS for p in sorted((root / top).rglob("*")) if p.suffix in CODE)
    return {u.path: u for u in (Unit(root, p.relative_to(root).as_posix()) for p in paths)}


class Rules:
    def __init__(self, path):
        ini = configparser.ConfigParser(interpolation=None, delimiters=("=",), comment_prefixes=("#",), strict=True)
        ini.optionxform = str
        ini.read_string(path.read_text(), str(path))
        self.edges = {folder: allowed.split() for folder, allowed in ini["edges"].items()}
        self.packages = {package: headers.split() for package, headers in ini["packages"].items()}
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

    def package(self, include):
        return next((p for p, headers in self.packages.items() if any(fnmatch.fnmatchcase(include, h) for h in headers)), None)


class Target:
    """A library, program or test of the build, with the folder whose CMakeLists.txt makes it."""

    def __init__(self, name, folder, kind):
        self.name, self.folder, self.kind = name, folder, kind
        self.sources, self.not_alone = [], []  # files, by their paths from the root
        self.links = {}  # name: PUBLIC or PRIVATE


def read_build(root):
    """All targets, and the folders in the order in which they are added, of every CMakeLists.txt from the root's on."""
    targets, order = {}, []

    def read(folder):
        text = re.sub(r"#[^\n]*", "", (root / folder / "CMakeLists.txt").read_text())
        here = folder.as_posix()
        for command, words in re.findall(r"(\w+)\s*\(([^()]*)\)", text):
            words = re.findall(r'"[^"]*"|\S+', words)
            if command == "add_subdirectory":
                order.append((folder / words[0]).as_posix())
                read(folder / words[0])
            elif command in ("birdseye_library", "birdseye_executable", "birdseye_test", "add_library", "add_executable"):
                kind = "library" if command in ("birdseye_library", "add_library") else "program"
                target = targets.setdefault(words[0], Target(words[0], here, kind))
                part = "SOURCES"
                for word in words[1:]:
                    if re.fullmatch("[A-Z_]+", word):
                        part = word
                    elif part in ("SOURCES", "NOT_ALONE") and word.endswith(CODE):
                        path = word.replace("${CMAKE_SOURCE_DIR}/", "") if "$" in word else f"{here}/{word}"
                        (target.sources if part == "SOURCES" else target.not_alone).append(posixpath.normpath(path))
                    elif part in ("PUBLIC", "PRIVATE"):
                        target.links[word] = part
            elif command == "target_link_libraries":
                part = "PRIVATE"
                for word in words[1:]:
                    if word in ("PUBLIC", "PRIVATE", "INTERFACE"):
                        part = "PRIVATE" if word == "PRIVATE" else "PUBLIC"
                    else:
                        targets.setdefault(words[0], Target(words[0], here, "program")).links[word] = part

    read(pathlib.Path("."))
    return targets, order


class Check:
    def __init__(self, root):
        self.root = root
        self.rules = Rules(root / "tests/layering/rules.ini")
        self.units = read_units(root)
        self.targets, self.added = read_build(root)
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
                if name is None or quoted and other is None or ".." in name.split("/"):
                    self.tell("spelling", place, f'includes {name or "by a macro"}: write "folder/file.hpp", from the root')
                elif other and not self.rules.allows(unit.folder, other):
                    self.tell("include", place, f"includes {name}, which {unit.folder} may not")

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
            if not target.sources or any(s not in self.units for s in target.sources):
                continue  # of another project's sources
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
                if other and other.folder != "." and other.kind == "library" and not self.rules.allows(target.folder, other.folder):
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

    def check_section(self, name, section):
        rule = name.partition(": ")[2]
        patterns = [(word, word_pattern(word)) for word in section.get("words", [])]
        headers = section.get("headers", [])
        exceptions = section.get("but not in", []) + section.get("not yet in", [])
        excepted = set()
        for unit in self.units.values():
            if not any(fnmatch.fnmatchcase(unit.path, p) for p in section["in"]):
                continue
            found = []
            for line, include, _ in unit.includes:
                if include and any(fnmatch.fnmatchcase(include, h) for h in headers):
                    found.append((line, f"<{include}>"))
            for word, pattern in patterns:
                found += [(i + 1, word) for i, text in enumerate(unit.code) if pattern.search(text)]
            place = [p for p in exceptions if fnmatch.fnmatchcase(unit.path, p)]
            if found and place:
                excepted.update(place)
            elif found:
                for line, word in sorted(found):
                    self.tell(rule, f"{unit.path}:{line}", f"has {word}")
        for path in exceptions:
            if path not in excepted:
                self.tell("unneeded exception", "tests/layering/rules.ini", f"[{name}] {path}: nothing there breaks the rule")


def word_pattern(word):
    """The word as code would have it: not as the end of a longer name, and not as its beginning unless it ends in _."""
    before = r"(?<![\w])" if re.match(r"[\w:]", word) else ""
    after = r"(?![\w])" if re.search(r"[^\W_]$", word) else ""
    return re.compile(before + re.escape(word) + after)


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
