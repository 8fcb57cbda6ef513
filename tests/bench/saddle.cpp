/* A saddle-point system as a MatNest, solved by a KSP that the options choose */
#include "saddle.h"
#include "report.h"
#include <petsctime.h>

enum TransposeBlock {
  TRANSPOSE_VIEW,
  TRANSPOSE_EXPLICIT,
  TRANSPOSE_NONE
};

struct Layout {
  PetscInt  transpose; /* TransposeBlock */
  PetscBool multipliersFirst, zeroBlock;
};

static PetscErrorCode LayoutGet(MPI_Comm comm, Layout *layout)
{
  const char *const blocks[] = {"view", "explicit", "none"}, *const orders[] = {"last", "first"},
                    *const zeros[] = {"absent", "empty"};
  PetscInt                 order = 0, zero = 0;

  PetscFunctionBeginUser;
  layout->transpose = TRANSPOSE_VIEW;
  PetscOptionsBegin(comm, NULL, "Saddle-point system [A B'; C -D] as a MatNest", NULL);
  PetscCall(PetscOptionsEList("-transpose_block", "B' is a view of B, a matrix of its own, or left out", NULL, blocks,
                              3, blocks[layout->transpose], &layout->transpose, NULL));
  PetscCall(PetscOptionsEList("-multipliers", "Place of the multipliers among the two fields", NULL, orders, 2,
                              orders[order], &order, NULL));
  PetscCall(PetscOptionsEList("-zero_block", "A zero D is no matrix or a matrix without entries", NULL, zeros, 2,
                              zeros[zero], &zero, NULL));
  PetscOptionsEnd();
  layout->multipliersFirst = order ? PETSC_TRUE : PETSC_FALSE;
  layout->zeroBlock        = zero ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateZeroBlock(Mat C, Mat *Z)
{
  PetscInt m;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(C, &m, NULL));
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)C), m, m, PETSC_DETERMINE, PETSC_DETERMINE, 0, NULL, 0, NULL, Z));
  PetscCall(MatAssemblyBegin(*Z, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*Z, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the primal field and the multipliers are in the vectors of the nest: is[0] and is[1] */
static PetscErrorCode CreateFields(Mat C, PetscBool multipliersFirst, IS is[2])
{
  MPI_Comm comm = PetscObjectComm((PetscObject)C);
  PetscInt m, n, row, column, bs;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(C, &m, &n));
  PetscCall(MatGetOwnershipRange(C, &row, NULL));
  PetscCall(MatGetOwnershipRangeColumn(C, &column, NULL));
  PetscCall(MatGetBlockSizes(C, NULL, &bs));
  PetscCall(ISCreateStride(comm, n, row + column + (multipliersFirst ? m : 0), 1, &is[0]));
  PetscCall(ISSetBlockSize(is[0], bs));
  PetscCall(ISCreateStride(comm, m, row + column + (multipliersFirst ? 0 : n), 1, &is[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateNest(const SaddleBlocks &s, const Layout &layout, const IS is[2], Mat *K)
{
  const int primal = layout.multipliersFirst ? 1 : 0, dual = 1 - primal;
  MPI_Comm  comm = PetscObjectComm((PetscObject)s.A);
  Mat       blocks[2][2], B = s.B ? s.B : s.C, Bt = NULL, corner = NULL;
  IS        fields[2];

  PetscFunctionBeginUser;
  PetscCheck(!s.B || layout.transpose != TRANSPOSE_NONE, comm, PETSC_ERR_ARG_INCOMP,
             "Option -transpose_block none leaves B out, which is not C");
  if (layout.transpose == TRANSPOSE_VIEW)
    PetscCall(PetscDefined(USE_COMPLEX) ? MatCreateHermitianTranspose(B, &Bt) : MatCreateTranspose(B, &Bt));
  if (layout.transpose == TRANSPOSE_EXPLICIT) PetscCall(MatHermitianTranspose(B, MAT_INITIAL_MATRIX, &Bt));
  if (s.D) {
    PetscCall(MatDuplicate(s.D, MAT_COPY_VALUES, &corner));
    PetscCall(MatScale(corner, -1.0));
  } else if (layout.zeroBlock) PetscCall(CreateZeroBlock(s.C, &corner));
  blocks[primal][primal] = s.A;
  blocks[primal][dual]   = Bt;
  blocks[dual][primal]   = s.C;
  blocks[dual][dual]     = corner;
  fields[primal]         = is[0];
  fields[dual]           = is[1];
  PetscCall(MatCreateNest(comm, 2, fields, 2, fields, &blocks[0][0], K));
  PetscCall(MatDestroy(&Bt));
  PetscCall(MatDestroy(&corner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CopyField(Vec all, IS is, Vec field, PetscBool out)
{
  Vec sub;

  PetscFunctionBeginUser;
  PetscCall(VecGetSubVector(all, is, &sub));
  if (out) PetscCall(VecCopy(sub, field));
  else PetscCall(VecCopy(field, sub));
  PetscCall(VecRestoreSubVector(all, is, &sub));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Seconds, once all ranks are here */
static PetscErrorCode Now(MPI_Comm comm, PetscLogDouble *seconds)
{
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Barrier(comm));
  PetscCall(PetscTime(seconds));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SaddleSolve(const SaddleBlocks &s, Vec f, Vec g, SaddleSolution *solution)
{
  MPI_Comm       comm = PetscObjectComm((PetscObject)s.A);
  PetscLogDouble start, ready, end;
  ReportUsage    usage[3];
  PetscLogDouble before;
  Layout         layout;
  Mat            K;
  Vec            rhs, all;
  IS             is[2];
  KSP            ksp;

  PetscFunctionBeginUser;
  PetscCall(LayoutGet(comm, &layout));
  PetscCall(CreateFields(s.C, layout.multipliersFirst, is));
  PetscCall(CreateNest(s, layout, is, &K));
  PetscCall(MatCreateVecs(K, &all, &rhs));
  PetscCall(CopyField(rhs, is[0], f, PETSC_FALSE));
  PetscCall(CopyField(rhs, is[1], g, PETSC_FALSE));
  PetscCall(KSPCreate(comm, &ksp));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(Now(comm, &start));
  PetscCall(PetscMemoryGetCurrentUsage(&before));
  usage[0] = ReportGetUsage();
  PetscCall(KSPSetUp(ksp));
  PetscCall(Now(comm, &ready));
  usage[1] = ReportGetUsage();
  PetscCall(KSPSolve(ksp, rhs, all));
  PetscCall(Now(comm, &end));
  usage[2]                 = ReportGetUsage();
  solution->setupProcessor = usage[1].seconds - usage[0].seconds;
  solution->solveProcessor = usage[2].seconds - usage[1].seconds;
  solution->setupPages     = usage[1].pages - usage[0].pages;
  solution->solvePages     = usage[2].pages - usage[1].pages;
  solution->peak           = usage[2].peak - before;
  solution->setupSeconds   = ready - start;
  solution->solveSeconds   = end - ready;
  PetscCall(KSPGetConvergedReason(ksp, &solution->reason));
  PetscCall(KSPGetIterationNumber(ksp, &solution->iterations));
  PetscCall(VecDuplicate(f, &solution->x));
  PetscCall(VecDuplicate(g, &solution->lambda));
  PetscCall(CopyField(all, is[0], solution->x, PETSC_TRUE));
  PetscCall(CopyField(all, is[1], solution->lambda, PETSC_TRUE));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(VecDestroy(&all));
  PetscCall(VecDestroy(&rhs));
  PetscCall(MatDestroy(&K));
  for (int i = 0; i < 2; i++) PetscCall(ISDestroy(&is[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SaddleSolutionDestroy(SaddleSolution *solution)
{
  PetscFunctionBeginUser;
  PetscCall(VecDestroy(&solution->x));
  PetscCall(VecDestroy(&solution->lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SaddleWrite(Mat A, Mat C, Vec f, Vec g, Vec X, const char prefix[])
{
  const char *const names[]   = {"A", "C", "f", "g", "X"};
  const PetscObject objects[] = {(PetscObject)A, (PetscObject)C, (PetscObject)f, (PetscObject)g, (PetscObject)X};
  char              file[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  for (int k = 0; k < 5; k++) {
    PetscViewer viewer;

    PetscCall(PetscSNPrintf(file, sizeof(file), "%s_%s.dat", prefix, names[k]));
    PetscCall(PetscViewerBinaryOpen(PetscObjectComm(objects[k]), file, FILE_MODE_WRITE, &viewer));
    PetscCall(PetscObjectView(objects[k], viewer));
    PetscCall(PetscViewerDestroy(&viewer));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
