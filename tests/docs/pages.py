#!/usr/bin/env python3
"""Tells what is wrong with the pages: links that lead nowhere, pages that the manual's index does not name once, decisions
that are not numbered from 1 on or lack a part, pages of the service's package that link to one that it lacks. usage: pages.py [SOURCE_DIR]"""
import pathlib
import re
import sys

LINK = re.compile(r"\]\(([^)\s]+)\)")


def anchors(page):
    found = set()
    for title in re.findall(r"^#+ (.*)", page.read_text(), re.M):
        text = re.sub(r"[`*]", "", title).lower()
        found.add(re.sub(r"[^\w\- ]", "", text).strip().replace(" ", "-"))
    return found


def links(root):
    pages = [*sorted(root.glob("*.md")), *sorted((root / "docs").rglob("*.md"))]
    for page in pages:
        for target in LINK.findall(page.read_text()):
            if re.match(r"\w+:", target):
                continue
            path, _, anchor = target.partition("#")
            file = (page.parent / path).resolve() if path else page
            if not file.exists():
                yield f"{page.relative_to(root)}: {target}: no such file"
            elif anchor and file.suffix == ".md" and anchor not in anchors(file):
                yield f"{page.relative_to(root)}: {target}: no such heading"


def index(root):
    page = root / "docs/manual/index.md"
    named = [(page.parent / target.partition("#")[0]).resolve() for target in LINK.findall(page.read_text())]
    for other in sorted((root / "docs").rglob("*.md")):
        if other == page or other.parent.name == "decisions":
            continue
        if named.count(other) != 1:
            yield f"docs/manual/index.md: names {other.relative_to(root)} {named.count(other)} times, not once"


def decisions(root):
    for number, page in enumerate(sorted((root / "docs/decisions").glob("*.md")), 1):
        text = page.read_text()
        if not page.name.startswith(f"{number:04d}-") or not text.startswith(f"# {number}. "):
            yield f"docs/decisions/{page.name}: is not number {number}"
        for part in ("Context", "Decision", "Consequences"):
            if f"\n**{part}.** " not in text:
                yield f"docs/decisions/{page.name}: has no {part}"


def packaged(root):
    packing = root / "packaging/birdseyed.cmake"
    if not packing.exists():
        return  # the manual as it is installed
    listed = re.search(r"foreach\(page ([^)]*)\)", packing.read_text()).group(1)
    pages = [(root / "docs" / name).resolve() for name in listed.split()]
    for page in (page for page in pages if page.suffix == ".md"):
        for target in LINK.findall(page.read_text()):
            path = target.partition("#")[0]
            if path and not re.match(r"\w+:", target) and (page.parent / path).resolve() not in pages:
                yield f"{page.relative_to(root)}: {target}: not in the package birdseyed, which has this page"


def faults(root):
    return [*links(root), *index(root), *decisions(root), *packaged(root)]


if __name__ == "__main__":
    told = faults(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve())
    print("\n".join(told))
    sys.exit(bool(told))
