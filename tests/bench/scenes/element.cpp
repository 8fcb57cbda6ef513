/*
   The matrix of one cell, of elasticity or of heat: Q1, or the simplices of its Kuhn division, P1 or P2; and the same
   functions at a point
*/
#include "scene.h"
#include <algorithm>
#include <array>
#include <cmath>

/* Gradients of the functions of some nodes at one point, with the weight of that point */
struct Gradients {
  int       size, node[10]; /* local numbers in the cell */
  PetscReal G[10][3];
};

static void Add(const Scene &s, const Gradients &g, PetscReal weight, SceneCell &cell)
{
  const PetscReal nu = s.options.nu, mu = 1 / (2 * (1 + nu)), lambda = nu / ((1 + nu) * (1 - 2 * nu));

  for (int a = 0; a < g.size; a++) {
    for (int b = 0; b < g.size; b++) {
      PetscReal *K = cell.Block(g.node[a], g.node[b]), dot = 0;

      for (int d = 0; d < s.dim; d++) dot += g.G[a][d] * g.G[b][d];
      cell.joined[g.node[a] * cell.nodes + g.node[b]] = 1;
      if (s.physics == SCENE_HEAT) K[0] += weight * dot;
      else {
        for (int i = 0; i < s.dim; i++) {
          for (int j = 0; j < s.dim; j++)
            K[i * s.dim + j] += weight *
                                (lambda * g.G[a][i] * g.G[b][j] + mu * g.G[a][j] * g.G[b][i] + (i == j ? mu * dot : 0));
        }
      }
    }
  }
}

/* Inverse, transposed, of a dim x dim matrix; its determinant */
static PetscReal InverseTransposed(int dim, const PetscReal J[3][3], PetscReal I[3][3])
{
  PetscReal det = 0;

  if (dim == 2) {
    I[0][0] = J[1][1];
    I[0][1] = -J[1][0];
    I[1][0] = -J[0][1];
    I[1][1] = J[0][0];
  } else {
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++)
        I[i][j] = J[(i + 1) % 3][(j + 1) % 3] * J[(i + 2) % 3][(j + 2) % 3] -
                  J[(i + 1) % 3][(j + 2) % 3] * J[(i + 2) % 3][(j + 1) % 3];
    }
  }
  for (int j = 0; j < dim; j++) det += J[0][j] * I[0][j];
  for (int i = 0; i < dim; i++) {
    for (int j = 0; j < dim; j++) I[i][j] /= det;
  }
  return det;
}

/* By 2^dim Gauss points */
static PetscErrorCode AddBilinear(const Scene &s, const PetscReal corner[8][3], SceneCell &cell)
{
  const PetscReal point = 1 / std::sqrt((PetscReal)3);

  PetscFunctionBeginUser;
  for (int q = 0; q < 1 << s.dim; q++) {
    PetscReal dN[8][3], J[3][3] = {}, I[3][3], det;
    Gradients g;

    g.size = 1 << s.dim;
    for (int b = 0; b < g.size; b++) {
      for (int d = 0; d < s.dim; d++) {
        dN[b][d] = (b >> d & 1) ? 0.5 : -0.5;
        for (int e = 0; e < s.dim; e++) {
          if (e != d) dN[b][d] *= 0.5 * (1 + ((b >> e & 1) ? 1 : -1) * ((q >> e & 1) ? point : -point));
        }
        for (int i = 0; i < s.dim; i++) J[i][d] += corner[b][i] * dN[b][d];
      }
    }
    det = InverseTransposed(s.dim, J, I);
    PetscCheck(det > 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
               "A cell is turned inside out (Jacobian %g): take a smaller -bend", (double)det);
    for (int b = 0; b < g.size; b++) {
      g.node[b] = b;
      for (int i = 0; i < s.dim; i++) {
        g.G[b][i] = 0;
        for (int d = 0; d < s.dim; d++) g.G[b][i] += I[i][d] * dN[b][d];
      }
    }
    Add(s, g, det, cell);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Corners of a simplex of Kuhn's division as bits: from the lowest corner of the cell to the highest, one axis after
   another
*/
static void Corners(int dim, const int axes[3], int corner[4])
{
  corner[0] = 0;
  for (int d = 0; d < dim; d++) corner[d + 1] = corner[d] | 1 << axes[d];
}

/* Local number in a cell of order p of the point that is the mean of two corners (of one, taken twice) */
static int LocalNode(int dim, int order, int a, int b)
{
  int node = 0;

  for (int d = dim - 1; d >= 0; d--) node = node * (order + 1) + ((a >> d & 1) + (b >> d & 1)) * order / 2;
  return node;
}

/*
   Values and, from those of the barycentric coordinates L, gradients of the functions of a simplex: corners, then the
   middles of its edges
*/
static int SimplexFunctions(int dim, int order, const int corner[4], const PetscReal L[4], const PetscReal dL[4][3],
                            int node[10], PetscReal N[10], PetscReal G[10][3])
{
  int size = 0;

  for (int a = 0; a <= dim; a++) {
    node[size] = LocalNode(dim, order, corner[a], corner[a]);
    N[size]    = order == 1 ? L[a] : L[a] * (2 * L[a] - 1);
    for (int d = 0; d < dim; d++) G[size][d] = dL[a][d] * (order == 1 ? 1 : 4 * L[a] - 1);
    size++;
  }
  for (int a = 0; a <= dim && order == 2; a++) {
    for (int b = 0; b < a; b++) {
      node[size] = LocalNode(dim, order, corner[a], corner[b]);
      N[size]    = 4 * L[a] * L[b];
      for (int d = 0; d < dim; d++) G[size][d] = 4 * (L[a] * dL[b][d] + L[b] * dL[a][d]);
      size++;
    }
  }
  return size;
}

/* By dim+1 points a simplex, exact for P2 */
static PetscErrorCode AddSimplices(const Scene &s, int order, const PetscReal corner[8][3], SceneCell &cell)
{
  const int       dim     = s.dim;
  const PetscReal far     = (1 - 1 / std::sqrt((PetscReal)(dim + 2))) / (dim + 1);
  int             axes[3] = {0, 1, 2}, where[4];

  PetscFunctionBeginUser;
  do {
    PetscReal J[3][3], I[3][3], dL[4][3] = {}, N[10], det;

    Corners(dim, axes, where);
    for (int d = 0; d < dim; d++) {
      for (int i = 0; i < dim; i++) J[i][d] = corner[where[d + 1]][i] - corner[where[0]][i];
    }
    det = PetscAbsReal(InverseTransposed(dim, J, I));
    PetscCheck(det > 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "A simplex is flat: take a smaller -bend");
    for (int d = 0; d < dim; d++) {
      for (int i = 0; i < dim; i++) {
        dL[d + 1][i] = I[i][d];
        dL[0][i] -= I[i][d];
      }
    }
    for (int q = 0; q <= dim; q++) {
      PetscReal L[4];
      Gradients g;

      for (int a = 0; a <= dim; a++) L[a] = a == q ? 1 - dim * far : far;
      g.size = SimplexFunctions(dim, order, where, L, dL, g.node, N, g.G);
      Add(s, g, det / ((dim == 2 ? 2 : 6) * (dim + 1)), cell);
    }
  } while (std::next_permutation(axes, axes + dim));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneCellCreate(const Scene &s, const SceneBody &body, const PetscReal corner[8][3], SceneCell *cell)
{
  PetscFunctionBeginUser;
  cell->bs    = s.bs;
  cell->nodes = 1;
  for (int d = 0; d < s.dim; d++) cell->nodes *= body.order + 1;
  cell->K.assign((size_t)cell->nodes * cell->nodes * s.bs * s.bs, 0);
  cell->joined.assign((size_t)cell->nodes * cell->nodes, 0);
  if (s.options.element == SCENE_Q1) PetscCall(AddBilinear(s, corner, *cell));
  else PetscCall(AddSimplices(s, body.order, corner, *cell));
  for (int a = 0; a < cell->nodes; a++) { /* symmetric to the last bit */
    for (int b = 0; b <= a; b++) {
      for (int i = 0; i < s.bs; i++) {
        for (int j = 0; j < s.bs; j++) {
          PetscReal &here = cell->Block(a, b)[i * s.bs + j], &there = cell->Block(b, a)[j * s.bs + i];

          here = there = 0.5 * (here + there);
        }
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneInterpolate(const Scene &s, int which, const PetscReal box[3], SceneInterpolation *found)
{
  const SceneBody &b    = s.body[which];
  const PetscReal  tiny = 1e-12, none[4][3] = {};
  PetscInt         lowest[3] = {0, 0, 0};
  PetscReal        t[3]      = {0, 0, 0}, N[10], G[10][3];
  int              node[10], size = 0;

  PetscFunctionBeginUser;
  for (int d = 0; d < s.dim; d++) {
    const PetscReal at = (box[d] - b.lo[d]) / b.size[d] * b.n[d];

    lowest[d] = PetscMax(0, PetscMin(b.n[d] - 1, (PetscInt)std::floor(at + tiny)));
    t[d]      = at - lowest[d];
    if (t[d] < tiny) t[d] = 0; /* no weights like 1e-16 */
    if (t[d] > 1 - tiny) t[d] = 1;
  }
  if (s.options.element == SCENE_Q1) {
    for (size = 0; size < 1 << s.dim; size++) {
      node[size] = size;
      N[size]    = 1;
      for (int d = 0; d < s.dim; d++) N[size] *= (size >> d & 1) ? t[d] : 1 - t[d];
    }
  } else { /* in the simplex where the coordinates fall in the order of its axes */
    int       axes[3] = {0, 1, 2}, where[4];
    PetscReal L[4];

    std::stable_sort(axes, axes + s.dim, [&t](int d, int e) { return t[d] > t[e]; });
    Corners(s.dim, axes, where);
    for (int d = 0; d <= s.dim; d++) L[d] = (d ? t[axes[d - 1]] : 1) - (d < s.dim ? t[axes[d]] : 0);
    size = SimplexFunctions(s.dim, b.order, where, L, none, node, N, G);
  }
  found->size = 0;
  for (int a = 0; a < size; a++) {
    const int p = b.order + 1;

    if (PetscAbsReal(N[a]) < tiny) continue;
    found->node[found->size]     = b.Node(lowest[0] * b.order + node[a] % p, lowest[1] * b.order + node[a] / p % p,
                                          lowest[2] * b.order + node[a] / p / p);
    found->weight[found->size++] = N[a];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
