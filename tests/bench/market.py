"""Matrix Market files as PETSc's binary files, which `solve` reads: python3 tests/bench/market.py A.mtx C.mtx f.mtx
writes A.dat, C.dat and f.dat.
"""

import os
import sys

import scipy.io
import scipy.sparse
from petsc4py import PETSc


def write(name, values):
    """A sparse matrix, or the vector that one dense column is, in the integers and scalars of this PETSc."""
    if scipy.sparse.issparse(values):
        rows = values.tocsr()
        value = PETSc.Mat().createAIJ(rows.shape,
                                      csr=(rows.indptr.astype(PETSc.IntType), rows.indices.astype(PETSc.IntType),
                                           rows.data.astype(PETSc.ScalarType)), comm=PETSc.COMM_SELF)
    else:
        value = PETSc.Vec().createWithArray(values.reshape(-1).astype(PETSc.ScalarType), comm=PETSc.COMM_SELF)
    viewer = PETSc.Viewer().createBinary(name, "w", comm=PETSc.COMM_SELF)
    value.view(viewer)
    viewer.destroy()


def convert(file, folder=None):
    """The PETSc file of a Matrix Market file, beside it or in a folder; another file is returned as it is."""
    base, extension = os.path.splitext(file)
    if extension != ".mtx":
        return file
    name = os.path.join(folder, os.path.basename(base)) if folder else base
    write(name + ".dat", scipy.io.mmread(file))
    return name + ".dat"


if __name__ == "__main__":
    for file in sys.argv[1:]:
        print(convert(file))
