"""Calls of DOLFINx that its versions write differently; the tutorials run with 0.5 and with 0.9 to 0.11.

A program for one version needs none of this: each function is the call of the newest, which its docstring names.
"""
import dolfinx.fem.petsc  # which fem does not import by itself
import ufl
from dolfinx import fem, mesh
from petsc4py import PETSc


def functionspace(domain, element):
    """fem.functionspace(domain, (family, degree)), or (family, degree, (components,)) for vectors"""
    if hasattr(fem, 'functionspace'):
        return fem.functionspace(domain, element)
    return (fem.VectorFunctionSpace if element[2:] else fem.FunctionSpace)(domain, element[:2])


def hexahedra(comm, cells, points):
    """mesh.create_mesh(comm, cells, element, points)"""
    try:
        from basix.ufl import element
    except ImportError:
        return mesh.create_mesh(comm, cells, points, ufl.Mesh(ufl.VectorElement('Lagrange', 'hexahedron', 1)))
    return mesh.create_mesh(comm, cells, x=points, e=element('Lagrange', 'hexahedron', 1, shape=(3,)))


def assemble_matrix(blocks, bcs, kind=None):
    """fem.petsc.assemble_matrix(blocks, bcs, kind=kind): one matrix, or a nest where kind is 'nest'"""
    if hasattr(fem.petsc, 'assemble_matrix_block'):
        assemble = fem.petsc.assemble_matrix_nest if kind == 'nest' else fem.petsc.assemble_matrix_block
        A = assemble(blocks, bcs=bcs)
    else:
        A = fem.petsc.assemble_matrix(blocks, bcs=bcs, kind=kind)
    A.assemble()
    return A


def assemble_vector(L, blocks, bcs):
    """fem.petsc.assemble_vector(L) and the values of bcs"""
    if hasattr(fem.petsc, 'assemble_vector_block'):
        return fem.petsc.assemble_vector_block(L, blocks, bcs=bcs)
    b = fem.petsc.assemble_vector(L)
    fem.petsc.apply_lifting(b, blocks, bcs=fem.bcs_by_block(fem.extract_function_spaces(blocks, 1), bcs))
    b.ghostUpdate(PETSc.InsertMode.ADD, PETSc.ScatterMode.REVERSE)
    fem.petsc.set_bc(b, fem.bcs_by_block(fem.extract_function_spaces(L), bcs))
    return b
