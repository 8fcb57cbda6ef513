/* Q_* = I - T_f for coarse functions: what they ask of the short rows is spread over the unknowns of these */
#include "inkernel.h"
#include "../lists.h"
#include "../loops.h"
#include "../objects.h"
#include "../projector/projector.h"

/*
   AinsworthKernelFindShares - finds what unknowns that belong to one row alone give to its flexibility, C W C'. Collective

   shares: for each entry of C, by local rows; 0 if other rows have its unknown
*/
PetscErrorCode AinsworthKernelFindShares(const AinsworthPmatInputs *in, Mat C, const AinsworthKernelRoles &roles, std::vector<PetscReal> *shares)
{
  Vec                    counts, squares, here[2];
  std::vector<PetscInt>  columns;
  std::vector<PetscReal> alone, whole;
  size_t                 at = 0;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, 0, &counts));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) { columns.insert(columns.end(), row.j, row.j + row.n); }));
  PetscCall(AinsworthVecGather(counts, (PetscInt)columns.size(), columns.data(), &here[0]));
  PetscCall(AinsworthVecGather(roles.weight, (PetscInt)columns.size(), columns.data(), &here[1]));
  PetscCall(
    AinsworthForEntries({here[0], here[1]}, [&](PetscInt, PetscScalar count, PetscScalar w) { alone.push_back(count == 1.0 ? PetscRealPart(w) : 0.0); }));
  PetscCall(MatCreateVecs(C, NULL, &squares));
  PetscCall(AinsworthRowSquares(C, in->weight, squares));
  PetscCall(AinsworthForEntries({squares}, [&](PetscInt, PetscScalar s) { whole.push_back(PetscRealPart(s)); }));
  for (Vec *v : {&counts, &squares, &here[0], &here[1]}) PetscCall(VecDestroy(v));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++, at++)
      shares->push_back(roles.shortRows[row.local] && alone[at] > 0.0 ? PetscSqr(PetscAbsScalar(row.a[k])) * alone[at] / whole[row.local] : 0.0);
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Adds to T what moves the softest unknown that a row has alone by what T leaves of the row, E (C - C T), where S is not diagonally dominant. Collective

   By the 1-norms of its rows Inv(S) S has eigenvalues from 2 d - 1 to 1, where a row of S has a part d of its 1-norm on the diagonal. From d = 1/2 downwards T may
   leave all of a row: where many slaves are tied to few masters that are softer, as on a plate of a fine mesh on a block of a coarse one. The exact projection then
   adds energy that the coarser levels do not know of (aspect 1000: eigenvalues up to 194 instead of 1.3, 509 iterations instead of 54)
*/
static PetscErrorCode AddRest(const AinsworthPmatInputs *in, Mat C, Mat S, const AinsworthKernelRoles &roles, Mat *T)
{
  static const PetscReal dominant = 0.5;
  std::vector<PetscReal> shares;
  std::vector<char>      weak;
  AinsworthEntries       picks;
  Mat                    pick, E, rest, moved;
  PetscInt               n;
  PetscMPIInt            any = 0;
  size_t                 at  = 0;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(S, [&](const AinsworthMatRow &row) {
    PetscReal sum = 0.0, diagonal = 0.0;

    for (PetscInt k = 0; k < row.n; k++) {
      sum += PetscAbsScalar(row.a[k]);
      if (row.j[k] == row.number) diagonal = PetscAbsScalar(row.a[k]);
    }
    weak.push_back(diagonal < dominant * sum);
    if (weak.back()) any = 1;
  }));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)C)));
  if (!any) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthKernelFindShares(in, C, roles, &shares));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    PetscInt best = -1;

    for (PetscInt k = 0; k < row.n; k++)
      if (shares[at + k] > (best < 0 ? 0.0 : shares[at + best])) best = k;
    if (best >= 0 && weak[row.local]) picks.add(row.j[best], PetscConj(1.0 / row.a[best]));
    picks.endRow();
    at += row.n;
  }));
  PetscCall(MatGetLocalSize(C, NULL, &n));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)C), n, picks, &pick));
  PetscCall(MatHermitianTranspose(pick, MAT_INITIAL_MATRIX, &E));
  PetscCall(MatMatMult(C, *T, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &rest));
  PetscCall(MatProductClear(rest));
  PetscCall(MatScale(rest, -1.0));
  PetscCall(AinsworthAddAIJ(1.0, {C}, &rest));
  PetscCall(MatMatMult(E, rest, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &moved));
  PetscCall(MatProductClear(moved));
  PetscCall(AinsworthAddAIJ(1.0, {moved}, T));
  for (Mat *M : {&pick, &E, &rest, &moved}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthKernelCreateSpread - creates T_f, W C' Inv(S) C for the short rows and what that leaves of some; NULL if there are none. Collective

   S is that of the projector if these are all rows, with their usual weight
*/
PetscErrorCode AinsworthKernelCreateSpread(const AinsworthPmatInputs *in, Mat all, const AinsworthPmatOptions *opt, const AinsworthKernelRoles &roles,
                                           Mat *spread)
{
  PetscInt  taken = 0, rows;
  PetscBool usual;
  Mat       C, CW, CWt, S, XC, inverse;

  PetscFunctionBegin;
  *spread = NULL;
  for (char s : roles.shortRows) taken += s;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &taken, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)all)));
  if (!taken || opt->type == PC_AINSWORTH_PMAT_ID) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetSize(all, &rows, NULL));
  PetscCall(VecEqual(roles.weight, in->weight, &usual));
  const bool whole = taken == rows && all == in->C && usual && in->S;
  if (whole) PetscCall(AinsworthShare(all, &C));
  else PetscCall(AinsworthCopyMarkedRows(all, &roles.shortRows, &C));
  PetscCall(AinsworthScaleColumns(C, roles.weight, &S));
  PetscCall(AinsworthCopyMarkedRows(S, NULL, &CW)); /* without the columns of unknowns that have no weight: their rows would couple all others */
  PetscCall(MatDestroy(&S));
  PetscCall(MatHermitianTranspose(CW, MAT_INITIAL_MATRIX, &CWt));
  if (whole) PetscCall(AinsworthShare(in->S, &S));
  else {
    PetscCall(MatMatMult(C, CWt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &S));
    PetscCall(MatProductClear(S));
  }
  PetscCall(AinsworthInvGramCreate(S, opt, &inverse));
  PetscCall(MatMatMult(inverse, C, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &XC));
  PetscCall(MatProductClear(XC));
  PetscCall(MatMatMult(CWt, XC, MAT_INITIAL_MATRIX, PETSC_DEFAULT, spread));
  PetscCall(MatProductClear(*spread));
  PetscCall(AddRest(in, C, S, roles, spread));
  for (Mat *M : {&C, &CW, &CWt, &S, &XC, &inverse}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}
