"""Two flanges of steel and six bolts with pretension."""
import numpy
from scipy.spatial import cKDTree

from .locate import closest_points
from .mesh import nodal_areas, of_order, on, split, surface, tetrahedra, together
from .part import Model

BOLTS = 75 * numpy.array([[numpy.cos(a), numpy.sin(a)] for a in numpy.arange(6) * numpy.pi / 3])
RADIUS, CUT = 6.0, 4.0  # of the bolts; the height at which they are cut
PRETENSION = 20e3


def _flange(side):
    def build(occ):
        plate = occ.addCylinder(0, 0, 0, 0, 0, 15 * side, 100)
        hub = occ.addCylinder(0, 0, 0, 0, 0, 60 * side, 45)
        holes = [(3, occ.addCylinder(0, 0, -70, 0, 0, 140, 30))]
        holes += [(3, occ.addCylinder(x, y, -70, 0, 0, 140, RADIUS)) for x, y in BOLTS]
        body, _ = occ.fuse([(3, plate)], [(3, hub)])
        occ.cut(body, holes)
    return build


def _bolt(x, y):
    """Thread below z = 0, shank, head above z = 15."""
    def build(occ):
        lower = occ.addCylinder(x, y, -15, 0, 0, 15 + CUT, RADIUS)
        shank = occ.addCylinder(x, y, CUT, 0, 0, 15 - CUT, RADIUS)
        head = occ.addCylinder(x, y, 15, 0, 0, 7, 10)
        upper, _ = occ.fuse([(3, shank)], [(3, head)])
        occ.fragment([(3, lower)], upper)
    return build


def _bodies(h, order):
    bodies = [tetrahedra(_flange(-1), h, h / 2.2)[:2], tetrahedra(_flange(1), 0.83 * h, h / 2.5)[:2]]
    for x, y in BOLTS:
        X, T, _ = tetrahedra(_bolt(x, y), 0.55 * h, h / 4)
        bodies.append(split(X, T, X[T].mean(axis=1)[:, 2] > CUT))
    return of_order(bodies, order)


def make(h, order):
    """The lower flange is fixed. Threads and heads are tied, the flanges slide on each other.

    Each bolt is cut, and its parts are apart by an extra unknown, on which the pretension acts."""
    X, T, body = together(_bodies(h, order))
    model = Model(X, T, numpy.where(body < 2, 210e3, 205e3), 0.3)
    S = [surface(T[body == i]) for i in range(8)]
    z = X[:, 2]
    model.fixed = numpy.unique(on(S[0], z < -60 + 1e-6))
    slaves = numpy.unique(on(S[1], numpy.abs(z) < 1e-6))
    nodes, weights, gap = closest_points(X, on(S[0], numpy.abs(z) < 1e-6), X[slaves])
    near = gap < 1e-3 * h
    model.tie(slaves[near], nodes[near], weights[near], directions=[[0.0, 0.0, 1.0]], rigid=gap[near])
    cuts = [_bolt_rows(model, S, i) for i in range(6)]
    top = on(S[1], z > 60 - 1e-6)
    model.load(nodal_areas(X, top), (2e3, 0, 5e3))
    model.careless()
    return model.part(numpy.concatenate([model.fixed, top.ravel()] + cuts))


def _bolt_rows(model, S, i):
    """Thread, seat and cut of a bolt; the nodes of the cut."""
    X, z = model.X, model.X[:, 2]
    from_axis = numpy.hypot(X[:, 0] - BOLTS[i, 0], X[:, 1] - BOLTS[i, 1])
    bolt = S[2 + i]
    thread = numpy.unique(on(bolt, (numpy.abs(from_axis - RADIUS) < 1e-4) & (z < 1e-6)))
    hole = on(S[0], from_axis < RADIUS + 0.01)
    nodes, weights, gap = closest_points(X, hole, X[thread])
    model.tie(thread, nodes, weights, rigid=gap)
    head = numpy.unique(on(bolt, numpy.abs(z - 15) < 1e-6))
    head = head[from_axis[head] > RADIUS - 1e-4]
    nodes, weights, gap = closest_points(X, on(S[1], numpy.abs(z - 15) < 1e-6), X[head])
    model.tie(head, nodes, weights, rigid=gap)
    # both sides of the cut lie in one plane: those of upper triangles, whose bodies are above it
    cut = numpy.unique(on(bolt, numpy.abs(z - CUT) < 1e-6))
    twin = cKDTree(X[cut]).query(X[cut], k=2)[1]
    twin = cut[numpy.where(twin[:, 0] == numpy.arange(len(cut)), twin[:, 1], twin[:, 0])]
    lower, upper = cut[cut < twin], twin[cut < twin]
    shortening = model.unknowns(1)
    model.f[shortening] = PRETENSION
    for a in range(3):
        columns, values = [3 * upper + a, 3 * lower + a], [1.0, -1.0]
        if a == 2:
            columns.append(numpy.full(len(upper), shortening))
            values.append(1.0)
        model.rows(numpy.stack(columns, axis=1), values)
    return cut
