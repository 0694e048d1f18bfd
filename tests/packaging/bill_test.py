#!/usr/bin/env python3
"""The bill of materials in each of our packages is valid SPDX 2.3 and names what the package stands on.
usage: bill_test.py FOLDER of packages"""
import io
import json
import pathlib
import re
import subprocess
import sys
import tarfile

# What a bill must have and must not: libraries at the end of a chain, static ones, headers.
KNOWN = {
    "birdseyed": {"has": {("DYNAMIC_LINK", "libssl3"), ("DYNAMIC_LINK", "liblzma5"), ("DEPENDS_ON", "procps"), ("BUILD_DEPENDENCY_OF", "libcli11-dev")},
                  "lacks": {"libgdcm3.0", "libdcmtk17", "libinsighttoolkit5.2", "libopencv-core406"}},
    "birdseye": {"has": {("DYNAMIC_LINK", "libgdcm3.0"), ("DYNAMIC_LINK", "libdcmtk17"), ("DYNAMIC_LINK", "libopenjp2-7"), ("DYNAMIC_LINK", "libhdf5-103-1"),
                         ("STATIC_LINK", "libceres-dev"), ("STATIC_LINK", "libimgui-dev"), ("DEPENDS_ON", "ffmpeg"),
                         ("BUILD_DEPENDENCY_OF", "libeigen3-dev"), ("BUILD_DEPENDENCY_OF", "nlohmann-json3-dev")}, "lacks": set()},
    "birdseye-sim": {"has": {("DYNAMIC_LINK", "libembree3-3"), ("STATIC_LINK", "libceres-dev")}, "lacks": set()},
}
PACKAGE_FIELDS = ("name", "SPDXID", "downloadLocation", "licenseConcluded", "licenseDeclared", "copyrightText", "versionInfo", "supplier")


def provided():
    """The names beside its own that a package of this machine may be asked for by, as liblapack.so.3."""
    lines = subprocess.run(["dpkg-query", "-W", "-f=${Package} ${Provides}\n"], check=True, stdout=subprocess.PIPE, text=True).stdout
    return {line.split()[0]: re.findall(r"(?:^|, )([^ ,]+)", line.partition(" ")[2]) for line in lines.splitlines()}


PROVIDED = provided()


def faults(bill, name, version, depends):
    for key, value in {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT"}.items():
        if bill.get(key) != value:
            yield f"{key} is {bill.get(key)}, not {value}"
    if not bill.get("name") or not re.fullmatch(r"[a-z]+:[^#\s]+", bill.get("documentNamespace", "")):
        yield "has no name or no namespace"
    made = bill.get("creationInfo", {})
    if not re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", made.get("created", "")):
        yield f"was created at {made.get('created')}"
    if not made.get("creators") or not all(re.match(r"(Tool|Organization|Person): \S", who) for who in made["creators"]):
        yield f"was created by {made.get('creators')}"

    packages = bill.get("packages", [])
    by_id = {package.get("SPDXID"): package.get("name") for package in packages}
    if len(by_id) != len(packages):
        yield "has two packages of one SPDXID"
    for package in packages:
        lacks = [field for field in PACKAGE_FIELDS if not package.get(field)]
        # Of a package that is needed beside libraries and is not on the machine that built, the name alone is known.
        if lacks and not (set(lacks) == {"versionInfo", "supplier"} and package["name"] in depends):
            yield f"{package.get('name')}: lacks {', '.join(lacks)}"
        if package.get("filesAnalyzed") is not False:
            yield f"{package.get('name')}: does not say that its files were not analysed"
        if not re.fullmatch(r"SPDXRef-[a-zA-Z0-9.-]+", package.get("SPDXID", "")):
            yield f"{package.get('name')}: {package.get('SPDXID')} is no SPDXID"

    relations = [(r["spdxElementId"], r["relationshipType"], r["relatedSpdxElement"]) for r in bill.get("relationships", [])]
    for a, _, b in relations:
        yield from (f"{unknown}: stands in a relationship and is no package" for unknown in (a, b) if unknown not in {*by_id, "SPDXRef-DOCUMENT"})
    described = [by_id.get(b) for a, kind, b in relations if (a, kind) == ("SPDXRef-DOCUMENT", "DESCRIBES")]
    if described != [name] or version not in [p.get("versionInfo") for p in packages if p.get("name") == name]:
        yield f"describes {described}, not {name} {version}"
    known = {(kind, by_id.get(a if kind == "BUILD_DEPENDENCY_OF" else b)) for a, kind, b in relations}
    yield from (f"{other}: is in no relationship" for other in by_id.values() if other not in {about for _, about in known})

    loaded = {by_id.get(b) for _, kind, b in relations if kind in ("DYNAMIC_LINK", "DEPENDS_ON")}
    loaded |= {virtual for real in loaded for virtual in PROVIDED.get(real, ())}
    for choice in depends:
        if not set(choice.split("|")) & loaded:
            yield f"{choice}: the package depends on it, and the bill does not name it"
    yield from (f"{kind} {about}: is not in it" for kind, about in KNOWN[name]["has"] - known)
    yield from (f"{about}: is in it" for about in KNOWN[name]["lacks"] & set(by_id.values()))


def field(deb, name):
    return subprocess.run(["dpkg-deb", "-f", deb, name], check=True, stdout=subprocess.PIPE, text=True).stdout.strip()


def main():
    debs, wrong = sorted(pathlib.Path(sys.argv[1]).glob("birdseye*.deb")), 0
    for deb in debs:
        name, version = field(deb, "Package"), field(deb, "Version")
        depends = {re.sub(r" |\(.*?\)", "", choice) for choice in field(deb, "Depends").split(",")}
        files = subprocess.run(["dpkg-deb", "--fsys-tarfile", deb], check=True, stdout=subprocess.PIPE).stdout
        with tarfile.open(fileobj=io.BytesIO(files)) as tar:
            text = tar.extractfile(f"./usr/share/doc/{name}/{name}.spdx.json").read().decode()
        told = list(faults(json.loads(text), name, version, depends))
        print(*(f"{deb.name}: {fault}" for fault in told), sep="\n", end="\n" if told else "")
        print(f"{deb.name}: {text.count('SPDXID') - 1} packages in its bill")
        wrong += len(told)
    sys.exit(bool(wrong) or not debs)


if __name__ == "__main__":
    main()
