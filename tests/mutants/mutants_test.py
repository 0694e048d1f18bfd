#!/usr/bin/env python3
"""That each defect can be planted in the tree as it is, and what is made of what was found."""
import dataclasses
import pathlib
import re
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import mutants
import mutants_page
from rows import MUTANTS

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Rows(unittest.TestCase):
    def test_each_applies_once(self):
        for mutant in MUTANTS:
            with self.subTest(mutant.id):
                file = ROOT / mutant.file
                self.assertTrue(file.is_file(), f"{mutant.file}: no such file")
                text = file.read_text()
                self.assertEqual(text.count(mutant.old), 1, f"how often its old text is in {mutant.file}")
                changed = text.replace(mutant.old, mutant.new)
                self.assertNotEqual(changed, text)
                self.assertLessEqual(max(map(len, changed.splitlines())), 120, "its lines are longer than the tree's")

    def test_each_differs_from_the_others(self):
        for of in (lambda m: m.id, lambda m: (m.file, m.old), lambda m: m.wrong):
            self.assertEqual(len({of(mutant) for mutant in MUTANTS}), len(MUTANTS))
        self.assertGreaterEqual(len(MUTANTS), 30)
        self.assertGreaterEqual(sum(mutant.campaign for mutant in MUTANTS), mutants.LEAST_BY_CAMPAIGN)

    def test_its_tests_are_there(self):
        names = [f"{suite}.{name}" for file in (ROOT / "tests").rglob("*.cpp")
                 for suite, name in re.findall(r"\bTEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\s*\)", file.read_text())]
        targets = {target for file in (ROOT / "tests").rglob("CMakeLists.txt")
                   for target in re.findall(r"\bbirdseye_test\(\s*(\w+)", file.read_text())}
        for mutant in MUTANTS:
            with self.subTest(mutant.id):
                self.assertTrue(any(re.search(mutant.tests, name) for name in names), f"{mutant.tests}: no such test")
                self.assertTrue(mutant.targets)
                self.assertLessEqual(set(mutant.targets), targets)


class Found(unittest.TestCase):
    ONE = dataclasses.replace(MUTANTS[0], id="one", campaign=True)
    TWO = dataclasses.replace(MUTANTS[0], id="two", campaign=False)
    SEEN = {"campaign": {"2": ["pose"], "10": ["named", "pose"]}, "tests": ["A.B"]}
    UNSEEN = {"campaign": {}, "tests": []}

    def test_a_line_that_was_cut_is_none(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "results"
            self.assertEqual(mutants.read_results(file), {})
            file.write_text('{"key": "a", "campaign": {}}\n{"key": "b", "why": "a fault"}\n{"key": "c", "camp')
            self.assertEqual(list(mutants.read_results(file)), ["a"])

    def test_laws_are_told_with_their_seeds(self):
        self.assertEqual(mutants_page.words_of(self.SEEN), "named in 10; pose in 2, 10")
        self.assertEqual(mutants_page.words_of(self.UNSEEN), "-")
        self.assertEqual(mutants_page.words_of({"why": "it does not build\nerror: x"}), "not judged: it does not build")

    def test_sums(self):
        lines, by_campaign, by_any = mutants_page.sums_of([(self.ONE, self.SEEN), (self.TWO, self.UNSEEN)])
        self.assertEqual((by_campaign, by_any), (1, 1))
        self.assertEqual(lines, ["Of 2 defects campaigns alone find 1, tests 1, both together 1.", "Nobody finds: two."])
        lines, *_ = mutants_page.sums_of([(self.ONE, self.UNSEEN), (self.TWO, self.SEEN)])
        self.assertEqual(lines[-1], "Otherwise than expected by the campaign: one, two.")

    def test_a_page_has_a_row_for_each(self):
        page = mutants_page.page_of([(self.ONE, self.SEEN), (self.TWO, {"why": "a fault"})], ["Sums."], "Title.")
        self.assertIn(f"| one | `{self.ONE.file}` | {self.ONE.wrong} | `A.B` | named in 10; pose in 2, 10 |", page)
        self.assertIn("| - | not judged: a fault |", page)


if __name__ == "__main__":
    unittest.main()
