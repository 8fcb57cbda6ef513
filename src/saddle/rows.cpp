#include "saddle.h"
#include <limits>

/* All ranks: the smallest of the rows that the ranks found, -1 where none did; value is that of its owner */
static PetscErrorCode FirstRow(MPI_Comm comm, PetscInt *row, PetscReal *value)
{
  PetscInt first = *row < 0 ? std::numeric_limits<PetscInt>::max() : *row;

  PetscFunctionBegin;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &first, 1, MPIU_INT, MPI_MIN, comm));
  if (*row != first) *value = PETSC_MIN_REAL;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, value, 1, MPIU_REAL, MPIU_MAX, comm));
  *row = first == std::numeric_limits<PetscInt>::max() ? -1 : first;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The diagonal of the multipliers' block D, on the rows of C */
static PetscErrorCode GetDiagonal(AinsworthSaddle *sp, Mat D)
{
  Vec                d;
  const PetscScalar *a;
  PetscInt           local;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(D, NULL, &d));
  PetscCall(MatGetDiagonal(D, d));
  PetscCall(VecGetLocalSize(d, &local));
  PetscCall(PetscMalloc1(local, &sp->diag));
  PetscCall(VecGetArrayRead(d, &a));
  PetscCall(PetscArraycpy(sp->diag, a, local));
  PetscCall(VecRestoreArrayRead(d, &a));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of sp->all of one kind */
static PetscErrorCode SelectRows(const AinsworthSaddle *sp, AinsworthRowKind kind, Mat *C)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)sp->all);
  PetscInt *index, n = 0, cstart, cend;
  IS        rows, cols;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(sp->local, &index));
  for (PetscInt i = 0; i < sp->local; i++)
    if (sp->kind[i] == kind) index[n++] = sp->first + i;
  PetscCall(ISCreateGeneral(comm, n, index, PETSC_OWN_POINTER, &rows));
  PetscCall(MatGetOwnershipRangeColumn(sp->all, &cstart, &cend));
  PetscCall(ISCreateStride(comm, cend - cstart, cstart, 1, &cols));
  PetscCall(MatCreateSubMatrix(sp->all, rows, cols, MAT_INITIAL_MATRIX, C));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&cols));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sp->C and sp->left from sp->all */
static PetscErrorCode SplitRows(AinsworthSaddle *sp)
{
  PetscInt count[AINSWORTH_ROW_KINDS] = {0}, rows;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < sp->local; i++) count[sp->kind[i]]++;
  PetscCall(MPIU_Allreduce(count, sp->count, AINSWORTH_ROW_KINDS, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)sp->C)));
  PetscCall(MatGetSize(sp->all ? sp->all : sp->C, &rows, NULL));
  if (sp->count[AINSWORTH_ROW_CONSTRAINT] == rows) PetscFunctionReturn(PETSC_SUCCESS);
  if (!sp->all) sp->all = sp->C;
  else PetscCall(MatDestroy(&sp->C));
  PetscCall(SelectRows(sp, AINSWORTH_ROW_CONSTRAINT, &sp->C));
  for (AinsworthRowKind kind : {AINSWORTH_ROW_PENALISED, AINSWORTH_ROW_DEPENDENT}) {
    if (!sp->count[kind] || (sp->left[kind] && kind == AINSWORTH_ROW_PENALISED)) continue;
    PetscCall(MatDestroy(&sp->left[kind]));
    PetscCall(VecDestroy(&sp->part[kind]));
    PetscCall(SelectRows(sp, kind, &sp->left[kind]));
    PetscCall(MatCreateVecs(sp->left[kind], NULL, &sp->part[kind]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A + C_p' D^{-1} C_p, the rows p being those with d_i = -D_i < 0: docs/method.md */
static PetscErrorCode AugmentStiffness(AinsworthSaddle *sp)
{
  Mat          aij, A, adjoint, scaled, product;
  PetscScalar *w;
  PetscInt     n    = 0;
  Vec          root = sp->part[AINSWORTH_ROW_PENALISED];

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(root, &w));
  for (PetscInt i = 0; i < sp->local; i++)
    if (sp->kind[i] == AINSWORTH_ROW_PENALISED) w[n++] = 1.0 / PetscSqrtReal(-PetscRealPart(sp->diag[i]));
  PetscCall(VecRestoreArrayWrite(root, &w));
  PetscCall(MatDuplicate(sp->left[AINSWORTH_ROW_PENALISED], MAT_COPY_VALUES, &scaled));
  PetscCall(MatDiagonalScale(scaled, root, NULL));
  PetscCall(MatHermitianTranspose(scaled, MAT_INITIAL_MATRIX, &adjoint));
  PetscCall(MatMatMult(adjoint, scaled, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
  PetscCall(AinsworthGetAIJ(sp->A, &aij));
  PetscCall(MatDuplicate(aij, MAT_COPY_VALUES, &A));
  PetscCall(AinsworthAddAIJ(product, &A));
  PetscCall(MatDestroy(&aij));
  PetscCall(MatDestroy(&adjoint));
  PetscCall(MatDestroy(&scaled));
  PetscCall(MatDestroy(&product));
  PetscCall(MatDestroy(&sp->A));
  sp->A = A;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleClassifyRows - what becomes of each row of sp->C, all of whose rows are there yet

   D is the multipliers' own block, a diagonal matrix, or NULL. Rows that are not kept as constraints are taken out of sp->C.
*/
PetscErrorCode AinsworthSaddleClassifyRows(AinsworthSaddle *sp, Mat D)
{
  MPI_Comm  comm      = PetscObjectComm((PetscObject)sp->C);
  PetscInt  notFinite = -1, positive = -1, rend;
  PetscReal badValue = PETSC_MIN_REAL, positiveValue = PETSC_MIN_REAL;

  PetscFunctionBegin;
  if (D) PetscCall(GetDiagonal(sp, D));
  PetscCall(MatGetOwnershipRange(sp->C, &sp->first, &rend));
  sp->local = rend - sp->first;
  PetscCall(PetscMalloc1(sp->local, &sp->kind));
  for (PetscInt i = 0; i < sp->local; i++) {
    const PetscScalar  d = sp->diag ? sp->diag[i] : 0.0;
    PetscInt           ncols;
    const PetscScalar *v;
    PetscBool          zero = PETSC_TRUE, bad = PetscIsInfOrNanScalar(d) ? PETSC_TRUE : PETSC_FALSE;

    PetscCall(MatGetRow(sp->C, sp->first + i, &ncols, NULL, &v));
    for (PetscInt k = 0; k < ncols; k++) {
      if (v[k] != 0.0) zero = PETSC_FALSE;
      if (PetscIsInfOrNanScalar(v[k])) bad = PETSC_TRUE;
    }
    PetscCall(MatRestoreRow(sp->C, sp->first + i, &ncols, NULL, &v));
    if (bad && notFinite < 0) {
      notFinite = sp->first + i;
      badValue  = 0.0;
    }
    if (d == 0.0) sp->kind[i] = zero ? AINSWORTH_ROW_ZERO : AINSWORTH_ROW_CONSTRAINT;
    else sp->kind[i] = zero ? AINSWORTH_ROW_DECOUPLED : AINSWORTH_ROW_PENALISED;
    if (sp->kind[i] == AINSWORTH_ROW_PENALISED && !bad && positive < 0 && (PetscRealPart(d) > 0.0 || PetscImaginaryPart(d) != 0.0)) {
      positive      = sp->first + i;
      positiveValue = PetscRealPart(d);
    }
  }
  PetscCall(FirstRow(comm, &notFinite, &badValue));
  if (notFinite >= 0) {
    PetscCall(PetscSNPrintf(sp->bad, sizeof(sp->bad), "row %" PetscInt_FMT " of C, or its entry of the diagonal block of the multipliers, holds NaN or Inf",
                            notFinite));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(FirstRow(comm, &positive, &positiveValue));
  PetscCheck(positive < 0, comm, PETSC_ERR_ARG_WRONG,
             "The diagonal block of the multipliers holds %g in row %" PetscInt_FMT
             ", whose row of C is not zero: only real negative entries, [A C'; C -D], can be eliminated; change the sign, or leave the entry out",
             (double)positiveValue, positive);
  PetscCall(SplitRows(sp));
  if (sp->count[AINSWORTH_ROW_PENALISED]) PetscCall(AugmentStiffness(sp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes rows out of sp->C that depend on the others: n of them, by their number in sp->C, rising, the same on all ranks */
PetscErrorCode AinsworthSaddleDropDependent(AinsworthSaddle *sp, PetscInt n, const PetscInt dependent[])
{
  PetscInt row, next = 0;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(sp->C, &row, NULL));
  while (next < n && dependent[next] < row) next++;
  for (PetscInt i = 0; i < sp->local && next < n; i++) {
    if (sp->kind[i] != AINSWORTH_ROW_CONSTRAINT) continue;
    if (row++ != dependent[next]) continue;
    sp->kind[i] = AINSWORTH_ROW_DEPENDENT;
    next++;
  }
  PetscCall(SplitRows(sp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: "3, 17, 20 and 37 more", the marked ones of the local rows of all ranks, in the program's numbering of the multiplier field */
PetscErrorCode AinsworthSaddleNameRows(const AinsworthSaddle *sp, const PetscBool marked[], char text[], size_t len)
{
  const int shown = 5;
  PetscInt  total = 0, next = 0;
  MPI_Comm  comm = PetscObjectComm((PetscObject)sp->C);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < sp->local; i++) total += marked[i];
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_INT, MPI_SUM, comm));
  text[0] = 0;
  for (int k = 0; k < PetscMin(total, shown); k++) {
    PetscInt row;
    char     number[32];

    while (next < sp->local && !marked[next]) next++;
    row = next < sp->local ? sp->first + next : std::numeric_limits<PetscInt>::max();
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &row, 1, MPIU_INT, MPI_MIN, comm));
    if (row == sp->first + next) next++;
    PetscCall(PetscSNPrintf(number, sizeof(number), "%s%" PetscInt_FMT, k ? ", " : "", row));
    PetscCall(PetscStrlcat(text, number, len));
  }
  if (total > shown) {
    char more[48];

    PetscCall(PetscSNPrintf(more, sizeof(more), " and %" PetscInt_FMT " more", total - shown));
    PetscCall(PetscStrlcat(text, more, len));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ", 2 zero rows left out, 3 decoupled rows solved ..." for what is not an ordinary constraint */
PetscErrorCode AinsworthSaddleDescribeRows(const AinsworthSaddle *sp, char text[], size_t len)
{
  static const char *const what[AINSWORTH_ROW_KINDS] = {"", "zero rows left out", "decoupled rows solved alone", "rows with a diagonal entry eliminated",
                                                        "dependent rows left out"};

  PetscFunctionBegin;
  text[0] = 0;
  for (int kind = AINSWORTH_ROW_ZERO; kind < AINSWORTH_ROW_KINDS; kind++) {
    char part[96];

    if (!sp->count[kind]) continue;
    PetscCall(PetscSNPrintf(part, sizeof(part), ", %" PetscInt_FMT " %s", sp->count[kind], what[kind]));
    PetscCall(PetscStrlcat(text, part, len));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
