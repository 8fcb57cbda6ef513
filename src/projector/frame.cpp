#include "frame.h"
#include "../saddle/saddle.h"
#include <algorithm>
#include <cmath>
#include <vector>

static const PetscReal dominance = 0.02; /* of the largest eigenvalue over the second, relative: below, no direction stands out */
static const PetscReal alignment = 1e-3; /* radians from an axis: closer, components are separated already */

/* Eigenvalues, descending, and the eigenvector of the largest, of a small symmetric matrix: cyclic Jacobi rotations */
static void LargestEigenvector(PetscInt n, PetscReal N[3][3], PetscReal values[3], PetscReal vector[3])
{
  PetscReal V[3][3] = {
    {1, 0, 0},
    {0, 1, 0},
    {0, 0, 1}
  };
  PetscInt order[3] = {0, 1, 2};

  for (int sweep = 0; sweep < 30; sweep++) {
    for (PetscInt p = 0; p < n; p++) {
      for (PetscInt q = p + 1; q < n; q++) {
        const PetscReal theta = 0.5 * std::atan2(2 * N[p][q], N[p][p] - N[q][q]), c = std::cos(theta), s = std::sin(theta);

        for (PetscInt k = 0; k < n; k++) {
          const PetscReal a = N[k][p], b = N[k][q], v = V[k][p], w = V[k][q];
          N[k][p] = c * a + s * b;
          N[k][q] = c * b - s * a;
          V[k][p] = c * v + s * w;
          V[k][q] = c * w - s * v;
        }
        for (PetscInt k = 0; k < n; k++) {
          const PetscReal a = N[p][k], b = N[q][k];
          N[p][k] = c * a + s * b;
          N[q][k] = c * b - s * a;
        }
      }
    }
  }
  std::sort(order, order + n, [N](PetscInt a, PetscInt b) { return N[a][a] > N[b][b]; });
  for (PetscInt k = 0; k < n; k++) {
    values[k] = N[order[k]][order[k]];
    vector[k] = V[k][order[0]];
  }
}

/*
   AinsworthFrameChoose - the rotation that turns the dominant contact normal onto the nearest axis, by the smallest angle

   The normal is the eigenvector of the largest eigenvalue of sum n n' / |c|^2 over the node blocks n of the rows c of C. Rows that hold all
   components of a node (stick) add a multiple of the identity and do not count. No rotation where no direction dominates, where the
   normal lies on an axis already, or where the unknowns are no displacements in 2 or 3 dimensions.
*/
PetscErrorCode AinsworthFrameChoose(Mat C, PetscInt bs, AinsworthFrame *frame)
{
  PetscReal N[3][3] = {{0}}, values[3], n[3], sign, axis = 0.0;
  PetscInt  rstart, rend, cstart, cend, a                = 0;

  PetscFunctionBegin;
  frame->bs = 0;
  PetscCall(MatGetOwnershipRangeColumn(C, &cstart, &cend));
  if (bs != 2 && bs != 3) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRange(C, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt           ncols;
    const PetscInt    *cols;
    const PetscScalar *v;
    PetscReal          square = 0.0;

    PetscCall(MatGetRow(C, i, &ncols, &cols, &v));
    for (PetscInt k = 0; k < ncols; k++) square += PetscSqr(PetscAbsScalar(v[k]));
    for (PetscInt k = 0; k < ncols; k++)
      for (PetscInt l = 0; l < ncols; l++)
        if (cols[k] / bs == cols[l] / bs) N[cols[k] % bs][cols[l] % bs] += PetscRealPart(v[k] * PetscConj(v[l])) / square;
    PetscCall(MatRestoreRow(C, i, &ncols, &cols, &v));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, N, 9, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)C)));
  LargestEigenvector(bs, N, values, n);
  if (!(values[0] - values[1] > dominance * values[0])) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < bs; k++) {
    if (std::abs(n[k]) > axis + 1e-8) { /* with a margin, so that ranks and builds agree on ties */
      axis = std::abs(n[k]);
      a    = k;
    }
  }
  if (std::acos(std::min(axis, (PetscReal)1.0)) < alignment) PetscFunctionReturn(PETSC_SUCCESS);
  sign = n[a] > 0 ? 1.0 : -1.0;
  for (PetscInt k = 0; k < bs; k++) frame->normal[k] = n[k] = sign * n[k];
  /* the rotation by the angle between n and the axis e in their common plane: T = I - (n+e)(n+e)'/(1+n.e) + 2 e n' */
  for (PetscInt k = 0; k < bs; k++) {
    for (PetscInt l = 0; l < bs; l++) {
      const PetscReal nk = n[k] + (k == a), nl = n[l] + (l == a);
      frame->T[k][l] = (k == l) - nk * nl / (1.0 + n[a]) + 2.0 * (k == a) * n[l];
    }
  }
  frame->bs = bs;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C' with the rows of C scaled to length 1 */
static PetscErrorCode CreateUnitTranspose(Mat C, Mat *Ct)
{
  Mat          unit;
  Vec          length;
  PetscInt     m;
  PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(C, NULL, &length));
  PetscCall(AinsworthRowSums(C, 2, length));
  PetscCall(VecGetLocalSize(length, &m));
  PetscCall(VecGetArray(length, &v));
  for (PetscInt i = 0; i < m; i++) v[i] = PetscRealPart(v[i]) > 0.0 ? 1.0 / PetscSqrtReal(PetscRealPart(v[i])) : 0.0;
  PetscCall(VecRestoreArray(length, &v));
  PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &unit));
  PetscCall(MatDiagonalScale(unit, length, NULL));
  PetscCall(VecDestroy(&length));
  PetscCall(MatHermitianTranspose(unit, MAT_INITIAL_MATRIX, Ct));
  PetscCall(MatDestroy(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Are the components of every node constrained apart from each other: is the block of the node in C' C, with rows of length 1, diagonal up to a
   hundredth of its square? Multigrid that interpolates component by component can then satisfy the constraints on its coarse levels; where
   components are mixed it cannot, and a large penalty locks.
*/
PetscErrorCode AinsworthFrameComponentsApart(Mat C, PetscInt bs, PetscBool *apart)
{
  Mat                                   Ct;
  PetscInt                              rstart, rend;
  PetscBool                             here = PETSC_TRUE;
  std::vector<std::vector<PetscInt>>    columns(bs);
  std::vector<std::vector<PetscScalar>> values(bs);

  PetscFunctionBegin;
  *apart = PETSC_TRUE;
  if (bs == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(CreateUnitTranspose(C, &Ct));
  PetscCall(MatGetOwnershipRange(Ct, &rstart, &rend));
  for (PetscInt first = rstart; first + bs <= rend && here; first += bs) {
    PetscReal trace = 0.0, mixed = 0.0;

    for (PetscInt k = 0; k < bs; k++) {
      PetscInt           n;
      const PetscInt    *c;
      const PetscScalar *v;

      PetscCall(MatGetRow(Ct, first + k, &n, &c, &v));
      columns[k].assign(c, c + n);
      values[k].assign(v, v + n);
      PetscCall(MatRestoreRow(Ct, first + k, &n, &c, &v));
      for (const PetscScalar &value : values[k]) trace += PetscSqr(PetscAbsScalar(value));
    }
    for (PetscInt k = 0; k < bs; k++) {
      for (PetscInt l = 0; l < k; l++) {
        PetscScalar dot = 0.0;
        for (size_t a = 0, b = 0; a < columns[k].size() && b < columns[l].size();) {
          if (columns[k][a] == columns[l][b]) dot += values[k][a++] * PetscConj(values[l][b++]);
          else if (columns[k][a] < columns[l][b]) a++;
          else b++;
        }
        mixed += 2.0 * PetscSqr(PetscAbsScalar(dot));
      }
    }
    here = (PetscBool)(mixed <= 0.01 * PetscSqr(trace));
  }
  PetscCall(MatDestroy(&Ct));
  PetscCall(MPIU_Allreduce(&here, apart, 1, MPIU_BOOL, MPI_LAND, PetscObjectComm((PetscObject)C)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x <- T x, or T' x, at every node */
PetscErrorCode AinsworthFrameRotate(const AinsworthFrame *frame, PetscBool transpose, Vec x)
{
  const PetscInt bs = frame->bs;
  PetscReal      T[3][3];
  PetscScalar   *v;
  PetscInt       n;

  PetscFunctionBegin;
  if (!bs) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < bs; k++)
    for (PetscInt l = 0; l < bs; l++) T[k][l] = transpose ? frame->T[l][k] : frame->T[k][l];
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArray(x, &v));
  if (bs == 3) {
    for (PetscScalar *p = v; p < v + n; p += 3) {
      const PetscScalar a = p[0], b = p[1], c = p[2];
      p[0] = T[0][0] * a + T[0][1] * b + T[0][2] * c;
      p[1] = T[1][0] * a + T[1][1] * b + T[1][2] * c;
      p[2] = T[2][0] * a + T[2][1] * b + T[2][2] * c;
    }
  } else {
    for (PetscScalar *p = v; p < v + n; p += 2) {
      const PetscScalar a = p[0], b = p[1];
      p[0] = T[0][0] * a + T[0][1] * b;
      p[1] = T[1][0] * a + T[1][1] * b;
    }
  }
  PetscCall(VecRestoreArray(x, &v));
  PetscCall(PetscLogFlops(n * (2.0 * bs - 1)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of C seen in the frame, C T', m x n AIJ; C itself without a rotation */
PetscErrorCode AinsworthFrameRotateRows(const AinsworthFrame *frame, Mat C, Mat *rotated)
{
  const PetscInt           bs = frame->bs;
  PetscInt                 rstart, rend, m, n, M, N;
  std::vector<PetscInt>    start(1, 0), columns;
  std::vector<PetscScalar> values;

  PetscFunctionBegin;
  if (!bs) {
    PetscCall(PetscObjectReference((PetscObject)C));
    *rotated = C;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetOwnershipRange(C, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt           ncols;
    const PetscInt    *cols;
    const PetscScalar *v;

    PetscCall(MatGetRow(C, i, &ncols, &cols, &v)); /* ascending: entries of a node stand together */
    for (PetscInt k = 0; k < ncols; k++) {
      const PetscInt node = cols[k] / bs;
      if (columns.size() == (size_t)start.back() || columns.back() / bs != node) {
        for (PetscInt l = 0; l < bs; l++) columns.push_back(node * bs + l);
        values.resize(columns.size(), 0.0);
      }
      for (PetscInt l = 0; l < bs; l++) values[values.size() - bs + l] += frame->T[l][cols[k] % bs] * v[k];
    }
    PetscCall(MatRestoreRow(C, i, &ncols, &cols, &v));
    start.push_back((PetscInt)columns.size());
  }
  PetscCall(MatGetLocalSize(C, &m, &n));
  PetscCall(MatGetSize(C, &M, &N));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)C), rotated));
  PetscCall(MatSetSizes(*rotated, m, n, M, N));
  PetscCall(MatSetType(*rotated, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(*rotated, start.data(), columns.data(), values.data()));
  PetscCall(MatMPIAIJSetPreallocationCSR(*rotated, start.data(), columns.data(), values.data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The vectors of a (near) null space seen in the frame; the same null space without a rotation. A tells the layout */
PetscErrorCode AinsworthFrameRotateNullSpace(const AinsworthFrame *frame, Mat A, MatNullSpace nullsp, MatNullSpace *rotated)
{
  PetscBool        constant;
  PetscInt         nv;
  const Vec       *given;
  std::vector<Vec> v;

  PetscFunctionBegin;
  if (!frame->bs) {
    PetscCall(PetscObjectReference((PetscObject)nullsp));
    *rotated = nullsp;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatNullSpaceGetVecs(nullsp, &constant, &nv, &given));
  v.resize(nv + (constant ? 1 : 0));
  for (size_t i = 0; i < v.size(); i++) {
    PetscCall(MatCreateVecs(A, &v[i], NULL));
    if (i < (size_t)nv) PetscCall(VecCopy(given[i], v[i]));
    else {
      PetscCall(VecSet(v[i], 1.0));
      PetscCall(VecNormalize(v[i], NULL));
    }
    PetscCall(AinsworthFrameRotate(frame, PETSC_FALSE, v[i]));
  }
  PetscCall(MatNullSpaceCreate(PetscObjectComm((PetscObject)A), PETSC_FALSE, (PetscInt)v.size(), v.data(), rotated));
  for (Vec &vec : v) PetscCall(VecDestroy(&vec));
  PetscFunctionReturn(PETSC_SUCCESS);
}
