#!/usr/bin/env python3
"""Breaks every rule of trace.py in a small tree of its own, and sees it told."""
import contextlib
import io
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).parent))
import trace

HELD = """id = "OVL-01"
requirement = "Nothing is drawn by a record that was withdrawn."
hazard = "wrong overlay"
situation = "The camera is exchanged."
harm = "A vessel is cut."
severity = "critical"
control = "The overlay goes."
tests = ["Overlay.Goes"]
"""
OPEN = """id = "OVL-40"
requirement = "A zoom | is seen."
hazard = "wrong overlay"
situation = "The ring is turned."
harm = "A vessel is cut."
severity = "serious"
control = "none yet"
instead = "Fix the ring."
"""
FIRST, SECOND = "docs/requirements/wrong-overlay/first.toml", "docs/requirements/wrong-overlay/second.toml"


def of_hazard(hazard, prefix):
    return HELD.replace("wrong overlay", hazard).replace("OVL", prefix)


TREE = {
    FIRST: HELD,
    SECOND: OPEN,
    "docs/requirements/loss-of-data/data.toml": of_hazard("loss of data", "DAT"),
    "docs/requirements/loss-of-service/service.toml": of_hazard("loss of service", "SRV"),
    "docs/requirements/disclosure/disclosure.toml": of_hazard("disclosure", "DIS"),
    "tests/CMakeLists.txt": "birdseye_test(all_test\n  SOURCES a_test.cpp part/b_test.cpp\n  PRIVATE lib)\n"
                            "add_executable(apart_test apart_test.cpp)\nadd_test(NAME package COMMAND package_test.sh)\n",
    "tests/a_test.cpp": "TEST(Overlay, Goes) {}\nTEST(Overlay, DISABLED_Stays) {}\n/*\nTEST(Overlay, WasThere) {}\n*/\n"
                        "// TEST(Overlay, IsARemark) {}\n",
    "tests/part/b_test.cpp": "TEST_F(Long,\n       NamedTest) {}\nTEST_P(Each, Runs) {}\nTEST_P(None, Runs) {}\n"
                             "INSTANTIATE_TEST_SUITE_P(All, Each, Values(1));\n",
    "tests/apart_test.cpp": "TEST(Apart, Runs) {}\n",
    "tests/unbuilt_test.cpp": "TEST(Unbuilt, Runs) {}\n",
    "docs/manual/lies.md": "| what was done | says | error | ends | by |\n|---|---|---|---|---|\n"
                           "| a mirror | mirror image | - | never drawn | - |\n| a zoom | - | 3 mm | not seen | nothing |\n",
    "docs/manual/faults.md": "| fault | how | seen |\n|---|---|---|\n| tracker unplug | 1 s | STATUS |\n"
                             "| metal | 1 s | **Not seen**: one sensor |\n",
    "docs/manual/inputs.md": "## record\n\n| | input | expected | what happened | s |\n|---|---|---|---|---|\n"
                             "| odd | a full folder: `birdseye record` | refused | 2 | 0 |\n"
                             "| odd | a crash: `birdseye record` | refused | 139 **NOT AS EXPECTED: exit** | 0 |\n"
                             "| odd | a fish: `birdseye record` | refused | not run: no fish | |\n",
}


class Trace(unittest.TestCase):
    def run_in(self, changes, *arguments):
        """The exit code, what is printed and the page, of a tree with these changes; a page that is asked for is written first."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder).resolve()
            for name, text in {**TREE, **changes}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                if text is not None:
                    (root / name).write_text(text)
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                code = trace.main([*arguments, folder])
            page = root / "docs/manual/trace.md"
            return code, said.getvalue().strip(), page.read_text() if page.exists() else ""

    def told(self, changes):
        code, said, _ = self.run_in(changes, "--write")
        self.assertEqual(bool(code), bool(said))
        return said

    def citing(self, *names):
        return {FIRST: HELD.replace('["Overlay.Goes"]', "[" + ", ".join(f'"{name}"' for name in names) + "]")}

    def test_a_sound_tree(self):
        self.assertEqual(self.told({}), "")
        for names in (["Long.NamedTest"], ["Each.Runs"], ["package"], ["lies: a mirror"], ["inputs: record: a full folder"],
                      ["Overlay.Goes", "Apart.Runs", "faults: tracker unplug"]):
            self.assertEqual(self.told(self.citing(*names)), "", names)

    def test_each_rule(self):
        without = lambda key: {FIRST: "".join(line + "\n" for line in HELD.splitlines() if not line.startswith(key + " "))}
        changed = lambda old, new: {FIRST: HELD.replace(old, new)}
        opened = lambda old, new: {SECOND: OPEN.replace(old, new)}
        for changes, fault in [
            (without("tests"), 'tests: has a control and no test; a test holds it, or the control is "none yet"'),
            (self.citing(), 'tests: has a control and no test; a test holds it, or the control is "none yet"'),
            (changed('["Overlay.Goes"]', '"Overlay.Goes"'), 'tests: has a control and no test'),
            (self.citing("Overlay.Gone"), "tests: Overlay.Gone: there is no such test or row"),
            (self.citing("Overlay.WasThere"), "tests: Overlay.WasThere: there is no such test or row"),
            (self.citing("Overlay.IsARemark"), "tests: Overlay.IsARemark: there is no such test or row"),
            (self.citing("Overlay.DISABLED_Stays"), "tests: Overlay.DISABLED_Stays: it is disabled"),
            (self.citing("None.Runs"), "tests: None.Runs: no INSTANTIATE_TEST_SUITE_P runs it"),
            (self.citing("Unbuilt.Runs"), "tests: Unbuilt.Runs: tests/unbuilt_test.cpp is in no test program"),
            (self.citing("packaging"), "tests: packaging: there is no such test or row"),
            (self.citing("lies: a miracle"), "tests: lies: a miracle: there is no such test or row"),
            (self.citing("lies: what was done"), "tests: lies: what was done: there is no such test or row"),
            (self.citing("lies: a zoom"), "tests: lies: a zoom: nothing sees it"),
            (self.citing("Overlay.Goes", "faults: metal"), "tests: faults: metal: nothing sees it"),
            (self.citing("inputs: record: a crash"), "tests: inputs: record: a crash: what happens is not what is expected"),
            (self.citing("inputs: record: a fish"), "tests: inputs: record: a fish: what happens is not what is expected"),
            (self.citing("inputs: replay: a full folder"), "tests: inputs: replay: a full folder: there is no such test or row"),
            (self.citing("Overlay.Goes", "Overlay.Goes"), "tests: Overlay.Goes: stands twice"),
            (self.citing("Apart.Runs", "faults: tracker unplug"), "tests: neither ./run test nor ./run studies runs one of them"),
            (without("control"), "control: is missing"),
            (changed('"The overlay goes."', '""'), "control: needs words"),
            (without("harm"), "harm: is missing"),
            (changed("harm = ", "harms = "), "harms: unknown key; known are id, requirement, hazard"),
            (changed("wrong overlay", "bad luck"), "hazard: 'bad luck' is none of wrong overlay, loss of data"),
            (changed("wrong overlay", "disclosure"), "hazard: disclosure: its folder is wrong-overlay"),
            (changed("critical", "dire"), "severity: 'dire' is none of negligible, minor"),
            (changed("OVL-01", "DAT-01"), "id: DAT-01: needs OVL- and two digits"),
            (changed("OVL-01", "OVL-1"), "id: OVL-1: needs OVL- and two digits"),
            ({SECOND: OPEN.replace("OVL-40", "OVL-01")}, f"id: OVL-01: is that of {FIRST} too"),
            (changed("tests =", 'instead = "Hope."\ntests ='), "instead: is of what has no control yet"),
            (opened('instead = "Fix the ring."\n', ""), "instead: is missing: what is done instead"),
            (opened("instead =", 'tests = ["Overlay.Goes"]\ninstead ='), "tests: nothing is held before there is a control"),
            (opened("instead =", 'remains = "Little."\ninstead ='), "remains: nothing is held before there is a control"),
            (changed("id =", "id"), "Expected '=' after a key"),
            ({"docs/requirements/notes.txt": "later"}, "docs/requirements/notes.txt: is no .toml"),
            ({"docs/requirements/disclosure/disclosure.toml": None}, "docs/requirements: nothing is required of the hazard 'disclosure'"),
        ]:
            said = self.told(changes)
            self.assertIn(fault, said)
            self.assertTrue(said.startswith("docs/requirements"), said)

    def test_the_page(self):
        code, said, page = self.run_in({}, "--write")
        self.assertEqual((code, said), (0, ""))
        self.assertIn("5 requirements: 4 are held, by 1 tests and rows; 1 are open.", page)
        head, _, tables = page.partition("## Known and open")
        self.assertNotIn("OVL-", head)
        left, _, held = tables.partition("## Wrong overlay")
        self.assertIn("| OVL-40 | A zoom \\| is seen. | The ring is turned. A vessel is cut. | serious | Fix the ring. |", left)
        self.assertNotIn("OVL-01", left)
        self.assertIn("| critical | The overlay goes. | `Overlay.Goes` |", held)
        self.assertNotIn("OVL-40", held)
        starred = self.run_in(self.citing("Overlay.Goes", "Apart.Runs", "lies: a mirror"), "--write")[2]
        self.assertIn("<br>`Apart.Runs`\\*<br>[lies](lies.md): a mirror |", starred)

    def test_a_page_that_is_out_of_date_or_missing(self):
        page = self.run_in({}, "--write")[2]
        self.assertEqual(self.run_in({"docs/manual/trace.md": page}), (0, "", page))
        out_of_date = "docs/manual/trace.md: is out of date; ./run trace writes it"
        for changes in ({}, {"docs/manual/trace.md": page, SECOND: OPEN.replace("Fix", "Glue")},
                        {"docs/manual/trace.md": page + "\n"}):
            self.assertEqual(self.run_in(changes)[:2], (1, out_of_date))

    def test_what_is_wrong_writes_no_page(self):
        code, _, page = self.run_in({**self.citing("Overlay.Gone"), "docs/manual/trace.md": "former"}, "--write")
        self.assertEqual((code, page), (1, "former"))


if __name__ == "__main__":
    unittest.main()
