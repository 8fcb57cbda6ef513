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

PetscErrorCode AinsworthLevel::mult(PetscReal scale, const PetscScalar *x, PetscScalar *y)
{
  PetscFunctionBegin;
  if (product) PetscCall(product->mult(x, y));
  else if (joined) PetscCall(joined->mult(x, y));
  else PetscCall(single->mult(scale, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMult_Level(Mat mat, Vec x, Vec y)
{
  AinsworthLevel    *level;
  PetscReal          scale = 1.0;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &level));
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArrayWrite(y, &to));
  if (!level->exact()) PetscCall(level->single->findScale(from, &scale));
  PetscCall(level->mult(scale, from, to));
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

/* AinsworthLevelMatSetDefinite - marks a matrix as Hermitian and positive definite */
PetscErrorCode AinsworthLevelMatSetDefinite(Mat mat)
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
  PetscCall(AinsworthLevelMatSetDefinite(B));
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
  PetscCall(AinsworthLevelMatSetDefinite(*mat));
  PetscFunctionReturn(PETSC_SUCCESS);
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
  wide->single->factor  = single->factor;
  wide->single->product = with(single->product);
  wide->single->createWork();
  return wide;
}
