#!/usr/bin/env python3
"""A picture of two bodies in contact: deformed, the upper one lifted so that the contact pressure on the lower one is
seen.

python3 docs/study/bodies.py bodies.vtu picture.png
bodies.vtu is what twocubes -view_vtu writes; without a screen. Needs Debian's python3-matplotlib.
"""
import base64
import re
import sys

import numpy
from common.plots import check_inside, pyplot
from mpl_toolkits.mplot3d import proj3d
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

# of a hexahedron, outwards
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
TYPES = {"Float64": "f8", "Int64": "i8", "Int32": "i4", "UInt8": "u1"}


def read(path):
    """The arrays of the file by name, those of its pieces one after the other."""
    arrays, shift = {}, 0
    with open(path) as file:
        pieces = re.findall(r"<Piece NumberOfPoints=\"(\d+)\"(.*?)</Piece>", file.read(), re.DOTALL)
    for points, piece in pieces:
        for kind, name, components, data in re.findall(r"<DataArray type=\"(\w+)\" Name=\"(\w+)\" "
                                                       r"NumberOfComponents=\"(\d+)\"[^>]*>([^<]*)<", piece):
            values = numpy.frombuffer(base64.b64decode(data)[8:], TYPES[kind]).reshape(-1, int(components))
            arrays.setdefault(name, []).append(values + shift if name == "connectivity" else values)
        shift += int(points)
    return {name: numpy.concatenate(parts) for name, parts in arrays.items()}


def weld(arrays):
    """Pieces repeat the nodes between them: one number for each node, by body and place before deformation."""
    place = arrays["position"] - arrays["displacement"]
    cells = arrays["connectivity"].reshape(-1, 8)
    body = numpy.zeros(len(place), int)
    for cell, number in zip(cells, arrays["body"].ravel()):
        body[cell] = number
    _, first, number = numpy.unique(numpy.column_stack((body, place.round(9))), axis=0, return_index=True,
                                    return_inverse=True)
    number = number.ravel()
    return number[cells], body[first], place[first], arrays["displacement"][first], arrays["contact_force"][first]


def outside(cells):
    """The faces of one cell only."""
    faces = numpy.concatenate([cells[:, face] for face in FACES])
    _, first, count = numpy.unique(numpy.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


def pressure(faces, place, force):
    """At the nodes, the force against the surface over the area that belongs to a node; faces: of the contact surface.
    """
    area, normal = numpy.zeros(len(place)), numpy.zeros((len(place), 3))
    for face in faces:
        a, b, c, d = place[face]
        n = numpy.cross(c - a, d - b) / 2
        normal[face] += n / 4
        area[face] += numpy.linalg.norm(n) / 4
    with numpy.errstate(invalid="ignore", divide="ignore"):
        return -numpy.einsum("ij,ij->i", force, normal) / area**2


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    cells, body, place, displacement, force = weld(read(sys.argv[1]))
    span = numpy.ptp(place, axis=0).max()
    scale = 0.1 * span / numpy.abs(displacement).max()
    faces = outside(cells)
    loaded = numpy.linalg.norm(force, axis=1) > 1e-12 * numpy.abs(force).max()
    middle = [place[body == number].mean(axis=0) for number in (1, 2)]
    upper = 1 if middle[0][2] > middle[1][2] else 2
    lower = 3 - upper
    touching = faces[(body[faces[:, 0]] == lower) & loaded[faces].all(axis=1)]
    at_nodes = pressure(touching, place, force)
    seen = place + scale * displacement
    seen[body == upper, 2] += 0.45 * span
    of_face = {tuple(face): numpy.nanmean(at_nodes[face]) for face in touching}
    colors = pyplot.get_cmap("viridis")
    most = max(of_face.values())
    light = numpy.array((0.3, -0.5, 0.8)) / numpy.linalg.norm((0.3, -0.5, 0.8))
    shades = []
    for face in faces:
        if tuple(face) in of_face:
            shades.append(colors(max(of_face[tuple(face)], 0) / most))
        else:
            a, b, c, d = seen[face]
            n = numpy.cross(c - a, d - b)
            gray = 0.62 + 0.3 * max(0, n @ light / numpy.linalg.norm(n))
            shades.append((gray, gray, gray + 0.04 if body[face[0]] == upper else gray, 1))
    figure = pyplot.figure(figsize=(7, 6.5))
    axes = figure.add_axes((0, 0, 0.86, 0.95), projection="3d")
    axes.add_collection3d(Poly3DCollection(seen[faces], facecolors=shades, edgecolors=(0, 0, 0, 0.25), linewidths=0.3))
    low, high = seen.min(axis=0), seen.max(axis=0)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_zlim(low[2], high[2])
    axes.set_box_aspect(high - low, zoom=0.92)  # the corners of the box, too
    axes.view_init(elev=28, azim=-55)
    axes.set_axis_off()
    bar = figure.colorbar(pyplot.cm.ScalarMappable(pyplot.Normalize(0, most), colors),
                          cax=figure.add_axes((0.84, 0.2, 0.03, 0.6)))
    bar.set_label("contact pressure")
    figure.suptitle("Deformed bodies, displacements %.3g times; the upper body is lifted" % scale, fontsize=10)
    axes.apply_aspect()
    x, y, _ = proj3d.proj_transform(*seen.T, axes.get_proj())
    corners = figure.transFigure.inverted().transform(axes.transData.transform(numpy.column_stack((x, y))))
    if corners.min() < 0 or corners.max() > 1 or corners[:, 1].max() > axes.get_position().y1:
        raise ValueError("a body is drawn outside of the picture")
    check_inside(figure)
    figure.savefig(sys.argv[2], dpi=110)
    print("wrote %s: %d nodes, %d faces in contact, pressure up to "
          "%.4g" % (sys.argv[2], len(place), len(touching), most))


if __name__ == "__main__":
    main()
