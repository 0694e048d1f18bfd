#!/usr/bin/env python3
"""Breaks every rule of pages.py in a small tree of its own, and sees it told."""
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).parent))
import pages

TREE = {
    "README.md": "[the manual](docs/manual/index.md), [a part of a page](docs/manual/page.md#its-part), <https://a.example>\n",
    "docs/manual/index.md": "[page](page.md)\n",
    "docs/manual/page.md": "# Page\n\n## Its `part`\n\n[above](#page)\n",
    "packaging/birdseyed.cmake": "foreach(page manual/page.md\n    images/a.jpg)\n",
    "docs/decisions/0001-first.md": "# 1. First\n\n**Context.** a\n\n**Decision.** b\n\n**Consequences.** c\n",
}


class Pages(unittest.TestCase):
    def told(self, changes):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder).resolve()
            for name, text in {**TREE, **changes}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text)
            return pages.faults(root)

    def test_a_sound_tree(self):
        self.assertEqual(self.told({}), [])

    def test_each_rule(self):
        first = TREE["docs/decisions/0001-first.md"]
        for changes, fault in [
            ({"README.md": "[gone](docs/gone.md)"}, "README.md: docs/gone.md: no such file"),
            ({"README.md": "[gone](docs/manual/page.md#gone)"}, "README.md: docs/manual/page.md#gone: no such heading"),
            ({"docs/manual/other.md": "# Other\n"}, "docs/manual/index.md: names docs/manual/other.md 0 times, not once"),
            ({"docs/manual/index.md": "[page](page.md) [page](page.md)\n"},
             "docs/manual/index.md: names docs/manual/page.md 2 times, not once"),
            ({"docs/manual/page.md": TREE["docs/manual/page.md"] + "[the manual](index.md)\n"},
             "docs/manual/page.md: index.md: not in the package birdseyed, which has this page"),
            ({"docs/decisions/0003-third.md": first.replace("1. First", "3. Third")},
             "docs/decisions/0003-third.md: is not number 2"),
            ({"docs/decisions/0001-first.md": first.replace("1. First", "2. First")},
             "docs/decisions/0001-first.md: is not number 1"),
            ({"docs/decisions/0001-first.md": first.replace("**Consequences.**", "Then:")},
             "docs/decisions/0001-first.md: has no Consequences"),
        ]:
            self.assertEqual(self.told(changes), [fault])


if __name__ == "__main__":
    unittest.main()
