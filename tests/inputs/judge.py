"""A row of the table of inputs, what came of running it, and whether that is what a user would expect."""
import dataclasses
import fnmatch
import re
from collections.abc import Callable, Sequence
from pathlib import Path

KINDS = ("good", "odd", "wrong")

# What libraries and the C++ runtime say by themselves: a user is to be told by us.
RAW = re.compile(r"libpng|Corrupt JPEG|Premature end of JPEG|terminate called|what\(\):|Segmentation fault|Aborted|core dumped|Killed|OpenCV\(|error: \(-|itk::|std::|"
                 r"\bDcm[A-Z]\w+|^[WEF]: |/usr/(include|lib)|json\.exception|toml::|YAML::|yaml-cpp|AddressSanitizer|runtime error:",
                 re.M)
# A refusal must cost no more than this.
MOST_MB_OF_A_REFUSAL = 512
MOST_LINES_OF_A_REFUSAL = 12


@dataclasses.dataclass
class Row:
    """One input, given to one command, and what a user would expect of it."""
    command: str  # as the manual calls it: "calibrate camera"
    kind: str  # good, odd or wrong
    input: str  # in words
    expected: str  # in words; the fields below hold it
    run: str  # the command line, for bash, in a folder of its own
    exit: int
    make: Callable[[Path], None] | None = None  # makes the input in that folder
    verdict: str = ""  # the word behind "verdict:", empty: no verdict is printed
    says: Sequence[str] = ()  # regular expressions, each found in what is printed
    says_not: Sequence[str] = ()  # none of these is
    writes: Sequence[str] = ()  # files that are new afterwards and not empty; `*` is any letters, also slashes
    check: Callable[[Path, str], str] | None = None  # of the folder and what was printed: what is wrong with the figures
    data: Sequence[str] = ()  # public recordings that it needs, below the folder of data
    screen: bool = False  # whether it has an X server
    beside: Sequence[tuple[str, str]] = ()  # programs that run meanwhile, and what each prints once it is ready
    slow: bool = False  # only run when all rows are


@dataclasses.dataclass
class Outcome:
    """What came of running a row."""
    exit: int | None  # None: it was ended after the deadline
    output: str  # of stdout and stderr together
    errors: str  # of stderr alone
    files: Sequence[str]  # that are new, with sizes of at least a byte
    empty_files: Sequence[str]  # that are new and empty
    seconds: float
    most_mb: float
    figures: str = ""  # what Row.check found wrong


def verdict_of(output):
    """The word of the last line "verdict: word", or nothing."""
    found = re.findall(r"^\s*verdict:? (pass|marginal|fail)\b", output, re.M)
    return found[-1] if found else ""


def faults_of_files(row, outcome):
    for pattern in row.writes:
        if not any(fnmatch.fnmatch(file, pattern) for file in outcome.files):
            yield f"{pattern} is not written"
    for file in [*outcome.files, *outcome.empty_files]:
        if not any(fnmatch.fnmatch(file, pattern) for pattern in row.writes):
            yield f"{file} is left behind"


def faults_of_a_refusal(outcome):
    """Exit code 2 is one line that names the thing and the remedy, or a few where there is more than one fault."""
    lines = [line for line in outcome.errors.splitlines() if line.strip()]
    if not lines:
        yield "refused without a word"
    if len(lines) > MOST_LINES_OF_A_REFUSAL:
        yield f"refused in {len(lines)} lines"
    if lines and not any(re.match(r"birdseye(d|-sim)?: ", line) for line in lines):
        yield "no line of the refusal begins with the program's name"
    if outcome.most_mb > MOST_MB_OF_A_REFUSAL:
        yield f"refused with {outcome.most_mb:.0f} MB"


def faults(row, outcome):
    """What happened otherwise than a user would expect, one line each."""
    if outcome.exit is None:
        return ["did not end"]
    found = []
    if outcome.exit != row.exit:
        found.append(f"exit code {outcome.exit}, not {row.exit}")
    if (verdict := verdict_of(outcome.output)) != row.verdict:
        found.append(f"verdict {verdict or 'none'}, not {row.verdict or 'none'}")
    found += [f"does not say /{text}/" for text in row.says if not re.search(text, outcome.output, re.M | re.I)]
    found += [f"says /{text}/" for text in row.says_not if re.search(text, outcome.output, re.M | re.I)]
    if raw := RAW.search(outcome.output):
        found.append(f"says what a library says: {raw.group()}")
    if outcome.exit == 2:
        found += faults_of_a_refusal(outcome)
    found += faults_of_files(row, outcome)
    if outcome.figures:
        found.append(outcome.figures)
    return found
