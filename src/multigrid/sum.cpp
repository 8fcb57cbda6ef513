/* Levels of A + D from those of A, where D has entries in few rows (docs/multigrid.md, with constraints) */
#include "hierarchy.h"

/* Adds the blocks of a level of A, of which half is stored, times a factor to rows of pieces; values keeps scaled copies */
static void AddLevel(const AinsworthGrid &grid, bool negative, std::vector<PetscScalar> *values, std::vector<std::vector<AinsworthPiece>> *pieces)
{
  const AinsworthBlockRows &U = *grid.upper, &rest = grid.outside.rows;
  const PetscScalar        *upper = U.a.data(), *outside = rest.a.data();
  const PetscInt            size = U.size();

  if (negative) {
    values->clear();
    values->reserve(U.a.size() + rest.a.size());
    for (const auto *a : {&U.a, &rest.a})
      for (PetscScalar v : *a) values->push_back(-v);
    upper   = values->data();
    outside = upper + U.a.size();
  }
  for (PetscInt r = 0; r < U.n; r++) {
    for (PetscInt k = U.i[r]; k < U.i[r + 1]; k++) {
      (*pieces)[r].push_back({grid.nodes->rstart + U.j[k], upper + (size_t)k * size, false});
      if (k > U.i[r]) (*pieces)[U.j[k]].push_back({grid.nodes->rstart + r, upper + (size_t)k * size, true});
    }
    for (PetscInt k = rest.i[r]; k < rest.i[r + 1]; k++) (*pieces)[r].push_back({grid.outside.cols.node(rest.j[k]), outside + (size_t)k * size, false});
  }
}

/* Computes X + A_l or, if negative, X - A_l, for the rows in which X has entries; collective */
static PetscErrorCode AddToLevel(const AinsworthBlockMat &X, const AinsworthGrid &grid, bool negative, AinsworthBlockMat *sum)
{
  std::vector<std::vector<AinsworthPiece>> pieces(X.rows.n);
  std::vector<PetscScalar>                 values;

  PetscFunctionBegin;
  for (PetscInt r = 0; r < X.rows.n; r++)
    for (PetscInt k = X.rows.i[r]; k < X.rows.i[r + 1]; k++) pieces[r].push_back({X.cols.node(X.rows.j[k]), X.rows.block(k), false});
  AddLevel(grid, negative, &values, &pieces);
  PetscCall(AinsworthBlockMatAssemble(grid.nodes, grid.bs, pieces, sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removes the blocks that rounding alone leaves in X - A_l, relative to the diagonal of X */
static void DropRounding(const std::vector<PetscReal> &diagonal, AinsworthBlockMat *D)
{
  static const PetscReal rounding = 64 * PETSC_MACHINE_EPSILON;
  AinsworthBlockRows     kept(D->rows.br, D->rows.bc);
  const PetscInt         bs = kept.br;

  for (PetscInt r = 0; r < D->rows.n; r++, kept.endRow())
    for (PetscInt k = D->rows.i[r]; k < D->rows.i[r + 1]; k++) {
      const PetscScalar *a    = D->rows.block(k);
      bool               keep = false;

      for (PetscInt v = 0; v < bs * bs && !keep; v++) keep = PetscAbsScalar(a[v]) > rounding * diagonal[r * bs + v / bs];
      if (!keep) continue;
      kept.j.push_back(D->rows.j[k]);
      kept.a.insert(kept.a.end(), a, a + bs * bs);
    }
  D->rows = std::move(kept);
}

/*
   AinsworthHierarchy::createSum - creates the coarser levels of A + D from those of A; collective

   The aggregates stay those of A, as some must not cross a surface on which bodies slip, and so does interpolation to the finest level. Below it, interpolation
   is smoothed for the sum: otherwise coarse functions of two tied bodies would jump at the surface between them.

   Input Parameter:
.  added - what D adds to the first coarser level

   Output Parameter:
.  levels - the levels; the finest one is that of A without D
*/
PetscErrorCode AinsworthHierarchy::createSum(AinsworthBlockMat &&added, const AinsworthHierarchyOptions &options, AinsworthHierarchy *levels) const
{
  AinsworthBlockMat D(std::move(added)), X;

  PetscFunctionBegin;
  levels->grids.assign(1, grids[0]);
  levels->modes   = modes;
  levels->order   = order;
  levels->sorted  = sorted;
  levels->carried = carried;
  if (grids.size() == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AddToLevel(D, grids[1], false, &X));
  for (size_t l = 1;; l++) {
    auto              P = std::make_shared<AinsworthInterpolation>();
    AinsworthBlockMat coarse;

    levels->modes.carried.assign(X.rows.n, 0);
    PetscCall(levels->add(X, options));
    AinsworthGrid &grid = levels->grids.back();
    if (l + 1 == grids.size()) break;
    PetscCall(AinsworthInterpolationSmoothAgain(D, *grids[l].P, grid.diagonal, 4.0 / 3.0 / grid.largest, P.get()));
    PetscCall(AinsworthGalerkin(X, *P, &coarse));
    grid.P = P;
    X      = std::move(coarse);
    if (l + 2 < grids.size()) {
      PetscCall(AddToLevel(X, grids[l + 1], true, &D));
      DropRounding(grids[l + 1].diagonal, &D);
    }
  }
  levels->modes.carried.clear();
  PetscFunctionReturn(PETSC_SUCCESS);
}
