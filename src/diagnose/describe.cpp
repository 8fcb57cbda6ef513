/* What the solver is, in words */
#include "diagnose.h"
#include "../base/words.h"
#include "../multigrid/blocksa.h"
#include "../projection/matainsworth.h"

/* Describes ranks that own no constrained unknown and solve for no row; collective */
static PetscErrorCode DescribeRanks(const AinsworthSolver *solver, const AinsworthGram *gram, std::string &text)
{
  MPI_Comm    comm = PetscObjectComm((PetscObject)solver->saddle->kept.C);
  PetscMPIInt size, idle;
  Mat         Ct;
  MatInfo     touched;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(MatTranspose(solver->saddle->kept.C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(MatGetInfo(Ct, MAT_LOCAL, &touched));
  PetscCall(MatDestroy(&Ct));
  idle = touched.nz_used == 0.0 && !AinsworthGramGetKSP(gram);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &idle, 1, MPI_INT, MPI_SUM, comm));
  if (idle)
    text += "; " + std::to_string(idle) + " of " + std::to_string(size) +
            " ranks without constraints: nothing to exchange for a projection";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthDescribeLeftOut - describes in one line what this system does not need, and why (docs/method.md, what is
   left out)
*/
PetscErrorCode AinsworthDescribeLeftOut(const AinsworthSolver *solver, PetscBool unchanged, std::string &text)
{
  PetscFunctionBegin;
  text.clear();
  if (!solver->saddle->constraints()) text += "; no constraints: neither projector nor copy of A";
  else {
    Mat_Ainsworth *ctx;
    PC             inner;
    PC_BlockSA    *sa = NULL;
    const char    *economy;

    PetscCall(MatAinsworthGetContext_Private(solver->reduced->mat, &ctx));
    PetscCall(AinsworthProjectorGetEconomy(&ctx->proj, &economy));
    text += economy;
    PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
    PetscCall(PCBlockSAGet_Private(inner, &sa));
    const bool inKernel = sa && sa->subspace;
    if (inKernel) text += "; multigrid in Ker C: neither a preconditioning matrix nor a penalty";
    else if (AinsworthSolverPmatTypeInUse(solver) == PC_AINSWORTH_PMAT_ID)
      text += "; preconditioning matrix of type id: no product with A";
    if (solver->inner.longRows && !inKernel)
      text += "; " + AinsworthCounted(solver->inner.longRows, "long row") + " of C: not in the preconditioning matrix";
    if (!solver->inner.left.shared.empty())
      text += "; " + AinsworthCounted(solver->inner.left.shared.size(), "shared unknown") +
              ": held in the preconditioning matrix";
    if (solver->inner.operation) text += "; iterates in Ker C: C' B C is not applied";
    else if (ctx->omitPenalty) text += "; preconditioned in Ker C: C' B C is not applied";
    if (ctx->homogeneous) text += "; g = 0: neither R g nor A R g";
    PetscCall(DescribeRanks(solver, &ctx->proj.gram, text));
  }
  if (unchanged) text += "; A and C as at the last set-up: nothing rebuilt";
  text = text.empty() ? "nothing" : text.substr(2);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthDescribePmat - describes the type of M_* with its settings, and why auto chose it */
PetscErrorCode AinsworthDescribePmat(const AinsworthSolver *solver, std::string &text)
{
  const AinsworthPmatOptions *chosen = &solver->choices.pmat;
  const PCAinsworthPmatType   type   = AinsworthSolverPmatTypeInUse(solver);
  /* an error may have come before the choice of auto */
  const bool made = AinsworthSolverReducedMat(solver) && solver->inner.autoReason;
  char       part[64];

  PetscFunctionBegin;
  text = made || chosen->type != PC_AINSWORTH_PMAT_AUTO ? PCAinsworthPmatTypes[type] : "auto";
  if (type == PC_AINSWORTH_PMAT_JCB && chosen->rowScaling && (made || chosen->type == type)) text += ", rows scaled";
  if (type == PC_AINSWORTH_PMAT_CG || type == PC_AINSWORTH_PMAT_BJ_CG) {
    PetscCall(PetscSNPrintf(part, sizeof(part), ", relative tolerance %g", (double)chosen->rtol));
    text += part;
  }
  if (type == PC_AINSWORTH_PMAT_BJ_CC || type == PC_AINSWORTH_PMAT_BJ_CG) {
    if (chosen->blocks == PETSC_DECIDE) text += ", one block per 32 constraints";
    else text += ", " + std::to_string(chosen->blocks) + " blocks";
  }
  if (chosen->type == PC_AINSWORTH_PMAT_AUTO && made && chosen->penalty == AINSWORTH_PENALTY_ROW)
    text += solver->inner.autoReason;
  PetscFunctionReturn(PETSC_SUCCESS);
}
