#!/usr/bin/env python3
"""Saddle points as programs write them, solved with the defaults and by MUMPS: docs/systems.csv and docs/systems.md.

python3 docs/study/systems.py [--ranks 1]      half a minute; needs a build (AINSWORTH_BUILD, default build/) with its tests
"""
import argparse
import csv
import os
import subprocess
import sys
import tempfile

from common import machine, prose

PROGRAM = os.path.join(machine.BUILD, "tests", "systems", "systems")
VERDICTS = ("right", "refused", "owed", "untrue", "wrong")
SAID = ("right", "refused, no solution exists", "refused, but one exists", "refused with untrue words", "wrong")


def solve(ranks, folder, *options):
    """Rows of the program's table."""
    name = os.path.join(folder, "systems.csv")
    subprocess.run(machine.launcher(ranks) + [PROGRAM, "-out", name, *options], env=machine.ENVIRONMENT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(name) as file:
        return list(csv.DictReader(file))


def count(rows, solver):
    return [sum(row[solver] == verdict for row in rows) for verdict in VERDICTS]


def span(numbers):
    """From the least to the largest of sorted ones."""
    return "" if not numbers else str(numbers[0]) if numbers[0] == numbers[-1] else "%d to %d" % (numbers[0], numbers[-1])


def page(rows, ranks):
    families = list(dict.fromkeys(row["family"] for row in rows))
    ours, mumps = count(rows, "ours"), count(rows, "mumps")
    text = ["# Saddle points as programs write them", "",
            "The plugin's defaults solve %d of %d small systems and refuse %d that have no solution. MUMPS with its defaults on the assembled matrix solves %d. "
            "Each system comes from a seeded generator in `tests/systems/`, with the signs, order and blocks that programs of its kind use." % (ours[0], len(rows), ours[1], mumps[0]), "",
            "| | " + " | ".join(SAID) + " |", "|---|" + "---|" * len(SAID)]
    for solver in ("ours", "mumps"):
        figures = {"ours": ours, "mumps": mumps}[solver]
        text.append("| %s | %s |" % ({"ours": "ainsworth", "mumps": "MUMPS"}[solver], " | ".join("" if solver == "mumps" and verdict == "untrue" else str(figure) for verdict, figure in zip(VERDICTS, figures))))
    text += ["", "| family | systems | right | iterations | MUMPS, right |", "|---|---|---|---|---|"]
    for family in families:
        some = [row for row in rows if row["family"] == family]
        iterations = sorted(int(row["iterations"]) for row in some if row["ours"] == "right")
        text.append("| %s | %d | %d | %s | %d |" % (family, len(some), count(some, "ours")[0], span(iterations), count(some, "mumps")[0]))
    text += ["", "## How they are judged", "",
             "- LU with complete pivoting in long double decides whether a system has a solution, whether x is unique, and what x is.",
             "- A solve is right if its reason is positive and each row of both equations holds to 1e-5 of its terms. x has to hold to 1e-5 in units of its own, or to a thousand times what rounding the system to double precision changes.",
             "- What a refusal says is compared with what is true of the system.", "",
             "CTest runs the collection on 1, 2 and 3 ranks. All systems: [systems.csv](systems.csv). Made by `%s` on %s, on %s." % (machine.command_line(), machine.describe(), "one rank" if ranks == 1 else "%d ranks" % ranks)]
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"), help="folder (default docs)")
    arguments = parser.parse_args()
    machine.require()
    if not os.path.exists(PROGRAM):
        sys.exit("%s is missing: build with the tests, which need Eigen" % PROGRAM)
    with tempfile.TemporaryDirectory() as folder:
        ours, mumps = solve(arguments.ranks, folder), solve(arguments.ranks, folder, "-mumps")
    rows = [{"name": a["name"], "n": a["n"], "m": a["m"], "family": a["family"], "ours": a["verdict"], "iterations": a["iterations"] if a["verdict"] == "right" else "", "error": a["error"],
             "mumps": b["verdict"], "mumps_error": b["error"]} for a, b in zip(ours, mumps)]
    with open(os.path.join(arguments.out, "systems.csv"), "w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    prose.write(os.path.join(arguments.out, "systems.md"), page(rows, arguments.ranks))
    figures = count(rows, "ours")
    print("%d systems: %s" % (len(rows), ", ".join("%d %s" % pair for pair in zip(figures, VERDICTS))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
