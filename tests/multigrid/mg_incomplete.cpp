static char help[] = "The incomplete factor of a level, and the condition number that calls for it, against dense "
                     "algebra.\n\n";

#include "internal.h"
#include <algorithm>

/* Nodes of this rank alone */
static Dense Own(const Dense &A, const AinsworthColumns &cols, PetscInt bs)
{
  return A.block(cols.first * bs, cols.first * bs, cols.local * bs, cols.local * bs);
}

/* The inverse of what the factor solves with, column by column; beyond: what is left beyond the nodes of a vector */
static Dense Inverse(const AinsworthIncomplete &factor, PetscInt n, PetscInt bs, PetscInt width, double *beyond)
{
  const PetscInt s = AinsworthStride<AinsworthSingle>(bs, width);
  Dense          inverse(n * bs, n * bs);

  *beyond = 0.0;
  for (PetscInt first = 0; first < n * bs; first += width) {
    const PetscInt               count = std::min(width, n * bs - first);
    std::vector<AinsworthSingle> x(n * s, AinsworthSingle(0));

    for (PetscInt k = 0; k < count; k++) x[(first + k) / bs * s + (first + k) % bs * width + k] = 1.0f;
    factor.forward(width, x.data());
    factor.backward(width, x.data());
    for (PetscInt i = 0; i < n; i++) {
      for (PetscInt c = 0; c < bs; c++)
        for (PetscInt k = 0; k < count; k++) inverse(i * bs + c, first + k) = (PetscScalar)x[i * s + c * width + k];
      for (PetscInt q = bs * width; q < s; q++) *beyond += std::abs(x[i * s + q]);
    }
  }
  return inverse;
}

/* How far a matrix is from another one in the blocks that are stored, but for those of nodes that come last */
static PetscReal Distance(const Dense &got, const Dense &expected, const AinsworthBlockRowsOf<AinsworthSingle> &pattern,
                          const std::vector<char> &last)
{
  const PetscInt bs   = pattern.br;
  PetscReal      most = 0.0;

  for (PetscInt i = 0; i < pattern.n; i++)
    for (PetscInt k = pattern.i[i]; k < pattern.i[i + 1]; k++)
      if (last.empty() || !last[i] || !last[pattern.j[k]])
        most = std::max(most, (got - expected).block(i * bs, pattern.j[k] * bs, bs, bs).cwiseAbs().maxCoeff());
  return most;
}

/* A factor has the entries of the matrix where that has any (Meijerink, van der Vorst), for vectors of all widths */
static PetscErrorCode CheckFactor(const char *what, const AinsworthBlockRows *added, const std::vector<PetscReal> &w,
                                  const std::shared_ptr<const AinsworthBlockRowsOf<AinsworthSingle>> &upper,
                                  const Dense &own, const std::vector<char> &last)
{
  const auto factor = AinsworthIncomplete::create(upper, added, w.data(), last);
  double     beyond;

  PetscFunctionBeginUser;
  PetscCheck(factor, PETSC_COMM_SELF, PETSC_ERR_PLIB, "There is no %s", what);
  for (PetscInt width : {1, AinsworthNarrow, AinsworthWidest}) {
    const Dense inverse = Inverse(*factor, upper->n, upper->br, width, &beyond);
    const Dense whole   = upper->n ? Dense(inverse.inverse()) : inverse;

    PetscCall(CheckTrue("zeros beyond the nodes", beyond == 0.0));
    PetscCall(CheckEqual("the factor is Hermitian", inverse, inverse.adjoint(), 1e-5));
    PetscCall(Check("entries of the factor", Distance(whole, own, *upper, last), 2e-5));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Factors(const Lattice &l)
{
  Mat                    A, D;
  Vec                    shift;
  Dense                  dense, plus;
  AinsworthBlockMat      X, Y;
  std::vector<PetscReal> w;
  const char            *layout;

  PetscFunctionBeginUser;
  PetscCall(LayoutName(l, &layout));
  Case("blocks of %d, %s", (int)l.bs, layout);
  PetscCall(LatticeCreate(l, &A));
  PetscCall(MatCreateVecs(A, &shift, NULL));
  PetscCall(MatGetDiagonal(A, shift));
  PetscCall(VecScale(shift, 1.5));
  PetscCall(VecShift(shift, 0.1)); /* a line of bars has no stiffness across */
  PetscCall(MatDiagonalSet(A, shift, INSERT_VALUES));
  PetscCall(LatticeScale(A));
  PetscCall(Gather(A, dense));
  PetscCall(AinsworthBlockMatOpen(A, l.bs, {}, NULL, &X));
  const AinsworthBlockSurvey survey(X);
  for (PetscReal d : survey.diagonal) w.push_back(AinsworthInversePower(d, 2));
  AinsworthUpperHalf<AinsworthSingle> half(X.rows, w.data());
  AinsworthBlockMat                   outside;
  AinsworthTakeBlocks(X, &half, &outside);
  const Column scale = Eigen::Map<const Eigen::Matrix<PetscReal, Eigen::Dynamic, 1>>(w.data(), (Eigen::Index)w.size())
                         .cast<PetscScalar>();
  const auto scaled = [&](const Dense &M) -> Dense {
    return scale.asDiagonal() * Own(M, X.cols, l.bs) * scale.asDiagonal();
  };
  PetscCall(CheckFactor("factor", NULL, w, half.rows, scaled(dense), {}));
  std::vector<char> last;
  for (PetscInt i = 0; i < X.rows.n; i++) last.push_back(i % 3 == 1);
  PetscCall(CheckFactor("factor where some nodes come last", NULL, w, half.rows, scaled(dense), last));
  PetscCall(SurfaceCreate(l, A, 2.0, 5, &D));
  PetscCall(Gather(D, plus));
  PetscCall(AinsworthBlockMatOpen(D, l.bs, {}, NULL, &Y));
  Y.store();
  PetscCall(CheckFactor("factor with what is added", &Y.rows, w, half.rows, scaled(dense + plus), {}));
  auto indefinite = std::make_shared<AinsworthBlockRowsOf<AinsworthSingle>>(*half.rows);
  for (PetscInt c = 0; indefinite->n && c < l.bs * l.bs; c += l.bs + 1)
    indefinite->block(indefinite->i[indefinite->n - 1])[c] *= -1.0f;
  PetscCall(CheckTrue("no factor of an indefinite matrix",
                      !indefinite->n || !AinsworthIncomplete::create(indefinite, NULL, NULL, {})));
  PetscCall(VecDestroy(&shift));
  PetscCall(MatDestroy(&D));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The condition number in the complement of the aggregates' modes, from below */
static PetscErrorCode Condition(const Lattice &l)
{
  Mat                    A;
  Dense                  dense, T;
  AinsworthBlockMat      X;
  AinsworthModes         modes;
  AinsworthAggregates    agg;
  AinsworthTentative     tentative;
  AinsworthInterpolation interpolation;
  AinsworthTies          ties;
  AinsworthGrid          grid;
  PetscReal              found;

  PetscFunctionBeginUser;
  Case("condition number, blocks of %d, contrast %g", (int)l.bs, (double)l.contrast);
  PetscCall(LatticeCreate(l, &A));
  PetscCall(Gather(A, dense));
  PetscCall(AinsworthBlockMatOpen(A, l.bs, {}, NULL, &X));
  AinsworthBlockSurvey survey(X);
  PetscCall(AinsworthGridCreateFinest(X, survey, true, false, {}, &grid));
  PetscCall(Modes(l, A, &modes, NULL));
  PetscCall(AinsworthAggregate(X.rows, std::move(survey.square), 0.03, modes, &agg));
  PetscCall(TentativeCreate(&agg, l.bs, false, &modes, &ties, &tentative));
  PetscCall(AinsworthTentativeInterpolate(tentative, &interpolation));
  PetscCall(Gather(interpolation.rows, interpolation.cols, X.cols.first, l.nodes(), T));
  PetscCall(AinsworthFindCompatibleCondition(grid, tentative, &found));
  const Column root = dense.diagonal().cwiseSqrt(), inverse = root.cwiseInverse();
  /* T has zero rows for nodes of the first layer, which is held: they belong to no aggregate */
  std::vector<Eigen::Index> at;
  for (Eigen::Index u = 0; u < T.rows(); u++)
    if (T.middleRows(u / l.bs * l.bs, l.bs).norm() > 0.0) at.push_back(u);
  Dense N((Eigen::Index)at.size(), T.cols()), S((Eigen::Index)at.size(), (Eigen::Index)at.size());
  for (size_t i = 0; i < at.size(); i++) {
    N.row((Eigen::Index)i) = root(at[i]) * T.row(at[i]);
    for (size_t j = 0; j < at.size(); j++)
      S((Eigen::Index)i, (Eigen::Index)j) = inverse(at[i]) * dense(at[i], at[j]) * inverse(at[j]);
  }
  const Eigen::ColPivHouseholderQR<Dense> qr(N);
  const Dense                             Q = Dense(qr.householderQ()).rightCols((Eigen::Index)at.size() - qr.rank());
  const auto values = Eigen::SelfAdjointEigenSolver<Dense>(Q.adjoint() * S * Q, Eigen::EigenvaluesOnly).eigenvalues();
  const PetscReal condition = values.maxCoeff() / values.minCoeff();
  PetscCall(Check("the estimate is not above the condition number", found / condition, 1.001));
  PetscCall(Check("the estimate is not far below it", condition / found, 4.0));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  for (PetscInt bs : {1, 2, 3, 4, 6})
    for (auto layout : {Lattice::EVEN, Lattice::HOLE, Lattice::SMALL}) {
      Lattice l;

      l.bs     = bs;
      l.n      = bs == 2 ? 5 : 3;
      l.layers = 4;
      l.layout = layout;
      PetscCall(Factors(l));
    }
  for (PetscInt bs : {1, 3, 4})
    for (PetscReal contrast : {1.0, 1e4}) {
      Lattice l;

      l.bs       = bs;
      l.contrast = contrast;
      PetscCall(Condition(l));
    }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
