"""Housing with a cover: a mortar joint of planar faces whose meshes do not match, and screws as rigid bodies."""
import numpy
from scipy import sparse

from .elasticity import shape_functions
from .locate import closest_points
from .mesh import areas, nodal_areas, of_order, on, surface, tetrahedra, together
from .part import Model

LENGTH, WIDTH, HEIGHT, WALL, FLOOR = 160.0, 100.0, 60.0, 16.0, 10.0
COVER, RECESS, SCREW, DEPTH = 12.0, 5.0, 3.5, 18.0  # thickness of the cover, of its recess; screws: radius, depth
SCREWS = [(x, y) for x in (8.0, LENGTH / 2, LENGTH - 8) for y in (8.0, WIDTH - 8)]


def _box(occ, bottom, top, inset=0.0):
    return [(3, occ.addBox(inset, inset, bottom, LENGTH - 2 * inset, WIDTH - 2 * inset, top - bottom))]


def _holes(occ, bottom, top):
    return [(3, occ.addCylinder(x, y, bottom, 0, 0, top - bottom, SCREW)) for x, y in SCREWS]


def _housing(occ):
    occ.cut(_box(occ, 0, HEIGHT), _box(occ, FLOOR, HEIGHT + 1, WALL) + _holes(occ, HEIGHT - DEPTH, HEIGHT + 1))


def _cover(occ):
    recess = _box(occ, HEIGHT - 1, HEIGHT + RECESS, WALL)
    occ.cut(_box(occ, HEIGHT, HEIGHT + COVER), recess + _holes(occ, HEIGHT - 1, HEIGHT + COVER + 1))


def _quadrature(pieces=3):
    """Barycentric points and weights: the centers of a triangle's pieces^2 equal pieces."""
    points = []
    for i in range(pieces):
        for j in range(pieces - i):
            points.append(((i + 1 / 3) / pieces, (j + 1 / 3) / pieces))
            if j < pieces - i - 1:
                points.append(((i + 2 / 3) / pieces, (j + 2 / 3) / pieces))
    points = numpy.array(points)
    return numpy.column_stack([1 - points.sum(axis=1), points]), numpy.full(len(points), 1 / len(points))


def mortar(X, slave, master):
    """Of each slave node the integrals of its shape function times those of all nodes, the master's with a minus.

    The integrals are sums over points of slave triangles, which are projected to the master's surface. The second
    answer is the integral of the distance between the surfaces (at holes, whose polygons differ)."""
    L, weights = _quadrature()
    N = L if slave.shape[1] == 3 else shape_functions(L)
    rows, columns, values = [], [], []
    area, gap = areas(X, slave), numpy.zeros(len(X))
    for l, n, weight in zip(L, N, weights):
        at = numpy.einsum("i,eij->ej", l, X[slave[:, :3]])
        nodes, shapes, distance = closest_points(X, master, at)
        numpy.add.at(gap, slave, (weight * area * distance)[:, None] * numpy.abs(n))
        for others, factors in ((slave, numpy.broadcast_to(n, slave.shape)), (nodes, -shapes)):
            value = (weight * area)[:, None, None] * n[None, :, None] * factors[:, None, :]
            rows.append(numpy.broadcast_to(slave[:, :, None], value.shape).ravel())
            columns.append(numpy.broadcast_to(others[:, None, :], value.shape).ravel())
            values.append(value.ravel())
    shape = (len(X), len(X))
    entries = (numpy.concatenate(values), (numpy.concatenate(rows), numpy.concatenate(columns)))
    return sparse.csr_matrix(entries, shape), gap


def make(h, order):
    """The housing is fixed at its bottom, the cover is under pressure from inside. Both are of aluminum.

    Each screw is a reference node that the holes in cover and housing follow, below and above the joint."""
    bodies = [tetrahedra(_housing, h, h / 3), tetrahedra(_cover, 0.8 * h, h / 4)]
    X, T, body = together(of_order(bodies, order))
    model = Model(X, T, 70e3, 0.33)
    housing, cover = (surface(T[body == i]) for i in range(2))
    joint = numpy.abs(X[:, 2] - HEIGHT) < 1e-6
    integrals, gap = mortar(X, on(cover, joint), on(housing, joint))
    slaves = numpy.unique(on(cover, joint))
    M = integrals[slaves].tocoo()
    for a in range(3):
        model.matrix(sparse.csr_matrix((M.data, (M.row, 3 * M.col + a)), (len(slaves), model.n)),
                     rigid=gap[slaves])
    for x, y in SCREWS:
        hole = numpy.abs(numpy.hypot(X[:, 0] - x, X[:, 1] - y) - SCREW) < 1e-3
        nodes = numpy.unique(numpy.concatenate([on(housing, hole).ravel(), on(cover, hole).ravel()]))
        model.rbe2(nodes[~joint[nodes]], model.reference((x, y, HEIGHT)))
    model.fixed = numpy.unique(on(housing, X[:, 2] < 1e-6))
    pressed = on(cover, numpy.abs(X[:, 2] - HEIGHT - RECESS) < 1e-6)
    model.load(nodal_areas(X, pressed), (0, 0, 2.0 * areas(X, pressed).sum()))
    model.load(nodal_areas(X, on(cover, X[:, 2] > HEIGHT + COVER - 1e-6)), (800, 300, 0))
    model.careless()
    return model.part(numpy.concatenate([model.fixed, slaves]))
