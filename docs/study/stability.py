#!/usr/bin/env python3
"""How stable the iterations are: two cubes over every parameter, against A alone and a direct solution.

python3 docs/study/stability.py [--quick] [--out docs/stability]
    the study: a CSV, a plot, and a part of docs/cost.md
python3 docs/study/stability.py --report
    text and plot anew from the CSV, also of those below
python3 docs/study/stability.py --acceptance
    docs/acceptance.csv and a part of docs/cost.md: the bounds that the defaults keep
python3 docs/study/stability.py --extremes [--case <regex>]
    docs/extremes.csv and a part of docs/extremes.md: extreme systems, four solvers, who is right
Needs Debian's python3-petsc4py, python3-numpy, python3-scipy, python3-matplotlib, and a build (AINSWORTH_BUILD, default
build/).
"""
import argparse
import os
import sys

from common import machine


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="at most three values of each parameter")
    parser.add_argument("--report", action="store_true", help="no runs: write the text and the plot of the study, or "
                        "the text of --acceptance or --extremes, from the CSV")
    parser.add_argument("--acceptance", action="store_true", help="measure the bounds instead")
    parser.add_argument("--extremes", action="store_true", help="extreme systems and four solvers instead")
    parser.add_argument("--case", default="",
                        help="of --extremes, those whose name has this in it; the others stay as they are in the CSV")
    parser.add_argument("--only", default="", help="configurations whose name has this in it (a regular expression); "
                        "the others stay as they are in the CSV")
    parser.add_argument("--out", default=None, help="folder of the CSV and the plots (default docs/stability; of "
                        "--acceptance, --extremes: docs)")
    parser.add_argument("--n1", type=int, default=None, help="elements per edge, upper cube (default 16)")
    parser.add_argument("--n2", type=int, default=None, help="elements per edge, lower cube (default 14)")
    parser.add_argument("--max-it", type=int, default=1000, help="most iterations of the inner solver (default 1000)")
    parser.add_argument("--repeat", type=int, default=3, help="seconds are the least of this many runs (default 3)")
    parser.add_argument("--limit", type=int, default=120,
                        help="seconds for one run, all its repetitions together (default 120)")
    parser.add_argument("--jobs", type=int, default=1,
                        help="systems at a time; more than 1 disturbs the seconds (default 1)")
    arguments = parser.parse_args()
    arguments.n1 = arguments.n1 or 16
    arguments.n2 = arguments.n2 or 14
    if not arguments.report:
        machine.require("petsc4py", "numpy", "scipy", "matplotlib")
    if arguments.acceptance:
        from common import acceptance
        return acceptance.main(arguments.out or os.path.join(machine.ROOT, "docs"), arguments.report)
    if arguments.extremes:
        from common import extremes
        return extremes.main(arguments.out or os.path.join(machine.ROOT, "docs"), arguments)
    from common import report, runs
    folder = os.path.abspath(arguments.out or os.path.join(machine.ROOT, "docs", "stability"))
    if not arguments.report:
        runs.study(folder, arguments)
    report.write(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
