/* Q_* = I - T_f for coarse functions: what they ask of the short rows is spread over the unknowns of these */
#include "coarse.h"
#include "../base/columns.h"
#include "../base/layouts.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../projection/projector.h"
#include <petscksp.h>

/*
   AinsworthKernelFindShares - finds what unknowns that belong to one row alone give to its flexibility, C W C'.
   Collective

   shares: for each entry of C, by local rows; 0 if other rows have its unknown
*/
PetscErrorCode AinsworthKernelFindShares(const AinsworthPmatInputs *in, Mat C, const AinsworthKernelRoles &roles,
                                         std::vector<PetscReal> *shares)
{
  Vec                    alone, squares;
  AinsworthAtColumns     at;
  std::vector<PetscReal> whole;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, 0, &alone));
  PetscCall(
    AinsworthUpdate(alone, {roles.weight}, [](PetscInt, PetscScalar &a, PetscScalar w) { a = a == 1.0 ? w : 0.0; }));
  PetscCall(at.create(C, alone));
  PetscCall(AinsworthCreateVecs(C, NULL, &squares));
  PetscCall(AinsworthRowSquares(C, in->weight, squares));
  PetscCall(AinsworthForEntries({squares}, [&](PetscInt, PetscScalar s) { whole.push_back(PetscRealPart(s)); }));
  for (Vec *v : {&alone, &squares}) PetscCall(VecDestroy(v));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++) {
      const PetscReal w = PetscRealPart(at(row.j[k]));

      shares->push_back(
        roles.shortRows[row.local] && w > 0.0 ? PetscSqr(PetscAbsScalar(row.a[k])) * w / whole[row.local] : 0.0);
    }
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks local rows of S that are not diagonally dominant; *any: there are some on any rank. Collective */
static PetscErrorCode FindWeak(Mat S, std::vector<char> *weak, PetscMPIInt *any)
{
  static const PetscReal dominant = 0.5;
  Vec                    sums, diagonal;

  PetscFunctionBegin;
  *any = 0;
  PetscCall(AinsworthCreateVecs(S, &diagonal, &sums));
  PetscCall(AinsworthRowSums(S, 1, sums));
  PetscCall(AinsworthGetDiagonal(S, diagonal));
  PetscCall(AinsworthForEntries({sums, diagonal}, [&](PetscInt, PetscScalar sum, PetscScalar d) {
    weak->push_back(PetscAbsScalar(d) < dominant * PetscRealPart(sum));
    if (weak->back()) *any = 1;
  }));
  PetscCall(VecDestroy(&sums));
  PetscCall(VecDestroy(&diagonal));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, any, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)S)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lowers the energy of v, a random vector, by steps of steepest descent in the norm of W. Collective */
static PetscErrorCode Smooth(Mat A, Vec weight, Vec v)
{
  static const int steps = 3;
  PetscScalar      square, energy;
  Vec              r, p, Ap;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(v, &r));
  PetscCall(VecDuplicate(v, &p));
  PetscCall(VecDuplicate(v, &Ap));
  PetscCall(MatMult(A, v, r));
  for (int k = 0; k < steps; k++) {
    PetscCall(VecPointwiseMult(p, weight, r));
    PetscCall(MatMult(A, p, Ap));
    PetscCall(VecDot(r, p, &square));
    PetscCall(VecDot(Ap, p, &energy));
    if (!(PetscRealPart(energy) > 0.0)) break;
    PetscCall(VecAXPY(v, -square / energy, p));
    PetscCall(VecAXPY(r, -square / energy, Ap));
  }
  for (Vec *x : {&r, &p, &Ap}) PetscCall(VecDestroy(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves S mu = c well enough for an energy. Collective */
static PetscErrorCode SolveRoughly(Mat S, Vec c, Vec mu)
{
  KSP ksp;
  PC  pc;

  PetscFunctionBegin;
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)S), &ksp));
  PetscCall(KSPSetOptionsPrefix(ksp, "ainsworth_spread_")); /* not asked by the program's -ksp_converged_reason */
  PetscCall(KSPSetOperators(ksp, S, S));
  PetscCall(KSPSetType(ksp, KSPCG));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCJACOBI));
  PetscCall(KSPSetTolerances(ksp, 1e-2, 0.0, PETSC_MAX_REAL, 30));
  PetscCall(KSPSolve(ksp, c, mu));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the unknowns of C and their neighbors in A: all that a vector on the unknowns of C has an energy with.
   Collective
*/
static PetscErrorCode FindSurface(Mat A, Mat C, IS *surface)
{
  Vec                   marked, neighbors;
  std::vector<PetscInt> mine;
  PetscInt              rstart;

  PetscFunctionBegin;
  PetscCall(AinsworthCountRows(C, 0, &marked));
  PetscCall(VecDuplicate(marked, &neighbors));
  PetscCall(VecGetOwnershipRange(marked, &rstart, NULL));
  PetscCall(AinsworthUpdate(marked, [=](PetscInt i, PetscScalar &m) {
    /* so that rows of A, which sum up to zero, do not cancel */
    if (m != 0.0) m = 1.0 + (PetscReal)((rstart + i) % 97) / 101.0;
  }));
  PetscCall(MatMult(A, marked, neighbors));
  PetscCall(AinsworthForEntries({marked, neighbors}, [&](PetscInt i, PetscScalar m, PetscScalar n) {
    if (m != 0.0 || n != 0.0) mine.push_back(rstart + i);
  }));
  PetscCall(
    ISCreateGeneral(PetscObjectComm((PetscObject)A), (PetscInt)mine.size(), mine.data(), PETSC_COPY_VALUES, surface));
  PetscCall(VecDestroy(&marked));
  PetscCall(VecDestroy(&neighbors));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the energy of a vector that is zero off the surface */
static PetscErrorCode EnergyOn(Mat A, IS surface, Vec v, PetscReal *energy)
{
  Vec part;

  PetscFunctionBegin;
  PetscCall(VecGetSubVector(v, surface, &part));
  PetscCall(AinsworthFormValue(A, part, energy));
  PetscCall(VecRestoreSubVector(v, surface, &part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a vector that is zero off the surface and smooth there */
static PetscErrorCode CreateSmooth(Mat A, IS surface, Vec weight, Vec *v)
{
  Vec part, w;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(weight, v));
  PetscCall(VecZeroEntries(*v));
  PetscCall(AinsworthCreateVecs(A, &part, NULL));
  PetscCall(AinsworthVecSetRandom(part));
  PetscCall(VecGetSubVector(weight, surface, &w));
  PetscCall(Smooth(A, w, part));
  PetscCall(VecRestoreSubVector(weight, surface, &w));
  PetscCall(VecISCopy(*v, surface, SCATTER_FORWARD, part));
  PetscCall(VecDestroy(&part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Measures how many times the energy of (I - T) v, for a smooth v, the exact projection has: v' Q' A Q v, Q = (I - W C'
   S^-1 C) (I - T), where C and T have the weak rows alone, and XC is Inv(S) C. Collective

   By so much the cycle may take steps that are too large, as its coarser levels do not know of the last projection
*/
static PetscErrorCode MeasureGain(const AinsworthPmatInputs *in, Mat C, Mat WCt, Mat XC, const std::vector<char> &weak,
                                  Vec weight, PetscReal *gain)
{
  PetscReal energies[2];
  IS        surface;
  Mat       CW, rows, adjoint, inverted, A, S, T;
  Vec       v, y, c, mu;

  PetscFunctionBegin;
  PetscCall(MatHermitianTranspose(WCt, MAT_INITIAL_MATRIX, &CW));
  PetscCall(AinsworthCopyMarkedRows(CW, &weak, &rows));
  PetscCall(MatHermitianTranspose(rows, MAT_INITIAL_MATRIX, &adjoint));
  for (Mat *M : {&CW, &rows}) PetscCall(MatDestroy(M));
  PetscCall(AinsworthCopyMarkedRows(C, &weak, &rows));
  PetscCall(AinsworthCopyMarkedRows(XC, &weak, &inverted));
  PetscCall(AinsworthMultiply(rows, adjoint, &S));
  PetscCall(AinsworthMultiply(adjoint, inverted, &T));
  PetscCall(FindSurface(in->aij, rows, &surface));
  PetscCall(MatCreateSubMatrix(in->aij, surface, surface, MAT_INITIAL_MATRIX, &A));
  PetscCall(CreateSmooth(A, surface, weight, &v));
  PetscCall(VecDuplicate(v, &y));
  PetscCall(AinsworthCreateVecs(S, &mu, &c));
  PetscCall(MatMult(T, v, y));
  PetscCall(VecAYPX(y, -1.0, v));
  PetscCall(EnergyOn(A, surface, y, &energies[0]));
  PetscCall(MatMult(rows, y, c));
  PetscCall(SolveRoughly(S, c, mu));
  PetscCall(MatMult(adjoint, mu, v));
  PetscCall(VecAXPY(y, -1.0, v));
  PetscCall(EnergyOn(A, surface, y, &energies[1]));
  *gain = energies[0] > 0.0 ? energies[1] / energies[0] : 1.0;
  for (Vec *x : {&v, &y, &c, &mu}) PetscCall(VecDestroy(x));
  for (Mat *M : {&rows, &adjoint, &inverted, &A, &S, &T}) PetscCall(MatDestroy(M));
  PetscCall(ISDestroy(&surface));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Adds to T what moves the softest unknown that a weak row has alone by what T leaves of the row, E (C - C T).
   Collective
*/
static PetscErrorCode AddRest(const AinsworthPmatInputs *in, Mat C, const std::vector<char> &weak,
                              const AinsworthKernelRoles &roles, Mat *T)
{
  std::vector<PetscReal> shares;
  AinsworthEntries       picks;
  Mat                    pick, E, rest, moved;
  size_t                 at = 0;

  PetscFunctionBegin;
  PetscCall(AinsworthKernelFindShares(in, C, roles, &shares));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    PetscInt best = -1;

    for (PetscInt k = 0; k < row.n; k++)
      if (shares[at + k] > (best < 0 ? 0.0 : shares[at + best])) best = k;
    if (best >= 0 && weak[row.local]) picks.add(row.j[best], PetscConj(1.0 / row.a[best]));
    picks.endRow();
    at += row.n;
  }));
  PetscCall(AinsworthCreateAIJLike(C, picks, &pick));
  PetscCall(MatHermitianTranspose(pick, MAT_INITIAL_MATRIX, &E));
  PetscCall(AinsworthMultiply(C, *T, &rest));
  PetscCall(MatScale(rest, -1.0));
  PetscCall(AinsworthAddAIJ(1.0, {C}, &rest));
  PetscCall(AinsworthMultiply(E, rest, &moved));
  PetscCall(AinsworthAddAIJ(1.0, {moved}, T));
  for (Mat *M : {&pick, &E, &rest, &moved}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthKernelCreateSpread - creates T_f, W C' Inv(S) C for the short rows and what that leaves of some; NULL if
   there are none. Collective

   S is that of the projector if these are all rows, with their usual weight. Inv(S) has the 1-norms of its rows: Inv(S)
   S has eigenvalues from 2 d - 1 to 1, where a row of S has a part d of its 1-norm on the diagonal. From d = 1/2
   downwards T may leave all of a row: where many slaves are tied to few masters, as on a plate of a fine mesh on a
   block of a coarse one. That alone does no harm; it does where moving the slaves strains what is stiffer than the
   smooth motions of the body, as the thickness of the plate: measured gains are 1.3 to 29 there, up to 1.07 on parts
   of a mesher, and 1.5 of 43 rows at the edges of a periodic cell. Then the slaves take what is left, so that Q_* P is
   in Ker C (aspect 1000: 54 iterations, 509 without). They do not always, because that makes coarse functions of softer
   masters stiff (two cubes, E2 = 1e-6: 16, 9 without)
*/
PetscErrorCode AinsworthKernelCreateSpread(const AinsworthPmatInputs *in, Mat all, const AinsworthPmatOptions *opt,
                                           const AinsworthKernelRoles &roles, Mat *spread)
{
  static const PetscReal most  = 1.1;
  PetscInt               taken = 0, rows;
  PetscMPIInt            any;
  PetscReal              gain = 1.0;
  PetscBool              usual;
  std::vector<char>      weak;
  Mat                    C, WCt, S, XC;

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
  if (whole && in->WCt) PetscCall(AinsworthShare(in->WCt, &WCt));
  else PetscCall(AinsworthGramMultiply(C, roles.weight, &WCt, whole ? NULL : &S));
  if (whole) PetscCall(AinsworthShare(in->S, &S));
  PetscCall(AinsworthInvGramMultiply(S, opt, C, &XC));
  PetscCall(AinsworthMultiply(WCt, XC, spread));
  PetscCall(FindWeak(S, &weak, &any));
  if (any) PetscCall(MeasureGain(in, C, WCt, XC, weak, roles.weight, &gain));
  if (gain > most) {
    PetscCall(PetscInfo(
      all, "The projection of coarse functions multiplies their energy by %g: slaves take what is left of rows\n",
      (double)gain));
    PetscCall(AddRest(in, C, weak, roles, spread));
  }
  for (Mat *M : {&C, &WCt, &S, &XC}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}
