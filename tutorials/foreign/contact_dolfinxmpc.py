"""
Two bodies of DOLFINx's elements whose meshes do not match, held together by dolfinx_mpc's contact conditions as
Lagrange multipliers: [A C'; C 0].

dolfinx_mpc eliminates its conditions; here ainsworth.from_mpc() makes each a row of C: a slave is a combination of its
masters. The answer is compared with that of dolfinx_mpc's own reduced matrix, factored by MUMPS. PETSC_OPTIONS loads
the plugin and chooses it, PYTHONPATH has ainsworth.py.

  $ export PETSC_OPTIONS="-dll_append /path/of/libainsworth.so -ksp_type preonly -pc_type ainsworth"
  $ export PETSC_OPTIONS="$PETSC_OPTIONS -ainsworth_ksp_converged_reason"
  $ export PYTHONPATH=/path/of/lib/ainsworth
  $ mpiexec -n 2 python3 contact_dolfinxmpc.py
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 13
  glued, nest: 1404 unknowns, 147 rows; difference from dolfinx_mpc below 1e-6: yes
  ...
"""
import sys
try:
    import ainsworth
    import dolfinx.fem.petsc
    import dolfinx_mpc
    import numpy as np
    import ufl
    from dolfinx import fem, mesh
    from dolfinx_versions import functionspace, hexahedra
    from mpi4py import MPI
    from petsc4py import PETSc
except ImportError as why:
    print('skipped:', why)
    sys.exit(77)

comm = MPI.COMM_WORLD
LOWER, UPPER = 1, 2  # the sides that meet
NEAR = 1e-12  # squared distance of what touches. Newton's method stops by it since 0.10, never by the default, 1e-20


def grid(n, corner, size):
    """Points and hexahedra of a block of n cells along each axis"""
    i, j, k = np.meshgrid(*(np.arange(n + 1),) * 3, indexing='ij')
    points = np.array(corner) + np.array(size) * np.stack((i, j, k), -1).reshape(-1, 3) / n
    number = np.arange((n + 1) ** 3).reshape((n + 1,) * 3)
    corners = [number[a:n + a, b:n + b, c:n + c].reshape(-1) for c in (0, 1) for b in (0, 1) for a in (0, 1)]
    return points, np.stack(corners, -1)


def bodies(n):
    """A block of n^3 cells on one of (n - n // 3)^3, all turned about an oblique axis; the upper one is a little
    smaller
    """
    below, above = grid(n - n // 3, (0, 0, 0), (1, 1, 1)), grid(n, (0.05, 0.03, 1), (0.9, 0.93, 1))
    points, cells = np.concatenate((below[0], above[0])), np.concatenate((below[1], above[1] + len(below[0])))
    if comm.rank:
        points, cells = points[:0], cells[:0]
    return hexahedra(comm, cells, points @ turned.T)


def elasticity(domain):
    V = functionspace(domain, ('Lagrange', 1, (3,)))
    E = fem.Function(functionspace(domain, ('DG', 0)))
    E.interpolate(lambda x: np.where((turned.T @ x)[2] < 1, 10.0, 1.0))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    strain = lambda w: ufl.sym(ufl.grad(w))
    stress = E / 1.3 * (strain(u) + 0.75 * ufl.div(u) * ufl.Identity(3))
    load = fem.Constant(domain, PETSc.ScalarType(tuple(turned @ (0.02, 0.01, -0.1))))
    bcs = []
    # the top of the upper body is moved down: frictionless contact does not hold it against sliding
    for height, value in ((0, (0, 0, 0)), (2, turned @ (0, 0, -0.1))):
        side = mesh.locate_entities_boundary(domain, 2, lambda x: np.isclose((turned.T @ x)[2], height))
        bcs.append(fem.dirichletbc(np.array(value, PETSc.ScalarType), fem.locate_dofs_topological(V, 2, side), V))
    return V, fem.form(ufl.inner(stress, strain(v)) * ufl.dx), fem.form(ufl.inner(load, v) * ufl.dx), bcs


def sides(domain):
    """The two sides that meet"""
    found = mesh.locate_entities_boundary(domain, 2, lambda x: np.isclose((turned.T @ x)[2], 1))
    # an upper facet belongs to a cell above
    middle = mesh.compute_midpoints(domain, 3, np.arange(domain.topology.index_map(3).size_local
                                                         + domain.topology.index_map(3).num_ghosts, dtype=np.int32))
    domain.topology.create_connectivity(2, 3)
    cell = domain.topology.connectivity(2, 3)
    which = np.array([UPPER if (turned.T @ middle[cell.links(f)[0]])[2] > 1 else LOWER for f in found], dtype=np.int32)
    return mesh.meshtags(domain, 2, found, which)


def eliminated(mpc, a, L, bcs):
    """dolfinx_mpc's own answer"""
    A = dolfinx_mpc.assemble_matrix(a, mpc, bcs=bcs)
    b = dolfinx_mpc.assemble_vector(L, mpc)
    dolfinx_mpc.apply_lifting(b, [a], [bcs], mpc)
    b.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
    fem.petsc.set_bc(b, bcs)
    direct = PETSc.KSP().create(comm)
    direct.setOptionsPrefix('direct_')
    direct.setOperators(A)
    direct.setType('preonly')
    direct.getPC().setType('lu')
    direct.getPC().setFactorSolverType('mumps')
    x = b.duplicate()
    direct.solve(b, x)
    x.ghostUpdate(PETSc.InsertMode.INSERT, PETSc.ScatterMode.FORWARD)
    mpc.backsubstitution(x)
    return x.array_r.copy()


def saddle(a, L, bcs):
    A = fem.petsc.assemble_matrix(a, bcs=bcs)
    A.assemble()
    f = fem.petsc.assemble_vector(L)
    fem.petsc.apply_lifting(f, [a], bcs=[bcs])
    f.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
    fem.petsc.set_bc(f, bcs)
    return A, f


def solve(name, K, f, m, reference):
    b = PETSc.Vec().createWithArray(np.concatenate((f.array_r, np.zeros(m))), comm=comm)
    ksp = PETSc.KSP().create(comm)
    ksp.setOperators(K)
    ksp.setFromOptions()
    x = b.duplicate()
    ksp.solve(b, x)
    n = len(reference)
    error, norm = (np.sqrt(comm.allreduce(np.vdot(v, v).real)) for v in (x.array_r[:n] - reference, reference))
    m = comm.allreduce(m)
    good = 'yes' if error < 1e-6 * norm else error / norm
    PETSc.Sys.Print(f'{name}: {K.getSize()[0] - m} unknowns, {m} rows; difference from dolfinx_mpc below 1e-6: {good}')


n = int(sys.argv[1]) if len(sys.argv) > 1 else 6
axis, angle = np.array((1, 2, 2)) / 3, 0.7
cross = np.array(((0, -axis[2], axis[1]), (axis[2], 0, -axis[0]), (-axis[1], axis[0], 0)))
turned = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
domain = bodies(n)
V, a, L, bcs = elasticity(domain)
tags = sides(domain)
for name in ('glued', 'sliding'):
    mpc = dolfinx_mpc.MultiPointConstraint(V)
    if name == 'glued':
        mpc.create_contact_inelastic_condition(tags, UPPER, LOWER, eps2=NEAR)
    else:
        normal = fem.Function(V)
        normal.interpolate(lambda x: np.outer(turned[:, 2], np.ones(x.shape[1])))
        mpc.create_contact_slip_condition(tags, UPPER, LOWER, normal, eps2=NEAR)
    mpc.finalize()
    A, f = saddle(a, L, bcs)
    C = ainsworth.from_mpc(mpc)
    m = C.getLocalSize()[0]
    reference = eliminated(mpc, a, L, bcs)[:A.getLocalSize()[0]]
    nest = PETSc.Mat().createNest([[A, PETSc.Mat().createTranspose(C)], [C, None]])
    solve(name + ', nest', nest, f, m, reference)
    whole = nest.convert('aij', PETSc.Mat())
    whole.setBlockSize(1)
    solve(name + ', one matrix alone', whole, f, m, reference)
