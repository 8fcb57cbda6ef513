"""Elimination: each row of C expresses one unknown, its slave, by others: x = T y + x0, with C T = 0 and C x0 = g."""
import numpy
from scipy import sparse

SMALL = 1e-12   # of the row before, relative: a row that depends on others is left with less
PIVOT = 0.9     # of the largest entry of its row, that of the slave


def eliminated(C, g):
    """T, whose rows of slaves have a stored zero on the diagonal, and x0.

    By Gauss and Jordan. Slaves are unknowns of few rows, so that the rows stay short; dependent rows are dropped.
    """
    C = C.tocsr()
    n = C.shape[1]
    rows = [dict(zip(C.indices[a:b].tolist(), C.data[a:b].tolist())) for a, b in zip(C.indptr, C.indptr[1:])]
    right = g.tolist()
    holders = [set() for _ in range(n)]   # the rows that an unknown is in
    for i, row in enumerate(rows):
        for j in [j for j, v in row.items() if v == 0.0]:
            del row[j]
        for j in row:
            holders[j].add(i)
    slaves = {}
    fewest = [min((len(holders[j]) for j in row), default=0) for row in rows]
    for i in sorted(range(len(rows)), key=lambda i: (fewest[i], len(rows[i]))):
        row, first = rows[i], numpy.abs(C.data[C.indptr[i]:C.indptr[i + 1]]).max(initial=0.0)
        largest = max((abs(v) for v in row.values()), default=0.0)
        if largest <= SMALL * first:
            for j in row:
                holders[j].discard(i)
            row.clear()
            continue
        slave = min((j for j, v in row.items() if abs(v) >= PIVOT * largest),
                    key=lambda j: (len(holders[j]), -abs(row[j])))
        pivot = row.pop(slave)
        for j in row:
            row[j] /= pivot
        right[i] /= pivot
        holders[slave].discard(i)
        slaves[slave] = i
        for other in holders[slave]:
            factor = rows[other].pop(slave)
            right[other] -= factor * right[i]
            for j, v in row.items():
                sum_ = rows[other].get(j, 0.0) - factor * v
                if abs(sum_) <= SMALL * abs(factor * v):
                    rows[other].pop(j, None)
                    holders[j].discard(other)
                else:
                    rows[other][j] = sum_
                    holders[j].add(other)
        holders[slave] = set()
    x0 = numpy.zeros(n)
    indptr, indices, data = numpy.zeros(n + 1, dtype=int), [], []
    for j in range(n):
        entries = {j: 1.0}
        if j in slaves:
            entries = {k: -v for k, v in rows[slaves[j]].items()}
            entries[j] = 0.0
            x0[j] = right[slaves[j]]
        for k in sorted(entries):
            indices.append(k)
            data.append(entries[k])
        indptr[j + 1] = len(indices)
    # not a sparse sum or product, which would drop the zeros
    T = sparse.csr_matrix((numpy.array(data), numpy.array(indices), indptr), shape=(n, n))
    return T, x0
