#!/usr/bin/env python3
r"""Two lattices of springs tied by Lagrange multipliers, pulled apart: ex1.c in Python.

$ mpiexec -n 2 python3 ex1.py -dll_append libainsworth.so -ksp_type preonly -pc_type ainsworth \
    -ainsworth_ksp_converged_reason
  Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 10
6400 unknowns, 80 multipliers; the ties carry 1.000000
"""
import sys

import petsc4py

petsc4py.init(sys.argv)
from petsc4py import PETSc  # noqa: E402 (PETSc reads its arguments at the import)

n = PETSc.Options().getInt("n", 40)  # nodes along each side of both lattices
N, M = 4 * n * n, 2 * n  # node (i, j) of lattice l is l n^2 + i n + j, and has two displacements

A = PETSc.Mat().create()
A.setSizes(N)
A.setBlockSize(2)  # displacements of a node: multigrid needs to know
A.setType("aij")
A.setPreallocationNNZ((18, 18))
X = A.createVecRight()  # coordinates
first, last = A.getOwnershipRange()
for node in range(first // 2, last // 2):
    i, j, own = node // n % n, node % n, [2 * node, 2 * node + 1]
    X.setValues(own, [node // n, j])
    if node < n:  # the left edge of the left lattice is held
        A.setValues(own, own, [1, 0, 0, 1], addv=True)
    for di, dj in ((1, 0), (0, 1), (1, 1), (-1, 1)):
        if 0 <= i + di < n and j + dj < n:
            other, d = node + di * n + dj, (di, dj, -di, -dj)
            ends = own + [2 * other, 2 * other + 1]
            A.setValues(ends, ends, [a * b / (di * di + dj * dj) for a in d for b in d], addv=True)
A.assemble()
A.setOption(PETSc.Mat.Option.SPD, True)
X.assemble()
A.setNearNullSpace(PETSc.NullSpace().createRigidBody(X))  # multigrid is two to five times faster with it

C = PETSc.Mat().createAIJ(((None, M), (A.getLocalSize()[1], N)), nnz=(2, 2))
for row in range(*C.getOwnershipRange()):
    C.setValues([row], [2 * n * (n - 1) + row, 2 * n * n + row], [1, -1])
C.assemble()

K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])
primal, dual = K.getNestISs()[0]
b, y = K.createVecLeft(), K.createVecRight()
load = b.getSubVector(primal)
for node in range(2 * n * n - n, 2 * n * n):  # the right edge of the right lattice is pulled
    if first <= 2 * node < last:
        load.setValue(2 * node, 1 / n)
load.assemble()
b.restoreSubVector(primal, load)

ksp = PETSc.KSP().create()
ksp.setOperators(K)
ksp.setErrorIfNotConverged(True)
ksp.setFromOptions()
ksp.solve(b, y)
force = y.getSubVector(dual).sum()  # the multipliers are the forces in the ties
PETSc.Sys.Print("%d unknowns, %d multipliers; the ties carry %f" % (N, M, -force.real))
