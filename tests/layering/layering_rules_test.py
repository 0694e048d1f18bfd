#!/usr/bin/env python3
"""Breaks every rule of layering.py, each in a small tree of its own, and sees it told under its name."""
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).parent))
import layering

REAL_RULES = pathlib.Path(__file__).with_name("rules.ini")

TREE = {
    "CMakeLists.txt": "add_subdirectory(calibration/base)\nadd_subdirectory(calibration/points)\nadd_subdirectory(host/files)\n"
                      "add_subdirectory(host/app)\n",
    "calibration/base/CMakeLists.txt": "birdseye_library(birdseye_calibration_base SOURCES base.cpp NOT_ALONE words.hpp)\n",
    "calibration/base/base.hpp": "#pragma once\n#include <vector>\n",
    "calibration/base/base.cpp": '#include "calibration/base/base.hpp"\n// std::thread and #include "host/app/app.hpp" in words\n',
    "calibration/base/words.hpp": "#include <fmt/format.h>\n",  # which base itself does not link
    "calibration/points/CMakeLists.txt":
        "birdseye_library(birdseye_calibration_points\n  SOURCES points.cpp\n"
        "  PUBLIC birdseye_calibration_base Eigen3::Eigen\n  PRIVATE fmt::fmt)\n",
    "calibration/points/points.hpp": '#include <Eigen/Core>\n#include "calibration/base/base.hpp"\n',
    "calibration/points/points.cpp": '#include "calibration/points/points.hpp"\n#include "calibration/base/words.hpp"\nauto text = "std::thread";\n',
    "host/files/CMakeLists.txt":
        "birdseye_library(birdseye_host_files\n  SOURCES files.cpp\n  PRIVATE birdseye_calibration_points fmt::fmt)\n",
    "host/files/files.hpp": "#include <string>\n",
    "host/files/files.cpp": '#include "host/files/files.hpp"\n#include <fmt/format.h>\n#include "calibration/points/points.hpp"\n',
    "host/app/CMakeLists.txt": "birdseye_executable(birdseye SOURCES main.cpp PRIVATE birdseye_host_files CLI11::CLI11)\n",
    "host/app/app.hpp": "#include <CLI/CLI.hpp>\n",
    "host/app/main.cpp": '#include "host/app/app.hpp"\n#include "host/files/files.hpp"\n',
    "tests/host/files/files_test.cpp": '#include "host/files/files.hpp"\n#include "tests/support/scratch.hpp"\n',
    "tests/support/scratch.hpp": "#include <string>\n",
    "tests/layering/rules.ini": """
[edges]
calibration/base =
calibration/points = calibration/base
host/files = calibration/points
host/app = host/files
tests/support =
tests/* = calibration/* host/* tests/support

[packages]
Eigen3::Eigen = Eigen/*
fmt::fmt = fmt/*
CLI11::CLI11 = CLI/*

[linked for more than includes]

[headers: commands]
because = the test says so
in = *
headers = CLI/*
but not in = host/app/*

[words: threads]
because = the test says so
in = calibration/*
headers = thread
words = std::thread sleep_
""",
}

# Rule, what is changed (file: (old, new), or new text where there was none), and what the complaint must hold.
BREAKS = [
    ("include", {"host/files/files.hpp": ("#include <string>", '#include "host/app/app.hpp"')},
     "host/files/files.hpp:1: [include] includes host/app/app.hpp, which host/files may not"),
    ("include", {"host/files/files.hpp": ("#include <string>", "#include <host/app/app.hpp>")}, "host/files/files.hpp:1: [include]"),
    ("include", {"host/files/files.hpp": ("#include <string>", '  #include "host/app/app.hpp"')}, "host/files/files.hpp:1: [include]"),
    ("include", {"host/files/files.hpp": ("#include <string>", '\t# include "host/app/app.hpp"')}, "host/files/files.hpp:1: [include]"),
    ("include", {"host/files/files.hpp": ("#include <string>", '#include /* why */ "host/app/app.hpp"')}, "host/files/files.hpp:1: [include]"),
    ("include", {"host/files/files.cpp": ("#include <fmt", '#include "calibration/base/base.hpp"\n#include <fmt')},
     "host/files/files.cpp:2: [include] includes calibration/base/base.hpp, which host/files may not"),
    ("include", {"calibration/base/base.hpp": ("<vector>", '"hw-sim/app/sim.hpp"')}, "[include] includes hw-sim/app/sim.hpp"),
    ("include", {"host/app/main.cpp": ("host/files/files.hpp", "tests/support/scratch.hpp")}, "[include] includes tests/support"),
    ("include", {"tests/host/files/files_test.cpp": ("tests/support/", "tests/host/app/")}, "[include] includes tests/host/app/scratch.hpp"),
    ("link", {"host/files/CMakeLists.txt": ("fmt::fmt", "fmt::fmt birdseye_calibration_base")},
     "[link] birdseye_host_files links birdseye_calibration_base, which host/files may not"),
    ("link", {"calibration/base/CMakeLists.txt": (")", ")\ntarget_link_libraries(birdseye_calibration_base PUBLIC birdseye_host_files)")},
     "[link] birdseye_calibration_base links birdseye_host_files, which calibration/base may not"),
    ("unlinked", {"host/files/CMakeLists.txt": ("fmt::fmt", "")}, "[unlinked] birdseye_host_files includes headers of fmt::fmt"),
    ("unlinked", {"calibration/points/CMakeLists.txt": ("PRIVATE fmt::fmt", "")},
     "[unlinked] birdseye_calibration_points includes headers of fmt::fmt"),
    ("unlinked", {"calibration/points/CMakeLists.txt": ("PUBLIC", "PRIVATE")},
     "[unlinked] birdseye_calibration_points links birdseye_calibration_base PRIVATE"),
    ("unlinked", {"host/app/CMakeLists.txt": ("birdseye_host_files", "")}, "[unlinked] birdseye includes headers of birdseye_host_files"),
    ("unneeded link", {"calibration/base/CMakeLists.txt": ("base.cpp", "base.cpp PRIVATE fmt::fmt")},
     "[unneeded link] birdseye_calibration_base links fmt::fmt, and no include needs it"),
    ("unneeded link", {"host/files/CMakeLists.txt": ("PRIVATE", "PUBLIC")},
     "[unneeded link] birdseye_host_files links birdseye_calibration_points PUBLIC, and no header needs it"),
    ("unneeded edge", {"host/files/files.cpp": ('#include "calibration/points/points.hpp"', "")},
     "[unneeded edge] host/files = ... calibration/points"),
    ("order", {"tests/layering/rules.ini": ("calibration/base =\n", "calibration/base = host/files\n")},
     "[order] calibration/base = ... host/files"),
    ("order", {"CMakeLists.txt": ("host/files)\nadd_subdirectory(host/app", "host/app)\nadd_subdirectory(host/files")},
     "[order] the build adds host/app where the table has host/files"),
    ("unknown folder", {"host/new/new.hpp": "#pragma once\n"}, "host/new: [unknown folder]"),
    ("unknown folder", {"tests/layering/rules.ini": ("calibration/base =\n", "calibration/base =\ncalibration/gone =\n")},
     "[unknown folder] has a row for calibration/gone"),
    ("target name", {"host/files/CMakeLists.txt": ("birdseye_host_files", "birdseye_host_documents"),
                     "host/app/CMakeLists.txt": ("birdseye_host_files", "birdseye_host_documents")},
     "[target name] birdseye_host_documents should be called birdseye_host_files"),
    ("spelling", {"host/files/files.cpp": ("host/files/files.hpp", "files.hpp")}, "files.cpp:1: [spelling] includes files.hpp"),
    ("spelling", {"host/files/files.cpp": ("host/files/files.hpp", "host/app/../files/files.hpp")}, "files.cpp:1: [spelling]"),
    ("spelling", {"host/files/files.cpp": ('"host/files/files.hpp"', "HEADER")}, "files.cpp:1: [spelling] includes by a macro"),
    ("unneeded exception", {"tests/layering/rules.ini": ("but not in = ", "but not in = host/files/* ")},
     "[unneeded exception] [headers: commands] host/files/*"),
    ("unneeded exception", {"tests/layering/rules.ini": ("but not in = ", "not yet in = host/files/*\nbut not in = ")},
     "[unneeded exception] [headers: commands] host/files/*"),
    ("unneeded exception", {"tests/layering/rules.ini": ("[linked for more than includes]", "[linked for more than includes]\nbirdseye = fmt::fmt")},
     "[unneeded exception] birdseye = fmt::fmt"),
    ("commands", {"host/files/files.cpp": ("<fmt/format.h>", "<fmt/format.h>\n #  include <CLI/App.hpp>")},
     "host/files/files.cpp:3: [commands] has <CLI/App.hpp>"),
    ("threads", {"calibration/base/base.hpp": ("<vector>", "<thread>")}, "calibration/base/base.hpp:2: [threads] has <thread>"),
    ("threads", {"calibration/base/base.cpp": ("in words", "in words\nstd::thread t;")}, "calibration/base/base.cpp:3: [threads] has std::thread"),
    ("threads", {"calibration/base/base.cpp": ("in words", "in words\nsleep_until(t);")}, "calibration/base/base.cpp:3: [threads] has sleep_"),
]


def tell(tree):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for path, text in tree.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text)
        return layering.Check(root).run()


class Layering(unittest.TestCase):
    def test_a_tree_that_keeps_the_rules_is_not_complained_of(self):
        self.assertEqual(tell(TREE), [])

    def test_every_rule_that_is_broken_is_told_by_its_name(self):
        for rule, changes, expected in BREAKS:
            with self.subTest(rule=rule, changes=changes):
                tree = dict(TREE)
                for path, change in changes.items():
                    if path in tree:
                        self.assertIn(change[0], tree[path])
                        tree[path] = tree[path].replace(*change)
                    else:
                        tree[path] = change
                told = tell(tree)
                self.assertTrue([line for line in told if f"[{rule}]" in line and expected in line], told)

    def test_no_rule_goes_without_a_tree_that_breaks_it(self):
        self.assertEqual(set(layering.RULES) | {"commands", "threads"}, {rule for rule, _, _ in BREAKS})

    def test_every_header_and_word_of_the_real_rules_is_found_where_they_hold(self):
        rules = layering.Rules(REAL_RULES)
        self.assertGreater(len(rules.sections), 4)
        for name, section in rules.sections.items():
            where = section["in"][0]
            place = {"*": "calibration/base/any.cpp", "*.hpp": "calibration/base/any.hpp"}.get(where, where.replace("*", "base/any.cpp"))
            lines = [f"#include <{header.replace('*', 'any.h')}>" for header in section.get("headers", [])]
            lines += [f"  {word}{'for' if word.endswith('_') else ''}(1);" for word in section.get("words", [])]
            self.assertTrue(lines, name)
            edges = f"[edges]\n{place.rpartition('/')[0]} =\n[packages]\n[linked for more than includes]\n"
            tree = {"CMakeLists.txt": "", place: "\n".join(lines) + "\n",
                    "tests/layering/rules.ini": f"{edges}[{name}]\n" + "".join(
                        f"{key} = {' '.join(section[key])}\n" for key in ("in", "headers", "words") if key in section)}
            told = tell(tree)
            for number in range(1, len(lines) + 1):
                with self.subTest(rule=name, line=lines[number - 1]):
                    self.assertTrue([t for t in told if t.startswith(f"{place}:{number}: [{name.partition(': ')[2]}]")], told)


if __name__ == "__main__":
    unittest.main()
