#include "pcainsworth.h"
#include "../multigrid/blocksa.h"
#include "../projection/matainsworth.h"
#include <string>

/* Describes ranks that own no constrained unknown and solve for no row; collective */
static PetscErrorCode DescribeRanks(PC_Ainsworth *data, const AinsworthGram *gram, std::string &text)
{
  MPI_Comm    comm = PetscObjectComm((PetscObject)data->saddle.C);
  PetscMPIInt size, idle;
  Mat         Ct;
  MatInfo     touched;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(MatTranspose(data->saddle.C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(MatGetInfo(Ct, MAT_LOCAL, &touched));
  PetscCall(MatDestroy(&Ct));
  idle = touched.nz_used == 0.0 && !AinsworthGramGetKSP(gram);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &idle, 1, MPI_INT, MPI_SUM, comm));
  if (idle) text += "; " + std::to_string(idle) + " of " + std::to_string(size) + " ranks have no constraints: they exchange nothing for a projection";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthDescribeLeftOut_Private - describes in one line what this system does not need, and why (docs/method.md, what is left out) */
PetscErrorCode PCAinsworthDescribeLeftOut_Private(PC_Ainsworth *data, std::string &text)
{
  PetscFunctionBegin;
  text.clear();
  if (!data->saddle.constraints()) text += "; no constraints: neither projector nor copy of A";
  else {
    Mat_Ainsworth       *ctx;
    const AinsworthGram *gram;
    PC                   inner;
    PC_BlockSA          *sa = NULL;
    const char          *economy;

    PetscCall(MatAinsworthGetContext_Private(data->reduced.mat, &ctx));
    PetscCall(MatAinsworthGetGram_Private(data->reduced.mat, &gram));
    PetscCall(AinsworthGramGetEconomy(gram, &economy));
    text += economy;
    PetscCall(AinsworthSolverGetInnerPC(data, &inner));
    PetscCall(PCBlockSAGet_Private(inner, &sa));
    const bool inKernel = sa && sa->subspace;
    if (inKernel) text += "; multigrid in Ker C: neither a preconditioning matrix nor a penalty";
    else if (AinsworthSolverPmatTypeInUse(data) == PC_AINSWORTH_PMAT_ID) text += "; id: no product with A for the preconditioning matrix";
    if (data->inner.longRows && !inKernel) text += "; " + std::to_string(data->inner.longRows) + " long rows of C: not in the preconditioning matrix";
    if (!data->inner.left.shared.empty()) text += "; " + std::to_string(data->inner.left.shared.size()) + " shared unknowns: held in the preconditioning matrix";
    if (data->inner.operation) text += "; iterates in Ker C: C' B C is not applied";
    else if (ctx->omitPenalty) text += "; preconditioned in Ker C: C' B C is not applied";
    if (ctx->homogeneous) text += "; g = 0: neither R g nor A R g";
    PetscCall(DescribeRanks(data, gram, text));
  }
  if (data->state == PC_AINSWORTH_UNCHANGED) text += "; A and C as at the last set-up: nothing rebuilt";
  text = text.empty() ? "nothing" : text.substr(2);
  PetscFunctionReturn(PETSC_SUCCESS);
}
