#!/usr/bin/env python3
"""Holds the judge of inputs to what it must find: each thing that may happen otherwise than expected, one at a time."""
import dataclasses
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).parent))
import page
import running
from judge import KINDS, Outcome, Row, faults
from rows import all_rows

REFUSAL = Row("volume info", "wrong", "an empty file", "refused", "birdseye volume info x", 2, says=["x: is empty"])
RESULT = Row("calibrate tip", "good", "a table", "pass", "birdseye calibrate tip", 0, verdict="pass", writes=["tip.txt"])
REFUSED = Outcome(2, "birdseye: x: is empty\n", "birdseye: x: is empty\n", [], [], 0.1, 80)
DONE = Outcome(0, "verdict: pass\n", "", ["tip.txt"], [], 0.1, 80)


class Judge(unittest.TestCase):
    def test_what_is_expected(self):
        self.assertEqual(faults(REFUSAL, REFUSED), [])
        self.assertEqual(faults(RESULT, DONE), [])

    def test_each_thing_that_is_not(self):
        for row, outcome, changes, fault in [
            (RESULT, DONE, {"exit": None}, "did not end"),
            (RESULT, DONE, {"exit": 3}, "exit code 3, not 0"),
            (RESULT, DONE, {"output": "verdict: marginal\n"}, "verdict marginal, not pass"),
            (RESULT, DONE, {"output": ""}, "verdict none, not pass"),
            (RESULT, DONE, {"files": []}, "tip.txt is not written"),
            (RESULT, DONE, {"files": ["tip.txt", "core"]}, "core is left behind"),
            (RESULT, DONE, {"files": [], "empty_files": ["tip.txt"]}, "tip.txt is not written"),
            (RESULT, DONE, {"figures": "off by 3 mm"}, "off by 3 mm"),
            (RESULT, DONE, {"output": "verdict: pass\nterminate called after"}, "says what a library says: terminate called"),
            (REFUSAL, REFUSED, {"exit": -11}, "exit code -11, not 2"),
            (REFUSAL, REFUSED, {"output": "birdseye: y\n"}, "does not say /x: is empty/"),
            (REFUSAL, REFUSED, {"errors": ""}, "refused without a word"),
            (REFUSAL, REFUSED, {"errors": "x: is empty\n"}, "no line of the refusal begins with the program's name"),
            (REFUSAL, REFUSED, {"errors": "birdseye: x\n" * 13}, "refused in 13 lines"),
            (REFUSAL, REFUSED, {"most_mb": 600}, "refused with 600 MB"),
            (REFUSAL, REFUSED, {"files": ["half.nii"]}, "half.nii is left behind"),
        ]:
            self.assertEqual(faults(row, dataclasses.replace(outcome, **changes)), [fault])

    def test_running(self):
        """A row's own files, what is left behind, and figures that cannot be read are seen."""
        row = Row("none", "wrong", "none", "none", "echo birdseye: no >&2; touch b; echo 1 > c; exit 2", 2,
                  make=lambda folder: (folder / "a").write_text("a"), check=lambda folder, _: (folder / "d").read_text())
        with tempfile.TemporaryDirectory() as programs:
            outcome = running.run(row, Path(programs), None)
        self.assertEqual((outcome.exit, outcome.files, outcome.empty_files, outcome.errors), (2, ["c"], ["b"], "birdseye: no\n"))
        self.assertIn("the figures cannot be read", outcome.figures)

    def test_the_page_names_no_folder_of_this_run(self):
        said = f"birdseye: {page.data_folder()}/hostile/x and /tmp/inputs-ab_1/work/y: no\n"
        table = page.table([(REFUSAL, dataclasses.replace(REFUSED, output=said, errors=said), [])])
        self.assertIn("hostile/x and y: no", table)
        self.assertNotIn("/work/", table)

    def test_the_rows(self):
        """Each kind is a quarter at least, no row stands twice, and a row on public recordings names them."""
        rows = all_rows()
        for kind in KINDS:
            self.assertGreaterEqual(sum(row.kind == kind for row in rows), len(rows) / 4, kind)
        self.assertEqual(len({(row.command, row.input) for row in rows}), len(rows))
        self.assertEqual([row.input for row in rows if "$DATA" in row.run and not row.data], [])


if __name__ == "__main__":
    unittest.main()
