#!/usr/bin/env python3
"""Small parts of docs/study/parts.py, meshed and solved here on the ranks of mpiexec.

python3 check.py <plugin> <part>... with PETSC_OPTIONS="-dll_append <plugin>"

A part with a colon and springs (D from 1e-8 to 10 times the flexibility under each row) or oblique (B is not C) after
it is changed so. A file of contact (tutorials/contact/peers -write FILE) with :central is the system of an
interior-point method.

For each part, with rigid-body modes: the solve converges and stays with the multigrid, rows of C hold to rounding, x is
that of MUMPS, refined, and the iterations are about those of the clamped part without constraints. Elimination of the
constraints, a peer of the studies, leads to the same x.
"""
import json
import os
import sys
import traceback

try:
    import gmsh  # noqa: F401
    import numpy
    import petsc4py  # noqa: F401
    import scipy  # noqa: F401
except ImportError as reason:
    print("skipped:", reason)
    sys.exit(77)

STUDY = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs", "study")
sys.path[:0] = [STUDY, os.path.join(STUDY, "common")]
import parts  # noqa: E402
import partsolver  # noqa: E402 (which initializes PETSc)
from parts import files  # noqa: E402

FIRST = partsolver.COMM.getRank() == 0
ENERGY = 1e-6               # error of x, in energy
ROWS, SPRINGS = 1e-13, 1e-7  # Cx - g - D lambda over the largest of x; with D it is a residual, else rounding
CHANGES = {"": lambda part: part, "springs": lambda part: part.joined(-8, 1),
           "oblique": lambda part: part.oblique(0.5), "central": lambda part: part.central(-4)}
ELIMINATED = ("flange", "cell", "rebars")  # not where a dense matrix comes of it, or B is not C
# most iterations: times those of the clamped part, where the whole joint of the housing is at rest, and more
# (GMRES reduces the residual, not the energy; another mesher's sector takes 32 for 25 on three ranks)
RATIO, MORE = {"housing": 1.6, "sector": 1.3, "oblique": 1.6, "springs": 1.4}, 2


def make(name, folder):
    """Files of a part with its exact solution, by one rank alone; their sizes."""
    name, _, change = name.partition(":")
    whole = files.read_contact(name) if os.path.isfile(name) else parts.make(name, *parts.sized(name, "small"))
    part = CHANGES[change](whole)
    sizes = files.petsc_files(part, folder, name in ELIMINATED and not change)
    everyone, partsolver.COMM = partsolver.COMM, partsolver.PETSc.COMM_SELF
    partsolver.JOB.update(folder=folder, sizes=sizes, method="reference", modes=False)
    answer = partsolver.answer()
    partsolver.COMM = everyone
    if answer["state"] != "exact":
        raise RuntimeError("reference: " + answer["state"])
    return sizes


def made(name, folder):
    """Sizes of the part that the first rank makes."""
    path = os.path.join(folder, "sizes.json")
    if FIRST:
        try:
            sizes = make(name, folder)
            with open(path, "w") as file:
                json.dump(sizes, file)
        except Exception:  # the other ranks would wait forever
            traceback.print_exc()
            sys.stderr.flush()
            os._exit(1)
    partsolver.COMM.barrier()
    with open(path) as file:
        return json.load(file)


def faults(name, answer, clamped):
    """What does not hold of a solve."""
    name, _, change = name.partition(":")
    exact = ROWS if name != "laminate" and change not in ("springs", "central") else SPRINGS
    most = max(RATIO.get(name, 1.15), RATIO.get(change, 1.15)) * clamped.get("iterations", 0) + MORE
    total, last = answer.get("iterations", numpy.inf), answer.get("last", 0)
    longest = max(total - last, last)  # of at most two reduced solves
    conditions = {
        "the clamped part is not solved": clamped["state"].startswith("CONVERGED"),
        "not solved": answer["state"].startswith("CONVERGED"),
        "not by multigrid": answer.get("solver") == "multigrid",
        "another x": answer.get("error", numpy.inf) < ENERGY,
        "rows do not hold": answer.get("constraint", numpy.inf) < exact,
        "more than %.1f iterations" % most: longest <= most,
    }
    return [fault for fault, holds in conditions.items() if not holds]


def main(plugin, *names):
    wrong = 0
    for name in names:
        folder = os.path.abspath(name.replace(":", "_"))
        sizes = made(name, folder)
        answers = []
        for method in ("clamped", "ainsworth") + ("eliminated",) * (name in ELIMINATED):
            partsolver.JOB.update(plugin=plugin, folder=folder, sizes=sizes, method=method, modes=True)
            answers.append(partsolver.answer())
        clamped, answer = answers[:2]
        found = faults(name, answer, clamped) + [
            "another x by elimination" for peer in answers[2:] if not peer.get("error", numpy.inf) < ENERGY]
        wrong += bool(found)
        if FIRST:
            print("%s: %d unknowns, %d rows: iterations %s, clamped %s; %s: %s" % (
                name, sizes["unknowns"], sizes["rows"], answer.get("iterations"), clamped.get("iterations"),
                " ".join("%s=%s" % (key, answer.get(key)) for key in ("state", "solver", "error", "constraint")),
                "; ".join(found) or "right"), flush=True)
    if FIRST and not wrong:
        print("parts: right")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
