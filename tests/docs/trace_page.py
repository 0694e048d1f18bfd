"""The page that shows the requirements and the tests that hold them."""
import os

PAGE = "docs/manual/trace.md"

INTRODUCTION = """# Requirements, and the tests that hold them

What must not happen, what holds it back, and which tests hold that. Each row is a file in `docs/requirements`; `./run trace`
writes this page from them. `./run test` fails where a requirement has neither a control nor a place among the open ones, where a control has
no test, where a test that is cited is not there or does not run, and where this page is out of date.

How to read it:

- The words are those of ISO 14971. A **hazard** is what harm can come of: a wrong overlay, loss of data, loss of service, disclosure. The
  **hazardous situation** is how people come to be exposed to it, and the **harm** what it does to them.
- **Severity** is that of the harm if it comes: negligible, minor (passes by itself), serious (has to be treated), critical (lasts, or threatens
  life), catastrophic (death). Developers chose it, no clinician has. How probable a harm is stands nowhere here: nobody has measured it. Whoever
  puts this into a medical device judges both in a risk file of their own, for which these rows are a beginning.
- **Control** is what the product does about it; after *it leaves* stands what that does not see.
- **Held by**: a name as `Suite.Name` is a GoogleTest. *lies*, *faults* and *inputs* are rows of [lies](lies.md),
  [faults](faults.md) and [inputs](inputs.md), each written and held by a test. `./run test` and `./run studies` run them, but for those with a star:
  `./run faults` and `./run vm-test` run these.

"""

OPEN_WORDS = """## Known and open

Nothing in the product holds these back yet. Until something does, do what the last column says.

| | what is wanted | what may happen, and the harm | severity | do this instead |
|---|---|---|---|---|
"""

HELD_HEAD = """| | what is required | hazardous situation, and the harm | severity | control | held by |
|---|---|---|---|---|---|
"""


def plain(text):
    return " ".join(text.split()).replace("|", "\\|")


def cited(name, evidence):
    star = "\\*" if name in evidence.apart else ""
    kind, colon, row = name.partition(": ")
    if not colon:
        return f"`{name}`{star}"  # no link: the manual is installed without the tests
    place = os.path.relpath(evidence.places[name], os.path.dirname(PAGE))
    return f"[{kind}]({place}): {plain(row)}{star}"


def held_row(one, evidence):
    control = plain(one["control"])
    if "remains" in one:
        control += f" *It leaves:* {plain(one['remains'])}"
    tests = "<br>".join(cited(name, evidence) for name in one["tests"])
    return (f"| {one['id']} | {plain(one['requirement'])} | {plain(one['situation'])} {plain(one['harm'])} | "
            f"{one['severity']} | {control} | {tests} |\n")


def open_row(one):
    return (f"| {one['id']} | {plain(one['requirement'])} | {plain(one['situation'])} {plain(one['harm'])} | "
            f"{one['severity']} | {plain(one['instead'])} |\n")


def page(requirements, hazards, open_control, evidence):
    held = [one for one in requirements if one["control"] != open_control]
    left = [one for one in requirements if one["control"] == open_control]
    names = {name for one in held for name in one["tests"]}
    text = INTRODUCTION + (f"{len(requirements)} requirements: {len(held)} are held, by {len(names)} tests and rows; "
                           f"{len(left)} are open.\n")
    if left:
        text += "\n" + OPEN_WORDS + "".join(open_row(one) for one in left)
    for hazard in hazards:
        rows = [held_row(one, evidence) for one in held if one["hazard"] == hazard]
        if rows:
            text += f"\n## {hazard.capitalize()}\n\n{HELD_HEAD}" + "".join(rows)
    return text
