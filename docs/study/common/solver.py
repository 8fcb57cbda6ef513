"""The part of the study that talks to PETSc, in a process of its own so that a crash or a time limit costs one run
only.

python3 solver.py <job.json> prints one JSON line per solver configuration of the job. The reference solution is kept
beside the system.
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
from direct import Rows, direct, energy, inner_iterations, load_system  # noqa: E402

LIBRARY = ctypes.CDLL(JOB["plugin"])
REASONS = {value: name for name, value in vars(PETSc.KSP.ConvergedReason).items() if isinstance(value, int)
           and not name.startswith("_")}


def reference(A, C, f, g, name):
    path = "%s_%s.npy" % (JOB["prefix"], name)
    if not os.path.exists(path):
        numpy.save(path, direct(Rows(A), Rows(C), f.getArray(), g.getArray())[0])
    return numpy.load(path)


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
        iterations, reason = inner_iterations(LIBRARY, ksp.getPC())
        failed = ksp.getConvergedReason()
        ksp.destroy()
    row["iterations"] = iterations
    row["reason"] = REASONS.get(reason, str(reason))
    if reason == 0:  # the set-up failed and the inner solver never ran
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
    A, C, f, g = load_system(JOB["prefix"])
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
        row = {key: None if isinstance(value, float) and not numpy.isfinite(value) else value
               for key, value in row.items()}
        print(json.dumps(dict(row, number=number)), flush=True)


main()
