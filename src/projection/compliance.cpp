#include "compliance.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../saddle/saddle.h"

/*
   Computes sums_i = sum_j |C_ij|^2 w_j^2 d_j with w the weight (NULL: 1) and d = diag(A): the flexibility of A under
   the force C_i'

   Unknowns without stiffness, whose weight is above 1 / d_j, count only in rows that have no others. If row i has
   unknowns that are in no other row, only these are summed, down to `least` times the full sum: unknowns that rows
   share may be soft without telling the rows apart. The smaller the sum, the smaller N is, and the closer to singular S
   may be where rows depend on each other.
*/
static PetscErrorCode RowFlexibility(Mat C, Vec weight, Vec inverseDiagonal, Vec sums)
{
  /* weights are 1 / d_j, or at least 100 times that of what holds the unknown */
  static const PetscReal least = 1e-4, loose = 2.0;
  Vec                    d, count, own, stiff;

  PetscFunctionBegin;
  PetscCall(AinsworthVecClone(inverseDiagonal, &d));
  PetscCall(VecSqrtAbs(d));
  PetscCall(VecReciprocal(d));
  if (weight) PetscCall(VecPointwiseMult(d, d, weight));
  PetscCall(VecPointwiseMult(d, d, d));
  PetscCall(AinsworthRowSquares(C, d, sums));
  PetscCall(VecDuplicate(sums, &own));
  if (weight) {
    PetscCall(AinsworthVecClone(d, &stiff));
    PetscCall(AinsworthUpdate(stiff, {weight, inverseDiagonal},
                              [](PetscInt, PetscScalar &s, PetscScalar w, PetscScalar inverse) {
                                if (PetscRealPart(w) > loose * PetscRealPart(inverse)) s = 0.0;
                              }));
    PetscCall(AinsworthRowSquares(C, stiff, own));
    PetscCall(AinsworthUpdate(sums, {own}, [](PetscInt, PetscScalar &all, PetscScalar part) {
      if (part != 0.0) all = part;
    }));
    PetscCall(VecDestroy(&stiff));
  }
  PetscCall(AinsworthCountRows(C, 0, &count));
  PetscCall(AinsworthUpdate(d, {count}, [](PetscInt, PetscScalar &own, PetscScalar rows) {
    if (PetscRealPart(rows) > 1.0) own = 0.0;
  }));
  PetscCall(AinsworthRowSquares(C, d, own));
  PetscCall(AinsworthUpdate(sums, {own}, [](PetscInt, PetscScalar &all, PetscScalar part) {
    if (part != 0.0) all = PetscMin(PetscRealPart(all), PetscMax(PetscRealPart(part), least * PetscRealPart(all)));
  }));
  for (Vec *v : {&d, &count, &own}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Lower bounds on the energy of mu_i, relative to the flexibility of the constraint; G scales smaller energies up to
   them

   Without G the energy would drown in the rounding of other energies, which amounts to the machine precision over the
   square root of this bound. A larger bound would slow down the preconditioner where rows of C are close to each other,
   because the part of C x that it leaves enters mu as S^{-1} C x. Rows that D couples need a larger bound against
   rounding, because D may leave some of their combinations without energy.
*/
static const PetscReal alone = 1e-4, together = 1e-2;
/*
   Relative energy given to what a singular D that couples rows leaves free: it moves nothing, but rounding would make
   the sign arbitrary
*/
static const PetscReal undecided = 1e-10;

/*
   Computes inverse = 1 / G, where G is 1, or (D_ii / flexibility_i / alone)^{1/2} if that is smaller, with the sign
   that adds N to the diagonal of C W C'; D_ii stands for the row sum of |D|

   Rows that D couples share one G, the geometric mean of theirs, so that N and E are as symmetric as D. Theirs has
   `together` in the place of `alone`, and is (D_ii / flexibility_i)^{1/2} where that is larger than 1, because their D
   may be singular and its rounding matters. On return, flexibility is the energy of rows without D.
*/
static PetscErrorCode InvertRatios(AinsworthCompliance *c, Mat D, Vec flexibility, Vec inverse)
{
  PetscReal         mean[2] = {0.0, 0.0};
  std::vector<char> coupled;
  PetscScalar      *g, *rest, *sums;

  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(inverse, &g));
  PetscCall(VecGetArray(flexibility, &rest));
  PetscCall(VecGetArray(c->sums, &sums));
  PetscCall(AinsworthForRows(D, [&](const AinsworthMatRow &row) {
    const PetscInt  k     = row.local;
    const PetscReal total = PetscRealPart(sums[k]), met = PetscRealPart(rest[k]);
    const PetscReal ratio    = total > 0.0 && met > 0.0 ? PetscSqrtReal(total) / PetscSqrtReal(met) : 1.0;
    PetscReal       diagonal = 0.0;

    coupled.push_back(0);
    for (PetscInt a = 0; a < row.n; a++) {
      if (row.j[a] == row.number) diagonal = PetscRealPart(row.a[a]);
      else if (row.a[a] != 0.0) coupled[k] = 1;
    }
    rest[k] = total == 0.0 ? alone * met : 0.0;
    g[k]    = (diagonal < 0.0 ? -1.0 : 1.0) / PetscMin(1.0, ratio / PetscSqrtReal(alone));
    if (diagonal < 0.0) sums[k] = -sums[k];
    if (!coupled[k] || met == 0.0) return;
    mean[0] += PetscLogReal(PetscMin(1.0, ratio / PetscSqrtReal(together)) * PetscMax(1.0, ratio));
    mean[1] += 1.0;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, mean, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)D)));
  mean[0] = mean[1] > 0.0 ? PetscExpReal(-mean[0] / mean[1]) : 1.0;
  c->soft = mean[0] < 1.0 ? mean[0] : 0.0;
  for (size_t k = 0; k < coupled.size(); k++) {
    if (!coupled[k]) continue;
    g[k]    = mean[0];
    rest[k] = undecided * PetscAbsScalar(sums[k]) * PetscSqr(mean[0]);
  }
  PetscCall(VecRestoreArray(c->sums, &sums));
  PetscCall(VecRestoreArray(flexibility, &rest));
  PetscCall(VecRestoreArrayWrite(inverse, &g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthComplianceSetUp - creates N and E; C and B are m x n, D is m x m and laid out as the rows of C. Collective
*/
PetscErrorCode AinsworthComplianceSetUp(AinsworthCompliance *c, Mat C, Mat B, Mat D, Vec weight, Vec inverseDiagonal)
{
  Vec other;

  PetscFunctionBegin;
  PetscCall(AinsworthComplianceReset(c));
  if (!D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateVecs(C, NULL, &c->sums));
  PetscCall(VecDuplicate(c->sums, &c->rest));
  PetscCall(VecDuplicate(c->sums, &c->inverse));
  PetscCall(RowFlexibility(C, weight, inverseDiagonal, c->rest));
  if (B != C) { /* geometric mean of both sides */
    PetscCall(VecDuplicate(c->rest, &other));
    PetscCall(RowFlexibility(B, weight, inverseDiagonal, other));
    for (Vec v : {other, c->rest}) PetscCall(VecSqrtAbs(v));
    PetscCall(VecPointwiseMult(c->rest, c->rest, other));
    PetscCall(VecDestroy(&other));
  }
  PetscCall(AinsworthRowSums(D, 1, c->sums));
  PetscCall(InvertRatios(c, D, c->rest, c->inverse));
  PetscCall(AinsworthScaleColumns(D, c->inverse, &c->N));
  PetscCall(MatDuplicate(c->N, MAT_COPY_VALUES, &c->E));
  PetscCall(MatDiagonalScale(c->E, c->inverse, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthComplianceGetPreconditioner - computes the factors that eliminate mu from M_*^+ = [A 0; 0 E] + [C -N]' B [C
   -N], with E and N lumped

   With F = E + N^2 B, shared = N B / F and inverse = 1 / F. penalty is B; it is ignored where D_ii < 0.
*/
PetscErrorCode AinsworthComplianceGetPreconditioner(const AinsworthCompliance *c, Vec penalty, Vec shared, Vec inverse)
{
  Vec          N, E;
  PetscScalar *s;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(penalty, &N));
  PetscCall(VecDuplicate(penalty, &E));
  PetscCall(AinsworthRowSums(c->N, 1, N));
  PetscCall(AinsworthRowSums(c->E, 1, E));
  PetscCall(VecGetArrayWrite(shared, &s));
  auto invert = [=](PetscInt i, PetscScalar &f, PetscScalar a, PetscScalar e, PetscScalar b, PetscScalar sum,
                    PetscScalar rest) {
    const PetscReal B = PetscRealPart(sum) > 0.0 ? PetscRealPart(b) : 0.0, Ni = PetscRealPart(a);
    const PetscReal F = PetscRealPart(e) + PetscRealPart(rest) + (B > 0.0 ? Ni * Ni * B : 0.0);

    f    = F > 0.0 ? 1.0 / F : 0.0;
    s[i] = F > 0.0 && B > 0.0 ? Ni / F * B : 0.0;
  };
  PetscCall(AinsworthUpdate(inverse, {N, E, penalty, c->sums, c->rest}, invert));
  PetscCall(VecRestoreArrayWrite(shared, &s));
  PetscCall(VecDestroy(&N));
  PetscCall(VecDestroy(&E));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthComplianceReset(AinsworthCompliance *c)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&c->N));
  PetscCall(MatDestroy(&c->E));
  for (Vec *v : {&c->sums, &c->rest, &c->inverse}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}
