#!/usr/bin/env python3
"""exposure_test.py UNIT PAGE: systemd-analyze finds the appliance's service exposed by no more than 1.2 (of 10), and PAGE says of each
thing that it still finds fault with why it is so. Skipped where there is no systemd-analyze."""

import json
import re
import shutil
import subprocess
import sys

MOST_TENTHS = 12


def analyze(unit, *options):
    return subprocess.run(["systemd-analyze", "security", "--offline=true", "--no-pager", *options, unit],
                          capture_output=True, text=True, env={"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8"})


def explained_in(page):
    """What the first column of the page's table names."""
    names = set()
    for line in page.splitlines():
        if line.startswith("| `"):
            first = re.split(r"(?<!\\)\|", line)[1]
            names |= set(re.findall(r"`([^`]+)`", first.replace("\\|", "|")))
    return names


def main(unit, page):
    if shutil.which("systemd-analyze") is None:
        print("exposure_test: no systemd-analyze here; skipped")
        return 77
    table = analyze(unit, "--json=short")
    if not table.stdout.startswith("["):
        print(f"exposure_test: systemd-analyze says {table.stdout}{table.stderr}")
        return 1
    # "exposure" is null where nothing is found fault with.
    faults = {row["name"] for row in json.loads(table.stdout) if row["exposure"]}
    with open(page, encoding="utf-8") as file:
        explained = explained_in(file.read())
    found = 0
    for name in sorted(faults - explained):
        print(f"exposure_test: {page} does not say why {name} is so")
        found = 1
    for name in sorted(explained - faults):
        print(f"exposure_test: {page} explains {name}, which systemd-analyze does not find fault with")
        found = 1
    last = analyze(unit).stdout.strip().splitlines()[-1]
    if analyze(unit, f"--threshold={MOST_TENTHS}").returncode != 0:
        print(f"exposure_test: over {MOST_TENTHS / 10}: {last}")
        found = 1
    print(f"{last}; {len(faults)} things left over")
    return found


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
