static char help[] = "Nodes that A knows nothing of, and what rows of C let them follow, against dense algebra.\n\n";

#include "internal.h"
#include <map>

/* What the rows of a node without stiffness ask for */
enum Kind {
  NEAR,     /* it moves as the nodes next to it */
  FAR,      /* it moves as all nodes do */
  GRADIENT, /* it is the derivative of the motion, which no mode moves in all ways */
  WRONG,    /* its rows contradict each other */
  SUM       /* its rows tell the sums of two unknowns, and with an even number of them not all motions */
};
static const Kind kinds[] = {NEAR, FAR, NEAR, GRADIENT, WRONG, SUM};

/* May the node follow others? */
static bool May(Kind kind, PetscInt bs)
{
  return kind == NEAR || kind == FAR || (kind == SUM && bs % 2);
}

struct Tied {
  PetscInt                      node = 0;
  Kind                          kind = NEAR;
  std::map<PetscInt, PetscReal> to; /* nodes and their weights */
};

static bool Alone(PetscInt a)
{
  return a % 7 == 3;
}

/* Coordinates of all nodes */
static Dense Coordinates(const Lattice &l)
{
  Dense x = Dense::Zero(l.nodes(), l.dim());

  for (PetscInt a = 0; a < l.nodes(); a++) {
    x(a, 0)           = (PetscReal)(a % l.n);
    x(a, l.dim() - 1) = (PetscReal)(l.dim() == 2 ? a / l.n : a / l.n / l.n);
    if (l.dim() == 3) x(a, 1) = (PetscReal)(a / l.n % l.n);
  }
  return x;
}

/* Gives nodes the least weights with a given sum and moments; those without a weight are left out */
static void Weigh(const Dense &x, PetscReal sum, const Column &moments, std::map<PetscInt, PetscReal> *nodes)
{
  std::map<PetscInt, PetscReal> all;
  Dense                         M(1 + x.cols(), (Eigen::Index)nodes->size());
  Column                        b(1 + x.cols());
  Eigen::Index                  k = 0;

  b << sum, moments;
  all.swap(*nodes);
  for (const auto &a : all) {
    M(0, k)                         = 1.0;
    M.col(k++).segment(1, x.cols()) = x.row(a.first).transpose();
  }
  const Column w = M.completeOrthogonalDecomposition().solve(b);
  k              = 0;
  for (const auto &a : all) {
    if (PetscAbsScalar(w(k)) > 1e-9) (*nodes)[a.first] = PetscRealPart(w(k));
    k++;
  }
}

/* The rows of C, which belong to all ranks in turn: one or two for each unknown of a tied node */
static PetscErrorCode RowsCreate(const Lattice &l, Mat A, std::vector<Tied> *tied, Mat *C)
{
  const Dense x = Coordinates(l);
  PetscMPIInt rank, size;
  PetscInt    n, first, rows = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (PetscInt a = 3; a < l.nodes(); a += 7) {
    Tied t;

    t.node = a;
    t.kind = kinds[tied->size() % (sizeof(kinds) / sizeof(kinds[0]))];
    for (PetscInt b = 0; b < l.nodes(); b++)
      if (!Alone(b) && (t.kind == FAR || (x.row(b) - x.row(a)).norm() < 1.9)) t.to[b] = 1.0;
    Weigh(x, t.kind == GRADIENT ? 0.0 : 1.0,
          t.kind == GRADIENT ? Column(Column::Unit(x.cols(), 0)) : Column(x.row(a).transpose()), &t.to);
    tied->push_back(t);
    if ((tied->size() - 1) % size == (size_t)rank) rows += t.kind == WRONG ? 2 * l.bs : l.bs;
  }
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(
    MatCreateAIJ(PETSC_COMM_WORLD, rows, n, PETSC_DETERMINE, PETSC_DETERMINE, l.nodes(), NULL, l.nodes(), NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &first, NULL));
  for (size_t k = rank; k < tied->size(); k += size) {
    const Tied &t = (*tied)[k];
    for (PetscReal factor : t.kind == WRONG ? std::vector<PetscReal>{1.0, 3.0} : std::vector<PetscReal>{2.0})
      for (PetscInt c = 0; c < l.bs; c++, first++) {
        for (PetscInt d : {c, t.kind == SUM ? (c + 1) % l.bs : c}) {
          PetscCall(MatSetValue(*C, first, t.node * l.bs + d, t.kind == WRONG ? -1.0 : -factor, INSERT_VALUES));
          for (const auto &b : t.to)
            PetscCall(MatSetValue(*C, first, b.first * l.bs + d, factor * b.second, INSERT_VALUES));
        }
      }
  }
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What nodes without stiffness move as, and the nodes that they are tied to */
static PetscErrorCode CheckFirst(const Lattice &l, const std::vector<Tied> &tied, const AinsworthModes &modes,
                                 const PetscLayout nodes, const AinsworthTies &ties, Dense truth)
{
  Dense found, pattern, expected = Dense::Zero(l.nodes(), l.nodes());

  PetscFunctionBeginUser;
  for (const Tied &t : tied) {
    auto block = truth.middleRows(t.node * l.bs, l.bs);
    if (May(t.kind, l.bs))
      for (const auto &b : t.to) expected(t.node, b.first) = 1.0;
    else block = Dense::Identity(l.bs, modes.k);
  }
  PetscCall(GatherModes(modes, l.bs, nodes, &found));
  PetscCall(CheckEqual("modes of all nodes", found, truth, 1e-8));
  PetscCall(Gather(ties, pattern));
  PetscCall(CheckEqual("ties", pattern, expected, 0.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Checks which nodes follow an aggregate: those tied to at most eight of them, unless that which they are tied to most
   has not all modes; others are coarse nodes with the ties of their aggregates. *count: of both kinds that may follow
*/
static PetscErrorCode CheckNext(const Lattice &l, const std::vector<Tied> &tied, const AinsworthModes &before,
                                const AinsworthTentative &T, const AinsworthTies &ties, const Dense &truth,
                                PetscInt count[2])
{
  std::vector<PetscInt> of(l.nodes(), -1), members(T.layout->N, 0);
  Dense                 pattern, expected = Dense::Zero(T.layout->N, T.layout->N);
  const PetscInt        n     = (PetscInt)T.aggregate.size();
  PetscInt              first = 0, wrong = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Exscan(&n, &first, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  std::copy(T.aggregate.begin(), T.aggregate.end(), of.begin() + first);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, of.data(), (PetscMPIInt)of.size(), MPIU_INT, MPI_MAX, PETSC_COMM_WORLD));
  for (PetscInt g : of) members[g]++;
  for (const Tied &t : tied) {
    std::map<PetscInt, PetscInt> around;
    const PetscInt               own  = of[t.node];
    PetscInt                     lead = -1;

    for (const auto &b : t.to) around[of[b.first]]++;
    for (const auto &g : around)
      if (lead < 0 || g.second > around[lead]) lead = g.first;
    const bool may = May(t.kind, l.bs), follows = around.count(own) > 0;
    Dense      N(0, before.k);
    for (PetscInt b = 0; b < l.nodes(); b++) {
      if (Alone(b) || of[b] != lead) continue;
      N.conservativeResize(N.rows() + l.bs, before.k);
      N.bottomRows(l.bs) = truth.middleRows(b * l.bs, l.bs);
    }
    const bool full = N.completeOrthogonalDecomposition().rank() == before.k;
    if (follows) wrong += !may || around.size() > 8 || own != lead;
    else wrong += members[own] != 1 || (may && full && around.size() <= 8);
    if (may) count[follows]++;
    for (const auto &g : around)
      if (may && !follows) expected(own, g.first) = 1.0;
  }
  PetscCall(CheckInt("nodes that follow, or do not, and should not, or should", wrong, 0));
  if (ties.cols.layout) PetscCall(Gather(ties, pattern));
  else pattern = Dense::Zero(expected.rows(), expected.cols());
  PetscCall(CheckEqual("ties of the coarser level", pattern, expected, 0.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the local unknowns node by node, those of each in reverse order */
static std::vector<PetscInt> Reversed(PetscInt n, PetscInt bs)
{
  std::vector<PetscInt> order;

  for (PetscInt l = 0; l < n * bs; l++) order.push_back(l / bs * bs + bs - 1 - l % bs);
  return order;
}

/* sorted: the unknowns of the matrix are not in the order of the levels */
static PetscErrorCode Follow(Lattice l, bool together, bool sorted, PetscInt count[2])
{
  Mat                    A, C;
  Dense                  truth, dense, coarse;
  AinsworthBlockMat      X;
  AinsworthModes         modes, before;
  AinsworthAggregates    agg;
  AinsworthTies          ties;
  AinsworthTentative     T;
  AinsworthInterpolation P;
  std::vector<Tied>      tied;
  std::vector<PetscInt>  order;
  const char            *layout;

  PetscFunctionBeginUser;
  PetscCall(LayoutName(l, &layout));
  Case("blocks of %d, %s%s%s", (int)l.bs, layout, together ? ", coarse nodes on one rank" : "",
       sorted ? ", sorted" : "");
  PetscCall(LatticeCreate(l, &A));
  PetscCall(RowsCreate(l, A, &tied, &C));
  PetscCall(Modes(l, A, &modes, &truth));
  if (sorted) {
    order          = Reversed((PetscInt)modes.carried.size(), l.bs);
    before         = modes;
    const Dense by = truth;
    for (size_t u = 0; u < order.size() * modes.k; u++)
      modes.values[u] = before.values[order[u / modes.k] * modes.k + u % modes.k];
    for (PetscInt u = 0; u < truth.rows(); u++) truth.row(u) = by.row(u / l.bs * l.bs + l.bs - 1 - u % l.bs);
  }
  PetscCall(AinsworthBlockMatOpen(A, l.bs, order, NULL, &X));
  for (PetscInt i = 0; i < X.rows.n; i++) {
    modes.carried[i] = Alone(X.cols.first + i);
    if (modes.carried[i]) std::fill_n(&modes.values[i * l.bs * modes.k], l.bs * modes.k, 7.0);
  }
  PetscCall(AinsworthTiesCreate(C, l.bs, order, &modes, &ties));
  PetscCall(CheckFirst(l, tied, modes, X.cols.layout.get(), ties, truth));
  PetscCall(GatherModes(modes, l.bs, X.cols.layout.get(), &truth));
  before = modes;
  PetscCall(AinsworthAggregate(X.rows, std::move(AinsworthBlockSurvey(X).square), 0.03, modes, &agg));
  PetscCall(TentativeCreate(&agg, l.bs, together, &modes, &ties, &T));
  PetscCall(AinsworthTentativeInterpolate(T, &P));
  PetscCall(Gather(P.rows, P.cols, X.cols.first, l.nodes(), dense));
  PetscCall(GatherModes(modes, modes.k, T.layout.get(), &coarse));
  PetscCall(CheckEqual("T Nc", dense * coarse, truth, 1e-8));
  PetscCall(CheckNext(l, tied, before, T, ties, truth, count));
  for (Mat *M : {&A, &C}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (PetscInt bs : {1, 2, 3, 6})
    for (auto kind : {Lattice::EVEN, Lattice::HOLE, Lattice::SMALL, Lattice::LAST}) {
      PetscInt count[2] = {0, 0};
      Lattice  l;

      l.bs     = bs;
      l.n      = bs == 2 ? 12 : 4;
      l.layers = 14;
      l.alone  = true;
      l.layout = kind;
      for (bool together : {false, true}) PetscCall(Follow(l, together, together && bs > 1, count));
      PetscCall(CheckTrue("some follow, some do not", count[0] > 0 && count[1] > 0));
    }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
