/* The application of PCBLOCKSA: in which precision, by which scale, and what a negative energy shows */
#include "blocksaimpl.h"
#include "../base/hermitian.h"
#include "../base/layouts.h"

/*
   Checks whether a KSP tolerates single precision, with which the cycle is linear only to seven digits

   Methods that update x and the residual with the same M^{-1} r do. Others, such as GMRES, would report residuals that
   x does not have
*/
PetscErrorCode PCBlockSATolerates_Private(KSP ksp, PetscBool *tolerates)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, tolerates, KSPCG, KSPPROJECTEDCG, KSPFCG, KSPPIPEFCG, KSPFGMRES,
                                      KSPGCR, KSPRICHARDSON, ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the next set-up use double precision, as its caller is not known, or the matrix may be nearly singular */
PetscErrorCode PCBlockSAUseDouble_Private(PC pc, bool unknown)
{
  PC_BlockSA *sa = BlockSA(pc);

  PetscFunctionBegin;
  PetscCall(
    PetscInfo(pc, "%s: the levels have double precision\n",
              unknown ? "The caller is not known to tolerate single precision" : "The matrix may be nearly singular"));
  sa->options.single = PETSC_FALSE;
  if (sa->levels.hierarchy && sa->levels.hierarchy->single()) sa->stale = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCPreSolve_BlockSA(PC pc, KSP ksp, Vec, Vec)
{
  PetscFunctionBegin;
  PetscCall(PCBlockSATolerates_Private(ksp, &BlockSA(pc)->tolerant));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCPostSolve_BlockSA(PC pc, KSP, Vec, Vec)
{
  PC_BlockSA *sa = BlockSA(pc);

  PetscFunctionBegin;
  sa->tolerant = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the scale of the levels in single precision for a right-hand side of the cycle. Collective */
PetscErrorCode PCBlockSASetScale_Private(const PC_BlockSA *sa, Vec b)
{
  PetscReal norm;

  PetscFunctionBegin;
  if (!(*sa->grids)[0].single) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(b, NORM_2, &norm));
  *sa->scale = AinsworthInversePower(norm * sa->largest, 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Applies the levels; kinds of cycles other than the multiplicative one are those of PCMG */
static PetscErrorCode ApplyLevels(PC pc, Vec b, Vec x)
{
  PC_BlockSA *sa = BlockSA(pc);

  PetscFunctionBegin;
  if (((PC_MG *)pc->data)->am == PC_MG_MULTIPLICATIVE) PetscCall(PCBlockSACycle_Private(pc, &sa->cycle, b, x));
  else PetscCall((*sa->mg->apply)(pc, b, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Applies the cycle, to vectors sorted node by node if the matrix stores its unknowns in another order; with a map O it
   is O M^{-1} O'
*/
static PetscErrorCode Cycle(PC pc, Vec b, Vec x)
{
  PC_BlockSA *sa  = BlockSA(pc);
  Mat         map = sa->subspace ? sa->subspace->map : NULL;
  Vec         in = b, out = x;

  PetscFunctionBegin;
  if (map) {
    for (Vec &v : sa->mapped)
      if (!v) PetscCall(AinsworthCreateVecs(map, &v, NULL));
    in  = sa->mapped[0];
    out = sa->mapped[1];
    PetscCall(MatMultHermitianTranspose(map, b, in));
  }
  PetscCall(PCBlockSASetScale_Private(sa, in));
  if (sa->levels.hierarchy->sorted) {
    for (Vec &v : sa->sorted)
      if (!v) PetscCall(VecDuplicate(in, &v));
    PetscCall(PCBlockSASort_Private(sa, false, 1, in, sa->sorted[0]));
    PetscCall(ApplyLevels(pc, sa->sorted[0], sa->sorted[1]));
    PetscCall(PCBlockSASort_Private(sa, true, 1, sa->sorted[1], out));
  } else PetscCall(ApplyLevels(pc, in, out));
  if (map) PetscCall(MatMult(map, out, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCApply_BlockSA(PC pc, Vec b, Vec x)
{
  PC_BlockSA *sa = BlockSA(pc);
  PetscScalar energy;

  PetscFunctionBegin;
  if (sa->levels.hierarchy->single() && !sa->given && !sa->tolerant) {
    PetscCall(PCBlockSAUseDouble_Private(pc, true));
    PetscCall(PCSetUp_BlockSA(pc));
    pc->setupcalled = PETSC_TRUE;
  }
  PetscCall(Cycle(pc, b, x));
  if (sa->raised) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDot(x, b, &energy));
  if (PetscRealPart(energy) >= 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(pc, "The cycle is indefinite, r'z = %g: the bounds of the smoothers are raised\n",
                      (double)PetscRealPart(energy)));
  PetscCall(PCBlockSASetBounds_Private(pc, AinsworthRaised));
  sa->raised = PETSC_TRUE;
  PetscCall(Cycle(pc, b, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cycle is Hermitian */
PetscErrorCode PCApplyTranspose_BlockSA(PC pc, Vec b, Vec x)
{
  PetscFunctionBegin;
  PetscCall(AinsworthApplyConjugated(b, x, [pc](Vec v, Vec w) { return PCApply_BlockSA(pc, v, w); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}
