#!/usr/bin/env python3
"""A part of a mesher, from files, by whatever solver the options choose: docs/story.md.

    python3 part.py FOLDER [-modes] [-whole] [-keep] [options of PETSc]

FOLDER has A, C, f, g and the rigid-body modes in PETSc's binary format, as docs/study/parts.py writes them.
-modes attaches the modes to A, -whole makes one matrix of the blocks, -keep writes x, with which later runs compare.
"""
import os
import resource
import sys
import time

import petsc4py

petsc4py.init(sys.argv)
from petsc4py import PETSc  # noqa: E402

OPTIONS = PETSc.Options()
FOLDER, COMM = sys.argv[1], PETSc.COMM_WORLD
OPTIONS["viewer_binary_skip_info"] = True  # or the block sizes of one file would hold for all


def reader(name):
    viewer = PETSc.Viewer().create(comm=COMM)
    viewer.setType("binary")
    viewer.setFileMode("r")
    viewer.setFromOptions()
    viewer.setFileName(os.path.join(FOLDER, name + ".dat"))
    return viewer


def matrix(name, block_sizes):
    M = PETSc.Mat().create(comm=COMM)
    M.setBlockSizes(*block_sizes)
    M.setType("aij")
    return M.load(reader(name))


def attach_modes(A):
    viewer, modes = reader("modes"), [A.createVecRight() for _ in range(6)]
    for k, mode in enumerate(modes):
        mode.load(viewer)
        for other in 2 * modes[:k]:
            mode.axpy(-other.dot(mode), other)
        mode.normalize()
    A.setNearNullSpace(PETSc.NullSpace().create(vectors=modes, comm=COMM))


A = matrix("A", (3, 3))
C = matrix("C", (1, 3))
if OPTIONS.getBool("modes", False):
    attach_modes(A)
K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]], comm=COMM)
f, g, x, multipliers = A.createVecLeft(), C.createVecLeft(), A.createVecRight(), C.createVecLeft()
f.load(reader("f"))
g.load(reader("g"))
b, y = PETSc.Vec().createNest([f, g], comm=COMM), PETSc.Vec().createNest([x, multipliers], comm=COMM)
whole = None
if OPTIONS.getBool("whole", False):
    whole = K.convert("aij", out=PETSc.Mat())

start = time.perf_counter()
ksp = PETSc.KSP().create(COMM)
ksp.setOperators(whole or K)
ksp.setFromOptions()
if whole:
    right, left = whole.createVecLeft(), whole.createVecRight()
    right.setArray(b.array_r)
    ksp.solve(right, left)
    y.setArray(left.array_r)
else:
    ksp.solve(b, y)
seconds = time.perf_counter() - start
state = "%s after %d iterations" % ("converged" if ksp.getConvergedReason() > 0 else "not converged",
                                    ksp.getIterationNumber())
used = PETSc.Vec().createMPI((1, PETSc.DECIDE), comm=COMM)
used.set(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
memory = used.sum()
line = "%d unknowns, %d multipliers: %s, %.2f s, %.0f MiB" % (f.getSize(), g.getSize(), state, seconds, memory)
exact = os.path.join(FOLDER, "x.dat")
if OPTIONS.getBool("keep", False):
    x.view(PETSc.Viewer().createBinary(exact, "w", comm=COMM))
elif os.path.exists(exact):
    other = x.duplicate()
    other.load(reader("x"))
    size = other.norm()
    other.axpy(-1.0, x)
    line += ", error %.0e" % (other.norm() / size)
PETSc.Sys.Print(line)
