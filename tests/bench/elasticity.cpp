/* Linear isotropic elasticity on Q1 hexahedra: A and f, with the Dirichlet conditions eliminated symmetrically */
#include "cubes.h"
#include <array>
#include <cmath>

/* Corner, edge or node number c of a block of 2, 3, 2 or 3 points per direction is at (x,y,z): x runs fastest */
typedef std::array<std::array<PetscReal, 9>, 8> HexRow; /* the 3x3 blocks of one corner with all eight */

/* Derivatives of the eight shape functions at the eight Gauss points, on the reference cube [-1,1]^3 */
struct ShapeTable {
  PetscReal dN[8][8][3];

  ShapeTable()
  {
    const PetscReal point = 1 / std::sqrt((PetscReal)3);

    for (int q = 0; q < 8; q++) {
      for (int b = 0; b < 8; b++) {
        PetscReal s[3], v[3];

        for (int d = 0; d < 3; d++) {
          s[d] = (b >> d & 1) ? 1 : -1;
          v[d] = 1 + s[d] * ((q >> d & 1) ? point : -point);
        }
        for (int d = 0; d < 3; d++) dN[q][b][d] = s[d] * v[(d + 1) % 3] * v[(d + 2) % 3] / 8;
      }
    }
  }
};

/*
   Row `a` of blocks of the stiffness matrix of a hexahedron with corners X, by 2x2x2 Gauss points. The product of any
   two gradient components is formed first, so that the blocks (a,b) and (b,a) are transposed of each other to the last
   bit.
*/
static PetscErrorCode HexStiffnessRow(const PetscReal X[8][3], PetscReal lambda, PetscReal mu, int a, HexRow &K)
{
  static const ShapeTable shape;

  PetscFunctionBeginUser;
  for (auto &block : K) block.fill(0);
  for (int q = 0; q < 8; q++) {
    const auto &dN = shape.dN[q];
    PetscReal   G[8][3], J[3][3] = {}, I[3][3], det, l, m;

    for (int b = 0; b < 8; b++) {
      for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) J[i][j] += X[b][i] * dN[b][j];
      }
    }
    /* cofactors: I = det(J) J^{-1} */
    for (int i = 0; i < 3; i++) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;

      for (int j = 0; j < 3; j++)
        I[j][i] = J[i1][(j + 1) % 3] * J[i2][(j + 2) % 3] - J[i1][(j + 2) % 3] * J[i2][(j + 1) % 3];
    }
    det = J[0][0] * I[0][0] + J[0][1] * I[1][0] + J[0][2] * I[2][0];
    PetscCheck(
      det > 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
      "An element is turned inside out (Jacobian %g at a Gauss point): take a smaller -curved, or more elements",
      (double)det);
    for (int b = 0; b < 8; b++) {
      for (int i = 0; i < 3; i++) G[b][i] = (dN[b][0] * I[0][i] + dN[b][1] * I[1][i] + dN[b][2] * I[2][i]) / det;
    }
    l = lambda * det;
    m = mu * det;
    for (int b = 0; b < 8; b++) {
      PetscReal P[3][3], trace;

      for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) P[i][j] = G[a][i] * G[b][j];
      }
      trace = m * (P[0][0] + P[1][1] + P[2][2]);
      for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) K[b][3 * i + j] += l * P[i][j] + m * P[j][i] + (i == j ? trace : 0);
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void Lame(const CubesOptions &o, int body, PetscReal *lambda, PetscReal *mu)
{
  *lambda = o.E[body] * o.nu[body] / ((1 + o.nu[body]) * (1 - 2 * o.nu[body]));
  *mu     = o.E[body] / (2 * (1 + o.nu[body]));
}

/*
   The 27 nodes around a node and, between them, its rows of A: summed over its (up to eight) elements in their natural
   order, whatever the partition, so that A is the same to the last bit on any number of ranks. Nothing is sent: a rank
   computes all that its own nodes need.
*/
struct Patch {
  PetscInt                                 ijk[3];
  std::array<PetscInt, 27>                 node; /* natural numbers, -1 outside the body */
  std::array<std::array<PetscReal, 9>, 27> K;
};

static void PatchNodes(const CubesBody &b, PetscInt node, Patch &p)
{
  b.NodeIndices(node, p.ijk);
  for (int t = 0; t < 27; t++) {
    const PetscInt i = p.ijk[0] + t % 3 - 1, j = p.ijk[1] + t / 3 % 3 - 1, k = p.ijk[2] + t / 9 - 1;
    const bool     inside = i >= 0 && j >= 0 && k >= 0 && i <= b.n[0] && j <= b.n[1] && k <= b.n[2];

    p.node[t] = inside ? b.Node(i, j, k) : -1;
  }
}

/* `all` holds the rows of the one element of a body whose elements are all alike, NULL if they are not */
static PetscErrorCode PatchStiffness(const CubesMesh &mesh, int body, const std::array<HexRow, 8> *all, Patch &p)
{
  PetscReal X[27][3], lambda, mu;

  PetscFunctionBeginUser;
  Lame(mesh.options, body, &lambda, &mu);
  for (int t = 0; t < 27; t++) {
    p.K[t].fill(0);
    if (!all && p.node[t] >= 0) {
      PetscReal x[3];

      mesh.Position(p.node[t], x);
      mesh.Rotate(x, X[t]);
    }
  }
  for (int e = 0; e < 8; e++) { /* the element whose lowest corner is point (e&1, e>>1&1, e>>2) of the patch */
    const int lowest = (e & 1) + 3 * (e >> 1 & 1) + 9 * (e >> 2), a = 7 - e;
    HexRow    computed;
    int       t[8];

    for (int b = 0; b < 8; b++) t[b] = lowest + (b & 1) + 3 * (b >> 1 & 1) + 9 * (b >> 2);
    if (p.node[t[0]] < 0 || p.node[t[7]] < 0) continue;
    if (!all) {
      PetscReal corner[8][3];

      for (int b = 0; b < 8; b++) {
        for (int c = 0; c < 3; c++) corner[b][c] = X[t[b]][c];
      }
      PetscCall(HexStiffnessRow(corner, lambda, mu, a, computed));
    }
    for (int b = 0; b < 8; b++) {
      const auto &block = all ? (*all)[a][b] : computed[b];

      for (int c = 0; c < 9; c++) p.K[t[b]][c] += block[c];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of an element of a body that is a regular grid */
static PetscErrorCode RegularElement(const CubesMesh &mesh, int body, std::array<HexRow, 8> &rows)
{
  const CubesBody &b = mesh.body[body];
  PetscReal        X[8][3], lambda, mu;

  PetscFunctionBeginUser;
  Lame(mesh.options, body, &lambda, &mu);
  for (int c = 0; c < 8; c++) {
    const PetscReal x[3] = {(PetscReal)(c & 1) / b.n[0], (PetscReal)(c >> 1 & 1) / b.n[1],
                            mesh.options.height * (c >> 2) / b.n[2]};

    mesh.Rotate(x, X[c]);
  }
  for (int a = 0; a < 8; a++) PetscCall(HexStiffnessRow(X, lambda, mu, a, rows[a]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Exact: no allocation happens while A is filled, and no space is left */
static PetscErrorCode CreateStiffnessMatrix(const CubesMesh &mesh, Mat *A)
{
  const PetscInt        n = (PetscInt)mesh.owned.size();
  std::vector<PetscInt> diagonal(3 * n), other(3 * n, 0);
  Patch                 p;

  PetscFunctionBeginUser;
  PetscCheck(243.0 * n <= (double)PETSC_MAX_INT, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "%" PetscInt_FMT " nodes on one rank have more matrix entries than the largest integer of this PETSc; "
             "take more ranks or 64-bit indices",
             n);
  for (PetscInt i = 0; i < n; i++) {
    PetscInt here = 0, there = 0;

    if (mesh.Fixed(mesh.owned[i])) {
      for (int c = 0; c < 3; c++) diagonal[3 * i + c] = 1;
      continue;
    }
    PatchNodes(mesh.body[mesh.Body(mesh.owned[i])], mesh.owned[i], p);
    for (PetscInt node : p.node) {
      if (node < 0 || mesh.Fixed(node)) continue;
      if (mesh.Owns(node)) here += 3;
      else there += 3;
    }
    for (int c = 0; c < 3; c++) {
      diagonal[3 * i + c] = here;
      other[3 * i + c]    = there;
    }
  }
  PetscCall(MatCreate(mesh.comm, A));
  PetscCall(MatSetSizes(*A, 3 * n, 3 * n, 3 * mesh.nodes, 3 * mesh.nodes));
  PetscCall(MatSetBlockSize(*A, 3));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*A, 0, diagonal.data()));
  PetscCall(MatMPIAIJSetPreallocation(*A, 0, diagonal.data(), 0, other.data()));
  PetscCall(MatSetOption(*A, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The force on a node of the loaded top of a floating body: the traction E gamma / height (0.3, 0, -1), uniform, so
   that the solution depends neither on the mesh nor on the units
*/
static void NodalLoad(const CubesMesh &mesh, PetscInt node, PetscReal load[3])
{
  const CubesOptions &o = mesh.options;
  const CubesBody    &b = mesh.body[1];
  PetscReal           force[3], area = 1;
  PetscInt            ijk[3];

  b.NodeIndices(node, ijk);
  for (int d = 0; d < 2; d++) area *= (ijk[d] == 0 || ijk[d] == b.n[d] ? 0.5 : 1.0) / b.n[d];
  force[2] = -o.E[1] * o.gamma / o.height * area;
  force[0] = -0.3 * force[2];
  force[1] = 0;
  mesh.Rotate(force, load);
}

PetscErrorCode CubesAssembleElasticity(const CubesMesh &mesh, Mat *A, Vec *f)
{
  const PetscReal       down[3] = {0, 0, -mesh.options.gamma};
  const bool            regular = mesh.options.curved == 0;
  std::array<HexRow, 8> element[2];
  PetscReal             pushed[3];
  PetscScalar          *rhs;

  PetscFunctionBeginUser;
  PetscCall(CreateStiffnessMatrix(mesh, A));
  PetscCall(MatCreateVecs(*A, NULL, f));
  PetscCall(VecGetArrayWrite(*f, &rhs));
  mesh.Rotate(down, pushed);
  if (regular) {
    for (int i = 0; i < 2; i++) PetscCall(RegularElement(mesh, i, element[i]));
  }
  for (size_t i = 0; i < mesh.owned.size(); i++) {
    const PetscInt node = mesh.owned[i], row = 3 * mesh.number[node];
    const int      body   = mesh.Body(node);
    PetscReal      sum[3] = {0, 0, 0};
    PetscInt       columns[81], rows[3] = {row, row + 1, row + 2}, n = 0;
    PetscScalar    values[3 * 81];
    Patch          p;

    PatchNodes(mesh.body[body], node, p);
    PetscCall(PatchStiffness(mesh, body, regular ? &element[body] : NULL, p));
    if (mesh.Fixed(node)) { /* an uncoupled row whose solution is the imposed value; 13 is the node itself */
      for (int c = 0; c < 3; c++) {
        PetscCall(MatSetValue(*A, row + c, row + c, p.K[13][4 * c], INSERT_VALUES));
        rhs[3 * i + c] = body ? p.K[13][4 * c] * pushed[c] : 0.0;
      }
      continue;
    }
    if (mesh.options.floating && body && p.ijk[2] == mesh.body[1].n[2]) NodalLoad(mesh, node, sum);
    for (PetscInt other : p.node) {
      if (other >= 0 && !mesh.Fixed(other)) {
        for (int c = 0; c < 3; c++) columns[n++] = 3 * mesh.number[other] + c;
      }
    }
    for (int t = 0, at = 0; t < 27; t++) {
      if (p.node[t] < 0) continue;
      if (!mesh.Fixed(p.node[t])) {
        for (int r = 0; r < 3; r++) {
          for (int c = 0; c < 3; c++) values[r * n + at + c] = p.K[t][3 * r + c];
        }
        at += 3;
      } else if (body) {
        for (int r = 0; r < 3; r++)
          sum[r] -= p.K[t][3 * r] * pushed[0] + p.K[t][3 * r + 1] * pushed[1] + p.K[t][3 * r + 2] * pushed[2];
      }
    }
    for (int r = 0; r < 3; r++) rhs[3 * i + r] = sum[r];
    PetscCall(MatSetValues(*A, 3, rows, n, columns, values, INSERT_VALUES));
  }
  PetscCall(VecRestoreArrayWrite(*f, &rhs));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  /* a floating body makes A singular */
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  if (!mesh.options.floating && !mesh.options.free) PetscCall(MatSetOption(*A, MAT_SPD, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
