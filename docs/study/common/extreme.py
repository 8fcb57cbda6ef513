"""One system, one solver, for extremes.py: a process of its own, so that a crash or a limit of time costs one run only.

python3 extreme.py <job.json> prints one JSON line. Without "solver" it computes the direct solution, which goes to
<prefix>_x.npy.
"""
import ctypes
import json
import sys

import numpy
import petsc4py

with open(sys.argv[1]) as handle:
    JOB = json.load(handle)
petsc4py.init(["extreme", "-dll_append", JOB["plugin"]] + JOB.get("arguments", []))
from petsc4py import PETSc  # noqa: E402 (PETSc reads its arguments at the import)
from direct import Rows, direct, energy, inner_iterations, load_system  # noqa: E402

REASONS = {value: name for name, value in vars(PETSc.KSP.ConvergedReason).items() if isinstance(value, int)
           and not name.startswith("_")}
LIBRARY = ctypes.CDLL(JOB["plugin"])


def csr(matrix):
    from scipy.sparse import csr_matrix
    indptr, indices, values = matrix.getValuesCSR()
    return csr_matrix((values, indices, indptr), shape=matrix.getSize())


def aij(matrix):
    matrix = matrix.tocsr()
    matrix.sort_indices()
    answer = PETSc.Mat().createAIJ(size=matrix.shape,
                                   csr=(matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType),
                                        matrix.data), comm=PETSc.COMM_SELF)
    return answer


def changed(C, g):
    """C, the diagonal of the multipliers' block or None, and g, with the further rows of the job."""
    from scipy.sparse import csr_matrix, diags, vstack
    rows, rhs = csr(C), g.getArray()
    zero, decoupled, near = (JOB["change"].get(key, 0) for key in ("zero", "decoupled", "near"))
    further = [csr_matrix((zero + decoupled, rows.shape[1]))]
    values = [numpy.full(zero, JOB["change"].get("zero_g", 0.0)), numpy.full(decoupled, 1e-3)]
    # copies whose last entry, of the secondary body, weighs a little more; for the direct solution what they add: that
    # unknown is zero
    if near:
        copies = rows[:near].tolil()
        for i in range(near):
            last = max(copies.rows[i])
            entry = copies[i, last]
            if JOB["solver"]:
                copies[i, last] = entry * (1 + JOB["change"]["distance"])
            else:
                copies[i] = 0
                copies[i, last] = entry
        further.insert(0, copies)
        values.insert(0, rhs[:near] if JOB["solver"] else numpy.zeros(near))
    m = rows.shape[0] + near + zero
    D = diags(numpy.concatenate([numpy.zeros(m), -numpy.ones(decoupled)])) if decoupled else None
    return vstack([rows] + further).tocsr(), D, numpy.concatenate([rhs] + values)


def failed_reason(pc):
    """The name of a PCFailedReason: its array is shifted by one, as PC_SETUP_ERROR is -1."""
    reason = ctypes.c_int()
    LIBRARY.PCGetFailedReason(ctypes.c_void_p(pc.handle), ctypes.byref(reason))
    names = ctypes.POINTER(ctypes.c_char_p).in_dll(LIBRARY, "PCFailedReasons")
    return names[reason.value].decode() if reason.value else ""


def solve(A, rows, D, f, g):
    from scipy.sparse import bmat
    C, Ct = aij(rows), aij(rows.T)
    if JOB["assembled"]:
        K = aij(bmat([[csr(A), rows.T], [rows, D]]))
        K.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    else:
        K = PETSc.Mat().createNest([[A, Ct], [C, aij(D.tocsr()) if D is not None else None]], comm=PETSc.COMM_SELF)
    b, y = K.createVecRight(), K.createVecRight()
    b.setArray(numpy.concatenate([f.getArray(), g]))
    ksp = PETSc.KSP().create(comm=PETSc.COMM_SELF)
    ksp.setOperators(K)
    ksp.setFromOptions()
    ksp.solve(b, y)
    pc = ksp.getPC()
    iterations, reason = ksp.getIterationNumber(), ksp.getConvergedReason()
    row = {"reason": REASONS.get(reason, str(reason)), "failure": failed_reason(pc), "converged": reason > 0}
    if pc.getType() == "ainsworth":
        iterations, inner = inner_iterations(LIBRARY, pc)
        if inner < 0:
            row["failure"] += ", inner solver " + REASONS.get(inner, str(inner))
    row["iterations"] = iterations
    values = y.getArray()
    row["finite"] = bool(numpy.isfinite(values).all())
    if not row["finite"]:
        return row
    n = rows.shape[1]
    x, l = values[:n].copy(), values[n:].copy()
    lengths = numpy.sqrt(rows.multiply(rows).sum(axis=1)).A1  # each row in units of its own length
    lengths[lengths == 0] = 1
    deviation = rows @ x - g
    if D is not None:
        deviation += D @ l
    row["constraint"] = float((numpy.abs(deviation) / lengths).max() / (numpy.abs(x).max() or 1.0))
    residual = f.getArray() - csr(A) @ x - rows.T @ l
    row["primal"] = float(numpy.linalg.norm(residual) / (numpy.linalg.norm(f.getArray()) or 1.0))
    if JOB["exact"]:
        exact = numpy.load(JOB["exact"])
        row["error"] = float(numpy.sqrt(energy(A, x - exact) / energy(A, exact)))
        row["displacement"] = float(numpy.linalg.norm(x - exact) / numpy.linalg.norm(exact))
    return row


def main():
    A, C, f, g = load_system(JOB["prefix"])
    if JOB["change"]:
        rows, D, rhs = changed(C, g)
    else:
        rows, D, rhs = csr(C), None, g.getArray()
    if JOB["solver"]:
        try:
            row = solve(A, rows, D, f, rhs)
        except PETSc.Error as error:
            row = {"reason": "error %d" % error.ierr, "failure": "", "converged": False, "finite": False}
    else:
        numpy.save(JOB["exact"], direct(Rows(A), Rows(aij(rows)), f.getArray(), rhs)[0])
        row = {"unknowns": A.getSize()[0], "constraints": rows.shape[0]}
    print("\n" + json.dumps({key: None if isinstance(value, float) and not numpy.isfinite(value) else value
                             for key, value in row.items()}), flush=True)


main()
