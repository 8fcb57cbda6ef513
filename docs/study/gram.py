#!/usr/bin/env python3
"""What the factorization of the Gram matrix and solves with it cost: docs/gram.csv and a part of docs/cost.md.

python3 docs/study/gram.py packages [--rows 10000 100000 1000000]
    one rank: PETSc's Cholesky, CHOLMOD, MUMPS, and what is chosen
python3 docs/study/gram.py networks [--rows 3000 10000 30000]
    one rank: the same on networks, and the search for dependent rows
python3 docs/study/gram.py ranks [--rows 100000] [--ranks 1 2 4]
    -pc_ainsworth_rows_per_rank
python3 docs/study/gram.py --report
    the text from the CSV; the others end with it, too
Needs Debian's python3-numpy and a build (AINSWORTH_BUILD, default build/); a million rows need 6 GB. Flat surfaces
without the volumes below them.
"""
import argparse
import os
import sys

from common import machine, measured


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    measured.experiment(parser, ("packages", "networks", "ranks"))
    parser.add_argument("--rows", type=int, nargs="+", help="rows of C, about")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--rows-per-rank", type=int, nargs="+", default=[5000, 25000, 100000])
    parser.add_argument("--surface", nargs="+", default=["along the axes", "turned"],
                        choices=("along the axes", "turned"))
    parser.add_argument("--repeat", type=int, default=3, help="times are the least of this many runs (default 3)")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"), help="folder of gram.csv and cost.md")
    arguments = parser.parse_args()
    if not arguments.report:
        machine.require("numpy")
    from common import gram
    if arguments.experiment == "packages":
        gram.packages(arguments)
    elif arguments.experiment == "networks":
        gram.networks(arguments)
    elif arguments.experiment == "ranks":
        gram.ranks(arguments)
    gram.write(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
