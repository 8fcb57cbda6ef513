"""Cyclic sector of a bladed disk that rotates."""
import numpy

from .locate import closest_points
from .mesh import nodal_volumes, of_order, on, surface, tetrahedra, together
from .part import Model

HALF = numpy.pi / 12  # of the sector's angle
BORE, RIM = 40.0, 160.0
SPEED = 800.0  # rad/s


def _wedge(occ, angle):
    wedge = occ.addCylinder(0, 0, -100, 0, 0, 200, 300, angle=angle)
    occ.rotate([(3, wedge)], 0, 0, 0, 0, 0, 1, -angle / 2)
    return [(3, wedge)]


def _ring(occ, inner, outer, thickness):
    whole = occ.addCylinder(0, 0, -thickness / 2, 0, 0, thickness, outer)
    hole = occ.addCylinder(0, 0, -thickness / 2 - 1, 0, 0, thickness + 2, inner)
    return occ.cut([(3, whole)], [(3, hole)])[0]


def _disk(occ):
    hub, web, rim = _ring(occ, BORE, 60, 50), _ring(occ, 55, 150, 12), _ring(occ, 140, RIM, 40)
    disk, _ = occ.fuse(hub, web + rim)
    occ.intersect(disk, _wedge(occ, 2 * HALF))


def _blade(occ):
    foot, _ = occ.intersect(_ring(occ, RIM, RIM + 6, 34), _wedge(occ, 1.3 * HALF))
    blade = [(3, occ.addBox(RIM + 3, -2, -15, 80, 4, 30))]
    occ.rotate(blade, RIM + 3, 0, 0, 1, 0, 0, 0.5)
    occ.fuse(foot, blade)


def make(h, order):
    """The blade is tied on the rim. One side of the sector moves as the other one, turned.

    The disk is shrunk on a shaft: its bore moves radially only."""
    X, T, body = together(of_order([tetrahedra(_disk, h, h / 2.5), tetrahedra(_blade, 0.6 * h, h / 5)], order))
    model = Model(X, T, numpy.where(body == 0, 205e3, 110e3), numpy.where(body == 0, 0.3, 0.34))
    disk, blade = (surface(T[body == i]) for i in range(2))
    angle, r = numpy.arctan2(X[:, 1], X[:, 0]), numpy.hypot(X[:, 0], X[:, 1])
    c, s = numpy.cos(2 * HALF), numpy.sin(2 * HALF)
    turn = numpy.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    slaves = numpy.unique(on(disk, numpy.abs(angle - HALF) < 1e-7))
    nodes, weights, _ = closest_points(X, on(disk, numpy.abs(angle + HALF) < 1e-7), X[slaves] @ turn)
    model.tie(slaves, nodes, weights, turn=turn, rigid=numpy.inf)
    foot = numpy.unique(on(blade, numpy.abs(r - RIM) < 1e-3))
    sagitta = RIM * (1 - numpy.cos(h / RIM))  # how far chords and P2's straight edges may be inside
    nodes, weights, gap = closest_points(X, on(disk, numpy.abs(r - RIM) < 0.02 * sagitta + 1e-3), X[foot])
    model.tie(foot, nodes, weights, rigid=gap)
    bore = numpy.unique(on(disk, numpy.abs(r - BORE) < 1e-3))
    tangents = numpy.stack([-X[bore, 1], X[bore, 0]], axis=1) / r[bore, None]
    model.rows(numpy.stack([3 * bore, 3 * bore + 1], axis=1), tangents, rigid=numpy.inf)
    model.support(3 * bore + 2)
    mass = nodal_volumes(X, T, numpy.where(body == 0, 7.85e-9, 4.43e-9))
    model.f[:3 * len(X)] += (mass[:, None] * SPEED ** 2 * X * [1, 1, 0]).ravel()
    model.load(numpy.where(r > RIM + 6, mass, 0), (0, 0, 200))  # gas
    model.careless()
    return model.part(numpy.concatenate([bore, foot]))
