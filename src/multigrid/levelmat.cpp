#include "levelmat.h"
#include "../base/hermitian.h"
#include "../base/layouts.h"
#include <petsc/private/matimpl.h>

PetscErrorCode AinsworthLevelMatGet(Mat mat, AinsworthLevel **level)
{
  PetscBool same;

  PetscFunctionBegin;
  *level = NULL;
  PetscCall(PetscObjectTypeCompare((PetscObject)mat, AINSWORTH_LEVEL_MAT, &same));
  if (same) PetscCall(MatShellGetContext(mat, level));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMult_Level(Mat mat, Vec x, Vec y)
{
  AinsworthLevel    *level;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  if (!level->product) {
    if (level->joined) PetscCall(level->joined->mult(x, y));
    else PetscCall(level->single->mult(x, y));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArrayWrite(y, &to));
  PetscCall(level->product->mult(from, to));
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMultTranspose_Level(Mat mat, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(AinsworthApplyConjugated(x, y, [mat](Vec v, Vec w) { return MatMult_Level(mat, v, w); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the residual; the smoother in single precision has already done half of the work */
static PetscErrorCode MatResidual_Level(Mat mat, Vec b, Vec x, Vec r)
{
  AinsworthLevel *level;
  bool            found = false;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  if (level->single) PetscCall(level->single->residual(level->exact(), b, x, r, &found));
  if (!found) {
    PetscCall(MatMult(mat, x, r));
    PetscCall(VecAYPX(r, -1.0, b));
  }
  if (level->subspace) PetscCall(level->subspace->project(true, level->width, r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatGetDiagonal_Level(Mat mat, Vec d)
{
  AinsworthLevel *level;
  PetscScalar    *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  PetscCall(VecGetArrayWrite(d, &to));
  for (PetscReal v : *level->diagonal) to = std::fill_n(to, level->width, PetscScalar(v));
  to -= level->diagonal->size() * level->width;
  PetscCall(VecRestoreArrayWrite(d, &to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetSymmetric(Mat mat)
{
  PetscFunctionBegin;
  PetscCall(MatSetOption(mat, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  if (!PetscDefined(USE_COMPLEX)) PetscCall(MatSetOption(mat, MAT_SPD, PETSC_TRUE)); /* implies A = A^T */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Converts to AIJ, for factorizations and for users of PCGetCoarseOperators() */
static PetscErrorCode MatConvert_Level_AIJ(Mat mat, MatType, MatReuse reuse, Mat *newmat)
{
  AinsworthLevel   *level;
  AinsworthBlockMat blocks;
  Mat               B;
  auto              open = [&](const auto &product, const std::shared_ptr<const AinsworthBlockRows> &upper) {
    return AinsworthBlockMatOpenHalf(upper, AinsworthBlockRows(*product.rest), *product.cols, &blocks);
  };

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  PetscCheck(level->exact(), PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP,
             "The level is stored in single precision: use -pc_blocksa_precision double");
  PetscCheck(reuse != MAT_REUSE_MATRIX, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP,
             "MatConvert() of a level operator makes a new matrix only");
  if (level->product) PetscCall(open(*level->product, level->product->upper));
  else PetscCall(open(*level->joined->product, level->joined->join()));
  blocks.store();
  PetscCall(AinsworthBlocksToAIJ(blocks.rows, blocks.cols, mat, &B));
  if (level->joined) PetscCall(level->joined->unscale(B));
  PetscCall(SetSymmetric(B));
  if (reuse == MAT_INPLACE_MATRIX) PetscCall(MatHeaderReplace(mat, &B));
  else *newmat = B;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatDestroy_Level(Mat mat)
{
  AinsworthLevel *level;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  delete level;
  PetscCall(PetscObjectComposeFunction((PetscObject)mat, "MatConvert_" AINSWORTH_LEVEL_MAT "_aij_C", NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthLevelMatSet - creates a matrix for a level operator with bs unknowns per node, or replaces the operator of
   an existing one and increases its state
*/
PetscErrorCode AinsworthLevelMatSet(const AinsworthLayout &nodes, PetscInt bs, std::unique_ptr<AinsworthLevel> &&level,
                                    Mat *mat)
{
  AinsworthLevel *old;
  PetscLayout     layout;

  PetscFunctionBegin;
  if (*mat) {
    PetscCall(MatShellGetContext(*mat, &old));
    delete old;
    PetscCall(MatShellSetContext(*mat, level.release()));
    PetscCall(PetscObjectStateIncrease((PetscObject)*mat));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthLayoutOfBlocks(nodes->comm, nodes.get(), bs * level->width, bs, &layout));
  PetscCall(AinsworthCreateShellOn(nodes->comm, layout, layout, level.release(), mat));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT, (void (*)(void))MatMult_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMultTranspose_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_RESIDUAL, (void (*)(void))MatResidual_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_GET_DIAGONAL, (void (*)(void))MatGetDiagonal_Level));
  PetscCall(MatShellSetOperation(*mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Level));
  PetscCall(PetscObjectChangeTypeName((PetscObject)*mat, AINSWORTH_LEVEL_MAT));
  PetscCall(
    PetscObjectComposeFunction((PetscObject)*mat, "MatConvert_" AINSWORTH_LEVEL_MAT "_aij_C", MatConvert_Level_AIJ));
  PetscCall(SetSymmetric(*mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns a number in [-1, 1) that depends on l alone, so that it is the same on any number of ranks */
static PetscReal Hash(size_t l)
{
  unsigned long long s = (unsigned long long)l * 0x9E3779B97F4A7C15ull + 0x1234567ull;

  s ^= s >> 29;
  s *= 0xBF58476D1CE4E5B9ull;
  s ^= s >> 32;
  return (PetscReal)((double)(s >> 11) / 4503599627370496.0 - 1.0);
}

/*
   AinsworthLevel::stay - keeps the cycle in a subspace on this level: W takes the place of the inverse diagonal where Q
   changes anything
*/
void AinsworthLevel::stay(const std::shared_ptr<const AinsworthLevelSubspace> &in)
{
  subspace = in;
  if (!single || !in) return;
  const PetscInt bs = single->product->bs(), stride = single->product->stride();

  for (size_t k = 0; k < in->at.size(); k++) {
    const PetscReal w = (*single->w)[in->at[k]];

    single->inverse[in->at[k] / bs * stride + in->at[k] % bs] = (AinsworthSingle)(in->space->weight[k] / (w * w));
  }
}

std::unique_ptr<AinsworthLevel> AinsworthLevel::widen(PetscInt vectors) const
{
  auto wide = std::make_unique<AinsworthLevel>();
  auto with = [=](const auto &of) {
    return std::make_unique<std::decay_t<decltype(*of)>>(of->upper, of->rest, of->cols, vectors);
  };

  wide->width    = vectors;
  wide->diagonal = diagonal;
  wide->largest  = largest;
  wide->subspace = subspace;
  if (product) wide->product = with(product);
  if (joined) wide->joined = std::make_unique<AinsworthJoined>(joined->w, with(joined->product));
  if (!single) return wide;
  wide->single          = std::make_unique<AinsworthScaled>();
  wide->single->w       = single->w;
  wide->single->s       = single->s;
  wide->single->inverse = single->inverse;
  wide->single->product = with(single->product);
  wide->single->createWork();
  return wide;
}

/* Computes z = D^{-1} r or, in a subspace, Q W Q' r, for the estimate below */
static PetscErrorCode ApplyWeight(PC pc, Vec r, Vec z)
{
  AinsworthLevel *level;
  Mat             mat;
  Vec             weight;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &weight));
  PetscCall(PCGetOperators(pc, &mat, NULL));
  PetscCall(AinsworthLevelMatGet(mat, &level));
  PetscCall(VecCopy(r, z));
  if (level->subspace && level->subspace->space->excess > 0.0) PetscCall(level->subspace->project(true, 1, z));
  PetscCall(VecPointwiseMult(z, weight, z));
  if (level->subspace) PetscCall(level->subspace->project(false, 1, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Estimates the largest eigenvalue by so many steps of conjugate gradients, or by those that can be made; 1 if none
   can. Collective

   Where a step breaks down, as where the residual becomes 0, PETSc 3.18 counts it, although its coefficients were never
   set: what is in memory there, which may be other numbers or NaN on each rank, becomes an eigenvalue, or its search
   never ends. So these steps are repeated without the last one
*/
static PetscErrorCode LargestEigenvalue(Mat mat, Vec weight, Vec b, Vec x, PetscInt steps, PetscReal *largest)
{
  PetscReal   least;
  PetscInt    made;
  PetscMPIInt size;
  bool        complete = false;

  PetscFunctionBegin;
  *largest = 1.0;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)mat), &size));
  while (steps > 0 && !complete) {
    KSP                ksp;
    PC                 pc;
    KSPConvergedReason reason;

    PetscCall(KSPCreate(PetscObjectComm((PetscObject)mat), &ksp));
    PetscCall(KSPSetOptionsPrefix(ksp, "blocksa_estimate_")); /* not asked by the program's -ksp_converged_reason */
    PetscCall(KSPSetType(ksp, KSPCG));
    PetscCall(
      KSPCGUseSingleReduction(ksp, (PetscBool)(size > 1))); /* a product more in all, a reduction less in each step */
    PetscCall(KSPSetOperators(ksp, mat, mat));
    PetscCall(KSPSetNormType(ksp, KSP_NORM_NONE));
    PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, steps));
    PetscCall(KSPSetComputeSingularValues(ksp, PETSC_TRUE));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCSetType(pc, PCSHELL));
    PetscCall(PCShellSetContext(pc, weight));
    PetscCall(PCShellSetApply(pc, ApplyWeight));
    PetscCall(KSPSolve(ksp, b, x));
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    PetscCall(KSPGetIterationNumber(ksp, &made));
    complete = reason == KSP_CONVERGED_ITS || reason == KSP_DIVERGED_ITS;
    if (complete) PetscCall(KSPComputeExtremeSingularValues(ksp, largest, &least));
    else steps = PetscMin(steps, made) - 1;
    PetscCall(KSPDestroy(&ksp));
  }
  if (!(*largest > 0.0)) *largest = 1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthLevelMatEstimate - estimates the largest eigenvalue of D^{-1} M or, in a subspace, of Q W Q' M, somewhat
   from below, by steps of conjugate gradients. Collective

   The first residual is r_i = sqrt(m_ii) times a random number, so that stiff and soft unknowns have the same share.
   added: M is A plus a matrix with entries in these rows, and `largest` holds the eigenvalue of A. If that of M is
   larger, its eigenvector is near these rows, and starting there finds it in half of the steps (docs/multigrid.md).
   embedded: M is meant without the rows and columns of these nodes; empty: none
*/
PetscErrorCode AinsworthLevelMatEstimate(Mat mat, const AinsworthBlockRows *added, const std::vector<char> &embedded)
{
  AinsworthLevel *level;
  Vec             b, x, weight;
  PetscScalar    *r, *w;
  PetscReal       largest;
  PetscInt        bs, rstart;

  PetscFunctionBegin;
  PetscCall(AinsworthLevelMatGet(mat, &level));
  PetscCall(MatGetBlockSize(mat, &bs));
  PetscCall(AinsworthCreateVecs(mat, &x, &b));
  PetscCall(VecDuplicate(b, &weight));
  PetscCall(VecGetOwnershipRange(b, &rstart, NULL));
  PetscCall(VecGetArrayWrite(b, &r));
  PetscCall(VecGetArrayWrite(weight, &w));
  const std::vector<PetscReal> &diagonal = *level->diagonal;
  for (PetscInt l = 0; l < (PetscInt)diagonal.size(); l++) {
    const bool starts = !added || added->i[l / bs] < added->i[l / bs + 1];

    r[l] = starts ? PetscSqrtReal(diagonal[l]) * Hash((size_t)(rstart + l)) : 0.0;
    w[l] = embedded.empty() || !embedded[l / bs] ? 1.0 / diagonal[l] : 0.0;
  }
  if (level->subspace)
    for (size_t k = 0; k < level->subspace->at.size(); k++)
      w[level->subspace->at[k]] = level->subspace->space->weight[k];
  PetscCall(VecRestoreArrayWrite(weight, &w));
  PetscCall(VecRestoreArrayWrite(b, &r));
  PetscCall(LargestEigenvalue(mat, weight, b, x, added ? 5 : 10, &largest));
  level->largest = added ? PetscMax(largest, level->largest) : largest;
  for (Vec *v : {&b, &x, &weight}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}
