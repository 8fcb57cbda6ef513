"""A part: the saddle-point system [A B'; C -D][u; lambda] = [f; g] of a constrained, unstructured mesh."""
from dataclasses import dataclass, replace

import numpy
from scipy import sparse

from . import elasticity, mesh


@dataclass
class Part:
    """Unknowns: three displacements of each node, then the extra ones (reference nodes, pretension, mean strain)."""
    A: sparse.csr_matrix
    C: sparse.csr_matrix   # supports are among the rows
    D: sparse.csr_matrix   # or None
    f: numpy.ndarray
    g: numpy.ndarray
    X: numpy.ndarray       # (nodes, 3)
    extra: int
    clamp: numpy.ndarray   # nodes that, held at rest, make the part without its constraints nonsingular
    modes: numpy.ndarray   # (unknowns, 6): rigid motions, with those of the reference nodes
    stiffness: sparse.csr_matrix  # of the nodes, before any is fixed
    rigid: numpy.ndarray   # of each row, how far from rigid motions it may be: the gap of a tie, infinity for supports
    added: int             # dependent rows at the end
    quality: numpy.ndarray  # of the tetrahedra
    B: sparse.csr_matrix = None  # where it is not C
    contact: tuple = None         # where the rows are those of contact, C u <= g: slack and force in the solution

    def flexibility(self):
        """Of A under each row."""
        stiff = self.A.diagonal()
        stiff = numpy.where(stiff > 0, stiff, numpy.median(stiff[stiff > 0]))
        return self.C.power(2) @ (1 / stiff)

    def joined(self, low, high, seed=1):
        """The same with springs: D is 10^low to 10^high times the flexibility of A under each row, at random."""
        decades = numpy.random.default_rng(seed).uniform(low, high, self.C.shape[0])
        return replace(self, D=sparse.diags(self.flexibility() * 10.0**decades).tocsr())

    def central(self, decade):
        """Contact's system in an interior-point method, D = slack / force, for its step to the solution, g = slack.

        The central path, slack * force = mu, is at 10^decade times the largest force and depth. Of each row alone:
        slack - flexibility * force is that of the solution.
        """
        slack, force = self.contact
        c = self.flexibility()
        mu = 10.0**decade * force.max() * abs(self.g).max()
        apart = numpy.where(force > 0, -c * force, slack)
        root = numpy.sqrt(apart**2 + 4 * c * mu)
        slack = numpy.where(apart > 0, (root + apart) / 2, 2 * c * mu / (root - apart))  # without cancellation
        return replace(self, D=sparse.diags(slack**2 / mu).tocsr(), g=slack)

    def oblique(self, share, seed=1):
        """The same with a B that is not C: each column is off by at most this share, so that dependent rows remain so.
        """
        scale = 1 + share * numpy.random.default_rng(seed).uniform(-1, 1, self.C.shape[1])
        return replace(self, B=(self.C @ sparse.diags(scale)).tocsr())

    def clamped(self):
        """A and f without constraints, extra unknowns and the nodes of clamp; the unknowns that are left.

        Where all of the load is on those, the others get a random one."""
        left = numpy.ones(len(self.f), dtype=bool)
        left[3 * len(self.X):] = False
        left[unknowns(self.clamp).ravel()] = False
        left = numpy.flatnonzero(left)
        f = self.f[left] if self.f[left].any() else numpy.random.default_rng(1).standard_normal(len(left))
        return self.A[left][:, left].tocsr(), f, left


def unknowns(nodes):
    """Numbers of the displacements of nodes, (nodes, 3)."""
    return 3 * numpy.asarray(nodes)[:, None] + numpy.arange(3)


def crosses(d):
    """Of each vector d the matrix that takes a rotation t to the displacement t x d."""
    zero = numpy.zeros(len(d))
    x, y, z = d.T
    return numpy.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=1).reshape(-1, 3, 3)


def bisection(X, leaf=64):
    """An order of points by recursive coordinate bisection: consecutive ones are close to each other."""
    order, ready = [], [numpy.arange(len(X))]
    while ready:
        some = ready.pop()
        if len(some) <= leaf:
            order.append(some)
            continue
        axis = numpy.argmax(numpy.ptp(X[some], axis=0))
        some = some[numpy.argsort(X[some, axis], kind="stable")]
        ready += [some[len(some) // 2:], some[:len(some) // 2]]
    return numpy.concatenate(order)


class Model:
    """Collects stiffness, loads, supports and rows of constraints."""

    def __init__(self, X, T, E, nu):
        self.X, self.T = X, T
        self.K = elasticity.solid(X, T, E, nu)
        self.n = 3 * len(X)
        self.f = numpy.zeros(self.n)
        self.fixed = numpy.zeros(0, dtype=int)
        self.extra_modes = numpy.zeros((0, 6))
        self.entries, self.rigid, self.g, self.d = [], [], [], []
        self.m = 0
        self.added = 0

    # Unknowns beside the displacements of the mesh

    def nodes(self, X, K):
        """More nodes of a stiffness of their own; before any other extra unknown."""
        self.X, self.n = numpy.vstack([self.X, X]), self.n + 3 * len(X)
        self.K = sparse.block_diag([self.K, K]).tocsr()
        self.f = numpy.concatenate([self.f, numpy.zeros(3 * len(X))])

    def unknowns(self, count, modes=None):
        """Extra unknowns, which rigid motions leave at zero unless their modes are given; the first one's number."""
        first = self.n
        self.extra_modes = numpy.vstack([self.extra_modes, numpy.zeros((count, 6)) if modes is None else modes])
        self.f = numpy.concatenate([self.f, numpy.zeros(count)])
        self.n += count
        return first

    def reference(self, point):
        """A reference node, with three displacements and three rotations; the number of its first unknown."""
        return self.unknowns(6, rigid_modes(numpy.atleast_2d(point), rotations=True))

    # Rows of constraints

    def rows(self, columns, values, g=0.0, rigid=0.0, compliance=0.0):
        """Rows values * u[columns] - compliance * lambda = g; columns and values: (rows, entries).

        rigid: how far from rigid motions they may be, see Part."""
        columns, values = numpy.broadcast_arrays(numpy.atleast_2d(columns), numpy.atleast_2d(values))
        number = numpy.repeat(numpy.arange(len(columns)), columns.shape[1])
        entries = (values.ravel(), (number, columns.ravel()))
        self.matrix(sparse.coo_matrix(entries, (len(columns), self.n)), g, rigid, compliance)

    def matrix(self, rows, g=0.0, rigid=0.0, compliance=0.0):
        """Rows of a sparse matrix, as rows()."""
        rows = rows.tocoo()
        self.entries.append((rows.row + self.m, rows.col, rows.data))
        for kept, values in ((self.g, g), (self.d, compliance), (self.rigid, rigid)):
            kept.append(numpy.broadcast_to(values, rows.shape[0]).astype(float))
        self.m += rows.shape[0]

    def tie(self, slaves, nodes, weights, directions=numpy.eye(3), turn=numpy.eye(3), **more):
        """Of each slave node directions (u - turn sum weights u[nodes]) = 0, a row for each direction."""
        for direction in numpy.atleast_2d(directions):
            own = numpy.broadcast_to(direction, (len(slaves), 1, 3))
            others = -weights[:, :, None] * (direction @ turn)
            values = numpy.concatenate([own, others], axis=1).reshape(len(slaves), -1)
            columns = unknowns(numpy.hstack([slaves[:, None], nodes]).ravel()).reshape(len(slaves), -1)
            used = numpy.abs(values).max(axis=0, initial=0) > 1e-12
            self.rows(columns[:, used], values[:, used], **more)

    def rbe3(self, weights, reference):
        """The reference node moves as the weighted mean of the nodes that have weights does."""
        nodes = numpy.flatnonzero(weights)
        weights = weights[nodes] / weights.sum()
        point = self.point(reference)
        center = weights @ self.X[nodes]
        M = crosses(self.X[nodes] - center)
        inertia = numpy.einsum("n,nia,nib->ab", weights, M, M)
        rotation = numpy.einsum("ab,n,nib->ani", numpy.linalg.inv(inertia), weights, M)  # t = sum rotation u
        offset = crosses(numpy.atleast_2d(point - center))[0]
        for a in range(3):  # u_ref = mean of u + t x offset
            row = numpy.einsum("b,bni->ni", offset[a], rotation)
            row[:, a] += weights
            self.rows(numpy.append(unknowns(nodes), reference + a), numpy.append(row, -1.0))
            self.rows(numpy.append(unknowns(nodes), reference + 3 + a), numpy.append(rotation[a], -1.0))

    def rbe2(self, nodes, reference):
        """Nodes move with the reference node as a rigid body."""
        M = crosses(self.X[nodes] - self.point(reference))
        one = numpy.ones(len(nodes))
        for a in range(3):
            others = [b for b in range(3) if b != a]
            columns = [3 * nodes + a] + [numpy.full(len(nodes), reference + b) for b in [a] + [3 + b for b in others]]
            self.rows(numpy.stack(columns, axis=1), numpy.stack([one, -one] + [-M[:, a, b] for b in others], axis=1))

    def point(self, reference):
        """Where a reference node is: its modes say so, t x point."""
        modes = self.extra_modes[reference - 3 * len(self.X):]
        return numpy.array([modes[1, 5], modes[2, 3], modes[0, 4]])

    def support(self, numbers):
        """Unknowns held at zero by rows."""
        self.rows(numpy.asarray(numbers).reshape(-1, 1), 1.0, rigid=numpy.inf)

    def careless(self, share=0.01):
        """Rows said twice: copies, multiples and sums of rows."""
        random = numpy.random.default_rng(1)
        C, g = self.constraints()
        count = max(3, int(share * self.m))
        i, j = random.integers(0, self.m, (2, count))
        kind = numpy.arange(count) % 3
        first, second = numpy.where(kind == 1, -2.0, 1.0), numpy.where(kind == 2, 1.0, 0.0)
        B = (sparse.diags(first) @ C[i] + sparse.diags(second) @ C[j]).tocoo()
        rigid = numpy.concatenate(self.rigid)
        self.matrix(B, first * g[i] + second * g[j], 2 * numpy.maximum(rigid[i], rigid[j]))
        self.added += count

    def constraints(self):
        """C and g."""
        rows, columns, values = (numpy.concatenate(some) for some in zip(*self.entries))
        C = sparse.csr_matrix((values, (rows, columns)), (self.m, self.n))
        C.data[numpy.abs(C.data) < 1e-13] = 0
        C.eliminate_zeros()
        return C, numpy.concatenate(self.g)

    # Loads

    def load(self, w, force):
        """A force, shared by the nodes as w is."""
        nodes = numpy.flatnonzero(w)
        numpy.add.at(self.f, unknowns(nodes), w[nodes, None] / w.sum() * numpy.asarray(force, dtype=float))

    # The whole

    def part(self, clamp):
        """Nodes that are fixed are eliminated from A and C, and all are numbered by bisection."""
        C, g = self.constraints()
        d, rigid = numpy.concatenate(self.d), numpy.concatenate(self.rigid)
        C, touched = without(C, unknowns(self.fixed).ravel())
        rigid[touched] = numpy.inf
        left = numpy.diff(C.indptr) > 0
        C, g, d, rigid = C[left], g[left], d[left], rigid[left]
        A, f = eliminate(self.K, self.fixed), self.f.copy()
        f[unknowns(self.fixed).ravel()] = 0
        nodes = bisection(self.X)
        N = 3 * len(self.X)
        order = numpy.concatenate([unknowns(nodes).ravel(), numpy.arange(N, self.n)])
        if self.n > N:
            A = sparse.block_diag([A, sparse.csr_matrix((self.n - N, self.n - N))])
        A, C = A.tocsr()[order][:, order], C[:, order]
        for M in (A, C):
            M.sort_indices()
        return Part(A, C, sparse.diags(d).tocsr() if d.any() else None, f[order], g, self.X[nodes], self.n - N,
                    numpy.unique(numpy.argsort(nodes)[clamp]),
                    numpy.vstack([rigid_modes(self.X[nodes]), self.extra_modes]),
                    self.K[order[:N]][:, order[:N]], rigid, self.added, mesh.quality(self.X, self.T))


def without(C, columns):
    """C without the entries of these columns; the rows that had any."""
    kept = numpy.ones(C.shape[1])
    kept[columns] = 0
    touched = abs(C) @ (1 - kept) > 0
    C = (C @ sparse.diags(kept)).tocsr()
    C.eliminate_zeros()
    return C, touched


def eliminate(K, nodes):
    """Nodes held at zero: rows and columns of the identity, times a stiffness."""
    if not len(nodes):
        return K
    fixed = numpy.zeros(K.shape[0], dtype=bool)
    fixed[unknowns(nodes).ravel()] = True
    left = sparse.diags((~fixed).astype(float))
    K = (left @ K @ left + sparse.diags(numpy.where(fixed, numpy.median(K.diagonal()), 0.0))).tocsr()
    K.eliminate_zeros()
    return K


def rigid_modes(X, rotations=False):
    """Three translations and three rotations of nodes, which have three rotations of their own if asked for."""
    count = 6 if rotations else 3
    modes = numpy.zeros((len(X), count, 6))
    modes[:, :3, :3] = numpy.eye(3)
    modes[:, :3, 3:] = crosses(X)
    if rotations:
        modes[:, 3:, 3:] = numpy.eye(3)
    return modes.reshape(-1, 6)
