#!/usr/bin/env python3
"""Iterations of two cubes on springs between the constraints, D over 32 decades: the table of docs/method.md, compliance.

/usr/bin/python3 docs/study/compliance.py [--ranks 1] [--system "-E2 1e-3 -curved .15"]      half a minute; needs a build
"""
import argparse
import os
import re
import subprocess
import tempfile

from common import machine

machine.require("petsc4py", "numpy")
import numpy
from petsc4py import PETSc

SCALES = [0.0, 1e-16, 1e-8, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e16]


def flexibility(prefix):
    """diag(C diag(A)^-1 C') of a system in files."""
    A, C = (PETSc.Mat().load(PETSc.Viewer().createBinary(prefix + name, "r")) for name in ("_A.dat", "_C.dat"))
    indptr, indices, values = C.getValuesCSR()
    weighted = values**2 / A.getDiagonal().array[indices]
    return numpy.add.reduceat(weighted, indptr[:-1])


def write(name, diagonal):
    with open(name, "w") as file:
        file.write("%%%%MatrixMarket matrix coordinate real general\n%d %d %d\n" % ((len(diagonal),) * 3))
        for i, value in enumerate(diagonal):
            file.write("%d %d %.17g\n" % (i + 1, i + 1, value))


def iterations(ranks, prefix, D):
    command = machine.launcher(ranks) + [machine.SOLVE] + ["-%s" % name if k else prefix + "_%s.dat" % name for name in "ACfg" for k in (1, 0)]
    command += ["-D", D, "-dll_append", machine.PLUGIN, "-ainsworth_ksp_converged_reason"] + machine.DEFAULTS.split()
    output = subprocess.run(command, env=machine.ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout
    found = re.findall(r"solve converged due to \w+ iterations (\d+)", output)
    return "+".join(found) if found else "no"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--system", default="-E2 1e-3 -curved .15", help="options of twocubes")
    options = parser.parse_args()
    random = numpy.random.default_rng(5)
    with tempfile.TemporaryDirectory() as folder:
        prefix, D = (os.path.join(folder, name) for name in ("cubes", "D.mtx"))
        command = [machine.TWOCUBES, "-n1", "16", "-n2", "14", "-write_system", prefix, "-dll_append", machine.PLUGIN] + options.system.split() + machine.DEFAULTS.split()
        subprocess.run(machine.launcher(1) + command, env=machine.ENVIRONMENT, stdout=subprocess.DEVNULL, check=True)
        F = flexibility(prefix)
        spread = 10.0 ** random.uniform(-16, 16, len(F))
        cases = [("%g" % scale, scale * F) for scale in SCALES]
        cases += [("1e-16 to 1e16", spread * F), ("the same, half 0", numpy.where(random.random(len(F)) < 0.5, 0.0, spread) * F)]
        print("| `twocubes -n1 16 -n2 14`, D / F | " + " | ".join(name for name, _ in cases) + " |\n|---|" + "---|" * len(cases))
        row = []
        for _, diagonal in cases:
            write(D, diagonal)
            row.append(iterations(options.ranks, prefix, D))
        print("| `%s`, iterations | %s |" % (options.system, " | ".join(row)))


main()
