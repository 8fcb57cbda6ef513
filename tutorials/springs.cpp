#include "springs.h"
#include <vector>

/* Numbers of the unknowns of a field in the whole */
struct Numbering {
  std::vector<PetscInt> first[FIELDS], whole;

  PetscInt operator()(int field, PetscInt i) const
  {
    size_t   rank = 0;
    PetscInt at;

    while (i >= first[field][rank + 1]) rank++;
    at = whole[rank] + i - first[field][rank];
    for (int f = 0; f < field; f++) at += first[f][rank + 1] - first[f][rank];
    return at;
  }
};

static PetscErrorCode NumberingCreate(Contact *c, Numbering *number)
{
  PetscMPIInt size, rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  number->whole.assign(size + 1, 0);
  for (int f = 0; f < FIELDS; f++) {
    number->first[f].assign(size + 1, 0);
    for (int r = 0; r < size; r++) { /* whole nodes, as PETSc shares them out */
      const PetscInt nodes = c->size[f] / c->dim;

      number->first[f][r + 1] = number->first[f][r] + c->dim * (nodes / size + (nodes % size > r));
      number->whole[r + 1] += number->first[f][r + 1];
    }
    c->local[f] = number->first[f][rank + 1] - number->first[f][rank];
  }
  PetscFunctionReturn((PetscErrorCode)0);
}

/* The springs of one lattice, from each node to those around it; the left side of the left one is held */
static PetscErrorCode AddSprings(const Contact *c, int field, const Numbering &number)
{
  const PetscInt dim = c->dim, n = c->n, around = dim == 2 ? 9 : 27;
  PetscMPIInt    rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (PetscInt node = number.first[field][rank] / dim; node < number.first[field][rank + 1] / dim; node++) {
    PetscInt at[3], ends[6];

    for (PetscInt d = dim - 1, rest = node; d >= 0; d--, rest /= n) at[d] = rest % n;
    for (PetscInt d = 0; d < dim; d++) ends[d] = number(field, dim * node + d);
    for (PetscInt d = 0; d < dim && field == LEFT && at[0] == 0; d++)
      PetscCall(MatSetValue(c->whole, ends[d], ends[d], 1.0, ADD_VALUES));
    for (PetscInt side = around / 2 + 1; side < around; side++) { /* the other half is that of the other ends */
      PetscInt    other  = 0;
      PetscReal   length = 0.0;
      PetscScalar stiff[36], along[6];
      bool        inside = true;

      for (PetscInt d = 0, digit = around / 3; d < dim; d++, digit /= 3) {
        const PetscInt step = side / digit % 3 - 1;

        inside         = inside && at[d] + step >= 0 && at[d] + step < n;
        other          = n * other + at[d] + step;
        along[d]       = (PetscReal)step;
        along[dim + d] = -(PetscReal)step;
        length += PetscSqr((PetscReal)step);
      }
      if (!inside) continue;
      for (PetscInt d = 0; d < dim; d++) ends[dim + d] = number(field, dim * other + d);
      for (PetscInt k = 0; k < 4 * dim * dim; k++)
        stiff[k] = (field == RIGHT ? 3.0 : 1.0) * along[k / (2 * dim)] * along[k % (2 * dim)] / length;
      PetscCall(MatSetValues(c->whole, 2 * dim, ends, 2 * dim, ends, stiff, ADD_VALUES));
    }
  }
  PetscFunctionReturn((PetscErrorCode)0);
}

/* All components of the nodes of the sides that meet, and zeros on the diagonal, as most programs store them */
static PetscErrorCode AddTies(const Contact *c, const Numbering &number)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (PetscInt r = number.first[TIES][rank]; r < number.first[TIES][rank + 1]; r++) {
    const PetscInt row = number(TIES, r), ends[2] = {number(LEFT, c->size[LEFT] - c->size[TIES] + r), number(RIGHT, r)};
    const PetscScalar pair[2] = {1.0, -1.0};

    PetscCall(MatSetValues(c->whole, 1, &row, 2, ends, pair, ADD_VALUES));
    PetscCall(MatSetValues(c->whole, 2, ends, 1, &row, pair, ADD_VALUES));
    PetscCall(MatSetValue(c->whole, row, row, 0.0, ADD_VALUES));
  }
  PetscFunctionReturn((PetscErrorCode)0);
}

PetscErrorCode ContactCreate(PetscInt dim, PetscInt n, Contact *c)
{
  Numbering number;
  PetscInt  local = 0, at, side = dim == 2 ? n : n * n, entries = dim == 2 ? 20 : 84;

  PetscFunctionBeginUser;
  PetscCheck(dim == 2 || dim == 3, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE,
             "The bodies have 2 or 3 dimensions, not %" PetscInt_FMT, dim);
  c->dim        = dim;
  c->n          = n;
  c->size[TIES] = dim * side;
  c->size[LEFT] = c->size[RIGHT] = n * c->size[TIES];
  PetscCall(NumberingCreate(c, &number));
  for (PetscInt l : c->local) local += l;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, local, local, PETSC_DETERMINE, PETSC_DETERMINE, entries, NULL, entries, NULL,
                         &c->whole));
  PetscCall(AddSprings(c, LEFT, number));
  PetscCall(AddSprings(c, RIGHT, number));
  PetscCall(AddTies(c, number));
  PetscCall(MatAssemblyBegin(c->whole, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->whole, MAT_FINAL_ASSEMBLY));
  PetscCall(MatGetOwnershipRange(c->whole, &at, NULL));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, c->local[LEFT] + c->local[RIGHT], at, 1, &c->primal));
  for (int f = 0; f < FIELDS; f++) {
    PetscCall(ISCreateStride(PETSC_COMM_WORLD, c->local[f], at, 1, &c->is[f]));
    at += c->local[f];
  }
  for (int k = 0; k < FIELDS * FIELDS; k++) {
    const int i = k / FIELDS, j = k % FIELDS;

    if (i == j ? i == TIES : i != TIES && j != TIES) continue;
    PetscCall(MatCreateSubMatrix(c->whole, c->is[i], c->is[j], MAT_INITIAL_MATRIX, &c->block[i][j]));
    if (i == j) PetscCall(MatSetBlockSize(c->block[i][j], dim));
  }
  PetscCall(MatCreateSubMatrix(c->whole, c->primal, c->primal, MAT_INITIAL_MATRIX, &c->A));
  PetscCall(MatCreateSubMatrix(c->whole, c->is[TIES], c->primal, MAT_INITIAL_MATRIX, &c->C));
  PetscFunctionReturn((PetscErrorCode)0);
}

PetscErrorCode ContactDestroy(Contact *c)
{
  PetscFunctionBeginUser;
  for (auto &row : c->block)
    for (Mat &M : row) PetscCall(MatDestroy(&M));
  for (IS &is : c->is) PetscCall(ISDestroy(&is));
  PetscCall(ISDestroy(&c->primal));
  for (Mat *M : {&c->whole, &c->A, &c->C}) PetscCall(MatDestroy(M));
  PetscFunctionReturn((PetscErrorCode)0);
}
