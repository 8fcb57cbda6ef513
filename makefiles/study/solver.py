"""The part of the study that talks to PETSc, in a process of its own so that a crash or a time limit costs one run only.

python3 solver.py <job.json> prints one JSON line per solver configuration of the job. The reference solution is kept beside the system.
"""
import ctypes
import json
import os
import sys
import time

import numpy
import petsc4py

with open(sys.argv[1]) as handle:
    JOB = json.load(handle)
petsc4py.init(["solver", "-dll_append", JOB["plugin"]])
from petsc4py import PETSc  # noqa: E402 (PETSc reads its arguments at the import)

LIBRARY = ctypes.CDLL(JOB["plugin"])
INTEGER = ctypes.c_int64 if PETSc.IntType().itemsize == 8 else ctypes.c_int32
REASONS = {value: name for name, value in vars(PETSc.KSP.ConvergedReason).items() if isinstance(value, int) and not name.startswith("_")}


def load_matrix(name):
    viewer = PETSc.Viewer().createBinary(JOB["prefix"] + "_%s.dat" % name, "r", comm=PETSc.COMM_SELF)
    matrix = PETSc.Mat().create(comm=PETSc.COMM_SELF)
    matrix.setType("aij")
    matrix.load(viewer)
    return matrix


def load_vector(name):
    viewer = PETSc.Viewer().createBinary(JOB["prefix"] + "_%s.dat" % name, "r", comm=PETSc.COMM_SELF)
    vector = PETSc.Vec().create(comm=PETSc.COMM_SELF)
    vector.load(viewer)
    return vector


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
    """x and lambda of the saddle-point system: MUMPS on the scaled matrix, residuals of the original one in extended precision."""
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
    K = PETSc.Mat().createAIJ(size=blocks.shape, csr=(blocks.indptr.astype(PETSc.IntType), blocks.indices.astype(PETSc.IntType), blocks.data), comm=PETSc.COMM_SELF)
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
        if change < 1e-17 or change > last / 2:
            break
        last = change
    if not last < 1e-12:
        raise RuntimeError("the reference solution is not exact: last correction %g" % last)
    return x.astype(float), l.astype(float)


def reference(A, C, f, g, name):
    path = "%s_%s.npy" % (JOB["prefix"], name)
    if not os.path.exists(path):
        numpy.save(path, direct(Rows(A), Rows(C), f.getArray(), g.getArray())[0])
    return numpy.load(path)


def energy(A, values):
    v, w = A.createVecs()
    v.setArray(values)
    A.mult(v, w)
    return max(v.dot(w), 0.0)


def solve(A, C, f, g, exact, config, number):
    """One configuration, through the plugin: setup and solve are each the least of the repetitions."""
    prefix = "run%d_" % number
    options = PETSc.Options()
    words = config["options"].split()
    while words:
        key, value = words.pop(0), None
        if words and not (words[0].startswith("-") and words[0][1:2].isalpha()):
            value = words.pop(0)
        options[prefix + key[1:]] = value
    K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]], comm=PETSc.COMM_SELF)
    b, y = K.createVecRight(), K.createVecRight()
    b.setArray(numpy.concatenate([f.getArray(), g.getArray()]))
    n = A.getSize()[0]
    row = {"setup": numpy.inf, "solve": numpy.inf}
    spent, repetitions = 0.0, 0
    while repetitions < JOB["repeat"] and (repetitions == 0 or spent < JOB["enough"]):
        ksp = PETSc.KSP().create(comm=PETSc.COMM_SELF)
        ksp.setOptionsPrefix(prefix)
        ksp.setOperators(K)
        ksp.setType("preonly")
        ksp.getPC().setType("ainsworth")
        ksp.setFromOptions()
        start = time.perf_counter()
        ksp.setUp()
        ready = time.perf_counter()
        ksp.solve(b, y)
        end = time.perf_counter()
        row["setup"], row["solve"] = min(row["setup"], ready - start), min(row["solve"], end - ready)
        spent += end - start
        repetitions += 1
        inner, iterations, reason = ctypes.c_void_p(), INTEGER(), ctypes.c_int()
        LIBRARY.PCAinsworthGetKSP(ctypes.c_void_p(ksp.getPC().handle), ctypes.byref(inner))
        LIBRARY.KSPGetIterationNumber(inner, ctypes.byref(iterations))
        LIBRARY.KSPGetConvergedReason(inner, ctypes.byref(reason))
        failed = ksp.getConvergedReason()
        ksp.destroy()
    row["iterations"] = iterations.value
    row["reason"] = REASONS.get(reason.value, str(reason.value))
    if reason.value == 0:  # the set-up failed and the inner solver never ran
        row["reason"] = REASONS.get(failed, str(failed))
    x, l = y.getArray()[:n], y.getArray()[n:]
    if not numpy.isfinite(y.getArray()).all():
        row["reason"] += ", not a number"
        return row
    row["error"] = float(numpy.sqrt(energy(A, x - exact) / energy(A, exact)))
    v, w = A.createVecs()
    v.setArray(x)
    A.mult(v, w)
    r = f.getArray() - w.getArray()
    if len(l):
        dual, force = C.createVecLeft(), C.createVecRight()
        C.mult(v, dual)
        row["constraint"] = float(numpy.abs(dual.getArray() - g.getArray()).max() / (1 + numpy.abs(g.getArray()).max()))
        dual.setArray(l)
        C.multTranspose(dual, force)
        r = r - force.getArray()
    row["primal"] = float(numpy.linalg.norm(r) / (numpy.linalg.norm(f.getArray()) or 1.0))
    return row


def main():
    A, C, f, g = load_matrix("A"), load_matrix("C"), load_vector("f"), load_vector("g")
    A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    A.setOption(PETSc.Mat.Option.SPD, True)
    n = A.getSize()[0]
    none = PETSc.Mat().createAIJ(size=((0, 0), (n, n)), nnz=0, comm=PETSc.COMM_SELF)
    none.assemble()
    nothing = PETSc.Vec().createSeq(0, comm=PETSc.COMM_SELF)
    print(json.dumps({"unknowns": n, "constraints": C.getSize()[0]}), flush=True)
    exact = reference(A, C, f, g, "x")
    print(json.dumps({"ready": True}), flush=True)
    for number, config in JOB["configs"]:
        try:
            if config["system"] == "constrained":
                row = solve(A, C, f, g, exact, config, number)
            elif config["system"] == "alone":
                row = solve(A, none, f, nothing, reference(A, none, f, nothing, "alone"), config, number)
            else:  # A alone, with the right-hand side that gives the constrained solution
                b = f.duplicate()
                v = f.duplicate()
                v.setArray(exact)
                A.mult(v, b)
                row = solve(A, none, b, nothing, exact, config, number)
        except PETSc.Error as error:
            row = {"reason": "error %d" % error.ierr}
        row = {key: None if isinstance(value, float) and not numpy.isfinite(value) else value for key, value in row.items()}
        print(json.dumps(dict(row, number=number)), flush=True)


main()
