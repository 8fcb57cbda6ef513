"""energy.py scenes plugin blocksa ...: periodic cells with fibers of contrast 1e6, f = 0,
at a relative tolerance of 1e-8: the energy error, against dense linear algebra."""
import os
import subprocess
import sys
import tempfile

import petsc4py

petsc4py.init([sys.argv[0]])
import numpy  # noqa: E402
from petsc4py import PETSc  # noqa: E402

scenes, plugin = sys.argv[1:3]
cell = ["-scene", "periodic", "-n", "5", "-inclusion", "fibers", "-contrast", "1e6"]


def load(name, into):
    return into.load(PETSc.Viewer().createBinary(name, "r"))


def dense(name):
    M = load(name, PETSc.Mat()).convert("dense")  # the array does not hold it
    return M.getDenseArray().copy()


def vector(name):
    return load(name, PETSc.Vec()).getArray().copy()


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    subprocess.run([scenes, *cell, "-solve", "0", "-write_system", "cell"], check=True, stdout=subprocess.DEVNULL)
    A, C, f, g = dense("cell_A.dat"), dense("cell_C.dat"), vector("cell_f.dat"), vector("cell_g.dat")
    m, n = C.shape
    assert not f.any() and g.any()
    # x in Ker C and beside it, each by an orthonormal basis: rows of C may depend on each other
    u, s, v = numpy.linalg.svd(C)
    rank = int((s > 1e-10 * s[0]).sum())
    start = v[:rank].T @ ((u.T @ g)[:rank] / s[:rank])
    Z = v[rank:].T
    K = Z.T @ A @ Z
    exact = start - Z @ numpy.linalg.lstsq(K, Z.T @ (A @ start), rcond=1e-14)[0]
    energy = lambda x: numpy.sqrt(abs(x @ (A @ x)))  # noqa: E731
    for inner in sys.argv[3:]:
        subprocess.run([scenes, *cell, "-dll_append", plugin, "-ksp_type", "preonly", "-pc_type", "ainsworth",
                        "-ainsworth_pc_type", inner,
                        "-ainsworth_ksp_rtol", "1e-8", "-ksp_view_solution", "binary:x.bin"], check=True,
                       stdout=subprocess.DEVNULL)
        error = energy(vector("x.bin")[:n] - exact) / energy(exact)
        print(f"{inner}: energy error {error:.1e}")
        if not error <= 1e-6:
            sys.exit("too large")
print("energy: met")
