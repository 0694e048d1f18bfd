"""Reads the tree's C++: what a file includes and declares, and its text without comments and strings."""
import re

TOPS = ("calibration", "drivers", "device", "host", "hw-sim", "tests")
HEADERS = (".hpp", ".h", ".hh", ".hxx", ".inl", ".ipp")
CODE = (*HEADERS, ".cpp", ".c", ".cc", ".cxx")

SPLICED = re.compile(r"^(?:[^\n]*\\[ \t]*\n)+[^\n]*", re.M)
# Comments go; strings are kept apart, because an include's name is one and a word in a message is no use of it. A number
# stays, and is a token only because its ' begins nothing.
TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|(?<!\w)(?:u8|[uUL])?R"([^(\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<!\w)\d(?:\'?[\w.])*'
    r"|'(?:\\.|[^'\\\n])*'", re.S)
INCLUDE = re.compile(r"^[ \t]*(?:#|%:|\?\?=)[ \t]*(?:include|include_next|import|embed)\b[ \t]*(.*)$", re.M)
ODD = {  # what would let an include or a word pass unseen: nothing needs it, so it is told instead of understood
    "a directive that does not begin with #": r"^[ \t]*(?:%:|\?\?=)",
    "a module": r"^[ \t]*(?:export[ \t]+)?(?:import|module)\b(?=[ \t]*[;\w<\":])",
    "a look whether a header is there": r"\b__has_(?:include|embed)",
    "a name that ## puts together": r"##|%:%:",
    "a letter by its number": r"\\[uU][0-9A-Fa-f{]",
}
ODD = [(what, re.compile(pattern, re.M)) for what, pattern in ODD.items()]
TYPE = re.compile(r"\bnamespace\s+(?:\w+\s*::\s*)*(\w+)\s*\{|"
                  r"\b(?:class|struct|union|enum(?:\s+(?:class|struct))?)\s+(?:\[\[[^]]*\]\]\s*)?(?:\w+\s*::\s*)*(\w+)\s*"
                  r"(?:final\b\s*)?((?::(?!:)[^;{}()]*)?)([{;&*\w]?)")


class Unit:
    """One file of C++."""

    def __init__(self, path, text):
        self.path, self.folder = path, path.rpartition("/")[0]
        text = SPLICED.sub(lambda m: re.sub(r"\\[ \t]*\n", "", m[0]) + "\n" * m[0].count("\n"), text)
        bare = TOKEN.sub(lambda m: m[0] if m[0][0] == '"' else blank(m[0]), text)
        self.includes = []  # (line, name, quoted); the name is None where a macro stands for it
        for found in INCLUDE.finditer(bare):
            name = re.match(r'"([^"]+)"|<([^>]+)>', found[1])
            self.includes.append((line_of(bare, found), name and (name[1] or name[2]), bool(name and name[1])))
        self.code = TOKEN.sub(lambda m: blank(m[0]), text)
        self.names = set(re.findall(r"[A-Za-z_]\w*", self.code))
        self.odd = [(line_of(self.code, found), what) for what, pattern in ODD for found in pattern.finditer(self.code)]
        self.declared, self.defined = [], set()  # types: (line, name), and names, each with its namespace's last part
        space = ""
        for found in TYPE.finditer(self.code):
            if found[1]:
                space = found[1]
            elif found[4] == "{":
                self.defined.add(f"{space}::{found[2]}")
            elif found[4]:
                self.declared.append((line_of(self.code, found), f"{space}::{found[2]}"))

    def line(self, found):
        return line_of(self.code, found)


def line_of(text, found):
    return text.count("\n", 0, found.start() + len(found[0]) - len(found[0].lstrip())) + 1


def blank(text):
    return text if text[0].isdigit() else "\n" * text.count("\n") or " "


def project_folder(name):
    return name.rpartition("/")[0] if name and name.partition("/")[0] in TOPS else None


def read_units(root):
    paths = (p for top in TOPS for p in sorted((root / top).rglob("*")) if p.suffix in CODE)
    return {u.path: u for u in (Unit(p.relative_to(root).as_posix(), p.read_text()) for p in paths)}


DIRECTIVE = re.compile(r"^[ \t]*#[ \t]*(?:define\s+\w+(?:\([^)]*\))?|(?!define)[^\n]*\n)", re.M)
KEYWORDS = "return|else|do|throw|case|goto|co_return|co_await|co_yield|and|or|not|xor|bitand|bitor"


class Words:
    """The words of a section of rules.ini, sought in code: a name, qualified or not, that is no part of a longer one; with *
    at its end, all that begin so; with ( at its end, a call of that function, which is neither a member nor, by a qualifier
    other than std, somebody else's, nor its declaration."""

    def __init__(self, words):
        self.plain = [(re.findall(r"\w+(?!\w|\*)", w), re.compile(self.name(w))) for w in words if w[-1] != "("]
        self.calls = [(w[:-1], re.compile(rf"(?<!\w){w[:-1]}(?:\s*\))?\s*\("), re.compile(rf"(?<![\w>])::\s*{w[:-1]}(?!\w)"))
                      for w in words if w[-1] == "("]

    @staticmethod
    def name(word):
        parts = r"\s*::\s*".join(re.escape(part) for part in word.rstrip("*").split("::"))
        return (r"(?<![\w>])" if word.startswith("::") else r"(?<!\w)") + parts + ("" if word.endswith("*") else r"(?!\w)")

    def find(self, unit):
        """(line, what) of each that the file has."""
        found, code = [], unit.code
        for names, pattern in self.plain:
            if unit.names.issuperset(names):
                found += [(unit.line(m), re.sub(r"\s+", "", m[0])) for m in pattern.finditer(code)]
        for name, call, global_name in self.calls:
            if name in unit.names:
                found += [(unit.line(m), f"{name}(") for m in call.finditer(code) if is_call(code, m.start())]
                found += [(unit.line(m), f"::{name}") for m in global_name.finditer(code)]
        return found


def is_call(code, start):
    before = DIRECTIVE.split(code[max(0, start - 200):start])[-1].rstrip()
    if before.endswith("::"):
        return bool(re.search(r"(?<!\w)std\s*::$", before))  # a global one is found by its ::
    if before.endswith((".", "->")):
        return False
    # A declaration has its type before the name: `int poll(`, `Result<void> sleep(`, `char* time(`. What stands apart is an
    # operator, as everywhere in the tree.
    return not re.search(rf"(?<!\w)(?!(?:{KEYWORDS})$)[A-Za-z_]\w*$|[\w>*&)]>$|[\w>][*&]+$", before)
