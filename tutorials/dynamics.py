#!/usr/bin/env python3
"""Two lattices of springs tied by Lagrange multipliers swing: PETSc's implicit method of second order in time.

$ python3 dynamics.py -dll_append libainsworth.so -ksp_type preonly -pc_type ainsworth -ainsworth_ksp_rtol 1e-12
1000 steps of 6400 unknowns with 80 ties, 2 matrices
the energy changes by 2e-13 of itself, C x is at most 0e+00
"""
import sys

import petsc4py

petsc4py.init(sys.argv)
from petsc4py import PETSc  # noqa: E402 (PETSc reads its arguments at the import)

n = PETSc.Options().getInt("n", 40)  # nodes along each side of both lattices
N, M = 4 * n * n, 2 * n  # node (i, j) of lattice l is l n^2 + i n + j, and has two displacements

A = PETSc.Mat().create()
A.setSizes(N)
A.setBlockSize(2)
A.setType("aij")
A.setPreallocationNNZ((18, 18))
X = A.createVecRight()  # coordinates
first, last = A.getOwnershipRange()
for node in range(first // 2, last // 2):
    i, j, own = node // n % n, node % n, [2 * node, 2 * node + 1]
    X.setValues(own, [node // n - node // n // n, j])  # tied nodes are in the same place
    held = float(node < n)  # the left edge of the left lattice
    A.setValues(own, own, [held, 0, 0, held], addv=True)
    for di, dj in ((1, 0), (0, 1), (1, 1), (-1, 1)):
        if 0 <= i + di < n and j + dj < n:
            other, d = node + di * n + dj, (di, dj, -di, -dj)
            ends = own + [2 * other, 2 * other + 1]
            A.setValues(ends, ends, [a * b / (di * di + dj * dj) for a in d for b in d], addv=True)
A.assemble()
X.assemble()

C = PETSc.Mat().createAIJ(((None, M), (A.getLocalSize()[1], N)), nnz=(2, 2))
for row in range(*C.getOwnershipRange()):
    C.setValues([row], [2 * n * (n - 1) + row, 2 * n * n + row], [1, -1])
C.assemble()

# Each step solves [A + shift M, C'; C, 0], where all masses are 1.
S = A.copy()
S.setOption(PETSc.Mat.Option.SPD, True)
S.setNearNullSpace(PETSc.NullSpace().createRigidBody(X))
K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])
J = PETSc.Mat().createNest([[S, PETSc.Mat().createTranspose(C)], [C, None]])
primal = J.getNestISs()[0][0]
shifts, energies, gaps = [], [], []


def residual(ts, t, u, v, a, f):
    """M a + A u + C' lambda, and C u."""
    K.mult(u, f)
    force, acceleration = f.getSubVector(primal), a.getSubVector(primal)
    force.axpy(1.0, acceleration)
    f.restoreSubVector(primal, force)
    a.restoreSubVector(primal, acceleration)


def jacobian(ts, t, u, v, a, shift_v, shift_a, J, P):
    """The matrix of a step, which does not change with equal steps: neither does its preconditioner."""
    if shifts[-1:] != [shift_a]:
        A.copy(S)
        S.shift(shift_a)
        J.assemble()
        shifts.append(shift_a)


def note(ts, step, t, u):
    """The energy, and what the ties are off by."""
    v = ts.getSolution2()[1].getSubVector(primal)
    x = u.getSubVector(primal)
    energies.append((v.dot(v) + x.dot(A * x)).real / 2)
    gaps.append((C * x).norm())


u, v = K.createVecRight(), K.createVecRight()
velocity = v.getSubVector(primal)
for node in range(first // 2, last // 2):  # the free end moves down
    velocity.setValue(2 * node + 1, -(node // n - node // n // n) / (2 * n))
velocity.assemble()
v.restoreSubVector(primal, velocity)

ts = PETSc.TS().create()
ts.setType(PETSc.TS.Type.ALPHA2)
ts.setI2Function(residual, K.createVecLeft())
ts.setI2Jacobian(jacobian, J, J)
ts.setSolution2(u, v)
ts.setTimeStep(4.0)  # in seconds where masses and springs are 1; the slowest mode takes some hundred
ts.setMaxTime(1e30)
ts.setMaxSteps(1000)
ts.setMonitor(note)
ts.getSNES().getKSP().setErrorIfNotConverged(True)
ts.setFromOptions()
ts.solve(u)
PETSc.Sys.Print("%d steps of %d unknowns with %d ties, %d matrices" % (ts.getStepNumber(), N, M, len(shifts)))
PETSc.Sys.Print("the energy changes by %.0e of itself, C x is at most %.0e"
                % (max(abs(e / energies[0] - 1) for e in energies), max(gaps)))
