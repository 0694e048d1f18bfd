"""Reads the CMakeLists.txt: who makes which target of which files and links it with what. What a folder's CMakeLists.txt has
beside that is told, for it could hide a link."""
import pathlib
import posixpath
import re

from source_files import CODE, TOPS

LEXEME = re.compile(r'#\[(=*)\[.*?\]\1\]|#[^\n]*|\[(=*)\[(.*?)\]\2\]|"((?:\\.|[^"\\])*)"|([()])|((?:\\.|[^\s()#"\\])+)', re.S)
PLAIN = re.compile(r"[A-Za-z0-9_][\w.+-]*(?:::[\w.+-]+)?")
MAKERS = {"birdseye_library": "library", "birdseye_executable": "program", "birdseye_test": "test",
          "birdseye_fuzz": "program", "add_library": "library", "add_executable": "program"}
# These make no link and no include. `set` may be too, of a name in small letters: CMake's own are in capitals.
HARMLESS = {"if", "elseif", "else", "endif", "foreach", "endforeach", "return", "message", "find_package", "add_test",
            "add_dependencies", "set_tests_properties", "target_compile_definitions"}
PROPERTIES = {"set_target_properties": {"UNITY_BUILD", "RUNTIME_OUTPUT_DIRECTORY"},
              "set_source_files_properties": {"COMPILE_DEFINITIONS", "COMPILE_OPTIONS"}}
OPTION = re.compile(r"-[mfW][\w=+-]*")
BY_COMPILER = re.compile(r"\$<\$<CXX_COMPILER_ID:\w+>:([^<>$;]*)>")
MODULES = {"GoogleTest"}  # CMake's own
OPTIONS = "birdseye_options"  # what every target of ours is compiled with; the functions of cmake/Birdseye.cmake link it
TEST_MAIN = "GTest::gmock_main"  # what birdseye_test links


class Target:
    """A library, program or test of the build, with the folder whose CMakeLists.txt makes it."""

    def __init__(self, name, folder, kind):
        self.name, self.folder, self.kind = name, folder, kind
        self.sources, self.not_alone = [], []  # files, by their paths from the root
        self.links = {}  # name: PUBLIC or PRIVATE


def commands(text):
    """(line, command, words) of each command; parentheses within one are words of it."""
    name, words, depth, end = None, [], 0, 0
    for m in LEXEME.finditer(text):
        if m[0].startswith("#"):
            continue
        if m[5] == "(" and depth == 0:
            depth, words, line = 1, [], text.count("\n", 0, m.start()) + 1
        elif m[5] == ")" and depth == 1:
            depth = 0
            yield line, (name or "").lower(), words
        elif depth == 0:
            name = m[0]
        else:
            depth += {"(": 1, ")": -1}.get(m[5], 0)
            word = next(w for w in (m[3], m[4], m[5], m[6]) if w is not None)
            if words and m.start() == end and m[5] is None and words[-1] not in ("(", ")"):
                words[-1] += word  # NAME="value"
            else:
                words.append(word)
        end = m.end()


class Build:
    """All targets, and the folders in the order in which they are added, of every CMakeLists.txt from the root's on."""

    def __init__(self, root, not_read):
        self.root, self.not_read, self.passed_over = root, not_read, set()
        self.targets, self.added = {}, []
        self.told = []  # (place, what)
        self.read(pathlib.Path("."))

    def read(self, folder):
        here = folder.as_posix()
        strict = here.partition("/")[0] in TOPS  # the root, cmake and packaging do as they must
        file = folder / "CMakeLists.txt"
        for line, command, words in commands((self.root / file).read_text()):
            self.place = f"{file.as_posix()}:{line}"
            if command == "add_subdirectory":
                self.add(folder, words)
            elif command in MAKERS:
                if strict and command == "add_library":
                    self.tell("add_library", "birdseye_library makes a library")
                if words:
                    self.make(here, MAKERS[command], words, strict)
            elif command == "target_link_libraries" and words:
                self.link(here, words, strict)
            elif strict:
                self.read_other(here, command, words)

    def tell(self, what, remedy="write it plainly, or in cmake/ if it must be"):
        self.told.append((self.place, f"{what}: {remedy}"))

    def add(self, folder, words):
        path = posixpath.normpath(posixpath.join(folder.as_posix(), words[0])) if words else ""
        if len(words) != 1 or "$" in path or (folder.parts and not path.startswith(folder.as_posix() + "/")):
            self.tell(f"add_subdirectory({' '.join(words)})", "name one folder below this one")
        else:
            self.added.append(path)
            self.read(pathlib.Path(path))

    def make(self, here, kind, words, strict):
        if strict and (not PLAIN.fullmatch(words[0]) or words[0] in self.targets):
            self.tell(f"a target called {words[0]}", "give each target a plain name of its own")
        target = self.targets.setdefault(words[0], Target(words[0], here, kind))
        if kind == "test":
            target.links[TEST_MAIN] = "PRIVATE"
        part = "SOURCES"
        for word in words[1:]:
            if re.fullmatch("[A-Z_]+", word):
                part = word if word != "EXCLUDE_FROM_ALL" else part
                if strict and part not in ("SOURCES", "NOT_ALONE", "PUBLIC", "PRIVATE", "LABEL", "STUDIES"):
                    self.tell(f"{word} of {target.name}")
            elif part in ("SOURCES", "NOT_ALONE"):
                self.source(here, target.sources if part == "SOURCES" else target.not_alone, word, strict)
            elif part in ("PUBLIC", "PRIVATE"):
                self.one_link(target, word, part, strict)

    def source(self, here, files, word, strict):
        path = word.replace("${CMAKE_SOURCE_DIR}/", "", 1) if word.startswith("${CMAKE_SOURCE_DIR}/") else f"{here}/{word}"
        if "$" in path or not path.endswith(CODE):
            if strict:
                self.tell(f"the source {word}", "name a file of C++, by its path from this folder or from ${CMAKE_SOURCE_DIR}")
        else:
            files.append(posixpath.normpath(path))

    def one_link(self, target, word, kind, strict):
        if PLAIN.fullmatch(word):
            target.links[word] = kind
        elif strict:
            self.tell(f"{target.name} links {word}", "name one target, plainly")

    def link(self, here, words, strict):
        target = self.targets.get(words[0])
        if target is None or strict and target.folder != here:
            if strict:
                self.tell(f"target_link_libraries of {words[0]}, which this file does not make")
            return
        part = "PRIVATE"
        for word in words[1:]:
            if word in ("PUBLIC", "PRIVATE", "INTERFACE"):
                part = "PRIVATE" if word == "PRIVATE" else "PUBLIC"
            else:
                self.one_link(target, word, part, strict)

    def read_other(self, here, command, words):
        known = command in HARMLESS
        if command in PROPERTIES and "PROPERTIES" in words:
            given = words[words.index("PROPERTIES") + 1:]
            known = all(key in PROPERTIES[command] for key in given[::2]) and all(
                OPTION.fullmatch(BY_COMPILER.sub(r"\1", option))
                for key, value in zip(given[::2], given[1::2]) if key == "COMPILE_OPTIONS" for option in value.split(";"))
        elif command == "target_sources" and len(words) > 2 and words[1] in ("PRIVATE", "PUBLIC"):
            target = self.targets.get(words[0])
            known = target is not None and target.folder == here
            for word in words[2:] if known else []:
                self.source(here, target.sources, word, True)
        elif command == "include" and len(words) == 1:
            path = posixpath.normpath(f"{here}/{words[0]}")
            self.passed_over.add(path)
            known = words[0] in MODULES or path in self.not_read
        elif command == "set" and words:
            known = re.fullmatch(r"[a-z]\w*", words[0]) is not None
        if not known:
            self.tell(f"{command}({' '.join(words[:4])}{' ...' if len(words) > 4 else ''})")
