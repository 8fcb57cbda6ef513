static char help[] = "Blocks, their products, their way between ranks and their conversion, against dense algebra.\n\n";

#include "internal.h"
#include <multigrid/path.h>

/* The blocks of an AIJ matrix, places and ghosts */
static PetscErrorCode Extraction(const Lattice &l, Mat A, const Dense &dense)
{
  AinsworthBlockMat     X, whole;
  AinsworthHalf         half;
  Dense                 got;
  std::vector<PetscInt> number, ghost;
  bool                  rising = true, outside = true;

  PetscFunctionBeginUser;
  PetscCall(AinsworthBlockMatOpen(A, l.bs, {}, NULL, &X));
  PetscCall(Gather(X, got));
  PetscCall(CheckEqual("blocks", got, dense, 0.0));
  AinsworthHalfTake(X, &half);
  PetscCall(OpenHalf(half, &whole));
  PetscCall(CheckTrue("half of the blocks has all of them", whole.rows.j == X.rows.j));
  PetscCall(Gather(whole, got));
  PetscCall(CheckEqual("blocks, of which half are stored", got, dense, 1e-15));
  for (PetscInt i = 0; i < X.rows.n; i++)
    for (PetscInt k = X.rows.i[i] + 1; k < X.rows.i[i + 1]; k++) rising = rising && X.rows.j[k - 1] < X.rows.j[k];
  PetscCall(CheckTrue("places rise along a row", rising));
  for (PetscInt i = 0; i < X.cols.local; i++) number.push_back(X.cols.first + i);
  ghost.assign(X.cols.ghosts.size(), -1);
  PetscCall(X.cols.toGhosts(MPIU_INT, number.data(), ghost.data()));
  PetscCall(CheckTrue("owners know the ghosts by the same numbers", ghost == X.cols.ghosts));
  for (size_t g = 0; g < X.cols.ghosts.size(); g++) {
    const PetscInt node = X.cols.ghosts[g];
    outside             = outside && (node < X.cols.first || node >= X.cols.first + X.cols.local) &&
              (!g || X.cols.ghosts[g - 1] < node);
    outside = outside && X.cols.place(node) == X.cols.local + (PetscInt)g &&
              X.cols.node(X.cols.local + (PetscInt)g) == node;
  }
  PetscCall(CheckTrue("ghosts are nodes of other ranks, rising", outside));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a row of node holds: so many blocks, their columns and values */
static PetscInt Length(PetscInt node, PetscInt sender)
{
  return (node + 2 * sender) % 4;
}

static PetscErrorCode FillRow(AinsworthBlockRows &rows, PetscInt node, PetscInt sender)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < Length(node, sender); k++) {
    rows.j.push_back(1000 * node + 10 * k + sender);
    for (PetscInt q = 0; q < rows.size(); q++) rows.a.push_back(Uniform(node, sender, 100 * k + q));
  }
  rows.endRow();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static bool SameRow(const AinsworthBlockRows &rows, PetscInt row, PetscInt node, PetscInt sender)
{
  AinsworthBlockRows expected(rows.br, rows.bc);

  (void)FillRow(expected, node, sender);
  if (rows.i[row + 1] - rows.i[row] != expected.i[1]) return false;
  return std::equal(expected.j.begin(), expected.j.end(), rows.j.begin() + rows.i[row]) &&
         std::equal(expected.a.begin(), expected.a.end(), rows.block(rows.i[row]));
}

/* Rows of different lengths to ghosts and back to owners */
static PetscErrorCode Exchange(const Lattice &l, Mat A)
{
  AinsworthBlockMat     X;
  AinsworthBlockRows    rows(2, 3), arrived;
  std::vector<PetscInt> owner;
  PetscMPIInt           rank, size;
  bool                  same = true;
  PetscInt              count[2];

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(AinsworthBlockMatOpen(A, l.bs, {}, NULL, &X));
  for (PetscInt i = 0; i < X.cols.local; i++) PetscCall(FillRow(rows, X.cols.first + i, 0));
  if (X.cols.sf) PetscCall(AinsworthSendRows(X.cols.sf, rows, (PetscInt)X.cols.ghosts.size(), &arrived));
  same = arrived.n == (PetscInt)X.cols.ghosts.size() && arrived.i.size() == X.cols.ghosts.size() + 1;
  if (X.cols.sf) same = same && arrived.br == 2 && arrived.bc == 3;
  for (PetscInt g = 0; same && g < arrived.n; g++) same = SameRow(arrived, g, X.cols.ghosts[g], 0);
  PetscCall(CheckTrue("rows of the owners arrive at the ghosts", same));

  rows = AinsworthBlockRows(2, 3);
  for (PetscInt node : X.cols.ghosts) PetscCall(FillRow(rows, node, rank));
  arrived = AinsworthBlockRows();
  PetscCall(AinsworthRowsToOwners(X.cols, rows, &owner, &arrived));
  same = arrived.n == (PetscInt)owner.size() && std::is_sorted(owner.begin(), owner.end());
  for (PetscInt r = 0; same && r < arrived.n; r++) { /* of several senders in any order, but each once */
    bool any = false;

    same = owner[r] >= 0 && owner[r] < X.cols.local;
    for (PetscInt sender = 0; sender < size; sender++)
      any = any || (sender != rank && SameRow(arrived, r, X.cols.first + owner[r], sender));
    same = same && any;
    for (PetscInt s = r - 1; same && s >= 0 && owner[s] == owner[r]; s--) {
      const PetscInt a = arrived.i[s], b = arrived.i[r];
      if (arrived.i[s + 1] > a && arrived.i[r + 1] > b) same = arrived.j[a] != arrived.j[b];
    }
  }
  PetscCall(CheckTrue("rows of the ghosts arrive at the owners", same));
  count[0] = rows.n - arrived.n;
  count[1] = rows.i.back() - arrived.i.back();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(CheckTrue("all of them", !count[0] && !count[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A level of A, or of A and what is added, as a matrix: products, diagonal, conversion; stored: NULL, or the same to
   the last bit
*/
static PetscErrorCode CheckLevel(const char *what, const AinsworthHierarchy &h, const AinsworthBlockMat *added,
                                 bool single, const Dense &expected, const Dense *stored)
{
  std::unique_ptr<AinsworthLevel> level;
  Mat                             mat = NULL, aij;
  Vec                             d;
  Dense                           got;
  Column                          diagonal;
  const PetscReal                 tolerance = single ? 1e-6 : 1e-14;

  PetscFunctionBeginUser;
  PetscCall(h.finest.createLevel(added, single, !single, &level));
  PetscCall(CheckTrue("precision", single == (level->single != nullptr) && single != level->exact()));
  PetscCall(AinsworthLevelMatSet(h.finest.nodes, h.finest.bs, std::move(level), &mat));
  PetscCall(Gather(mat, got));
  PetscCall(CheckEqual(what, Scaled(got, expected), Scaled(expected, expected), tolerance));
  PetscCall(MatCreateVecs(mat, &d, NULL));
  PetscCall(MatGetDiagonal(mat, d));
  PetscCall(Gather(d, diagonal));
  PetscCall(CheckEqual("diagonal", diagonal, expected.diagonal(), 1e-15));
  PetscCall(VecDestroy(&d));
  if (single) {
    PetscCall(CheckError("conversion", [mat, &aij] { return MatConvert(mat, MATAIJ, MAT_INITIAL_MATRIX, &aij); },
                         PETSC_ERR_SUP, {"-pc_blocksa_precision double"}));
  } else {
    PetscCall(MatConvert(mat, MATAIJ, MAT_INITIAL_MATRIX, &aij));
    PetscCall(Gather(aij, got));
    PetscCall(CheckEqual("as AIJ", got, expected, 1e-15));
    if (stored) PetscCall(CheckEqual("no bit is lost", got, *stored, 0.0));
    PetscCall(MatDestroy(&aij));
  }
  PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Products(const Lattice &l, Mat A, const Dense &dense)
{
  AinsworthHierarchyOptions o = UsualOptions();
  Mat                       D;
  AinsworthBlockMat         X, Y, whole;
  AinsworthHalf             half, surface, both;
  Dense                     added, sum, kept;

  PetscFunctionBeginUser;
  PetscCall(SurfaceCreate(l, A, 3.0, 4, &D));
  PetscCall(Gather(D, added));
  PetscCall(AinsworthBlockMatOpen(D, l.bs, {}, NULL, &X));
  X.store();
  PetscCall(AinsworthBlockMatOpen(A, l.bs, {}, NULL, &Y));
  AinsworthHalfTake(X, &surface);
  AinsworthHalfTake(Y, &half);
  PetscCall(OpenHalf(half, &whole));
  PetscCall(Gather(whole, kept));
  PetscCall(AinsworthHalfAdd(half, surface, &both));
  PetscCall(OpenHalf(both, &whole));
  PetscCall(Gather(whole, sum));
  PetscCall(CheckEqual("A + D, of which half are stored", sum, dense + added, 1e-15));
  o.single  = PETSC_TRUE;
  o.product = PETSC_TRUE;
  {
    AinsworthHierarchy h;
    Mat                product;
    Vec                x, y;
    Dense              got;

    PetscCall(HierarchyCreate(l, A, o, &h));
    PetscCall(CheckTrue("more than one level", h.levels() > 1));
    PetscCall(CheckLevel("A in double precision", h, NULL, false, dense, &kept));
    PetscCall(CheckLevel("A + D in double precision", h, &X, false, dense + added, NULL));
    PetscCall(CheckTrue("single precision", h.single()));
    PetscCall(CheckLevel("A in single precision", h, NULL, true, dense, NULL));
    PetscCall(CheckLevel("A + D in single precision", h, &X, true, dense + added, NULL));
    PetscCall(AinsworthGridCreateProduct(h.finest, &product));
    PetscCall(Gather(product, got));
    PetscCall(CheckEqual("A for products", got, dense, 1e-15));
    PetscCall(MatCreateVecs(product, &x, &y));
    PetscCall(GatherOperator(
      y, x, [product](Vec in, Vec out) { return MatMultTranspose(product, in, out); }, got));
    PetscCall(CheckEqual("its transpose", got, dense.transpose(), 1e-15));
    PetscCall(VecDestroy(&x));
    PetscCall(VecDestroy(&y));
    PetscCall(MatDestroy(&product));
  }
  PetscCall(MatDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Interpolation as a matrix, in both precisions: product, transpose, sum and conversion */
static PetscErrorCode CheckInterpolation(const AinsworthHierarchy &h, bool single)
{
  Mat   mat, aij;
  Vec   coarse, fine;
  Dense expected, got, transposed;

  PetscFunctionBeginUser;
  auto P = std::make_shared<AinsworthInterpolation>(*h.finest.P);
  PetscCall(Gather(P->rows, P->cols, h.finest.nodes->rstart, h.finest.nodes->N, expected));
  if (single) {
    expected = expected.unaryExpr([](PetscScalar v) { return (PetscScalar)(AinsworthSingle)v; });
    P->single.assign(P->rows.a.begin(), P->rows.a.end());
    P->rows.a.clear();
  }
  PetscCall(AinsworthInterpolationMatCreate(P, h.finest.nodes, 1, &mat));
  PetscCall(Gather(mat, got));
  PetscCall(CheckEqual("interpolation", got, expected, 1e-15));
  PetscCall(MatCreateVecs(mat, &coarse, &fine));
  PetscCall(GatherOperator(
    fine, coarse, [mat](Vec x, Vec y) { return MatMultTranspose(mat, x, y); }, transposed));
  PetscCall(CheckEqual("its transpose", transposed, expected.transpose(), 1e-15));
  PetscCall(GatherOperator(
    coarse, fine,
    [mat](Vec x, Vec y) {
      PetscFunctionBeginUser;
      PetscCall(VecSet(y, 2.0));
      PetscCall(MatMultAdd(mat, x, y, y));
      PetscCall(VecShift(y, -2.0));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    got));
  PetscCall(CheckEqual("and added to a vector", got, expected, 1e-14));
  PetscCall(VecDestroy(&coarse));
  PetscCall(VecDestroy(&fine));
  PetscCall(MatConvert(mat, MATAIJ, MAT_INITIAL_MATRIX, &aij));
  PetscCall(Gather(aij, got));
  PetscCall(CheckEqual("interpolation as AIJ", got, expected, 1e-15));
  PetscCall(MatDestroy(&aij));
  PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A coarser level: products in single precision, and residuals, which are exact where smoothing did not begin with
   zero, as rounding of M x is then amplified by the coarser levels
*/
static PetscErrorCode Rounded(Lattice l)
{
  AinsworthHierarchyOptions       o = UsualOptions();
  AinsworthHierarchy              h;
  std::vector<AinsworthGrid>      grids;
  std::unique_ptr<AinsworthLevel> level;
  Mat                             A, mat = NULL, alone = NULL;
  Vec                             b, x, r;
  Dense                           exact, rounded;
  Column                          got, at, rhs;

  PetscFunctionBeginUser;
  Case("coarser level, blocks of %d", (int)l.bs);
  PetscCall(LatticeCreate(l, &A));
  o.single     = PETSC_TRUE;
  o.coarseSize = 10;
  PetscCall(HierarchyCreate(l, A, o, &h));
  PetscCall(h.createGrids(NULL, &grids));
  PetscCall(CheckTrue("a level between", grids.size() > 2 && grids[1].single && !grids.back().single));
  PetscCall(grids[1].createLevel(NULL, true, true, &level));
  AinsworthScaled &single = *level->single;
  single.s                = std::make_shared<PetscReal>(1.0);
  PetscCall(AinsworthLevelMatSet(grids[1].nodes, grids[1].bs, std::move(level), &mat));
  PetscCall(MatCreateVecs(mat, &x, &b));
  PetscCall(VecDuplicate(b, &r));
  PetscCall(Gather(mat, exact));
  PetscCall(grids[1].createLevel(NULL, true, false, &level));
  PetscCall(AinsworthLevelMatSet(grids[1].nodes, grids[1].bs, std::move(level), &alone));
  PetscCall(Gather(alone, rounded));
  PetscCall(Check("products", Scaled(rounded - exact, exact).norm() / Scaled(exact, exact).norm(), 1e-6));
  PetscCall(VecSetRandom(b, NULL));
  for (bool zero : {true, false}) {
    bool found = false;

    PetscCall(VecSet(x, zero ? 0.0 : 1e4));
    PetscCall(single.smooth(2, 0.2, 2.0, (PetscBool)zero, NULL, b, x));
    PetscCall(single.residual(true, b, x, r, &found));
    PetscCall(CheckTrue("what smoothing has left", found == zero));
    if (!found) PetscCall(MatResidual(mat, b, x, r));
    PetscCall(Gather(r, got));
    PetscCall(Gather(x, at));
    PetscCall(Gather(b, rhs));
    const PetscReal error = (got - (rhs - exact * at)).norm() / (exact * at).norm();
    PetscCall(Check("residual", error, zero ? 1e-6 : 1e-14));
  }
  for (Vec *v : {&b, &x, &r}) PetscCall(VecDestroy(v));
  for (Mat *M : {&mat, &alone}) PetscCall(MatDestroy(M));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Kernels(Lattice l)
{
  const char *name;

  PetscFunctionBeginUser;
  for (auto layout : {Lattice::EVEN, Lattice::HOLE, Lattice::SMALL, Lattice::LAST}) {
    Mat   A;
    Dense dense;

    l.layout = layout;
    PetscCall(LayoutName(l, &name));
    Case("blocks of %d, %s", (int)l.bs, name);
    PetscCall(LatticeCreate(l, &A));
    PetscCall(LatticeScale(A));
    PetscCall(Gather(A, dense));
    PetscCall(Extraction(l, A, dense));
    PetscCall(Exchange(l, A));
    PetscCall(Products(l, A, dense));
    AinsworthHierarchy h;
    PetscCall(HierarchyCreate(l, A, UsualOptions(), &h));
    for (bool single : {false, true}) PetscCall(CheckInterpolation(h, single));
    PetscCall(MatDestroy(&A));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values in single precision and the bits that they lack, for all exponents that the diagonal leaves to entries */
static PetscErrorCode LowBits()
{
  bool same = true, near = true;

  PetscFunctionBeginUser;
  Case("bits that single precision lacks");
  for (int exponent = -300; exponent <= 120; exponent++)
    for (PetscInt k = 0; k < 60; k++) {
      /* sums of two make all of the 53 bits random; the last ones round up to the next power of two, or are exact */
      const double mantissa = k == 0   ? 2.0 - ldexp(1.0, -52)
                              : k == 1 ? 1.0
                              : k == 2 ? 1.0 + ldexp(1.0, -24)
                                       : 1.5 + 0.25 * (Uniform(exponent, k, 1) + ldexp(Uniform(exponent, k, 2), -27)),
                   v        = ldexp(k % 2 ? mantissa : -mantissa, exponent),
                   joined   = AinsworthJoin((float)v, AinsworthLowBits(v, (float)v));

      if (exponent >= -127) same = same && joined == v;
      near = near && fabs(joined - v) <= ldexp(1.0, -149);
    }
  PetscCall(CheckTrue("no bit is lost", same));
  PetscCall(CheckTrue("or next to nothing of the smallest numbers", near));
  PetscCall(CheckTrue("zero", AinsworthJoin(0.0f, AinsworthLowBits(0.0, 0.0f)) == 0.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values beyond those of single precision, as an indefinite A may have them */
static PetscErrorCode Large()
{
  Lattice                   l;
  AinsworthHierarchyOptions o = UsualOptions();
  Mat                       A;

  PetscFunctionBeginUser;
  Case("large values");
  o.single  = PETSC_TRUE;
  o.product = PETSC_TRUE;
  for (PetscReal large : {1e30, 1e40}) {
    AinsworthHierarchy h;
    Dense              dense, got;
    Mat                product;
    PetscInt           begin, end;

    PetscCall(LatticeCreate(l, &A));
    PetscCall(MatGetOwnershipRange(A, &begin, &end));
    for (PetscInt k : {begin, begin + 1})
      if (begin + 1 < end) PetscCall(MatSetValue(A, k, 2 * begin + 1 - k, large, INSERT_VALUES));
    PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    PetscCall(Gather(A, dense));
    PetscCall(HierarchyCreate(l, A, o, &h));
    PetscCall(CheckTrue("precision", h.single() == (large < 1e35)));
    PetscCall(AinsworthGridCreateProduct(h.finest, &product));
    PetscCall(Gather(product, got));
    PetscCall(CheckEqual("products", got, dense, 1e-15));
    PetscCall(MatDestroy(&product));
    PetscCall(MatDestroy(&A));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Ranks of a level: all where they have many nodes, fewer where not or where messages are dear, one for what is
   factored
*/
static PetscErrorCode Paths()
{
  AinsworthPathModel usual, dear;
  int                group = 0;

  PetscFunctionBeginUser;
  Case("ranks of a level");
  (void)AinsworthPath(usual, 1e5, 512, &group);
  PetscCall(CheckInt("groups of 200 nodes a rank", group, 1));
  (void)AinsworthPath(usual, 1300, 64, &group);
  PetscCall(CheckTrue("some ranks for 20 nodes a rank", group > 1 && group < 64));
  PetscCall(CheckTrue("at least 50 nodes a rank", 1300.0 / ((64 + group - 1) / group) >= 50.0));
  for (int ranks : {1, 7, 64}) {
    (void)AinsworthPath(usual, 100, ranks, &group);
    PetscCall(CheckInt("groups of what is factored", group, ranks));
  }
  (void)AinsworthPath(usual, 0, 0, &group);
  PetscCall(CheckInt("groups of nothing", group, 1));
  dear.coarseSize = 1.0;
  (void)AinsworthPath(dear, 3, 2, &group);
  PetscCall(CheckInt("groups of what cannot be factored", group, 2));
  dear.coarseSize      = 600.0;
  dear.machine.message = 1.0;
  (void)AinsworthPath(dear, 1e5, 512, &group);
  PetscCall(CheckInt("groups with dear messages", (512 + group - 1) / group, 1));
  PetscCall(CheckTrue("a longer path", AinsworthPath(dear, 1e5, 512, NULL) > AinsworthPath(usual, 1e5, 512, NULL)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A W-cycle where the levels below the first coarser one are small and messages cheap */
static PetscErrorCode Cycles()
{
  /* clang-format off */
  const std::vector<AinsworthPathLevel> one  = {{6e6, 1}, {4e6, 1}, {4e5, 1}, {4e4, 1}},
                                        full = {{6e6, 1}, {4e6, 1}, {2e6, 1}, {4e4, 1}};
  /* clang-format on */
  std::vector<AinsworthPathLevel> many = one;
  AinsworthMachine                machine;

  PetscFunctionBeginUser;
  Case("cycle");
  machine.rate    = 1e6;
  machine.message = 0.0;
  PetscCall(Check("two visits",
                  PetscAbsReal(AinsworthPathCycle(machine, one, 1) - (6 * (6 + 2 * 4 + 2 * 0.4) + 2 * 0.04)), 1e-12));
  PetscCall(Check("W-cycle", PetscAbsReal(AinsworthPathCycle(machine, one, 2) - (6 * (6 + 2 * 4 + 4 * 0.4) + 4 * 0.04)),
                  1e-12));
  PetscCall(CheckTrue("W where that costs little", AinsworthPathPrefersW(machine, one)));
  PetscCall(CheckTrue("not where the second coarser level is large", !AinsworthPathPrefersW(machine, full)));
  for (AinsworthPathLevel &level : many) level.ranks = 64;
  PetscCall(CheckTrue("W on many ranks without latency", AinsworthPathPrefersW(machine, many)));
  machine.message = 1e-2;
  PetscCall(CheckTrue("not where messages are dear", !AinsworthPathPrefersW(machine, many)));
  /* clang-format off */
  PetscCall(CheckTrue("the same as two visits of two or three levels",
                      AinsworthPathPrefersW(machine, {{6e6, 64}}) &&
                        AinsworthPathPrefersW(machine, {{6e6, 64}, {4e4, 1}}) &&
                        AinsworthPathPrefersW(machine, {{6e6, 64}, {4e6, 64}, {4e4, 1}})));
  /* clang-format on */
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(Paths());
  PetscCall(Cycles());
  PetscCall(LowBits());
  PetscCall(Large());
  for (PetscInt bs : {1, 2, 3, 4, 6}) {
    Lattice l;

    l.bs     = bs;
    l.n      = bs == 2 ? 7 : 3;
    l.layers = bs == 2 ? 6 : 5;
    PetscCall(Kernels(l));
    l.n      = bs == 2 ? 12 : 7;
    l.layers = bs == 2 ? 24 : 8;
    PetscCall(Rounded(l));
  }
  Lattice jump; /* scaling by powers of two matters */
  jump.n        = 3;
  jump.layers   = 5;
  jump.contrast = 1e7;
  jump.alone    = true;
  PetscCall(Kernels(jump));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
