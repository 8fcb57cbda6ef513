#include "refine.h"
#include "../base/loops.h"
#include "../base/objects.h"

/*
   An entry of w' K is rounding below this part of the largest terms: some thousand times the machine precision, the
   distance at which rows are dependent
*/
static const PetscReal exact = 1e-12;

/*
   AinsworthCertify - finds what w means, a combination of rows [C -D] that is meant to be zero. Collective

   With K = [A B'; C -D], w' C = 0 and w' D = 0 make w' b = w' (b - K y) for any y: if that is more than its rows are
   allowed, no y is a solution. What rounding leaves of w' C and w' D counts with an entry as large as any of y

   Input Parameters:
+  w       - m; not NaN
.  left    - m, b - K y in these rows, for some y
.  size    - of the largest entry of y, in units of the scale
-  allowed - m, what these rows may be left with
*/
PetscErrorCode AinsworthCertify(const AinsworthSaddle *sp, Vec w, Vec left, PetscReal size, Vec allowed,
                                AinsworthDependence *what)
{
  PetscReal          sizes[2], bound = 0.0;
  PetscScalar        dot;
  AinsworthSaddleVec row = {NULL, NULL}, terms = {NULL, NULL};

  PetscFunctionBegin;
  for (AinsworthSaddleVec *v : {&row, &terms}) {
    PetscCall(VecDuplicate(sp->scale.primal, &v->primal));
    if (sp->all.D) PetscCall(VecDuplicate(w, &v->dual));
  }
  PetscCall(MatMultHermitianTranspose(sp->all.C, w, row.primal));
  PetscCall(AinsworthAbsoluteMultTranspose(sp->all.C, w, terms.primal));
  for (Vec v : {row.primal, terms.primal}) PetscCall(AinsworthSaddleClearKnown(sp, v));
  if (sp->all.D) {
    PetscCall(MatMultHermitianTranspose(sp->all.D, w, row.dual));
    PetscCall(AinsworthAbsoluteMultTranspose(sp->all.D, w, terms.dual));
    /* multipliers of decoupled rows are known, like right-hand sides */
    for (Vec v : {row.dual, terms.dual})
      PetscCall(AinsworthUpdate(
        v, [sp](PetscInt i, PetscScalar &entry) { entry = sp->kind[i] == AINSWORTH_ROW_DECOUPLED ? 0.0 : entry; }));
  }
  PetscCall(AinsworthLargestEntry(sp, row, false, &sizes[0]));
  PetscCall(AinsworthLargestEntry(sp, terms, false, &sizes[1]));
  for (AinsworthSaddleVec *v : {&row, &terms}) PetscCall(AinsworthSaddleVecDestroy(v));
  PetscCall(AinsworthForEntries(
    {w, allowed}, [&](PetscInt, PetscScalar a, PetscScalar b) { bound += PetscAbsScalar(a) * PetscRealPart(b); }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &bound, 1, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)w)));
  PetscCall(VecDot(left, w, &dot));
  *what = AINSWORTH_DEPENDENCE_NONE;
  if (!(sizes[0] <= exact * sizes[1])) PetscFunctionReturn(PETSC_SUCCESS);
  if (PetscAbsScalar(dot) <= bound) *what = AINSWORTH_DEPENDENCE_CONSISTENT;
  else if (PetscAbsScalar(dot) > bound + sizes[0] * size) *what = AINSWORTH_DEPENDENCE_CONTRADICTION;
  PetscFunctionReturn(PETSC_SUCCESS);
}
