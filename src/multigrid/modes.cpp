#include "coarsen.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include <algorithm>

/* Checks that vectors of a near null space have n values on each rank. Collective */
static PetscErrorCode CheckSizes(MatNullSpace near, PetscInt nvec, const Vec vec[], PetscInt n)
{
  const MPI_Comm comm  = PetscObjectComm((PetscObject)near);
  PetscInt       first = PETSC_MAX_INT, local, wanted = n;

  PetscFunctionBegin;
  for (PetscInt c = nvec - 1; c >= 0; c--) {
    PetscCall(VecGetLocalSize(vec[c], &local));
    if (local != n) first = c;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &first, 1, MPIU_INT, MPI_MIN, comm));
  if (first == PETSC_MAX_INT) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetLocalSize(vec[first], &local));
  PetscCall(AinsworthFirstMismatch(comm, &local, &wanted));
  SETERRQ(comm, PETSC_ERR_ARG_SIZ,
          "Vector %" PetscInt_FMT " of the near null space has %" PetscInt_FMT
          " values on a rank, but the matrix has %" PetscInt_FMT
          " rows: call MatSetNearNullSpace() with vectors that have the layout of the matrix",
          first, local, wanted);
}

/*
   Takes the modes from a near null space, whose constant, if it has one, comes first; order: the local rows node by
   node, empty if they are stored so
*/
static PetscErrorCode FromNullSpace(MatNullSpace near, PetscInt n, const std::vector<PetscInt> &order,
                                    AinsworthModes *modes)
{
  PetscBool  constant;
  PetscInt   nvec;
  const Vec *vec;

  PetscFunctionBegin;
  PetscCall(MatNullSpaceGetVecs(near, &constant, &nvec, &vec));
  const PetscInt first = constant ? 1 : 0;
  modes->k             = nvec + first;
  modes->values.assign((size_t)n * modes->k, 1.0);
  PetscCall(CheckSizes(near, nvec, vec, n));
  for (PetscInt c = 0; c < nvec; c++) {
    const PetscScalar *v;

    PetscCall(VecGetArrayRead(vec[c], &v));
    for (PetscInt l = 0; l < n; l++) modes->values[(size_t)l * modes->k + first + c] = v[order.empty() ? l : order[l]];
    PetscCall(VecRestoreArrayRead(vec[c], &v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the rigid-body modes of the nodes at x; bs is the dimension of space, 2 or 3. Collective */
static PetscErrorCode FromCoordinates(MPI_Comm comm, PetscInt n, PetscInt bs, const PetscReal x[],
                                      AinsworthModes *modes)
{
  Vec          coordinates;
  MatNullSpace rigid;

  PetscFunctionBegin;
  PetscCall(VecCreateMPI(comm, n, PETSC_DETERMINE, &coordinates));
  PetscCall(VecSetBlockSize(coordinates, bs));
  PetscCall(AinsworthUpdate(coordinates, [x](PetscInt l, PetscScalar &v) { v = x[l]; }));
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, &rigid));
  PetscCall(FromNullSpace(rigid, n, {}, modes));
  PetscCall(MatNullSpaceDestroy(&rigid));
  PetscCall(VecDestroy(&coordinates));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthModesCreate - creates the near null space that interpolation preserves. Collective

   Input Parameters:
+  A     - the matrix
.  bs    - unknowns per node
.  order - its local rows node by node; empty if they are stored so
.  near  - the near null space that the program attached, or NULL
.  dim   - dimension of the coordinates, 0 without any
-  x     - coordinates of the local nodes, dim each

   Output Parameter:
.  modes - k values for each local unknown, node by node
*/
PetscErrorCode AinsworthModesCreate(Mat A, PetscInt bs, const std::vector<PetscInt> &order, MatNullSpace near,
                                    PetscInt dim, const PetscReal x[], AinsworthModes *modes)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  *modes = AinsworthModes();
  if (near) PetscCall(FromNullSpace(near, n, order, modes));
  if (modes->k > 0) {
    modes->origin = "the near null space of the matrix";
  } else if (dim == bs && (bs == 2 || bs == 3)) {
    PetscCall(FromCoordinates(PetscObjectComm((PetscObject)A), n, bs, x, modes));
    modes->origin = "rigid-body modes from coordinates";
  } else {
    modes->k = bs;
    modes->values.assign((size_t)n * bs, 0.0);
    for (PetscInt l = 0; l < n; l++) modes->values[(size_t)l * bs + l % bs] = 1.0;
    modes->origin    = "one constant per component";
    modes->rotations = bs == 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Counts, in sampled rows of A, those whose product with mode c is not small relative to its terms; count[k] is the
   number of sampled rows. Collective
*/
static PetscErrorCode CountUnfit(const AinsworthBlockMat &A, const std::vector<char> &held, const AinsworthModes &modes,
                                 std::vector<PetscInt> *count)
{
  const AinsworthBlockRows &rows = A.rows;
  const PetscInt            bs = rows.br, k = modes.k, step = PetscMax(1, rows.n / 256);
  AinsworthUnit             unit(bs * k, MPIU_SCALAR);
  std::vector<PetscScalar>  ghosts(A.cols.ghosts.size() * bs * k), sum(k);
  std::vector<PetscReal>    terms(k);

  PetscFunctionBegin;
  PetscCall(A.cols.toGhosts(unit.type, modes.values.data(), ghosts.data()));
  count->assign(k + 1, 0);
  for (PetscInt i = 0; i < rows.n; i += step) {
    const PetscScalar *a = A.row(i) - (size_t)rows.i[i] * rows.size();

    for (PetscInt r = 0; r < bs; r++) {
      if (held[i * bs + r]) continue;
      std::fill(sum.begin(), sum.end(), 0.0);
      std::fill(terms.begin(), terms.end(), 0.0);
      for (PetscInt e = rows.i[i]; e < rows.i[i + 1]; e++) {
        const PetscInt     j = rows.j[e];
        const PetscScalar *m = j < rows.n ? &modes.values[(size_t)j * bs * k] : &ghosts[(size_t)(j - rows.n) * bs * k];

        for (PetscInt q = 0; q < bs; q++)
          for (PetscInt c = 0; c < k; c++) {
            const PetscScalar term = a[(size_t)e * rows.size() + r * bs + q] * m[q * k + c];
            sum[c] += term;
            terms[c] += PetscAbsScalar(term);
          }
      }
      for (PetscInt c = 0; c < k; c++) (*count)[c] += PetscAbsScalar(sum[c]) > AinsworthModeSatisfied * terms[c];
      (*count)[k]++;
    }
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count->data(), (PetscMPIInt)(k + 1), MPIU_INT, MPI_SUM, A.cols.layout->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthModesFit - drops modes that are not in the near null space of A unless none is. Collective

   Rotations from wrong coordinates, or of unknowns that are not displacements, would only make the coarse levels
   larger. Next to held unknowns no mode is mapped to zero, so a mode is kept if it is mapped to zero in half of the
   rows; if no mode is, all are kept.
*/
PetscErrorCode AinsworthModesFit(const AinsworthBlockMat &A, const AinsworthBlockSurvey &survey, AinsworthModes *modes)
{
  const PetscInt           bs = A.rows.br, k = modes->k;
  std::vector<PetscInt>    count, fit;
  std::vector<PetscScalar> values;

  PetscFunctionBegin;
  PetscCall(CountUnfit(A, survey.held, *modes, &count));
  for (PetscInt c = 0; c < k; c++)
    if (2 * count[c] <= count[k]) fit.push_back(c);
  if (!fit.empty() && (PetscInt)fit.size() < k) {
    for (size_t l = 0; l < (size_t)A.rows.n * bs; l++)
      for (PetscInt c : fit) values.push_back(modes->values[l * k + c]);
    modes->values = std::move(values);
    modes->k      = (PetscInt)fit.size();
    modes->unfit  = k - modes->k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthModesHold - zeroes the modes at held unknowns, except those of carried nodes, which A does not know */
void AinsworthModesHold(const AinsworthBlockSurvey &survey, AinsworthModes *modes)
{
  const size_t bs = survey.held.size() / PetscMax(1, modes->carried.size());

  for (size_t l = 0; l < survey.held.size(); l++)
    if (survey.held[l] && !modes->carried[l / bs])
      std::fill_n(modes->values.begin() + (ptrdiff_t)(l * modes->k), modes->k, 0.0);
}
