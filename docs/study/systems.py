#!/usr/bin/env python3
"""Saddle points as programs write them, solved with the defaults and by MUMPS: docs/systems.csv and a part of
docs/extremes.md.

python3 docs/study/systems.py [--ranks 1]
    half a minute; needs a build (AINSWORTH_BUILD, default build/) with its tests; --report: the text anew from the CSV
"""
import argparse
import csv
import os
import subprocess
import sys
import tempfile

from common import machine, measured, prose

PROGRAM = os.path.join(machine.BUILD, "tests", "systems", "systems")
VERDICTS = ("right", "refused", "owed", "untrue", "wrong")
SAID = ("right", "refused, no solution exists", "refused, but one exists", "refused with untrue words", "wrong")


def solve(ranks, folder, *options):
    """Rows of the program's table."""
    name = os.path.join(folder, "systems.csv")
    subprocess.run(machine.launcher(ranks) + [PROGRAM, "-out", name, *options], env=machine.ENVIRONMENT,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(name) as file:
        return list(csv.DictReader(file))


def count(rows, solver):
    return [sum(row[solver] == verdict for row in rows) for verdict in VERDICTS]


def write(folder):
    about, rows = measured.read(os.path.join(folder, "systems.csv"))
    ours, mumps = count(rows, "ours"), count(rows, "mumps")
    text = ["The defaults solve %d of %d small systems of %d families (`tests/systems/`), and refuse %d that have no "
            "solution:" % (
                ours[0], len(rows), len({row["family"] for row in rows}), ours[1]), "",
            "| | " + " | ".join(SAID) + " |", "|---|" + "---|" * len(SAID)]
    for title, figures in (("ainsworth", ours), ("MUMPS", mumps)):
        text.append("| %s | %s |" % (title, " | ".join("" if figures is mumps and verdict == "untrue" else str(figure)
                                                       for verdict, figure in zip(VERDICTS, figures))))
    text += ["", "LU with complete pivoting in long double decides what is right: rows hold to 1e-5 of their terms, "
             "and x to 1e-5, or to a thousand times what rounding the system changes. Made by `%s` on %s; "
             "[systems.csv](systems.csv)." % (about["command"], about["machine"])]
    prose.part(os.path.join(folder, "extremes.md"), "systems.py", text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"), help="folder (default docs)")
    parser.add_argument("--report", action="store_true", help="no runs")
    arguments = parser.parse_args()
    if not arguments.report:
        machine.require()
        if not os.path.exists(PROGRAM):
            sys.exit("%s is missing: build with the tests, which need Eigen" % PROGRAM)
        with tempfile.TemporaryDirectory() as folder:
            ours, mumps = solve(arguments.ranks, folder), solve(arguments.ranks, folder, "-mumps")
        rows = [{"name": a["name"], "n": a["n"], "m": a["m"], "family": a["family"], "ours": a["verdict"],
                 "iterations": a["iterations"] if a["verdict"] == "right" else "", "error": a["error"],
                 "mumps": b["verdict"], "mumps_error": b["error"]} for a, b in zip(ours, mumps)]
        measured.save(os.path.join(arguments.out, "systems.csv"), measured.provenance(), list(rows[0]), rows)
        print("%d systems: %s" % (len(rows), ", ".join("%d %s" % pair for pair in zip(count(rows, "ours"), VERDICTS))))
    write(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
