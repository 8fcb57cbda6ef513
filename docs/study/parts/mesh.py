"""Meshes of tetrahedra from gmsh's OpenCASCADE kernel, with four nodes (P1) or ten (P2), and their surfaces."""
import numpy

EDGES = numpy.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
FACES = numpy.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def _mid_nodes():
    """Of each face the local numbers of its mid-side nodes, on the sides 01, 12 and 20."""
    number = {frozenset(edge): 4 + i for i, edge in enumerate(EDGES.tolist())}
    return numpy.array([[number[frozenset((face[i], face[(i + 1) % 3]))] for i in range(3)] for face in FACES.tolist()])


MID_NODES = _mid_nodes()


def tetrahedra(build, h, smallest=None, attempts=4):
    """Coordinates of the nodes, nodes of the tetrahedra, and the volume that each is in.

    build(occ) makes the geometry; h is the largest size of an element, smallest the least that is asked for. Where
    the mesher fails, it is asked for slightly smaller elements."""
    smallest = smallest or h / 3
    for attempt in range(attempts):
        try:
            return _generate(build, h * 0.97 ** attempt, smallest * 0.97 ** attempt)
        except Exception:  # gmsh raises no other kind
            if attempt == attempts - 1:
                raise


def _generate(build, h, smallest):
    import gmsh
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.add("part")
        build(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", h)
        gmsh.option.setNumber("Mesh.MeshSizeMin", smallest)
        gmsh.option.setNumber("Mesh.Algorithm3D", 1)
        gmsh.model.mesh.generate(3)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        elements = []
        for _, volume in gmsh.model.getEntities(3):
            nodes = gmsh.model.mesh.getElementsByType(4, volume)[1]
            elements.append((volume, numpy.array(nodes, dtype=int).reshape(-1, 4)))
    finally:
        gmsh.finalize()
    X = numpy.array(coordinates).reshape(-1, 3)
    T = numpy.vstack([nodes for _, nodes in elements])
    volumes = numpy.concatenate([numpy.full(len(nodes), volume) for volume, nodes in elements])
    used, T = numpy.unique(T, return_inverse=True)
    place = numpy.zeros(int(tags.max()) + 1, dtype=int)
    place[tags.astype(int)] = numpy.arange(len(tags))
    X, T = X[place[used]], T.reshape(-1, 4)
    negative = volume_of(X, T) < 0
    T[negative] = T[negative][:, [1, 0, 2, 3]]
    return X, T, volumes


def quadratic(X, T):
    """The same mesh with nodes in the middle of its edges."""
    edges = numpy.sort(T[:, EDGES].reshape(-1, 2), axis=1)
    key, number = numpy.unique(edges[:, 0] * len(X) + edges[:, 1], return_inverse=True)
    ends = X[key // len(X)], X[key % len(X)]
    return numpy.vstack([X, (ends[0] + ends[1]) / 2]), numpy.hstack([T, len(X) + number.reshape(-1, 6)])


def of_order(bodies, order):
    """Bodies (X, T, ...) of linear tetrahedra in the order that is asked for."""
    return [quadratic(*body[:2]) if order == 2 else body[:2] for body in bodies]


def together(bodies):
    """One mesh of several bodies (X, T), and the body that each tetrahedron is in."""
    first = numpy.cumsum([0] + [len(X) for X, _ in bodies])
    return (numpy.vstack([X for X, _ in bodies]), numpy.vstack([T + start for (_, T), start in zip(bodies, first)]),
            numpy.concatenate([numpy.full(len(T), i) for i, (_, T) in enumerate(bodies)]))


def split(X, T, upper):
    """Two bodies of one, apart along the faces between the tetrahedra that are upper and the others."""
    shared = numpy.intersect1d(T[upper], T[~upper])
    copy = numpy.arange(len(X))
    copy[shared] = len(X) + numpy.arange(len(shared))
    T = T.copy()
    T[upper] = copy[T[upper]]
    return numpy.vstack([X, X[shared]]), T


def volume_of(X, T):
    """Signed volumes of tetrahedra."""
    P = X[T[:, :4]]
    return numpy.linalg.det(P[:, 1:] - P[:, :1]) / 6


def quality(X, T):
    """Of each tetrahedron 12 (3 volume)^(2/3) / (sum of the squared edges): 1 if it is regular, 0 if it is flat."""
    P = X[T[:, :4]]
    lengths = ((P[:, EDGES[:, 0]] - P[:, EDGES[:, 1]]) ** 2).sum(axis=(1, 2))
    return 12 * (3 * numpy.abs(volume_of(X, T))) ** (2 / 3) / lengths


def surface(T):
    """Triangles of the boundary: three corners, and with P2 three mid-side nodes."""
    corners = T[:, FACES].reshape(-1, 3)
    ordered = numpy.sort(corners, axis=1)
    n = int(ordered.max()) + 1
    key = (ordered[:, 0] * n + ordered[:, 1]) * n + ordered[:, 2]
    _, first, count = numpy.unique(key, return_index=True, return_counts=True)
    outer = numpy.sort(first[count == 1])
    if T.shape[1] == 4:
        return corners[outer]
    return numpy.hstack([corners[outer], T[(outer // 4)[:, None], MID_NODES[outer % 4]]])


def on(S, condition):
    """The triangles whose corners all fulfill a condition, which is given at the nodes."""
    return S[condition[S[:, :3]].all(axis=1)]


def areas(X, S):
    """Areas of triangles."""
    return numpy.linalg.norm(numpy.cross(X[S[:, 1]] - X[S[:, 0]], X[S[:, 2]] - X[S[:, 0]]), axis=1) / 2


def nodal_areas(X, S, positive=False):
    """Shares of the nodes in the area of triangles, as a uniform pressure is shared.

    The corners of P2 get none, unless they have to be positive: then as for a lumped mass matrix."""
    share = numpy.full(3, 1 / 3)
    if S.shape[1] == 6:
        share = numpy.repeat([1 / 12, 1 / 4] if positive else [0, 1 / 3], 3)
    w = numpy.zeros(len(X))
    numpy.add.at(w, S, areas(X, S)[:, None] * share)
    return w


def nodal_volumes(X, T, density=1.0):
    """Shares of the nodes in the volume, as gravity is shared but without the negative shares of P2's corners."""
    nodes = T[:, -6:] if T.shape[1] == 10 else T
    w = numpy.zeros(len(X))
    numpy.add.at(w, nodes, (density * volume_of(X, T) / nodes.shape[1])[:, None])
    return w
