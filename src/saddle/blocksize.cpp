/*
   Recovers the block size of A (unknowns of a node), which programs lose when they build the saddle-point matrix, and
   which multigrid needs
*/
#include "saddle.h"
#include <algorithm>

/* Approximate number of rows of each rank that are examined */
static const PetscInt voters = 1000;

/*
   Finds the largest block size for which the rows of nearly all nodes touch the same nodes, 1 if there is none.
   Collective

   A nearly full matrix would vote for any size and is excluded.
*/
static PetscErrorCode Vote(Mat A, PetscInt *bs)
{
  struct Ballot {
    PetscInt yes = 0, all = 0, touched = 0;
  };
  std::vector<Ballot> ballots(AinsworthNodesLargest + 1); /* for each size */
  AinsworthNodeRows   rows;
  PetscInt            first, end, N;

  PetscFunctionBegin;
  *bs = 1;
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(MatGetOwnershipRange(A, &first, &end));
  for (PetscInt b = 2; b <= AinsworthNodesLargest; b++) {
    auto toNodes = [b](std::vector<PetscInt> *columns) {
      for (PetscInt &c : *columns) c /= b;
      columns->erase(std::unique(columns->begin(), columns->end()), columns->end());
    };

    for (PetscInt i = first; i + b <= end; i += b * PetscMax(1, (end - first) / voters)) {
      PetscCall(AinsworthCompareRows(A, i, 1, b, toNodes, &rows));
      if (!rows.votes) continue;
      ballots[b].yes += rows.same;
      ballots[b].all++;
      ballots[b].touched += rows.touched;
    }
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &ballots[0].yes, (PetscMPIInt)(3 * ballots.size()), MPIU_INT, MPI_SUM,
                           PetscObjectComm((PetscObject)A)));
  for (PetscInt b = AinsworthNodesLargest; b > 1 && *bs == 1; b--) {
    PetscBool divides;

    if (!ballots[b].all || ballots[b].yes < AinsworthNodesEnough * ballots[b].all) continue;
    if (ballots[b].touched > (PetscReal)N / b / 4.0 * ballots[b].all) continue;
    PetscCall(AinsworthBlocksDivide(A, b, &divides));
    if (divides) *bs = b;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the block size common to all primal blocks of a MatNest, 1 if they differ */
static PetscErrorCode GetCommon(Mat nest, const AinsworthSaddleBlocks *found, PetscInt *bs)
{
  PetscFunctionBegin;
  *bs = 0;
  for (size_t i = 0; i < found->fields.size(); i++) {
    Mat       block, inner;
    PetscInt  one, nr = 1;
    PetscBool is;

    if (found->multiplier[i]) continue;
    PetscCall(MatNestGetSubMat(nest, (PetscInt)i, (PetscInt)i, &block));
    if (!block) continue;
    PetscCall(PetscObjectTypeCompare((PetscObject)block, MATNEST, &is));
    if (is) PetscCall(MatNestGetSize(block, &nr, NULL));
    for (PetscInt j = 0; j < nr; j++) {
      inner = block;
      if (is) PetscCall(MatNestGetSubMat(block, j, j, &inner));
      if (!inner) continue;
      PetscCall(MatGetBlockSize(inner, &one));
      if (*bs != 0 && *bs != one) one = 1;
      *bs = one;
    }
  }
  *bs = PetscMax(*bs, 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts the primal components per node of a matrix with a block size; 1 if nodes differ */
static PetscErrorCode CountComponents(Mat mat, IS primal, PetscInt *components)
{
  PetscInt        bs, n, first, end, count[2];
  const PetscInt *index;

  PetscFunctionBegin;
  *components = 1;
  PetscCall(MatGetBlockSize(mat, &bs));
  if (bs < 2) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRange(mat, &first, &end));
  std::vector<PetscInt> nodes((end - first) / bs, 0);

  PetscCall(ISGetLocalSize(primal, &n));
  PetscCall(ISGetIndices(primal, &index));
  for (PetscInt i = 0; i < n; i++)
    if (index[i] >= first && index[i] < end && (i == 0 || index[i] > index[i - 1])) nodes[(index[i] - first) / bs]++;
  PetscCall(ISRestoreIndices(primal, &index));
  count[0] = nodes.empty() ? 0 : *std::max_element(nodes.begin(), nodes.end());
  count[1] = nodes.empty() ? 0 : -*std::min_element(nodes.begin(), nodes.end());
  if (nodes.empty()) count[1] = PETSC_MIN_INT;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)mat)));
  if (count[0] == -count[1] && count[0] > 0) *components = count[0];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Derives the block size 3 from six near-null vectors, the rigid-body modes in space; three may also be just
   translations
*/
static PetscErrorCode FromNearNullSpace(const AinsworthSaddleBlocks *found, PetscInt *bs)
{
  MatNullSpace near;
  PetscBool    constant;
  PetscInt     n = 0;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleGetNearNullSpace(found, &near));
  if (near) PetscCall(MatNullSpaceGetVecs(near, &constant, &n, NULL));
  *bs = n == 6 ? 3 : 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds nodes by the pattern of A, with contiguous unknowns or others; 1 and 1 if A does not give it. Collective */
static PetscErrorCode FromPattern(Mat A, PetscInt *bs, PetscInt *scattered)
{
  Mat                   aij;
  std::vector<PetscInt> order;

  PetscFunctionBegin;
  *bs = *scattered = 1;
  PetscCall(AinsworthFindOpaque(A, &aij));
  if (aij) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(A, &aij));
  PetscCall(Vote(aij, bs));
  if (*bs == 1) PetscCall(AinsworthFindNodes(aij, scattered, &order));
  PetscCall(MatDestroy(&aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Recovers the block size from what the program tells, from its matrices and fields, or from the pattern of A */
static PetscErrorCode Recover(Mat mat, AinsworthSaddleBlocks *found)
{
  Mat A = found->block[AINSWORTH_BLOCK_A];
  struct {
    PetscInt    bs     = 0;
    const char *source = NULL;
  } known[] = {
    {1, "A"                         },
    {1, "Pmat"                      },
    {1, "the blocks of the MatNest" },
    {1, "the index set of the field"},
    {1, "the nodes of the matrix"   },
    {1, "the pattern of A"          },
    {1, "the near null space"       }
  };

  PetscFunctionBegin;
  PetscCall(MatGetBlockSize(A, &known[0].bs));
  PetscCall(MatGetBlockSize(found->block[AINSWORTH_BLOCK_P], &known[1].bs));
  if (!found->extracted) PetscCall(GetCommon(mat, found, &known[2].bs));
  PetscCall(ISGetBlockSize(found->rows[0], &known[3].bs));
  if (found->extracted) PetscCall(CountComponents(mat, found->rows[0], &known[4].bs));
  PetscCall(FromNearNullSpace(found, &known[6].bs));
  for (auto &k : known) {
    PetscBool divides;

    if (&k == &known[5]) PetscCall(FromPattern(A, &k.bs, &found->scattered));
    if (found->scattered > 1) break;
    if (k.bs < 2) continue;
    PetscCall(AinsworthBlocksDivide(A, k.bs, &divides));
    if (!divides) continue;
    found->bs       = k.bs;
    found->bsSource = k.source;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  found->bs       = 1;
  found->bsSource = "nothing tells another";
  if (found->scattered > 1) found->bsSource = "nodes have several unknowns, not next to each other";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindBlockSize - sets found->bs and its source; sets the block size of matrices that were made here, not of
   the program's. Collective
*/
PetscErrorCode AinsworthFindBlockSize(const AinsworthSaddleInputs *in, Mat mat, const AinsworthSaddleBlocks *last,
                                      AinsworthSaddleBlocks *found)
{
  Mat       A = found->block[AINSWORTH_BLOCK_A];
  PetscBool divides;

  PetscFunctionBegin;
  found->scattered = 1;
  if (in->bs > 0) {
    PetscCall(AinsworthBlocksDivide(A, in->bs, &divides));
    PetscCheck(divides, PetscObjectComm((PetscObject)A), PETSC_ERR_ARG_SIZ,
               "-pc_ainsworth_block_size %" PetscInt_FMT
               " does not divide the number of rows that each rank has of %s, A",
               in->bs, found->name[AINSWORTH_BLOCK_A]);
    found->bs       = in->bs;
    found->bsSource = "-pc_ainsworth_block_size";
  } else if (found->made[AINSWORTH_BLOCK_A] && last && last->block[AINSWORTH_BLOCK_A] == A) {
    found->bs        = last->bs;
    found->scattered = last->scattered;
    found->bsSource  = last->bsSource;
  } else PetscCall(Recover(mat, found));
  for (int k : {AINSWORTH_BLOCK_A, AINSWORTH_BLOCK_P})
    if (found->made[k]) PetscCall(MatSetBlockSize(found->block[k], found->bs));
  PetscFunctionReturn(PETSC_SUCCESS);
}
