#include "hierarchy.h"
#include "half.h"
#include "path.h"
#include "../base/events.h"
#include <algorithm>
#include <numeric>

/*
   A hierarchy with a larger operator complexity costs more than it gains (docs/multigrid.md), and so does a level of
   more than half of the unknowns of the one before it, which a W-cycle visits twice as often. Therefore levels come to
   an end: each has at most half of the unknowns, or fewer on fewer ranks, as aggregates end at the borders of ranks.
   None has as many as the one before it: MatRestrict() could not tell its interpolation from its restriction
*/
static const PetscReal tooComplex = 2.5, tooLarge = 0.5;

PetscReal AinsworthHierarchy::complexity() const
{
  return finest.blocks ? 1.0 + first.entries() / finest.entries() : 1.0;
}

/*
   Chooses the ranks that own the next level, of which this rank has made `nodes` nodes with bs unknowns each.
   Collective

   Ranks with nodes are grouped in order, and the first rank of a group owns all of its nodes
*/
static PetscErrorCode ChooseLayout(MPI_Comm comm, PetscInt nodes, PetscInt bs, const AinsworthHierarchyOptions &options,
                                   AinsworthLayout *layout, PetscMPIInt *owners)
{
  PetscMPIInt           rank, size, owner = 0;
  PetscInt              total = 0, active = 0, before = 0, mine = 0;
  int                   group = 1;
  std::vector<PetscInt> made;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  made.resize(size);
  PetscCallMPI(MPI_Allgather(&nodes, 1, MPIU_INT, made.data(), 1, MPIU_INT, comm));
  for (PetscInt m : made) {
    total += m;
    active += m > 0;
  }
  if (options.rankSize < 0)
    (void)AinsworthPath({options.machine, (double)bs, (double)options.coarseSize}, (double)total, (int)active, &group);
  else if (total * bs < options.rankSize * active) {
    const PetscInt ranks = PetscMax(1, total * bs / options.rankSize);

    group = (int)((active + ranks - 1) / ranks);
  }
  for (PetscMPIInt r = 0; r < size; r++) {
    if (!made[r]) continue;
    if (before++ % group == 0) owner = r;
    if (owner == rank) mine += made[r];
  }
  *owners = (PetscMPIInt)((active + group - 1) / group);
  PetscCall(AinsworthLayoutCreate(comm, mine, layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Makes tentative interpolation to a level, whose nodes are grouped by the couplings in X, of which the squares of the
   norms of all blocks are given; ties: of this level, replaced by those of the next one. Collective

   *made: the next level has nodes, and not too many
*/
PetscErrorCode AinsworthHierarchy::coarsen(const AinsworthBlockMat &X, std::vector<PetscReal> &&square,
                                           PetscMPIInt ranks, const AinsworthHierarchyOptions &options,
                                           AinsworthTies *ties, AinsworthTentative *T, bool *made)
{
  const PetscInt           unknowns = X.cols.layout->N * X.rows.br;
  AinsworthAggregates      aggregates;
  AinsworthLayout          nodes;
  PetscMPIInt              owners = 0;
  std::vector<PetscScalar> coarse;

  PetscFunctionBegin;
  *made = false;
  if (unknowns <= options.coarseSize) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(AINSWORTH_Aggregate, 0, 0, 0, 0));
  PetscCall(AinsworthAggregate(X.rows, std::move(square), options.threshold, modes, &aggregates));
  PetscCall(PetscLogEventEnd(AINSWORTH_Aggregate, 0, 0, 0, 0));
  AinsworthTentativeCreate(aggregates, X.rows.br, modes, T, &coarse);
  PetscCall(AinsworthTentativeFollow(*ties, modes, &aggregates, T, &coarse));
  PetscCall(ChooseLayout(X.cols.layout->comm, aggregates.count, modes.k, options, &nodes, &owners));
  if (nodes->N == 0) PetscFunctionReturn(PETSC_SUCCESS);
  const PetscInt coarser = nodes->N * modes.k;
  if (coarser >= unknowns || (coarser > tooLarge * unknowns && owners == ranks)) {
    PetscCall(PetscSNPrintf(doubts, sizeof(doubts),
                            "level %d, of %" PetscInt_FMT " unknowns, cannot be made much smaller", (int)levels(),
                            unknowns));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthTentativePlace(aggregates, nodes, std::move(coarse), &modes, T));
  PetscCall(AinsworthTiesCoarsen(aggregates, *T, ties));
  T->ranks = owners;
  *made    = true;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Chooses what smooths the finest level, whose largest eigenvalue is known. Collective

   Where couplings in some directions are far stronger, as of stretched elements, an incomplete factor solves for them
*/
PetscErrorCode AinsworthHierarchy::chooseSmoother(const AinsworthTentative &T, const AinsworthHierarchyOptions &options)
{
  PetscFunctionBegin;
  if (options.smoother == AINSWORTH_SMOOTHER_DECIDE && finest.single)
    PetscCall(AinsworthFindCompatibleCondition(finest, T, &condition));
  finest.incomplete = options.smoother == AINSWORTH_SMOOTHER_INCOMPLETE || condition > AinsworthConditionOfJacobi;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthHierarchy::create - creates what is known of the levels from A alone. Collective

   A: AIJ, Hermitian, bs unknowns per node; nodes: the local rows node by node, empty if they are stored so; carry: what
   gets coarse functions although A has no entries there, as what is added to A will couple it to many others; embed:
   marks local nodes that get none, as others move them, or is empty
*/
PetscErrorCode AinsworthHierarchy::create(Mat A, PetscInt bs, std::vector<PetscInt> &&nodes, AinsworthModes &&near,
                                          const AinsworthCarried &carry, const std::vector<char> &embed,
                                          const AinsworthHierarchyOptions &options)
{
  AinsworthBlockMat      X;
  AinsworthHalf          product;
  AinsworthTentative     T;
  AinsworthTies          ties;
  AinsworthInterpolation interpolation;
  auto                   P = std::make_shared<AinsworthInterpolation>();
  PetscInt               rstart, rend;
  bool                   made;

  PetscFunctionBegin;
  modes  = std::move(near);
  order  = std::move(nodes);
  sorted = (PetscBool)!order.empty();
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &sorted, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)A)));
  PetscCall(MatGetOwnershipRange(A, &rstart, &rend));
  if (sorted && order.empty()) { /* this rank stores its rows so */
    order.resize(rend - rstart);
    std::iota(order.begin(), order.end(), 0);
  }
  PetscCall(AinsworthBlockMatOpen(A, bs, order, NULL, &X));
  AinsworthBlockSurvey survey(X);
  PetscCall(AinsworthModesFit(X, survey, &modes));
  carried = carry;
  modes.carried.assign(X.rows.n, 0);
  const std::vector<PetscInt> place = AinsworthInverse(order);
  for (PetscInt u : carry.unknowns)
    if (u >= rstart && u < rend) modes.carried[(order.empty() ? u - rstart : place[u - rstart]) / bs] = 1;
  AinsworthModesHold(survey, &modes);
  PetscCall(AinsworthTiesCreate(carried.rows, bs, order, &modes, &ties));
  if (!ties.cols.layout) carried.rows.reset(); /* no levels depend on them */
  embedded       = embed;
  modes.embedded = embed;
  PetscCall(AinsworthGridCreateFinest(X, survey, options.single, options.product, embedded, &finest));
  PetscCall(coarsen(X, std::move(survey.square), finest.ranks, options, &ties, &T, &made));
  if (made) {
    PetscCall(chooseSmoother(T, options));
    PetscCall(PetscLogEventBegin(AINSWORTH_Interpolation, A, 0, 0, 0));
    /* the coarse operator belongs to the rounded interpolation */
    PetscCall(
      AinsworthTentativeSmooth(X, T, *finest.diagonal, 4.0 / 3.0 / finest.largest, finest.single != NULL, P.get()));
    PetscCall(PetscLogEventEnd(AINSWORTH_Interpolation, A, 0, 0, 0));
    PetscCall(AinsworthGalerkin(X, *P, &product));
    finest.P = P;
  }
  if (!made) AinsworthGridTakeDouble(X, &finest);
  modes.embedded.clear();
  if (made) PetscCall(AinsworthGridStore(product, &first));
  for (PetscMPIInt ranks = first.ranks; made;) {
    PetscCall(AinsworthBlockMatOpenHalf(product.upper, std::move(product.outside.rows), product.outside.cols, &X));
    AinsworthTentative tentative; /* not T, whose memory is that of the finest level */
    PetscCall(coarsen(X, std::move(AinsworthBlockSurvey(X).square), ranks, options, &ties, &tentative, &made));
    if (!made) break;
    below.push_back(std::move(tentative));
    PetscCall(AinsworthTentativeInterpolate(below.back(), &interpolation));
    PetscCall(AinsworthGalerkin(X, interpolation, &product));
    ranks = below.back().ranks;
  }
  carriedToAll = (PetscInt)std::count(modes.carried.begin(), modes.carried.end(), 1);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &carriedToAll, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  modes.values.clear();
  modes.carried.clear();
  if (!doubts[0] && complexity() > tooComplex)
    PetscCall(PetscSNPrintf(doubts, sizeof(doubts),
                            "the first two levels together have %.3g times the entries of the finest",
                            (double)complexity()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthHierarchy::createGrids - creates all levels, of A or of A plus a matrix with entries in few rows. Collective

   Aggregates are those of A, as some must not cross a surface on which bodies slip, and so is interpolation to the
   finest level. Below it, interpolation is smoothed for the sum: otherwise coarse functions of two tied bodies would
   jump at the surface between them.

   Input Parameter:
.  added - what is added to the first coarser level, which takes it over, or NULL

   Output Parameter:
.  grids - the levels; the finest one is always that of A
*/
PetscErrorCode AinsworthHierarchy::createGrids(AinsworthHalf *added, std::vector<AinsworthGrid> *grids) const
{
  AinsworthBlockMat X;
  AinsworthHalf     half;

  PetscFunctionBegin;
  grids->assign(1, finest);
  if (!finest.P) PetscFunctionReturn(PETSC_SUCCESS);
  if (added) {
    PetscCall(AinsworthHalfAdd({first.upper, first.outside}, *added, &half));
    *added = AinsworthHalf();
  } else half = {first.upper, first.outside};
  for (size_t l = 0;; l++) {
    auto P = std::make_shared<AinsworthInterpolation>();

    grids->emplace_back();
    AinsworthGrid &grid = grids->back();
    PetscCall(AinsworthGridCreate(std::move(half), single() && l < below.size(), &grid));
    if (l == below.size()) break;
    PetscCall(AinsworthBlockMatOpenHalf(grid.upper, AinsworthBlockRows(grid.outside.rows), grid.outside.cols, &X));
    PetscCall(PetscLogEventBegin(AINSWORTH_Interpolation, 0, 0, 0, 0));
    PetscCall(AinsworthTentativeSmooth(X, below[l], *grid.diagonal, 4.0 / 3.0 / grid.largest, single(), P.get()));
    PetscCall(PetscLogEventEnd(AINSWORTH_Interpolation, 0, 0, 0, 0));
    PetscCall(AinsworthGalerkin(X, *P, &half));
    grid.P = P;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthHierarchy::replaceFinest - replaces the finest level for an A with other values; keeps interpolation and
   what is known of the coarser levels. Collective

   A: as in create(), with the same distribution
*/
PetscErrorCode AinsworthHierarchy::replaceFinest(Mat A, const AinsworthHierarchyOptions &options)
{
  AinsworthBlockMat X;
  AinsworthGrid     grid;

  PetscFunctionBegin;
  PetscCall(AinsworthBlockMatOpen(A, finest.bs, order, NULL, &X));
  const AinsworthBlockSurvey survey(X);
  PetscCall(AinsworthGridCreateFinest(X, survey, options.single, options.product, embedded, &grid));
  grid.P          = finest.P;
  grid.incomplete = finest.incomplete;
  if (!grid.P) AinsworthGridTakeDouble(X, &grid);
  finest = std::move(grid);
  PetscFunctionReturn(PETSC_SUCCESS);
}
