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

/* The point (t[0],t[1]) of the unit square whose image r = x - p(t) is shortest; tangents at it */
static PetscErrorCode ProjectOnFace(const PetscReal X[4][3], const PetscReal x[3], PetscReal t[2], PetscReal tangent[2][3], PetscReal *distance)
{
  PetscReal r[3], step = 0;

  PetscFunctionBeginUser;
  t[0] = t[1] = 0.5;
  for (int iteration = 0;; iteration++) {
    PetscReal gradient[2], H[2][2], d[2] = {0, 0}, det, twist;
    bool      held[2];

    for (int c = 0; c < 3; c++) {
      r[c]          = x[c] - (1 - t[1]) * ((1 - t[0]) * X[0][c] + t[0] * X[1][c]) - t[1] * ((1 - t[0]) * X[2][c] + t[0] * X[3][c]);
      tangent[0][c] = (1 - t[1]) * (X[1][c] - X[0][c]) + t[1] * (X[3][c] - X[2][c]);
      tangent[1][c] = (1 - t[0]) * (X[2][c] - X[0][c]) + t[0] * (X[3][c] - X[1][c]);
    }
    if (iteration && step < 1e-13) break;
    PetscCheck(iteration < 100, PETSC_COMM_SELF, PETSC_ERR_NOT_CONVERGED,
               "The orthogonal projection of the interface point (%g,%g,%g) on the lower body does not converge: take a smaller -curved, or a larger -n2", (double)x[0], (double)x[1],
               (double)x[2]);
    twist = 0;
    for (int c = 0; c < 3; c++) twist += r[c] * (X[0][c] - X[1][c] - X[2][c] + X[3][c]);
    for (int i = 0; i < 2; i++) {
      gradient[i] = -Dot(r, tangent[i]);
      held[i]     = (t[i] == 0 && gradient[i] > 0) || (t[i] == 1 && gradient[i] < 0);
    }
    H[0][0] = Dot(tangent[0], tangent[0]);
    H[1][1] = Dot(tangent[1], tangent[1]);
    H[0][1] = Dot(tangent[0], tangent[1]) - twist;
    if (H[0][0] * H[1][1] <= H[0][1] * H[0][1]) H[0][1] += twist; /* not convex here: Gauss-Newton, which is */
    H[1][0] = H[0][1];
    det     = H[0][0] * H[1][1] - H[0][1] * H[1][0];
    if (held[0] || held[1]) {
      for (int i = 0; i < 2; i++) {
        if (!held[i]) d[i] = -gradient[i] / H[i][i];
      }
    } else {
      d[0] = (H[0][1] * gradient[1] - H[1][1] * gradient[0]) / det;
      d[1] = (H[1][0] * gradient[0] - H[0][0] * gradient[1]) / det;
    }
    step = 0;
    for (int i = 0; i < 2; i++) {
      const PetscReal before = t[i];

      t[i] = PetscMin(1, PetscMax(0, t[i] + d[i]));
      step = PetscMax(step, PetscAbsReal(t[i] - before));
    }
  }
  *distance = PetscSqrtReal(Dot(r, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ProjectOnPrimary(const CubesMesh &mesh, const PetscReal x[3], Projection *best)
{
  const CubesBody &b    = mesh.body[0];
  PetscInt         face[2];
  PetscReal        norm;

  PetscFunctionBeginUser;
  /* the face below or above the point, and those around it: the surface is a graph over (x,y) and the point is close to it */
  for (int d = 0; d < 2; d++) face[d] = PetscMax(0, PetscMin(b.n[d] - 1, (PetscInt)std::floor(x[d] * b.n[d] + 1e-12)));
  best->distance = PETSC_MAX_REAL;
  for (int around = 0; around < 9; around++) { /* 4 is the middle one, taken first */
    const int       which = around == 0 ? 4 : around <= 4 ? around - 1 : around;
    const PetscInt  i = face[0] + which % 3 - 1, j = face[1] + which / 3 - 1;
    PetscReal       X[4][3], t[2], tangent[2][3], distance;
    PetscInt        node[4];
    const PetscReal tie = 1e-12 / b.n[0];

    if (i < 0 || j < 0 || i >= b.n[0] || j >= b.n[1]) continue;
    for (int c = 0; c < 4; c++) {
      node[c] = b.Node(i + (c & 1), j + (c >> 1), b.n[2]);
      mesh.Position(node[c], X[c]);
    }
    PetscCall(ProjectOnFace(X, x, t, tangent, &distance));
    if (distance >= best->distance - tie) continue;
    best->distance = distance;
    for (int d = 0; d < 2; d++) t[d] = Snap(t[d]);
    for (int c = 0; c < 4; c++) {
      best->node[c]   = node[c];
      best->weight[c] = ((c & 1) ? t[0] : 1 - t[0]) * ((c >> 1) ? t[1] : 1 - t[1]);
    }
    for (int c = 0; c < 3; c++) best->normal[c] = tangent[0][(c + 1) % 3] * tangent[1][(c + 2) % 3] - tangent[0][(c + 2) % 3] * tangent[1][(c + 1) % 3];
  }
  norm = PetscSqrtReal(Dot(best->normal, best->normal));
  for (int c = 0; c < 3; c++) best->normal[c] /= norm;
  PetscFunctionReturn(PETSC_SUCCESS);
}
