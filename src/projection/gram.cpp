#include "gram.h"
#include "../base/events.h"
#include "../base/layouts.h"
#include "../base/objects.h"
#include "shared.h"
#include "../saddle/saddle.h"
#include <limits>

/* Creates the communicator of the ranks that have rows of S; they solve for split components together */
static PetscErrorCode CreateGroup(AinsworthGram *gram)
{
  PetscInt    n;
  PetscMPIInt rank;

  PetscFunctionBegin;
  if (gram->group != MPI_COMM_NULL) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ISGetLocalSize(gram->placement.rows, &n));
  PetscCallMPI(MPI_Comm_rank(gram->comm, &rank));
  PetscCallMPI(MPI_Comm_split(gram->comm, n ? 0 : MPI_UNDEFINED, rank, &gram->group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the placed matrix on the group from the placed rows of this rank */
static PetscErrorCode MoveToGroup(const AinsworthGram *gram, Mat moved, Mat *placed)
{
  PetscInt n;
  Mat      local;

  PetscFunctionBegin;
  if (gram->group == MPI_COMM_NULL) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(moved, NULL, &n));
  PetscCall(MatMPIAIJGetLocalMat(moved, MAT_INITIAL_MATRIX, &local)); /* global column numbers */
  PetscCall(MatCreateMPIMatConcatenateSeqMat(gram->group, local, n, MAT_INITIAL_MATRIX, placed));
  PetscCall(MatDestroy(&local));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scales S to a unit diagonal */
static PetscErrorCode Scale(AinsworthGram *gram)
{
  Mat scaled, placed = NULL;

  PetscFunctionBegin;
  PetscCall(VecDestroy(&gram->scale));
  PetscCall(AinsworthCreateVecs(gram->S, NULL, &gram->scale));
  if (gram->hermitian) PetscCall(MatGetDiagonal(gram->S, gram->scale));
  else PetscCall(AinsworthRowSums(gram->S, 1, gram->scale)); /* its diagonal may be zero */
  PetscCall(VecSqrtAbs(gram->scale));
  PetscCall(VecReciprocal(gram->scale));
  PetscCall(MatDuplicate(gram->S, MAT_COPY_VALUES, &scaled));
  PetscCall(MatDiagonalScale(scaled, gram->scale, gram->scale));
  if (gram->placement.split) {
    PetscCall(MoveToGroup(gram, scaled, &placed));
    PetscCall(MatDestroy(&scaled));
  } else placed = scaled;
  if (gram->placed) { /* keep the object, whose pattern its solver knows */
    PetscCall(MatCopy(placed, gram->placed, SAME_NONZERO_PATTERN));
    PetscCall(MatDestroy(&placed));
  } else gram->placed = placed;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Chooses the preconditioner that the components of this rank need: none for a diagonal, dense inverses of small
   blocks, or a factorization
*/
static PetscErrorCode ChoosePC(AinsworthGram *gram)
{
  const std::vector<PetscInt> &sizes   = gram->placement.sizes;
  PetscInt                     largest = 0;
  PC                           pc;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(gram->ksp, &pc));
  for (PetscInt size : sizes) largest = PetscMax(largest, size);
  if (gram->placement.split) largest = std::numeric_limits<PetscInt>::max();
  /* the scaled matrix is the identity, up to signs */
  if (largest <= 1) PetscCall(PCSetType(pc, gram->hermitian ? PCNONE : PCJACOBI));
  else if (largest <= gram->placement.small) {
    PetscCall(MatSetVariableBlockSizes(gram->placed, (PetscInt)sizes.size(), (PetscInt *)sizes.data()));
    PetscCall(PCSetType(pc, PCVPBJACOBI));
  } else if (gram->placed) PetscCall(AinsworthFactorChoose(&gram->factor, gram->placed, gram->hermitian, gram->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Factors the placed S on ranks with rows. An error on some of them, for instance out of memory, is raised on all.
   Collective on the communicator of S
*/
static PetscErrorCode Factor(AinsworthGram *gram)
{
  MPI_Comm    comm = gram->comm;
  std::string message;
  char        text[512] = "";
  struct {
    PetscMPIInt code = 0, rank = 0;
  } worst = {PETSC_SUCCESS, 0};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &worst.rank));
  if (gram->placement.sizes.size()) {
    PetscErrorCode code;

    PetscCall(AinsworthFactorTry([=] { return AinsworthFactorSetUp(&gram->factor, gram->placed, gram->ksp); }, &code,
                                 &message));
    worst.code = (PetscMPIInt)code;
    PetscCall(PetscStrncpy(text, message.c_str(), sizeof(text)));
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_2INT, MPI_MAXLOC, comm));
  if (!worst.code) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Bcast(text, sizeof(text), MPI_CHAR, worst.rank, comm));
  SETERRQ(comm, (PetscErrorCode)worst.code, "%s", text);
}

/* Creates the solver and reads its options, on ranks without rows as well: rank 0 reports unused options */
static PetscErrorCode CreateSolver(AinsworthGram *gram, PetscObject parent)
{
  PetscInt    n, m;
  const char *prefix;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetOptionsPrefix(parent, &prefix));
  PetscCall(KSPCreate(gram->placed ? PetscObjectComm((PetscObject)gram->placed) : PETSC_COMM_SELF, &gram->ksp));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)gram->ksp, parent, 1));
  PetscCall(KSPSetOptionsPrefix(gram->ksp, prefix));
  PetscCall(KSPAppendOptionsPrefix(gram->ksp, "ainsworth_gram_"));
  PetscCall(KSPSetType(gram->ksp, KSPPREONLY));
  /* for iterative methods: Q is only as accurate as this */
  PetscCall(KSPSetTolerances(gram->ksp, 1e-14, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(ChoosePC(gram));
  PetscCall(KSPSetFromOptions(gram->ksp));
  PetscCall(AinsworthFactorCheckMemory(&gram->factor, gram->comm));
  if (!gram->placement.sizes.size()) PetscFunctionReturn(PETSC_SUCCESS);
  if (gram->hermitian)
    PetscCall(MatSetOption(gram->placed, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SPD, PETSC_TRUE));
  PetscCall(AinsworthCreateVecs(gram->placed, NULL, &gram->b));
  PetscCall(VecGetLocalSize(gram->b, &n));
  PetscCall(VecGetSize(gram->b, &m));
  if (gram->placement.split) PetscCall(VecCreateMPIWithArray(gram->group, 1, n, m, NULL, &gram->x));
  else PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, n, NULL, &gram->x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGramMultiply - computes W C', without rows of unknowns that have no weight, whose rows would couple all
   others, and, unless S is NULL, C W C', laid out as the rows of C. Collective
*/
PetscErrorCode AinsworthGramMultiply(Mat C, Vec weight, Mat *WCt, Mat *S)
{
  Mat       left;
  PetscReal least = 1.0;

  PetscFunctionBegin;
  if (weight) PetscCall(VecMin(weight, NULL, &least));
  if (least == 0.0) PetscCall(AinsworthCopyWeighted(C, weight, &left));
  else PetscCall(AinsworthShare(C, &left));
  PetscCall(MatHermitianTranspose(left, MAT_INITIAL_MATRIX, WCt));
  PetscCall(MatDestroy(&left));
  if (weight) PetscCall(MatDiagonalScale(*WCt, weight, NULL));
  if (!S) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMatMult(C, *WCt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, S));
  PetscCall(MatProductClear(*S)); /* otherwise the product keeps its factors */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Adds N to S. Two transpositions sort the columns of N, which a permuted submatrix need not have in ascending order;
   searches rely on it. Collective
*/
static PetscErrorCode AddSprings(AinsworthGram *gram, Mat N)
{
  Mat own = N, sorted;

  PetscFunctionBegin;
  if (!gram->placement.split) PetscCall(MatGetDiagonalBlock(N, &own));
  PetscCall(MatTranspose(own, MAT_INITIAL_MATRIX, &sorted));
  PetscCall(MatTranspose(sorted, MAT_INPLACE_MATRIX, &sorted));
  PetscCall(AinsworthAddAIJ(1.0, {sorted}, &gram->S));
  PetscCall(MatDestroy(&sorted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGramForm - forms S = C W C' + N of placed rows; only split components need more rows than those of the rank.
   Collective
*/
PetscErrorCode AinsworthGramForm(AinsworthGram *gram, const AinsworthSurface &rows, const AinsworthGramInputs &in)
{
  AinsworthRef<Mat> WCt;

  PetscFunctionBegin;
  gram->comm = PetscObjectComm((PetscObject)in.C);
  PetscCall(MatDestroy(&gram->S));
  if (gram->placement.split) PetscCall(AinsworthGramMultiply(in.C, in.weight, WCt.out(), &gram->S));
  else PetscCall(rows.createGram(in.own, &gram->S));
  if (in.N) PetscCall(AddSprings(gram, in.N));
  if (!in.hermitian) PetscCall(AinsworthMakePatternSymmetric(&gram->S));
  PetscCall(AinsworthStoreDiagonal(&gram->S)); /* rows of B may be zero */
  gram->hermitian = in.hermitian;
  if (in.hermitian)
    PetscCall(MatSetOption(gram->S, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  if (gram->placement.split) PetscCall(CreateGroup(gram));
  PetscCall(Scale(gram));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGramGetWhole - gets S on all ranks, placed; to be destroyed by the caller. Collective */
PetscErrorCode AinsworthGramGetWhole(const AinsworthGram *gram, Mat *S)
{
  PetscMPIInt                    size;
  AinsworthCSR                   block;
  std::unique_ptr<AinsworthRows> own(new AinsworthRows), others(new AinsworthRows);

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(gram->comm, &size));
  if (gram->placement.split || size == 1) {
    PetscCall(AinsworthShare(gram->S, S));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(block.open(gram->S));
  own->reserve(block.ia[block.n]);
  own->i.assign(block.ia, block.ia + block.n + 1);
  std::copy(block.ja, block.ja + block.ia[block.n], own->j.get());
  std::copy(block.a, block.a + block.ia[block.n], own->a.get());
  others->reserve(0);
  others->i.assign(block.n + 1, 0);
  const PetscInt n = block.n;
  PetscCall(block.close());
  PetscCall(AinsworthMatCreateFromRows(gram->comm, n, std::move(own), std::move(others), S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGramFactor - factors the components of S; parent gives the solver its options prefix. Collective */
PetscErrorCode AinsworthGramFactor(AinsworthGram *gram, PetscObject parent)
{
  const bool small = AinsworthGramIsSmall(gram);

  PetscFunctionBegin;
  if (!small) PetscCall(PetscLogEventBegin(AINSWORTH_GramFactor, 0, 0, 0, 0));
  if (!gram->ksp) PetscCall(CreateSolver(gram, parent));
  PetscCall(Factor(gram));
  if (!small) PetscCall(PetscLogEventEnd(AINSWORTH_GramFactor, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthGramReset(AinsworthGram *gram)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&gram->S));
  PetscCall(AinsworthPlacementReset(&gram->placement));
  PetscCall(VecDestroy(&gram->scale));
  PetscCall(MatDestroy(&gram->placed));
  PetscCall(KSPDestroy(&gram->ksp));
  PetscCall(AinsworthFactorReset(&gram->factor));
  PetscCall(VecDestroy(&gram->b));
  PetscCall(VecDestroy(&gram->x));
  if (gram->group != MPI_COMM_NULL) PetscCallMPI(MPI_Comm_free(&gram->group));
  gram->group = MPI_COMM_NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves with the placed matrix; fills x with Inf on failure, which every rank sees in its next norm */
static PetscErrorCode SolveOrInf(AinsworthGram *gram, Vec b, Vec x)
{
  KSPConvergedReason reason = KSP_DIVERGED_PC_FAILED;

  PetscFunctionBegin;
  if (!gram->factor.failed) {
    PetscCall(KSPSolve(gram->ksp, b, x));
    PetscCall(KSPGetConvergedReason(gram->ksp, &reason));
  }
  if (reason < 0) {
    PetscCall(PetscInfo(gram->ksp, "Solve with the Gram matrix failed: %s\n", KSPConvergedReasons[reason]));
    PetscCall(VecFlag(x, 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Computes x = S^{-1} b = D (D S D)^{-1} D b, D = diag(S)^{-1/2}, for different placed vectors. Only ranks that share a
   component communicate
*/
PetscErrorCode AinsworthGramSolve(AinsworthGram *gram, Vec b, Vec x)
{
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_GramSolve, b, x, 0, 0));
  PetscCall(VecGetLocalSize(b, &n));
  if (n) {
    const PetscScalar *d, *in;
    PetscScalar       *out;

    PetscCall(VecGetArrayRead(gram->scale, &d));
    PetscCall(VecGetArrayRead(b, &in));
    PetscCall(VecGetArrayWrite(gram->b, &out));
    for (PetscInt i = 0; i < n; i++) out[i] = d[i] * in[i];
    PetscCall(VecRestoreArrayWrite(gram->b, &out));
    PetscCall(VecRestoreArrayRead(b, &in));
    PetscCall(VecGetArray(x, &out));
    PetscCall(VecPlaceArray(gram->x, out));
    PetscCall(SolveOrInf(gram, gram->b, gram->x));
    PetscCall(VecResetArray(gram->x));
    for (PetscInt i = 0; i < n; i++) out[i] *= d[i];
    PetscCall(VecRestoreArray(x, &out));
    PetscCall(VecRestoreArrayRead(gram->scale, &d));
    PetscCall(PetscLogFlops(2.0 * n));
  }
  PetscCall(PetscLogEventEnd(AINSWORTH_GramSolve, b, x, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the largest failed reason of all ranks. Collective on the communicator of S */
PetscErrorCode AinsworthGramGetFailedReason(AinsworthGram *gram, PCFailedReason *reason)
{
  PetscMPIInt    local;
  PCFailedReason r = PC_NOERROR;

  PetscFunctionBegin;
  if (gram->ksp) PetscCall(AinsworthFactorGetFailedReason(&gram->factor, gram->ksp, &r));
  local = (PetscMPIInt)r;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &local, 1, MPI_INT, MPI_MAX, gram->comm));
  *reason = (PCFailedReason)local;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGramDescribe - describes the components of S and the ranks that solve for them */
PetscErrorCode AinsworthGramDescribe(const AinsworthGram *gram, char text[], size_t len)
{
  const AinsworthPlacement &p = gram->placement;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(text, len,
                          "%" PetscInt_FMT " connected component%s, the largest of %" PetscInt_FMT
                          " row%s, on %" PetscInt_FMT " rank%s%s",
                          p.components, p.components > 1 ? "s" : "", p.largest, p.largest > 1 ? "s" : "", p.ranks,
                          p.ranks > 1 ? "s" : "", p.split ? ", which share it" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGramView - views the solver on the first of the ranks with the most operations */
PetscErrorCode AinsworthGramView(const AinsworthGram *gram, PetscViewer viewer)
{
  const AinsworthPlacement &p    = gram->placement;
  MPI_Comm                  comm = gram->comm, own = MPI_COMM_NULL;
  PetscMPIInt               rank, first;
  PetscReal                 most;
  PetscViewer               sub;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(MPIU_Allreduce(&gram->factor.cost.operations, &most, 1, MPIU_REAL, MPIU_MAX, comm));
  first = p.sizes.size() && gram->factor.cost.operations == most ? rank : PETSC_MPI_INT_MAX;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, comm));
  PetscCall(PetscViewerASCIIPrintf(viewer, "its solver on rank %d:\n", first));
  PetscCall(PetscViewerASCIIPushTab(viewer));
  own = p.split && p.sizes.size() ? gram->group : PETSC_COMM_SELF;
  PetscCall(PetscViewerASCIIPushSynchronized(viewer));
  PetscCall(PetscViewerGetSubViewer(viewer, own, &sub));
  if (p.sizes.size() && (p.split || rank == first)) {
    PetscCall(AinsworthFactorView(&gram->factor, sub));
    PetscCall(KSPView(gram->ksp, sub));
  }
  PetscCall(PetscViewerRestoreSubViewer(viewer, own, &sub));
  PetscCall(PetscViewerFlush(viewer));
  PetscCall(PetscViewerASCIIPopSynchronized(viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGramGetEconomy - tells why no factorization is needed, in words; an empty string if one is. Collective */
PetscErrorCode AinsworthGramGetEconomy(const AinsworthGram *gram, const char **text)
{
  PetscBool none = PETSC_TRUE, blocks = PETSC_TRUE, flags[2];

  PetscFunctionBegin;
  if (gram->placement.sizes.size()) {
    PC pc;

    PetscCall(KSPGetPC(gram->ksp, &pc));
    PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCNONE, &none));
    PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCVPBJACOBI, &blocks));
  }
  flags[0] = none;
  flags[1] = (PetscBool)(none || blocks);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, flags, 2, AINSWORTH_MPI_BOOL, MPI_LAND, gram->comm));
  *text = "";
  if (gram->placement.largest == 1 && flags[0]) *text = "; S is diagonal: no factorization";
  else if (flags[1]) *text = "; S is in small components: dense inverses, no factorization";
  PetscFunctionReturn(PETSC_SUCCESS);
}
