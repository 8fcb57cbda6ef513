#!/usr/bin/env python3
"""How sharp the estimates of -pc_ainsworth_monitor_error are, and what they cost: CSVs in docs/estimate and a part of
docs/cost.md.

/usr/bin/python3 docs/study/estimate.py sharp [--n1 12 24] [--cases base ...]
    bounds against the true error, on the systems of docs/study/errortime.py
/usr/bin/python3 docs/study/estimate.py cost [--n1 24 48]
    solves with the monitor, without and with the residuals, against solves without it
/usr/bin/python3 docs/study/estimate.py --report
    the text from the CSVs; the others end with it, too
Needs a build (AINSWORTH_BUILD, default build/); seconds need an otherwise idle machine.
"""
import argparse
import os
import sys

from common import errors, estimate, machine, measured


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    measured.experiment(parser, ("sharp", "cost"))
    parser.add_argument("--n1", type=int, nargs="+",
                        help="elements per edge of the upper cube; the lower one has 5/6 of it")
    parser.add_argument("--cases", nargs="+", default=list(errors.CASES), choices=list(errors.CASES),
                        help="systems (sharp; default all); other rows of the CSV stay")
    parser.add_argument("--references", help="folder that keeps the exact solutions (sharp); those that are there are "
                        "not computed again")
    parser.add_argument("--repeat", type=int, default=7, help="runs of each kind, in turns (cost; default 7)")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs", "estimate"),
                        help="folder of the CSVs; the text is in cost.md beside it")
    arguments = parser.parse_args()
    arguments.out = os.path.abspath(arguments.out)
    if not arguments.report:
        machine.require()
    os.makedirs(arguments.out, exist_ok=True)
    if arguments.experiment == "sharp":
        estimate.sharp(arguments.out, arguments.cases, arguments.n1 or [12, 24], arguments.references)
    elif arguments.experiment == "cost":
        estimate.cost(arguments.out, arguments.n1 or [24, 48], arguments.repeat)
    estimate.write(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
