#!/usr/bin/env python3
"""Iterations of the programs of tutorials/foreign/ on 1 and 2 ranks, as their tests run them: the last column of
docs/layouts.csv.

/usr/bin/python3 docs/study/foreign.py
    needs a build with tests (AINSWORTH_BUILD, default build/) and the programs' packages
"""
import argparse
import os
import re
import subprocess

from common import machine, measured

PATH, COLUMN = os.path.join(machine.ROOT, "docs", "layouts.csv"), "iterations on 1 and 2 ranks"


def iterations(name, ranks):
    """The least and the most of all solves; None if there is no such test, it is skipped, or fails. 0 ranks: a program
    that is not run by mpiexec.
    """
    run = subprocess.run(["ctest", "--test-dir", machine.BUILD, "-V", "-R", "^layouts_%s_np%d$" % (name, ranks)],
        capture_output=True, text=True)
    found = [int(n) for n in re.findall(r"solve converged due to \w+ iterations (\d+)$", run.stdout, re.MULTILINE)]
    if run.returncode or not found:
        return None
    return "%d" % min(found) if min(found) == max(found) else "%d to %d" % (min(found), max(found))


def main():
    """See above."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    _, rows = measured.read(PATH)
    for row in rows:
        serial, *counts = [iterations(row["program"].split(".")[0], ranks) for ranks in (0, 1, 2)]
        if all(counts):
            row[COLUMN] = ", ".join(counts)
        elif serial:
            row[COLUMN] = serial
        was_run = all(counts) or serial
        print("%s: %s%s" % (row["program"], row[COLUMN], "" if was_run else ", as before: it was not run"), flush=True)
    measured.save(PATH, measured.provenance(), list(rows[0]), rows)


if __name__ == "__main__":
    main()
