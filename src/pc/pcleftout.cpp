#include "pcainsworth.h"
#include "../ksp/projectedcg.h"
#include "../operator/matainsworth.h"
#include "../pmat/surface.h"
#include <string>

/* What the factorisation of the Gram matrix gave way to */
static PetscErrorCode DescribeGram(AinsworthGram *gram, std::string &text)
{
  PetscBool none = PETSC_FALSE, blocks = PETSC_FALSE, flags[2];

  PetscFunctionBegin;
  if (gram->placement.sizes.size()) {
    PC pc;
    PetscCall(KSPGetPC(gram->ksp, &pc));
    PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCNONE, &none));
    PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCVPBJACOBI, &blocks));
  } else none = blocks = PETSC_TRUE;
  flags[0] = none;
  flags[1] = (PetscBool)(none || blocks);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, flags, 2, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)gram->S)));
  if (gram->placement.largest == 1 && flags[0]) text += "; S is diagonal: no factorisation";
  else if (flags[1]) text += "; S is in small pieces: dense inverses, no factorisation";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ranks that hold no constrained degree of freedom and solve for no row */
static PetscErrorCode DescribeRanks(AinsworthProjector *proj, std::string &text)
{
  MPI_Comm    comm = PetscObjectComm((PetscObject)proj->C);
  PetscMPIInt size, idle;
  PetscInt    touched, rows;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(AinsworthSurfaceCountConstrained(proj->C, &touched));
  PetscCall(MatGetLocalSize(proj->C, &rows, NULL));
  idle = !touched && !rows;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &idle, 1, MPI_INT, MPI_SUM, comm));
  if (idle) text += "; " + std::to_string(idle) + " of " + std::to_string(size) + " ranks have no constraints: they exchange nothing for a projection";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthViewLeftOut - one line: what this scene does not need, and why (design of the method: docs/method.md, what is left out) */
PetscErrorCode PCAinsworthViewLeftOut(PC_Ainsworth *data, PetscViewer viewer)
{
  std::string text;

  PetscFunctionBegin;
  if (!data->constraints) text += "; no constraints: neither projector nor copy of A";
  else {
    Mat_Ainsworth *ctx;
    PetscBool      projected;

    PetscCall(MatAinsworthGetContext(data->S, &ctx));
    PetscCall(KSPProjectedCGGetUse_Private(data->ksp, &projected));
    PetscCall(DescribeGram(&ctx->proj.gram, text));
    if (PCAinsworthPmatTypeInUse(data) == PC_AINSWORTH_PMAT_ID) text += "; id: no product with A for the preconditioning matrix";
    if (projected) text += "; iterates in Ker C: C' B C is not applied";
    if (ctx->withoutRange) text += "; preconditioned in Ker C: C' B C is not applied";
    if (ctx->homogeneous) text += "; g = 0: neither R g nor A R g";
    PetscCall(DescribeRanks(&ctx->proj, text));
  }
  if (data->unchanged) text += "; A and C as at the last set-up: nothing rebuilt";
  PetscCall(PetscViewerASCIIPrintf(viewer, "  left out: %s\n", text.empty() ? "nothing" : text.c_str() + 2));
  PetscFunctionReturn(PETSC_SUCCESS);
}
