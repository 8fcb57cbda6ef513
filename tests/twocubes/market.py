"""A system as Matrix Market files gives the files that PETSc wrote, after tests/bench/market.py; `solve` names that
program for the former.
"""
import os
import subprocess
import sys

import scipy.io
from petsc4py import PETSc

market, twocubes, solve, plugin = sys.argv[1:]
alone = ["-dll_append", plugin, "-ksp_type", "preonly", "-pc_type", "ainsworth"]
subprocess.run([twocubes, "-n1", "3", "-n2", "2", "-write_system", "given"] + alone, check=True,
               stdout=subprocess.DEVNULL)


def viewer(name):
    return PETSc.Viewer().createBinary(name, "r", comm=PETSc.COMM_SELF)


for name in ("A", "C"):
    rows, columns, values = PETSc.Mat().load(viewer("given_%s.dat" % name)).getValuesCSR()
    size = PETSc.Mat().load(viewer("given_%s.dat" % name)).getSize()
    scipy.io.mmwrite("market_%s.mtx" % name, scipy.sparse.csr_matrix((values, columns, rows), shape=size), precision=17)
for name in ("f", "g"):
    scipy.io.mmwrite("market_%s.mtx" % name, PETSc.Vec().load(viewer("given_%s.dat" % name)).array.reshape(-1, 1),
                     precision=17)
files = ["market_%s.mtx" % name for name in "ACfg"]
refused = subprocess.run([solve] + ["-A", files[0], "-C", files[1], "-f", files[2]] + alone, stdout=subprocess.PIPE,
                         stderr=subprocess.STDOUT, text=True)
assert refused.returncode and (
    "is a Matrix Market file: tests/bench/market.py writes it for PETSc" in refused.stdout), refused.stdout
subprocess.run([sys.executable, market] + files, check=True, stdout=subprocess.DEVNULL)
for name in ("A", "C"):
    assert PETSc.Mat().load(viewer("given_%s.dat" % name)).equal(PETSc.Mat().load(viewer("market_%s.dat" % name))), name
for name in ("f", "g"):
    assert PETSc.Vec().load(viewer("given_%s.dat" % name)).equal(PETSc.Vec().load(viewer("market_%s.dat" % name))), name
print("market: the same files")
