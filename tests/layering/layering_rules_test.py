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
GTest::gmock_main = gtest/*

[headers of the language and the system]
language = string vector thread
system = sys/*

[build files that are not read]

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
words = std::thread nap_* poll( select( sleep( clock(

[words: waits]
because = the test says so
in = host/*
words = std::future poll( ::wait
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
    ("threads", {"calibration/base/base.cpp": ("in words", "in words\nnap_until(t);")}, "calibration/base/base.cpp:3: [threads] has nap_"),
    *(("threads", {"calibration/base/base.cpp": ("in words", f"in words\n{code}")}, f"base.cpp:{line}: [threads] has {word}")
      for code, line, word in [
          ("std :: thread t;", 3, "std::thread"), ("::std::thread t;", 3, "std::thread"), ("std::\\\nthread t;", 3, "std::thread"),
          ("std::\n  thread t;", 3, "std::thread"), ("using std::thread;", 3, "std::thread"),
          ("poll(p, 1, 0);", 3, "poll("), ("return poll(p, 1, 0);", 3, "poll("), ("int n = poll\n(p, 1, 0);", 3, "poll("),
          ("if (n > poll(p, 1, 0)) return;", 3, "poll("), ("if (!(poll)(p, 1, 0)) return;", 3, "poll("),
          ("n = m * select(1);", 3, "select("), ("f(&::select);", 3, "::select"), ("return ::sleep(1);", 3, "::sleep"),
          ("x = std::clock();", 3, "clock("), ("auto s = 'x' + u8'\"'; poll(p);  // \"", 3, "poll("),
          ("auto n = 1'000 + poll(p) + 1'000;", 3, "poll("), ('auto s = u8R"x(")x"; poll(p);', 3, "poll("),
          ('auto s = "\\\\"; poll(p);', 3, "poll("), ("#define REST poll(p)", 3, "poll("),
          ("#define LONG \\\n  1\nint n = poll(p);", 5, "poll("),
          ("#define MORE 1 + \\\n  poll(p)\n\n", 3, "poll("), ("int n; /* a */ poll /* b */ (p);", 3, "poll(")]),
    ("waits", {"host/files/files.cpp": ("<fmt/format.h>", "<fmt/format.h>\nstd::future<int> f;")}, "files.cpp:3: [waits] has std::future"),
    ("waits", {"host/files/files.cpp": ("<fmt/format.h>", "<fmt/format.h>\nauto n = !::wait(f);")}, "files.cpp:3: [waits] has ::wait"),
    *(("atomic wait", {"host/files/files.cpp": ("<fmt/format.h>", f"<fmt/format.h>\n{code}")}, f"files.cpp:{line}: [atomic wait] waits for {name}")
      for code, line, name in [("std::atomic<int> state_;\nvoid f() { state_.wait(0); }", 4, "state_"),
                               ("std::atomic<int> a_ = 0, b_ = 1;\nvoid f() { b_.wait(0); }", 4, "b_"),
                               ("std::atomic_flag gone;\nvoid f() { gone\n.wait(true); }", 4, "gone"),
                               ("void f(std::atomic<std::pair<int, int>>* p) { p->wait({}); }", 3, "p")]),
    ("atomic wait", {"host/files/files.hpp": ("<string>", "<string>\nstd::atomic_int state_;"),
                     "host/files/files.cpp": ("<fmt/format.h>", "<fmt/format.h>\nvoid f() { x->state_.wait(0); }")}, "files.cpp:3: [atomic wait]"),
    *(("spelling", {"host/files/files.cpp": ("<fmt/format.h>", f"<fmt/format.h>\n{code}")}, f"files.cpp:3: [spelling] {what}")
      for code, what in [
          ("#include <./host/app/app.hpp>", "includes ./host/app/app.hpp"), ('#include "./host/app/app.hpp"', "includes"),
          ("#include <host//app/app.hpp>", "includes"), ("#include </usr/include/string>", "includes /usr/include/string"),
          ('%:include "host/app/app.hpp"', "has a directive"), ('??=include "host/app/app.hpp"', "has a directive"),
          ("import <string>;", "has a module"), ("export module files;", "has a module"), ("import app;", "has a module"),
          ("#if __has_include(<string>)", "has a look"), ("#define BOTH(a, b) a##b", "has a name that ##"),
          ("std::thr\\u0065ad t;", "has a letter"), ("using namespace std;", "has using namespace std;"),
          ("namespace s = ::std;", "has namespace s = ::std;")]),
    ("include", {"host/files/files.hpp": ("#include <string>", '%: include "host/app/app.hpp"')}, "files.hpp:1: [include]"),
    ("include", {"host/files/files.hpp": ("#include <string>", '#inc\\\nlude \\\n"host/app/app.hpp"')}, "files.hpp:1: [include]"),
    ("include", {"host/files/files.hpp": ("#include <string>", '#include_next "host/app/app.hpp"')}, "files.hpp:1: [include]"),
    ("include", {"host/files/files.hpp": ("#include <string>", '#import "host/app/app.hpp"')}, "files.hpp:1: [include]"),
    ("include", {"host/files/files.hpp": ("#include <string>", '#include <string>\n/* */ #include "host/app/app.hpp"')}, "files.hpp:2: [include]"),
    *(("include", {"host/app/app.hpp": ("<CLI/CLI.hpp>", f"<CLI/CLI.hpp>\nnamespace birdseye::host {{\n{there}\n}}"),
                   "host/files/files.cpp": ("<fmt/format.h>", f"<fmt/format.h>\nnamespace birdseye::host {{\n{here}\n}}")},
       "host/files/files.cpp:4: [include] declares host::App, of host/app, which host/files may not")
      for there, here in [("class App {};", "class App;"), ("struct App final : Base {};", "struct App;"), ("class App {};", "void f(class App& app);"),
                          ("enum class App : int { one };", "enum class App : int;"), ("template <class T> struct App {};", "template <class T> struct App;"),
                          ("class App {};", "class Files { friend class App; };")]),
    *(("unknown header", {"host/files/files.cpp": ("<fmt/format.h>", f"<fmt/format.h>\n#include <{name}>")}, f"files.cpp:3: [unknown header] includes <{name}>")
      for name in ["toml11/toml.hpp", "CLI11.hpp", "boost/any.hpp", "packaging/all.hpp", "linux.h"]),
    *(("unknown header", {"host/files/files.cpp": ("<fmt/format.h>", f'<fmt/format.h>\n#include "host/files/rest{suffix}"'),
                          f"host/files/rest{suffix}": '#include "host/app/app.hpp"\n'}, "files.cpp:3: [unknown header] includes host/files/rest")
      for suffix in [".inc", ".tpp", ".cu", ".def", ""]),
    ("unknown header", {"host/files/files.cpp": ("host/files/files.hpp", "host/files/gone.hpp")}, "includes host/files/gone.hpp, which is not there"),
    *(("link", {"calibration/base/CMakeLists.txt": (")", f")\n{code}")}, "[link] birdseye_calibration_base links birdseye_host_files")
      for code in ['target_link_libraries(birdseye_calibration_base PUBLIC "birdseye_host_files")',
                   "TARGET_LINK_LIBRARIES(birdseye_calibration_base PRIVATE birdseye_host_files)",
                   "target_link_libraries(birdseye_calibration_base birdseye_host_files)",
                   "target_link_libraries (\n  birdseye_calibration_base # (\n  INTERFACE [=[birdseye_host_files]=])"]),
    ("link", {"CMakeLists.txt": ("add_subdirectory(host/files)", "add_subdirectory(host/files)\ntarget_link_libraries(birdseye_calibration_base PUBLIC birdseye_host_files)")},
     "[link] birdseye_calibration_base links birdseye_host_files"),
    ("build", {"calibration/base/CMakeLists.txt": (")", " PRIVATE birdseye)")}, "[build] birdseye_calibration_base links birdseye, which"),
    ("link", {"calibration/base/CMakeLists.txt": ("base.cpp", "base.cpp ../points/points.cpp")},
     "[link] birdseye_calibration_base is built of calibration/points/points.cpp"),
    ("link", {"host/files/CMakeLists.txt": (")", ")\ntarget_sources(birdseye_host_files PRIVATE ${CMAKE_SOURCE_DIR}/host/app/main.cpp)")},
     "[link] birdseye_host_files is built of host/app/main.cpp"),
    ("unlinked", {"calibration/base/CMakeLists.txt": (")", ")\ntarget_sources(birdseye_calibration_base PRIVATE more.cpp)"),
                  "calibration/base/more.cpp": "#include <fmt/format.h>\n"}, "[unlinked] birdseye_calibration_base includes headers of fmt::fmt"),
    *(("build", {"calibration/base/CMakeLists.txt": ("NOT_ALONE words.hpp)", f"NOT_ALONE words.hpp)\n{code}")},
       "calibration/base/CMakeLists.txt:2: [build] ")
      for code in ["target_link_libraries(birdseye_calibration_base PUBLIC ${LIBRARIES})",
                   "target_link_libraries(birdseye_calibration_base PUBLIC $<LINK_ONLY:birdseye_host_files>)",
                   "target_link_libraries(birdseye_calibration_base PUBLIC $<1:birdseye_host_files>)",
                   'target_link_libraries(birdseye_calibration_base PUBLIC "birdseye_host_files;fmt::fmt")',
                   "target_link_libraries(birdseye_calibration_base PUBLIC debug;birdseye_host_files)",
                   "target_link_libraries(birdseye_calibration_base PUBLIC (birdseye_host_files))",
                   "target_link_libraries(birdseye_calibration_base PUBLIC -lbirdseye_host_files)",
                   "target_link_libraries(birdseye_calibration_base PUBLIC /usr/lib/libany.so)",
                   "target_link_libraries(${name} PUBLIC fmt::fmt)",
                   "target_link_libraries(birdseye_host_files PUBLIC fmt::fmt)",
                   "set_property(TARGET birdseye_calibration_base APPEND PROPERTY LINK_LIBRARIES birdseye_host_files)",
                   "set_target_properties(birdseye_calibration_base PROPERTIES INTERFACE_LINK_LIBRARIES birdseye_host_files)",
                   "set_target_properties(birdseye_calibration_base PROPERTIES UNITY_BUILD OFF LINK_LIBRARIES birdseye_host_files)",
                   "link_libraries(birdseye_host_files)", "link_directories(..)", "target_link_options(birdseye_calibration_base PRIVATE -lany)",
                   "target_include_directories(birdseye_calibration_base PRIVATE ${CMAKE_SOURCE_DIR}/host/app)", "include_directories(../../host)",
                   "target_compile_options(birdseye_calibration_base PRIVATE -include host/app/app.hpp)",
                   "add_compile_options(-include host/app/app.hpp)", "set(CMAKE_CXX_FLAGS -I../../host/app)", "set(${flags} -I..)",
                   "set_source_files_properties(base.cpp PROPERTIES COMPILE_OPTIONS -I..)",
                   'set_source_files_properties(base.cpp PROPERTIES COMPILE_OPTIONS "-mavx2;-include;app.hpp")',
                   "set_source_files_properties(base.cpp PROPERTIES COMPILE_OPTIONS -Wl,-lany)",
                   "set_source_files_properties(base.cpp PROPERTIES INCLUDE_DIRECTORIES ..)",
                   "target_precompile_headers(birdseye_calibration_base PRIVATE app.hpp)",
                   "target_sources(birdseye_host_files PRIVATE base.cpp)", "target_sources(birdseye_calibration_base PRIVATE ${files})",
                   "target_sources(birdseye_calibration_base PRIVATE $<TARGET_OBJECTS:birdseye_host_files>)",
                   "target_sources(birdseye_calibration_base PRIVATE base.cu)",
                   "add_library(more base.cpp)", "add_library(more ALIAS birdseye_host_files)", "add_executable(more IMPORTED)",
                   "birdseye_executable(birdseye_${name} SOURCES base.cpp)", "birdseye_executable(more SOURCES ${files})",
                   "birdseye_executable(more SOURCES base.cpp LIBRARIES fmt::fmt)",
                   "include(more.cmake)", "include(more OPTIONAL)", "add_subdirectory(../../host/app more)", "add_subdirectory(${more})",
                   "add_subdirectory(../../host/app)", "cmake_language(CALL link_libraries fmt::fmt)", "cmake_language(EVAL CODE x)",
                   "function(more)", "macro(more)", "more()", "file(GLOB files *.cpp)", "add_custom_command(OUTPUT base.cpp)",
                   "FetchContent_Declare(more)", "project(more)", "link_libraries(\n  (fmt::fmt)\n)"]),
    ("build", {"host/files/CMakeLists.txt": ("fmt::fmt", "fmt::fmt boost::any")}, "[build] birdseye_host_files links boost::any, which"),
    ("build", {"host/files/CMakeLists.txt": ("fmt::fmt", "fmt::fmt pthread")}, "[build] birdseye_host_files links pthread, which"),
    ("build", {"host/files/CMakeLists.txt": ("files.cpp", "files.cpp gone.cpp")}, "[build] birdseye_host_files is built of host/files/gone.cpp"),
    ("build", {"host/app/CMakeLists.txt": (")", ")\nbirdseye_executable(birdseye_host_files SOURCES main.cpp)")}, "[build] a target called birdseye_host_files"),
    ("unneeded exception", {"tests/layering/rules.ini": ("that are not read]", "that are not read]\nhost/files/gone.cmake = why")},
     "[unneeded exception] host/files/gone.cmake"),
]

# What looks like a broken rule and is none.
KEEPS = [
    *({"calibration/base/base.cpp": ("in words", f"in words\n{code}")} for code in [
        "camera.poll(1);", "camera->poll(1);", "camera\n    .poll(1);", "Pack::select(a, b);", "Pack<T>::select(a, b);", "Result<void> sleep();",
        "static F select(M m, F a);", "Result<void> Bird::sleep() {", "char* select(int);", "const Clock& clock() const;",
        "int pollute(int);", "auto poll = 3;", "old_poll(1);", "struct Polled { std::string thread; };", 'say("poll(1)");', "'p'; // poll(1)",
        'R"(\n#include "host/app/app.hpp"\n)";', "auto n = 1'000'000; // it's poll(1)", "using namespace std::literals;", "#define A(b) #b"]),
    {"host/files/files.cpp": ("<fmt/format.h>", "<fmt/format.h>\n#include <sys/stat.h>\nstd::atomic<int> state_;\nvoid f() { told_.wait(1); wait(2); }")},
    {"host/app/app.hpp": ("<CLI/CLI.hpp>", "<CLI/CLI.hpp>\nnamespace host {\nclass App {};\nenum class Mark { one };\n}"),
     "host/app/main.cpp": ('files.hpp"\n', 'files.hpp"\nnamespace host {\nclass App;\n}\n'),
     "host/files/files.cpp": ("<fmt/format.h>", "<fmt/format.h>\nnamespace files {\nclass App;\ntemplate <class Mark> Mark f(class Other*);\n}")},
    *({"calibration/base/CMakeLists.txt": ("NOT_ALONE words.hpp)", f"NOT_ALONE words.hpp)\n{code}")} for code in [
        "if(NOT (X AND (Y)))\n  return()\nendif()", "# link_libraries(x)", "#[[ link_libraries(x) ]]", 'message("link_libraries(x)")',
        "set(files base.cpp)", "set_target_properties(birdseye_calibration_base PROPERTIES UNITY_BUILD OFF)",
        'set_source_files_properties(base.cpp PROPERTIES COMPILE_OPTIONS "-mavx2;$<$<CXX_COMPILER_ID:GNU>:-Wno-psabi>")',
        'set_source_files_properties(base.cpp PROPERTIES COMPILE_DEFINITIONS VERSION="${PROJECT_VERSION}")', "include(GoogleTest)",
        "target_sources(birdseye_calibration_base PRIVATE base.cpp)"]),
    {"calibration/base/CMakeLists.txt": ("NOT_ALONE words.hpp)", "NOT_ALONE words.hpp)\ninclude(more.cmake)"),
     "tests/layering/rules.ini": ("that are not read]", "that are not read]\ncalibration/base/more.cmake = why")},
    {"CMakeLists.txt": ("host/app)\n", "host/app)\nadd_subdirectory(tests/host)\n"),
     "tests/host/CMakeLists.txt": "birdseye_test(files_test SOURCES files/files_test.cpp PRIVATE birdseye_host_files LABEL gl STUDIES Files.Are*)\n"
                                  "add_executable(other_test EXCLUDE_FROM_ALL files/files_test.cpp ../support/more.cpp)\n"
                                  "target_link_libraries(other_test PRIVATE birdseye_host_files birdseye_options GTest::gmock_main)\n",
     "tests/support/more.cpp": "#include <string>\n",
     "tests/host/files/files_test.cpp": ("files.hpp", 'files.hpp"\n#include <gtest/gtest.h>\n#include "host/files/files.hpp')},
]


def changed(changes):
    tree = dict(TREE)
    for path, change in changes.items():
        if path in tree:
            assert change[0] in tree[path], (path, change)
            tree[path] = tree[path].replace(*change)
        else:
            tree[path] = change
    return tree


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
                told = tell(changed(changes))
                self.assertTrue([line for line in told if f"[{rule}]" in line and expected in line], told)

    def test_what_only_looks_like_a_broken_rule_is_not_complained_of(self):
        for changes in KEEPS:
            with self.subTest(changes=changes):
                self.assertEqual(tell(changed(changes)), [])

    def test_no_rule_goes_without_a_tree_that_breaks_it(self):
        self.assertEqual(set(layering.RULES) | {"commands", "threads", "waits"}, {rule for rule, _, _ in BREAKS})

    def test_every_header_and_word_of_the_real_rules_is_found_where_they_hold(self):
        rules = layering.Rules(REAL_RULES)
        self.assertGreater(len(rules.sections), 4)
        for name, section in rules.sections.items():
            where = section["in"][0]
            place = {"*": "calibration/base/any.cpp", "*.hpp": "calibration/base/any.hpp"}.get(where, where.replace("*", "base/any.cpp"))
            lines = [f"#include <{header.replace('*', 'any.h')}>" for header in section.get("headers", [])]
            lines += [f"  {word.replace('*', 'for').rstrip('(')}(1);" for word in section.get("words", [])]
            self.assertTrue(lines, name)
            edges = f"[edges]\n{place.rpartition('/')[0]} =\n[packages]\n[linked for more than includes]\n[build files that are not read]\n[headers of the language and the system]\n"
            tree = {"CMakeLists.txt": "", place: "\n".join(lines) + "\n",
                    "tests/layering/rules.ini": f"{edges}[{name}]\n" + "".join(
                        f"{key} = {' '.join(section[key])}\n" for key in ("in", "headers", "words") if key in section)}
            told = tell(tree)
            for number in range(1, len(lines) + 1):
                with self.subTest(rule=name, line=lines[number - 1]):
                    self.assertTrue([t for t in told if t.startswith(f"{place}:{number}: [{name.partition(': ')[2]}]")], told)


if __name__ == "__main__":
    unittest.main()
