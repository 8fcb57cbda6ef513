#!/usr/bin/env python3
"""SLEPc's own LOBPCG in Ker C, with the preconditioner and the shift of EPSAINSWORTH, beside that type.

Iterations, or how it ends: rows of docs/examples.csv.

/usr/bin/python3 docs/study/modeslobpcg.py      a minute; needs slepc4py

Its operators are Q' (A + sigma M) Q and Q' M Q on x alone, and its start meets the constraints. The shifts are fixed.
"""
import ctypes
import os
import re
import subprocess
import sys
import tempfile

from common import examples, machine

machine.require("petsc4py", "numpy")
import numpy
import slepc4py

slepc4py.init(sys.argv)
from petsc4py import PETSc
from slepc4py import SLEPc

sys.path.insert(0, os.path.join(machine.ROOT, "include"))
import ainsworth

PROGRAM, LIBRARY = (os.path.join(machine.BUILD, name) for name in ("bench/modes", "libainsworthslepc.so"))
NEV, VECTORS = 12, 16
SYSTEMS = [("-model ties -free -n1 6 -n2 6", [0.05]), ("-model rbe3 -n1 6 -n2 6", [0.05]),
           ("-model mortar -free -n1 6 -n2 6", [0.05]),
           ("-model ties -free -n1 6 -n2 6 -height 20 -nz1 40 -nz2 40", [1e-4, 1e-3, 1e-2, 1e-1])]


def ours(options):
    """Iterations of EPSAINSWORTH, and the number of rows of C."""
    command = [PROGRAM, *options.split(),
               *("-near_nullspace -eps_nev %d -eps_type ainsworth -dll_append %s" % (NEV, LIBRARY)).split()]
    found = re.search(r"constraints=(\d+) converged=\d+ iterations=(\d+)", machine.output(command, 600))
    return int(found.group(2)), int(found.group(1))


def load(options, folder):
    """K and M, which any eigensolver of the program writes."""
    names = [os.path.join(folder, name) for name in ("K", "M")]
    direct = ("-layout aij -near_nullspace -eps_type krylovschur -st_type sinvert -eps_target -0.1 -st_pc_type lu "
              "-st_pc_factor_mat_solver_type mumps")
    subprocess.run([PROGRAM, *options.split(), *direct.split(), "-eps_view_mat0", "binary:" + names[0],
                    "-eps_view_mat1", "binary:" + names[1]],
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=machine.ENVIRONMENT, check=True)
    return [PETSc.Mat().load(PETSc.Viewer().createBinary(name, "r")) for name in names]


class Projected:
    """Q' A Q"""

    def __init__(self, matrix, reduced):
        self.matrix, self.reduced, self.work = matrix, reduced, matrix.createVecRight()

    def project(self, name, x, y):
        code = getattr(ainsworth.load(), name)(*(ctypes.c_void_p(thing.handle) for thing in (self.reduced, x, y)))
        assert code == 0

    def mult(self, _, x, y):
        self.project("MatAinsworthMultProjector", x, self.work)
        self.matrix.mult(self.work, y)
        self.project("MatAinsworthMultTransposeProjector", y, y)


class Cycle:
    """One cycle in Ker C"""

    def __init__(self, ksp, n):
        self.ksp, self.n, (self.right, self.left) = ksp, n, ksp.getOperators()[0].createVecs()

    def apply(self, _, r, z):
        self.right.set(0)
        self.right.array[:self.n] = r.array_r
        self.ksp.solve(self.right, self.left)
        z.array[:] = self.left.array_r[:self.n]


def peer(K, M, m, sigma):
    n = K.getSize()[0] - m
    primal, dual = PETSc.IS().createStride(n, 0, 1), PETSc.IS().createStride(m, n, 1)
    shifted = K.copy()
    shifted.axpy(sigma, M)
    mass = M.createSubMatrix(primal, primal)
    ksp = PETSc.KSP().create()
    ksp.setOperators(shifted)
    ksp.setType("richardson")
    ksp.setNormType(PETSc.KSP.NormType.NONE)
    ksp.setTolerances(max_it=1)
    pc = ksp.getPC()
    pc.setType("ainsworth")
    pc.setFieldSplitIS(("primal", primal), ("dual", dual))
    ainsworth.inner_ksp(pc).setType("preonly")
    ksp.setUp()
    reduced, cycle = ainsworth.inner_ksp(pc).getOperators()[0], Cycle(ksp, n)
    operators = []
    for matrix in (shifted.createSubMatrix(primal, primal), mass):
        operators.append(PETSc.Mat().createPython([n, n], Projected(matrix, reduced)))
        operators[-1].setUp()
    eps = SLEPc.EPS().create()
    eps.setOperators(*operators)
    eps.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    eps.setType("lobpcg")
    eps.setWhichEigenpairs(SLEPc.EPS.Which.SMALLEST_REAL)
    eps.setDimensions(NEV)
    eps.setLOBPCGBlockSize(VECTORS)
    eps.setTolerances(1e-8, 200)
    eps.getST().setType("precond")
    eps.getST().getKSP().setType("preonly")
    inner = eps.getST().getKSP().getPC()
    inner.setType("python")
    inner.setPythonContext(cycle)
    random, start = numpy.random.default_rng(1), []
    for _ in range(3 * VECTORS):
        load, x = mass.createVecs()
        x.array[:] = random.uniform(-1, 1, n)
        mass.mult(x, load)
        cycle.apply(None, load, x)
        start.append(x)
    eps.setInitialSpace(start)
    try:
        eps.solve()
    except PETSc.Error as error:
        return "error-%d" % error.ierr  # 76: LAPACK's sygvd
    return str(eps.getIterationNumber()) if eps.getConverged() >= NEV else "%d-of-%d" % (eps.getConverged(), NEV)


ainsworth.load(machine.PLUGIN)
PETSc.Sys.popErrorHandler()
PETSc.Sys.pushErrorHandler("ignore")
for options, shifts in SYSTEMS:
    iterations, rows = ours(options)
    with tempfile.TemporaryDirectory() as folder:
        matrices = load(options, folder)
    peers = ["%g=%s" % (sigma, peer(*matrices, rows, sigma)) for sigma in shifts]
    examples.put("lobpcg " + options, 1, "bench/modes " + options, [iterations], peers)
