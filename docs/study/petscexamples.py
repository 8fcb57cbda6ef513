#!/usr/bin/env python3
"""PETSc's own examples, unchanged, with their usual solver and with PCAINSWORTH by options alone: the layout that is
found, the difference of the solutions.

docs/petscexamples.csv. The examples are those of PETSc's package (libpetsc3.18-dev-examples) or sources;
/usr/bin/python3 has petsc4py.
"""
import argparse
import concurrent.futures
import itertools
import os
import re
import subprocess
import sys
import tempfile

from common import measured

LU = '-{p}pc_type lu -{p}pc_factor_mat_solver_type mumps -{p}ksp_type preonly'
SCHUR = ('-{p}ksp_type fgmres -{p}pc_type fieldsplit -{p}pc_fieldsplit_type schur -{p}pc_fieldsplit_schur_fact_type '
         'full -{p}pc_fieldsplit_schur_precondition full -{p}fieldsplit_%s_pc_type lu -{p}fieldsplit_%s_pc_type svd')
TAYLOR = '-dm_plex_simplex 0 -dm_refine 2 -dm_plex_separate_marker -vel_petscspace_degree 2 -pres_petscspace_degree 1'
STOKES = SCHUR % ('velocity', 'pressure')
CRASHES = {('snes/tutorials/ex77.c', 2)}  # with any solver, on so many ranks
UNSOLVED = CRASHES | {('ts/tutorials/ex46.c', 2)}  # by their usual solvers
FULL = '-ksp_type gmres -ksp_gmres_restart 3000 -ksp_max_it 3000 -pc_type none'
# name, file, options of the program, its usual solver, prefix of the KSP, what writes the solution
EXAMPLES = [
    ('Stokes, finite volumes', 'snes/tutorials/ex70.c', '-nx 24 -ny 24',
     '-user_ksp -ksp_type fgmres -pc_type fieldsplit -pc_fieldsplit_type schur -pc_fieldsplit_schur_fact_type lower '
     '-pc_fieldsplit_schur_precondition selfp -fieldsplit_1_pc_type jacobi -fieldsplit_0_pc_type lu', '', 'ksp'),
    ('Stokes, DMPlex', 'snes/tutorials/ex62.c', '-sol quadratic ' + TAYLOR.replace('-dm_plex_separate_marker ', ''),
     STOKES, '', 'snes'),
    ('Stokes with variable viscosity, DMPlex', 'snes/tutorials/ex69.c', TAYLOR, STOKES, '', 'snes'),
    ('Poiseuille flow, DMPlex', 'snes/tutorials/ex71.c', TAYLOR, STOKES, '', 'snes'),
    ('Mixed Poisson, DMPlex', 'snes/tutorials/ex24.c',
     '-sol_type quadratic -dm_plex_simplex 0 -dm_refine 2 -field_petscspace_degree 2 '
     '-potential_petscspace_degree 0', SCHUR % ('field', 'potential'), '', 'snes'),
    ('Hyperelasticity, DMPlex', 'snes/tutorials/ex77.c',
     '-run_type full -dm_plex_dim 3 -dm_plex_simplex 0 -def_petscspace_degree 2 -pres_petscspace_degree 1 '
     '-elastMat_petscspace_degree 0 -wall_pres_petscspace_degree 0 -bc_fixed 1 -bc_pressure 2 -wall_pressure 0.4',
     SCHUR % ('deformation', 'pressure'), '', 'snes'),
    ('Bratu with a constraint, Fortran', 'snes/tutorials/ex73f90t.F90', '-par 5.0 -da_grid_x 10 -da_grid_y 10',
     '-ksp_type fgmres -pc_type fieldsplit -pc_fieldsplit_type schur -pc_fieldsplit_schur_fact_type upper '
     '-fieldsplit_lambda_pc_type jacobi -fieldsplit_phi_pc_type gamg', '', 'snes'),
    ('Stokes, DMDA in 2D', 'ksp/ksp/tutorials/ex43.c', '-mx 12 -my 12', '-{p}ksp_type gmres -{p}ksp_gmres_restart 500',
     'stokes_', 'ksp'),
    ('Stokes, DMDA in 3D', 'ksp/ksp/tutorials/ex42.c', '-mx 4', '-{p}ksp_type gmres -{p}ksp_gmres_restart 500',
     'stokes_', 'ksp'),
    ('Stokes, particles', 'ksp/ksp/tutorials/ex70.c', '-mx 10 -my 10 -no_view',
     '-{p}ksp_type gmres -{p}ksp_gmres_restart 500', 'stokes_', 'ksp'),
    ('Stokes, DMStag in 2D', 'dm/impls/stag/tutorials/ex2.c', '-stag_grid_x 20 -stag_grid_y 20', FULL, '', 'ksp'),
    ('Stokes, DMStag in 3D', 'dm/impls/stag/tutorials/ex3.c', '-stag_grid_x 6 -stag_grid_y 5 -stag_grid_z 4', FULL, '',
     'ksp'),
    ('Stokes with a sinker, DMStag', 'dm/impls/stag/tutorials/ex4.c',
     '-dim 2 -coefficients sinker -nondimensional 1 -s 16', FULL, '', 'ksp'),
    ('A fluid at rest, DMStag', 'dm/impls/stag/tests/ex15.c', '-dim 2', FULL, '', 'ksp'),
    ('Low Mach flow in time, DMPlex', 'ts/tutorials/ex76.c',
     '-sol_type taylor_green ' + TAYLOR.replace('refine 2', 'refine 1') + ' -temp_petscspace_degree 1 '
     '-ts_max_steps 2 -ts_dt 0.1', '-ksp_type fgmres -pc_type fieldsplit -pc_fieldsplit_0_fields 0,2 '
     '-pc_fieldsplit_1_fields 1 -pc_fieldsplit_type schur -pc_fieldsplit_schur_fact_type full '
     '-pc_fieldsplit_schur_precondition full -fieldsplit_0_pc_type lu -fieldsplit_pressure_pc_type svd', '', 'ts'),
    ('3 x 3 nest, vectors that are nests', 'ksp/ksp/tests/ex57.c', '-pc_ainsworth_multiplier_fields c',
     '-pc_type fieldsplit', '', 'ksp'),
    ('Multiphysics, DMComposite', 'snes/tutorials/ex28.c', '-u_da_grid_x 20 -problem_type 2 -pack_dm_mat_type nest',
     '-pc_type none', '', 'snes'),
    ('Low Mach flow, DMPlex', 'snes/tutorials/ex76.c', '-sol_type quadratic ' + TAYLOR + ' -temp_petscspace_degree 1',
     LU, '', 'snes'),
    ('Navier-Stokes, DMPlex', 'ts/tutorials/ex46.c', TAYLOR + ' -ts_max_steps 2 -ts_dt 0.1', STOKES, '', 'ts'),
]
LAYOUT = re.compile(r'^ *layout: (.*)$', re.M)
COLUMNS = 'example', 'layout found', 'iterations', 'difference'
SOLVED = re.compile(r'Linear (\S* ?)solve converged .* iterations (\d+)')
RESIDUAL = re.compile(r'final norm of residual ([-+.0-9e]+)')
MESSAGE = re.compile(r'Error Message -+\n.*\n\[\d+\]PETSC ERROR: (.*)')


def build(source, folder, petsc):
    program = os.path.join(folder, os.path.basename(source).split('.')[0] + '_' + source.split('/')[-3])
    os.environ['PKG_CONFIG_PATH'] = os.path.join(petsc, 'lib/pkgconfig')
    flags = subprocess.run(['pkg-config', '--cflags', '--libs', 'PETSc'], capture_output=True, text=True,
                           check=True).stdout.split()
    compiler = ['mpif90', '-ffree-line-length-none'] if source.endswith('F90') else ['mpicc']
    subprocess.run([*compiler, '-w', '-o', program, source, *flags, '-lm'], check=True, cwd=folder)
    return program


def run(program, options, ranks, solution):
    folder = os.path.dirname(solution)
    for file in solution, os.path.join(folder, 'matrix'):
        if os.path.exists(file):
            os.remove(file)
    try:
        out = subprocess.run(['mpiexec', '-n', str(ranks), program, *options.split()], capture_output=True, text=True,
                             timeout=100, cwd=folder, env=dict(os.environ))  # without what MPI in petsc4py adds
    except subprocess.TimeoutExpired:
        return 1, ''
    return out.returncode, out.stdout + out.stderr


def iterations(text):
    """Of all reduced solves, the first and those of corrections, in each of the program's solves"""
    found, inner = [], 0
    for prefix, count in SOLVED.findall(text):
        if prefix.endswith('ainsworth_ '):
            inner += int(count)
        else:
            found, inner = found + [inner], 0
    return found


def read(file):
    from petsc4py import PETSc
    kind = PETSc.Mat if file.endswith('matrix') else PETSc.Vec
    return (kind().load(PETSc.Viewer().createBinary(file, comm=PETSc.COMM_SELF)) if os.path.exists(file)
            and os.path.getsize(file) else None)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--petsc', default='/usr/lib/petsc', help='prefix of PETSc: the folder of its lib/pkgconfig')
    parser.add_argument('--examples', default='/usr/share/petsc/3.18/share/petsc/examples/src')
    parser.add_argument('--plugin', default=os.path.join(os.environ.get('AINSWORTH_BUILD', 'build'), 'libainsworth.so'))
    parser.add_argument('--ranks', type=int, nargs='+', default=[1])
    parser.add_argument('--only', default='', help='part of a name or a file')
    parser.add_argument('--verbose', action='store_true')
    parser.add_argument('--csv', help='file, docs/petscexamples.csv for that of the page')
    given = parser.parse_args()
    folder = tempfile.mkdtemp()
    examples = [example for example in EXAMPLES if given.only in example[0] + example[1]]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        programs = list(pool.map(lambda example: build(os.path.join(given.examples, example[1]), folder, given.petsc),
                                 examples))
    right, rows = True, []
    print('| %s |\n|---|---|---|---|' % ' | '.join(COLUMNS))
    for ranks, (program, (name, source, options, usual, p, writer)) in itertools.product(
            given.ranks, zip(programs, examples)):
        tight = f' -{p}ksp_rtol 1e-10 -snes_rtol 1e-9 -{p}ksp_error_if_not_converged '
        view = ' -{}_view_solution binary:{}'.format((p + 'ksp') if writer == 'ksp' else writer, '{}')
        matrix = os.path.join(folder, 'matrix')
        files = [os.path.join(folder, f) for f in ('usual', 'ours')]
        if os.path.exists(files[0]):  # of the example before
            os.remove(files[0])
        usual_code, text = (1, '') if (source, ranks) in UNSOLVED else run(
            program, options + tight + usual.format(p=p) + view.format(files[0]), ranks, files[0])
        if given.verbose:
            print(text)
        code, text = run(
            program,
            options + tight + f'-dll_append {os.path.abspath(given.plugin)} -{p}pc_type ainsworth -{p}ksp_type preonly '
            f'-{p}ainsworth_ksp_rtol 1e-11 -{p}ainsworth_ksp_converged_reason -{p}ksp_converged_reason -{p}ksp_view '
            f'-{p}ksp_view_final_residual -{p}ksp_view_mat binary:{matrix}' + view.format(files[1]), ranks, files[1])
        if given.verbose:
            print(text)
        layout, x, y = LAYOUT.findall(text), *map(read, files)
        if code or x is None or y is None:  # PETSc does not write vectors that are nests
            message, residual = MESSAGE.findall(text), RESIDUAL.findall(text)
            difference = (('refused: ' + message[0]) if code and message
                          else 'failed, as its usual solver does' if usual_code and code else 'failed' if code
                          else f'residual {float(residual[-1]):.0e}' if residual else 'none written')
            right = right and bool((source, ranks) in CRASHES or (not code and residual and float(residual[-1]) < 1e-8))
        else:
            x.axpy(-1, y)
            K = read(matrix)  # pressures may differ by what it does not see
            error = (K * x).norm() / (K * y).norm() if K else x.norm() / y.norm()
            right = right and error < 1e-6
            difference = f'{error:.0e}'
        rows.append((f'{name}, {source.replace("tutorials/", "")}', layout[-1] if layout else '',
                     ', '.join(map(str, iterations(text)[:4])), difference))
        print('| %s |' % ' | '.join(rows[-1]), flush=True)
    if given.csv:
        measured.save(given.csv, measured.provenance(), COLUMNS, [dict(zip(COLUMNS, row)) for row in rows])
    print('each as its usual solver has it:', 'yes' if right else 'no')
    return 0 if right else 1


if __name__ == '__main__':
    sys.exit(main())
