"""ainsworth.py, loaded after PETSc was initialized: module.py [plugin [module that initializes PETSc]]. A chain of
springs with ties.
"""
import importlib
import sys

for module in sys.argv[2:]:
    importlib.import_module(module)

from petsc4py import PETSc  # noqa: E402

import ainsworth  # noqa: E402

ainsworth.load(*sys.argv[1:2])
assert ainsworth.load() is ainsworth.load(), "loaded twice"
n, ties = 200, 3
A = PETSc.Mat().createAIJ((n, n), nnz=3)
C = PETSc.Mat().createAIJ(((None, ties), (A.getLocalSize()[1], n)), nnz=2)
for i in range(*A.getOwnershipRange()):
    for j, value in ((i - 1, -1.0), (i, 2.1), (i + 1, -1.0)):
        if 0 <= j < n:
            A[i, j] = value
for row in range(*C.getOwnershipRange()):
    C[row, 40 * row], C[row, 40 * row + 90] = 1.0, -1.0
A.assemble()
C.assemble()
K = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])
x, b = K.createVecs()
b.set(1.0)

ksp = PETSc.KSP().create()
ksp.setType("preonly")
ksp.setOperators(K)
pc = ksp.getPC()
pc.setType("ainsworth")
inner = ainsworth.inner_ksp(pc)
assert inner.getOptionsPrefix() == "ainsworth_", inner.getOptionsPrefix()
inner.setTolerances(rtol=1e-10)
inner.getPC().setType("jacobi")
try:  # nothing was estimated, and an error of the plugin is one of petsc4py
    ainsworth.error_estimate(pc)
    sys.exit("an estimate of nothing")
except PETSc.Error as error:
    assert error.ierr == 73, error.ierr
PETSc.Options().setValue("-pc_ainsworth_stop", "energy_error")
PETSc.Options().setValue("-pc_ainsworth_error_rtol", 1e-8)
ksp.setFromOptions()
ksp.solve(b, x)
r = K.createVecLeft()
K.mult(x, r)
r.axpy(-1.0, b)
assert r.norm() <= 1e-6 * b.norm(), r.norm()
assert ainsworth.iterations(pc) == inner.getIterationNumber() > 1
iteration, lower, upper = ainsworth.error_estimate(pc)
energy = x.getSubVector(K.getNestISs()[0][0])
Ax = A.createVecLeft()
A.mult(energy, Ax)
assert 0 < iteration < ainsworth.iterations(pc) and 0 < lower <= 1e-6 * abs(Ax.dot(energy)) ** 0.5, (
    iteration, lower, upper)
assert ainsworth.failure(pc) == ""

inner.setTolerances(max_it=1)  # and now a solve that fails
ksp.solve(b, x)
assert ksp.getConvergedReason() < 0 and "iteration" in ainsworth.failure(pc), ainsworth.failure(pc)
PETSc.Sys.Print("failure: " + ainsworth.failure(pc))
references = inner.getRefCount()
del inner
assert ainsworth.inner_ksp(pc).getRefCount() == references, "a reference is lost or too many"
PETSc.Sys.Print("module: passed")
