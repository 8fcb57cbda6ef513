#include "contact.h"

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
    for (int r = 0; r < size; r++) { /* whole nodes, of two unknowns each, as PETSc shares them out */
      const PetscInt nodes = c->size[f] / 2;

      number->first[f][r + 1] = number->first[f][r] + 2 * (nodes / size + (nodes % size > r));
      number->whole[r + 1] += number->first[f][r + 1];
    }
    c->local[f] = number->first[f][rank + 1] - number->first[f][rank];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The springs of one lattice of n x n nodes; the left edge of the left one is held */
static PetscErrorCode AddSprings(const Contact *c, PetscInt n, int field, const Numbering &number)
{
  const PetscInt side[4][2] = {
    {1,  0},
    {0,  1},
    {1,  1},
    {-1, 1}
  };
  const PetscScalar hold[4] = {1.0, 0.0, 0.0, 1.0};
  PetscMPIInt       rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (PetscInt node = number.first[field][rank] / 2; node < number.first[field][rank + 1] / 2; node++) {
    const PetscInt i = node / n, j = node % n, own[2] = {number(field, 2 * node), number(field, 2 * node + 1)};

    if (field == LEFT && i == 0) PetscCall(MatSetValues(c->whole, 2, own, 2, own, hold, ADD_VALUES));
    for (const PetscInt *d : side) {
      const PetscInt other = node + d[0] * n + d[1];
      PetscScalar    stiff[16], along[4] = {(PetscReal)d[0], (PetscReal)d[1], -(PetscReal)d[0], -(PetscReal)d[1]};

      if (i + d[0] < 0 || i + d[0] >= n || j + d[1] >= n) continue;
      const PetscInt ends[4] = {own[0], own[1], number(field, 2 * other), number(field, 2 * other + 1)};

      for (int k = 0; k < 16; k++) stiff[k] = (field == RIGHT ? 3.0 : 1.0) * along[k / 4] * along[k % 4] / (PetscReal)(d[0] * d[0] + d[1] * d[1]);
      PetscCall(MatSetValues(c->whole, 4, ends, 4, ends, stiff, ADD_VALUES));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Both components of the nodes of the edges, and zeros on the diagonal, as most programs store them */
static PetscErrorCode AddTies(const Contact *c, PetscInt n, const Numbering &number)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (PetscInt r = number.first[TIES][rank]; r < number.first[TIES][rank + 1]; r++) {
    const PetscInt    row = number(TIES, r), ends[2] = {number(LEFT, 2 * n * (n - 1) + r), number(RIGHT, r)};
    const PetscScalar pair[2] = {1.0, -1.0};

    PetscCall(MatSetValues(c->whole, 1, &row, 2, ends, pair, ADD_VALUES));
    PetscCall(MatSetValues(c->whole, 2, ends, 1, &row, pair, ADD_VALUES));
    PetscCall(MatSetValue(c->whole, row, row, 0.0, ADD_VALUES));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ContactCreate(PetscInt n, Contact *c)
{
  Numbering number;
  PetscInt  local = 0, at;

  PetscFunctionBeginUser;
  c->size[LEFT] = c->size[RIGHT] = 2 * n * n;
  c->size[TIES]                  = 2 * n;
  PetscCall(NumberingCreate(c, &number));
  for (PetscInt l : c->local) local += l;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, local, local, PETSC_DETERMINE, PETSC_DETERMINE, 20, NULL, 20, NULL, &c->whole));
  PetscCall(AddSprings(c, n, LEFT, number));
  PetscCall(AddSprings(c, n, RIGHT, number));
  PetscCall(AddTies(c, n, number));
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
    if (i == j) PetscCall(MatSetBlockSize(c->block[i][j], 2));
  }
  PetscCall(MatCreateSubMatrix(c->whole, c->primal, c->primal, MAT_INITIAL_MATRIX, &c->A));
  PetscCall(MatCreateSubMatrix(c->whole, c->is[TIES], c->primal, MAT_INITIAL_MATRIX, &c->C));
  PetscCall(MatCreateVecs(c->whole, &c->solution, &c->rhs));
  PetscCall(SetRandom(c->solution, 3));
  PetscCall(MatMult(c->whole, c->solution, c->rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ContactScaleTies(Contact *c, PetscScalar factor)
{
  Vec scale, part;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(c->rhs, &scale));
  PetscCall(VecSet(scale, 1.0));
  PetscCall(VecGetSubVector(scale, c->is[TIES], &part));
  PetscCall(VecSet(part, factor));
  PetscCall(VecRestoreSubVector(scale, c->is[TIES], &part));
  PetscCall(MatDiagonalScale(c->whole, scale, scale));
  PetscCall(VecDestroy(&scale));
  PetscCall(MatMult(c->whole, c->solution, c->rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ContactDestroy(Contact *c)
{
  PetscFunctionBeginUser;
  for (auto &row : c->block)
    for (Mat &M : row) PetscCall(MatDestroy(&M));
  for (IS &is : c->is) PetscCall(ISDestroy(&is));
  PetscCall(ISDestroy(&c->primal));
  for (Mat *M : {&c->whole, &c->A, &c->C}) PetscCall(MatDestroy(M));
  PetscCall(VecDestroy(&c->solution));
  PetscCall(VecDestroy(&c->rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}
