#!/usr/bin/env python3
"""Plants the defects of rows.py in a copy of the tree, one at a time, and tells which tests and which campaigns find each.
usage: mutants.py --copy FOLDER --results FILE [--only TEXT] [--seeds 1:8] [--minutes 10] [--page FILE]
  --copy     a worktree of the commit that is checked out; it is made there, and built, where it is not
  --results  a line of JSON for each defect; what it has already is not done again, so a run that was cut goes on
  --only     defects whose id has this text in it
  --page     writes what was found as a page
The tree without a defect is looked at first: where it does not pass, nothing is planted.
Exit codes: 1 something is amiss, 3 too few were found."""
import argparse
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from mutants_page import page_of, sums_of, words_of
from rows import MUTANTS

ROOT = pathlib.Path(__file__).resolve().parents[2]
LEAST_BY_CAMPAIGN, LEAST_BY_ANY = 24, 29
BROKEN, PATIENCE_S = 3, 1800  # the exit code that says that a law broke; how long a campaign may take
SIMULATOR = "birdseye-sim"


class Fault(Exception):
    """Why nothing can be said of a defect."""


def run(command, folder, **more):
    try:
        return subprocess.run([str(part) for part in command], cwd=folder, text=True, errors="replace",
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more)
    except FileNotFoundError as missing:
        raise Fault(f"{missing.filename}: is not there; install it") from None


def must(command, folder):
    done = run(command, folder)
    if done.returncode != 0:
        raise Fault(f"{' '.join(map(str, command))} (in {folder}) failed:\n{done.stdout[-2000:]}")
    return done.stdout.strip()


class Copy:
    """The tree of a commit in a folder of its own, where defects are planted."""

    def __init__(self, folder, commit):
        self.folder, self.build = folder, folder / "build/release"
        if folder == ROOT:
            raise Fault(f"{folder}: is the tree itself; give --copy another folder")
        if not folder.exists():
            must(["git", "worktree", "add", "--detach", folder, commit], ROOT)
        top = run(["git", "rev-parse", "--path-format=absolute", "--show-toplevel", "--git-common-dir"], folder)
        ours = must(["git", "rev-parse", "--path-format=absolute", "--git-common-dir"], ROOT)
        if top.returncode != 0 or top.stdout.split("\n")[:2] != [str(folder), ours]:
            raise Fault(f"{folder}: is there, and is no worktree of {ROOT}; give --copy another folder")
        must(["git", "checkout", "--quiet", "--force", "--detach", commit], folder)  # and a defect that was left is out
        if not (self.build / "build.ninja").exists():
            must(["cmake", "--preset", "release"], folder)

    def make(self, targets):
        """Why it does not build; nothing where it does."""
        made = run(["ninja", "-C", self.build, "-j2", SIMULATOR, *sorted(set(targets))], self.folder)
        return "" if made.returncode == 0 else made.stdout[-2000:]

    def campaign(self, seeds, minutes):
        """Of each seed that broke a law, which ones."""
        with tempfile.TemporaryDirectory() as out:
            try:
                done = run([self.build / "bin" / SIMULATOR, "campaign", "--seeds", seeds, "--minutes", minutes, "--out", out],
                           self.folder, timeout=PATIENCE_S)
            except subprocess.TimeoutExpired:
                return {"any": ["does not end"]}
        if done.returncode not in (0, BROKEN):
            raise Fault(f"the campaign ended with {done.returncode}:\n{done.stdout[-2000:]}")
        found = {}
        for seed, what in re.findall(r"^seed (\d+): (.*)$", done.stdout, re.MULTILINE) if done.returncode else []:
            found[seed] = sorted(set(re.findall(r"(?:^|; )(?:[\d.]+ s )?([a-z]+): ", what)))
        if done.returncode == BROKEN and not found:
            raise Fault(f"the campaign says that laws broke, and not of which seed:\n{done.stdout[-2000:]}")
        return found

    def tests(self, which):
        """The tests that fail, of those that the regular expression names."""
        with tempfile.TemporaryDirectory() as out:
            report = pathlib.Path(out) / "report.xml"
            done = run(["ctest", "--test-dir", self.build, "-j2", "-R", which, "--no-tests=error", "--output-junit", report],
                       self.folder)
            if not report.exists():
                raise Fault(f"ctest -R '{which}' ran nothing:\n{done.stdout[-2000:]}")
            cases = list(xml.etree.ElementTree.parse(report).iter("testcase"))
        if not any(case.get("status") in ("run", "fail") for case in cases):
            raise Fault(f"ctest -R '{which}' found no test that runs")
        return sorted(case.get("name") for case in cases if case.get("status") == "fail")


def planted(copy, mutant, seeds, minutes):
    """What comes of the copy with the defect in it; it is taken out again."""
    file = copy.folder / mutant.file
    text = file.read_text() if file.exists() else ""
    if text.count(mutant.old) != 1:
        return {"why": f"its old text is in {mutant.file} {text.count(mutant.old)} times, not once; mend its row"}
    file.write_text(text.replace(mutant.old, mutant.new))
    try:
        if why := copy.make(mutant.targets):
            return {"why": f"it does not build\n{why}"}
        return {"campaign": copy.campaign(seeds, minutes), "tests": copy.tests(mutant.tests)}
    except Fault as fault:
        return {"why": str(fault)}
    finally:
        file.write_text(text)


def check_unchanged(copy, chosen, seeds, minutes):
    if why := copy.make([target for mutant in chosen for target in mutant.targets]):
        raise Fault(f"the tree does not build as it is:\n{why}")
    if broken := copy.campaign(seeds, minutes):
        raise Fault(f"the tree breaks laws as it is: {broken}")
    for which in sorted({mutant.tests for mutant in chosen}):
        if failed := copy.tests(which):
            raise Fault(f"the tree fails tests as it is: {', '.join(failed)}")
    return {"campaign": {}, "tests": []}


def read_results(file):
    """By key, the newest of each. A line that was cut is none, and what was not judged is judged again."""
    results = {}
    for line in file.read_text().splitlines() if file.exists() else []:
        try:
            result = json.loads(line)
            if "why" not in result:
                results[result["key"]] = result
        except (ValueError, KeyError, TypeError):
            continue
    return results


def key_of(parts):
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()[:16]


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--copy", type=lambda text: pathlib.Path(text).resolve(), required=True)
    options.add_argument("--results", type=pathlib.Path, required=True)
    options.add_argument("--page", type=pathlib.Path)
    options.add_argument("--only", default="")
    options.add_argument("--seeds", default="1:8")
    options.add_argument("--minutes", default="10")
    given = options.parse_args()
    chosen = [mutant for mutant in MUTANTS if given.only in mutant.id]
    if not chosen:
        raise Fault(f"no defect has \"{given.only}\" in its id; they are {', '.join(mutant.id for mutant in MUTANTS)}")
    commit = must(["git", "rev-parse", "HEAD"], ROOT)
    of_run = (commit, given.seeds, given.minutes)
    keys = {mutant: key_of((*of_run, mutant.id, mutant.file, mutant.old, mutant.new, mutant.tests)) for mutant in chosen}
    unchanged = key_of((*of_run, "unchanged", *sorted({mutant.tests for mutant in chosen})))
    results = read_results(given.results)

    def enter(key, name, work):
        began = time.monotonic()
        result = {"key": key, "id": name, **work(), "seconds": round(time.monotonic() - began)}
        given.results.parent.mkdir(parents=True, exist_ok=True)
        with given.results.open("a") as file:
            file.write("\n" * (file.tell() > 0) + json.dumps(result))
        results[key] = result
        print(f"{name}: {result['seconds']} s; campaign: {words_of(result)}; tests: {', '.join(result.get('tests', [])) or '-'}",
              flush=True)

    if any(key not in results for key in keys.values()):
        copy = Copy(given.copy, commit)
        if unchanged not in results:
            enter(unchanged, "unchanged", lambda: check_unchanged(copy, chosen, given.seeds, given.minutes))
        for mutant, key in keys.items():
            if key not in results:
                enter(key, mutant.id, lambda: planted(copy, mutant, given.seeds, given.minutes))
    found = [(mutant, results[key]) for mutant, key in keys.items()]
    sums, by_campaign, by_any = sums_of(found)
    print("\n".join(sums))
    if given.page:
        title = f"Commit {commit[:12]}, campaigns of seeds {given.seeds}, {given.minutes} minutes each."
        given.page.write_text(page_of(found, sums, title))
    whole = len(found) == len(MUTANTS)
    return BROKEN if whole and (by_campaign < LEAST_BY_CAMPAIGN or by_any < LEAST_BY_ANY) else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Fault as fault:
        sys.exit(f"mutants.py: {fault}")
