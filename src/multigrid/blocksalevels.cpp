/* The levels of A alone: whether those of the last set-up still hold, and new ones */
#include "blocksaimpl.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/matrices.h"
#include <algorithm>

/*
   PCBlockSAFindNodes_Private - gets the number of unknowns per node of the levels of A: that of the matrix that has A,
   which may not know it, of A, or of its pattern. Collective

   order: the local rows node by node; empty if nodes are contiguous
*/
PetscErrorCode PCBlockSAFindNodes_Private(PetscInt known, Mat A, PetscInt *bs, std::vector<PetscInt> *order)
{
  Mat aij;

  PetscFunctionBegin;
  order->clear();
  *bs = known;
  if (*bs == 1) PetscCall(MatGetBlockSize(A, bs));
  if (*bs > 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthGetAIJ(A, &aij));
  PetscCall(AinsworthFindNodes(aij, bs, order));
  PetscCall(MatDestroy(&aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the diagonal of the finest level in the program's order */
static std::vector<PetscReal> Unsorted(const AinsworthHierarchy &h)
{
  std::vector<PetscReal> diagonal(*h.finest.diagonal);

  for (size_t l = 0; l < h.order.size(); l++) diagonal[h.order[l]] = (*h.finest.diagonal)[l];
  return diagonal;
}

/* Gets the columns of the local rows that have entries, one row after another, each with its length before it */
static PetscErrorCode GetPattern(Mat rows, std::vector<PetscInt> *pattern)
{
  PetscFunctionBegin;
  PetscCall(AinsworthForRows(rows, [&](const AinsworthMatRow &row) {
    if (!row.n) return;
    pattern->push_back(row.n);
    pattern->insert(pattern->end(), row.j, row.j + row.n);
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks whether the nodes that follow others, if there are any, still do so by rows with the same pattern. The same on
   all ranks only with the others
*/
static PetscErrorCode FollowAsBefore(const AinsworthHierarchy &h, Mat rows, PetscBool *same)
{
  std::vector<PetscInt> before, now;

  PetscFunctionBegin;
  *same = PETSC_TRUE;
  if (!h.carried.rows || h.carried.rows == rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(GetPattern(h.carried.rows, &before));
  if (rows) PetscCall(GetPattern(rows, &now));
  *same = (PetscBool)(before == now);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the levels of this PC have to carry */
static AinsworthCarried GetCarried(const PC_BlockSA *sa)
{
  return sa->subspace ? sa->subspace->carried : AinsworthCarried();
}

/*
   Checks whether there are levels with the same block size whose coarse functions reach all that they have to.
   Collective
*/
static PetscErrorCode HasLevels(PC pc, const PC_BlockSA *sa, Mat A, PetscInt bs, PetscBool *has)
{
  const AinsworthHierarchy *h     = sa->levels.hierarchy.get();
  const AinsworthCarried    carry = GetCarried(sa);
  PetscInt                  n;
  PetscBool                 follow = PETSC_TRUE;

  PetscFunctionBegin;
  if (h) PetscCall(FollowAsBefore(*h, carry.rows, &follow));
  if (sa->subspace && sa->subspace->map) PetscCall(MatGetLocalSize(sa->subspace->map, NULL, &n));
  else PetscCall(MatGetLocalSize(A, NULL, &n));
  *has = (PetscBool)(!sa->stale && follow && h && h->finest.bs == bs && h->finest.nodes->n * bs == n &&
                     std::includes(h->carried.unknowns.begin(), h->carried.unknowns.end(), carry.unknowns.begin(),
                                   carry.unknowns.end()));
  if (*has && !h->embedded.empty()) {
    const std::vector<char> embedded = AinsworthSubspaceEmbedded(sa, h->finest.bs, h->order);

    for (size_t i = 0; i < h->embedded.size(); i++)
      if (h->embedded[i] && (embedded.empty() || !embedded[i])) *has = PETSC_FALSE;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, has, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)pc)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the coordinates of the nodes in their order; if the program stores its unknowns in another order it may have
   given coordinates of all unknowns
*/
static PetscErrorCode GetCoordinates(PC pc, const PC_BlockSA *sa, Mat A, PetscInt bs,
                                     const std::vector<PetscInt> &order, std::vector<PetscReal> *x)
{
  const PetscInt dim = sa->dim;
  PetscInt       n, given = (PetscInt)sa->coordinates.size(), wanted;

  PetscFunctionBegin;
  *x = sa->coordinates;
  if (!dim) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(A, &n, NULL));
  wanted = n / bs * dim;
  if (!order.empty() && given == n * dim) {
    for (PetscInt l = 0; l < wanted; l++) (*x)[l] = sa->coordinates[order[l / dim * bs] * dim + l % dim];
    given = wanted;
  }
  PetscCall(AinsworthFirstMismatch(PetscObjectComm((PetscObject)pc), &given, &wanted));
  PetscCheck(given == wanted, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_SIZ,
             "PCSetCoordinates() was called with %" PetscInt_FMT
             " coordinates on a rank, but the matrix needs %" PetscInt_FMT " there, with its blocks of %" PetscInt_FMT,
             given, wanted, bs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Replaces the finest level and keeps the coarser levels of an earlier A; *rebuild: impossible, because the precision
   would change
*/
static PetscErrorCode KeepCoarse(PC pc, PC_BlockSA *sa, Mat A, MatNullSpace near, PetscBool *rebuild)
{
  auto       hierarchy = std::make_shared<AinsworthHierarchy>(*sa->levels.hierarchy);
  const bool single    = hierarchy->single();
  Mat        aij;

  PetscFunctionBegin;
  sa->levels.hierarchy.reset();
  PetscCall(PCBlockSAGetAIJ_Private(sa, A, &aij));
  PetscCall(hierarchy->replaceFinest(aij, sa->options));
  PetscCall(MatDestroy(&aij));
  *rebuild = (PetscBool)(hierarchy->single() != single);
  if (*rebuild) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(pc, "A has other values: the coarser levels are kept nevertheless\n"));
  PetscCall(MatDestroy(&sa->product));
  sa->levels.hierarchy = hierarchy;
  if (sa->levels.alone) {
    auto grids       = std::make_shared<std::vector<AinsworthGrid>>(*sa->levels.alone);
    (*grids)[0]      = hierarchy->finest;
    sa->levels.alone = grids;
  }
  sa->old = PETSC_TRUE;
  PetscCall(sa->levels.fingerprint.take(A, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the levels of A, again if A, its near null space, or an option changed */
PetscErrorCode PCBlockSASetUpLevels_Private(PC pc, PC_BlockSA *sa, Mat A, PetscBool *rebuild)
{
  Mat                    aij;
  MatNullSpace           near;
  PetscInt               bs, known, n, all;
  PetscBool              same = PETSC_FALSE, fits = PETSC_FALSE, has;
  AinsworthModes         modes;
  std::vector<PetscInt>  order;
  std::vector<PetscReal> coordinates;

  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(pc->pmat, &near));
  if (!near) PetscCall(MatGetNearNullSpace(A, &near));
  if (!near) PetscCall(MatGetNearNullSpace(pc->mat, &near));
  PetscCall(MatGetBlockSize(pc->pmat, &known));
  PetscCall(PCBlockSAFindNodes_Private(known, A, &bs, &order));
  PetscCall(HasLevels(pc, sa, A, bs, &has));
  if (has) PetscCall(sa->levels.fingerprint.holds(A, near, Unsorted(*sa->levels.hierarchy), &same, &fits));
  *rebuild = (PetscBool)(!fits || (!sa->keep && (!same || sa->old)));
  if (!*rebuild && same) {
    PetscCall(PetscInfo(pc, "A has the values that it had: its levels are kept\n"));
    PetscCall(sa->levels.fingerprint.identify(A, near));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!*rebuild) PetscCall(KeepCoarse(pc, sa, A, near, rebuild));
  if (!*rebuild) PetscFunctionReturn(PETSC_SUCCESS);
  sa->old = PETSC_FALSE;
  if (bs > 1 && !order.empty())
    PetscCall(
      PetscInfo(pc, "Nodes have %" PetscInt_FMT " unknowns, by the pattern of A, not next to each other\n", bs));
  PetscCall(GetCoordinates(pc, sa, A, bs, order, &coordinates));
  sa->levels = AinsworthLevels();
  PetscCall(MatDestroy(&sa->product));
  PetscCall(AinsworthModesCreate(A, bs, order, near, sa->dim, coordinates.data(), &modes));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(PCBlockSAGetAIJ_Private(sa, A, &aij));
  PetscCall(MatGetLocalSize(aij, &all, NULL));
  for (PetscInt l = n; l < all && !order.empty(); l++) order.push_back(l);
  modes.values.resize((size_t)all * modes.k, 0.0); /* no mode moves what is not in A */
  if (!modes.rotations)
    PetscCall(PetscInfo(pc, "Neither a near null space nor coordinates: with rigid-body modes (MatSetNearNullSpace(), "
                            "PCSetCoordinates()) slender bodies "
                            "take 2 to 5 times less\n"));
  auto                    hierarchy = std::make_shared<AinsworthHierarchy>();
  const std::vector<char> embedded  = AinsworthSubspaceEmbedded(sa, bs, order);
  PetscCall(hierarchy->create(aij, bs, std::move(order), std::move(modes), GetCarried(sa), embedded, sa->options));
  PetscCall(MatDestroy(&aij));
  sa->levels.hierarchy = hierarchy;
  sa->stale            = PETSC_FALSE;
  PetscCall(sa->levels.fingerprint.take(A, near));
  if (hierarchy->doubts[0])
    PetscCall(PetscInfo(pc, "%s: PC type hypre may be faster on this matrix\n", hierarchy->doubts));
  PetscFunctionReturn(PETSC_SUCCESS);
}
