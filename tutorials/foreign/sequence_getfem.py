"""
Two bodies of GetFEM's elements, meshes that do not match, pressed on each other step by step: its Newton method, with
all of its tangent systems solved by one KSP that options choose.

[A B'; C -D][u1, u2; contact, ties]: which nodes touch, and what they touch, changes from system to system, and A does
not. Each system is solved by MUMPS, too.

  $ export PETSC_OPTIONS="-dll_append /path/of/libainsworth.so -ksp_type preonly -pc_type ainsworth"
  $ export PETSC_OPTIONS="$PETSC_OPTIONS -ainsworth_ksp_converged_reason"
  $ mpiexec -n 2 python3 sequence_getfem.py
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 17
  load 1, step 2: 28 nodes touch; set-ups of Gram matrix 1, levels 0
  ...
  nodes: 12 systems; difference from MUMPS below 1e-6: yes; levels of A made once: yes
"""
import sys
try:
    import getfem as gf
    import numpy as np
    from petsc4py import PETSc
    from contact_getfem import tangent
except ImportError as why:
    print('skipped:', why)
    sys.exit(77)

BOTTOM, TOP = 1, 2
EVENTS = {'Gram matrix': 'AinsGramMat', 'levels': 'BlockSAAggreg'}


def body(n, low, bulge):
    """A square with n^2 cells above the height low, its bottom round"""
    m = gf.Mesh('cartesian Q1', np.linspace(0, 1, n + 1), np.linspace(low, low + 1, n + 1))
    at = m.pts()
    at[1] += bulge * (at[0] - 0.5) ** 2 * (low + 1 - at[1])
    m.set_pts(at)
    faces = m.outer_faces()
    normal = m.normal_of_faces(faces)
    m.set_region(BOTTOM, faces[:, normal[1] < -0.5])
    m.set_region(TOP, faces[:, normal[1] > 0.5])
    fem = gf.MeshFem(m, 2)
    fem.set_classical_fem(1)
    return m, fem, gf.MeshIm(m, 4)


def two_bodies(n, nodal):
    """The model: the lower body held at its bottom, the top of the upper one moved; contact at its nodes, as Alart and
    Curnier, or in integrals, symmetric
    """
    md = gf.Model('real')
    md.add_initialized_data('lambda', [1.0])
    md.add_initialized_data('mu', [1.0])
    md.add_initialized_data('r', [10.0])
    parts = body(n, -1, 0), body(n + 3, 0, 0.2)
    for name, held, move, (_, fem, mim) in zip(('u1', 'u2'), (BOTTOM, TOP), ('rest', 'down'), parts):
        md.add_fem_variable(name, fem)
        md.add_initialized_data(move, [0.0, 0.0])
        md.add_isotropic_linearized_elasticity_brick(mim, name, 'lambda', 'mu')
        md.add_Dirichlet_condition_with_multipliers(mim, name, fem, held, move)
    (_, _, below), (mesh, _, above) = parts
    if nodal:
        md.add_nodal_contact_between_nonmatching_meshes_brick(above, below, 'u2', 'u1', 'contact', 'r', [BOTTOM], [TOP])
        return md, parts  # the model does not keep them
    pressure = gf.MeshFem(mesh, 1)
    pressure.set_classical_fem(1)
    md.add_filtered_fem_variable('contact', pressure, BOTTOM)
    md.add_integral_contact_between_nonmatching_meshes_brick(above, 'u2', 'u1', 'contact', 'r', BOTTOM, TOP, 2)
    return md, (parts, pressure)


def direct(A, b):
    ksp = PETSc.KSP().create()
    ksp.setOptionsPrefix('direct_')
    ksp.setOperators(A)
    ksp.setType('preonly')
    ksp.getPC().setType('lu')
    ksp.getPC().setFactorSolverType('mumps')
    x = A.createVecRight()
    ksp.solve(b, x)
    return x


def counts():
    return {what: PETSc.Log.Event(event).getPerfInfo()['count'] for what, event in EVENTS.items()}


def sequence(md, loads):
    """Number of systems, largest difference from MUMPS, and how often levels of A were made"""
    ksp, worst, systems, start = PETSc.KSP().create(), 0, 0, counts()
    for load in range(1, loads + 1):
        md.set_variable('down', [0.0, -0.05 * load / loads])
        for step in range(1, 20):
            md.assembly('build_all')
            A, b = tangent(md, 'u1')
            if b.norm() < 1e-10:
                break
            before = counts()
            ksp.setOperators(A)
            if not systems:
                ksp.setFromOptions()
            x, exact = A.createVecRight(), direct(A, b)
            ksp.solve(b, x)
            now = counts()
            worst = max(worst, (x - exact).norm() / exact.norm())
            systems += 1
            scatter, everything = PETSc.Scatter.toAll(exact)
            scatter.scatter(exact, everything)
            md.to_variables(md.from_variables() + everything.array_r)
            touching = np.count_nonzero(abs(md.variable('contact')) > 1e-12)
            PETSc.Sys.Print(f'load {load}, step {step}: {touching} nodes touch; set-ups of '
                            + ', '.join(f'{what} {now[what] - before[what]}' for what in EVENTS))
    return systems, worst, counts()['levels'] - start['levels']


gf.util_trace_level(0)
PETSc.Log.begin()
for name in 'integrals', 'nodes':
    md, kept = two_bodies(int(sys.argv[1]) if len(sys.argv) > 1 else 24, name == 'nodes')
    systems, worst, levels = sequence(md, 4)
    PETSc.Sys.Print(f'{name}: {systems} systems; difference from MUMPS below 1e-6: {"yes" if worst < 1e-6 else worst}; '
                    f'levels of A made once: {"yes" if levels == 1 else levels}')
