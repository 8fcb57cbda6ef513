"""Set-up when C alone changes, by PETSc's events, for multigridcost.py.

python3 change.py <plugin> <prefix> <prefix>: two systems of the same A; prints one JSON line per solve, C in turn.
"""
import json
import sys

import numpy
import petsc4py

PLUGIN, PREFIXES = sys.argv[1], sys.argv[2:4]
petsc4py.init(["change", "-dll_append", PLUGIN])
from petsc4py import PETSc  # noqa: E402 (PETSc reads its arguments at the import)
from direct import load_system  # noqa: E402

TURNS = 7


def seconds(name):
    return PETSc.Log.Event(name).getPerfInfo()["time"]


def main():
    PETSc.Log.begin()
    (A, C, f, g), (_, other, _, other_g) = (load_system(prefix) for prefix in PREFIXES)
    systems = []
    for matrix, values in ((C, g), (other, other_g)):
        K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(matrix)], [matrix, None]], comm=PETSc.COMM_SELF)
        K.assemble()
        b = K.createVecLeft()
        b.setArray(numpy.concatenate([f.getArray(), values.getArray()]))
        systems.append((K, b, matrix.getSize()[0]))
    ksp = PETSc.KSP().create(comm=PETSc.COMM_SELF)
    ksp.setType("preonly")
    ksp.getPC().setType("ainsworth")
    for turn in range(TURNS):
        K, b, rows = systems[turn % 2]
        x, r = K.createVecRight(), b.duplicate()
        ksp.reset()  # PETSc wants it where the number of rows is another
        ksp.setOperators(K)
        before = seconds("PCSetUp")
        ksp.setUp()
        after = seconds("PCSetUp")
        ksp.solve(b, x)
        K.mult(x, r)
        r.axpy(-1.0, b)
        print(json.dumps({"rows": rows, "unknowns": A.getSize()[0], "setup": after - before, "residual": r.norm() / b.norm()}), flush=True)


main()
