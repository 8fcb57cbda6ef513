/* Orthogonal projection on a surface of bilinear faces: Newton on each face nearby, and the closest of the answers */
#include "projection.h"
#include <cmath>

static PetscReal Dot(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* A coordinate within rounding of an edge is on the edge, so that no constraint has weights like 1e-16 */
static PetscReal Snap(PetscReal t)
{
  const PetscReal tiny = 1e-12;

  return t < tiny ? 0 : t > 1 - tiny ? 1 : t;
}

/* A bilinear face with corners X seen from a point x: where it is at t, its tangents, and r = x - p(t) */
struct Face {
  PetscReal X[4][3], x[3], t[2], r[3], tangent[2][3];

  void MoveTo(PetscReal t0, PetscReal t1)
  {
    t[0] = t0;
    t[1] = t1;
    for (int c = 0; c < 3; c++) {
      r[c]          = x[c] - (1 - t1) * ((1 - t0) * X[0][c] + t0 * X[1][c]) - t1 * ((1 - t0) * X[2][c] + t0 * X[3][c]);
      tangent[0][c] = (1 - t1) * (X[1][c] - X[0][c]) + t1 * (X[3][c] - X[2][c]);
      tangent[1][c] = (1 - t0) * (X[2][c] - X[0][c]) + t0 * (X[3][c] - X[1][c]);
    }
  }

  /* A step of Newton's method, if it stays on the face and comes no farther from x */
  bool Newton()
  {
    const PetscReal g[2] = {Dot(r, tangent[0]), Dot(r, tangent[1])}, before = Dot(r, r), t0 = t[0], t1 = t[1];
    PetscReal H00 = Dot(tangent[0], tangent[0]), H11 = Dot(tangent[1], tangent[1]), H01 = Dot(tangent[0], tangent[1]),
              det;
    PetscReal to[2];

    for (int c = 0; c < 3; c++) H01 -= r[c] * (X[0][c] - X[1][c] - X[2][c] + X[3][c]);
    det = H00 * H11 - H01 * H01;
    if (det <= 0) return false;
    to[0] = t0 + (H11 * g[0] - H01 * g[1]) / det;
    to[1] = t1 + (H00 * g[1] - H01 * g[0]) / det;
    if (to[0] < 0 || to[0] > 1 || to[1] < 0 || to[1] > 1) return false;
    MoveTo(to[0], to[1]);
    if (Dot(r, r) <= before) return true;
    MoveTo(t0, t1);
    return false;
  }

  /* The face is linear in each of its coordinates: the closest point along one of them is exact, and never farther */
  void Along(int i)
  {
    const PetscReal to = PetscMin(1, PetscMax(0, t[i] + Dot(r, tangent[i]) / Dot(tangent[i], tangent[i])));

    if (i) MoveTo(t[0], to);
    else MoveTo(to, t[1]);
  }
};

/* The closest point of the face, edges included */
static PetscErrorCode ProjectOnFace(Face &face)
{
  PetscReal step = 1;

  PetscFunctionBeginUser;
  face.MoveTo(0.5, 0.5);
  for (int iteration = 0; step > 1e-13; iteration++) {
    const PetscReal t[2] = {face.t[0], face.t[1]};

    PetscCheck(iteration < 1000, PETSC_COMM_SELF, PETSC_ERR_NOT_CONVERGED,
               "The orthogonal projection of the interface point (%g,%g,%g) on the lower body does not converge: take "
               "a smaller -curved, or a larger -n2",
               (double)face.x[0], (double)face.x[1], (double)face.x[2]);
    if (!face.Newton()) {
      face.Along(0);
      face.Along(1);
    }
    step = PetscMax(PetscAbsReal(face.t[0] - t[0]), PetscAbsReal(face.t[1] - t[1]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ProjectOnPrimary(const CubesMesh &mesh, const PetscReal x[3], Projection *best)
{
  const CubesBody &b = mesh.body[0];
  PetscInt         cell[2];
  PetscReal        norm;

  PetscFunctionBeginUser;
  /*
     the face below or above the point, and those around it: the surface is a graph over (x,y) and the point is close to
     it
  */
  for (int d = 0; d < 2; d++) cell[d] = PetscMax(0, PetscMin(b.n[d] - 1, (PetscInt)std::floor(x[d] * b.n[d] + 1e-12)));
  best->distance = PETSC_MAX_REAL;
  for (int around = 0; around < 9; around++) { /* 4 is the middle one, taken first */
    const int       which = around == 0 ? 4 : around <= 4 ? around - 1 : around;
    const PetscInt  i = cell[0] + which % 3 - 1, j = cell[1] + which / 3 - 1;
    const PetscReal tie = 1e-12 / b.n[0];
    PetscReal       distance;
    PetscInt        node[4];
    Face            face;

    if (i < 0 || j < 0 || i >= b.n[0] || j >= b.n[1]) continue;
    for (int c = 0; c < 4; c++) {
      node[c] = b.Node(i + (c & 1), j + (c >> 1), b.n[2]);
      mesh.Position(node[c], face.X[c]);
    }
    for (int c = 0; c < 3; c++) face.x[c] = x[c];
    PetscCall(ProjectOnFace(face));
    distance = PetscSqrtReal(Dot(face.r, face.r));
    if (distance >= best->distance - tie) continue;
    best->distance = distance;
    face.MoveTo(Snap(face.t[0]), Snap(face.t[1]));
    for (int c = 0; c < 4; c++) {
      best->node[c]   = node[c];
      best->weight[c] = ((c & 1) ? face.t[0] : 1 - face.t[0]) * ((c >> 1) ? face.t[1] : 1 - face.t[1]);
    }
    for (int c = 0; c < 3; c++)
      best->normal[c] = face.tangent[0][(c + 1) % 3] * face.tangent[1][(c + 2) % 3] -
                        face.tangent[0][(c + 2) % 3] * face.tangent[1][(c + 1) % 3];
  }
  norm = PetscSqrtReal(Dot(best->normal, best->normal));
  for (int c = 0; c < 3; c++) best->normal[c] /= norm;
  PetscFunctionReturn(PETSC_SUCCESS);
}
