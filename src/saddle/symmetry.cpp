#include "saddle.h"
#include "../base/loops.h"
#include "../base/objects.h"

/* Reports a common reason for a non-symmetric A through PetscInfo(): Dirichlet rows turned into identity rows, with their columns left in place. Collective */
static PetscErrorCode ExplainAsymmetry(Mat A)
{
  PetscBool    has, listens;      /* listens: some rank prints PetscInfo() of matrices */
  PetscInt     found[2] = {0, 0}; /* diagonal rows, and rows with entries in their columns */
  Vec          v, y;
  PetscScalar *one;

  PetscFunctionBegin;
  PetscCall(PetscInfoEnabled(MAT_CLASSID, &listens));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &listens, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)A)));
  PetscCall(MatHasOperation(A, MATOP_GET_ROW, &has));
  if (!listens || !has) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatCreateVecs(A, &v, &y));
  PetscCall(VecGetArrayWrite(v, &one));
  PetscCall(AinsworthForRows(A, [&](const AinsworthMatRow &row) {
    PetscInt others = 0;

    for (PetscInt k = 0; k < row.n; k++) others += row.j[k] != row.number && row.a[k] != 0.0;
    one[row.local] = others ? 0.0 : 1.0;
    found[0] += !others;
  }));
  PetscCall(VecRestoreArrayWrite(v, &one));
  PetscCall(MatMult(A, v, y));
  PetscCall(AinsworthForEntries({v, y}, [&](PetscInt, PetscScalar mask, PetscScalar product) { found[1] += mask == 0.0 && product != 0.0; }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, found, 2, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  if (found[1])
    PetscCall(PetscInfo(A,
                        "%" PetscInt_FMT " rows of A hold nothing but their diagonal, while %" PetscInt_FMT
                        " other rows have entries in the columns of these: if they are Dirichlet conditions, MatZeroRowsColumns() keeps A symmetric\n",
                        found[0], found[1]));
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the largest |Av - Atv| of a row relative to the larger of both and to its diagonal entry, so that rows of different stiffness are judged separately */
static PetscErrorCode LargestDifference(Mat A, Vec Av, Vec Atv, PetscReal *largest)
{
  Vec diagonal;

  PetscFunctionBegin;
  *largest = 0.0;
  PetscCall(VecDuplicate(Av, &diagonal));
  PetscCall(AinsworthGetDiagonal(A, diagonal));
  PetscCall(AinsworthForEntries({Av, Atv, diagonal}, [=](PetscInt, PetscScalar a, PetscScalar b, PetscScalar d) {
    const PetscReal size = PetscMax(PetscMax(PetscAbsScalar(a), PetscAbsScalar(b)), PetscAbsScalar(d));

    if (a != b) *largest = PetscMax(*largest, AinsworthQuotient(PetscAbsScalar(a - b), size)); /* also for numbers that overflow */
  }));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, largest, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthProbeSymmetry - tells whether A = A': as the program declared, otherwise by comparing A v with A' v for a random v. Collective

   Rows are compared one by one, so that rows of a soft body count as much as those of a stiff one and nothing underflows.
*/
PetscErrorCode AinsworthProbeSymmetry(Mat A, PetscBool *symmetric)
{
  static const char name[] = "AinsworthSymmetry";
  PetscBool         known, has;
  Vec               v, Av, Atv;
  PetscReal         difference;

  PetscFunctionBegin;
  PetscCall(PetscDefined(USE_COMPLEX) ? MatIsHermitianKnown(A, &known, symmetric) : MatIsSymmetricKnown(A, &known, symmetric));
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
  if (!*symmetric) PetscCall(ExplainAsymmetry(A));
  PetscCall(
    PetscInfo(A, "A is %s: a row of A v and A' v differs by %g of itself for a random v\n", *symmetric ? "symmetric" : "not symmetric", (double)difference));
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&Av));
  PetscCall(VecDestroy(&Atv));
  PetscFunctionReturn(PETSC_SUCCESS);
}
