#!/usr/bin/env python3
"""Small runs whose iterations and errors pages name: docs/examples.csv; no seconds are measured.

/usr/bin/python3 docs/study/examples.py [--only REGEX]      minutes; other rows of the CSV stay
docs/study/figures.py brings them to the pages.
"""
import argparse
import os
import re
import sys

from common import examples, machine

OURS = machine.DEFAULTS + " -ainsworth_ksp_converged_reason "
CUBES = OURS + "-n1 24 -n2 20 -E2 10 "
LARGE = OURS + "-n1 40 -n2 34 -near_nullspace -ainsworth_pc_mg_cycle_type "
BEAM = "-scene beam -unknowns 47000 -ksp_type cg -pc_type blocksa -ksp_converged_reason -near_nullspace "
SMOOTHED = (("frame", "-scene frame"), ("flat elements", "-scene stretched -aspect 10"),
            ("flatter elements", "-scene stretched -aspect 100"))
FRICTION = machine.DEFAULTS + " -n1 16 -n2 14 -mu 0.2"
TIGHT = OURS + "-ainsworth_ksp_rtol 1e-12 "
COLUMN = "-eps_type ainsworth -near_nullspace -E2 1 -height 20 -prestress 0,0,-1 -swapped -eps_nev 4 "
PAPER = " -pc_ainsworth_variant paper -pc_ainsworth_pmat "
RUNS = [  # name, ranks, program, options
    ("A alone", 2, "bench/twocubes", CUBES + "-near_nullspace -contact 0"),
    ("beam, modes", 1, "bench/scenes", BEAM + "1"),
    ("beam", 1, "bench/scenes", BEAM + "0"),
    ("thin plate", 1, "bench/scenes", OURS + "-scene plate_block -aspect 1000 -nz 1 -unknowns 50000"),
    ("W-cycle", 1, "bench/twocubes", LARGE + "w"),
    ("V-cycle", 1, "bench/twocubes", LARGE + "v"),
    ("friction", 1, "tutorials/friction", FRICTION),
    ("friction, loose", 1, "tutorials/friction", FRICTION + " -ainsworth_ksp_rtol 1e-2"),
    ("slips", 1, "tutorials/friction", machine.DEFAULTS + " -n1 6 -n2 5 -mu 0 -compare_slips"),
    ("sticks", 1, "tutorials/friction", machine.DEFAULTS + " -n1 6 -n2 5 -mu 100 -compare_tied"),
    ("mortar", 1, "tutorials/mortar", TIGHT + "-n1 6 -n2 5 -rows mortar"),
    ("node", 1, "tutorials/mortar", TIGHT + "-n1 6 -n2 5 -rows node"),
    ("mortar, long", 1, "tutorials/mortar", TIGHT + "-n1 4 -n2 16 -nz2 8 -rows mortar"),
    ("node, long", 1, "tutorials/mortar", TIGHT + "-n1 4 -n2 16 -nz2 8 -rows node"),
    ("cell", 1, "tutorials/cell", OURS + "-n 6 -contrast 20 -ainsworth_ksp_rtol 1e-11"),
    ("steps", 1, "dynamics.py", TIGHT),
    ("steps, ksponly", 1, "dynamics.py", TIGHT + "-snes_type ksponly"),
]
for name, scene in SMOOTHED:
    for more, smoother in (("", "decide"), (", Jacobi", "jacobi")):
        RUNS.append((name + more, 1, "bench/scenes", scene + " -unknowns 50000 -ksp_type cg -pc_type blocksa "
                     "-ksp_converged_reason -ksp_view -pc_blocksa_smoother " + smoother))
for n in (2, 4, 8):
    RUNS.append(("column %d" % n, 2, "bench/modes", COLUMN + "-n1 %d -n2 %d -nz1 %d -nz2 %d" % (n, n, 20 * n, 20 * n)))
for pmat in examples.PMATS:
    RUNS += [("paper " + pmat, ranks, "bench/twocubes", CUBES + PAPER + pmat) for ranks in (1, 2, 3, 4)]
    for more in examples.VARIATIONS:
        RUNS.append(("paper %s %s" % (pmat, more), 2, "bench/twocubes", CUBES + more + PAPER + pmat))
RESULT = re.compile(r"^(?:patch|cell|slips|tied|friction|modes|result): (.*)$", re.MULTILINE)
ITERATIONS = re.compile(r" iterations (\d+)$|(\d+) iterations,|^modes: .*iterations=(\d+)", re.MULTILINE)
OTHERS = ("cpu_s", "seconds", "setup_s", "solve_s", "peak_mib", "primal_residual", "constraint_residual", "iterations")


def measure(name, ranks, program, options):
    library = "libainsworthslepc.so" if program.endswith("modes") else "libainsworth.so"
    command = [os.path.join(machine.BUILD, program)]
    if program.endswith(".py"):
        command = [sys.executable, os.path.join(machine.ROOT, "tutorials", program)]
    command += ["-dll_append", os.path.join(machine.BUILD, library), *options.split()]
    text = machine.output(machine.launcher(ranks) + command, 600)
    said = [word.split("=", 1) for line in RESULT.findall(text) for word in line.split() if "=" in word]
    said += re.findall(r"^the (energy) changes by (\S+) ", text, re.MULTILINE)
    said += re.findall(r"(condition) number of Jacobi .* at least (\S+)", text)
    said += [("eigenvalue", value) for value in re.findall(r"^  (\S+)  residual", text, re.MULTILINE)[:1]]
    counts = [next(filter(None, found)) for found in ITERATIONS.findall(text)]
    if not counts or not said or "did not converge" in text:
        sys.exit("%s %s\n%s" % (program, options, text))
    if len(counts) > 20:  # of steps in time
        counts = sorted(set(counts), key=int)
    results = ["%s=%s" % (key, value) for key, value in said if key not in OTHERS]
    return name, ranks, " ".join([program, *options.split()]), counts, results


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="names that have this in them, a regular expression")
    arguments = parser.parse_args()
    machine.require("petsc4py")
    for run in RUNS:
        if re.search(arguments.only, run[0]):
            examples.put(*measure(*run))


if __name__ == "__main__":
    main()
