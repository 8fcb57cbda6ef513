#!/usr/bin/env python3
"""Modes of tied cubes that nothing holds, by multigrid in Ker C and by shift-and-invert with MUMPS:
docs/modes/modes.csv.

python3 docs/study/modes.py [--n 8 13 22] [--nev 20]
    minutes; seconds count on an otherwise idle machine; other rows of the CSV stay
docs/study/figures.py brings them to docs/modes.md.
"""
import argparse
import os
import re

from common import machine, measured

PROGRAM, LIBRARY = (os.path.join(machine.BUILD, name) for name in ("bench/modes", "libainsworthslepc.so"))
OURS = "-eps_type ainsworth -dll_append %s" % LIBRARY
DIRECT = ("-layout aij -eps_type krylovschur -eps_ncv 60 -st_type sinvert -eps_target -0.1 -eps_target_magnitude "
          "-st_ksp_type preonly -st_pc_type lu -st_pc_factor_mat_solver_type mumps")
# of elastic eigenvalues, the largest
COLUMNS = ["unknowns", "modes", "iterations", "seconds", "MiB", "MUMPS seconds", "MUMPS MiB", "difference"]


def run(options):
    text = machine.output([PROGRAM, *options.split()], 3600)
    found = re.search(r"^modes: unknowns=(\d+) .*converged=(\d+) iterations=(\d+) seconds=(\S+) peak_mib=(\d+)", text,
                      re.MULTILINE)
    if not found:
        raise SystemExit("%s %s\n%s" % (PROGRAM, options, text))
    return found.groups(), [float(word) for word in re.findall(r"^  (\S+)  residual", text, re.MULTILINE)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n", type=int, nargs="+", default=[8, 13, 22],
                        help="elements along an edge of each cube (default 8 13 22)")
    parser.add_argument("--nev", type=int, default=20, help="modes (default 20), six of which are rigid")
    arguments = parser.parse_args()
    rows = []
    for n in arguments.n:
        system = "-model ties -free -near_nullspace -n1 %d -n2 %d -eps_nev %d " % (n, n, arguments.nev)
        (unknowns, _, iterations, seconds, memory), ours = run(system + OURS)
        (_, _, _, peer, most), direct = run(system + DIRECT)
        elastic = [abs(a / b - 1) for a, b in zip(ours, direct) if b > 1e-6 * direct[-1]]
        rows.append(dict(zip(COLUMNS, (unknowns, arguments.nev, iterations, seconds, memory, peer, most,
                                       "%.1e" % max(elastic)))))
        print(rows[-1], flush=True)
    measured.merge(os.path.join(machine.ROOT, "docs", "modes", "modes.csv"), measured.provenance(), COLUMNS, rows,
                   ["unknowns", "modes"])


if __name__ == "__main__":
    main()
