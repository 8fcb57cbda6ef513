"""The constraints of two bodies that touch on a flat square, without their volumes: A is a diagonal, the stiffness of
each body.

Node to surface, as twocubes makes them: n1 elements per edge above, seven eighths of it below, the nodes do not meet;
one half sticks (three rows a node), the other slips (one row, along the normal). turned: the surface is turned against
the axes, so that slip rows tie all components together and the Gram matrix is one piece.
"""
import math
import os

import numpy

ANGLES = (20, 35, 50)
STIFFNESS = (10.0, 1.0)


def normal(turned):
    n = numpy.array([0.0, 0.0, 1.0])
    if turned:
        for axis, degrees in enumerate(ANGLES):
            c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
            rotation = numpy.eye(3)
            i, j = [k for k in range(3) if k != axis]
            rotation[i, i] = rotation[j, j] = c
            rotation[i, j], rotation[j, i] = (s, -s) if axis == 1 else (-s, s)
            n = rotation @ n
    return n


def edge(rows):
    """Elements per edge of the upper body that give about so many rows: two per node."""
    return max(8, round(math.sqrt(rows / 2)) - 1)


def constraints(n1, turned):
    """C in CSR: offsets, columns, values; and the number of unknowns of each body. Unknowns of a body are together,
    three per node.
    """
    n2 = n1 * 7 // 8
    j, i = (part.ravel() for part in numpy.divmod(numpy.arange((n1 + 1) ** 2), n1 + 1))
    x, y = i * n2 / n1, j * n2 / n1
    p, q = numpy.minimum(x.astype(int), n2 - 1), numpy.minimum(y.astype(int), n2 - 1)
    a, b = x - p, y - q
    upper, lower = len(i), (n2 + 1) ** 2
    corner = upper + p + q * (n2 + 1)
    nodes = numpy.stack([numpy.arange(upper), corner, corner + 1, corner + n2 + 1, corner + n2 + 2], 1)
    weights = numpy.stack([numpy.ones(upper), -(1 - a) * (1 - b), -a * (1 - b), -(1 - a) * b, -a * b], 1)
    sticks = i / n1 < 0.5
    count = numpy.where(sticks, 3, 1)
    first = numpy.concatenate([[0], numpy.cumsum(count)])
    n = normal(turned)
    rows, columns, values = [], [], []
    for c in range(3):
        for chosen, row, direction in ((sticks, first[:-1] + c, 1.0), (~sticks, first[:-1], n[c])):
            rows.append(numpy.repeat(row[chosen], 5))
            columns.append((3 * nodes[chosen] + c).ravel())
            values.append(direction * weights[chosen].ravel())
    rows, columns, values = (numpy.concatenate(part) for part in (rows, columns, values))
    keep = numpy.abs(values) > 1e-14
    rows, columns, values = rows[keep], columns[keep], values[keep]
    order = numpy.lexsort((columns, rows))
    offsets = numpy.concatenate([[0], numpy.cumsum(numpy.bincount(rows, minlength=first[-1]))])
    return offsets, columns[order], values[order], (3 * upper, 3 * lower)


def save_matrix(path, columns_in_all, offsets, columns, values):
    """PETSc's binary format: big endian, 32-bit indices."""
    with open(path, "wb") as file:
        numpy.array([1211216, len(offsets) - 1, columns_in_all, len(columns)], ">i4").tofile(file)
        numpy.diff(offsets).astype(">i4").tofile(file)
        columns.astype(">i4").tofile(file)
        values.astype(">f8").tofile(file)


def save_vector(path, values):
    with open(path, "wb") as file:
        numpy.array([1211214, len(values)], ">i4").tofile(file)
        values.astype(">f8").tofile(file)


def save(folder, n1, turned):
    """Files of A, C and f for tests/bench/solve.cpp: its options, and the number of rows of C."""
    offsets, columns, values, sizes = constraints(n1, turned)
    unknowns = sum(sizes)
    path = {name: os.path.join(folder, name + ".dat") for name in "ACf"}
    save_matrix(path["A"], unknowns, numpy.arange(unknowns + 1), numpy.arange(unknowns), numpy.repeat(STIFFNESS, sizes))
    save_matrix(path["C"], unknowns, offsets, columns, values)
    save_vector(path["f"], numpy.cos(numpy.arange(unknowns)))
    return " ".join("-%s %s" % item for item in path.items()) + " -block_size 3", len(offsets) - 1
