"""
A block of GetFEM's elements pressed on a round obstacle, without friction: its Newton method, with each tangent system
solved by the KSP that options choose.

[A B' E'; C -D 0; E 0 0][u; contact; top]: the forces of contact are multipliers, of which those not in contact have a
row of D alone, and so are the forces that press the top down. The matrix and nothing else is passed to PETSc, then with
its fields named; the result is compared with GetFEM's own solver. GetFEM is serial: each rank assembles all and passes
its rows.

  $ export PETSC_OPTIONS="-dll_append /path/of/libainsworth.so -ksp_type preonly -pc_type ainsworth"
  $ export PETSC_OPTIONS="$PETSC_OPTIONS -ainsworth_ksp_converged_reason"
  $ mpiexec -n 2 python3 contact_getfem.py
  1250 unknowns, 25 nodes may touch the obstacle, 16 do
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 19
  ...
  fields named: 5 steps; difference from GetFEM's own solver below 1e-7: yes
"""
import sys
try:
    import getfem as gf
    import numpy as np
    from petsc4py import PETSc
except ImportError as why:
    print('skipped:', why)
    sys.exit(77)

BOTTOM, TOP = 1, 2


def block(n, dim=2):
    """The model: the unit square, or cube, with n cells along an edge, its top moved down by 0.05, the highest point of
    the obstacle below the middle of its bottom
    """
    m = gf.Mesh('cartesian', *[np.linspace(0, 1, n + 1)] * dim)
    faces = m.outer_faces()
    normal = m.normal_of_faces(faces)
    m.set_region(BOTTOM, faces[:, normal[-1] < -0.9])
    m.set_region(TOP, faces[:, normal[-1] > 0.9])
    mfu = gf.MeshFem(m, dim)
    mfu.set_classical_fem(1)
    mim = gf.MeshIm(m, 4)
    md = gf.Model('real')
    md.add_fem_variable('u', mfu)
    md.add_initialized_data('lambda', [1.0])
    md.add_initialized_data('mu', [1.0])
    md.add_isotropic_linearized_elasticity_brick(mim, 'u', 'lambda', 'mu')
    md.add_initialized_data('down', [0.0] * (dim - 1) + [-0.05])
    md.add_Dirichlet_condition_with_multipliers(mim, 'u', mfu, TOP, 'down')
    md.add_variable('contact', len(mfu.basic_dof_on_region(BOTTOM)) // dim)
    md.add_initialized_data('r', [1.0])
    md.add_nodal_contact_with_rigid_obstacle_brick(mim, 'u', 'contact', 'r', BOTTOM, 'y+0.2*(x-0.5)*(x-0.5)' if dim
                                                   == 2 else 'z+0.2*((x-0.5)*(x-0.5)+(y-0.5)*(y-0.5))', 2)
    return md, (m, mfu, mim)  # the model does not keep them


def tangent(md, body='u'):
    """GetFEM's tangent matrix as AIJ and the residual; all unknowns of a node on one rank, the body on all, what comes
    before it on the first
    """
    K = md.tangent_matrix()
    K.transpose()
    starts, columns = K.csc_ind()  # of the transpose, hence row by row
    u, size = md.interval_of_variable(body)
    dim = md.mesh_fem_of_variable(body).qdim()
    ranks, rank = PETSc.COMM_WORLD.size, PETSc.COMM_WORLD.rank
    cut = [0] + [u + dim * (size // dim * r // ranks) for r in range(1, ranks)] + [K.size()[0]]
    first, end = cut[rank], cut[rank + 1]
    local = (end - first, None)
    A = PETSc.Mat().createAIJ((local, local), comm=PETSc.COMM_WORLD, csr=(
        starts[first:end + 1] - starts[first], columns[starts[first]:starts[end]],
        K.csc_val()[starts[first]:starts[end]]))
    b = A.createVecLeft()
    b.array = md.rhs()[first:end]
    return A, b


def name_fields(md, A, pc):
    first, end = A.getOwnershipRange()
    for name in 'u', 'contact', 'mult_on_u':
        start, size = md.interval_of_variable(name)
        rows = np.arange(max(start, first), min(start + size, end), dtype=PETSc.IntType)
        pc.setFieldSplitIS((name, PETSc.IS().createGeneral(rows, comm=PETSc.COMM_WORLD)))


def newton(md, named):
    """Steps until the forces are in balance"""
    for step in range(20):
        md.assembly('build_all')
        A, b = tangent(md)
        if b.norm() < 1e-9:
            return step
        ksp = PETSc.KSP().create()
        ksp.setOperators(A)
        ksp.setFromOptions()
        if named:
            name_fields(md, A, ksp.getPC())
        x = A.createVecRight()
        ksp.solve(b, x)
        scatter, everything = PETSc.Scatter.toAll(x)
        scatter.scatter(x, everything)
        md.to_variables(md.from_variables() + everything.array_r)
    return step


def main():
    gf.util_trace_level(0)
    md, kept = block(int(sys.argv[1]) if len(sys.argv) > 1 else 24)
    zero = md.from_variables()
    md.solve('max_res', 1e-12)
    u, contact = md.variable('u'), md.variable('contact')
    PETSc.Sys.Print(f'{len(u)} unknowns, {len(contact)} nodes may touch the obstacle, {np.count_nonzero(contact)} do')
    for named in True, False:
        md.to_variables(zero)
        steps = newton(md, named)
        error = max(abs(md.variable('u') - u).max(), abs(md.variable('contact') - contact).max())
        PETSc.Sys.Print(f'fields {"named" if named else "not named"}: {steps} steps; '
                        f'difference from GetFEM\'s own solver below 1e-7: {"yes" if error < 1e-7 else error}')


if __name__ == '__main__':
    main()
