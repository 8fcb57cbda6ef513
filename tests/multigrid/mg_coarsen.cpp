static char help[] = "Aggregates, smoothed interpolation, its modes, Galerkin products and eigenvalue estimates, "
                     "against dense algebra.\n\n";

#include "internal.h"
#include <algorithm>

struct Level {
  Mat                 A;
  Dense               dense, modes;
  Column              diagonal; /* of A, or 1 where that has none */
  AinsworthBlockMat   X;
  AinsworthModes      near;
  AinsworthAggregates agg;
};

static PetscErrorCode LevelCreate(const Lattice &l, PetscReal theta, Level *level)
{
  PetscFunctionBeginUser;
  PetscCall(LatticeCreate(l, &level->A));
  PetscCall(LatticeScale(level->A));
  PetscCall(Gather(level->A, level->dense));
  level->diagonal = level->dense.diagonal();
  for (PetscScalar &d : level->diagonal)
    if (d == 0.0) d = 1.0; /* a line of bars has no stiffness across */
  /* as for the finest level; the others of this program are stored */
  PetscCall(AinsworthBlockMatOpen(level->A, l.bs, {}, NULL, &level->X));
  PetscCall(Modes(l, level->A, &level->near, &level->modes));
  PetscCall(AinsworthAggregate(level->X.rows, std::move(AinsworthBlockSurvey(level->X).square), theta, level->near,
                               &level->agg));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Is there a block other than zero between the nodes? */
static bool Coupled(const Dense &A, PetscInt bs, PetscInt a, PetscInt b)
{
  return a != b && A.block(a * bs, b * bs, bs, bs).cwiseAbs().maxCoeff() > 0.0;
}

/*
   Each coupled node is in one aggregate of its rank, each aggregate has nodes and is connected; those of two bodies
   have none in common
*/
static PetscErrorCode CheckAggregates(const Lattice &l, const Level &level)
{
  const PetscInt        n = level.X.rows.n, first = level.X.cols.first, N = l.nodes();
  bool                  all = (PetscInt)level.agg.of.size() == n, connected = true, full = true;
  PetscInt              count[2] = {level.agg.count, 0}, single = 0;
  std::vector<PetscInt> members(level.agg.count, 0), part(n);

  PetscFunctionBeginUser;
  for (PetscInt i = 0; all && i < n; i++) {
    bool coupled = false;

    for (PetscInt b = 0; b < N; b++) coupled = coupled || Coupled(level.dense, l.bs, first + i, b);
    all = level.agg.of[i] < level.agg.count && (level.agg.of[i] >= 0) == coupled;
    if (level.agg.of[i] >= 0) members[level.agg.of[i]]++;
    count[1] += coupled;
    part[i] = i;
  }
  PetscCall(CheckTrue("a node is in an aggregate if A couples it to another", all));
  for (bool changed = true; changed;) { /* the smallest node that can be reached within the aggregate */
    changed = false;
    for (PetscInt i = 0; i < n; i++)
      for (PetscInt j = 0; j < n; j++)
        if (level.agg.of[i] == level.agg.of[j] && part[j] < part[i] &&
            Coupled(level.dense, l.bs, first + i, first + j)) {
          part[i] = part[j];
          changed = true;
        }
  }
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j = 0; j < n; j++)
      connected = connected && (level.agg.of[i] < 0 || level.agg.of[i] != level.agg.of[j] || part[i] == part[j]);
  PetscCall(CheckTrue("aggregates are connected", connected));
  for (PetscInt m : members) full = full && m > 0;
  PetscCall(CheckTrue("no aggregate is empty", full));
  for (PetscInt i = 0; i < n; i++)
    if (level.agg.of[i] >= 0 && members[level.agg.of[i]] == 1) {
      PetscReal here = 0.0, elsewhere = 0.0;

      for (PetscInt j = 0; j < N; j++) {
        const PetscReal size = j == first + i
                                 ? 0.0
                                 : (PetscReal)level.dense.block((first + i) * l.bs, j * l.bs, l.bs, l.bs).norm();
        PetscReal      &best = first <= j && j < first + n ? here : elsewhere;

        best = PetscMax(best, size);
      }
      single += here > elsewhere * (1 + 1e-12);
    }
  PetscCall(CheckInt("nodes on their own with their strongest neighbor on this rank", single, 0));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  if (l.n > 1) PetscCall(CheckTrue("aggregates are larger than a pair on average", 2 * count[0] <= count[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Interpolate(const Lattice &l, const Level &level, PetscReal omega, bool together,
                                  AinsworthInterpolation *P, Dense *dense, Dense *coarse)
{
  const PetscInt         k = level.near.k;
  std::vector<PetscReal> diagonal;
  AinsworthModes         modes(level.near);
  AinsworthAggregates    agg(level.agg);
  AinsworthTies          ties;
  AinsworthTentative     T;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < level.X.rows.n * l.bs; i++)
    diagonal.push_back(PetscRealPart(level.diagonal[level.X.cols.first * l.bs + i]));
  PetscCall(TentativeCreate(&agg, l.bs, together, &modes, &ties, &T));
  const PetscLayout layout = T.layout.get();
  if (omega == 0.0) PetscCall(AinsworthTentativeInterpolate(T, P));
  else PetscCall(AinsworthTentativeSmooth(level.X, T, diagonal, omega, false, P));
  PetscCall(Gather(P->rows, P->cols, level.X.cols.first, l.nodes(), *dense));
  PetscCall(CheckInt("values of the modes on the next level", (PetscInt)modes.values.size(),
                     (layout->rend - layout->rstart) * k * k));
  PetscCall(GatherModes(modes, k, layout, coarse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckGalerkin(const char *what, const AinsworthBlockMat &X, const Dense &dense,
                                    const AinsworthInterpolation &P, const Dense &denseP)
{
  AinsworthHalf     half;
  AinsworthBlockMat coarse;
  Dense             got;

  PetscFunctionBeginUser;
  PetscCall(AinsworthGalerkin(X, P, &half));
  PetscCall(OpenHalf(half, &coarse));
  PetscCall(Gather(coarse, got));
  PetscCall(Check(what, (got - denseP.adjoint() * dense * denseP).norm(), 1e-15 * dense.norm() * denseP.squaredNorm()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckInterpolation(const Lattice &l, const Level &level, bool together)
{
  AinsworthInterpolation T, P;
  Dense                  denseT, denseP, coarse, again, modes = level.modes;
  const PetscReal        omega   = 0.4;
  Column                 inverse = level.diagonal.cwiseInverse();

  PetscFunctionBeginUser;
  for (PetscInt a = 0; a < l.nodes(); a++) { /* interpolation leaves nodes alone that A does not couple */
    bool coupled = false;

    for (PetscInt b = 0; b < l.nodes(); b++) coupled = coupled || Coupled(level.dense, l.bs, a, b);
    if (!coupled) modes.middleRows(a * l.bs, l.bs).setZero();
    if (!coupled) inverse.segment(a * l.bs, l.bs).setZero();
  }
  PetscCall(Interpolate(l, level, 0.0, together, &T, &denseT, &coarse));
  PetscCall(CheckEqual("T Nc", denseT * coarse, modes, 1e-12));
  const Dense gram        = denseT.adjoint() * denseT;
  bool        orthonormal = true;
  for (Eigen::Index c = 0; c < gram.cols(); c++) { /* columns of length 1, or zero where modes depend on each other */
    const PetscReal d = PetscAbsScalar(gram(c, c));

    orthonormal = orthonormal && (d == 0.0 || PetscAbsReal(d - 1.0) < 1e-12) && gram.col(c).norm() <= d + 1e-12;
  }
  PetscCall(CheckTrue("columns of T are orthonormal or zero", orthonormal));
  PetscCall(Interpolate(l, level, omega, together, &P, &denseP, &again));
  PetscCall(CheckEqual("coarse modes", again, coarse, 0.0));
  const Dense smoothing = Dense::Identity(inverse.size(), inverse.size()) - omega * inverse.asDiagonal() * level.dense;
  PetscCall(CheckEqual("P = (I - omega D^-1 A) T", denseP, smoothing * denseT, 1e-14));
  PetscCall(CheckEqual("P Nc", denseP * again, modes - omega * inverse.asDiagonal() * level.dense * modes, 1e-12));

  Mat               D;
  AinsworthBlockMat X;
  Dense             dense;
  PetscCall(CheckGalerkin("P' A P", level.X, level.dense, P, denseP));
  PetscCall(SurfaceCreate(l, level.A, 2.0, 5, &D));
  PetscCall(Gather(D, dense));
  PetscCall(AinsworthBlockMatOpen(D, l.bs, {}, NULL, &X));
  PetscCall(CheckGalerkin("P' D P", X, dense, P, denseP));
  PetscCall(MatDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Coarsening(const char *name, Lattice l, PetscReal theta)
{
  const char *layout;

  PetscFunctionBeginUser;
  for (auto kind : {Lattice::EVEN, Lattice::HOLE, Lattice::SMALL, Lattice::LAST}) {
    Level level;

    l.layout = kind;
    PetscCall(LayoutName(l, &layout));
    Case("%s, %s", name, layout);
    PetscCall(LevelCreate(l, theta, &level));
    PetscCall(CheckAggregates(l, level));
    for (bool together : {false, true}) PetscCall(CheckInterpolation(l, level, together));
    PetscCall(MatDestroy(&level.A));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A layer far stiffer than the rest shares no aggregate with it; with one connection only of its nodes it would be
   joined
*/
static PetscErrorCode Strength()
{
  Lattice  l;
  Level    level;
  PetscInt common = 0;

  PetscFunctionBeginUser;
  Case("strength of connections");
  l.layers   = 12; /* with few nodes a rank theta falls to zero, so that the next level is smaller */
  l.contrast = 1e6;
  PetscCall(LevelCreate(l, 0.03, &level));
  for (PetscInt i = 0; i < level.X.rows.n; i++)
    for (PetscInt j = 0; j < level.X.rows.n; j++) {
      const PetscInt half = l.nodes() / 2;
      common += level.X.cols.first + i < half && level.X.cols.first + j >= half && level.agg.of[i] == level.agg.of[j];
    }
  PetscCall(CheckInt("pairs of a soft and a stiff node in one aggregate", common, 0));
  PetscCall(MatDestroy(&level.A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Modes from coordinates are those that a truss does not feel; others as they are given */
static PetscErrorCode CheckModes(PetscInt bs)
{
  Lattice                l;
  Mat                    A;
  Dense                  dense, modes;
  AinsworthModes         near;
  MatNullSpace           space;
  std::vector<PetscReal> x;
  PetscInt               n, start;

  PetscFunctionBeginUser;
  Case("modes, blocks of %d", (int)bs);
  l.bs       = bs;
  l.floating = true;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(Gather(A, dense));
  PetscCall(Modes(l, A, &near, &modes));
  PetscCall(CheckInt("modes", near.k, bs == 2 ? 3 : bs == 3 ? 6 : bs));
  PetscCall(CheckTrue("rotations", near.rotations == (bs < 4)));
  PetscCall(Check("A N", (dense * modes).norm(), 1e-12 * dense.norm() * modes.norm()));
  Eigen::ColPivHouseholderQR<Dense> qr(modes);
  PetscCall(CheckInt("rank of N", (PetscInt)qr.rank(), near.k));

  PetscCall(LatticeSetNearNullSpace(l, A));
  PetscCall(MatGetNearNullSpace(A, &space));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetOwnershipRange(A, &start, NULL));
  PetscCall(LatticeCoordinates(l, A, x));
  PetscCall(AinsworthModesCreate(A, bs, {}, space, l.dim(), x.data(), &near));
  const Vec *vec;
  PetscInt   nvec;
  PetscBool  constant;
  PetscCall(MatNullSpaceGetVecs(space, &constant, &nvec, &vec));
  PetscCall(CheckInt("given modes", near.k, nvec));
  for (PetscInt c = 0; c < nvec; c++) {
    Column expected;
    bool   same = true;

    PetscCall(Gather(vec[c], expected));
    for (PetscInt i = 0; i < n; i++) same = same && near.values[i * near.k + c] == expected[start + i];
    PetscCall(CheckTrue("modes as given", same));
  }
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_TRUE, 1, vec, &space));
  PetscCall(AinsworthModesCreate(A, bs, {}, space, 0, NULL, &near));
  bool same = near.k == 2;
  for (PetscInt i = 0; same && i < n; i++) same = near.values[2 * i] == 1.0;
  PetscCall(CheckTrue("a null space with the constant vector", same));
  PetscCall(MatNullSpaceDestroy(&space));
  PetscCall(AinsworthModesCreate(A, bs, {}, NULL, 0, NULL, &near));
  same = near.k == bs && near.rotations == (bs == 1);
  for (PetscInt i = 0; same && i < n * bs; i++) same = near.values[i] == (i / bs % bs == i % bs ? 1.0 : 0.0);
  PetscCall(CheckTrue("translations where nothing is known", same));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The estimate is from below, and not far */
static PetscErrorCode Estimate(PetscInt bs, PetscReal contrast, PetscReal stiffness)
{
  Lattice                   l;
  Mat                       A, D;
  Dense                     dense, added;
  AinsworthBlockMat         X;
  AinsworthHierarchyOptions o = UsualOptions();

  PetscFunctionBeginUser;
  Case("eigenvalue, blocks of %d, contrast %g, surface %g", (int)bs, (double)contrast, (double)stiffness);
  l.bs       = bs;
  l.n        = bs == 2 ? 8 : 4;
  l.contrast = contrast;
  o.single   = PETSC_TRUE;
  o.product  = PETSC_TRUE;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(Gather(A, dense));
  PetscCall(SurfaceCreate(l, A, stiffness, 6, &D));
  PetscCall(Gather(D, added));
  PetscCall(AinsworthBlockMatOpen(D, bs, {}, NULL, &X));
  X.store();
  {
    AinsworthHierarchy h;

    PetscCall(HierarchyCreate(l, A, o, &h));
    for (bool single : {false, true})
      for (bool sum : {false, true}) {
        const Dense                     M = sum ? Dense(dense + added) : dense;
        std::unique_ptr<AinsworthLevel> level;
        const PetscReal
          largest = Eigen::SelfAdjointEigenSolver<Dense>(Scaled(M, M), Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();

        PetscCall(h.finest.createLevel(sum ? &X : NULL, single, !single, &level));
        PetscCall(level->estimate(NULL, {}));
        PetscCall(Check("estimate over the eigenvalue", level->largest / largest, single ? 1.0 + 1e-5 : 1.0 + 1e-12));
        PetscCall(Check("eigenvalue over the estimate", largest / level->largest, 1.0 / 0.6));
        if (!sum)
          PetscCall(Check("estimate of the hierarchy", PetscAbsReal(h.finest.largest / level->largest - 1.0), 1e-2));
      }
  }
  PetscCall(MatDestroy(&D));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Lattice l;
  int     exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  l.layers = 5;
  for (PetscInt bs : {1, 2, 3, 4, 6}) {
    char name[32];

    l.bs = bs;
    l.n  = bs == 2 ? 7 : 3;
    snprintf(name, sizeof(name), "blocks of %d", (int)bs);
    PetscCall(Coarsening(name, l, 0.03));
    PetscCall(CheckModes(bs));
  }
  l          = Lattice();
  l.n        = 3;
  l.contrast = 1e6;
  PetscCall(Coarsening("contrast", l, 0.03));
  l.alone = l.apart = true;
  PetscCall(Coarsening("two bodies, some nodes alone", l, 0.03));
  l.floating = true;
  PetscCall(Coarsening("floating, few strong neighbors", l, 0.5));
  l.n      = 1; /* rotation about the line is no mode */
  l.layers = 9;
  l.alone  = false;
  PetscCall(Coarsening("a line", l, 0.03));
  PetscCall(Strength());
  for (PetscReal contrast : {1.0, 1e6}) {
    PetscCall(Estimate(1, contrast, 10.0));
    PetscCall(Estimate(2, contrast, 0.1));
    PetscCall(Estimate(3, contrast, 10.0));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
