#!/usr/bin/env python3
"""Vibration modes of two plates, lattices of springs, that Lagrange multipliers tie together and nothing holds: modes.c
in Python.

$ mpiexec -n 2 python3 modes.py -dll_append libainsworthslepc.so -eps_type ainsworth
6400 unknowns, 80 multipliers: 10 modes in 12 iterations
...

-draw modes.png draws the first three that are not rigid, on one rank.
"""
import math
import sys

import slepc4py

slepc4py.init(sys.argv)
from petsc4py import PETSc  # noqa: E402 (SLEPc reads its arguments at the import)
from slepc4py import SLEPc  # noqa: E402

n = PETSc.Options().getInt("n", 40)  # nodes along each side of both plates
N, m = 4 * n * n, 2 * n  # node (i, j) of plate l is l n^2 + i n + j, and has two displacements

A = PETSc.Mat().create()  # as in ex1.py, but no node is held
A.setSizes(N)
A.setBlockSize(2)
A.setType("aij")
A.setPreallocationNNZ((18, 18))
X = A.createVecRight()  # coordinates
first, last = A.getOwnershipRange()
for node in range(first // 2, last // 2):
    i, j, own = node // n % n, node % n, [2 * node, 2 * node + 1]
    X.setValues(own, [node // n, j])
    for di, dj in ((1, 0), (0, 1), (1, 1), (-1, 1)):
        if 0 <= i + di < n and j + dj < n:
            other, d = node + di * n + dj, (di, dj, -di, -dj)
            ends = own + [2 * other, 2 * other + 1]
            A.setValues(ends, ends, [a * b / (di * di + dj * dj) for a in d for b in d], addv=True)
A.assemble()
A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
X.assemble()
A.setNearNullSpace(PETSc.NullSpace().createRigidBody(X))  # for the interpolation of multigrid, as always

mass = PETSc.Mat().createAIJ(A.getSizes(), nnz=1)  # 1 for each node
for row in range(first, last):
    mass.setValue(row, row, 1)
mass.assemble()

C = PETSc.Mat().createAIJ(((None, m), (A.getLocalSize()[1], N)), nnz=(2, 2))
for row in range(*C.getOwnershipRange()):
    C.setValues([row], [2 * n * (n - 1) + row, 2 * n * n + row], [1, -1])
C.assemble()

K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])
# an empty block tells how many multipliers M has
none = PETSc.Mat().createAIJ((C.getSizes()[0], C.getSizes()[0]), nnz=0)
none.assemble()
M = PETSc.Mat().createNest([[mass, None], [None, none]])

eps = SLEPc.EPS().create()
eps.setOperators(K, M)
eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)  # symmetric, with a mass that is not negative
eps.setWhichEigenpairs(SLEPc.EPS.Which.SMALLEST_REAL)
eps.setDimensions(10)
eps.setFromOptions()
eps.solve()
found = min(eps.getConverged(), 10)
PETSc.Sys.Print("%d unknowns, %d multipliers: %d modes in %d iterations" % (N, m, found, eps.getIterationNumber()))
v, dual = K.createVecRight(), K.getNestISs()[0][1]
shapes = []
for k in range(found):
    value = eps.getEigenpair(k, v).real  # v = [x; multipliers], x' M x = 1
    forces = v.getSubVector(dual).norm(PETSc.NormType.INFINITY)
    PETSc.Sys.Print("  frequency %8.6f, largest force of a tie %8.6f" % (math.sqrt(abs(value)) / (2 * math.pi), forces))
    shapes.append(v.getArray().copy()[:N])

picture = PETSc.Options().getString("draw", "")
if picture:
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(9, 2))
    for axis, shape in zip(axes, shapes[3:6]):
        place = X.getArray().reshape(-1, 2)[:, 1], X.getArray().reshape(-1, 2)[:, 0]
        scale = 0.12 * n / abs(shape).max()
        for plate, color in enumerate(("tab:blue", "tab:orange")):
            here = slice(plate * n * n, (plate + 1) * n * n)
            x = (place[1] + scale * shape[0::2])[here].reshape(n, n) - plate
            y = (place[0] + scale * shape[1::2])[here].reshape(n, n)
            axis.plot(x, y, color=color, linewidth=0.5)
            axis.plot(x.T, y.T, color=color, linewidth=0.5)
        axis.set_aspect("equal")
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(picture, dpi=110)
