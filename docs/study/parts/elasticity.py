"""Stiffness matrices of linear elasticity: tetrahedra and trusses."""
import numpy
from scipy import sparse

from .mesh import EDGES

CHUNK = 20000  # tetrahedra at once


def shape_functions(L):
    """Of barycentric coordinates (..., 3 or 4), with the nodes of P2: corners, then the middles of edges."""
    edges = EDGES if L.shape[-1] == 4 else EDGES[:3]
    return numpy.concatenate([L * (2 * L - 1), 4 * L[..., edges[:, 0]] * L[..., edges[:, 1]]], axis=-1)


def _gradients(J, quadratic):
    """Weights and gradients of shape functions at the points of quadrature."""
    G = numpy.linalg.inv(J).transpose(0, 2, 1)
    G = numpy.concatenate([-G.sum(axis=1, keepdims=True), G], axis=1)
    if not quadratic:
        yield 1.0, G
        return
    for point in range(4):
        L = numpy.full(4, 0.1381966011250105)
        L[point] = 0.5854101966249685
        middles = [4 * (L[a] * G[:, b:b + 1] + L[b] * G[:, a:a + 1]) for a, b in EDGES]
        yield 0.25, numpy.concatenate([(4 * L - 1)[None, :, None] * G] + middles, axis=1)


def _element_matrices(X, T, E, nu):
    """(elements, nodes, 3, nodes, 3)"""
    P = X[T[:, :4]]
    J = P[:, 1:] - P[:, :1]
    volume = numpy.linalg.det(J) / 6
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    k = T.shape[1]
    K = numpy.zeros((len(T), k, 3, k, 3))
    for weight, G in _gradients(J, k == 10):
        products = numpy.einsum("eia,ejb->eiajb", G, G)
        K += (weight * volume * lam)[:, None, None, None, None] * products
        K += (weight * volume * mu)[:, None, None, None, None] * products.transpose(0, 1, 4, 3, 2)
        diagonal = numpy.einsum("eia,eja->eij", G, G) * (weight * volume * mu)[:, None, None]
        for a in range(3):
            K[:, :, a, :, a] += diagonal
    return K


def _assemble(nodes, K, n):
    """Element matrices (elements, nodes, 3, nodes, 3) in a matrix of n unknowns."""
    unknowns = (3 * nodes[:, :, None] + numpy.arange(3)).reshape(len(nodes), -1)
    size = unknowns.shape[1]
    rows, columns = numpy.repeat(unknowns, size, axis=1).ravel(), numpy.tile(unknowns, (1, size)).ravel()
    return sparse.csr_matrix((K.ravel(), (rows, columns)), (n, n))


def solid(X, T, E, nu):
    """Tetrahedra of isotropic material; E and nu for all, or for each."""
    n = 3 * len(X)
    E, nu = numpy.broadcast_to(E, len(T)), numpy.broadcast_to(nu, len(T))
    K = sparse.csr_matrix((n, n))
    for start in range(0, len(T), CHUNK):
        some = slice(start, start + CHUNK)
        K = K + _assemble(T[some], _element_matrices(X, T[some], E[some], nu[some]), n)
    return ((K + K.T) / 2).tocsr()


def truss(X, bars, EA):
    """Bars of two nodes, with stiffness along their axes only."""
    d = X[bars[:, 1]] - X[bars[:, 0]]
    length = numpy.linalg.norm(d, axis=1)
    block = numpy.einsum("ea,eb->eab", d, d) * (EA / length ** 3)[:, None, None]
    K = numpy.einsum("ij,eab->eiajb", numpy.array([[1.0, -1.0], [-1.0, 1.0]]), block)
    return _assemble(bars, K, 3 * len(X))
