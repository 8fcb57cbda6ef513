"""
A plate in plane stress, held on one side by multipliers: GetDP, a program that knows nothing of the plugin, with
options alone.

GetDP numbers the components of displacements as its elements meet them, so that the unknowns of a node are not next to
each other, and hands one matrix to PETSc. The displacement of a corner is compared with that of GetDP's own solver,
which is direct. The plugin is the first argument, the cells along the short side the second.

  $ python3 plate_getdp.py /path/of/libainsworth.so 60
    Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 26
    block size of A: 1 (nodes have several unknowns, not next to each other)
  14884 unknowns; difference from GetDP's own solver below 1e-7: yes
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

if not shutil.which('getdp'):
    print('skipped: there is no getdp')
    sys.exit(77)

PROBLEM = '''
Group { Plate = Region[1]; Left = Region[2]; Right = Region[3]; Whole = Region[{Plate, Left, Right}]; }
Function { // E = 200, nu = 0.3
  a = 200 / (1 - 0.09); b = 0.3 * a; c = 200 / 2.6;
  Cxx[] = Tensor[a,0,0, 0,c,0, 0,0,c]; Cxy[] = Tensor[0,b,0, c,0,0, 0,0,0];
  Cyx[] = Tensor[0,c,0, b,0,0, 0,0,0]; Cyy[] = Tensor[c,0,0, 0,a,0, 0,0,c];
}
Jacobian { { Name Vol; Case { { Region Whole; Jacobian Vol; } } }
           { Name Sur; Case { { Region Whole; Jacobian Sur; } } } }
Integration { { Name I; Case { { Type Gauss; Case {
  { GeoElement Triangle; NumberOfPoints 3; } { GeoElement Line; NumberOfPoints 3; } } } } } }
FunctionSpace {
  { Name Hx; Type Form0;
    BasisFunction { { Name s; NameOfCoef u; Function BF_Node; Support Whole; Entity NodesOf[Whole]; } } }
  { Name Hy; Type Form0;
    BasisFunction { { Name s; NameOfCoef v; Function BF_Node; Support Whole; Entity NodesOf[Whole]; } } }
  { Name Lx; Type Form0;
    BasisFunction { { Name s; NameOfCoef l; Function BF_Node; Support Left; Entity NodesOf[Left]; } } }
  { Name Ly; Type Form0;
    BasisFunction { { Name s; NameOfCoef m; Function BF_Node; Support Left; Entity NodesOf[Left]; } } }
}
Formulation { { Name Elasticity; Type FemEquation;
  Quantity { { Name ux; Type Local; NameOfSpace Hx; } { Name uy; Type Local; NameOfSpace Hy; }
             { Name lx; Type Local; NameOfSpace Lx; } { Name ly; Type Local; NameOfSpace Ly; } }
  Equation {
    Galerkin { [Cxx[] * Dof{d ux}, {d ux}]; In Plate; Integration I; Jacobian Vol; }
    Galerkin { [Cxy[] * Dof{d uy}, {d ux}]; In Plate; Integration I; Jacobian Vol; }
    Galerkin { [Cyx[] * Dof{d ux}, {d uy}]; In Plate; Integration I; Jacobian Vol; }
    Galerkin { [Cyy[] * Dof{d uy}, {d uy}]; In Plate; Integration I; Jacobian Vol; }
    Galerkin { [Dof{lx}, {ux}]; In Left; Integration I; Jacobian Sur; }
    Galerkin { [Dof{ly}, {uy}]; In Left; Integration I; Jacobian Sur; }
    Galerkin { [Dof{ux}, {lx}]; In Left; Integration I; Jacobian Sur; }
    Galerkin { [Dof{uy}, {ly}]; In Left; Integration I; Jacobian Sur; }
    Galerkin { [-1, {uy}]; In Right; Integration I; Jacobian Sur; }             // a load
    Galerkin { [-0.01 * Y[], {lx}]; In Left; Integration I; Jacobian Sur; }     // a turn of the held side
  } } }
Resolution { { Name Solve; System { { Name S; NameOfFormulation Elasticity; } }
  Operation { Generate[S]; Solve[S]; SaveSolution[S]; PostOperation[Corner]; } } }
PostProcessing { { Name Fields; NameOfFormulation Elasticity;
  Quantity { { Name uy; Value { Term { [{uy}]; In Plate; Jacobian Vol; } } } } } }
PostOperation { { Name Corner; NameOfPostProcessing Fields;
  Operation { Print[uy, OnPoint {2, 1, 0}, File "corner.txt", Format Table]; } } }
'''


def petsc_of(file):
    return re.search(r'libpetsc\S*',
                     subprocess.run(['ldd', file], capture_output=True, text=True, check=True).stdout)[0]


def write_mesh(file, n):
    """A plate of 2 x 1 in 4 n^2 triangles; its left side is region 2, its right one region 3"""
    def node(i, j):
        return j * (2 * n + 1) + i + 1

    elements = [(1, 2, (node(0, j), node(0, j + 1)))
                for j in range(n)] + [(1, 3, (node(2 * n, j), node(2 * n, j + 1))) for j in range(n)]
    for j in range(n):
        for i in range(2 * n):
            elements.append((2, 1, (node(i, j), node(i + 1, j), node(i + 1, j + 1))))
            elements.append((2, 1, (node(i, j), node(i + 1, j + 1), node(i, j + 1))))
    with open(file, 'w') as out:
        out.write(f'$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{(2 * n + 1) * (n + 1)}\n')
        for j in range(n + 1):
            for i in range(2 * n + 1):
                out.write(f'{node(i, j)} {i / n!r} {j / n!r} 0\n')
        out.write(f'$EndNodes\n$Elements\n{len(elements)}\n')
        for k, (kind, region, nodes) in enumerate(elements, 1):
            out.write(f'{k} {kind} 2 {region} {region} {" ".join(map(str, nodes))}\n')
        out.write('$EndElements\n')


def solve(folder, *options):
    """What GetDP prints, and the displacement of a corner"""
    out = subprocess.run(['getdp', 'plate.pro', '-msh', 'plate.msh', '-solve', 'Solve', '-v', '4', *options],
                         cwd=folder, capture_output=True, text=True,
                         check=True)
    with open(os.path.join(folder, 'corner.txt')) as file:
        return out.stdout, float(file.read().split()[-1])


def main():
    plugin, n = os.path.abspath(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 60
    if petsc_of(shutil.which('getdp')) != petsc_of(plugin):
        print('skipped: the plugin was built for another PETSc than getdp')
        return 77
    with tempfile.TemporaryDirectory() as folder:
        write_mesh(os.path.join(folder, 'plate.msh'), n)
        with open(os.path.join(folder, 'plate.pro'), 'w') as file:
            file.write(PROBLEM)
        _, direct = solve(folder)
        text, ours = solve(folder, '-dll_append', plugin, '-ksp_type', 'preonly', '-pc_type', 'ainsworth',
                           '-ainsworth_ksp_converged_reason', '-ksp_view')
    for line in text.splitlines():
        if 'ainsworth_ solve' in line or 'block size of A' in line:
            print(line)
    close = abs(ours - direct) < 1e-7 * abs(direct)
    print(f"{2 * (2 * n + 1) * (n + 1) + 2 * (n + 1)} unknowns; difference from GetDP's own solver below 1e-7: "
          f"{'yes' if close else (ours - direct) / direct}")
    return 0 if close else 1


if __name__ == '__main__':
    sys.exit(main())
