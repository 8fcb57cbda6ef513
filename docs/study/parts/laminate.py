"""Laminate: layers of different stiffness, joined by cohesive springs."""
import numpy

from .locate import closest_points
from .mesh import nodal_areas, of_order, on, surface, tetrahedra, together
from .part import Model

LENGTH, WIDTH = 100.0, 50.0
THICKNESS = (4.0, 2.5, 5.0, 2.5, 4.0)
MODULI = (70e3, 3e3, 140e3, 1e3, 70e3)
NORMAL, TANGENTIAL = 5e3, 1.5e3  # stiffness of the springs [MPa/mm]
FACETS = 1e-6


def _layer(bottom, top):
    def build(occ):
        plate = occ.addBox(0, 0, bottom, LENGTH, WIDTH, top - bottom)
        occ.cut([(3, plate)], [(3, occ.addCylinder(0.6 * LENGTH, WIDTH / 2, bottom, 0, 0, top - bottom, 9))])
    return build


def make(h, order):
    """A plate with a hole, fixed at one end; its layers have meshes of their own.

    Rows: the jump of a slave node minus its traction's share of the springs' compliance."""
    heights = numpy.concatenate([[0], numpy.cumsum(THICKNESS)])
    sizes = h * numpy.array([1.0, 0.85, 1.1, 0.9, 0.95])
    bodies = [tetrahedra(_layer(*pair), size, size / 2) for pair, size in zip(zip(heights, heights[1:]), sizes)]
    X, T, body = together(of_order(bodies, order))
    model = Model(X, T, numpy.array(MODULI)[body], 0.3)
    S = [surface(T[body == i]) for i in range(len(MODULI))]
    for i, height in enumerate(heights[1:-1]):
        there = numpy.abs(X[:, 2] - height) < FACETS
        upper = on(S[i + 1], there)
        area = nodal_areas(X, upper, positive=True)
        slaves = numpy.unique(upper)
        nodes, weights, gap = closest_points(X, on(S[i], there), X[slaves])
        for direction, stiffness in zip(numpy.eye(3), (TANGENTIAL, TANGENTIAL, NORMAL)):
            compliance = 1 / (stiffness * area[slaves])
            model.tie(slaves, nodes, weights, directions=direction, rigid=gap, compliance=compliance)
    end = numpy.flatnonzero(X[:, 0] < FACETS)
    model.fixed = end[numpy.isin(end, T[body == 2])]  # the layer in the middle
    model.load(nodal_areas(X, numpy.vstack([on(s, X[:, 0] > LENGTH - FACETS) for s in S])), (200, 50, -120))
    return model.part(end)
