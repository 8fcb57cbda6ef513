"""
Two blocks of SfePy's elements under a load, their bottom held: SfePy's own Newton method and its own PETSc solver,
ls.petsc, with the preconditioner that its description names. SfePy passes the matrix and nothing else, without block
size.

One has a tilted side that slides along itself, [A B'; B 0][u; pressure]: the sliding is that of dw_non_penetration, its
pressure a field of this side. Where the bottom is held, rows of B depend on others: the displacements are unique, the
pressure at that edge is not. The other is a wet sponge, [A -B'; B D][u; p], whose diagonal is positive: signs tell
which are the multipliers. Compared with SfePy's direct solver. SfePy is serial; it passes a guess that is not zero,
which -ksp_type preonly does not take.

  $ export PETSC_OPTIONS="-dll_append /path/of/libainsworth.so -ainsworth_ksp_converged_reason"
  $ python3 blocks_sfepy.py
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 17
  slides: 3100 unknowns; both equations hold to 1e-7: yes; displacements' difference from SfePy's direct solver below
  1e-7: yes
    Linear ainsworth_ solve converged due to CONVERGED_ITS iterations 10
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 50
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 3
  sponge: 4000 unknowns; both equations hold to 1e-7: yes; displacements' difference from SfePy's direct solver below
  1e-7: yes
"""
import sys
try:
    import numpy as np
    import sfepy
    from petsc4py import PETSc  # noqa: F401 (SfePy passes sys.argv to PETSc where nobody has initialized it)
    from sfepy.base.base import output
    from sfepy.base.conf import IndexedStruct
    from sfepy.discrete import Equation, Equations, FieldVariable, Integral, Material, Problem
    from sfepy.discrete.conditions import Conditions, EssentialBC
    from sfepy.discrete.fem import FEDomain, Field
    from sfepy.mechanics.matcoefs import stiffness_from_lame
    from sfepy.mesh.mesh_generators import gen_block_mesh
    from sfepy.solvers.ls import PETScKrylovSolver, ScipyDirect
    from sfepy.solvers.nls import Newton
    from sfepy.terms import Term
    if not sfepy.get_paths('sfepy/discrete/fem/poly_spaces.py'):
        raise ImportError('this SfePy does not find its own files')  # as Debian's package 2026.2-2
except ImportError as why:
    print('skipped:', why)
    sys.exit(77)


def block(n, slides):
    """The problem: a block of n^3 nodes"""
    mesh = gen_block_mesh([1, 1, 1], [n, n, n], [0.5, 0.5, 0.5], verbose=False)
    domain = FEDomain('block', mesh)
    omega = domain.create_region('Omega', 'all')
    bottom, top, side = (domain.create_region(name, f'vertices in {where}', 'facet')
                         for name, where in (('Bottom', 'z < 1e-8'), ('Top', 'z > 0.99999'), ('Side', 'x > 0.99999')))
    mesh.coors[:, 0] *= 1 + 0.3 * mesh.coors[:, 1]
    displacement = Field.from_args('displacement', np.float64, 'vector', omega, 1)
    pressure = Field.from_args('pressure', np.float64, 'scalar', side if slides else omega, 1)
    u, p = FieldVariable('u', 'unknown', displacement), FieldVariable('p', 'unknown', pressure)
    v, q = (FieldVariable('v', 'test', displacement, primary_var_name='u'),
            FieldVariable('q', 'test', pressure, primary_var_name='p'))
    solid = Material('solid', D=stiffness_from_lame(3, 1.0, 1.0),
                     biot=np.array([[1.0], [1.0], [1.0], [0.0], [0.0], [0.0]]), permeability=1e-3 * np.eye(3))
    load = Material('load', val=[[0.3], [0.1], [-1.0]])
    rule = Integral('rule', 2)
    balance = (Term.new('dw_lin_elastic(solid.D, v, u)', rule, omega, solid=solid, v=v, u=u)
               - Term.new('dw_surface_ltr(load.val, v)', rule, top, load=load, v=v))
    fixed = [EssentialBC('held', bottom, {'u.all': 0.0})]
    if slides:
        balance = balance + Term.new('dw_non_penetration(v, p)', rule, side, v=v, p=p)
        other = Term.new('dw_non_penetration(u, q)', rule, side, u=u, q=q)
    else:
        balance = balance - Term.new('dw_biot(solid.biot, v, p)', rule, omega, solid=solid, v=v, p=p)
        other = (Term.new('dw_biot(solid.biot, u, q)', rule, omega, solid=solid, u=u, q=q)
                 + Term.new('dw_diffusion(solid.permeability, q, p)', rule, omega, solid=solid, q=q, p=p))
        fixed.append(EssentialBC('drained', top, {'p.all': 0.0}))
    problem = Problem('block', equations=Equations([Equation('balance', balance), Equation('other', other)]))
    problem.set_bcs(ebcs=Conditions(fixed))
    return problem


def solve(n, slides, linear):
    """The displacements, and how far the residual fell"""
    status = IndexedStruct()
    problem = block(n, slides)
    problem.set_solver(Newton({'i_max': 1, 'eps_a': 1e-14, 'check': 0}, lin_solver=linear, status=status))
    state = problem.solve(save_results=False)
    return problem.get_variables()['u'](), state().size, status['err'] / status['err0']


output.set_output(quiet=True)
n = int(sys.argv[1]) if len(sys.argv) > 1 else 10
for slides in True, False:
    u, size, fall = solve(n, slides,
                          PETScKrylovSolver({'method': 'fgmres', 'precond': 'ainsworth', 'eps_a': 0.0, 'eps_r': 1e-7}))
    direct = solve(n, slides, ScipyDirect({}))[0]
    error = np.linalg.norm(u - direct) / np.linalg.norm(direct)
    print(f"{'slides' if slides else 'sponge'}: {size} unknowns; both equations hold to 1e-7: "
          f"{'yes' if fall < 1e-7 else fall}; "
          f"displacements' difference from SfePy's direct solver below 1e-7: {'yes' if error < 1e-7 else error}",
          flush=True)
