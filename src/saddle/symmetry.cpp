#include "saddle.h"
#include "../base/loops.h"
#include "../base/objects.h"

/*
   Finds the largest |Av - Atv| of a row relative to the larger of both and to its diagonal entry, so that rows of
   different stiffness are judged separately
*/
static PetscErrorCode LargestDifference(Mat A, Vec Av, Vec Atv, PetscReal *largest)
{
  Vec diagonal;

  PetscFunctionBegin;
  *largest = 0.0;
  PetscCall(VecDuplicate(Av, &diagonal));
  PetscCall(AinsworthGetDiagonal(A, diagonal));
  PetscCall(AinsworthForEntries({Av, Atv, diagonal}, [=](PetscInt, PetscScalar a, PetscScalar b, PetscScalar d) {
    const PetscReal size = PetscMax(PetscMax(PetscAbsScalar(a), PetscAbsScalar(b)), PetscAbsScalar(d));

    /* also for numbers that overflow */
    if (a != b) *largest = PetscMax(*largest, AinsworthQuotient(PetscAbsScalar(a - b), size));
  }));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, largest, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthProbeSymmetry - tells whether A = A': as the program declared, otherwise by comparing A v with A' v for a
   random v. Collective

   Rows are compared one by one, so that rows of a soft body count as much as those of a stiff one and nothing
   underflows.
*/
PetscErrorCode AinsworthProbeSymmetry(Mat A, PetscBool *symmetric)
{
  static const char name[] = "AinsworthSymmetry";
  PetscBool         known, has;
  Vec               v, Av, Atv;
  PetscReal         difference;

  PetscFunctionBegin;
  PetscCall(PetscDefined(USE_COMPLEX) ? MatIsHermitianKnown(A, &known, symmetric)
                                      : MatIsSymmetricKnown(A, &known, symmetric));
  if (known) PetscFunctionReturn(PETSC_SUCCESS);
  /* the result is cached with A until its values change */
  *symmetric = PETSC_FALSE;
  PetscCall(AinsworthRecall((PetscObject)A, name, symmetric, &known));
  if (known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatHasOperation(A, MATOP_MULT_TRANSPOSE, &has));
  if (!has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(A, &v, &Av));
  PetscCall(VecDuplicate(Av, &Atv));
  PetscCall(VecSetRandom(v, NULL));
  PetscCall(MatMult(A, v, Av));
  PetscCall(MatMultHermitianTranspose(A, v, Atv));
  PetscCall(LargestDifference(A, Av, Atv, &difference));
  *symmetric = (PetscBool)(difference <= 1e-10);
  PetscCall(AinsworthRemember((PetscObject)A, name, *symmetric));
  PetscCall(PetscInfo(A, "A is %s: a row of A v and A' v differs by %g of itself for a random v\n",
                      *symmetric ? "symmetric" : "not symmetric", (double)difference));
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&Av));
  PetscCall(VecDestroy(&Atv));
  PetscFunctionReturn(PETSC_SUCCESS);
}
