"""Writes docs/manual/inputs.md: the table of inputs, with what happened."""
import re

from judge import KINDS, verdict_of
from running import data_folder

INTRODUCTION = """# Inputs, and what comes of them

What the commands do with good, odd and wrong inputs. The table is written by a test (`tests/inputs`) that makes each input, runs the command
and holds exit code, verdict, words, files and figures against what a user would expect: `./run inputs` writes the page anew and fails where a
row differs. `./run studies` runs all rows but the slow ones. Expectations were written before the commands were run first; where the two differed, the
program was mended, or the expectation was put right.

How to read it:

- **good**: what the manual asks for. **odd**: what users have all the same: another format, a station that is off, a file beside the
  slices. **wrong**: what no result can come of.
- **what happened**: the exit code (0 done, with a verdict *pass* or *marginal* where there is one; 2 the input cannot be used, 3 the verdict is
  *fail*), the verdict, and the first line of what was said about it.
- Of every row it is held, too, that no file is left but those that were asked for, that no words of a library are printed, and that
  a refusal takes at most 512 MB.
- **s**: seconds, from the command's start to its end, on two cores that had other work besides. They are told, not judged; a row that takes over
  120 s fails.

"""


def _cell(text):
    return re.sub(r"\s+", " ", text).replace("|", "\\|").strip()


def _shown(line):
    """Without the folders of this run, and no longer than a cell may be."""
    line = re.sub(r"/tmp/inputs-\w+/work/", "", line).replace(f"{data_folder()}/", "")
    return line if len(line) <= 160 else line[:157] + ".."


def _said(row, outcome):
    """The line that tells most: a refusal's first, else the first reason that is not met, else nothing."""
    lines = [line.strip() for line in outcome.errors.splitlines() if re.match(r"birdseye(d|-sim)?: ", line)]
    if outcome.exit == 2 and lines:
        return _shown(re.sub(r"^birdseye(d|-sim)?: ", "", lines[0]))
    if row.says:
        found = next((line.strip() for line in outcome.output.splitlines() if re.search(row.says[0], line, re.I)), "")
        return _shown(found)
    return ""


def _happened(row, outcome, told):
    parts = [str(outcome.exit) if outcome.exit is not None else "did not end"]
    if verdict := verdict_of(outcome.output):
        parts.append(f"*{verdict}*")
    text = ", ".join(parts)
    if said := _said(row, outcome):
        text += f": {said}"
    if told:
        text += " **NOT AS EXPECTED: " + "; ".join(told) + "**"
    return text


def _typed(command):
    """The command line as a user would type it."""
    text = re.sub(r"\$DATA/", "", command)
    return f"`{_cell(text)}`"


def table(results):
    """The table's sections, one for each command, in the order of the rows."""
    text, command = "", None
    for row, outcome, told in results:
        if row.command != command:
            command = row.command
            text += f"\n## {command}\n\n| | input | a user would expect | what happened | s |\n|---|---|---|---|---|\n"
        happened = _happened(row, outcome, told) if outcome else f"not run: {told[0]}"
        seconds = f"{outcome.seconds:.1f}" if outcome else ""
        text += f"| {row.kind} | {_cell(row.input)}: {_typed(row.run)} | {_cell(row.expected)} | {_cell(happened)} | {seconds} |\n"
    return text


def write(path, results):
    ran = [(row, told) for row, outcome, told in results if outcome]
    counts = ", ".join(f"{sum(row.kind == kind for row, _ in ran)} {kind}" for kind in KINDS)
    as_expected = sum(not told for _, told in ran)
    summary = f"{len(ran)} inputs ({counts}); {as_expected} of them did what a user would expect.\n"
    path.write_text(INTRODUCTION + summary + table(results))
