#!/usr/bin/env python3
"""Multigrid on many kinds of systems (tests/bench/scenes.cpp): docs/multigrid.csv, plots in docs/multigrid/, and a part
of docs/multigrid.md.

/usr/bin/python3 docs/study/multigrid.py
    all families without constraints, all solvers, on 1 rank
/usr/bin/python3 docs/study/multigrid.py --families tied --ranks 1 2 4
    with constraints
/usr/bin/python3 docs/study/multigrid.py --families plate balls6 --solvers blocksa agg1 --sizes 75000 500000
/usr/bin/python3 docs/study/multigrid.py --report
    text and plots anew from the CSV
A system that is measured again takes the place of the old one, solver by solver. Needs a build (AINSWORTH_BUILD,
default build/), Debian's python3-matplotlib and, for the family foreign, python3-getfem; seconds need an otherwise idle
machine. With peak.py between mpiexec and the program, memory is that of the program alone.
"""
import argparse
import os
import sys

from common import families, machine


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--families", nargs="+", default=["alone"], metavar="NAME", help="alone, tied, all, or of: "
                        + " ".join(entry[0] for entry in families.ALONE + families.TIED))
    parser.add_argument("--solvers", nargs="+", default=["all"], metavar="NAME",
                        help="all, or of: " + " ".join(entry[0] for entry in families.SOLVERS))
    parser.add_argument("--sizes", nargs="+", type=int, default=[50000], help="unknowns, about (default 50000)")
    parser.add_argument("--ranks", nargs="+", type=int, default=[1], help="numbers of ranks (default 1)")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each, in turns (default 3)")
    parser.add_argument("--limit", type=int, default=120, help="seconds that one run may take (default 120)")
    parser.add_argument("--report", action="store_true", help="no runs")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"), help="folder (default docs)")
    arguments = parser.parse_args()
    machine.require("matplotlib")
    path = os.path.join(os.path.abspath(arguments.out), "multigrid.csv")
    os.makedirs(os.path.dirname(path), exist_ok=True)
    if not arguments.report:
        from common import multigrid
        try:
            multigrid.study(path, arguments)
        except ValueError as error:
            sys.exit(str(error))
    from common import multigridpage
    multigridpage.write(path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
