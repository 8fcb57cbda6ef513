"""
Bodies of DOLFINx's elements that integrals alone hold, each a row with all unknowns or with all of a side: [A C'; C
0][u; l] = [f; g].

A potential with a given mean value, an elastic body without mean translation and rotation, and one whose side moves by
0.1 in the mean. The program knows PETSc only; PETSC_OPTIONS loads the plugin and chooses it. Each layout is compared
with MUMPS.

  $ export PETSC_OPTIONS="-dll_append /path/of/libainsworth.so -ksp_type preonly -pc_type ainsworth"
  $ export PETSC_OPTIONS="$PETSC_OPTIONS -ainsworth_ksp_converged_reason"
  $ mpiexec -n 2 python3 mean_dolfinx.py
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 12
  potential, nest: 1332 rows; difference from MUMPS below 1e-6: yes
  ...
"""
import sys
try:
    import dolfinx.fem.petsc
    import numpy as np
    import ufl
    from dolfinx import fem, mesh
    from dolfinx_versions import functionspace
    from mpi4py import MPI
    from petsc4py import PETSc
    from ufl import cross, div, dx, grad, inner, sin
except ImportError as why:
    print('skipped:', why)
    sys.exit(77)

comm = MPI.COMM_WORLD
n = int(sys.argv[1]) if len(sys.argv) > 1 else 10
cube = mesh.create_unit_cube(comm, n, n, n, mesh.CellType.hexahedron)
x = ufl.SpatialCoordinate(cube)
axes = [ufl.as_vector([1.0 if i == k else 0.0 for i in range(3)]) for k in range(3)]
motions = axes + [cross(x, axis) for axis in axes]
facets = mesh.locate_entities_boundary(cube, 2, lambda x: np.isclose(x[2], 0))
side = ufl.Measure('ds', domain=cube,
                   subdomain_data=mesh.meshtags(cube, 2, np.sort(facets), np.ones(len(facets), np.int32)))(1)


def matrix(a):
    A = fem.petsc.assemble_matrix(fem.form(a))
    A.assemble()
    return A


def vector(L):
    v = fem.petsc.assemble_vector(fem.form(L))
    v.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
    return v


def rows(integrals):
    """A row for each integral, all of them on the first rank"""
    vectors = [vector(L) for L in integrals]
    C = PETSc.Mat().createAIJ(((len(vectors) if comm.rank == 0 else 0, None), (vectors[0].getLocalSize(), None)),
                              comm=comm)
    C.setUp()
    C.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    for i, v in enumerate(vectors):
        nonzero = np.flatnonzero(v.array_r)
        C.setValues([i], (v.getOwnershipRange()[0] + nonzero).astype(PETSc.IntType), v.array_r[nonzero])
    C.assemble()
    return C


def rigid_motions(V):
    at = V.tabulate_dof_coordinates()[:V.dofmap.index_map.size_local]
    vectors = []
    for k in range(6):
        v = PETSc.Vec().createMPI((3 * len(at), None), comm=comm)
        v.array = (np.tile(np.eye(3)[k], (len(at), 1)) if k < 3 else np.cross(at, np.eye(3)[k - 3])).ravel()
        for other in vectors:
            v.axpy(-v.dot(other), other)
        v.normalize()
        vectors.append(v)
    return PETSc.NullSpace().create(vectors=vectors, comm=comm)


def solve(name, A, C, f, value):
    nest = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])
    g = C.createVecLeft()
    g.set(value)
    b = PETSc.Vec().createWithArray(np.concatenate((f.array_r[:A.getLocalSize()[0]], g.array_r)), comm=comm)
    whole = nest.convert('aij', PETSc.Mat())
    whole.setBlockSize(1)
    direct = PETSc.KSP().create(comm)
    direct.setOptionsPrefix('direct_')
    direct.setOperators(whole)
    direct.setType('preonly')
    direct.getPC().setType('lu')
    direct.getPC().setFactorSolverType('mumps')
    y = b.duplicate()
    direct.solve(b, y)
    for layout, K in ('nest', nest), ('one matrix', whole):
        ksp = PETSc.KSP().create(comm)
        ksp.setOperators(K)
        ksp.setFromOptions()
        x = b.duplicate()
        ksp.solve(b, x)
        norm = b.norm()  # which a solver must leave right
        x.axpy(-1, y)
        error = x.norm() / y.norm()
        right = error < 1e-6 and abs(norm - np.sqrt(comm.allreduce(b.array_r @ b.array_r))) < 1e-12 * norm
        PETSc.Sys.Print(
            f'{name}, {layout}: {K.getSize()[0]} rows; difference from MUMPS below 1e-6: {"yes" if right else error}')


Q = functionspace(cube, ('Lagrange', 1))
u, v = ufl.TrialFunction(Q), ufl.TestFunction(Q)
solve('potential', matrix(inner(grad(u), grad(v)) * dx), rows([v * dx]), vector(sin(3 * x[0]) * v * dx), 0.3)

V = functionspace(cube, ('Lagrange', 1, (3,)))
u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
strain = lambda w: ufl.sym(grad(w))
A = matrix(inner(strain(u) + 1.5 * div(u) * ufl.Identity(3), strain(v)) * dx)
A.setNearNullSpace(rigid_motions(V))
f = vector(inner(ufl.as_vector((x[1] * x[2], 0, sin(4 * x[0]))), v) * dx)
solve('body without rigid motions', A, rows([inner(m, v) * dx for m in motions]), f, 0)
solve('body held by a side', A, rows([inner(m, v) * side for m in motions]), f, 0.1)
