#!/usr/bin/env python3
"""Gives every command good, odd and wrong inputs, and holds what happens against what a user would expect.

usage: inputs.py PROGRAMS [--all] [--page FILE] [--only TEXT] [--show]
  PROGRAMS     the folder of birdseye, birdseyed and birdseye-sim
  --all        slow rows too
  --page FILE  writes the table
  --only TEXT  rows whose command, input or command line has that text
  --show       prints what each row printed"""
import argparse
import concurrent.futures
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).parent))
import page
from judge import faults
from rows import all_rows
from running import data_folder, missing_data, run


def judged(number, programs, data):
    """What came of a row and what is wrong with it; of a row whose data is not there, that."""
    row = all_rows()[number]
    if absent := missing_data(row, data):
        return None, [f"skipped: no {absent} in the folder of data"]
    try:
        outcome = run(row, programs, data)
    except (OSError, RuntimeError, subprocess.CalledProcessError) as error:
        return None, [f"its input cannot be made: {error}"]
    return outcome, faults(row, outcome)


def tell(row, outcome, told, show):
    """Prints what is wrong with a row, and with show what it printed. Returns whether anything is."""
    if outcome is None:
        print(f"{row.command}: {row.input}: {told[0]}")
        return not told[0].startswith("skipped")
    if told:
        print(f"FAILED {row.command}: {row.input}\n  $ {row.run}\n  a user would expect: {row.expected}")
        print("".join(f"  but: {line}\n" for line in told), end="")
    if told or show:
        print(f"  [{row.command}: {row.input}] exit {outcome.exit}, {outcome.seconds:.1f} s, {outcome.most_mb:.0f} MB, "
              f"wrote {', '.join(outcome.files) or 'nothing'}")
        print("".join(f"  | {line}\n" for line in outcome.output.splitlines()[:60]), end="", flush=True)
    return bool(told)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("programs", type=Path)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--page", type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--show", action="store_true")
    asked = parser.parse_args()
    rows = all_rows()
    chosen = [number for number, row in enumerate(rows)
              if (asked.all or not row.slow) and asked.only in f"{row.command}: {row.input}: {row.run}"]
    if not chosen:
        sys.exit(f"inputs: no row has {asked.only!r}")
    # For the page one after the other: times are to be those of a command alone.
    workers = 1 if asked.page else len(os.sched_getaffinity(0))
    # Spawned, each has its own port, and little memory, which is counted to the programs that it starts.
    with concurrent.futures.ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        waited = [pool.submit(judged, number, asked.programs.resolve(), data_folder()) for number in chosen]
        results, failed = [], 0
        for number, future in zip(chosen, waited):
            outcome, told = future.result()
            results.append((rows[number], outcome, told))
            failed += tell(rows[number], outcome, told, asked.show)
    print(f"inputs: {len(chosen)} rows, {failed} failed, {sum(outcome is None for _, outcome, _ in results)} skipped")
    if asked.page:
        page.write(asked.page, results)
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
