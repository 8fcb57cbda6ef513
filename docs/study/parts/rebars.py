"""Reinforced concrete: bars as trusses, whose nodes are embedded in the tetrahedra that contain them."""
import numpy

from . import elasticity
from .locate import containing
from .mesh import nodal_areas, of_order, on, surface, tetrahedra
from .part import Model

LENGTH, WIDTH, HEIGHT, COVER = 600.0, 200.0, 300.0, 30.0  # mm
CONCRETE, STEEL, DIAMETER = 30e3, 200e3, 14.0


def _geometry(occ):
    occ.addBox(0, 0, 0, LENGTH, WIDTH, HEIGHT)


def _lines():
    """Ends of straight bars: along the beam, stirrups, and bars that are turned to all axes."""
    y, z = (COVER, WIDTH / 2, WIDTH - COVER), (COVER, HEIGHT - COVER)
    lines = [((12, b, c), (LENGTH - 12, b, c)) for b in y for c in z]
    for x in numpy.linspace(40, LENGTH - 40, 7):
        loop = [(x, y[0], z[0]), (x, y[2], z[0]), (x, y[2], z[1]), (x, y[0], z[1])]
        lines += list(zip(loop, loop[1:] + loop[:1]))
    for b in (0.3, 0.7):
        lines.append(((60, b * WIDTH, HEIGHT - 40), (LENGTH / 2, WIDTH / 2 + (b - 0.5) * 90, 45)))
        lines.append(((LENGTH - 60, b * WIDTH, HEIGHT - 50), (LENGTH / 2 + 20, WIDTH / 2 - (b - 0.5) * 80, 55)))
    return [numpy.array(line, dtype=float) for line in lines]


def _trusses(h):
    """Nodes and bars, about h long and by no means those of the mesh."""
    nodes, bars, first = [], [], 0
    for a, b in _lines():
        count = max(2, int(numpy.ceil(numpy.linalg.norm(b - a) / h)))
        nodes.append(a + numpy.linspace(0, 1, count + 1)[:, None] * (b - a))
        bars.append(first + numpy.stack([numpy.arange(count), numpy.arange(count) + 1], axis=1))
        first += count + 1
    return numpy.vstack(nodes), numpy.vstack(bars)


def _turn(angles=(0.4, -0.7, 1.1)):
    """A rotation about x, y and z, of no special angles."""
    turn = numpy.eye(3)
    for axis, angle in enumerate(angles):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        step = numpy.eye(3)
        step[[a, a, b, b], [a, b, a, b]] = numpy.cos(angle), -numpy.sin(angle), numpy.sin(angle), numpy.cos(angle)
        turn = step @ turn
    return turn


def make(h, order, turned=False):
    """A beam of concrete that is fixed at one end; the nodes of its bars have stiffness along the bars alone.

    turned: so that no bar is along an axis, and each node of the bars has a singular block without a zero row."""
    (X, T), = of_order([tetrahedra(_geometry, h, h / 2)], order)
    Y, bars = _trusses(0.8 * h)
    turn = _turn() if turned else numpy.eye(3)
    model = Model(X @ turn.T, T, CONCRETE, 0.2)
    slaves = len(X) + numpy.arange(len(Y))
    nodes, weights = containing(X, T, Y)
    Y = Y @ turn.T
    model.nodes(Y, elasticity.truss(Y, bars, STEEL * numpy.pi / 4 * DIAMETER ** 2))
    model.tie(slaves, nodes, weights)
    S = surface(T)
    model.fixed = numpy.unique(on(S, X[:, 0] < 1e-6))
    model.load(nodal_areas(X, on(S, X[:, 2] > HEIGHT - 1e-6)), turn @ [0, 4e3, -40e3])
    model.careless()
    return model.part(numpy.concatenate([model.fixed, slaves]))


def make_turned(h, order):
    """The beam in no special direction."""
    return make(h, order, turned=True)
