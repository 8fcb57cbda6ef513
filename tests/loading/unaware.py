"""unaware.c in Python: a small saddle-point system, solved with whatever the options say."""
import os
import sys
import petsc4py

petsc4py.init(sys.argv)
from petsc4py import PETSc  # noqa: E402

if "AINSWORTH_LIBRARY" in os.environ:  # the third way in: no option of PETSc at all
    import ctypes
    plugin = ctypes.CDLL(os.environ["AINSWORTH_LIBRARY"], ctypes.RTLD_GLOBAL)
    if plugin.AinsworthInitializePackage() != 0:
        sys.exit("AinsworthInitializePackage failed")

comm = PETSc.COMM_WORLD
n, size, rank = 16, comm.size, comm.rank
N = n * size
A = PETSc.Mat().createAIJ(((n, N), (n, N)), nnz=(3, 2), comm=comm)
start, end = A.getOwnershipRange()
for i in range(start, end):
    for j in (i - 1, i + 1):
        if 0 <= j < N:
            A[i, j] = -1.0
    A[i, i] = 2.1 + i / N
A.assemble()
C = PETSc.Mat().createAIJ(((2, 2 * size), (n, N)), nnz=(2, 2), comm=comm)
for row, first, second in ((2 * rank, start, end - 1), (2 * rank + 1, start + 2, start + 4)):
    C[row, first] = 1.0
    C[row, second] = -1.0
C.assemble()
K = PETSc.Mat().createNest([[A, C.transpose(PETSc.Mat())], [C, None]], comm=comm)
x, b = K.createVecs()
b.set(1.0)

ksp = PETSc.KSP().create(comm)
ksp.setOperators(K)
ksp.getPC().setType(PETSc.Options().getString("pc_type"))
ksp.setErrorIfNotConverged(True)
ksp.setFromOptions()
ksp.solve(b, x)
r = b.duplicate()
K.mult(x, r)
r.aypx(-1.0, b)
residual = r.norm() / b.norm()
PETSc.Sys.Print(f"relative residual: {residual:g}\nsolved: {'yes' if residual <= 1e-8 else 'no'}")
