#!/usr/bin/env python3
"""Sequences of systems, one KSP for all steps beside a new one for each: docs/sequence.csv, and the table of
docs/contact.md on the screen.

python3 docs/study/sequence.py [--cases rows75 ...]
    some minutes; processor seconds, so that other programs matter less
"""
import argparse
import csv
import os
import re
import subprocess

from common import machine

SEQUENCE = os.path.join(machine.BUILD, "bench", "sequence")
SMALL, MIDDLE, LARGE = ("-n1 12 -n2 10 -E2 10 -near_nullspace", "-n1 24 -n2 20 -E2 10 -near_nullspace",
                        "-n1 32 -n2 28 -E2 10 -near_nullspace")
HYPRE, GAMG = " -ainsworth_pc_type hypre", " -ainsworth_pc_type gamg"
ACTIVE_SET = " -active_set -snes_type ainsworthactiveset"
CASES = {
    "rows75": MIDDLE + " -change rows -changed 0.01 -steps 5",
    "rows181": LARGE + " -change rows -changed 0.01 -steps 5",
    "contact75": MIDDLE + " -change contact -stick 0 -bulge 0.01 -steps 8" + ACTIVE_SET,
    "contact181": LARGE + " -change contact -stick 0 -bulge 0.01 -steps 8" + ACTIVE_SET,
    "values75": MIDDLE + " -change values -changed 0.01 -steps 5",
    "rhs75": MIDDLE + " -change rhs -steps 4",
    "A10": SMALL + " -change A -changed 0.1 -steps 8",
    "A50": SMALL + " -change A -changed 0.5 -steps 8",
    "hypre_rows": SMALL + HYPRE + " -change rows -changed 0.01 -steps 8",
    "hypre_A10": SMALL + HYPRE + " -change A -changed 0.1 -steps 8",
    "hypre_A50": SMALL + HYPRE + " -change A -changed 0.5 -steps 8",
    "gamg_A10": SMALL + GAMG + " -change A -changed 0.1 -steps 8",
}


def run(options):
    """One row for each step, as the program prints them, and its lines on the active set."""
    command = machine.launcher(1) + [SEQUENCE, "-dll_append",
                                     machine.PLUGIN] + (machine.DEFAULTS + " -compare " + options).split()
    text = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env=machine.ENVIRONMENT).stdout
    return (list(csv.DictReader(line for line in text.splitlines() if line.count(",") > 5)),
            re.findall("active set, .*", text))


def total(steps, prefix):
    return sum(float(step[prefix + "setup_cpu_s"]) + float(step[prefix + "solve_cpu_s"]) for step in steps)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs", "sequence.csv"))
    arguments = parser.parse_args()
    rows, notes = [], []
    print("| | rows that change | first set-up | later ones | iterations | with a new KSP | all / with a new KSP "
          "|\n|---|---|---|---|---|---|---|")
    for name in arguments.cases:
        steps, sets = run(CASES[name])
        rows += [dict({"case": name, "options": CASES[name]}, **step) for step in steps]
        later = sorted(float(step["setup_cpu_s"]) for step in steps[1:])
        print("| %s | %s | %.3f | %.3f to %.3f | %s | %s | %.2f |" % (
            name, ", ".join(step["changes"] for step in steps[1:]), float(steps[0]["setup_cpu_s"]), later[0], later[-1],
            ", ".join(step["iterations"] for step in steps),
            ", ".join(step["new_iterations"] for step in steps), total(steps, "") / total(steps, "new_")), flush=True)
        notes += ["%s, %s" % (name, line) for line in sets]
    print("\n" + "\n".join(notes))
    with open(arguments.out, "w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


if __name__ == "__main__":
    main()
