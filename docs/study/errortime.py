#!/usr/bin/env python3
"""Error against run time: every solver of tests/bench/solvers on two-cube systems: a CSV for each system, diagrams, a
heat map and a part of docs/cost.md.

python3 docs/study/errortime.py [--n1 12 24 48] [--cases base soft ...] [--out docs/error-vs-time]
    measures, draws, writes
python3 docs/study/errortime.py --system A.mtx C.mtx f.mtx [g.mtx] [--block-size 3] [--out here]
    your own system: a table, and diagrams
python3 docs/study/errortime.py --report [--out ...]
    diagrams and text anew from the CSVs
Each solver is a process of its own, one after the other. Needs Debian's python3-matplotlib and a build
(AINSWORTH_BUILD, default build/).
"""
import argparse
import os
import sys

from common import errors, errorspage, machine


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n1", type=int, nargs="+", default=[12],
                        help="elements per edge of the upper cube; the lower one has 5/6 of it (default 12)")
    parser.add_argument("--cases", nargs="+", default=list(errors.CASES), choices=list(errors.CASES),
                        help="systems (default all)")
    parser.add_argument("--solvers", nargs="+", default=None, help="names or files of option files (default all of "
                        "tests/bench/solvers); rows of others in the CSV stay")
    parser.add_argument("--ranks", type=int, default=1, help="MPI ranks (default 1)")
    parser.add_argument("--first", type=int, default=1, help="tolerances from 10^-first (default 1)")
    parser.add_argument("--last", type=int, default=12, help="to 10^-last (default 12)")
    parser.add_argument("--step", type=int, default=1, help="in steps of 10^-step (default 1)")
    parser.add_argument("--repeat", type=int, default=3, help="seconds are the least of this many runs (default 3)")
    parser.add_argument("--enough", type=float, default=20,
                        help="repeat a tolerance no more after this many seconds (default 20)")
    parser.add_argument("--limit", type=int, default=900,
                        help="seconds for one solver on one system, all its tolerances (default 900)")
    parser.add_argument("--references",
                        help="folder that keeps the exact solutions; those that are there are not computed again")
    parser.add_argument("--out", help="folder of the CSVs and pictures (default docs/error-vs-time, and error-vs-time "
                        "here for --system); the text is in cost.md beside it")
    parser.add_argument("--system", nargs="+", metavar="FILE",
                        help="A, C, f and, unless it is zero, g, as Matrix Market or PETSc's binary files")
    parser.add_argument("--block-size", type=int, help="unknowns of a node of that A")
    parser.add_argument("--coordinates", metavar="FILE",
                        help="of its nodes, from which multigrid gets rigid-body modes")
    parser.add_argument("--table", action="store_true", help="diagrams, and a table on the terminal in place of a text")
    parser.add_argument("--report", action="store_true", help="no runs: diagrams and text from the CSVs")
    arguments = parser.parse_args()
    machine.require("matplotlib", program=errors.ERRORTIME)
    if arguments.system and len(arguments.system) not in (3, 4):
        parser.error("--system takes A, C, f and perhaps g")
    folder = os.path.abspath(
        arguments.out or ("error-vs-time" if arguments.system else os.path.join(machine.ROOT, "docs", "error-vs-time")))
    if not arguments.report:
        (errors.measure_own if arguments.system else errors.measure)(folder, arguments)
    (errorspage.show if arguments.system or arguments.table else errorspage.write)(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
