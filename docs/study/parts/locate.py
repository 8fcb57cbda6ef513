"""Where points are in a mesh: the closest points of a surface, and the tetrahedra that contain them."""
import numpy
from scipy.spatial import cKDTree

from .elasticity import shape_functions


def _closest_in_plane(P, Y):
    """Barycentric coordinates of the feet of perpendiculars on the planes of triangles."""
    u, v, w = P[:, 1] - P[:, 0], P[:, 2] - P[:, 0], Y - P[:, 0]
    uu, uv, vv, wu, wv = ((a * b).sum(axis=1) for a, b in ((u, u), (u, v), (v, v), (w, u), (w, v)))
    s, t = numpy.array([vv * wu - uv * wv, uu * wv - uv * wu]) / (uu * vv - uv * uv)
    return numpy.stack([1 - s - t, s, t], axis=1)


def _closest_on_side(P, Y, i, j):
    """Barycentric coordinates of the closest points on one side of triangles."""
    side = P[:, j] - P[:, i]
    t = numpy.clip(((Y - P[:, i]) * side).sum(axis=1) / (side ** 2).sum(axis=1), 0, 1)
    L = numpy.zeros((len(Y), 3))
    L[:, i], L[:, j] = 1 - t, t
    return L


def closest_points(X, S, Y, candidates=16):
    """The closest points of Y on triangles S: nodes of the triangle, values of their shape functions, distances."""
    P = X[S[:, :3]]
    nearest = cKDTree(P.mean(axis=1)).query(Y, k=min(candidates, len(S)))[1].reshape(len(Y), -1)
    distance, triangle, L = numpy.full(len(Y), numpy.inf), numpy.zeros(len(Y), dtype=int), numpy.zeros((len(Y), 3))
    for chosen in nearest.T:
        Q = P[chosen]
        inside = _closest_in_plane(Q, Y)
        offers = [numpy.where((inside >= 0).all(axis=1)[:, None], inside, [1.0, 0.0, 0.0])]
        offers += [_closest_on_side(Q, Y, i, j) for i, j in ((0, 1), (1, 2), (2, 0))]
        for offer in offers:
            d = numpy.linalg.norm(numpy.einsum("ni,nij->nj", offer, Q) - Y, axis=1)
            better = d < distance - 1e-14
            distance[better], triangle[better], L[better] = d[better], chosen[better], offer[better]
    L[numpy.abs(L) < 1e-12] = 0
    return S[triangle], L if S.shape[1] == 3 else shape_functions(L), distance


def containing(X, T, Y, candidates=48):
    """The tetrahedra that contain the points Y: nodes, values of their shape functions."""
    P = X[T[:, :4]]
    nearest = cKDTree(P.mean(axis=1)).query(Y, k=min(candidates, len(T)))[1].reshape(len(Y), -1)
    best, element, L = numpy.full(len(Y), -numpy.inf), numpy.zeros(len(Y), dtype=int), numpy.zeros((len(Y), 4))
    for chosen in nearest.T:
        Q = P[chosen]
        inner = numpy.linalg.solve((Q[:, 1:] - Q[:, :1]).transpose(0, 2, 1), (Y - Q[:, 0])[:, :, None])[:, :, 0]
        offer = numpy.concatenate([1 - inner.sum(axis=1, keepdims=True), inner], axis=1)
        better = offer.min(axis=1) > best
        best[better], element[better], L[better] = offer.min(axis=1)[better], chosen[better], offer[better]
    if (best < -1e-9).any():
        raise ValueError("%d points are in none of the tetrahedra" % (best < -1e-9).sum())
    L[numpy.abs(L) < 1e-12] = 0
    return T[element], L if T.shape[1] == 4 else shape_functions(L)
