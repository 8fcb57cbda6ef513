#include "hierarchy.h"
#include "../events.h"
#include <algorithm>

/* If neighboring diagonals differ by a larger factor, single precision loses the coarse modes of the stiff part (measured, docs/multigrid.md) */
static const PetscReal jumpOfSingle = 1e8;
/* A hierarchy with a larger operator complexity, or with a level that is not much smaller than the one before it, costs more than it gains */
static const PetscReal tooComplex = 2.5, tooLarge = 0.5;
static const size_t    mostLevels = 10;

PetscReal AinsworthHierarchy::complexity() const
{
  PetscReal entries = 0.0;

  for (const AinsworthGrid &grid : grids) entries += (PetscReal)grid.blocks * grid.bs * grid.bs;
  return grids.size() && grids[0].blocks ? entries / ((PetscReal)grids[0].blocks * grids[0].bs * grids[0].bs) : 1.0;
}

/*
   Reads the diagonal and replaces zeros by the mean of the nonzero entries on all ranks; collective

   coarse: replaces them in the matrix, too, where unknowns that no mode reaches have zero rows; those of carried nodes that modes reach get entries later, from
   what is added to A
*/
static PetscErrorCode ReadDiagonal(AinsworthBlockMat &X, bool coarse, const AinsworthModes &modes, std::vector<PetscReal> *diagonal)
{
  AinsworthBlockRows &rows   = X.rows;
  const PetscInt      bs = rows.br, k = modes.k;
  PetscReal           sum[2] = {0.0, 0.0};
  auto                moves  = [&](PetscInt l) { return std::any_of(&modes.values[l * k], &modes.values[l * k] + k, [](PetscScalar v) { return v != 0.0; }); };

  PetscFunctionBegin;
  diagonal->assign((size_t)rows.n * bs, 0.0);
  for (PetscInt i = 0; i < rows.n; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] == i)
        for (PetscInt c = 0; c < bs; c++) (*diagonal)[i * bs + c] = PetscAbsScalar(rows.block(k)[c * bs + c]);
  for (PetscReal d : *diagonal) {
    sum[0] += d;
    sum[1] += d > 0.0;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPIU_SUM, X.cols.layout->comm));
  const PetscReal mean = sum[1] > 0.0 ? sum[0] / sum[1] : 1.0;

  for (PetscInt i = 0; i < rows.n && coarse; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] == i)
        for (PetscInt c = 0; c < bs; c++)
          if ((*diagonal)[i * bs + c] == 0.0 && !(modes.carried[i] && moves(i * bs + c))) rows.block(k)[c * bs + c] = mean;
  for (PetscReal &d : *diagonal)
    if (d == 0.0) d = mean;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the largest ratio of the diagonals of two coupled nodes; collective */
static PetscErrorCode LargestJump(const AinsworthBlockMat &A, const std::vector<PetscReal> &diagonal, PetscReal *jump)
{
  const AinsworthBlockRows &rows = A.rows;
  std::vector<PetscReal>    size(A.cols.count(), 0.0);

  PetscFunctionBegin;
  *jump = 1.0;
  for (PetscInt i = 0; i < rows.n; i++) size[i] = *std::max_element(diagonal.begin() + i * rows.br, diagonal.begin() + (i + 1) * rows.br);
  PetscCall(A.cols.toGhosts(MPIU_REAL, size.data(), size.data() + rows.n));
  for (PetscInt i = 0; i < rows.n; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++) {
      const PetscInt j = rows.j[k];
      if (size[i] > *jump * size[j] && std::any_of(rows.block(k), rows.block(k + 1), [](PetscScalar v) { return v != 0.0; })) *jump = size[i] / size[j];
    }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, jump, 1, MPIU_REAL, MPIU_MAX, A.cols.layout->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends a block of the matrix, unchanged or with its rows and columns scaled */
template <class T>
static void TakeBlock(PetscInt j, const PetscScalar *a, const PetscReal *rows, const PetscReal *columns, AinsworthBlockRowsOf<T> *taken)
{
  const PetscInt bs = taken->br;

  taken->j.push_back(j);
  for (PetscInt p = 0; p < bs; p++)
    for (PetscInt q = 0; q < bs; q++) taken->a.push_back((T)(rows ? a[p * bs + q] * rows[p] * columns[q] : a[p * bs + q]));
}

/* Copies the blocks between owned nodes on and above the diagonal, the diagonal block first in each row; scaled by w on both sides unless it is NULL */
template <class T>
static std::shared_ptr<AinsworthBlockRowsOf<T>> TakeUpper(const AinsworthBlockRows &rows, const PetscReal *w)
{
  const PetscInt bs = rows.br;
  auto           U  = std::make_shared<AinsworthBlockRowsOf<T>>(bs, bs);
  const size_t   n  = (rows.j.size() + rows.n) / 2 + 1;

  auto take = [&](PetscInt i, PetscInt k) { TakeBlock(rows.j[k], rows.block(k), w ? w + i * bs : NULL, w ? w + rows.j[k] * bs : NULL, U.get()); };
  U->i.reserve(rows.n + 1);
  U->j.reserve(n);
  U->a.reserve(n * bs * bs + 4);
  for (PetscInt i = 0; i < rows.n; i++, U->endRow()) {
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] == i) take(i, k);
    if ((PetscInt)U->j.size() == U->i.back()) { /* the matrix has no diagonal block here */
      U->j.push_back(i);
      U->a.resize(U->a.size() + bs * bs, T(0));
    }
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] > i && rows.j[k] < rows.n) take(i, k);
  }
  U->a.resize(U->a.size() + 4, T(0)); /* the last load of four may read beyond the last block */
  return U;
}

/* Stores the blocks of A in the last level; collective */
PetscErrorCode AinsworthHierarchy::store(const AinsworthBlockMat &A, const AinsworthHierarchyOptions &options)
{
  AinsworthGrid &grid     = grids.back();
  const bool     finest   = grids.size() == 1;
  PetscInt64     count[2] = {(PetscInt64)A.rows.j.size(), A.rows.n > 0};
  PetscReal      jump;

  PetscFunctionBegin;
  grid.bs    = A.rows.br;
  grid.nodes = A.cols.layout;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT64, MPI_SUM, grid.nodes->comm));
  grid.blocks = count[0];
  grid.ranks  = (PetscMPIInt)count[1];
  if (finest) PetscCall(LargestJump(A, grid.diagonal, &jump));
  if (finest && options.single && jump <= jumpOfSingle) {
    auto w = std::make_shared<std::vector<PetscReal>>(grid.diagonal.size());

    std::transform(grid.diagonal.begin(), grid.diagonal.end(), w->begin(), [](PetscReal v) { return AinsworthInversePower(v, 2); });
    grid.single = TakeUpper<AinsworthSingle>(A.rows, w->data());
    grid.w      = w;
  } else grid.upper = TakeUpper<PetscScalar>(A.rows, NULL);
  AinsworthBlockRows &outside = grid.outside.rows;
  grid.outside.cols           = A.cols;
  outside                     = AinsworthBlockRows(grid.bs, grid.bs);
  grid.outside.cols.sf.reset(); /* these columns do not communicate */
  for (PetscInt i = 0; i < A.rows.n; i++, outside.endRow())
    for (PetscInt k = A.rows.i[i]; k < A.rows.i[i + 1]; k++)
      if (A.rows.j[k] >= A.rows.n) TakeBlock(A.rows.j[k], A.rows.block(k), NULL, NULL, &outside);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the product with a level of A plus the added matrix, in the precision of the upper half, scaled by w unless it is NULL; collective */
template <class T>
static PetscErrorCode CreateProduct(const AinsworthGrid &grid, const std::shared_ptr<const AinsworthBlockRowsOf<T>> &upper, const std::vector<PetscReal> *w,
                                    const AinsworthBlockMat *added, std::unique_ptr<AinsworthProduct<T>> *product)
{
  const PetscInt          bs = grid.bs;
  std::vector<PetscInt>   ghosts(grid.outside.cols.ghosts);
  std::vector<PetscReal>  scale;
  AinsworthColumns        cols;
  AinsworthBlockRowsOf<T> rest(bs, bs);
  AinsworthUnit           unit(bs, MPIU_REAL);

  PetscFunctionBegin;
  if (added) ghosts.insert(ghosts.end(), added->cols.ghosts.begin(), added->cols.ghosts.end());
  AinsworthSortUnique(&ghosts);
  PetscCall(cols.create(grid.nodes, std::move(ghosts)));
  if (w) {
    scale = *w;
    scale.resize((size_t)cols.count() * bs);
    PetscCall(cols.toGhosts(unit.type, w->data(), scale.data() + w->size()));
  }
  for (PetscInt i = 0; i < cols.local; i++, rest.endRow())
    for (const AinsworthBlockMat *X : {&grid.outside, added})
      for (PetscInt k = X ? X->rows.i[i] : 0; X && k < X->rows.i[i + 1]; k++) {
        const PetscInt j = cols.place(X->cols.node(X->rows.j[k]));
        TakeBlock(j, X->rows.block(k), w ? &scale[(size_t)i * bs] : NULL, w ? &scale[(size_t)j * bs] : NULL, &rest);
      }
  product->reset(new AinsworthProduct<T>(upper, std::move(rest), std::move(cols)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthHierarchy::createLevel - creates the operator of level l, 0 being the finest, of A or of A plus the matrix added on this level; collective

   single: in single precision if this level has it
*/
PetscErrorCode AinsworthHierarchy::createLevel(PetscInt l, const AinsworthBlockMat *added, bool single, std::unique_ptr<AinsworthLevel> *level) const
{
  const AinsworthGrid &grid = grids[l];
  const PetscInt       bs   = grid.bs;

  PetscFunctionBegin;
  level->reset(new AinsworthLevel);
  std::vector<PetscReal> &diagonal = (*level)->diagonal;
  diagonal                         = grid.diagonal;
  (*level)->largest                = grid.largest;
  for (PetscInt i = 0; added && i < added->rows.n; i++)
    for (PetscInt k = added->rows.i[i]; k < added->rows.i[i + 1]; k++)
      for (PetscInt c = 0; added->rows.j[k] == i && c < bs; c++) diagonal[i * bs + c] += PetscRealPart(added->rows.block(k)[c * bs + c]);
  if (single && grid.single) {
    (*level)->single.reset(new AinsworthScaled);
    AinsworthScaled &L = *(*level)->single;
    L.w                = grid.w;
    for (PetscReal w : *L.w) L.largest = PetscMax(L.largest, w);
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &L.largest, 1, MPIU_REAL, MPIU_MAX, grid.nodes->comm));
    PetscCall(CreateProduct(grid, grid.single, L.w.get(), added, &L.product));
    const PetscInt stride = L.product->stride();
    for (auto *v : {&L.inverse, &L.x, &L.r, &L.p, &L.q}) v->assign((size_t)L.product->n() * stride, AinsworthSingle(0));
    for (size_t k = 0; k < diagonal.size(); k++) L.inverse[k / bs * stride + k % bs] = (AinsworthSingle)(1.0 / (diagonal[k] * (*L.w)[k] * (*L.w)[k]));
  } else PetscCall(CreateProduct(grid, grid.upper, NULL, added, &(*level)->product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a level from its blocks and estimates the largest eigenvalue of its operator; collective */
PetscErrorCode AinsworthHierarchy::add(AinsworthBlockMat &X, const AinsworthHierarchyOptions &options)
{
  std::unique_ptr<AinsworthLevel> level;

  PetscFunctionBegin;
  grids.emplace_back();
  PetscCall(ReadDiagonal(X, grids.size() > 1, modes, &grids.back().diagonal));
  PetscCall(store(X, options));
  PetscCall(createLevel((PetscInt)grids.size() - 1, NULL, true, &level));
  PetscCall(level->estimate(NULL, &modes.left));
  grids.back().largest = level->largest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the double-precision blocks of a level in single precision, for products, or in its place if the level is factored */
static void TakeDouble(const AinsworthBlockMat &X, bool factored, const AinsworthHierarchyOptions &options, AinsworthGrid *grid)
{
  if (grid->single && (options.product || factored)) grid->upper = TakeUpper<PetscScalar>(X.rows, NULL);
  if (!factored) return;
  grid->single = NULL;
  grid->w      = NULL;
}

/*
   Chooses the ranks that own the next level, of which this rank has made `nodes` nodes; collective

   If ranks would own too few nodes, ranks are grouped in order, and the first rank of a group owns all of its nodes
*/
static PetscErrorCode ChooseLayout(MPI_Comm comm, PetscInt nodes, PetscInt enough, AinsworthLayout *layout, PetscMPIInt *owners)
{
  PetscMPIInt           rank, size, owner = 0;
  PetscInt              total = 0, active = 0, before = 0, group = 1, mine = 0;
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
  if (total < enough * active) {
    const PetscInt ranks = PetscMax(1, total / (4 * enough));
    group                = (active + ranks - 1) / ranks;
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
   AinsworthHierarchy::create - creates the levels of A, down to one that can be factored; collective

   A: AIJ, Hermitian, bs unknowns per node; nodes: the local rows node by node, empty if they are stored so; carry: unknowns without entries in A, global numbers
   of all ranks, whose nodes get coarse functions nevertheless, as what is added to A will couple them to many others; leave: marks local nodes that get none, as others move
   them, or is empty
*/
PetscErrorCode AinsworthHierarchy::create(Mat A, PetscInt bs, std::vector<PetscInt> &&nodes, AinsworthModes &&near, const std::vector<PetscInt> &carry,
                                          const std::vector<char> &leave, const AinsworthHierarchyOptions &options)
{
  AinsworthBlockMat X;
  PetscInt          rstart, rend;

  PetscFunctionBegin;
  modes  = std::move(near);
  order  = std::move(nodes);
  sorted = (PetscBool)!order.empty();
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &sorted, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)A)));
  PetscCall(AinsworthBlockMatCreate(A, bs, order, NULL, &X));
  PetscCall(AinsworthModesFit(X, &modes));
  carried = carry;
  modes.carried.assign(X.rows.n, 0);
  PetscCall(MatGetOwnershipRange(A, &rstart, &rend));
  std::vector<PetscInt> place(order.size());
  for (size_t l = 0; l < order.size(); l++) place[order[l]] = (PetscInt)l;
  for (PetscInt u : carry)
    if (u >= rstart && u < rend) modes.carried[(order.empty() ? u - rstart : place[u - rstart]) / bs] = 1;
  AinsworthModesCarry(bs, &modes);
  left       = leave;
  modes.left = leave;
  for (;;) {
    AinsworthAggregates aggregates;
    AinsworthLayout     nodes;
    PetscMPIInt         ranks = 0;
    AinsworthBlockMat   coarse;
    auto                P = std::make_shared<AinsworthInterpolation>();

    PetscCall(add(X, options));
    AinsworthGrid &grid     = grids.back();
    const PetscInt unknowns = grid.nodes->N * grid.bs;
    if (unknowns <= options.coarseSize || grids.size() == mostLevels) break;
    PetscCall(PetscLogEventBegin(AINSWORTH_Aggregate, A, 0, 0, 0));
    PetscCall(AinsworthAggregate(X, options.threshold, modes, &aggregates));
    PetscCall(PetscLogEventEnd(AINSWORTH_Aggregate, A, 0, 0, 0));
    PetscCall(ChooseLayout(grid.nodes->comm, aggregates.count, options.rankSize / 6, &nodes, &ranks));
    if (nodes->N == 0) break;
    if ((PetscReal)nodes->N * modes.k > tooLarge * unknowns && ranks == grid.ranks) {
      PetscCall(PetscSNPrintf(doubts, sizeof(doubts), "level %d, of %" PetscInt_FMT " unknowns, cannot be made much smaller", (int)grids.size(), unknowns));
      break;
    }
    PetscCall(PetscLogEventBegin(AINSWORTH_Interpolation, A, 0, 0, 0));
    PetscCall(AinsworthInterpolationCreate(X, aggregates, grid.diagonal, 4.0 / 3.0 / grid.largest, nodes, &modes, P.get()));
    PetscCall(PetscLogEventEnd(AINSWORTH_Interpolation, A, 0, 0, 0));
    if (grid.single) P->round(); /* before the Galerkin product, so that the coarse operator belongs to the rounded interpolation */
    PetscCall(AinsworthGalerkin(X, *P, &coarse));
    TakeDouble(X, false, options, &grid); /* not earlier: the Galerkin product needs the most memory */
    grid.P = P;
    X      = std::move(coarse);
    modes.left.clear();
  }
  modes.values.clear();
  modes.carried.clear();
  modes.left.clear();
  if (grids.size() == 1) TakeDouble(X, true, options, &grids[0]);
  if (!doubts[0] && complexity() > tooComplex)
    PetscCall(PetscSNPrintf(doubts, sizeof(doubts), "all levels together have %.3g times the entries of the finest", (double)complexity()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthHierarchy::replaceFinest - replaces the finest level for an A with other values; keeps the coarser levels and the interpolation; collective

   A: as in create(), with the same distribution
*/
PetscErrorCode AinsworthHierarchy::replaceFinest(Mat A, const AinsworthHierarchyOptions &options)
{
  AinsworthBlockMat  X;
  AinsworthHierarchy finest;

  PetscFunctionBegin;
  PetscCall(AinsworthBlockMatCreate(A, grids[0].bs, order, NULL, &X));
  finest.modes.carried.assign(X.rows.n, 0);
  PetscCall(finest.add(X, options));
  AinsworthGrid &grid = finest.grids[0];
  grid.P              = grids[0].P;
  TakeDouble(X, !grid.P, options, &grid);
  grids[0] = std::move(grid);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthHierarchyCreateProduct - creates a matrix for products with A that stores half of its entries; collective */
PetscErrorCode AinsworthHierarchyCreateProduct(const AinsworthHierarchy &hierarchy, Mat *mat)
{
  std::unique_ptr<AinsworthLevel> level;

  PetscFunctionBegin;
  *mat = NULL;
  PetscCall(hierarchy.createLevel(0, NULL, false, &level));
  PetscCall(AinsworthLevelMatSet(hierarchy.grids[0].nodes, hierarchy.grids[0].bs, std::move(level), mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}
