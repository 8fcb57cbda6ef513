static char help[] = "Multigrid that stays in the kernel of constraints: its parts against dense algebra, and the "
                     "bounds of docs/method.md.\n\n";

#include "internal.h"
#include "multigrid/blocksa.h"
#include <petsc/private/petscimpl.h> /* PetscObjectStateIncrease() */
#include <Eigen/Eigenvalues>
#include <numeric>

static Lattice Usual(PetscInt bs)
{
  Lattice l;

  l.bs     = bs;
  l.n      = bs == 2 ? 9 : 4;
  l.layers = bs == 2 ? 24 : 6;
  return l;
}

static PetscErrorCode Gather(const AinsworthGrid &grid, Dense &dense)
{
  std::unique_ptr<AinsworthLevel> level;
  Mat                             mat = NULL;

  PetscFunctionBeginUser;
  PetscCall(grid.createLevel(NULL, false, true, &level));
  PetscCall(AinsworthLevelMatSet(grid.nodes, grid.bs, std::move(level), &mat));
  PetscCall(Gather(mat, dense));
  PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Gather(const AinsworthGrid &grid, const AinsworthInterpolation &P, Dense &dense)
{
  AinsworthBlockRows rows(P.rows);

  PetscFunctionBeginUser;
  if (!P.single.empty()) rows.a.assign(P.single.begin(), P.single.end());
  PetscCall(Gather(rows, P.cols, grid.nodes->rstart, grid.nodes->N, dense));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Column DiagonalOf(const AinsworthGrid &grid)
{
  Column d = Column::Zero(grid.nodes->N * grid.bs);

  for (size_t k = 0; k < grid.diagonal->size(); k++)
    d[grid.nodes->rstart * grid.bs + (PetscInt)k] = (*grid.diagonal)[k];
  (void)MPI_Allreduce(MPI_IN_PLACE, d.data(), (PetscMPIInt)d.size(), MPIU_SCALAR, MPIU_SUM, PETSC_COMM_WORLD);
  return d;
}

/*
   Z = T P; (P - Z)' A (P - Z) - P' A P; and the levels of A and of A plus that change: interpolation is smoothed for
   their own operators, which are products

   Graphs of the coarser levels are those of tentative interpolation, which is the same for both; rounded: Z in single
   precision
*/
static PetscErrorCode Products(Lattice l, bool rounded)
{
  Mat                    A, T;
  AinsworthHierarchy     h;
  AinsworthBlockMat      blocks, rows, change;
  AinsworthHalf          half;
  AinsworthInterpolation Z;
  Dense                  dense, fine, P, got, D;
  std::vector<char>      marked;
  const char            *layout;

  PetscFunctionBeginUser;
  PetscCall(LayoutName(l, &layout));
  Case("products, blocks of %d, %s, rounded %d", (int)l.bs, layout, rounded);
  PetscCall(LatticeCreate(l, &A));
  PetscCall(HierarchyCreate(l, A, UsualOptions(), &h));
  PetscCall(CheckTrue("three levels or more", h.levels() > 2));
  PetscCall(Gather(A, fine));
  PetscCall(Gather(h.finest, *h.finest.P, P));
  PetscCall(SurfaceCreate(l, A, 0.1, 5, &T));
  PetscCall(Gather(T, dense));
  PetscCall(AinsworthBlockMatOpen(T, l.bs, {}, NULL, &blocks));
  PetscCall(AinsworthInterpolationMultiply(blocks, *h.finest.P, &Z));
  PetscCall(Gather(h.finest, Z, got));
  PetscCall(CheckEqual("Z = T P", got, dense * P, 1e-14));
  for (PetscScalar &v : Z.rows.a) v = -v;
  if (rounded) {
    AinsworthInterpolation large(Z);
    const bool             some = !Z.rows.a.empty();

    if (some) large.rows.a.back() = 1e36;
    large.round();
    Z.round();
    PetscCall(CheckTrue("only what fits is rounded", large.single.empty() && Z.single.empty() != some));
  }
  PetscCall(Gather(h.finest, Z, got));
  for (PetscInt i = 0; i < blocks.rows.n; i++) marked.push_back(blocks.rows.i[i] < blocks.rows.i[i + 1]);
  PetscCall(AinsworthBlockMatOpen(A, l.bs, {}, &marked, &rows));
  PetscCall(AinsworthGalerkinChange(rows, *h.finest.P, Z, &half));
  PetscCall(OpenHalf(half, &change));
  PetscCall(Gather(change, D));
  const Dense Q = P + got, coarse = P.adjoint() * fine * P;
  PetscCall(CheckEqual("(P + Z)' A (P + Z) - P' A P", D, Q.adjoint() * fine * Q - coarse, 1e-12));

  for (bool changed : {false, true}) {
    std::vector<AinsworthGrid> grids;
    Dense                      last = changed ? Dense(coarse + D) : coarse;

    PetscCall(h.createGrids(changed ? &half : NULL, &grids));
    PetscCall(CheckInt("levels", (PetscInt)grids.size(), (PetscInt)h.levels()));
    for (size_t k = 1; k < grids.size(); k++) {
      AinsworthInterpolation tentative;

      PetscCall(Gather(grids[k], got));
      /* a zero diagonal entry, of an unknown that no mode reaches, was replaced */
      for (Eigen::Index i = 0; i < last.rows(); i++)
        if (last.row(i).norm() <= 1e-12 * last.norm()) last(i, i) = got(i, i);
      PetscCall(CheckEqual("an operator", got, last, 1e-11));
      if (!grids[k].P) break;
      PetscCall(AinsworthTentativeInterpolate(h.below[k - 1], &tentative));
      PetscCall(Gather(grids[k], tentative, dense));
      PetscCall(Gather(grids[k], *grids[k].P, P));
      const PetscReal omega   = 4.0 / 3.0 / grids[k].largest;
      Column          inverse = DiagonalOf(grids[k]).cwiseInverse();
      for (Eigen::Index i = 0; i < dense.rows(); i++) /* nodes without an aggregate have no coarse functions */
        if (dense.middleRows(i / grids[k].bs * grids[k].bs, grids[k].bs).norm() == 0.0) inverse[i] = 0.0;
      PetscCall(CheckEqual("P = (1 - omega D^-1 A) T", P, dense - omega * (inverse.asDiagonal() * got * dense), 1e-11));
      last = (P.adjoint() * last * P).eval();
    }
  }
  PetscCall(MatDestroy(&T));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Few rows, one of them dependent on two others: Q, Q', C' C, and the solver on their kernel */
static PetscErrorCode FewRows(PetscInt n, PetscMPIInt owner)
{
  PetscMPIInt                                   rank, size;
  auto                                          few = std::make_shared<AinsworthFewRows>();
  std::shared_ptr<const AinsworthLevelSubspace> subspace;
  std::vector<Vec>                              rows(4);
  std::vector<PetscReal>                        weight;
  Vec                                           x, y;
  Mat                                           A;
  PC                                            inner, pc;
  Dense                                         C(4, n), Q, Qt, square, M, got;
  Column                                        W(n);
  PetscInt                                      rstart, rend;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  Case("few rows of %d unknowns, %s", (int)n, owner < 0 ? "on all ranks" : "on one rank");
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, owner < 0 ? PETSC_DECIDE : rank == owner % size ? n : 0, n, &x));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecGetOwnershipRange(x, &rstart, &rend));
  for (PetscInt j = 0; j < n; j++) {
    W[j] = 1.5 + Uniform(3, 0, j);
    for (PetscInt i = 0; i < 3; i++) C(i, j) = Uniform(4, i, j);
    C(3, j) = C(0, j) - 2.0 * C(1, j);
  }
  for (PetscInt j = rstart; j < rend; j++) weight.push_back(PetscRealPart(W[j]));
  for (PetscInt i = 0; i < 4; i++) {
    PetscCall(VecDuplicate(x, &rows[i]));
    PetscCall(Scatter(C.row(i).adjoint(), rows[i]));
  }
  PetscCall(few->create(rows, weight));
  PetscCall(CheckInt("independent rows", (PetscInt)few->c.size(), 3));
  PetscCall(AinsworthFewRowsSubspaceCreate(few, &subspace));
  for (bool adjoint : {false, true})
    PetscCall(GatherOperator(
      x, y,
      [&](Vec in, Vec out) {
        PetscFunctionBeginUser;
        PetscCall(VecCopy(in, out));
        PetscCall(subspace->project(adjoint, 1, out));
        PetscFunctionReturn(PETSC_SUCCESS);
      },
      adjoint ? Qt : Q));
  const Dense top = C.topRows(3), S = top * W.asDiagonal() * top.adjoint(),
              R = W.asDiagonal() * top.adjoint() * S.inverse();
  PetscCall(CheckEqual("Q", Q, Dense::Identity(n, n) - R * top, 1e-12));
  PetscCall(CheckEqual("Q'", Qt, Q.adjoint(), 1e-12));

  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, rend - rstart, rend - rstart, n, n, 1, NULL, 1, NULL, &A));
  for (PetscInt j = rstart; j < rend; j++) PetscCall(MatSetValue(A, j, j, 2.0 + j % 5, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(Gather(A, M));
  PetscCall(PCCreate(PETSC_COMM_WORLD, &inner));
  PetscCall(PCSetOperators(inner, A, A));
  PetscCall(PCSetType(inner, PCJACOBI));
  PetscCall(PCSetUp(inner));
  PetscCall(AinsworthFewRowsPCCreate(few, inner, &pc));
  PetscCall(PCSetUp(pc));
  PetscCall(GatherOperator(
    x, y, [&](Vec in, Vec out) { return PCApply(pc, in, out); }, got));
  const Dense Z = M.inverse() * top.adjoint();
  PetscCall(CheckEqual("M^-1 - Z (C Z)^-1 Z'", got, M.inverse() - Z * (top * Z).inverse() * Z.adjoint(), 1e-12));
  PetscCall(few->addSquare(&A));
  PetscCall(Gather(A, square));
  PetscCall(CheckEqual("C' C of orthonormal rows", square - M, top.adjoint() * S.inverse() * top, 1e-12));
  PetscCall(PCDestroy(&pc));
  PetscCall(PCDestroy(&inner));
  PetscCall(MatDestroy(&A));
  for (Vec &row : rows) PetscCall(VecDestroy(&row));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest v' X v / v' A v for positive definite A */
static PetscReal LargestQuotient(const Dense &X, const Dense &A)
{
  const Dense                                     left = (X + X.adjoint()) / 2.0, right = (A + A.adjoint()) / 2.0;
  Eigen::GeneralizedSelfAdjointEigenSolver<Dense> solver(left, right, Eigen::EigenvaluesOnly);

  return solver.eigenvalues().maxCoeff();
}

/* How badly P approximates vectors of the range of N: the largest min_w |v - P w|_D^2 / v' A v */
static PetscReal Approximation(const Dense &A, const Dense &P, const Dense &N, const Column &D)
{
  const Dense root = D.cwiseSqrt().asDiagonal(), scaled = root * P;
  const Dense U = Eigen::ColPivHouseholderQR<Dense>(scaled).householderQ() *
                  Dense::Identity(P.rows(), Eigen::ColPivHouseholderQR<Dense>(scaled).rank());
  const Dense rest = root * N - U * (U.adjoint() * root * N);

  return LargestQuotient(rest.adjoint() * rest, N.adjoint() * A * N);
}

/* Ties of first and last unknowns, and the bounds that hold in their kernel whatever the rows */
static PetscErrorCode Bounds(Lattice l, PetscReal scale)
{
  Mat                A;
  AinsworthHierarchy h;
  Dense              op, P;
  const PetscInt     n = l.nodes() * l.bs, m = 7;
  Dense              C = Dense::Zero(m, n);

  PetscFunctionBeginUser;
  Case("bounds, blocks of %d, contrast %g", (int)l.bs, (double)l.contrast);
  PetscCall(LatticeCreate(l, &A));
  PetscCall(HierarchyCreate(l, A, UsualOptions(), &h));
  PetscCall(Gather(h.finest, op));
  PetscCall(Gather(h.finest, *h.finest.P, P));
  const Column D = DiagonalOf(h.finest), W = D.cwiseInverse();
  for (PetscInt i = 0; i < m; i++)
    for (PetscInt k = 0; k < 5; k++)
      C(i, (PetscInt)(PetscAbsReal(Uniform(11, i, k)) * n)) += (1.0 + Uniform(12, i, k)) * PetscPowReal(scale, i);
  const DenseProjector projector(C, W);
  const Dense          Q = projector.Q, N = Eigen::FullPivLU<Dense>(C).kernel();
  const Dense          DW = D.asDiagonal();
  const PetscReal all = LargestQuotient(op, DW), inside = LargestQuotient(N.adjoint() * op * N, N.adjoint() * DW * N);
  PetscCall(CheckTrue("Q W A has no larger eigenvalue than W A", inside <= all * (1 + 1e-10)));
  const PetscReal before = Approximation(op, P, Dense::Identity(n, n), D), after = Approximation(op, Q * P, N, D);
  PetscCall(CheckTrue("Q P approximates Ker C as well as P approximates everything", after <= before * (1 + 1e-8)));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The cycle of PCBLOCKSA: Hermitian, into Ker C, and close to the inverse there; with carried unknowns, kept rows, and
   in both precisions
*/
static PetscErrorCode Cycle(Lattice l, bool single, bool kept)
{
  Mat              A, T;
  Vec              x, y, places;
  PC               pc;
  KSP              coarse;
  Mat              coarsest;
  PetscInt         rstart, rend, n = l.nodes() * l.bs, m = 6, before = 0, now;
  Dense            C        = Dense::Zero(m, n), dense, B;
  auto             subspace = std::make_shared<AinsworthSubspace>();
  std::vector<Vec> rows;

  PetscFunctionBeginUser;
  Case("cycle, blocks of %d, %s precision%s", (int)l.bs, single ? "single" : "double", kept ? ", a row is kept" : "");
  PetscCall(LatticeCreate(l, &A));
  PetscCall(LatticeSetNearNullSpace(l, A));
  PetscCall(Gather(A, dense));
  PetscCall(MatCreateVecs(A, &x, &y));
  PetscCall(VecGetOwnershipRange(x, &rstart, &rend));
  Column D = dense.diagonal();
  for (PetscScalar &d : D)
    if (d == 0.0) d = 1.0;
  const Column W = D.cwiseInverse();
  for (PetscInt i = 0; i < m; i++) { /* an unknown of the last layer equals the mean of two in the middle */
    const PetscInt last = n - 1 - 2 * i, middle = n / 2 + 3 * i;

    C(i, last)              = 1.0;
    C(i, middle)            = -0.6;
    C(i, middle + 3 * l.bs) = -0.4;
  }
  if (kept) {
    C.conservativeResize(m + 1, n);
    for (PetscInt j = 0; j < n; j++) C(m, j) = 1.0 / n;
  }
  const DenseProjector projector(C, W);
  const Dense          shortRows = C.topRows(m), S = shortRows * W.asDiagonal() * shortRows.adjoint();
  const Dense          spread = W.asDiagonal() * shortRows.adjoint() * S.inverse() * shortRows;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, rend - rstart, rend - rstart, n, n, n, NULL, n, NULL, &T));
  for (PetscInt i = rstart; i < rend; i++)
    for (PetscInt j = 0; j < n; j++)
      if (PetscAbsScalar(spread(i, j)) > 1e-14) PetscCall(MatSetValue(T, i, j, spread(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(T, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(T, MAT_FINAL_ASSEMBLY));
  subspace->correction = T;
  for (PetscInt i = rstart; i < rend; i++) { /* all unknowns, as the kept row has all */
    subspace->places.push_back(i - rstart);
    subspace->weight.push_back(PetscRealPart(W[i]));
  }
  PetscCall(VecDuplicate(x, &places));
  subspace->values  = places;
  subspace->project = [&](bool adjoint, Vec v) -> PetscErrorCode {
    Column in;

    PetscFunctionBeginUser;
    PetscCall(Gather(v, in));
    PetscCall(Scatter(adjoint ? (projector.Q.adjoint() * in).eval() : (projector.Q * in).eval(), v));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  if (kept) {
    Vec row;

    PetscCall(VecDuplicate(x, &row));
    PetscCall(Scatter(((Dense::Identity(n, n) - spread).adjoint() * C.row(m).adjoint()).eval(), row));
    subspace->rows.push_back(row);
  }
  PetscCall(PCCreate(PETSC_COMM_WORLD, &pc));
  PetscCall(PCSetOperators(pc, A, A));
  PetscCall(PCSetType(pc, PCBLOCKSA));
  PetscCall(PCBlockSASetSubspace_Private(pc, subspace, NULL));
  /* the second set-up unwraps what the first has wrapped, the third has levels of other sizes */
  for (int pass = 0; pass < 3; pass++) {
    Options options(std::string("-pc_blocksa_coarse_eq_limit 40 -pc_blocksa_precision ") +
                    (single ? "single" : "double") + " -pc_blocksa_threshold " + (pass < 2 ? "0" : "0.2"));

    PetscCall(PCSetFromOptions(pc));
    PetscCall(PetscObjectStateIncrease((PetscObject)A));
    PetscCall(PCSetOperators(pc, A, A));
    PetscCall(PCSetUp(pc));
    PetscCall(PCMGGetCoarseSolve(pc, &coarse));
    PetscCall(KSPGetOperators(coarse, &coarsest, NULL));
    PetscCall(MatGetSize(coarsest, &now, NULL));
    PetscCall(CheckTrue(pass < 2 ? "levels of the same size" : "levels of another size",
                        !pass || (pass == 1) == (now == before)));
    before = now;
    PetscCall(GatherOperator(
      x, y, [&](Vec in, Vec out) { return PCApply(pc, in, out); }, B));
    const PetscReal rounding = single ? 1e-5 : 1e-11;
    PetscCall(CheckEqual("the cycle is Hermitian", B, B.adjoint(), rounding));
    PetscCall(Check("the cycle ends in Ker C", (C * B).norm(), rounding * C.norm() * B.norm()));
    const Dense N = Eigen::FullPivLU<Dense>(C).kernel(), reduced = N.adjoint() * dense * N, inverse = reduced.inverse();
    const Dense onKernel = Eigen::FullPivLU<Dense>(N).solve(
      B * Eigen::FullPivLU<Dense>(N.adjoint().eval()).solve(Dense::Identity(N.cols(), N.cols()).eval()));
    const PetscReal most  = LargestQuotient(reduced, onKernel.inverse()),
                    least = 1.0 / LargestQuotient(onKernel.inverse(), reduced);
    PetscCall(
      CheckTrue("eigenvalues of the cycle times A in Ker C are between 0.2 and 1.3", least > 0.2 && most < 1.3));
    (void)inverse;
  }
  PetscCall(PCDestroy(&pc));
  for (Vec &row : subspace->rows) PetscCall(VecDestroy(&row));
  PetscCall(VecDestroy(&places));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(MatDestroy(&T));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (PetscInt bs : {2, 3})
    for (auto kind : {Lattice::EVEN, Lattice::HOLE, Lattice::SMALL, Lattice::LAST}) {
      Lattice l = Usual(bs);

      l.layout = kind;
      for (bool rounded : {false, true}) PetscCall(Products(l, rounded));
    }
  PetscCall(FewRows(17, -1));
  PetscCall(FewRows(17, 1));
  for (PetscInt bs : {2, 3})
    for (PetscReal contrast : {1.0, 1e4}) {
      Lattice l = Usual(bs);

      l.contrast = contrast;
      PetscCall(Bounds(l, 10.0));
    }
  for (bool kept : {false, true})
    for (bool single : {false, true}) PetscCall(Cycle(Usual(3), single, kept));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
