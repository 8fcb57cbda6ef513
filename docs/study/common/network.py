"""Constraints whose Gram matrix is not that of a surface: balances at the nodes of a network, and ties that repeat each
other.

Balances: a row for each node, +1 and -1 for the flows of its branches, the unknowns; S is the weighted Laplacian of the
network, and one row of each piece depends on the others unless a node is open (a branch that leads out). Ties: a row
for each branch, the nodes are the unknowns.
"""
import os

import numpy

from . import surface


def grid(rows, seed=1):
    k = round(rows ** 0.5)
    node = numpy.arange(k * k).reshape(k, k)
    return k * k, numpy.concatenate([numpy.stack([node[:, :-1].ravel(), node[:, 1:].ravel()], 1),
                                     numpy.stack([node[:-1].ravel(), node[1:].ravel()], 1)])


def cube(rows, seed=1):
    k = round(rows ** (1 / 3))
    node = numpy.arange(k ** 3).reshape(k, k, k)
    pairs = [(node[:-1], node[1:]), (node[:, :-1], node[:, 1:]), (node[:, :, :-1], node[:, :, 1:])]
    return k ** 3, numpy.concatenate([numpy.stack([a.ravel(), b.ravel()], 1) for a, b in pairs])


def power(rows, seed=1):
    """A power grid: points of a plane, each tied to the nearest earlier one of a few, and half as many lines more
    between neighbors.
    """
    random = numpy.random.default_rng(seed)
    place = random.random((rows, 2))
    place = place[numpy.argsort(numpy.floor(place[:, 0] * rows ** 0.5) + place[:, 1])]
    pairs = []
    for i in range(1, rows):
        earlier = numpy.arange(max(0, i - int(2 * rows ** 0.5)), i)
        distance = numpy.abs(place[earlier] - place[i]).sum(1)
        near = earlier[numpy.argsort(distance)[:2]]
        pairs.append((near[0], i))
        if len(near) > 1 and random.random() < 0.5:
            pairs.append((near[1], i))
    return rows, numpy.array(pairs)


def random_graph(rows, seed=1):
    """A tree of random branches, and half as many branches again between any two nodes."""
    random = numpy.random.default_rng(seed)
    tree = numpy.stack([(random.random(rows - 1) * numpy.arange(1, rows)).astype(int), numpy.arange(1, rows)], 1)
    more = random.integers(0, rows, (rows // 2, 2))
    return rows, numpy.concatenate([tree, more[more[:, 0] != more[:, 1]]])


KINDS = {"grid network": grid, "power network": power, "random network": random_graph, "cubic network": cube}


def csr(rows, columns, values, m):
    order = numpy.lexsort((columns, rows))
    offsets = numpy.concatenate([[0], numpy.cumsum(numpy.bincount(rows, minlength=m))])
    return offsets, columns[order], values[order]


def balances(kind, rows, closed, seed=1):
    """C in CSR and its number of unknowns. closed: nothing leaves the network, and one row depends on the others"""
    nodes, branches = KINDS[kind](rows, seed)
    flows = numpy.arange(len(branches))
    i, j, v = [branches[:, 0], branches[:, 1]], [flows, flows], [numpy.ones(len(flows)), -numpy.ones(len(flows))]
    unknowns = len(flows)
    if not closed:
        out = numpy.arange(0, nodes, 50)
        i, j, v = i + [out], j + [unknowns + numpy.arange(len(out))], v + [numpy.ones(len(out))]
        unknowns += len(out)
    return csr(numpy.concatenate(i), numpy.concatenate(j), numpy.concatenate(v), nodes) + (unknowns,)


def ties(kind, rows, seed=1):
    nodes, branches = KINDS[kind](rows, seed)
    row = numpy.arange(len(branches))
    return csr(numpy.concatenate([row, row]), branches.T.ravel(), numpy.repeat([1.0, -1.0], len(row)),
               len(row)) + (nodes,)


def save(folder, what, kind, rows):
    """Files for tests/bench/solve.cpp of closed or open balances, or ties: its options, those of the whole system in
    one matrix, the rows of C.
    """
    offsets, columns, values, n = ties(kind, rows) if what == "ties" else balances(kind, rows, what == "closed")
    m = len(offsets) - 1
    stiffness = 10.0 ** numpy.random.default_rng(3).uniform(-1, 1, n)
    path = {name: os.path.join(folder, name + ".dat") for name in ("A", "C", "f", "K", "b")}
    surface.save_matrix(path["A"], n, numpy.arange(n + 1), numpy.arange(n), stiffness)
    surface.save_matrix(path["C"], n, offsets, columns, values)
    surface.save_vector(path["f"], numpy.cos(numpy.arange(n)))
    row = n + numpy.repeat(numpy.arange(m), numpy.diff(offsets))
    parts = (numpy.arange(n), numpy.arange(n),
             stiffness), (row, columns,
                          values), (columns, row, values), (n + numpy.arange(m), n + numpy.arange(m), numpy.zeros(m))
    surface.save_matrix(path["K"], n + m, *csr(*(numpy.concatenate(part) for part in zip(*parts)), n + m))
    surface.save_vector(path["b"], numpy.concatenate([numpy.cos(numpy.arange(n)), numpy.zeros(m)]))
    return "-A %(A)s -C %(C)s -f %(f)s" % path, "-A %(K)s -f %(b)s" % path, m
