#include "gram.h"
#include "../events.h"

/* Ranks 0, size/k, 2 size/k, ... form the group; rank 0 is always in it, so that options and views find it */
static PetscErrorCode GroupRanks(AinsworthGram *gram, PetscInt rowsPerRank)
{
  MPI_Comm    comm = PetscObjectComm((PetscObject)gram->S);
  PetscMPIInt size, rank, member = 0;
  PetscInt    m, local, nonempty;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(MatGetSize(gram->S, &m, NULL));
  PetscCall(MatGetLocalSize(gram->S, &local, NULL));
  nonempty = local > 0;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &nonempty, 1, MPIU_INT, MPI_SUM, comm));
  gram->ranks = PetscMin(1 + (m - 1) / rowsPerRank, nonempty);
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < gram->ranks; k++)
    if (rank == (PetscMPIInt)(((PetscInt64)k * size) / gram->ranks)) member = 1;
  PetscCallMPI(MPI_Comm_split(comm, member ? 0 : MPI_UNDEFINED, rank, &gram->group));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Move the rows of S to the group, in their global order, in equal shares */
static PetscErrorCode GatherOnGroup(AinsworthGram *gram)
{
  MPI_Comm    comm = PetscObjectComm((PetscObject)gram->S);
  PetscInt    m, n = 0, start = 0;
  PetscMPIInt size, rank;
  IS          is;
  Mat         moved;
  Vec         rows;

  PetscFunctionBegin;
  PetscCall(MatGetSize(gram->S, &m, NULL));
  if (gram->group != MPI_COMM_NULL) {
    PetscCallMPI(MPI_Comm_size(gram->group, &size));
    PetscCallMPI(MPI_Comm_rank(gram->group, &rank));
    n     = m / size + ((m % size) > rank);
    start = rank * (m / size) + PetscMin(m % size, rank);
  }
  PetscCall(ISCreateStride(comm, n, start, 1, &is));
  PetscCall(MatCreateSubMatrix(gram->S, is, is, MAT_INITIAL_MATRIX, &moved));
  PetscCall(MatCreateVecs(gram->S, NULL, &rows));
  PetscCall(MatCreateVecs(moved, NULL, &gram->all));
  PetscCall(VecScatterCreate(rows, is, gram->all, NULL, &gram->scatter));
  PetscCall(VecDestroy(&rows));
  PetscCall(ISDestroy(&is));
  if (gram->group != MPI_COMM_NULL) {
    Mat                local;
    PetscInt           nrows;
    const PetscInt    *ia, *ja;
    const PetscScalar *a;
    PetscBool          done;

    PetscCall(MatMPIAIJGetLocalMat(moved, MAT_INITIAL_MATRIX, &local)); /* global column numbers, in order */
    PetscCall(MatGetRowIJ(local, 0, PETSC_FALSE, PETSC_FALSE, &nrows, &ia, &ja, &done));
    PetscCall(MatSeqAIJGetArrayRead(local, &a));
    PetscCall(MatCreate(gram->group, &gram->grouped));
    PetscCall(MatSetSizes(gram->grouped, n, n, m, m));
    PetscCall(MatSetType(gram->grouped, MATAIJ));
    PetscCall(MatSeqAIJSetPreallocationCSR(gram->grouped, ia, ja, a));
    PetscCall(MatMPIAIJSetPreallocationCSR(gram->grouped, ia, ja, a));
    PetscCall(MatSeqAIJRestoreArrayRead(local, &a));
    PetscCall(MatRestoreRowIJ(local, 0, PETSC_FALSE, PETSC_FALSE, &nrows, &ia, &ja, &done));
    PetscCall(MatDestroy(&local));
  }
  PetscCall(MatDestroy(&moved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGramSetUp - forms S = C (C W)' and factors it on ceil(m / rowsPerRank) ranks

   CW is C with its columns scaled by W (C itself for W = I). The solver has the options prefix `prefix`ainsworth_gram_.
*/
PetscErrorCode AinsworthGramSetUp(AinsworthGram *gram, Mat C, Mat CW, PetscInt rowsPerRank, PetscObject parent, const char prefix[])
{
  Mat         CWt;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCall(AinsworthGramReset(gram));
  PetscCall(PetscLogEventBegin(AINSWORTH_GramMat, C, 0, 0, 0));
  PetscCall(MatHermitianTranspose(CW, MAT_INITIAL_MATRIX, &CWt));
  PetscCall(MatMatMult(C, CWt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &gram->S));
  PetscCall(MatDestroy(&CWt));
  PetscCall(MatSetOption(gram->S, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(GroupRanks(gram, rowsPerRank));
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)C), &size));
  if (size > 1) PetscCall(GatherOnGroup(gram));
  else {
    PetscCall(PetscObjectReference((PetscObject)gram->S));
    gram->grouped = gram->S;
  }
  PetscCall(PetscLogEventEnd(AINSWORTH_GramMat, C, 0, 0, 0));

  PetscCall(PetscLogEventBegin(AINSWORTH_GramFactor, gram->S, 0, 0, 0));
  if (gram->grouped) {
    PC pc;

    PetscCall(MatSetOption(gram->grouped, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SPD, PETSC_TRUE));
    PetscCall(KSPCreate(PetscObjectComm((PetscObject)gram->grouped), &gram->ksp));
    PetscCall(PetscObjectIncrementTabLevel((PetscObject)gram->ksp, parent, 1));
    PetscCall(KSPSetOptionsPrefix(gram->ksp, prefix));
    PetscCall(KSPAppendOptionsPrefix(gram->ksp, "ainsworth_gram_"));
    PetscCall(KSPSetType(gram->ksp, KSPPREONLY));
    PetscCall(KSPSetTolerances(gram->ksp, 1e-14, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT)); /* for iterative choices: Q is as exact as this */
    PetscCall(KSPGetPC(gram->ksp, &pc));
    PetscCall(PCSetType(pc, PetscDefined(USE_COMPLEX) ? PCLU : PCCHOLESKY)); /* PETSc's own Cholesky factorisation knows L L^T only */
    PetscCall(KSPSetOperators(gram->ksp, gram->grouped, gram->grouped));
    PetscCall(KSPSetFromOptions(gram->ksp));
    PetscCall(KSPSetUp(gram->ksp));
    PetscCall(MatCreateVecs(gram->grouped, &gram->x, NULL));
    if (gram->scatter) {
      PetscInt n, m;
      PetscCall(MatGetLocalSize(gram->grouped, &n, NULL));
      PetscCall(MatGetSize(gram->grouped, &m, NULL));
      PetscCall(VecCreateMPIWithArray(gram->group, 1, n, m, NULL, &gram->b));
    }
  }
  PetscCall(PetscLogEventEnd(AINSWORTH_GramFactor, gram->S, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthGramReset(AinsworthGram *gram)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&gram->S));
  PetscCall(MatDestroy(&gram->grouped));
  PetscCall(KSPDestroy(&gram->ksp));
  PetscCall(VecScatterDestroy(&gram->scatter));
  PetscCall(VecDestroy(&gram->all));
  PetscCall(VecDestroy(&gram->b));
  PetscCall(VecDestroy(&gram->x));
  if (gram->group != MPI_COMM_NULL) PetscCallMPI(MPI_Comm_free(&gram->group));
  gram->group = MPI_COMM_NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solve that failed on the group becomes Inf, which every rank sees at its next norm */
static PetscErrorCode SolveOrInf(KSP ksp, Vec b, Vec x)
{
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  if (reason < 0) {
    PetscCall(PetscInfo(ksp, "Solve with the Gram matrix failed: %s\n", KSPConvergedReasons[reason]));
    PetscCall(VecFlag(x, 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x = S^{-1} b, both distributed as the rows of C */
PetscErrorCode AinsworthGramSolve(AinsworthGram *gram, Vec b, Vec x)
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_GramSolve, gram->S, b, x, 0));
  if (!gram->scatter) PetscCall(SolveOrInf(gram->ksp, b, x));
  else {
    PetscCall(VecScatterBegin(gram->scatter, b, gram->all, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(gram->scatter, b, gram->all, INSERT_VALUES, SCATTER_FORWARD));
    if (gram->ksp) {
      PetscScalar *array;

      PetscCall(VecGetArray(gram->all, &array));
      PetscCall(VecPlaceArray(gram->b, array));
      PetscCall(SolveOrInf(gram->ksp, gram->b, gram->x));
      PetscCall(VecCopy(gram->x, gram->b));
      PetscCall(VecResetArray(gram->b));
      PetscCall(VecRestoreArray(gram->all, &array));
    }
    PetscCall(VecScatterBegin(gram->scatter, gram->all, x, INSERT_VALUES, SCATTER_REVERSE));
    PetscCall(VecScatterEnd(gram->scatter, gram->all, x, INSERT_VALUES, SCATTER_REVERSE));
  }
  PetscCall(PetscLogEventEnd(AINSWORTH_GramSolve, gram->S, b, x, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective on the communicator of S: did the factorisation fail on the group? */
PetscErrorCode AinsworthGramGetFailedReason(AinsworthGram *gram, PCFailedReason *reason)
{
  PetscMPIInt    local;
  PCFailedReason r = PC_NOERROR;

  PetscFunctionBegin;
  if (gram->ksp) {
    PC pc;
    PetscCall(KSPGetPC(gram->ksp, &pc));
    PetscCall(PCGetFailedReason(pc, &r));
  }
  local = r < 0 ? PC_FACTOR_OTHER : (PetscMPIInt)r; /* the largest is agreed on, and PC_SETUP_ERROR is negative */
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &local, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)gram->S)));
  *reason = (PCFailedReason)local;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthGramView(AinsworthGram *gram, PetscViewer viewer)
{
  PetscViewer sub;
  MPI_Comm    comm = gram->ksp ? PetscObjectComm((PetscObject)gram->ksp) : PETSC_COMM_SELF;

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "Gram matrix S = C W C' and its solver, on %" PetscInt_FMT " rank%s:\n", gram->ranks, gram->ranks > 1 ? "s" : ""));
  PetscCall(PetscViewerASCIIPushTab(viewer));
  PetscCall(PetscViewerGetSubViewer(viewer, comm, &sub));
  if (gram->ksp) PetscCall(KSPView(gram->ksp, sub));
  PetscCall(PetscViewerRestoreSubViewer(viewer, comm, &sub));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
