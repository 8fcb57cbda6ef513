#include "saddle.h"
#include "../base/loops.h"
#include "../base/objects.h"

/*
   Finds the local rows of an AIJ matrix (may be NULL) with nonzero entries, and those with off-diagonal ones; bad:
   first row with NaN or Inf
*/
static PetscErrorCode FindNonzeroRows(Mat M, std::vector<char> *nonzero, std::vector<char> *coupled, PetscInt *bad)
{
  PetscFunctionBegin;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthForRows(M, [=](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++) {
      if (row.a[k] == 0.0) continue;
      (*nonzero)[row.local] = 1;
      if (coupled && row.j[k] != row.number) (*coupled)[row.local] = 1;
      if (PetscIsInfOrNanScalar(row.a[k]) && (*bad < 0 || row.number < *bad)) *bad = row.number;
    }
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Selects the kept rows of a matrix, and their columns as well if it is square */
static PetscErrorCode SelectRows(const AinsworthSaddle *sp, Mat all, PetscBool square, Mat *kept)
{
  PetscInt *index, n = 0;
  IS        rows;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(sp->local, &index));
  for (PetscInt i = 0; i < sp->local; i++)
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) index[n++] = sp->first + i;
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)all), n, index, PETSC_OWN_POINTER, &rows));
  PetscCall(MatCreateSubMatrix(all, rows, square ? rows : NULL, MAT_INITIAL_MATRIX, kept));
  PetscCall(ISDestroy(&rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Scales the rows of D to entries of about 1, and lambda with them, if squares of its entries would overflow

   C_i may become as small as 1e-150, which has little effect beside such a D_ii. Powers of 2 cause no rounding.
*/
static PetscErrorCode BalanceRows(AinsworthSaddle *sp)
{
  static const PetscReal large = 1e60; /* products of several such numbers, and of those of C, must be finite */
  PetscReal              most;

  PetscFunctionBegin;
  PetscCall(VecDestroy(&sp->balance));
  if (!sp->D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(sp->D, NULL, &sp->balance));
  PetscCall(MatGetRowMaxAbs(sp->D, sp->balance, NULL));
  if (PetscDefined(USE_COMPLEX)) PetscCall(VecRealPart(sp->balance));
  PetscCall(VecMax(sp->balance, NULL, &most));
  if (most <= large) {
    PetscCall(VecDestroy(&sp->balance));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthUpdate(sp->balance, [](PetscInt, PetscScalar &b) {
    b = PetscRealPart(b) > large ? PetscPowReal(2.0, -PetscFloorReal(0.5 * PetscLog2Real(PetscRealPart(b)))) : 1.0;
  }));
  for (Mat *M : {&sp->C, &sp->B, &sp->D}) {
    Mat copy;

    if (M == &sp->B && sp->rowsB == sp->rowsC) PetscCall(AinsworthShare(sp->C, &copy));
    else {
      PetscCall(MatDuplicate(*M, MAT_COPY_VALUES, &copy));
      PetscCall(MatDiagonalScale(copy, sp->balance, M == &sp->D ? sp->balance : NULL));
    }
    PetscCall(MatDestroy(M));
    *M = copy;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates sp->C, B and D from the matrices with all rows. Collective */
static PetscErrorCode SplitRows(AinsworthSaddle *sp)
{
  PetscInt count[AINSWORTH_ROW_KINDS] = {0}, rows, row, col = -1;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < sp->local; i++) count[sp->kind[i]]++;
  PetscCall(
    MPIU_Allreduce(count, sp->count, AINSWORTH_ROW_KINDS, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)sp->rowsC)));
  PetscCall(MatGetSize(sp->rowsC, &rows, NULL));
  for (Mat *M : {&sp->C, &sp->B, &sp->D}) PetscCall(MatDestroy(M));
  if (sp->count[AINSWORTH_ROW_CONSTRAINT] == rows) {
    PetscCall(AinsworthShare(sp->rowsC, &sp->C));
    PetscCall(AinsworthShare(sp->rowsB, &sp->B));
    PetscCall(AinsworthShare(sp->rowsD, &sp->D));
    PetscCall(BalanceRows(sp));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SelectRows(sp, sp->rowsC, PETSC_FALSE, &sp->C));
  if (sp->rowsB == sp->rowsC) PetscCall(AinsworthShare(sp->C, &sp->B));
  else PetscCall(SelectRows(sp, sp->rowsB, PETSC_FALSE, &sp->B));
  if (sp->rowsD) {
    PetscCall(SelectRows(sp, sp->rowsD, PETSC_TRUE, &sp->D));
    PetscCall(AinsworthMatFindEntry(sp->D, AinsworthIsNonzero, &row, &col));
    if (row < 0) PetscCall(MatDestroy(&sp->D));
  }
  PetscCall(BalanceRows(sp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleClassifyRows - decides how each row of the multiplier field is treated, and creates sp->C, B and D
   from the rows that are kept. Collective
*/
PetscErrorCode AinsworthSaddleClassifyRows(AinsworthSaddle *sp)
{
  const Mat Bs      = sp->rowsB == sp->rowsC ? NULL : sp->rowsB;
  Mat       columns = NULL;
  PetscInt  bad     = -1;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(sp->rowsC, &sp->first, NULL));
  PetscCall(MatGetLocalSize(sp->rowsC, &sp->local, NULL));
  PetscCall(PetscMalloc1(sp->local, &sp->kind));
  /* row, column: more than D_ii */
  std::vector<char> inC(sp->local), inB(sp->local), inRow(sp->local), inColumn(sp->local), row(sp->local),
    column(sp->local);

  if (sp->rowsD) PetscCall(MatTranspose(sp->rowsD, MAT_INITIAL_MATRIX, &columns));
  PetscCall(FindNonzeroRows(sp->rowsC, &inC, NULL, &bad));
  PetscCall(FindNonzeroRows(Bs, &inB, NULL, &bad));
  PetscCall(FindNonzeroRows(sp->rowsD, &inRow, &row, &bad));
  PetscCall(FindNonzeroRows(columns, &inColumn, &column, &bad));
  PetscCall(MatDestroy(&columns));
  for (PetscInt i = 0; i < sp->local; i++) {
    const bool acts = Bs ? inB[i] : inC[i];

    if (!inC[i] && !inRow[i]) sp->kind[i] = AINSWORTH_ROW_ZERO;
    else if (!inC[i] && !row[i]) sp->kind[i] = AINSWORTH_ROW_DECOUPLED;
    else if (!acts && inColumn[i] && !column[i]) sp->kind[i] = AINSWORTH_ROW_PASSIVE;
    else sp->kind[i] = AINSWORTH_ROW_CONSTRAINT;
  }
  PetscCall(AinsworthAgreeOnFirst(PetscObjectComm((PetscObject)sp->rowsC), &bad));
  if (bad >= 0)
    PetscCall(PetscSNPrintf(sp->bad, sizeof(sp->bad),
                            "row %" PetscInt_FMT " of C, or of the other blocks of the multipliers, holds NaN or Inf",
                            bad));
  else PetscCall(SplitRows(sp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks those local rows that are given by n numbers in sp->C, ascending, the same on all ranks */
static PetscErrorCode MarkKept(const AinsworthSaddle *sp, PetscInt n, const PetscInt numbers[],
                               std::vector<bool> *marked)
{
  PetscInt row, next = 0;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(sp->C, &row, NULL));
  while (next < n && numbers[next] < row) next++;
  for (PetscInt i = 0; i < sp->local; i++) {
    marked->push_back(sp->kind[i] == AINSWORTH_ROW_CONSTRAINT && next < n && row++ == numbers[next]);
    next += marked->back();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Drops n rows, as dependent or nearly so (kind), given by their numbers in sp->C, ascending, the same on all ranks.
   Collective
*/
PetscErrorCode AinsworthSaddleDropDependent(AinsworthSaddle *sp, PetscInt n, const PetscInt dependent[],
                                            AinsworthRowKind kind)
{
  std::vector<bool> marked;

  PetscFunctionBegin;
  PetscCall(MarkKept(sp, n, dependent, &marked));
  for (PetscInt i = 0; i < sp->local; i++)
    if (marked[i]) sp->kind[i] = kind;
  PetscCall(SplitRows(sp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Lists the marked local entries of all ranks, such as "3, 17, 20 and 37 more"; first: global number of the first local
   entry. Collective
*/
PetscErrorCode AinsworthNameMarked(MPI_Comm comm, PetscInt first, const std::vector<bool> &marked, char text[],
                                   size_t len)
{
  const int      shown = 5;
  const PetscInt local = (PetscInt)marked.size();
  PetscInt       total = 0, next = 0;
  char           part[48];

  PetscFunctionBegin;
  for (bool mark : marked) total += mark;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_INT, MPI_SUM, comm));
  text[0] = 0;
  for (int k = 0; k < PetscMin(total, shown); k++) {
    PetscInt row;

    while (next < local && !marked[next]) next++;
    row = next < local ? first + next : -1;
    PetscCall(AinsworthAgreeOnFirst(comm, &row));
    if (row == first + next) next++;
    PetscCall(PetscSNPrintf(part, sizeof(part), "%s%" PetscInt_FMT, k ? ", " : "", row));
    PetscCall(PetscStrlcat(text, part, len));
  }
  if (total > shown) {
    PetscCall(PetscSNPrintf(part, sizeof(part), " and %" PetscInt_FMT " more", total - shown));
    PetscCall(PetscStrlcat(text, part, len));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the marked local rows in the program's numbering of the multiplier field. Collective */
PetscErrorCode AinsworthSaddleNameRows(const AinsworthSaddle *sp, const std::vector<bool> &marked, char text[],
                                       size_t len)
{
  PetscFunctionBegin;
  PetscCall(AinsworthNameMarked(PetscObjectComm((PetscObject)sp->rowsC), sp->first, marked, text, len));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the rows of a kind. Collective */
PetscErrorCode AinsworthSaddleNameKind(const AinsworthSaddle *sp, AinsworthRowKind kind, char text[], size_t len)
{
  std::vector<bool> marked;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < sp->local; i++) marked.push_back(sp->kind[i] == kind);
  PetscCall(AinsworthSaddleNameRows(sp, marked, text, len));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists n rows given by their numbers in sp->C, as for AinsworthSaddleDropDependent(). Collective */
PetscErrorCode AinsworthSaddleNameKept(const AinsworthSaddle *sp, PetscInt n, const PetscInt numbers[], char text[],
                                       size_t len)
{
  std::vector<bool> marked;

  PetscFunctionBegin;
  PetscCall(MarkKept(sp, n, numbers, &marked));
  PetscCall(AinsworthSaddleNameRows(sp, marked, text, len));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Describes the rows that are not ordinary constraints, such as ", 2 zero rows left out, 3 decoupled rows solved alone"
*/
PetscErrorCode AinsworthSaddleDescribeRows(const AinsworthSaddle *sp, char text[], size_t len)
{
  static const char *const what[AINSWORTH_ROW_KINDS] = {"",
                                                        "zero rows left out",
                                                        "decoupled rows solved alone",
                                                        "rows without a column solved last",
                                                        "dependent rows left out",
                                                        "nearly dependent rows left out"};

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
