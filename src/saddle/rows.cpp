#include "saddle.h"
#include "../base/layouts.h"
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

/* Selects rows of C, B and D, and with them the columns of D. Collective */
static PetscErrorCode SelectRows(IS rows, AinsworthRowBlocks *kept)
{
  const AinsworthRowBlocks from = *kept;
  PetscInt                 row, col = -1;

  PetscFunctionBegin;
  PetscCall(MatCreateSubMatrix(from.C, rows, NULL, MAT_INITIAL_MATRIX, kept->C.out()));
  if (from.B == from.C) kept->B = kept->C;
  else PetscCall(MatCreateSubMatrix(from.B, rows, NULL, MAT_INITIAL_MATRIX, kept->B.out()));
  if (!from.D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateSubMatrix(from.D, rows, rows, MAT_INITIAL_MATRIX, kept->D.out()));
  PetscCall(AinsworthMatFindEntry(kept->D, AinsworthIsNonzero, &row, &col));
  if (row < 0) kept->D.reset();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Scales the rows of D to entries of about 1, and lambda with them, if squares of its entries would overflow

   C_i may become as small as 1e-150, which has little effect beside such a D_ii. Powers of 2 cause no rounding.
*/
static PetscErrorCode BalanceRows(AinsworthRowBlocks *kept, AinsworthRef<Vec> *balance)
{
  static const PetscReal large = 1e60; /* products of several such numbers, and of those of C, must be finite */
  const bool             same  = kept->B == kept->C;
  AinsworthRef<Vec>      factors;
  PetscReal              most;

  PetscFunctionBegin;
  if (!kept->D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateVecs(kept->D, NULL, factors.out()));
  PetscCall(MatGetRowMaxAbs(kept->D, factors, NULL));
  if (PetscDefined(USE_COMPLEX)) PetscCall(VecRealPart(factors));
  PetscCall(VecMax(factors, NULL, &most));
  if (most <= large) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthUpdate(factors, [](PetscInt, PetscScalar &b) {
    b = PetscRealPart(b) > large ? PetscPowReal(2.0, -PetscFloorReal(0.5 * PetscLog2Real(PetscRealPart(b)))) : 1.0;
  }));
  for (AinsworthRef<Mat> *M : {&kept->C, &kept->B, &kept->D}) {
    const AinsworthRef<Mat> given = *M;

    if (M == &kept->B && same) continue;
    PetscCall(MatDuplicate(given, MAT_COPY_VALUES, M->out()));
    PetscCall(MatDiagonalScale(*M, factors, M == &kept->D ? (Vec)factors : NULL));
  }
  if (same) kept->B = kept->C;
  *balance = factors;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Copies A, or the block of Pmat, for a solver without constraints, if the program's does not store its diagonal or
   does not know its block size; to AIJ if the block size is part of the type
*/
static PetscErrorCode CompleteAlone(PetscInt bs, AinsworthRef<Mat> *A)
{
  PetscInt          given;
  PetscBool         aij;
  Mat               M;
  AinsworthRef<Mat> copy;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)*A, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (aij) {
    PetscCall(AinsworthShare<Mat>(*A, &M));
    PetscCall(AinsworthStoreDiagonal(&M));
    *A = AinsworthOwn(M);
  }
  PetscCall(MatGetBlockSize(*A, &given));
  if (given == bs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(*A, copy.out()));
  if (copy == *A) PetscCall(MatDuplicate(*A, MAT_COPY_VALUES, copy.out()));
  *A = copy;
  PetscCall(MatSetBlockSize(*A, bs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts the rows of each kind, and keeps those rows of sp->kept that are constraints; rows: their numbers there */
static PetscErrorCode KeepRows(AinsworthSaddle *sp, const std::vector<PetscInt> &rows)
{
  MPI_Comm          comm                       = PetscObjectComm((PetscObject)sp->all.C);
  PetscInt          count[AINSWORTH_ROW_KINDS] = {0}, before;
  AinsworthRef<IS>  selected;
  AinsworthRef<Vec> factors;

  PetscFunctionBegin;
  for (AinsworthRowKind kind : sp->kind) count[kind]++;
  PetscCall(MPIU_Allreduce(count, sp->count, AINSWORTH_ROW_KINDS, MPIU_INT, MPI_SUM, comm));
  if (!sp->constraints()) {
    const bool same = sp->P == sp->A;

    PetscCall(CompleteAlone(sp->bs, &sp->A));
    if (same) sp->P = sp->A;
    else PetscCall(CompleteAlone(sp->bs, &sp->P));
  }
  PetscCall(MatGetSize(sp->kept.C, &before, NULL));
  if (sp->constraints() == before) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ISCreateGeneral(comm, (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, selected.out()));
  PetscCall(SelectRows(selected, &sp->kept));
  if (!sp->balance) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateVecs(sp->kept.C, NULL, factors.out()));
  PetscCall(VecISCopy(sp->balance, selected, SCATTER_REVERSE, factors));
  sp->balance = factors;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleClassifyRows - decides how each row of the multiplier field is treated, and restricts sp->kept, which
   has all of them, to the constraints. Collective
*/
PetscErrorCode AinsworthSaddleClassifyRows(AinsworthSaddle *sp)
{
  AinsworthRef<Mat>     columns;
  PetscInt              local, bad = -1;
  std::vector<PetscInt> rows;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(sp->kept.C, &sp->first, NULL));
  PetscCall(MatGetLocalSize(sp->kept.C, &local, NULL));
  /* row, column: more than D_ii */
  std::vector<char> inC(local), inB(local), inRow(local), inColumn(local), row(local), column(local);

  if (sp->kept.D) PetscCall(MatTranspose(sp->kept.D, MAT_INITIAL_MATRIX, columns.out()));
  PetscCall(FindNonzeroRows(sp->kept.C, &inC, NULL, &bad));
  if (sp->oneSided()) inB = inC;
  else PetscCall(FindNonzeroRows(sp->kept.B, &inB, NULL, &bad));
  PetscCall(FindNonzeroRows(sp->kept.D, &inRow, &row, &bad));
  PetscCall(FindNonzeroRows(columns, &inColumn, &column, &bad));
  PetscCall(AinsworthAgreeOnFirst(PetscObjectComm((PetscObject)sp->all.C), &bad));
  if (bad >= 0) {
    PetscCall(PetscSNPrintf(sp->bad, sizeof(sp->bad),
                            "row %" PetscInt_FMT " of C, or of the other blocks of the multipliers, holds NaN or Inf",
                            bad));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt i = 0; i < local; i++) {
    sp->kind.push_back(!inC[i] && !inRow[i]                   ? AINSWORTH_ROW_ZERO
                       : !inC[i] && !row[i]                   ? AINSWORTH_ROW_DECOUPLED
                       : !inB[i] && inColumn[i] && !column[i] ? AINSWORTH_ROW_PASSIVE
                                                              : AINSWORTH_ROW_CONSTRAINT);
    if (sp->kind[i] == AINSWORTH_ROW_CONSTRAINT) rows.push_back(sp->first + i);
  }
  PetscCall(KeepRows(sp, rows));
  PetscCall(BalanceRows(&sp->kept, &sp->balance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks those local rows that are given by n numbers in sp->kept, ascending, the same on all ranks */
static PetscErrorCode MarkKept(const AinsworthSaddle *sp, PetscInt n, const PetscInt numbers[],
                               std::vector<bool> *marked)
{
  PetscInt row, next = 0;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(sp->kept.C, &row, NULL));
  while (next < n && numbers[next] < row) next++;
  for (AinsworthRowKind kind : sp->kind) {
    marked->push_back(kind == AINSWORTH_ROW_CONSTRAINT && next < n && row++ == numbers[next]);
    next += marked->back();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Replaces the system by one without n rows, as dependent or nearly so (kind), given by their numbers in kept.C,
   ascending, the same on all ranks. Collective
*/
PetscErrorCode AinsworthSaddleDropDependent(AinsworthSaddleStage *stage, PetscInt n, const PetscInt dependent[],
                                            AinsworthRowKind kind)
{
  auto                  sp = std::make_unique<AinsworthSaddle>(**stage);
  PetscInt              row;
  std::vector<bool>     marked;
  std::vector<PetscInt> rows;

  PetscFunctionBegin;
  PetscCall(MarkKept(sp.get(), n, dependent, &marked));
  PetscCall(MatGetOwnershipRange(sp->kept.C, &row, NULL));
  for (size_t i = 0; i < marked.size(); i++) {
    if (sp->kind[i] != AINSWORTH_ROW_CONSTRAINT) continue;
    if (marked[i]) sp->kind[i] = kind;
    else rows.push_back(row);
    row++;
  }
  PetscCall(KeepRows(sp.get(), rows));
  *stage = std::move(sp);
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
  PetscCall(AinsworthNameMarked(PetscObjectComm((PetscObject)sp->all.C), sp->first, marked, text, len));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the rows of a kind. Collective */
PetscErrorCode AinsworthSaddleNameKind(const AinsworthSaddle *sp, AinsworthRowKind kind, char text[], size_t len)
{
  std::vector<bool> marked;

  PetscFunctionBegin;
  for (AinsworthRowKind k : sp->kind) marked.push_back(k == kind);
  PetscCall(AinsworthSaddleNameRows(sp, marked, text, len));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists n rows given by their numbers in kept.C, as for AinsworthSaddleDropDependent(). Collective */
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
