#include "refine.h"
#include "../loops.h"
#include "../objects.h"

/* An entry of w' K is rounding below this part of the largest terms: some thousand times the machine precision, the distance at which rows are dependent */
static const PetscReal exact = 1e-12;

/* Raises sizes to the largest |u_i| s_i and t_i s_i of this rank */
static PetscErrorCode Raise(Vec u, Vec t, Vec s, PetscReal sizes[2])
{
  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({u, t, s}, [=](PetscInt, PetscScalar a, PetscScalar b, PetscScalar c) {
    sizes[0] = PetscMax(sizes[0], PetscAbsScalar(a) * PetscRealPart(c));
    sizes[1] = PetscMax(sizes[1], PetscRealPart(b) * PetscRealPart(c));
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthCertify - finds what w means, a combination of rows [C -D] that is meant to be zero. Collective

   With K = [A B'; C -D], w' C = 0 and w' D = 0 make w' b = w' (b - K y) for any y: if that is more than its rows are allowed, no y is a solution. What rounding
   leaves of w' C and w' D counts with an entry as large as any of y

   Input Parameters:
+  w       - m; not NaN
.  left    - m, b - K y in these rows, for some y
.  size    - of the largest entry of y, in units of the scale
-  allowed - m, what these rows may be left with
*/
PetscErrorCode AinsworthCertify(const AinsworthSaddle *sp, Vec w, Vec left, PetscReal size, Vec allowed, AinsworthDependence *what)
{
  const MPI_Comm comm     = PetscObjectComm((PetscObject)w);
  PetscReal      sizes[2] = {0.0, 0.0}, bound = 0.0;
  PetscScalar    dot;
  Vec            row, terms;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(sp->scale.primal, &row));
  PetscCall(VecDuplicate(sp->scale.primal, &terms));
  PetscCall(MatMultHermitianTranspose(sp->rowsC, w, row));
  PetscCall(AinsworthAbsoluteMultTranspose(sp->rowsC, w, terms));
  PetscCall(Raise(row, terms, sp->scale.primal, sizes));
  for (Vec *v : {&row, &terms}) PetscCall(VecDestroy(v));
  if (sp->rowsD) {
    PetscCall(VecDuplicate(w, &row));
    PetscCall(VecDuplicate(w, &terms));
    PetscCall(MatMultHermitianTranspose(sp->rowsD, w, row));
    PetscCall(AinsworthAbsoluteMultTranspose(sp->rowsD, w, terms));
    /* multipliers of decoupled rows are known, like right-hand sides */
    for (Vec v : {row, terms})
      PetscCall(AinsworthUpdate(v, [sp](PetscInt i, PetscScalar &entry) { entry = sp->kind[i] == AINSWORTH_ROW_DECOUPLED ? 0.0 : entry; }));
    PetscCall(Raise(row, terms, sp->scale.dual, sizes));
    for (Vec *v : {&row, &terms}) PetscCall(VecDestroy(v));
  }
  PetscCall(AinsworthForEntries({w, allowed}, [&](PetscInt, PetscScalar a, PetscScalar b) { bound += PetscAbsScalar(a) * PetscRealPart(b); }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sizes, 2, MPIU_REAL, MPIU_MAX, comm));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &bound, 1, MPIU_REAL, MPIU_SUM, comm));
  PetscCall(VecDot(left, w, &dot));
  *what = AINSWORTH_DEPENDENCE_NONE;
  if (!(sizes[0] <= exact * sizes[1])) PetscFunctionReturn(PETSC_SUCCESS);
  if (PetscAbsScalar(dot) <= bound) *what = AINSWORTH_DEPENDENCE_CONSISTENT;
  else if (PetscAbsScalar(dot) > bound + sizes[0] * size) *what = AINSWORTH_DEPENDENCE_CONTRADICTION;
  PetscFunctionReturn(PETSC_SUCCESS);
}
