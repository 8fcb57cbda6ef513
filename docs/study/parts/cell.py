"""Periodic cell with stiff inclusions under a macroscopic stress; the macroscopic strain is unknown."""
import numpy

from .locate import closest_points
from .mesh import nodal_volumes, of_order, on, surface, tetrahedra
from .part import Model

INCLUSIONS, RADIUS, CONTRAST = 12, 0.14, 1e3
STRESS = numpy.array([40.0, -10.0, 0.0, 0.0, 15.0, 0.0])  # MPa: xx, yy, zz, yz, zx, xy
VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))


def _balls():
    """Centers of balls in the unit cell, apart from each other and from being tangent to a face, with their images."""
    random = numpy.random.default_rng(3)
    shifts = numpy.array([[i, j, k] for i in (0, -1, 1) for j in (0, -1, 1) for k in (0, -1, 1)])
    centers = []
    while len(centers) < INCLUSIONS:
        x = random.random(3)
        to_face = numpy.minimum(x, 1 - x)
        apart = all(numpy.linalg.norm(x + shifts - y, axis=1).min() > 2.15 * RADIUS for y in centers)
        if apart and not ((to_face > 0.6 * RADIUS) & (to_face < 1.2 * RADIUS)).any():
            centers.append(x)
    images = (numpy.array(centers)[:, None] + shifts).reshape(-1, 3)
    return images[((images > -RADIUS) & (images < 1 + RADIUS)).all(axis=1)]


def _geometry(occ):
    balls = [(3, occ.addSphere(x, y, z, RADIUS)) for x, y, z in _balls()]
    inside, _ = occ.intersect(balls, [(3, occ.addBox(0, 0, 0, 1, 1, 1))])
    occ.fragment([(3, occ.addBox(0, 0, 0, 1, 1, 1))], inside)


def make(h, order, mean=False):
    """Unit cube of a matrix with inclusions a thousand times stiffer, some of which cross its faces.

    Faces, edges and corners that meet are tied by closest points, which says some things twice.
    mean: the mean displacement is zero (long rows), else one node is held."""
    X, T, _ = tetrahedra(_geometry, h, h / 2)
    middle = X[T].mean(axis=1)
    inside = numpy.min([numpy.linalg.norm(middle - ball, axis=1) for ball in _balls()], axis=0) < RADIUS
    (X, T), = of_order([(X, T)], order)
    model = Model(X, T, numpy.where(inside, 3000.0 * CONTRAST, 3000.0), numpy.where(inside, 0.2, 0.35))
    S = surface(T)
    strain = model.unknowns(6)
    for axis in range(3):
        lower, upper = on(S, X[:, axis] < 1e-7), on(S, X[:, axis] > 1 - 1e-7)
        slaves = numpy.unique(upper)
        nodes, weights, distance = closest_points(X, lower, X[slaves] - numpy.eye(3)[axis])
        for a in range(3):  # u(+) - u(-) = strain (x(+) - x(-))
            columns = numpy.hstack([3 * slaves[:, None] + a, 3 * nodes + a,
                                    numpy.full((len(slaves), 1), strain + _voigt(a, axis))])
            one = numpy.ones((len(slaves), 1))
            model.rows(columns, numpy.hstack([one, -weights, -one]), rigid=1.5)
    if mean:
        w = nodal_volumes(X, T)
        for a in range(3):
            used = numpy.flatnonzero(w)
            model.rows(3 * used + a, w[used] / w.sum(), rigid=numpy.inf)
    else:
        held = numpy.argmin(numpy.linalg.norm(X - 0.5, axis=1))
        model.support(3 * held + numpy.arange(3))
    model.f[strain:] = STRESS * numpy.where(numpy.arange(6) < 3, 1, 2)
    return model.part(numpy.unique(on(S, X[:, 0] < 1e-7)))


def make_mean(h, order):
    """The cell whose mean displacement is zero."""
    return make(h, order, mean=True)


def _voigt(a, b):
    return next(i for i, pair in enumerate(VOIGT) if set(pair) == {a, b})
