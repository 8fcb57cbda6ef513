/* A level: its operator, half of which is stored, and products with it */
#include "hierarchy.h"
#include "half.h"
#include "../base/words.h"
#include <algorithm>

/*
   If neighboring diagonals differ by a larger factor, single precision loses the coarse modes of the stiff part
   (measured, docs/multigrid.md)
*/
static const PetscReal jumpOfSingle = 1e8;

/* AinsworthComplexity - entries of all levels relative to those of the finest */
PetscReal AinsworthComplexity(const std::vector<AinsworthGrid> &grids)
{
  PetscReal all = 0.0;

  for (const AinsworthGrid &grid : grids) all += grid.entries();
  return grids[0].blocks > 0 ? all / grids[0].entries() : 1.0;
}

/* Returns the mean of the nonzero entries of the diagonal on all ranks, or 1. Collective */
static PetscErrorCode GetMean(MPI_Comm comm, const std::vector<PetscReal> &diagonal, PetscReal *mean)
{
  PetscReal sum[2] = {0.0, 0.0};

  PetscFunctionBegin;
  for (PetscReal d : diagonal) {
    sum[0] += d;
    sum[1] += d > 0.0;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPIU_SUM, comm));
  *mean = sum[1] > 0.0 ? sum[0] / sum[1] : 1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the largest ratio of the diagonals of coupled nodes, PETSC_MAX_REAL if a value does not fit. Collective */
static PetscErrorCode LargestJump(const AinsworthBlockMat &A, const std::vector<PetscReal> &square,
                                  const std::vector<PetscReal> &diagonal, PetscReal *jump)
{
  const AinsworthBlockRows             &rows = A.rows;
  std::vector<std::array<PetscReal, 2>> size(A.cols.count()); /* the least and the most of a node */
  AinsworthUnit                         unit(2, MPIU_REAL);

  PetscFunctionBegin;
  *jump = 1.0;
  for (PetscInt i = 0; i < rows.n; i++) {
    const auto of = std::minmax_element(diagonal.begin() + i * rows.br, diagonal.begin() + (i + 1) * rows.br);
    size[i]       = {*of.first, *of.second};
  }
  PetscCall(A.cols.toGhosts(unit.type, size.data(), size.data() + rows.n));
  for (PetscInt i = 0; i < rows.n; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++) {
      const PetscInt j = rows.j[k];
      if (size[i][1] > *jump * size[j][1] && square[k] > 0.0) *jump = size[i][1] / size[j][1];
      if (square[k] / size[i][0] / size[j][0] > AinsworthMostOfSingle * AinsworthMostOfSingle) *jump = PETSC_MAX_REAL;
    }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, jump, 1, MPIU_REAL, MPIU_MAX, A.cols.layout->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts the blocks of a level, and the ranks that have some. Collective */
static PetscErrorCode CountBlocks(size_t local, AinsworthGrid *grid)
{
  PetscInt64 count[2] = {(PetscInt64)local, grid->nodes->n > 0};

  PetscFunctionBegin;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT64, MPI_SUM, grid->nodes->comm));
  grid->blocks = count[0];
  grid->ranks  = (PetscMPIInt)count[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGridStore - stores a coarser level, without its diagonal. Collective */
PetscErrorCode AinsworthGridStore(const AinsworthHalf &half, AinsworthGrid *grid)
{
  PetscFunctionBegin;
  grid->bs      = half.upper->br;
  grid->nodes   = half.outside.cols.layout;
  grid->upper   = half.upper;
  grid->outside = half.outside;
  PetscCall(CountBlocks(2 * half.upper->j.size() - half.upper->n + half.outside.rows.j.size(), grid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns powers of two near the inverse square roots of a diagonal */
static std::shared_ptr<const std::vector<PetscReal>> Scale(const std::vector<PetscReal> &diagonal)
{
  auto w = std::make_shared<std::vector<PetscReal>>();

  for (PetscReal d : diagonal) w->push_back(AinsworthInversePower(d, 2));
  return w;
}

/* Estimates the largest eigenvalue of a level; embedded: see AinsworthModes. Collective */
static PetscErrorCode Estimate(const std::vector<char> &embedded, AinsworthGrid *grid)
{
  std::unique_ptr<AinsworthLevel> level;

  PetscFunctionBegin;
  PetscCall(grid->createLevel(NULL, true, false, &level));
  PetscCall(level->estimate(NULL, embedded));
  grid->largest = level->largest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGridCreate - creates a coarser level, for the cycle in single precision if `single`, and estimates the
   largest eigenvalue of its operator. Where no mode reaches an unknown the diagonal is zero, and gets the mean of the
   others. The level takes `half` over. Collective
*/
PetscErrorCode AinsworthGridCreate(AinsworthHalf &&half, bool single, AinsworthGrid *grid)
{
  const PetscInt                      bs       = half.upper->br;
  auto                                diagonal = std::make_shared<std::vector<PetscReal>>();
  std::shared_ptr<AinsworthBlockRows> changed;
  PetscReal                           mean;

  PetscFunctionBegin;
  PetscCall(AinsworthGridStore(half, grid));
  half = AinsworthHalf();
  for (PetscInt i = 0; i < grid->upper->n; i++)
    for (PetscInt c = 0; c < bs; c++)
      diagonal->push_back(PetscAbsScalar(grid->upper->block(grid->upper->i[i])[c * bs + c]));
  PetscCall(GetMean(grid->nodes->comm, *diagonal, &mean));
  for (size_t l = 0; l < diagonal->size(); l++) {
    if ((*diagonal)[l] != 0.0) continue;
    if (!changed && grid->upper.use_count() == 1) changed = std::const_pointer_cast<AinsworthBlockRows>(grid->upper);
    if (!changed) changed = std::make_shared<AinsworthBlockRows>(*grid->upper); /* which others have, too */
    changed->block(changed->i[l / bs])[l % bs * bs + l % bs] = mean;
    (*diagonal)[l]                                           = mean;
  }
  grid->diagonal = diagonal;
  if (changed) grid->upper = changed;
  PetscCall(Estimate({}, grid));
  if (!single) PetscFunctionReturn(PETSC_SUCCESS);
  grid->w      = Scale(*diagonal);
  grid->single = AinsworthHalfRound(*grid->upper, grid->w->data());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGridCreateFinest - creates the finest level and estimates the largest eigenvalue of its operator; single: in
   single precision, if its values do not jump too far, and in double as well for products, if `product`; embedded: see
   AinsworthModes. Collective
*/
PetscErrorCode AinsworthGridCreateFinest(const AinsworthBlockMat &A, const AinsworthBlockSurvey &survey, bool single,
                                         bool product, const std::vector<char> &embedded, AinsworthGrid *grid)
{
  auto      diagonal = std::make_shared<std::vector<PetscReal>>(survey.diagonal);
  PetscReal mean, jump = 0.0;

  PetscFunctionBegin;
  grid->bs       = A.rows.br;
  grid->nodes    = A.cols.layout;
  grid->diagonal = diagonal;
  PetscCall(CountBlocks(A.rows.j.size(), grid));
  PetscCall(GetMean(grid->nodes->comm, *diagonal, &mean));
  for (PetscReal &d : *diagonal)
    if (d == 0.0) d = mean;
  if (single) PetscCall(LargestJump(A, survey.square, *diagonal, &jump));
  if (single && jump <= jumpOfSingle) {
    grid->w = Scale(*diagonal);
    AinsworthUpperHalf<AinsworthSingle> taken(A.rows, grid->w->data(), product);

    AinsworthTakeBlocks(A, &taken, &grid->outside);
    grid->single = taken.rows;
    if (product) grid->split.reset(new AinsworthSplitRows{taken.rows, taken.low});
  } else {
    AinsworthHalf half;

    AinsworthHalfTake(A, &half);
    grid->upper   = half.upper;
    grid->outside = std::move(half.outside);
  }
  PetscCall(Estimate(embedded, grid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates the product with a level of A plus the added matrix, in the precision of the upper half, scaled by w unless
   it is NULL. Collective
*/
template <class T, class Half>
static PetscErrorCode CreateProduct(const AinsworthGrid &grid, const std::shared_ptr<const Half> &upper,
                                    const std::vector<PetscReal> *w, const AinsworthBlockMat *added,
                                    std::unique_ptr<AinsworthProduct<T, Half>> *product)
{
  const PetscInt          bs = grid.bs;
  std::vector<PetscInt>   ghosts(grid.outside.cols.ghosts);
  std::vector<PetscReal>  scale;
  AinsworthColumns        cols;
  AinsworthBlockRowsOf<T> rest(bs, bs);
  AinsworthUnit           unit(bs, MPIU_REAL);

  PetscFunctionBegin;
  if (added) {
    ghosts.insert(ghosts.end(), added->cols.ghosts.begin(), added->cols.ghosts.end());
    PetscCall(cols.create(grid.nodes, std::move(ghosts)));
  } else cols = grid.outside.cols;
  if (w) {
    scale = *w;
    scale.resize((size_t)cols.count() * bs);
    PetscCall(cols.toGhosts(unit.type, w->data(), scale.data() + w->size()));
  }
  for (PetscInt i = 0; i < cols.local; i++, rest.endRow())
    for (const AinsworthBlockMat *X : {&grid.outside, added})
      for (PetscInt k = X ? X->rows.i[i] : 0; X && k < X->rows.i[i + 1]; k++) {
        const PetscInt j = cols.place(X->cols.node(X->rows.j[k]));
        AinsworthTakeBlock(j, X->rows.block(k), w ? &scale[(size_t)i * bs] : NULL, w ? &scale[(size_t)j * bs] : NULL,
                           &rest);
      }
  product->reset(new AinsworthProduct<T, Half>(upper, std::make_shared<AinsworthBlockRowsOf<T>>(std::move(rest)),
                                               std::make_shared<AinsworthColumns>(std::move(cols)), 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the diagonal of a level plus square blocks */
static std::shared_ptr<const std::vector<PetscReal>> Sum(const std::vector<PetscReal> &diagonal,
                                                         const AinsworthBlockRows     &added)
{
  auto           sum = std::make_shared<std::vector<PetscReal>>(diagonal);
  const PetscInt bs  = added.br;

  for (PetscInt i = 0; i < added.n; i++)
    for (PetscInt k = added.i[i]; k < added.i[i + 1]; k++)
      for (PetscInt c = 0; added.j[k] == i && c < bs; c++)
        (*sum)[i * bs + c] += PetscRealPart(added.block(k)[c * bs + c]);
  return sum;
}

/*
   AinsworthGrid::createLevel - creates the operator of a level, of which half is stored, plus `added` if it is not
   NULL; rounded: in single precision if the level has it; exact: in double precision as well. Collective
*/
PetscErrorCode AinsworthGrid::createLevel(const AinsworthBlockMat *added, bool rounded, bool exact,
                                          std::unique_ptr<AinsworthLevel> *level) const
{
  PetscFunctionBegin;
  level->reset(new AinsworthLevel);
  (*level)->diagonal = added ? Sum(*diagonal, added->rows) : diagonal;
  (*level)->largest  = largest;
  if (rounded && single) {
    (*level)->single.reset(new AinsworthScaled);
    AinsworthScaled &L = *(*level)->single;
    L.w                = w;
    PetscCall(CreateProduct(*this, single, w.get(), added, &L.product));
    const PetscInt stride = L.product->stride();
    L.createWork();
    L.inverse.assign(L.x.size(), AinsworthSingle(0));
    const std::vector<PetscReal> &d = *(*level)->diagonal;
    for (size_t k = 0; k < d.size(); k++)
      L.inverse[k / bs * stride + k % bs] = (AinsworthSingle)(1.0 / (d[k] * (*w)[k] * (*w)[k]));
  }
  if (!exact && (*level)->single) PetscFunctionReturn(PETSC_SUCCESS);
  if (split) {
    std::unique_ptr<AinsworthJoined::Product> product;

    PetscCall(CreateProduct(*this, split, w.get(), added, &product));
    (*level)->joined = std::make_unique<AinsworthJoined>(w, std::move(product));
  } else PetscCall(CreateProduct(*this, upper, NULL, added, &(*level)->product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGridTakeDouble - replaces a level in single precision, as it is factored */
void AinsworthGridTakeDouble(const AinsworthBlockMat &A, AinsworthGrid *grid)
{
  if (!grid->upper) {
    AinsworthHalf half;

    AinsworthHalfTake(A, &half);
    grid->upper = half.upper;
  }
  grid->single = NULL;
  grid->split  = NULL;
  grid->w      = NULL;
}

/* AinsworthGridCreateProduct - creates a matrix for products with A that stores half of its entries. Collective */
PetscErrorCode AinsworthGridCreateProduct(const AinsworthGrid &grid, Mat *mat)
{
  std::unique_ptr<AinsworthLevel> level;

  PetscFunctionBegin;
  *mat = NULL;
  PetscCall(grid.createLevel(NULL, false, true, &level));
  PetscCall(AinsworthLevelMatSet(grid.nodes, grid.bs, std::move(level), mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the bytes of block rows with these values */
template <class T>
static double Bytes(const std::vector<PetscInt> &places, const std::vector<T> &values)
{
  return (double)(places.size() * sizeof(PetscInt) + values.size() * sizeof(T));
}

/*
   AinsworthGridView - views the size of a level, how it is spread, and what a product with its operator and with its
   interpolation reads on all ranks, in one line. Collective
*/
PetscErrorCode AinsworthGridView(const AinsworthGrid &grid, PetscViewer viewer)
{
  PetscInt most     = 0;
  double   bytes[2] = {Bytes(grid.outside.rows.j, grid.outside.rows.a), 0.0};

  PetscFunctionBegin;
  bytes[0] += grid.single ? Bytes(grid.single->j, grid.single->a) : Bytes(grid.upper->j, grid.upper->a);
  if (grid.P)
    bytes[1] = grid.P->single.empty() ? Bytes(grid.P->rows.j, grid.P->rows.a) : Bytes(grid.P->rows.j, grid.P->single);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, bytes, 2, MPI_DOUBLE, MPI_SUM, grid.nodes->comm));
  for (PetscMPIInt r = 0; r < grid.nodes->size; r++)
    most = PetscMax(most, grid.nodes->range[r + 1] - grid.nodes->range[r]);
  PetscCall(PetscViewerASCIIPrintf(
    viewer,
    "    level: %" PetscInt_FMT " unknowns, blocks of %" PetscInt_FMT
    ", %.1f of them a row, %.1f MiB, interpolation %.1f, at most %" PetscInt_FMT " rows a rank, on %s\n",
    grid.nodes->N * grid.bs, grid.bs, grid.nodes->N ? (double)grid.blocks / (double)grid.nodes->N : 0.0,
    bytes[0] / 1048576, bytes[1] / 1048576, most, AinsworthCounted(grid.ranks, "rank").c_str()));
  PetscFunctionReturn(PETSC_SUCCESS);
}
