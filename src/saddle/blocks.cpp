/* Where the blocks of the saddle point are in the program's matrix: one finder for each layout; nothing after it sees the layout */
#include "saddle.h"
#include <petsc/private/petscimpl.h>
#include <limits>

/* Collective: refuses a block that waits for its assembly on any rank; each rank knows only of the values that it set itself */
static PetscErrorCode CheckAssembled(Mat M, const char name[])
{
  PetscBool assembled;

  PetscFunctionBegin;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAssembled(M, &assembled));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &assembled, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)M)));
  PetscCheck(assembled, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_WRONGSTATE, "%s is not assembled: call MatAssemblyBegin() and MatAssemblyEnd() on it",
             name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBlockNorm - the Frobenius norm of a block, 0 where it is absent or zero and only there, Inf where its type has none

   Collective. A is looked at once while it does not change, however often C does.
*/
PetscErrorCode AinsworthBlockNorm(Mat M, PetscReal *norm)
{
  static PetscInt normId = -1;
  PetscBool       has, known;
  PetscInt        row, col;
  uint64_t        state;

  PetscFunctionBegin;
  *norm = 0.0;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthMatGetState(M, &state)); /* changes of its parts come to its own state */
  PetscCall(MatHasOperation(M, MATOP_NORM, &has));
  if (!has) {
    *norm = PETSC_INFINITY;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (normId < 0) PetscCall(PetscObjectComposedDataRegister(&normId));
  PetscCall(PetscObjectComposedDataGetReal((PetscObject)M, normId, *norm, known));
  if (known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNorm(M, NORM_FROBENIUS, norm));
  if (*norm == 0.0) { /* or the squares of its entries underflow */
    PetscCall(AinsworthMatFindNonzero(M, &row, &col));
    if (row >= 0) *norm = std::numeric_limits<PetscReal>::min();
  }
  PetscCall(PetscObjectComposedDataSetReal((PetscObject)M, normId, *norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collective: the largest entry of the diagonal, its real part */
static PetscErrorCode LargestDiagonal(Mat M, PetscReal *largest)
{
  Vec d;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(M, NULL, &d));
  PetscCall(MatGetDiagonal(M, d));
  PetscCall(VecMax(d, NULL, largest));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Which block is A? The multipliers' is absent or zero; where neither is, it is the one that is diagonal; of two diagonal ones the one without positive
   entries, then the smaller, of two equal ones (1,1)
*/
static PetscErrorCode ChoosePrimal(Mat mat, const Mat diagonal[2], PetscInt *primal)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)mat);
  PetscReal norm[2], largest[2];
  PetscInt  n[2], row[2] = {0, 0}, col[2] = {0, 0}, l;
  PetscBool rows[2];

  PetscFunctionBegin;
  for (int i = 0; i < 2; i++) PetscCall(AinsworthBlockNorm(diagonal[i], &norm[i]));
  PetscCheck(norm[0] != 0.0 || norm[1] != 0.0, comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no primal block: blocks (0,0) and (1,1) of the MatNest are both absent or zero, A must be one of them");
  if (norm[0] == 0.0 || norm[1] == 0.0) {
    *primal = norm[0] == 0.0 ? 1 : 0;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (int i = 0; i < 2; i++) {
    PetscCall(MatGetSize(diagonal[i], &n[i], NULL));
    PetscCall(MatHasOperation(diagonal[i], MATOP_GET_ROW, &rows[i]));
    if (rows[i]) PetscCall(AinsworthMatFindOffDiagonal(diagonal[i], &row[i], &col[i]));
  }
  l = n[0] < n[1] ? 0 : 1;
  for (int i = 0; i < 2; i++) {
    PetscCheck(
      rows[i], comm, PETSC_ERR_ARG_WRONG,
      "PCAINSWORTH found no multipliers: blocks (0,0) and (1,1) of the MatNest are both nonzero, and the type %s of (%d,%d) has no rows to look at; leave "
      "the block of the multipliers absent, or pass an AIJ matrix",
      ((PetscObject)diagonal[i])->type_name, i, i);
    PetscCall(LargestDiagonal(diagonal[i], &largest[i]));
  }
  if ((largest[0] > 0.0) != (largest[1] > 0.0)) l = largest[0] > 0.0 ? 1 : 0;
  else if (row[l] >= 0 && row[1 - l] < 0) l = 1 - l;
  *primal = 1 - l;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A MatNest of 2 x 2 blocks, the multipliers first or last */
static PetscErrorCode FindInNest(Mat mat, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  PetscInt nr, nc, p = 0, l;
  IS       rows[2], cols[2];

  PetscFunctionBegin;
  PetscCall(MatNestGetSize(mat, &nr, &nc));
  PetscCheck(nr == 2 && nc == 2, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_SIZ,
             "PCAINSWORTH needs a MatNest of 2 x 2 blocks, [A C'; C 0], and got %" PetscInt_FMT " x %" PetscInt_FMT
             ": gather the primal fields in one block and the multipliers in another",
             nr, nc);
  if (last) p = last->primal;
  else {
    Mat diagonal[2];

    for (PetscInt i = 0; i < 2; i++) {
      char name[32];

      PetscCall(MatNestGetSubMat(mat, i, i, &diagonal[i]));
      PetscCall(PetscSNPrintf(name, sizeof(name), "Block (%" PetscInt_FMT ",%" PetscInt_FMT ") of the MatNest", i, i));
      PetscCall(CheckAssembled(diagonal[i], name));
    }
    PetscCall(ChoosePrimal(mat, diagonal, &p));
  }
  l             = 1 - p;
  found->primal = p;
  PetscCall(MatNestGetISs(mat, rows, cols));
  for (PetscInt i = 0; i < 2; i++) {
    for (PetscInt j = 0; j < 2; j++) {
      const int k = i == p ? (j == p ? AINSWORTH_BLOCK_A : AINSWORTH_BLOCK_B) : (j == p ? AINSWORTH_BLOCK_C : AINSWORTH_BLOCK_D);

      PetscCall(MatNestGetSubMat(mat, i, j, &found->block[k]));
      PetscCall(PetscSNPrintf(found->name[k], sizeof(found->name[k]), "Block (%" PetscInt_FMT ",%" PetscInt_FMT ") of the MatNest", i, j));
    }
    found->rows[i] = rows[i ? l : p];
    found->cols[i] = cols[i ? l : p];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The layouts that are understood, by the type of the program's matrix */
static const struct {
  MatType type;
  PetscErrorCode (*find)(Mat, const AinsworthSaddleBlocks *, AinsworthSaddleBlocks *);
} layouts[] = {
  {MATNEST, FindInNest}
};

/*
   AinsworthSaddleFindBlocks - the blocks of the program's matrix with their states, and the index sets of its fields; to be reset

   Collective where last is NULL. Otherwise the fields are what they were in `last`, as far as the layout is the same, and no value is looked at: to
   compare both.
*/
PetscErrorCode AinsworthSaddleFindBlocks(Mat mat, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  *found = AinsworthSaddleBlocks();
  for (const auto &layout : layouts) {
    PetscBool same;

    PetscCall(PetscObjectTypeCompare((PetscObject)mat, layout.type, &same));
    if (!same) continue;
    found->layout = layout.type;
    PetscCall(layout.find(mat, last && last->layout == layout.type ? last : NULL, found));
  }
  PetscCheck(found->layout, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH needs a matrix of type nest, [A C'; C 0], and got type %s: build it with MatCreateNest()", ((PetscObject)mat)->type_name);
  for (int k = 0; k < AINSWORTH_BLOCKS; k++) {
    if (!last) PetscCall(CheckAssembled(found->block[k], found->name[k]));
    PetscCall(PetscObjectReference((PetscObject)found->block[k]));
    PetscCall(AinsworthMatGetState(found->block[k], &found->state[k]));
  }
  for (int k = 0; k < 2; k++) {
    PetscCall(PetscObjectReference((PetscObject)found->rows[k]));
    PetscCall(PetscObjectReference((PetscObject)found->cols[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSaddleResetBlocks(AinsworthSaddleBlocks *b)
{
  PetscFunctionBegin;
  for (Mat &M : b->block) PetscCall(MatDestroy(&M));
  for (int k = 0; k < 2; k++) {
    PetscCall(ISDestroy(&b->rows[k]));
    PetscCall(ISDestroy(&b->cols[k]));
  }
  b->layout = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}
