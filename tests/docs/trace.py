#!/usr/bin/env python3
"""Reads the requirements (docs/requirements, a file each) and tells what is wrong with them: one without a control, a control
without a test, a test that is not there or does not run, a page that is out of date. usage: trace.py [--write] [SOURCE_DIR]
  --write  writes the page, docs/manual/trace.md"""
import pathlib
import re
import sys
import tomllib

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).parent))
import trace_page

HAZARDS = {"wrong overlay": "OVL", "loss of data": "DAT", "loss of service": "SRV", "disclosure": "DIS"}
SEVERITIES = ("negligible", "minor", "serious", "critical", "catastrophic")  # of ISO 14971's guidance, TR 24971
OPEN = "none yet"
TEXTS = ("id", "requirement", "hazard", "situation", "harm", "severity", "control")
OPTIONAL = ("remains", "instead", "tests")


def cells(line):
    return [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


class Evidence:
    """What may be cited: the tests of the tree and the rows of the manual's pages that tests write."""

    def __init__(self, root):
        self.places = {}  # of each name the file, from the root
        self.apart = set()  # what neither ./run test nor ./run studies runs
        self.useless = {}  # what is there and holds nothing, and why
        self._tests(root)
        for page, read in (("lies", self._lie), ("faults", self._fault), ("inputs", self._input)):
            file = root / f"docs/manual/{page}.md"
            lines = file.read_text().splitlines() if file.exists() else []
            command = ""
            for line, below in zip(lines, [*lines[1:], ""]):
                command = line[3:] if line.startswith("## ") else command
                if not line.startswith("| ") or below.startswith("|-"):
                    continue
                name, why = read(cells(line), command)
                self.places[name] = f"docs/manual/{page}.md"
                if why:
                    self.useless[name] = why
                if page == "faults":
                    self.apart.add(name)

    def _tests(self, root):
        sources, instantiated, parametrised = {}, set(), {}
        for file in sorted((root / "tests").rglob("CMakeLists.txt")):
            text = file.read_text()
            for maker, body in re.findall(r"\b(birdseye_test|add_executable)\(([^()]*)\)", text):
                for source in re.findall(r"[\w./-]+\.cpp", body):
                    sources.setdefault((file.parent / source).resolve(), set()).add(maker)
            for name in re.findall(r"\badd_test\(NAME (\w+)", text):
                self.places[name] = str(file.relative_to(root))
        for file in sorted((root / "tests").rglob("*.cpp")):
            text = re.sub(r"/\*.*?\*/|^#if 0\b.*?^#endif", "", file.read_text(), flags=re.S | re.M)
            instantiated |= set(re.findall(r"^INSTANTIATE_TEST_SUITE_P\(\s*\w+,\s*(\w+)", text, re.M))
            for kind, suite, test in re.findall(r"^TEST(_F|_P|)\(\s*(\w+),\s*(\w+)\s*\)", text, re.M):
                name = f"{suite}.{test}"
                self.places[name] = str(file.relative_to(root))
                makers = sources.get(file.resolve(), set())
                if not makers:
                    self.useless[name] = f"{file.relative_to(root)} is in no test program"
                elif "birdseye_test" not in makers:
                    self.apart.add(name)
                if "DISABLED_" in name:
                    self.useless[name] = "it is disabled"
                if kind == "_P":
                    parametrised[name] = suite
        for name, suite in parametrised.items():
            if suite not in instantiated:
                self.useless[name] = "no INSTANTIATE_TEST_SUITE_P runs it"

    @staticmethod
    def _lie(row, _):
        return f"lies: {row[0]}", "nothing sees it" if "not seen" in row else ""

    @staticmethod
    def _fault(row, _):
        return f"faults: {row[0]}", "nothing sees it" if "**Not seen**" in row[2] else ""

    @staticmethod
    def _input(row, command):
        expected = "NOT AS EXPECTED" not in row[3] and not row[3].startswith("not run")
        why = "" if expected else "what happens is not what is expected"
        return f"inputs: {command}: {row[1].partition(': `')[0]}", why


def faults_of_tests(tests, evidence):
    """Of what a requirement with a control cites."""
    if not isinstance(tests, list) or not tests or not all(isinstance(name, str) for name in tests):
        yield "tests: has a control and no test; a test holds it, or the control is \"none yet\""
        return
    for name in tests:
        if name not in evidence.places:
            yield f"tests: {name}: there is no such test or row"
        elif name in evidence.useless:
            yield f"tests: {name}: {evidence.useless[name]}"
        if tests.count(name) > 1:
            yield f"tests: {name}: stands twice"
    if all(name in evidence.apart for name in tests):
        yield "tests: neither ./run test nor ./run studies runs one of them"


def faults_of(one, folder, evidence):
    """What is wrong with a requirement by itself."""
    for key in one:
        if key not in (*TEXTS, *OPTIONAL):
            yield f"{key}: unknown key; known are {', '.join((*TEXTS, *OPTIONAL))}"
    for key in TEXTS:
        if key not in one:
            yield f"{key}: is missing"
    for key in (*TEXTS, "remains", "instead"):
        if key in one and not (isinstance(one[key], str) and one[key].strip()):
            yield f"{key}: needs words"
    hazard = one.get("hazard")
    if hazard is not None and hazard not in HAZARDS:
        yield f"hazard: {hazard!r} is none of {', '.join(HAZARDS)}"
    elif hazard is not None:
        if folder != hazard.replace(" ", "-"):
            yield f"hazard: {hazard}: its folder is {folder}"
        if not re.fullmatch(rf"{HAZARDS[hazard]}-\d\d", str(one.get("id", ""))):
            yield f"id: {one.get('id')}: needs {HAZARDS[hazard]}- and two digits"
    if "severity" in one and one["severity"] not in SEVERITIES:
        yield f"severity: {one['severity']!r} is none of {', '.join(SEVERITIES)}"
    if "control" not in one:
        return
    if one["control"] != OPEN:
        yield from faults_of_tests(one.get("tests"), evidence)
        if "instead" in one:
            yield "instead: is of what has no control yet"
        return
    if "instead" not in one:
        yield "instead: is missing: what is done instead, for there is no control yet"
    for key in ("tests", "remains"):
        if key in one:
            yield f"{key}: nothing is held before there is a control"


def read(root):
    """All requirements by their files, from the root; in place of one that is no TOML, what is wrong with it."""
    found = {}
    for file in sorted((root / "docs/requirements").rglob("*")):
        if file.is_dir():
            continue
        name = str(file.relative_to(root))
        try:
            found[name] = tomllib.loads(file.read_text()) if file.suffix == ".toml" else "is no .toml"
        except tomllib.TOMLDecodeError as error:
            found[name] = str(error)
    return found


def examine(root):
    """What is wrong, a line each, and the page as it should be, if it can be written."""
    evidence = Evidence(root)
    told, good, ids = [], [], {}
    for name, one in read(root).items():
        wrong = [one] if isinstance(one, str) else [*faults_of(one, pathlib.Path(name).parent.name, evidence)]
        if not wrong and (other := ids.setdefault(one["id"], name)) != name:
            wrong = [f"id: {one['id']}: is that of {other} too"]
        told += [f"{name}: {fault}" for fault in wrong]
        if not wrong:
            good.append(one)
    good.sort(key=lambda one: ([*HAZARDS].index(one["hazard"]), one["id"]))
    for hazard in HAZARDS:
        if not any(one["hazard"] == hazard for one in good):
            told.append(f"docs/requirements: nothing is required of the hazard {hazard!r}")
    return told, trace_page.page(good, HAZARDS, OPEN, evidence) if not told else None


def main(arguments):
    write = "--write" in arguments
    folders = [one for one in arguments if one != "--write"]
    root = pathlib.Path(folders[0] if folders else ".").resolve()
    told, page = examine(root)
    file = root / trace_page.PAGE
    if page and write:
        file.write_text(page)
    elif page and (not file.exists() or file.read_text() != page):
        told = [f"{trace_page.PAGE}: is out of date; ./run trace writes it"]
    for line in told:
        print(line)
    return bool(told)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
