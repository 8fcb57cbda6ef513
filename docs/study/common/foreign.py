"""A mesh and matrices of somebody else: a ball with a hole through it, quadratic tetrahedra, meshed and assembled by
GetFEM.

/usr/bin/python3 docs/study/common/foreign.py prefix [unknowns] writes <prefix>_A.dat, _C, _f, _g and _X, the
coordinates, in PETSc's binary format. C: no displacement along the normal in the hole. Needs Debian's python3-getfem
and python3-numpy.
"""
import sys

import numpy

MAT, VEC = 1211216, 1211214  # PETSc's class numbers
FINEST = 0.15  # of the mesher, which is slow: beyond it the mesh is refined


def write_matrix(path, rows, columns, values, shape, block_size=1):
    """Entries sorted by rows, then columns."""
    with open(path, "wb") as file:
        counts = numpy.bincount(rows, minlength=shape[0])
        numpy.array([MAT, shape[0], shape[1], len(rows)], ">i4").tofile(file)
        for array, kind in ((counts, ">i4"), (columns, ">i4"), (values, ">f8")):
            numpy.asarray(array).astype(kind).tofile(file)
    with open(path + ".info", "w") as file:
        file.write("-matload_block_size %d\n" % block_size)


def write_vector(path, values):
    with open(path, "wb") as file:
        numpy.array([VEC, len(values)], ">i4").tofile(file)
        numpy.asarray(values).astype(">f8").tofile(file)


def mesh(unknowns):
    """Of about as many unknowns, by experience; a refinement has 8 times as many."""
    import getfem

    h, refinements = 4.3 * unknowns ** (-1 / 3), 0
    while h < FINEST:
        h, refinements = 2 * h, refinements + 1
    hole = getfem.MesherObject("cylinder", [0, 0, -2], [0, 0, 1], 4, 0.4)
    answer = getfem.Mesh("generate", getfem.MesherObject("set minus", getfem.MesherObject("ball", [0, 0, 0], 1), hole),
                         h, 2)
    for _ in range(refinements):
        answer.refine()
    return answer


def assemble(unknowns):
    """Entries of A in three arrays, the nodes, and their shares of the body."""
    import getfem

    body = mesh(unknowns)
    displacement, material, scalar = getfem.MeshFem(body, 3), getfem.MeshFem(body, 1), getfem.MeshFem(body, 1)
    displacement.set_fem(getfem.Fem("FEM_PK(3,2)"))
    scalar.set_fem(getfem.Fem("FEM_PK(3,2)"))
    material.set_fem(getfem.Fem("FEM_PK(3,0)"))
    integration = getfem.MeshIm(body, getfem.Integ("IM_TETRAHEDRON(5)"))
    nu, ones = 0.3, numpy.ones(material.nbdof())
    lame, mu = nu / ((1 + nu) * (1 - 2 * nu)), 1 / (2 * (1 + nu))
    A = getfem.asm_linear_elasticity(integration, displacement, material, lame * ones, mu * ones)
    starts, rows = A.csc_ind()
    columns = numpy.repeat(numpy.arange(len(starts) - 1), numpy.diff(starts))
    nodes = displacement.basic_dof_nodes().T
    if not (numpy.array_equal(nodes[0::3], nodes[1::3]) and numpy.array_equal(nodes[0::3], nodes[2::3])):
        raise RuntimeError("the three components of a node are not beside each other")
    return columns, rows, A.csc_val(), nodes[0::3]  # A is symmetric: columns for rows


def main():
    prefix, unknowns = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 25000
    rows, columns, values, nodes = assemble(unknowns)
    n = 3 * len(nodes)
    random = numpy.random.RandomState(1)
    f = (numpy.array([0.3, 0.2, -1]) + random.uniform(-1, 1, (len(nodes), 3))).ravel() / len(nodes)
    fixed = numpy.repeat(nodes[:, 2] < -0.8, 3)
    keep = ~(fixed[rows] | fixed[columns]) | (rows == columns)  # a fixed unknown keeps its diagonal entry alone
    f[fixed] = 0
    write_matrix(prefix + "_A.dat", rows[keep], columns[keep], values[keep], (n, n), 3)
    radius = numpy.hypot(nodes[:, 0], nodes[:, 1])
    touching = numpy.flatnonzero((abs(radius - 0.4) < 1e-3) & ~fixed[0::3])
    normals = nodes[touching, :2] / radius[touching, None]
    slip = numpy.arange(len(touching))
    write_matrix(prefix + "_C.dat", numpy.repeat(slip, 2), (3 * touching[:, None] + numpy.arange(2)).ravel(),
                 normals.ravel(), (len(touching), n))
    write_vector(prefix + "_f.dat", f)
    write_vector(prefix + "_g.dat", numpy.zeros(len(touching)))
    write_vector(prefix + "_X.dat", nodes.ravel())
    print("foreign: unknowns=%d constraints=%d nonzeros=%d" % (n, len(touching), keep.sum()))


if __name__ == "__main__":
    main()
