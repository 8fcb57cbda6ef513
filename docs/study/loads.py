#!/usr/bin/env python3
"""Many loads at once beside as many solves: docs/modes/loads.csv.

python3 docs/study/loads.py [--n 6 13 22 36] [--repeat 9]
    minutes; seconds count on an otherwise idle machine; other rows of the CSV stay
docs/study/figures.py brings them to docs/modes.md.
"""
import argparse
import os
import re

from common import machine, measured

PROGRAM, LIBRARY = (os.path.join(machine.BUILD, name) for name in ("bench/loads", "libainsworth.so"))
# seconds one after the other and at once; of the solutions, the largest
COLUMNS = ["model", "unknowns", "loads", "each", "all", "ratio", "difference"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n", type=int, nargs="+", default=[6, 13, 22, 36],
                        help="elements along an edge of each cube (default 6 13 22 36)")
    parser.add_argument("--repeat", type=int, default=9,
                        help="times that both are timed, in turns; the least counts (default 9)")
    parser.add_argument("--models", nargs="+", default=["ties", "periodic"],
                        help="of build/bench/loads (default ties periodic)")
    arguments = parser.parse_args()
    rows = []
    for model in arguments.models:
        for n in arguments.n:
            for loads in (6, 8, 32):
                options = ("-dll_append %s -pc_type ainsworth -ksp_type preonly -near_nullspace -n1 %d -n2 %d "
                           "-model %s -loads %d -repeat %d" % (LIBRARY, n, n, model, loads, arguments.repeat))
                text = machine.output([PROGRAM, *options.split()], 3600)
                found = re.search(r"^loads: .*unknowns=(\d+).*each_s=(\S+) all_s=(\S+) ratio=(\S+) difference=(\S+)",
                                  text, re.MULTILINE)
                if not found:
                    raise SystemExit("%s %s\n%s" % (PROGRAM, options, text))
                unknowns, *rest = found.groups()
                rows.append(dict(zip(COLUMNS, (model, unknowns, loads, *rest))))
                print(rows[-1], flush=True)
    measured.merge(os.path.join(machine.ROOT, "docs", "modes", "loads.csv"), measured.provenance(), COLUMNS, rows,
                   ["model", "unknowns", "loads"])


if __name__ == "__main__":
    main()
