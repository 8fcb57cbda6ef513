"""
Flow in a cavity that its lid drives, Taylor-Hood elements of DOLFINx: [A B'; B 0][u; p] = [0; 0], pressures are
multipliers.

The steps of DOLFINx's own Stokes demo. The program knows PETSC_OPTIONS only; the fields are named after the options
have been read, and Pmat has a mass matrix of the pressures, as PCFIELDSPLIT wants it. Each layout is compared with
MUMPS, where one pressure is fixed.

  $ export PETSC_OPTIONS="-dll_append /path/of/libainsworth.so -ksp_type preonly -pc_type ainsworth"
  $ export PETSC_OPTIONS="$PETSC_OPTIONS -ainsworth_ksp_converged_reason"
  $ mpiexec -n 2 python3 stokes_dolfinx.py
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 19
  nest: 2467 rows; difference from MUMPS below 1e-6: yes
  ...
"""
import sys
try:
    import numpy as np
    import ufl
    from dolfinx import fem, mesh
    from dolfinx_versions import assemble_matrix, assemble_vector, functionspace
    from mpi4py import MPI
    from petsc4py import PETSc
    from ufl import div, dx, grad, inner
except ImportError as why:
    print('skipped:', why)
    sys.exit(77)

comm = MPI.COMM_WORLD
n = int(sys.argv[1]) if len(sys.argv) > 1 else 16
square = mesh.create_unit_square(comm, n, n)
V, Q = functionspace(square, ('Lagrange', 2, (2,))), functionspace(square, ('Lagrange', 1))
u, v, p, q = ufl.TrialFunction(V), ufl.TestFunction(V), ufl.TrialFunction(Q), ufl.TestFunction(Q)
zero = fem.Constant(square, PETSc.ScalarType(0))


def velocity(where, value):
    facets = mesh.locate_entities_boundary(square, 1, where)
    return fem.dirichletbc(np.array(value, PETSc.ScalarType), fem.locate_dofs_topological(V, 1, facets), V)


walls = velocity(lambda x: np.isclose(x[0], 0) | np.isclose(x[0], 1) | np.isclose(x[1], 0), (0, 0))
lid = velocity(lambda x: np.isclose(x[1], 1), (1, 0))
a = fem.form([[inner(grad(u), grad(v)) * dx, inner(p, div(v)) * dx], [inner(div(u), q) * dx, None]])
mass = fem.form(inner(p, q) * dx)
L = fem.form([inner(fem.Constant(square, PETSc.ScalarType((0, 0))), v) * dx, inner(zero, q) * dx])
m = [[a[0][0], None], [None, mass]]
nest, nestM = (assemble_matrix(form, [walls, lid], kind='nest') for form in (a, m))
whole, wholeM = (assemble_matrix(form, [walls, lid]) for form in (a, m))
b = assemble_vector(L, a, [walls, lid])
rows = nest.getNestISs()[0]

# MUMPS: the first pressure is zero, the others follow
fixed = whole.copy()
first = rows[1].getIndices()[:1] if comm.rank == 0 else []
fixed.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
fixed.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
fixed.zeroRowsColumns(first, 1)
constant = b.duplicate()
part = constant.getSubVector(rows[1])  # pressures are known but for a constant
part.set(1)
constant.restoreSubVector(rows[1], part)
constant.normalize()
for M in nest, whole:
    M.setNullSpace(PETSc.NullSpace().create(vectors=[constant]))

direct = PETSc.KSP().create(comm)
direct.setOptionsPrefix('direct_')
direct.setOperators(fixed)
direct.setType('preonly')
direct.getPC().setType('lu')
direct.getPC().setFactorSolverType('mumps')
y, rhs = b.duplicate(), b.copy()
if len(first):
    rhs.setValue(first[0], 0)
rhs.assemble()
direct.solve(rhs, y)
y.axpy(-y.dot(constant), constant)


def solve(name, K, M, named):
    ksp = PETSc.KSP().create(comm)
    ksp.setOperators(K, M)
    ksp.setFromOptions()
    if named:
        ksp.getPC().setFieldSplitIS(('u', rows[0]), ('p', rows[1]))
    x = b.duplicate()
    ksp.solve(b, x)
    x.axpy(-1, y)
    error = x.norm() / y.norm()
    PETSc.Sys.Print(
        f'{name}: {K.getSize()[0]} rows; difference from MUMPS below 1e-6: {"yes" if error < 1e-6 else error}')


solve('nest', nest, nestM, False)
solve('one matrix, fields named', whole, wholeM, True)
solve('one matrix and nothing else', whole, wholeM, False)
