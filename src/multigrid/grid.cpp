/* A level: its operator, half of which is stored, and products with it */
#include "hierarchy.h"
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

/*
   Gets the diagonal, of the finest level from its survey, and replaces zeros by the mean of the nonzero entries on all
   ranks; on a coarser level in the matrix, too, where no mode reaches an unknown. Collective
*/
static PetscErrorCode GetDiagonal(AinsworthBlockMat &X, const AinsworthBlockSurvey *survey,
                                  std::vector<PetscReal> *diagonal)
{
  AinsworthBlockRows &rows   = X.rows;
  const PetscInt      bs     = rows.br;
  PetscReal           sum[2] = {0.0, 0.0};

  PetscFunctionBegin;
  if (survey) *diagonal = survey->diagonal;
  else diagonal->assign((size_t)rows.n * bs, 0.0);
  for (PetscInt i = 0; i < rows.n && !survey; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] == i)
        for (PetscInt c = 0; c < bs; c++) (*diagonal)[i * bs + c] = PetscAbsScalar(rows.block(k)[c * bs + c]);
  for (PetscReal d : *diagonal) {
    sum[0] += d;
    sum[1] += d > 0.0;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPIU_SUM, X.cols.layout->comm));
  const PetscReal mean = sum[1] > 0.0 ? sum[0] / sum[1] : 1.0;

  for (PetscInt i = 0; i < rows.n && !survey; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] == i)
        for (PetscInt c = 0; c < bs; c++)
          if ((*diagonal)[i * bs + c] == 0.0) rows.block(k)[c * bs + c] = mean;
  for (PetscReal &d : *diagonal)
    if (d == 0.0) d = mean;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the largest ratio of the diagonals of two coupled nodes. Collective */
static PetscErrorCode LargestJump(const AinsworthBlockMat &A, const std::vector<PetscReal> &square,
                                  const std::vector<PetscReal> &diagonal, PetscReal *jump)
{
  const AinsworthBlockRows &rows = A.rows;
  std::vector<PetscReal>    size(A.cols.count(), 0.0);

  PetscFunctionBegin;
  *jump = 1.0;
  for (PetscInt i = 0; i < rows.n; i++)
    size[i] = *std::max_element(diagonal.begin() + i * rows.br, diagonal.begin() + (i + 1) * rows.br);
  PetscCall(A.cols.toGhosts(MPIU_REAL, size.data(), size.data() + rows.n));
  for (PetscInt i = 0; i < rows.n; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++) {
      const PetscInt j = rows.j[k];
      if (size[i] > *jump * size[j] && square[k] > 0.0) *jump = size[i] / size[j];
    }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, jump, 1, MPIU_REAL, MPIU_MAX, A.cols.layout->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends a block of the matrix, unchanged or with its rows and columns scaled */
template <class T>
static void TakeBlock(PetscInt j, const PetscScalar *a, const PetscReal *rows, const PetscReal *columns,
                      AinsworthBlockRowsOf<T> *taken)
{
  const PetscInt bs = taken->br;

  taken->j.push_back(j);
  AinsworthDispatch(bs, [&](auto B) {
    const PetscInt b = B() ? B() : bs;
    T              scaled[B() ? B() * B() : 1], *to = scaled;

    if (!rows) taken->a.insert(taken->a.end(), a, a + b * b);
    else if (!B())
      for (PetscInt p = 0; p < b * b; p++) taken->a.push_back((T)(a[p] * rows[p / b] * columns[p % b]));
    else {
      for (PetscInt p = 0; p < b; p++)
        for (PetscInt q = 0; q < b; q++) *to++ = (T)(a[p * b + q] * rows[p] * columns[q]);
      taken->a.insert(taken->a.end(), scaled, to);
    }
  });
}

/*
   Copies the blocks between owned nodes on and above the diagonal, the diagonal block first in each row, scaled by w on
   both sides unless it is NULL; outside: blocks in ghost columns, or NULL
*/
template <class T>
static std::shared_ptr<AinsworthBlockRowsOf<T>> TakeUpper(const AinsworthBlockMat &A, const PetscReal *w,
                                                          AinsworthBlockRows *outside)
{
  const AinsworthBlockRows &rows = A.rows;
  const PetscInt            bs = rows.br, size = bs * bs;
  auto                      U = std::make_shared<AinsworthBlockRowsOf<T>>(bs, bs);
  const size_t              n = (rows.j.size() + rows.n) / 2 + 1;

  U->i.reserve(rows.n + 1);
  U->j.reserve(n);
  U->a.reserve(n * size + 4);
  for (PetscInt i = 0; i < rows.n; i++, U->endRow()) {
    const PetscScalar *a    = A.row(i) - (size_t)rows.i[i] * size;
    auto               take = [&](PetscInt k) {
      TakeBlock(rows.j[k], a + (size_t)k * size, w ? w + i * bs : NULL, w ? w + rows.j[k] * bs : NULL, U.get());
    };

    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      if (rows.j[k] == i) take(k);
    if ((PetscInt)U->j.size() == U->i.back()) { /* the matrix has no diagonal block here */
      U->j.push_back(i);
      U->a.resize(U->a.size() + size, T(0));
    }
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++) {
      if (rows.j[k] > i && rows.j[k] < rows.n) take(k);
      if (outside && rows.j[k] >= rows.n) TakeBlock(rows.j[k], a + (size_t)k * size, NULL, NULL, outside);
    }
    if (outside) outside->endRow();
  }
  U->a.resize(U->a.size() + 4, T(0)); /* the last load of four may read beyond the last block */
  return U;
}

/*
   AinsworthGridStore - stores the blocks of a level, in single precision if it has a survey and they do not jump too
   far. Collective
*/
PetscErrorCode AinsworthGridStore(const AinsworthBlockMat &A, const AinsworthBlockSurvey *survey, AinsworthGrid *grid)
{
  PetscInt64          count[2] = {(PetscInt64)A.rows.j.size(), A.rows.n > 0};
  PetscReal           jump     = 0.0;
  AinsworthBlockRows &outside  = grid->outside.rows;

  PetscFunctionBegin;
  grid->bs    = A.rows.br;
  grid->nodes = A.cols.layout;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT64, MPI_SUM, grid->nodes->comm));
  grid->blocks       = count[0];
  grid->ranks        = (PetscMPIInt)count[1];
  grid->outside.cols = A.cols;
  outside            = AinsworthBlockRows(grid->bs, grid->bs);
  grid->outside.cols.sf.reset(); /* these columns do not communicate */
  if (survey) PetscCall(LargestJump(A, survey->square, grid->diagonal, &jump));
  if (survey && jump <= jumpOfSingle) {
    auto w = std::make_shared<std::vector<PetscReal>>(grid->diagonal.size());

    std::transform(grid->diagonal.begin(), grid->diagonal.end(), w->begin(),
                   [](PetscReal v) { return AinsworthInversePower(v, 2); });
    grid->single = TakeUpper<AinsworthSingle>(A, w->data(), &outside);
    grid->w      = w;
  } else grid->upper = TakeUpper<PetscScalar>(A, NULL, &outside);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates the product with a level of A plus the added matrix, in the precision of the upper half, scaled by w unless
   it is NULL. Collective
*/
template <class T>
static PetscErrorCode CreateProduct(const AinsworthGrid                                  &grid,
                                    const std::shared_ptr<const AinsworthBlockRowsOf<T>> &upper,
                                    const std::vector<PetscReal> *w, const AinsworthBlockMat *added,
                                    std::unique_ptr<AinsworthProduct<T>> *product)
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
   AinsworthGrid::createLevel - creates the operator of a level, of which half is stored, plus `added` if it is not
   NULL; single: in single precision if the level has it. Collective
*/
PetscErrorCode AinsworthGrid::createLevel(const AinsworthBlockMat *added, bool inSingle,
                                          std::unique_ptr<AinsworthLevel> *level) const
{
  PetscFunctionBegin;
  level->reset(new AinsworthLevel);
  std::vector<PetscReal> &d = (*level)->diagonal;
  d                         = diagonal;
  (*level)->largest         = largest;
  for (PetscInt i = 0; added && !d.empty() && i < added->rows.n; i++) /* the hierarchy keeps one without a diagonal */
    for (PetscInt k = added->rows.i[i]; k < added->rows.i[i + 1]; k++)
      for (PetscInt c = 0; added->rows.j[k] == i && c < bs; c++)
        d[i * bs + c] += PetscRealPart(added->rows.block(k)[c * bs + c]);
  if (inSingle && single) {
    (*level)->single.reset(new AinsworthScaled);
    AinsworthScaled &L = *(*level)->single;
    L.w                = w;
    for (PetscReal scale : *w) L.largest = PetscMax(L.largest, scale);
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &L.largest, 1, MPIU_REAL, MPIU_MAX, nodes->comm));
    PetscCall(CreateProduct(*this, single, w.get(), added, &L.product));
    const PetscInt stride = L.product->stride();
    for (auto *v : {&L.inverse, &L.x, &L.r, &L.p, &L.q}) v->assign((size_t)L.product->n() * stride, AinsworthSingle(0));
    for (size_t k = 0; k < d.size(); k++)
      L.inverse[k / bs * stride + k % bs] = (AinsworthSingle)(1.0 / (d[k] * (*w)[k] * (*w)[k]));
  } else PetscCall(CreateProduct(*this, upper, NULL, added, &(*level)->product));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGridCreate - creates a level from its blocks, and estimates the largest eigenvalue of its operator; survey:
   of the finest level, NULL for others; embedded: see AinsworthModes. Collective
*/
PetscErrorCode AinsworthGridCreate(AinsworthBlockMat &X, const AinsworthBlockSurvey *survey, bool single,
                                   const std::vector<char> &embedded, AinsworthGrid *grid)
{
  std::unique_ptr<AinsworthLevel> created;
  AinsworthLevel                 *level;
  Mat                             mat = NULL;

  PetscFunctionBegin;
  PetscCall(GetDiagonal(X, survey, &grid->diagonal));
  PetscCall(AinsworthGridStore(X, single ? survey : NULL, grid));
  PetscCall(grid->createLevel(NULL, true, &created));
  PetscCall(AinsworthLevelMatSet(grid->nodes, grid->bs, std::move(created), &mat));
  PetscCall(AinsworthLevelMatEstimate(mat, NULL, embedded));
  PetscCall(AinsworthLevelMatGet(mat, &level));
  grid->largest = level->largest;
  PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGridTakeDouble - keeps the double-precision blocks of a level in single precision, for products, or in its
   place if the level is factored
*/
void AinsworthGridTakeDouble(const AinsworthBlockMat &X, bool factored, const AinsworthHierarchyOptions &options,
                             AinsworthGrid *grid)
{
  if (grid->single && (options.product || factored)) grid->upper = TakeUpper<PetscScalar>(X, NULL, NULL);
  if (!factored) return;
  grid->single = NULL;
  grid->w      = NULL;
}

/* AinsworthGridCreateProduct - creates a matrix for products with A that stores half of its entries. Collective */
PetscErrorCode AinsworthGridCreateProduct(const AinsworthGrid &grid, Mat *mat)
{
  std::unique_ptr<AinsworthLevel> level;

  PetscFunctionBegin;
  *mat = NULL;
  PetscCall(grid.createLevel(NULL, false, &level));
  PetscCall(AinsworthLevelMatSet(grid.nodes, grid.bs, std::move(level), mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGridView - views the size of a level, and how it is spread, in one line */
PetscErrorCode AinsworthGridView(const AinsworthGrid &grid, PetscViewer viewer)
{
  PetscInt most = 0;

  PetscFunctionBegin;
  for (PetscMPIInt r = 0; r < grid.nodes->size; r++)
    most = PetscMax(most, grid.nodes->range[r + 1] - grid.nodes->range[r]);
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "    level: %" PetscInt_FMT " unknowns, blocks of %" PetscInt_FMT
                                   ", %.1f of them a row, at most %" PetscInt_FMT " rows a rank, on %d ranks\n",
                                   grid.nodes->N * grid.bs, grid.bs,
                                   grid.nodes->N ? (double)grid.blocks / (double)grid.nodes->N : 0.0, most,
                                   (int)grid.ranks));
  PetscFunctionReturn(PETSC_SUCCESS);
}
