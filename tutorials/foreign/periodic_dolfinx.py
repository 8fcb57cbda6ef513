"""
A layered block of DOLFINx's elements that is periodic in x by Lagrange multipliers, stretched by a tenth: [A C'; C
0][u; l] = [f; g].

The program knows PETSc only; PETSC_OPTIONS loads the plugin and chooses it. Each layout is compared with MUMPS.

  $ export PETSC_OPTIONS="-dll_append /path/of/libainsworth.so -ksp_type preonly -pc_type ainsworth"
  $ export PETSC_OPTIONS="$PETSC_OPTIONS -ainsworth_ksp_converged_reason"
  $ mpiexec -n 2 python3 periodic_dolfinx.py
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 13
  nest: 2403 rows; difference from MUMPS below 1e-6: yes
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
except ImportError as why:
    print('skipped:', why)
    sys.exit(77)

comm = MPI.COMM_WORLD


def elasticity(n):
    """A, f and the function space of a cube of n^3 cells, held at its bottom; its layers differ by a factor of 10"""
    cube = mesh.create_unit_cube(comm, n, n, n, mesh.CellType.hexahedron)
    V = functionspace(cube, ('Lagrange', 1, (3,)))
    x = ufl.SpatialCoordinate(cube)
    E = ufl.conditional(ufl.lt(x[2], 0.5), 10.0, 1.0)
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    strain = lambda w: ufl.sym(ufl.grad(w))
    stress = E / 1.3 * (strain(u) + 0.75 * ufl.div(u) * ufl.Identity(3))
    load = fem.Constant(cube, PETSc.ScalarType((0, 0, -0.01)))
    bottom = mesh.locate_entities_boundary(cube, 2, lambda x: np.isclose(x[2], 0))
    held = fem.dirichletbc(np.zeros(3, PETSc.ScalarType), fem.locate_dofs_topological(V, 2, bottom), V)
    a, L = fem.form(ufl.inner(stress, strain(v)) * ufl.dx), fem.form(ufl.inner(load, v) * ufl.dx)
    A = fem.petsc.assemble_matrix(a, bcs=[held])
    A.assemble()
    f = fem.petsc.assemble_vector(L)
    fem.petsc.apply_lifting(f, [a], bcs=[[held]])
    f.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
    fem.petsc.set_bc(f, [held])
    return A, f, V


def ties(A, V):
    """C and g: u on the right side is u on the left side, and a tenth more in x. A pair of nodes has its rows where the
    right one is
    """
    nodes = V.dofmap.index_map
    at = V.tabulate_dof_coordinates()[:nodes.size_local]
    number = nodes.local_range[0] + np.arange(nodes.size_local)
    free = at[:, 2] > 1e-9
    left, right = (free & np.isclose(at[:, 0], side) for side in (0, 1))
    key = lambda x: (round(x[1], 9), round(x[2], 9))
    partner = dict(sum(comm.allgather([(key(x), k) for x, k in zip(at[left], number[left])]), []))
    C = PETSc.Mat().createAIJ(((3 * right.sum(), None), (A.getLocalSize()[1], None)), nnz=(2, 2), comm=comm)
    g = C.createVecLeft()
    row = C.getOwnershipRange()[0]
    for x, k in zip(at[right], number[right]):
        for c in range(3):
            C.setValues(row, [3 * k + c, 3 * partner[key(x)] + c], [1, -1])
            g.setValue(row, 0.1 if c == 0 else 0)
            row += 1
    C.assemble()
    g.assemble()
    return C, g


def factor(K):
    direct = PETSc.KSP().create(comm)
    direct.setOptionsPrefix('direct_')
    direct.setOperators(K.convert('aij', PETSc.Mat()) if K.getType() == 'nest' else K)
    direct.setType('preonly')
    direct.getPC().setType('lu')
    direct.getPC().setFactorSolverType('mumps')
    return direct


def solve(name, K, b, name_fields=None):
    """As the options say, and by MUMPS"""
    ksp = PETSc.KSP().create(comm)
    ksp.setOperators(K)
    ksp.setFromOptions()
    if name_fields:
        name_fields(ksp.getPC())
    x = b.duplicate()
    ksp.solve(b, x)
    direct = factor(K)
    y, flat = (PETSc.Vec().createWithArray(v.array_r.copy(), comm=comm) for v in (b, b))
    direct.solve(flat, y)
    error = y.norm()
    y.array = y.array_r - x.array_r
    error = y.norm() / error
    PETSc.Sys.Print(
        f'{name}: {K.getSize()[0]} rows; difference from MUMPS below 1e-6: {"yes" if error < 1e-6 else error}')


def solve_all(name, K, b, loads):
    """b and random ones, at once"""
    ksp, direct = PETSc.KSP().create(comm), factor(K)
    ksp.setOperators(K)
    ksp.setFromOptions()
    ksp.setUp()
    B = PETSc.Mat().createDense(((b.getLocalSize(), b.getSize()), (None, loads)), comm=comm)
    B.setUp()
    random = np.random.default_rng(comm.rank)
    for k in range(loads):
        column = B.getDenseColumnVec(k, mode='w')
        column.setArray(b.array_r if k == 0 else random.uniform(-1, 1, b.getLocalSize()))
        B.restoreDenseColumnVec(k, mode='w')
    B.assemble()
    X = B.duplicate()
    ksp.getPC().matApply(B, X)  # KSP.matSolve() of newer petsc4pys
    worst = 0
    for k in range(loads):
        y = b.duplicate()
        right = B.getDenseColumnVec(k, mode='r')
        direct.solve(right, y)
        B.restoreDenseColumnVec(k, mode='r')
        norm, x = y.norm(), X.getDenseColumnVec(k, mode='r')
        y.axpy(-1, x)
        X.restoreDenseColumnVec(k, mode='r')
        worst = max(worst, y.norm() / norm)
    PETSc.Sys.Print(f'{name}: {loads} loads; difference from MUMPS below 1e-6: {"yes" if worst < 1e-6 else worst}')


def main():
    A, f, V = elasticity(int(sys.argv[1]) if len(sys.argv) > 1 else 8)
    C, g = ties(A, V)
    nest = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])
    b = PETSc.Vec().createWithArray(np.concatenate((f.array_r, g.array_r)), comm=comm)
    rows = nest.getNestISs()[0]
    whole = nest.convert('aij', PETSc.Mat())
    whole.setBlockSize(1)
    forgotten = A.copy()
    forgotten.setBlockSize(1)
    solve('nest', nest, b)
    solve('nest, block size forgotten',
          PETSc.Mat().createNest([[forgotten, PETSc.Mat().createTranspose(C)], [C, None]]), b)
    solve('one matrix, fields named', whole, b, lambda pc: pc.setFieldSplitIS(('u', rows[0]), ('ties', rows[1])))
    solve('one matrix and nothing else', whole, b)
    solve_all('nest', nest, b, 10)


if __name__ == '__main__':
    main()
