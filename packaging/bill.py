#!/usr/bin/env python3
"""Writes the bill of materials of one of our programs, as SPDX 2.3 in JSON, to standard output: each Debian package that it
loads libraries of, directly or through another library (DYNAMIC_LINK), that its program holds code of (STATIC_LINK for
libraries, BUILD_DEPENDENCY_OF for headers), or that it needs beside (DEPENDS_ON), in the version that it was built with.
What a program links is read from its ELF file, what was compiled into it from ninja's own books, and whose a file is from
the package database: the machine's, or that of the sysroot of packaging/arm64-sysroot.
usage: bill.py --program BUILD_DIR/bin/NAME --version V --architecture A --ninja NINJA [--depends NAMES] [--sysroot DIR]"""
import argparse
import datetime
import json
import os
import pathlib
import re
import subprocess
import sys
import time
import uuid
from urllib.parse import quote


def lines_of(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()


class Database:
    """Which package a file is of, and the package's version, source and maintainer."""

    def __init__(self, sysroot):
        self.root = pathlib.Path(sysroot or "/").resolve()
        self.owner, self.facts = {}, {}
        if sysroot:
            facts = (self.root / "packages.txt").read_text().splitlines()
            for line in (self.root / "files.txt").read_text().splitlines():
                name, _, path = line.partition(" ")
                self.owner[path] = name
        else:
            facts = lines_of("dpkg-query", "-W", "-f=${db:Status-Abbrev}\t${Package}\t${Version}\t${source:Package}\t${source:Version}"
                             "\t${Architecture}\t${Maintainer}\n")
            facts = [line.partition("\t")[2] for line in facts if line.startswith("ii")]
            for of_package in pathlib.Path("/var/lib/dpkg/info").glob("*.list"):
                name = of_package.name[:-len(".list")].partition(":")[0]
                for path in of_package.read_text().splitlines():
                    self.owner.setdefault(path, name)
        for line in facts:
            name, *rest = line.split("\t")
            self.facts.setdefault(name, rest)

    def package_of(self, path):
        path = "/" + str(path.resolve().relative_to(self.root))
        for known in (path, path.removeprefix("/usr"), "/usr" + path):  # /lib is a link to /usr/lib, and packages say either
            if known in self.owner:
                return self.owner[known]
        sys.exit(f"bill.py: {path}: of no package; install Debian's package of it")


def machine_of(elf):
    with open(elf, "rb") as file:
        return file.read(20)[18:]


def links(program, database):
    """(package or None for the program, package it loads a library of), for all that is loaded when the program starts."""
    folders = [*sorted((database.root / "usr/lib").glob("*-linux-gnu")), database.root / "usr/lib"]
    found, edges, waiting = {}, set(), [program]

    def find(name, searched):
        for folder in [*searched, *folders]:
            path = folder / name
            if path.exists() and machine_of(path) == machine_of(program):
                return path.resolve()
        sys.exit(f"bill.py: {name}: not found; install the package that {program} needs it of")

    while waiting:
        loader = waiting.pop()
        dynamic = "\n".join(lines_of("readelf", "-dW", str(loader)))
        by = None if loader == program else database.package_of(loader)
        searched = [pathlib.Path(folder.replace("$ORIGIN", str(loader.parent)))
                    for paths in re.findall(r"\((?:RUNPATH|RPATH)\).*\[(.*)\]", dynamic) for folder in paths.split(":")]
        for name in re.findall(r"\(NEEDED\).*\[(.*)\]", dynamic):
            if name not in found:
                found[name] = find(name, searched)
                waiting.append(found[name])
            edges.add((by, database.package_of(found[name])))
    return {(by, of) for by, of in edges if by != of}


def compiled_in(program, ninja, database):
    """Packages whose headers, and packages whose static libraries, the program was built of."""
    build = program.parent.parent
    inputs = lines_of(ninja, "-C", str(build), "-t", "inputs", str(program.relative_to(build)))
    objects = [line for line in inputs if line.endswith(".o")]
    headers = {line.strip() for line in lines_of(ninja, "-C", str(build), "-t", "deps", *objects) if line.startswith("    ")}

    def owners(paths):
        paths = {pathlib.Path(os.path.normpath(build / path)) for path in paths}
        return {database.package_of(path) for path in paths
                if any(path.is_relative_to(database.root / top) for top in ("usr/include", "usr/lib"))}

    return owners(headers), owners(line for line in inputs if line.endswith(".a"))


def entry(name, facts):
    """A package; of those that are not installed here no more than the name is known."""
    made = {"name": name, "SPDXID": spdx_id(name), "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
            "licenseConcluded": "NOASSERTION", "licenseDeclared": "NOASSERTION", "copyrightText": "NOASSERTION"}
    if facts:
        version, source, source_version, architecture, maintainer = facts
        person = re.fullmatch(r"(.*?) *<(.*)>", maintainer)
        made |= {"versionInfo": version,
                 "supplier": f"Organization: {person[1]} ({person[2]})" if person else f"Organization: {maintainer}",
                 "sourceInfo": f"built by Debian from the source package {source} {source_version}",
                 "externalRefs": [locator(f"pkg:deb/debian/{quote(name)}@{quote(version)}?arch={architecture}&distro=debian-12")]}
    return made


def locator(purl):
    return {"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": purl}


def spdx_id(name):
    return "SPDXRef-Package-" + re.sub(r"[^a-zA-Z0-9.-]", lambda c: f".{ord(c[0]):x}.", name)


def bill(name, version, architecture, linked, headers, static, beside, database):
    """The document, but for when and as what it was made."""
    ours = spdx_id(name)
    product = entry(name, None) | {
        "versionInfo": version, "supplier": "Organization: The Birdseye authors", "licenseConcluded": "Apache-2.0",
        "licenseDeclared": "Apache-2.0", "copyrightText": "2026 The Birdseye authors", "primaryPackagePurpose": "APPLICATION",
        "externalRefs": [locator(f"pkg:generic/{name}@{version}?arch={architecture}")]}
    relations = [("SPDXRef-DOCUMENT", "DESCRIBES", ours)]
    relations += [(spdx_id(by) if by else ours, "DYNAMIC_LINK", spdx_id(of)) for by, of in linked]
    relations += [(ours, "STATIC_LINK", spdx_id(of)) for of in static]
    relations += [(spdx_id(of), "BUILD_DEPENDENCY_OF", ours) for of in headers - static]
    relations += [(ours, "DEPENDS_ON", spdx_id(of)) for of in beside]
    others = {of for _, of in linked} | headers | static | set(beside)
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
            "name": f"{name}-{version}-{architecture}",
            "comment": "Versions are those that the program was built with. Libraries are Debian's shared ones: Debian's security "
                       "updates replace them without a new build, but for what is STATIC_LINK or BUILD_DEPENDENCY_OF.",
            "packages": [product, *(entry(other, database.facts.get(other)) for other in sorted(others))],
            "relationships": [{"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b}
                              for a, kind, b in sorted(relations)]}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for option in ("--program", "--version", "--architecture", "--ninja"):
        parser.add_argument(option, required=True)
    parser.add_argument("--depends", default="", help="packages needed beside libraries, separated by commas")
    parser.add_argument("--sysroot", default="")
    given = parser.parse_args()
    program, database = pathlib.Path(given.program), Database(given.sysroot)
    headers, static = compiled_in(program, given.ninja, database)
    beside = re.findall(r"[^, ]+", given.depends)
    document = bill(program.name, given.version, given.architecture, links(program, database), headers, static, beside,
                    database)
    # The same materials have the same name wherever and whenever the bill is written.
    document["documentNamespace"] = "urn:uuid:" + str(uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(document)))
    when = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", time.time())), datetime.timezone.utc)
    document["creationInfo"] = {"created": when.strftime("%Y-%m-%dT%H:%M:%SZ"),
                                "creators": ["Organization: The Birdseye authors", f"Tool: birdseye-bill.py-{given.version}"]}
    json.dump(document, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
