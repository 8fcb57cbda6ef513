"""Connecting rod, held and loaded by reference nodes in its bearings."""
import numpy

from .mesh import nodal_areas, of_order, on, surface, tetrahedra
from .part import Model

LENGTH, BIG, SMALL = 150.0, 27.0, 12.0  # between the bearings; their radii
LOADS = [25e3, 1e3, 300, 0, 2e4, 1e4]


def _geometry(occ):
    big = occ.addCylinder(0, 0, -14, 0, 0, 28, 42)
    small = occ.addCylinder(LENGTH, 0, -11, 0, 0, 22, 20)
    web = occ.addBox(25, -11, -4, 115, 22, 8)
    edges = [occ.addBox(25, y, -9, 115, 5, 18) for y in (8, -13)]
    body, _ = occ.fuse([(3, big)], [(3, volume) for volume in [small, web] + edges])
    occ.cut(body, [(3, occ.addCylinder(x, 0, -30, 0, 0, 60, radius)) for x, radius in ((0, BIG), (LENGTH, SMALL))])


def _make(h, order, rigid):
    (X, T), = of_order([tetrahedra(_geometry, h, h / 2.5)], order)
    model = Model(X, T, 210e3, 0.3)
    S = surface(T)
    big, small = (on(S, numpy.abs(numpy.hypot(X[:, 0] - x, X[:, 1]) - radius) < 1e-3)
                  for x, radius in ((0, BIG), (LENGTH, SMALL)))
    held, loaded = model.reference((0, 0, 0)), model.reference((LENGTH, 0, 0))
    model.rbe3(nodal_areas(X, big), held)
    if rigid:
        model.rbe2(numpy.unique(small), loaded)
    else:
        model.rbe3(nodal_areas(X, small), loaded)
    model.support(held + numpy.arange(6))
    model.f[loaded:loaded + 6] = LOADS
    model.careless(0.005)
    return model.part(numpy.unique(big))


def make_rbe3(h, order):
    """Both reference nodes move as their bearings do in the mean."""
    return _make(h, order, rigid=False)


def make_rbe2(h, order):
    """The small bearing is rigid, and turns with its reference node."""
    return _make(h, order, rigid=True)
