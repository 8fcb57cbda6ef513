#include "hierarchy.h"
#include "../events.h"
#include <algorithm>

/* Beyond this quotient of neighboring diagonals single precision loses the coarse modes of the stiff part: measured, docs/multigrid.md */
static const PetscReal jumpOfSingle = 1e8;
/* A hierarchy with more entries than this times those of A costs more than it gains; so does a level that is not much smaller than the one before it */
static const PetscReal tooComplex = 2.5, tooLarge = 0.5;

AinsworthHierarchy::~AinsworthHierarchy()
{
  for (AinsworthGrid &grid : grids) {
    (void)PetscLayoutDestroy(&grid.nodes);
    if (grid.P) (void)const_cast<AinsworthInterpolation &>(*grid.P).cols.destroy();
  }
}

PetscReal AinsworthHierarchy::complexity() const
{
  PetscReal entries = 0.0;

  for (const AinsworthGrid &grid : grids) entries += (PetscReal)grid.blocks * grid.bs * grid.bs;
  return grids.size() && grids[0].blocks ? entries / ((PetscReal)grids[0].blocks * grids[0].bs * grids[0].bs) : 1.0;
}

/* Diagonals, made positive where they are zero. coarse: so they are in the matrix then, whose unknowns that no mode reaches have rows of zeros */
static void ReadDiagonal(AinsworthBlockRows &rows, bool coarse, std::vector<PetscReal> *diagonal)
{
  const PetscInt bs   = rows.br;
  PetscReal      mean = 0.0;

  diagonal->assign((size_t)rows.n * bs, 0.0);
  for (PetscInt i = 0; i < rows.n; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] == i)
        for (PetscInt c = 0; c < bs; c++) mean += ((*diagonal)[i * bs + c] = PetscAbsScalar(rows.block(k)[c * bs + c]));
  mean = mean > 0.0 ? mean / (PetscReal)diagonal->size() : 1.0;
  for (PetscInt i = 0; i < rows.n && coarse; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] == i)
        for (PetscInt c = 0; c < bs; c++)
          if ((*diagonal)[i * bs + c] == 0.0) rows.block(k)[c * bs + c] = mean;
  for (PetscReal &d : *diagonal)
    if (d == 0.0) d = mean;
}

/* The largest quotient of the diagonals of two nodes that the matrix couples, the first one of this rank */
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
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The upper half of the blocks between owned nodes, times diagonal scalings where w is given */
template <class T>
static std::shared_ptr<AinsworthUpper<T>> TakeUpper(const AinsworthBlockRows &rows, const PetscReal *w)
{
  const PetscInt bs = rows.br, size = bs * bs;
  auto           U = std::make_shared<AinsworthUpper<T>>();
  size_t         n = 0;

  auto take = [&](PetscInt i, PetscInt k) {
    const PetscScalar *a = rows.block(k);
    U->j.push_back(rows.j[k]);
    for (PetscInt q = 0; q < size; q++) U->a.push_back((T)(w ? a[q] * w[i * bs + q / bs] * w[rows.j[k] * bs + q % bs] : a[q]));
  };
  for (PetscInt i = 0; i < rows.n; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++) n += rows.j[k] >= i && rows.j[k] < rows.n;
  U->n  = rows.n;
  U->bs = bs;
  U->i.assign(1, 0);
  U->i.reserve(rows.n + 1);
  U->j.reserve(n + 1);
  U->a.reserve((n + 1) * size + 4);
  for (PetscInt i = 0; i < rows.n; i++) {
    const size_t first = U->j.size();

    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] == i) take(i, k);
    if (U->j.size() == first) { /* no diagonal block is stored */
      U->j.push_back(i);
      U->a.resize(U->a.size() + size, T(0));
    }
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] > i && rows.j[k] < rows.n) take(i, k);
    U->i.push_back((PetscInt)U->j.size());
  }
  U->a.resize(U->a.size() + 4, T(0)); /* the last load of four may read beyond the last block */
  return U;
}

static AinsworthRest<PetscScalar> TakeOutside(const AinsworthBlockMat &A)
{
  AinsworthRest<PetscScalar> E;

  E.i.assign(1, 0);
  for (PetscInt i = 0; i < A.rows.n; i++) {
    for (PetscInt k = A.rows.i[i]; k < A.rows.i[i + 1]; k++) {
      if (A.rows.j[k] < A.rows.n) continue;
      E.j.push_back(A.cols.node(A.rows.j[k]));
      E.a.insert(E.a.end(), A.rows.block(k), A.rows.block(k + 1));
    }
    if ((PetscInt)E.j.size() == E.i.back()) continue;
    E.row.push_back(i);
    E.i.push_back((PetscInt)E.j.size());
  }
  return E;
}

/* The power of two near v^{-1/2} */
static PetscReal InverseRoot(PetscReal v)
{
  int exponent;

  (void)frexp((double)v, &exponent);
  return (PetscReal)ldexp(1.0, -exponent / 2);
}

/* A level of A from its blocks */
PetscErrorCode AinsworthHierarchy::store(AinsworthBlockMat &A, const AinsworthHierarchyOptions &options)
{
  AinsworthGrid &grid     = grids.back();
  const bool     finest   = grids.size() == 1;
  PetscInt64     count[2] = {(PetscInt64)A.rows.j.size(), A.rows.n > 0};
  MPI_Comm       comm     = A.cols.layout->comm;

  PetscFunctionBegin;
  grid.bs = A.rows.br;
  PetscCall(PetscLayoutReference(A.cols.layout, &grid.nodes));
  ReadDiagonal(A.rows, !finest, &grid.diagonal);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT64, MPI_SUM, comm));
  grid.blocks = count[0];
  grid.ranks  = (PetscMPIInt)count[1];
  if (finest) {
    PetscReal quotient;

    PetscCall(LargestJump(A, grid.diagonal, &quotient));
    PetscCall(MPIU_Allreduce(&quotient, &jump, 1, MPIU_REAL, MPIU_MAX, comm));
  }
  if (finest && options.single && jump <= jumpOfSingle) {
    auto w = std::make_shared<std::vector<PetscReal>>(grid.diagonal.size());

    std::transform(grid.diagonal.begin(), grid.diagonal.end(), w->begin(), InverseRoot);
    grid.single = TakeUpper<AinsworthSingle>(A.rows, w->data());
    grid.w      = w;
  }
  if (!grid.single) grid.upper = TakeUpper<PetscScalar>(A.rows, NULL);
  grid.outside = TakeOutside(A);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of two parts with their columns' nodes, as places in the union of both */
static PetscErrorCode Unite(const AinsworthGrid &grid, const AinsworthBlockMat *added, AinsworthRest<PetscScalar> *E, AinsworthColumns *cols)
{
  const AinsworthRest<PetscScalar> &A     = grid.outside;
  const size_t                      size  = (size_t)grid.bs * grid.bs;
  const PetscInt                    first = grid.nodes->rstart, last = grid.nodes->rend;
  std::vector<PetscInt>             ghosts(A.j), row(last - first, -1);

  PetscFunctionBegin;
  if (added) ghosts.insert(ghosts.end(), added->cols.ghosts.begin(), added->cols.ghosts.end());
  AinsworthSortUnique(ghosts);
  PetscCall(cols->create(grid.nodes, std::move(ghosts)));
  for (size_t r = 0; r < A.row.size(); r++) row[A.row[r]] = (PetscInt)r;
  E->i.assign(1, 0);
  for (PetscInt i = 0; i < last - first; i++) {
    if (row[i] >= 0) {
      for (PetscInt k = A.i[row[i]]; k < A.i[row[i] + 1]; k++) E->j.push_back(cols->place(A.j[k]));
      E->a.insert(E->a.end(), A.a.begin() + A.i[row[i]] * size, A.a.begin() + A.i[row[i] + 1] * size);
    }
    if (added && added->rows.i[i] < added->rows.i[i + 1]) {
      for (PetscInt k = added->rows.i[i]; k < added->rows.i[i + 1]; k++) E->j.push_back(cols->place(added->cols.node(added->rows.j[k])));
      E->a.insert(E->a.end(), added->rows.block(added->rows.i[i]), added->rows.block(added->rows.i[i + 1]));
    }
    if ((PetscInt)E->j.size() == E->i.back()) continue;
    E->row.push_back(i);
    E->i.push_back((PetscInt)E->j.size());
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* W E W in single precision; w: of owned nodes */
static PetscErrorCode ScaleRest(const AinsworthRest<PetscScalar> &E, const AinsworthColumns &cols, PetscInt bs, const std::vector<PetscReal> &w,
                                AinsworthRest<AinsworthSingle> *scaled)
{
  std::vector<PetscReal> all(w);
  AinsworthUnit          unit(bs, MPIU_REAL);

  PetscFunctionBegin;
  all.resize((size_t)cols.count() * bs);
  PetscCall(cols.toGhosts(unit.type, w.data(), all.data() + w.size()));
  scaled->row = E.row;
  scaled->i   = E.i;
  scaled->j   = E.j;
  scaled->a.resize(E.a.size());
  for (size_t r = 0; r < E.row.size(); r++)
    for (PetscInt k = E.i[r]; k < E.i[r + 1]; k++)
      for (PetscInt q = 0; q < bs * bs; q++) {
        const size_t at = (size_t)k * bs * bs + q;
        scaled->a[at]   = (AinsworthSingle)(E.a[at] * all[E.row[r] * bs + q / bs] * all[(size_t)E.j[k] * bs + q % bs]);
      }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthHierarchy::createLevel - the operator of level l, the finest being 0: of A, or of A plus what is added to it there

   single: in single precision, where this level has it. Collective
*/
PetscErrorCode AinsworthHierarchy::createLevel(PetscInt l, const AinsworthBlockMat *added, bool single, std::unique_ptr<AinsworthLevel> *out) const
{
  const AinsworthGrid            &grid = grids[l];
  const PetscInt                  bs   = grid.bs;
  std::unique_ptr<AinsworthLevel> level(new AinsworthLevel);
  AinsworthRest<PetscScalar>      E;
  AinsworthColumns                cols;

  PetscFunctionBegin;
  level->diagonal = grid.diagonal;
  level->largest  = grid.largest;
  if (added)
    for (PetscInt i = 0; i < added->rows.n; i++)
      for (PetscInt k = added->rows.i[i]; k < added->rows.i[i + 1]; k++)
        if (added->rows.j[k] == i)
          for (PetscInt c = 0; c < bs; c++) level->diagonal[i * bs + c] += PetscRealPart(added->rows.block(k)[c * bs + c]);
  PetscCall(Unite(grid, added, &E, &cols));
  if (single && grid.single) {
    AinsworthRest<AinsworthSingle> scaled;
    PetscReal                      most = 0.0;

    level->single.reset(new AinsworthScaled);
    AinsworthScaled &L = *level->single;
    L.w                = grid.w;
    for (PetscReal w : *L.w) most = PetscMax(most, w);
    PetscCall(MPIU_Allreduce(&most, &L.largest, 1, MPIU_REAL, MPIU_MAX, grid.nodes->comm));
    PetscCall(ScaleRest(E, cols, bs, *grid.w, &scaled));
    PetscCall(L.product.create(grid.single, std::move(cols), std::move(scaled)));
    const PetscInt stride = L.product.stride();
    for (auto *v : {&L.inverse, &L.x, &L.r, &L.p, &L.q}) v->assign((size_t)L.product.n() * stride, AinsworthSingle(0));
    for (size_t k = 0; k < level->diagonal.size(); k++)
      L.inverse[k / bs * stride + k % bs] = (AinsworthSingle)(1.0 / (level->diagonal[k] * (*L.w)[k] * (*L.w)[k]));
  } else {
    level->product.reset(new AinsworthProduct<PetscScalar>);
    PetscCall(level->product->create(grid.upper, std::move(cols), std::move(E)));
  }
  *out = std::move(level);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthHierarchy::chooseLayout - the ranks that own the next level: where ranks would have few nodes, the first of some in a row owns those of all

   nodes: of the next level, made by this rank. Collective
*/
PetscErrorCode AinsworthHierarchy::chooseLayout(const AinsworthGrid &grid, PetscInt nodes, PetscInt enough, PetscLayout *layout) const
{
  MPI_Comm              comm = grid.nodes->comm;
  PetscMPIInt           rank, size;
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
  if (total < enough * active) group = (active + PetscMax(1, total / (4 * enough)) - 1) / PetscMax(1, total / (4 * enough));
  PetscMPIInt owner = 0;
  for (PetscMPIInt r = 0; r < size; r++) {
    if (!made[r]) continue;
    if (before++ % group == 0) owner = r;
    if (owner == rank) mine += made[r];
  }
  PetscCall(PetscLayoutCreateFromSizes(comm, mine, total, 1, layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthHierarchy::create - levels of A from the finest to one that can be factored

   Collective. A: AIJ, Hermitian, blocks of bs
*/
PetscErrorCode AinsworthHierarchy::create(Mat A, PetscInt bs, AinsworthModes &&near, const AinsworthHierarchyOptions &options)
{
  AinsworthBlockMat        X;
  std::vector<PetscScalar> values;

  PetscFunctionBegin;
  PetscCall(AinsworthBlockMatCreate(A, bs, &X));
  PetscCall(AinsworthModesFit(X, &near));
  modes     = near.source;
  rotations = near.rotations;
  unfit     = near.unfit;
  values    = std::move(near.values);
  for (;;) {
    std::unique_ptr<AinsworthLevel>         level;
    AinsworthAggregates                     aggregates;
    PetscLayout                             nodes;
    AinsworthBlockMat                       coarse;
    std::vector<PetscScalar>                coarseValues;
    std::shared_ptr<AinsworthInterpolation> P = std::make_shared<AinsworthInterpolation>();

    grids.emplace_back();
    PetscCall(store(X, options));
    PetscCall(createLevel((PetscInt)grids.size() - 1, NULL, true, &level));
    PetscCall(AinsworthLevelEstimate(level.get()));
    AinsworthGrid &grid = grids.back();
    grid.largest        = level->largest;
    level.reset();
    const PetscInt unknowns = grid.nodes->N * grid.bs;
    if (unknowns <= options.coarseSize || (PetscInt)grids.size() == options.levels) break;
    PetscCall(PetscLogEventBegin(AINSWORTH_Aggregate, A, 0, 0, 0));
    PetscCall(AinsworthAggregate(X, options.threshold, near.k, &aggregates));
    PetscCall(PetscLogEventEnd(AINSWORTH_Aggregate, A, 0, 0, 0));
    PetscCall(chooseLayout(grid, aggregates.count, options.nodesOfRank, &nodes));
    PetscMPIInt ranks = 0;
    for (PetscMPIInt r = 0; r < nodes->size; r++) ranks += nodes->range[r + 1] > nodes->range[r];
    if (nodes->N == 0 || ((PetscReal)nodes->N * near.k > tooLarge * unknowns && ranks == grid.ranks)) {
      if (nodes->N)
        PetscCall(PetscSNPrintf(doubts, sizeof(doubts), "level %d, of %" PetscInt_FMT " unknowns, cannot be made much smaller", (int)grids.size(), unknowns));
      PetscCall(PetscLayoutDestroy(&nodes));
      break;
    }
    PetscCall(PetscLogEventBegin(AINSWORTH_Interpolation, A, 0, 0, 0));
    PetscCall(AinsworthInterpolationCreate(X, aggregates, grid.diagonal, 4.0 / 3.0 / grid.largest, values, near.k, nodes, P.get(), &coarseValues));
    PetscCall(PetscLogEventEnd(AINSWORTH_Interpolation, A, 0, 0, 0));
    PetscCall(PetscLayoutDestroy(&nodes));
    if (grid.single) P->round(); /* before the product: the coarse operator is that of the interpolation in use */
    PetscCall(AinsworthGalerkin(X, *P, &coarse));
    if (grid.single && options.product) grid.upper = TakeUpper<PetscScalar>(X.rows, NULL); /* not before: the product needs the most memory */
    grid.P = P;
    values = std::move(coarseValues);
    PetscCall(X.cols.destroy());
    X.rows      = std::move(coarse.rows);
    X.cols      = std::move(coarse.cols);
    coarse.cols = AinsworthColumns();
  }
  if (grids.size() == 1 && grids[0].single) { /* it is factored */
    grids[0].upper  = TakeUpper<PetscScalar>(X.rows, NULL);
    grids[0].single = NULL;
    grids[0].w      = NULL;
  }
  PetscCall(X.cols.destroy());
  if (!doubts[0] && complexity() > tooComplex)
    PetscCall(PetscSNPrintf(doubts, sizeof(doubts), "all levels together have %.3g times the entries of the finest", (double)complexity()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthHierarchyCreateProduct - A itself as a matrix for products, with half of its entries stored */
PetscErrorCode AinsworthHierarchyCreateProduct(const AinsworthHierarchy &hierarchy, Mat *mat)
{
  std::unique_ptr<AinsworthLevel> level;

  PetscFunctionBegin;
  PetscCall(AinsworthLevelMatCreate(hierarchy.grids[0].nodes, hierarchy.grids[0].bs, mat));
  PetscCall(hierarchy.createLevel(0, NULL, false, &level));
  PetscCall(AinsworthLevelMatSet(*mat, std::move(level)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
