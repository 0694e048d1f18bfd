"""Writes what was found of planted defects, for mutants.py."""


def words_of(result):
    """Which law broke in which seeds."""
    if "why" in result:
        return "not judged: " + result["why"].split("\n")[0]
    seeds = {law: sorted((seed for seed, laws in result["campaign"].items() if law in laws), key=lambda s: (len(s), s))
             for law in sorted({law for laws in result["campaign"].values() for law in laws})}
    return "; ".join(f"{law} in {', '.join(of)}" for law, of in seeds.items()) or "-"


def page_of(found, sums, title):
    """found: of each defect what came of it."""
    lines = ["# Planted defects", "", title, "", *sums, "",
             "| defect | where | what is wrong | tests | campaign: law, in seeds |", "|---|---|---|---|---|"]
    for mutant, result in found:
        tests = [f"`{name}`" for name in result.get("tests", [])]
        more = f" and {len(tests) - 2} more" if len(tests) > 3 else ""
        lines.append(f"| {mutant.id} | `{mutant.file}` | {mutant.wrong} | "
                     f"{', '.join(tests[:2] if more else tests) + more or '-'} | {words_of(result)} |")
    return "\n".join(lines) + "\n"


def sums_of(found):
    """Lines that say it, how many a campaign found, and how many anybody."""
    by_campaign = [mutant.id for mutant, result in found if result.get("campaign")]
    by_tests = [mutant.id for mutant, result in found if result.get("tests")]
    either = set(by_campaign) | set(by_tests)
    unjudged = [mutant.id for mutant, result in found if "why" in result]
    missed = [mutant.id for mutant, _ in found if mutant.id not in either and mutant.id not in unjudged]
    unexpected = [mutant.id for mutant, _ in found if mutant.campaign != (mutant.id in by_campaign)]
    lines = [f"Of {len(found)} defects campaigns alone find {len(by_campaign)}, tests {len(by_tests)}, "
             f"both together {len(either)}."]
    lines += [f"Not judged: {', '.join(unjudged)}."] * bool(unjudged)
    lines += [f"Nobody finds: {', '.join(missed)}."] * bool(missed)
    lines += [f"Otherwise than expected by the campaign: {', '.join(unexpected)}."] * bool(unexpected)
    return lines, len(by_campaign), len(either)
