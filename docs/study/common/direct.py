"""A system from its files, its direct solution, and what both workers (solver.py, extreme.py) need of the plugin.
petsc4py must be initialised.
"""
import ctypes
import os

import numpy
from petsc4py import PETSc

INTEGER = ctypes.c_int64 if PETSc.IntType().itemsize == 8 else ctypes.c_int32


def load_matrix(prefix, name):
    viewer = PETSc.Viewer().createBinary("%s_%s.dat" % (prefix, name), "r", comm=PETSc.COMM_SELF)
    matrix = PETSc.Mat().create(comm=PETSc.COMM_SELF)
    matrix.setType("aij")
    matrix.load(viewer)
    return matrix


def load_vector(prefix, name):
    viewer = PETSc.Viewer().createBinary("%s_%s.dat" % (prefix, name), "r", comm=PETSc.COMM_SELF)
    vector = PETSc.Vec().create(comm=PETSc.COMM_SELF)
    vector.load(viewer)
    return vector


def inner_iterations(library, pc):
    """Iterations and KSPConvergedReason of the reduced solve of a PCAINSWORTH."""
    inner, iterations, reason = ctypes.c_void_p(), INTEGER(), ctypes.c_int()
    library.PCAinsworthGetKSP(ctypes.c_void_p(pc.handle), ctypes.byref(inner))
    library.KSPGetIterationNumber(inner, ctypes.byref(iterations))
    library.KSPGetConvergedReason(inner, ctypes.byref(reason))
    return iterations.value, reason.value


def load_system(prefix):
    """A, C, f, g; A with rigid-body modes where the coordinates are there, as an engineer's program would have them."""
    A, C = (load_matrix(prefix, name) for name in "AC")
    f, g = (load_vector(prefix, name) for name in "fg")
    A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    A.setOption(PETSc.Mat.Option.SPD, True)
    if os.path.exists(prefix + "_X.dat"):
        A.setNearNullSpace(PETSc.NullSpace().createRigidBody(load_vector(prefix, "X")))
    return A, C, f, g


class Rows:
    """A matrix by rows, multiplied in extended precision; no row is empty."""

    def __init__(self, matrix):
        from scipy.sparse import csr_matrix
        indptr, indices, values = matrix.getValuesCSR()
        self.csr = csr_matrix((values, indices, indptr), shape=matrix.getSize())

    def product(self, x):
        return self._product(self.csr, x)

    def transposed(self, x):
        return self._product(self.csr.T.tocsr(), x)

    @staticmethod
    def _product(csr, x):
        y = numpy.zeros(csr.shape[0], dtype=numpy.longdouble)
        full = numpy.flatnonzero(numpy.diff(csr.indptr))
        if len(full):
            y[full] = numpy.add.reduceat(csr.data.astype(numpy.longdouble) * x[csr.indices], csr.indptr[full])
        return y


def direct(A, C, f, g):
    """x and lambda of the saddle-point system: MUMPS on the scaled matrix, residuals of the original one in extended
    precision.
    """
    from scipy.sparse import bmat, diags
    n, m = A.csr.shape[0], C.csr.shape[0]
    dx = 1 / numpy.sqrt(A.csr.diagonal())
    blocks = diags(dx) @ A.csr @ diags(dx)
    dl = numpy.ones(0)
    if m:
        scaled = C.csr @ diags(dx)
        dl = 1 / numpy.sqrt(scaled.multiply(scaled).sum(axis=1).A1)
        scaled = diags(dl) @ scaled
        blocks = bmat([[blocks, scaled.T], [scaled, None]])
    blocks = blocks.tocsr()
    blocks.sort_indices()
    scale = numpy.concatenate([dx, dl])
    K = PETSc.Mat().createAIJ(size=blocks.shape,
                              csr=(blocks.indptr.astype(PETSc.IntType), blocks.indices.astype(PETSc.IntType),
                                   blocks.data), comm=PETSc.COMM_SELF)
    K.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    options = PETSc.Options()
    options["direct_mat_mumps_icntl_14"] = 100
    options["direct_mat_mumps_icntl_7"] = 5
    ksp = PETSc.KSP().create(comm=PETSc.COMM_SELF)
    ksp.setOptionsPrefix("direct_")
    ksp.setOperators(K)
    ksp.setType("preonly")
    ksp.getPC().setType("cholesky")
    ksp.getPC().setFactorSolverType("mumps")
    ksp.setFromOptions()
    b, z = K.createVecRight(), K.createVecRight()
    x, l = numpy.zeros(n, numpy.longdouble), numpy.zeros(m, numpy.longdouble)
    last = numpy.inf
    for _ in range(12):
        r = numpy.concatenate([f - A.product(x) - C.transposed(l), g - C.product(x)])
        b.setArray((r * scale).astype(float))
        ksp.solve(b, z)
        step = z.getArray() * scale
        x, l = x + step[:n], l + step[n:]
        change = numpy.abs(step[:n]).max() / numpy.abs(x).max()
        finished = change < 1e-17 or change > last / 2
        last = min(last, change)
        if finished:
            break
    if not last < 1e-12:
        raise RuntimeError("the reference solution is not exact: last correction %g" % last)
    return x.astype(float), l.astype(float)


def energy(A, values):
    v, w = A.createVecs()
    v.setArray(values)
    A.mult(v, w)
    return max(v.dot(w), 0.0)
