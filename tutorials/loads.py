#!/usr/bin/env python3
"""The stiffness of a composite: a periodic cell of two elastic materials under six unit strains, all solved at once by
KSPMatSolve().

$ mpiexec -n 2 python3 loads.py -dll_append libainsworth.so -ksp_type preonly -pc_type ainsworth

The displacement differs by E L between opposite faces of the cell, whose edges are L: these are the constraints, and
the strain E is in g.
"""
import itertools
import sys

import numpy
import petsc4py

petsc4py.init(sys.argv)
from petsc4py import PETSc  # noqa: E402 (PETSc reads its arguments at the import)

options = PETSc.Options()
n = options.getInt("n", 8)  # elements along an edge of the cell, which is a unit cube
# Young's modulus of the ball in the middle, .35 in radius, over that around it
contrast = options.getReal("contrast", 10.0)
N = (n + 1) ** 3  # node (i, j, k) is i (n + 1)^2 + j (n + 1) + k, and has three displacements


def number(i, j, k):
    return (i * (n + 1) + j) * (n + 1) + k


def hooke(young, poisson=0.3):
    """Stresses of the strains xx, yy, zz, yz, xz, xy, where shear counts twice"""
    shear = young / (2 * (1 + poisson))
    D = numpy.diag([2 * shear] * 3 + [shear] * 3)
    D[:3, :3] += young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    return D


def brick(D, h):
    """Stiffness of a cube of 8 nodes with edges h, by 2 x 2 x 2 points"""
    corners = numpy.array(list(itertools.product((-1, 1), repeat=3)))
    K = numpy.zeros((24, 24))
    for point in corners / numpy.sqrt(3):
        factors = 1 + corners * point
        slopes = corners * numpy.stack([factors[:, 1] * factors[:, 2], factors[:, 0] * factors[:, 2],
                                        factors[:, 0] * factors[:, 1]], axis=1) / (4 * h)
        B = numpy.zeros((6, 24))
        for c in range(3):
            B[c, c::3] = slopes[:, c]
        for row, (a, b) in enumerate(((1, 2), (0, 2), (0, 1)), 3):
            B[row, a::3], B[row, b::3] = slopes[:, b], slopes[:, a]
        K += B.T @ D @ B * (h / 2) ** 3
    return K


A = PETSc.Mat().create()
A.setSizes(3 * N)
A.setBlockSize(3)
A.setType("aij")
A.setPreallocationNNZ((81, 81))
first, last = A.getOwnershipRange()
place = numpy.array(list(itertools.product(range(n + 1), repeat=3)))[first // 3 : last // 3] / n
stiff, soft = brick(hooke(contrast), 1 / n), brick(hooke(1.0), 1 / n)
for i, j, k in itertools.product(range(n), repeat=3):
    nodes = [number(i + a, j + b, k + c) for a, b, c in itertools.product((0, 1), repeat=3)]
    if first <= 3 * nodes[0] < last:  # the rank of its first node adds the element
        inside = sum(((m + 0.5) / n - 0.5) ** 2 for m in (i, j, k)) < 0.35**2
        rows = [3 * node + c for node in nodes for c in range(3)]
        A.setValues(rows, rows, stiff if inside else soft, addv=True)
A.assemble()
A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
X = A.createVecRight()
X.setArray(place.ravel())
A.setNearNullSpace(PETSc.NullSpace().createRigidBody(X))  # for the interpolation of multigrid, as always

pairs = []  # a node on the faces x = 1, y = 1, z = 1, and the one on the opposite face or edge or corner
for i, j, k in itertools.product(range(n + 1), repeat=3):
    if n in (i, j, k):
        pairs.append((number(i, j, k), number(i % n, j % n, k % n), numpy.array([i == n, j == n, k == n])))
C = PETSc.Mat().createAIJ(((None, 3 * len(pairs) + 3), (A.getLocalSize()[1], 3 * N)), nnz=(2, 2))
for row in range(*C.getOwnershipRange()):
    if row >= 3 * len(pairs):
        C.setValue(row, row - 3 * len(pairs), 1)  # the first node is held
    else:
        pair, c = divmod(row, 3)
        C.setValues([row], [3 * pairs[pair][0] + c, 3 * pairs[pair][1] + c], [1, -1])
C.assemble()
K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])

strains = []
for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)):
    E = numpy.zeros((3, 3))
    E[a, b] += 0.5
    E[b, a] += 0.5
    strains.append(E)
size, local = K.getSize()[0], K.getLocalSize()[0]
B = PETSc.Mat().createDense(((local, size), (None, 6)), comm=K.comm)
B.setUp()
U = B.duplicate()
inA = last - first
for column, E in enumerate(strains):
    b = B.getDenseColumnVec(column, mode="w")
    values = numpy.zeros(local)
    for row in range(*C.getOwnershipRange()):
        if row < 3 * len(pairs):
            values[inA + row - C.getOwnershipRange()[0]] = E[row % 3] @ pairs[row // 3][2]
    b.setArray(values)
    B.restoreDenseColumnVec(column, mode="w")
B.assemble()

ksp = PETSc.KSP().create()
ksp.setOperators(K)
ksp.setFromOptions()
ksp.setUp()
if hasattr(ksp, "matSolve"):
    ksp.matSolve(B, U)
else:  # petsc4py 3.18; with -ksp_type preonly this is the same
    ksp.getPC().matApply(B, U)

parts = []
for column in range(6):
    u = U.getDenseColumnVec(column, mode="r")
    x = A.createVecRight()
    x.setArray(u.getArray(readonly=True)[:inA])
    parts.append(x)
    U.restoreDenseColumnVec(column, mode="r")
stress = numpy.zeros((6, 6))
for a, u in enumerate(parts):
    forces = A.createVecLeft()
    A.mult(u, forces)
    stress[a] = [forces.dot(v) for v in parts]  # the energy of two strains is the stress of one in the other
PETSc.Sys.Print("%d unknowns, %d multipliers, 6 strains\nstiffness of the composite:" % (3 * N, C.getSize()[0]))
for row in stress:
    PETSc.Sys.Print("  " + " ".join("%8.5f" % (value + 0.0) for value in numpy.round(row, 5)))
bound = numpy.linalg.eigvalsh(hooke(max(contrast, 1)) - stress).min()
if contrast == 1:
    PETSc.Sys.Print("difference from the one material: %.1e" % abs(stress - hooke(1.0)).max())
elif bound < 0:
    raise SystemExit("stiffer than the stiffer material")
