"""Files of a part."""
import os

import numpy
from scipy import sparse

from common.binary import reader
from .eliminate import eliminated


def read(prefix):
    """The part of A, C, f, g, X as the programs of tests/bench write them (-write_system prefix)."""
    from petsc4py import PETSc
    from .part import Part, rigid_modes

    def load(thing, name):
        viewer = reader(prefix + "_" + name + ".dat", PETSc.COMM_SELF)
        thing.create(comm=PETSc.COMM_SELF).load(viewer)
        viewer.destroy()
        return thing

    def matrix(name):
        M = load(PETSc.Mat(), name)
        return sparse.csr_matrix(M.getValuesCSR()[::-1], M.getSize())

    A, C = matrix("A"), matrix("C")
    f, g, X = (load(PETSc.Vec(), name).getArray().copy() for name in ("f", "g", "X"))
    X = X.reshape(-1, 3)
    return Part(A, C, None, f, g, X, 0, numpy.zeros(0, dtype=int), rigid_modes(X), A, None, 0, None)


def read_contact(path):
    """The part of A, C, g, u, X, lambda as tutorials/contact/peers.cpp writes them (-write file)."""
    from petsc4py import PETSc
    from .part import Part, rigid_modes
    viewer = reader(path, PETSc.COMM_SELF)
    things = [thing().create(comm=PETSc.COMM_SELF).load(viewer) for thing in [PETSc.Mat] * 2 + [PETSc.Vec] * 4]
    viewer.destroy()
    A, C = (sparse.csr_matrix(M.getValuesCSR()[::-1], M.getSize()) for M in things[:2])
    g, u, X, force = (v.getArray().copy() for v in things[2:])
    X = X.reshape(-1, 3)
    return Part(A, C, None, numpy.zeros(len(u)), g, X, 0, numpy.zeros(0, dtype=int), rigid_modes(X), A, None, 0, None,
                contact=(g - C @ u, force))


def numpy_file(part, path):
    """A and C in compressed rows, the diagonal of D."""
    arrays = {name + key: getattr(M, long) for name, M in (("A", part.A), ("C", part.C))
              for key, long in (("i", "indptr"), ("j", "indices"), ("v", "data"))}
    if part.D is not None:
        arrays["Dv"] = part.D.diagonal()
    numpy.savez(path, f=part.f, g=part.g, X=part.X, extra=part.extra, clamp=part.clamp, modes=part.modes, **arrays)


def petsc_files(part, folder, eliminate=False):
    """In PETSc's binary format, without constraints, too, and with their elimination where asked; the sizes."""
    from petsc4py import PETSc

    def write(name, *things):
        viewer = PETSc.Viewer().createBinary(os.path.join(folder, name + ".dat"), "w", comm=PETSc.COMM_SELF)
        for thing in things:
            thing.view(viewer)
        viewer.destroy()

    def matrix(M, rows, columns):
        A = PETSc.Mat().create(comm=PETSc.COMM_SELF)
        A.setSizes(M.shape)
        A.setBlockSizes(rows, columns)
        A.setType("aij")
        A.setPreallocationCSR((M.indptr.astype(PETSc.IntType), M.indices.astype(PETSc.IntType), M.data))
        return A

    def vector(values):
        return PETSc.Vec().createWithArray(numpy.ascontiguousarray(values, dtype=float), comm=PETSc.COMM_SELF)

    os.makedirs(folder, exist_ok=True)
    A, f, left = part.clamped()
    write("A", matrix(part.A, 3, 3))
    write("C", matrix(part.C, 1, 3))
    if part.B is not None:
        write("B", matrix(part.B, 1, 3))
    if part.D is not None:
        write("D", matrix(part.D, 1, 1))
    write("f", vector(part.f))
    write("g", vector(part.g))
    if not part.extra:
        write("X", vector(part.X.ravel()))
    write("modes", *(vector(mode) for mode in part.modes.T))
    write("clamped_A", matrix(A, 3, 3))
    write("clamped_f", vector(f))
    write("clamped_modes", *(vector(mode) for mode in part.modes[left].T))
    if eliminate:
        T, x0 = eliminated(part.C, part.g)
        write("T", matrix(T, 3, 3))
        write("x0", vector(x0))
    return {"unknowns": part.A.shape[0], "rows": part.C.shape[0], "clamped": A.shape[0]}


def petsc_vector(values, path):
    """A vector in PETSc's binary format."""
    from petsc4py import PETSc
    viewer = PETSc.Viewer().createBinary(path, "w", comm=PETSc.COMM_SELF)
    PETSc.Vec().createWithArray(numpy.ascontiguousarray(values, dtype=float), comm=PETSc.COMM_SELF).view(viewer)
    viewer.destroy()
