"""One solve of a part from its files, on all ranks of a parallel program.

python3 partsolver.py <job.json> prints one JSON line. Programs that import this fill JOB before each answer().

The method reference writes x to 1e-13 beside the files: MUMPS, refined in extended precision; clampedreference that
of the clamped part: CG with the factor of MUMPS.
"""
import ctypes
import json
import os
import re
import resource
import sys
import time

import numpy
import petsc4py

JOB = {}
if __name__ == "__main__":
    with open(sys.argv[1]) as handle:
        JOB.update(json.load(handle))
    petsc4py.init(["partsolver", "-dll_append", JOB["plugin"]] + JOB["options"])
from petsc4py import PETSc  # noqa: E402 (PETSc reads its arguments at the import)
from binary import reader  # noqa: E402
from direct import INTEGER, Rows  # noqa: E402

COMM = PETSc.COMM_WORLD
REASONS = {value: name for name, value in vars(PETSc.KSP.ConvergedReason).items()
           if isinstance(value, int) and name.startswith(("CONVERGED_", "DIVERGED_"))}
COMPLIANCE = 1e-9  # of the scaled rows in the reference's factor: dependent rows; refinement takes it away


def path(name):
    return os.path.join(JOB["folder"], name + ".dat")


def load(thing, name):
    viewer = reader(path(name), COMM)
    thing.load(viewer)
    viewer.destroy()
    return thing


def save(x, name):
    viewer = PETSc.Viewer().createBinary(path(name), "w", comm=x.getComm())
    x.view(viewer)
    viewer.destroy()


def matrix(name, rows, columns, block_sizes):
    """Of these (local, global) sizes."""
    M = PETSc.Mat().create(comm=COMM)
    M.setSizes((rows, columns))
    M.setBlockSizes(*block_sizes)
    M.setType("aij")
    return load(M, name)


def near_null_space(A, name, share=None):
    """Six vectors from one file, made orthonormal; share: a factor for each entry."""
    viewer = reader(path(name), COMM)
    modes = []
    for _ in range(6):
        mode = A.createVecRight()
        mode.load(viewer)
        if share:
            mode.pointwiseMult(mode, share)
        for _ in range(2):
            for other in modes:
                mode.axpy(-other.dot(mode), other)
        mode.normalize()
        modes.append(mode)
    viewer.destroy()
    A.setNearNullSpace(PETSc.NullSpace().create(vectors=modes, comm=COMM))


def unconstrained():
    """The part that is clamped: matrix, right-hand side."""
    n = JOB["sizes"]["clamped"]
    A = matrix("clamped_A", (PETSc.DECIDE, n), (PETSc.DECIDE, n), (3, 3))
    if JOB["modes"]:
        near_null_space(A, "clamped_modes")
    return A, load(A.createVecLeft(), "clamped_f")


def constrained():
    """A, B, C, D (or None), f, g"""
    n, m = JOB["sizes"]["unknowns"], JOB["sizes"]["rows"]
    A = matrix("A", (PETSc.DECIDE, n), (PETSc.DECIDE, n), (3, 3))
    A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    if JOB["modes"]:
        near_null_space(A, "modes")
    C = matrix("C", (PETSc.DECIDE, m), (A.getLocalSize()[1], n), (1, 3))
    own = C.getLocalSize()[0]
    B = matrix("B", (own, m), (A.getLocalSize()[1], n), (1, 3)) if os.path.exists(path("B")) else C
    D = matrix("D", (own, m), (own, m), (1, 1)) if os.path.exists(path("D")) else None
    return A, B, C, D, load(A.createVecLeft(), "f"), load(C.createVecLeft(), "g")


def timed(create, b, y):
    """A solver, seconds of set-up and of solve: the least of new solvers that find the memory of the last one."""
    ksp = least = None
    for _ in range(1 + JOB.get("again", 0)):
        if ksp:
            ksp.destroy()
        ksp = create()
        COMM.barrier()
        start = time.perf_counter()
        ksp.setUp()
        ksp.getPC().setUpOnBlocks()
        COMM.barrier()
        ready = time.perf_counter()
        ksp.solve(b, y)
        COMM.barrier()
        seconds = ready - start, time.perf_counter() - ready
        least = min(least or seconds, seconds, key=sum)
    return ksp, *least


def relative(r, b):
    return r.norm() / (b.norm() or 1.0)


def energy(A, v):
    w = v.duplicate()
    A.mult(v, w)
    return max(v.dot(w), 0.0)


def last_solver(pc):
    """Of the plugin: multigrid, factor (of the preconditioning matrix), whole (the saddle point is factored)."""
    name = os.path.join(JOB["folder"], "view.txt")
    viewer = PETSc.Viewer().createASCII(name, "w", comm=COMM)
    viewer.pushFormat(PETSc.Viewer.Format.ASCII_INFO_DETAIL)
    pc.view(viewer)
    viewer.popFormat()
    viewer.destroy()
    COMM.barrier()
    with open(name) as file:
        text = file.read()
    if "the whole system is factored" in text:
        return "whole"
    found = re.search(r"reduced solve in the primal unknowns:.*?PC Object:.*?type: (\w+)", text, re.DOTALL)
    name = found.group(1) if found else "none"
    return {"blocksa": "multigrid", "cholesky": "factor", "lu": "factor"}.get(name, name)


def inner(pc):
    """Of the plugin's reduced solves: iterations of all, iterations of the last one and its KSPConvergedReason."""
    library, ksp = ctypes.CDLL(JOB["plugin"]), ctypes.c_void_p()
    library.PCAinsworthGetKSP(ctypes.c_void_p(pc.handle), ctypes.byref(ksp))
    numbers = []
    for function, kind in (("GetTotalIterations", INTEGER), ("GetIterationNumber", INTEGER),
                           ("GetConvergedReason", ctypes.c_int)):
        numbers.append(kind())
        getattr(library, "KSP" + function)(ksp, ctypes.byref(numbers[-1]))
    return [number.value for number in numbers]


def state(ksp):
    """Iterations, those of the last reduced solve, the reason of the solver that did them."""
    total, last, reason = ksp.getIterationNumber(), None, ksp.getConvergedReason()
    if ksp.getPC().getType() == "ainsworth":
        total, last, inner_reason = inner(ksp.getPC())
        reason = reason if reason < 0 else inner_reason
    return {"iterations": total, "last": last, "state": REASONS.get(reason, str(reason))}


def conjugate_gradients(A):
    """With PCBLOCKSA, or what the options say."""
    ksp = PETSc.KSP().create(comm=COMM)
    ksp.setOperators(A)
    ksp.setType("cg")
    ksp.setNormType(PETSc.KSP.NormType.NATURAL)
    ksp.setTolerances(rtol=1e-8, max_it=2000)
    ksp.getPC().setType("blocksa")
    ksp.setFromOptions()
    return ksp


def clamped():
    A, f = unconstrained()
    x = f.duplicate()
    ksp, setup, solve = timed(lambda: conjugate_gradients(A), f, x)
    r = f.duplicate()
    A.mult(x, r)
    r.aypx(-1, f)
    row = dict(state(ksp), setup=setup, solve=solve, primal=relative(r, f))
    return dict(row, error=energy_error(A, x, "clamped_x"))


def clampedreference():
    A, f = unconstrained()
    x = f.duplicate()
    ksp = conjugate_gradients(A)
    ksp.getPC().setType("cholesky")
    ksp.getPC().setFactorSolverType("mumps")
    ksp.setTolerances(rtol=1e-14, max_it=5)
    ksp.solve(f, x)
    if ksp.getConvergedReason() < 0:
        return {"state": "the reference is not exact"}
    save(x, "clamped_x")
    return {"state": "exact"}


def eliminated():
    """x = T y + x0: the set-up counts the product T' A T, but not how T was found."""
    n = JOB["sizes"]["unknowns"]
    A = matrix("A", (PETSc.DECIDE, n), (PETSc.DECIDE, n), (3, 3))
    T = matrix("T", (A.getLocalSize()[0], n), (A.getLocalSize()[0], n), (3, 3))
    f, x0 = load(A.createVecLeft(), "f"), load(A.createVecLeft(), "x0")
    COMM.barrier()
    start = time.perf_counter()
    R, masters = A.ptap(T), T.getDiagonal()
    slaves = masters.duplicate()
    slaves.set(A.getDiagonal().sum() / n)  # rows of their own, so that the blocks of the nodes survive
    slaves.axpy(-slaves.max()[1], masters)
    own = PETSc.Mat().createAIJ(A.getSizes(), bsize=3, nnz=1, comm=COMM)
    own.setDiagonal(slaves)
    R.axpy(1, own, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)  # T'AT has no place for some
    R.setOption(PETSc.Mat.Option.SPD, True)
    COMM.barrier()
    product = time.perf_counter() - start
    if JOB["modes"]:
        near_null_space(R, "modes", masters)
    r, b, y, x = (f.duplicate() for _ in range(4))
    A.mult(x0, r)
    r.aypx(-1, f)
    T.multTranspose(r, b)
    ksp, setup, solve = timed(lambda: conjugate_gradients(R), b, y)
    T.mult(y, x)
    x.axpy(1, x0)
    A.mult(x, r)
    r.aypx(-1, f)
    left = b.duplicate()
    T.multTranspose(r, left)
    row = dict(state(ksp), setup=product + setup, solve=solve, primal=relative(left, b))
    return dict(row, error=energy_error(A, x))


def energy_error(A, x, reference="x"):
    """Relative to the exact x; None without that. It changes x."""
    if not os.path.exists(path(reference)):
        return None
    exact = load(x.duplicate(), reference)
    x.axpy(-1, exact)
    return numpy.sqrt(energy(A, x) / energy(A, exact))


def whole(blocks, K, configure, P=None, right=None):
    """A solve of the saddle point of these blocks by the PC that configure() sets; the solver, the row."""
    A, B, C, D, f, g = blocks

    def create():
        ksp = PETSc.KSP().create(comm=COMM)
        configure(ksp.getPC())
        ksp.setOperators(K, P)
        ksp.setType("preonly")
        ksp.setFromOptions()
        return ksp

    b, y = K.createVecLeft(), K.createVecRight()
    local = A.getLocalSize()[0]
    b.setArray(numpy.concatenate([(right or f).getArray(), g.getArray()]))
    ksp, setup, solve = timed(create, b, y)
    x, l = A.createVecRight(), C.createVecLeft()
    x.setArray(y.getArray()[:local])
    l.setArray(y.getArray()[local:])
    row = dict(state(ksp), setup=setup, solve=solve)
    if not numpy.isfinite(y.norm()):
        return ksp, dict(row, state=row["state"] + ", not a number")
    r, s, t = f.duplicate(), g.duplicate(), f.duplicate()
    A.mult(x, r)
    B.multTranspose(l, t)
    r.axpy(1, t)
    r.aypx(-1, f)
    C.mult(x, s)
    if D is not None:
        t = g.duplicate()
        D.mult(l, t)
        s.axpy(-1, t)
    s.aypx(-1, g)
    row["primal"], row["constraint"] = relative(r, f), s.norm(PETSc.NormType.INFINITY) / x.norm(PETSc.NormType.INFINITY)
    row["error"] = energy_error(A, x)
    row["memory"] = peak()
    return ksp, row


def corner(D):
    """-D; None without it."""
    return None if D is None else -1.0 * D


def ainsworth():
    """The plugin, with a nest; the set-up after a change of C, too."""
    A, B, C, D, _, _ = blocks = constrained()
    K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(B)], [C, corner(D)]], comm=COMM)
    ksp, row = whole(blocks, K, lambda pc: pc.setType("ainsworth"))
    if ksp.getPC().getType() == "ainsworth":
        row["solver"] = last_solver(ksp.getPC())
    if B is C and "primal" in row:
        row["change"] = change(ksp, K, C)
    return row


def mumps():
    """MUMPS, with one matrix."""
    A, B, C, D, _, _ = blocks = constrained()
    K = PETSc.Mat().createNest([[A, B.transpose(PETSc.Mat())], [C, corner(D) or zero(C)]], comm=COMM)
    K = K.convert("aij", PETSc.Mat())
    K.setOption(PETSc.Mat.Option.SYMMETRIC, B is C)
    options = PETSc.Options()
    for option, value in (("icntl_14", 80), ("icntl_24", 1)):  # memory; null pivots, of dependent rows
        if not options.hasName("mat_mumps_" + option):
            options["mat_mumps_" + option] = value

    def configure(pc):
        pc.setType("cholesky" if B is C else "lu")
        pc.setFactorSolverType("mumps")

    return dict(whole(blocks, K, configure)[1], iterations=None)


def fieldsplit():
    """PCFIELDSPLIT, with a nest of A + C'GC; the set-up counts that product."""
    A, _, C, D, f, g = blocks = constrained()
    if D is not None:
        return {"state": "not for D"}
    K, P, right, product = augmented(A, C, f, g)

    def configure(pc):
        pc.setType("fieldsplit")
        pc.setFieldSplitIS(*zip("01", K.getNestISs()[0]))

    row = whole(blocks, K, configure, P, right)[1]
    row["setup"] += product
    if row.get("primal", 0) > 1e-6:  # the norm of its solver is that of f + C'Gg
        row["state"] = "left with %.0e of f" % row["primal"]
    return row


def augmented(A, C, f, g):
    """Of A + C'GC, with G = 2 / diag(C diag(A)^-1 C'): matrix, preconditioning matrix, f + C'Gg, seconds."""
    COMM.barrier()
    start = time.perf_counter()
    weight, G = A.getDiagonal(), C.createVecLeft()
    stiffness = weight.getArray()
    weight.setArray(numpy.divide(1.0, stiffness, out=numpy.zeros_like(stiffness), where=stiffness > 0))
    starts, columns, values = C.getValuesCSR()
    PETSc.Mat().createAIJ(C.getSizes(), csr=(starts, columns, values**2), comm=COMM).mult(weight, G)
    own = PETSc.Mat().createAIJ((C.getSizes()[0],) * 2, nnz=1, comm=COMM)
    own.setDiagonal(-0.5 * G)
    G.reciprocal()
    G.scale(2)
    scaled, Ct, K = C.copy(), C.transpose(PETSc.Mat()), A.copy()
    scaled.diagonalScale(G)
    K.axpy(1, Ct.matMult(scaled), PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
    K.setOption(PETSc.Mat.Option.SPD, True)
    K.setNearNullSpace(A.getNearNullSpace())
    right = f.copy()
    Ct.multAdd(G * g, f, right)
    both = [PETSc.Mat().createNest([[K, Ct], [C, corner]], comm=COMM) for corner in (zero(C), own)]
    COMM.barrier()
    return *both, right, time.perf_counter() - start


def peak():
    """Memory so far [MiB], the sum over the ranks."""
    memory = PETSc.Vec().createMPI((1, PETSc.DECIDE), comm=COMM)
    memory.set(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    return memory.sum()


def change(ksp, K, C):
    """Seconds of the set-up after every hundredth row of C was scaled: the same system, but nothing tells so."""
    start, end = C.getOwnershipRange()
    scale = C.createVecLeft()
    scale.setArray(numpy.where(numpy.arange(start, end) % 100 == 0, 1.1, 1.0))
    C.diagonalScale(scale, None)
    K.assemble()
    ksp.setOperators(K)
    COMM.barrier()
    begin = time.perf_counter()
    ksp.setUp()
    COMM.barrier()
    return time.perf_counter() - begin


def zero(C):
    own, m = C.getLocalSize()[0], C.getSize()[0]
    Z = PETSc.Mat().createAIJ(((own, m), (own, m)), nnz=0, comm=COMM)
    Z.assemble()
    return Z


def scales(A, C):
    """Of unknowns and rows: one over the root of the stiffness, or of the rows where there is none."""
    from scipy.sparse import diags
    diagonal = A.diagonal()
    stiff = diagonal > 1e-12 * diagonal.max()
    dx = 1 / numpy.sqrt(numpy.where(stiff, diagonal, numpy.median(diagonal[stiff])))
    dl = 1 / numpy.sqrt((C @ diags(dx)).power(2).sum(axis=1).A1)
    columns = numpy.sqrt((diags(dl) @ C).power(2).sum(axis=0).A1)
    return numpy.where(stiff | (columns == 0), dx, 1 / numpy.where(columns > 0, columns, 1)), dl


def reference():
    """x of one rank."""
    from scipy.sparse import bmat, csr_matrix, diags, identity
    A, B, C, D, f, g = constrained()
    symmetric = B is C
    A, B, C = Rows(A), Rows(B), Rows(C)
    D = csr_matrix((len(g.getArray()),) * 2) if D is None else Rows(D).csr
    dx, dl = scales(A.csr, C.csr)
    K = bmat([[diags(dx) @ A.csr @ diags(dx), (diags(dl) @ B.csr @ diags(dx)).T],
              [diags(dl) @ C.csr @ diags(dx), -(diags(dl) @ D @ diags(dl)) - COMPLIANCE * identity(len(dl))]]).tocsr()
    K.sort_indices()
    integers = (K.indptr.astype(PETSc.IntType), K.indices.astype(PETSc.IntType))
    M = PETSc.Mat().createAIJ(size=K.shape, csr=integers + (K.data,), comm=COMM)
    M.setOption(PETSc.Mat.Option.SYMMETRIC, symmetric)
    PETSc.Options()["mat_mumps_icntl_14"] = 80
    ksp = PETSc.KSP().create(comm=COMM)
    ksp.setOperators(M)
    ksp.setType("preonly")
    ksp.getPC().setType("cholesky" if symmetric else "lu")
    ksp.getPC().setFactorSolverType("mumps")
    ksp.setFromOptions()
    b, z = M.createVecs()
    x, l = numpy.zeros(len(dx), numpy.longdouble), numpy.zeros(len(dl), numpy.longdouble)
    f, g, d = f.getArray(), g.getArray(), D.diagonal()
    changes = []
    for _ in range(60):
        r = numpy.concatenate([dx * (f - A.product(x) - B.transposed(l)), dl * (g - C.product(x) + d * l)])
        b.setArray(r.astype(float))
        ksp.solve(b, z)
        step = z.getArray().astype(numpy.longdouble) * numpy.concatenate([dx, dl])
        x, l = x + step[:len(dx)], l + step[len(dx):]
        changes.append(float(numpy.abs(step[:len(dx)]).max() / numpy.abs(x).max()))
        if changes[-1] < 1e-15:
            break
    if changes[-1] > 1e-13:
        return {"state": "the reference is not exact: last correction %g" % changes[-1]}
    result = PETSc.Vec().createSeq(len(x), comm=PETSc.COMM_SELF)
    result.setArray(x.astype(float))
    save(result, "x")
    return {"state": "exact", "steps": len(changes)}


def answer():
    """What JOB asks for; the memory [MiB] is that of all jobs so far."""
    try:
        row = {"reference": reference, "clampedreference": clampedreference, "clamped": clamped,
               "eliminated": eliminated, "ainsworth": ainsworth, "mumps": mumps,
               "fieldsplit": fieldsplit}[JOB["method"]]()
    except PETSc.Error as error:
        print(error, file=sys.stderr, flush=True)
        row = {"state": "error %d" % error.ierr}
    row.setdefault("memory", peak())
    return row


def main():
    row = answer()
    if COMM.getRank() == 0:
        print(json.dumps({key: None if isinstance(value, float) and not numpy.isfinite(value) else value
                          for key, value in row.items()}), flush=True)


if __name__ == "__main__":
    main()
