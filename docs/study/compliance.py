#!/usr/bin/env python3
"""Iterations of two cubes on springs between the constraints, D over 32 decades: docs/method/compliance.csv has what it
prints.

/usr/bin/python3 docs/study/compliance.py [--ranks 1] [--system "-E2 1e-3 -curved .15"]
    half a minute; needs a build
/usr/bin/python3 docs/study/compliance.py --n1 8 --most 1.1
    fails where D costs more than that times D = 0
/usr/bin/python3 docs/study/compliance.py --collection torn_elastic mixed_raviart
    systems of tests/systems, and the error of x
/usr/bin/python3 docs/study/compliance.py --collection torn_elastic --scales 1e6 1e8 1e10
    other D / F

The error is that of x in the norm of A against LU with refinement in extended precision, with a tolerance of 1e-12, and
that of the same LU with refinement in double precision; iterations are those of the default tolerance, 18+1 with a
further solve, which is loose, after it.
"""
import argparse
import math
import os
import re
import subprocess
import sys
import tempfile

from common import machine

machine.require("petsc4py", "numpy")
import numpy
import petsc4py

petsc4py.init(["compliance", "-dll_append", machine.PLUGIN])
from petsc4py import PETSc

SCALES = [0.0, 1e-16, 1e-8, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e16]


def flexibility(prefix):
    """diag(C diag(A)^-1 C') of a system in files."""
    A, C = (PETSc.Mat().load(PETSc.Viewer().createBinary(prefix + name, "r")) for name in ("_A.dat", "_C.dat"))
    indptr, indices, values = C.getValuesCSR()
    weighted = values**2 / A.getDiagonal().array[indices]
    return numpy.add.reduceat(weighted, indptr[:-1])


def write(name, diagonal):
    n = len(diagonal)
    D = PETSc.Mat().createAIJ((n, n), csr=(numpy.arange(n + 1, dtype=PETSc.IntType),
                                           numpy.arange(n, dtype=PETSc.IntType), diagonal), comm=PETSc.COMM_SELF)
    viewer = PETSc.Viewer().createBinary(name, "w", comm=PETSc.COMM_SELF)
    D.view(viewer)
    viewer.destroy()


def iterations(ranks, prefix, D, rtol=None):
    command = machine.launcher(ranks) + [machine.SOLVE] + ["-%s" % name if k else prefix + "_%s.dat" % name
                                                           for name in "ACfg" for k in (1, 0)]
    command += (["-D", D, "-dll_append", machine.PLUGIN, "-ainsworth_ksp_converged_reason", "-info", ":pc"]
                + machine.DEFAULTS.split())
    command += ["-ainsworth_ksp_rtol", rtol] if rtol else []
    process = subprocess.run(command, env=machine.ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                             text=True)
    output = process.stdout
    found = re.findall(r"solve converged due to \w+ iterations (\d+)", output)
    if process.returncode or "Setting up PC" in output.split("solve converged", 1)[-1]:
        return "no"  # refused, or by a factorization: a solve sets up nothing
    return "+".join(found) if found else "no"


def direct(A, C, D, f, g, precision):
    """x by LU; the equations are scaled to entries of about 1."""
    K = numpy.block([[A, C.T], [C, -D]]).astype(precision)
    b = numpy.concatenate([f, g]).astype(precision)
    scale = 1 / numpy.sqrt(abs(K).max(axis=1))
    K, b, y = K * scale[:, None] * scale, b * scale, numpy.zeros(len(b), precision)
    inverse = numpy.linalg.inv(K.astype(float))
    for _ in range(20):
        y += inverse @ (b - K @ y).astype(float)
    return (y * scale)[: len(A)].astype(float)


def error(A, x, exact):
    return numpy.sqrt((x - exact) @ A @ (x - exact) / (exact @ A @ exact))


def solve(A, C, D, f, g, tolerance):
    """x by the plugin, from a nest."""
    def mat(values):
        M = PETSc.Mat().createAIJ(values.shape, nnz=max(1, int((values != 0).sum(axis=1).max())))
        for i, j in zip(*numpy.nonzero(values)):
            M.setValue(int(i), int(j), values[i, j])
        M.assemble()
        return M
    K = PETSc.Mat().createNest([[mat(A), mat(C.T.copy())], [mat(C), mat(-D)]])
    K.assemble()
    ksp = PETSc.KSP().create()
    ksp.setOperators(K)
    for name, value in (("ksp_type", "preonly"), ("pc_type", "ainsworth"), ("ainsworth_ksp_rtol", tolerance)):
        PETSc.Options()[name] = value
    ksp.setFromOptions()
    x, b = PETSc.Vec().createSeq(len(f) + len(g)), PETSc.Vec().createSeq(len(f) + len(g))
    b.setArray(numpy.concatenate([f, g]))
    ksp.solve(b, x)
    return x.getArray()[: len(A)].copy()


def collection(names, scales, random):
    print("| system of `tests/systems` | " + " | ".join("%g" % s for s in scales)
          + " | 1e-16 to 1e16 | the same, half 0 |\n|---|" + "---|" * (len(scales) + 2))
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            prefix = os.path.join(folder, "system")
            binary = os.path.join(machine.BUILD, "tests", "systems", "systems")
            subprocess.run(machine.launcher(1) + [binary, "-only", name, "-write", prefix], env=machine.ENVIRONMENT,
                           stdout=subprocess.DEVNULL, check=True)
            A, C = (PETSc.Mat().load(PETSc.Viewer().createBinary(prefix + part, "r")) for part in ("_A.dat", "_C.dat"))
            f, g = (PETSc.Vec().load(PETSc.Viewer().createBinary(prefix + part, "r")).getArray().copy()
                    for part in ("_f.dat", "_g.dat"))
            F = flexibility(prefix)
            spread = 10.0 ** random.uniform(-16, 16, len(F))
            counts, errors = [], ([], [])
            for diagonal in [scale * F for scale in scales] + [
                    spread * F, numpy.where(random.random(len(F)) < 0.5, 0.0, spread) * F]:
                write(os.path.join(folder, "D"), diagonal)
                counts.append(iterations(1, prefix, os.path.join(folder, "D")))
                dense = [M.convert("dense").getDenseArray().copy() for M in (A.copy(), C.copy())]
                system = (*dense, numpy.diag(diagonal), f, g)
                exact = direct(*system, numpy.longdouble)
                errors[0].append(error(dense[0], solve(*system, 1e-12), exact))
                errors[1].append(error(dense[0], direct(*system, float), exact))
            print("| `%s`, iterations | %s |" % (name, " | ".join(counts)))
            for name, values in zip(("error, tolerance 1e-12", "LU in double precision"), errors):
                print("| %s | %s |" % (name, " | ".join("%.0e" % e for e in values)), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--system", default="-E2 1e-3 -curved .15", help="options of twocubes")
    parser.add_argument("--n1", type=int, default=16, help="elements per edge of the first cube")
    parser.add_argument("--rtol", help="of the reduced system, in the place of the default")
    parser.add_argument("--most", type=float, help="how many times the iterations of D = 0 are allowed")
    parser.add_argument("--collection", nargs="+", default=[], help="names of systems of tests/systems instead")
    parser.add_argument("--scales", nargs="+", type=float, default=SCALES, help="D / F of these systems")
    options = parser.parse_args()
    random = numpy.random.default_rng(5)
    if options.collection:
        return collection(options.collection, options.scales, random)
    with tempfile.TemporaryDirectory() as folder:
        prefix, D = (os.path.join(folder, name) for name in ("cubes", "D.dat"))
        command = [machine.TWOCUBES, "-n1", str(options.n1), "-n2", str(options.n1 - 2), "-write_system", prefix,
                   "-dll_append", machine.PLUGIN] + options.system.split() + machine.DEFAULTS.split()
        subprocess.run(machine.launcher(1) + command, env=machine.ENVIRONMENT, stdout=subprocess.DEVNULL, check=True)
        F = flexibility(prefix)
        spread = 10.0 ** random.uniform(-16, 16, len(F))
        cases = [("%g" % scale, scale * F) for scale in SCALES]
        cases += [("1e-16 to 1e16", spread * F),
                  ("the same, half 0", numpy.where(random.random(len(F)) < 0.5, 0.0, spread) * F)]
        print("| `twocubes -n1 %d -n2 %d`, D / F | " % (options.n1, options.n1 - 2)
              + " | ".join(name for name, _ in cases) + " |\n|---|" + "---|" * len(cases))
        row = []
        for _, diagonal in cases:
            write(D, diagonal)
            row.append(iterations(options.ranks, prefix, D, options.rtol))
        print("| `%s`, iterations | %s |" % (options.system, " | ".join(row)))
    if options.most:
        totals = [sum(int(k) for k in count.split("+")) if count != "no" else math.inf for count in row]
        enough = max(totals) <= options.most * totals[0]
        print("at most %g times the iterations of D = 0: %s" % (options.most, "yes" if enough else "no"))
        sys.exit(not enough)


main()
