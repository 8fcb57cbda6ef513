"""What has to hold for every part, without any solver of PETSc."""
import numpy
from scipy import sparse


def check(part):
    """Figures of a part, as a dictionary; an AssertionError where something does not hold."""
    A, C, R = part.A, part.C, part.modes
    K, N = part.stiffness, 3 * len(part.X)
    size = abs(A).max()
    assert abs(A - A.T).max() < 1e-12 * size, "A is not symmetric"
    assert A.shape[0] == N + part.extra == len(part.f) and C.shape == (len(part.g), A.shape[0])
    strain = numpy.abs(K @ R[:N]).max(axis=0) / (abs(K) @ numpy.abs(R[:N])).max(axis=0)
    assert strain.max() < 1e-12, "rigid motions have energy: %g" % strain.max()
    jump = numpy.abs(C @ R)
    scale = abs(C) @ numpy.abs(R)
    ties = numpy.isfinite(part.rigid)
    assert (jump[ties, :3] <= 1e-10 * scale[ties, :3].max(initial=1)).all(), "C does not annihilate translations"
    allowed = 1e-9 * scale[ties, 3:].max(initial=1) + part.rigid[ties, None]
    assert (jump[ties, 3:] <= allowed).all(), "C does not annihilate rotations"
    assert numpy.isfinite(A.data).all() and numpy.isfinite(C.data).all() and numpy.isfinite(part.f).all()
    assert numpy.diff(C.indptr).min() > 0, "an empty row"
    return {"unknowns": A.shape[0], "extra": part.extra, "rows": C.shape[0], "added": part.added,
            "supports": int((~ties).sum()), "longest": int(numpy.diff(C.indptr).max()), "nonzeros": A.nnz,
            "quality": round(float(part.quality.min()), 3), "clamp": len(part.clamp)}


def solve(part, steps=30):
    """x and lambda by SuperLU, with a little compliance against dependent rows that refinement takes away again."""
    from scipy.sparse.linalg import splu
    A, C = part.A, part.C
    D = sparse.csr_matrix((C.shape[0],) * 2) if part.D is None else part.D
    typical = numpy.median(A.diagonal()[A.diagonal() > 0])
    dx = numpy.where(A.diagonal() > 0, 1 / numpy.sqrt(numpy.maximum(A.diagonal(), 1e-30)), 1 / numpy.sqrt(typical))
    S = sparse.diags(dx)
    dl = 1 / numpy.sqrt((C @ S).multiply(C @ S).sum(axis=1).A1)
    L = sparse.diags(dl)
    B = L @ C @ S
    K = sparse.bmat([[S @ A @ S, B.T], [B, -(L @ D @ L) - 1e-9 * sparse.eye(len(dl))]]).tocsc()
    factor = splu(K)
    x, l = numpy.zeros(len(dx)), numpy.zeros(len(dl))
    for _ in range(steps):
        r = numpy.concatenate([dx * (part.f - A @ x - C.T @ l), dl * (part.g - C @ x + D @ l)])
        step = factor.solve(r)
        x, l = x + dx * step[:len(dx)], l + dl * step[len(dx):]
        if numpy.abs(dx * step[:len(dx)]).max() < 1e-12 * numpy.abs(x).max():
            break
    return x, l
