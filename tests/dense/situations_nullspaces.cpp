/* Null spaces, near null spaces and block sizes reach both inner matrices; singular systems are solved */
#include "situations.h"

static const std::string jacobi = "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 ";

static PetscErrorCode VecOfFields(const Live &s, const Column &x, const Column &lambda, Vec *v)
{
  const int primal = s.storage & FIRST ? 1 : 0;
  IS        is[2];
  Vec       part;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(s.nest, v, NULL));
  PetscCall(MatNestGetISs(s.nest, is, NULL));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(*v, is[k], &part));
    PetscCall(Scatter(k == primal ? x : lambda, part));
    PetscCall(VecRestoreSubVector(*v, is[k], &part));
  }
  PetscCall(VecNormalize(*v, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Null spaces are attached to a matrix, or composed with an index set under this name; vectors are destroyed */
static PetscErrorCode Attach(PetscObject to, const char *name, bool constant, std::vector<Vec> v)
{
  MatNullSpace space;

  PetscFunctionBeginUser;
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, (PetscBool)constant, (PetscInt)v.size(), v.data(), &space));
  if (name) PetscCall(PetscObjectCompose(to, name, (PetscObject)space));
  else PetscCall(MatSetNullSpace((Mat)to, space));
  PetscCall(MatNullSpaceDestroy(&space));
  for (Vec &vec : v) PetscCall(VecDestroy(&vec));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What both inner matrices, S and M_*, have */
static Action OfBoth(const std::function<PetscErrorCode(Mat)> &judge)
{
  return [=](Live &s) -> PetscErrorCode {
    Mat mats[2];

    PetscFunctionBeginUser;
    PetscCall(KSPSetUp(s.ksp));
    PetscCall(Inner([&](KSP inner, PC) { return KSPGetOperators(inner, &mats[0], &mats[1]); })(s));
    for (Mat mat : mats) PetscCall(judge(mat));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* A null space that is spanned by these orthonormal columns */
static Action Kernel(const Dense &kernel, PetscReal tolerance)
{
  return OfBoth([=](Mat mat) -> PetscErrorCode {
    PetscBool    constant = PETSC_FALSE;
    PetscInt     vectors  = 0;
    const Vec   *vecs;
    MatNullSpace space;
    Dense        projector = Dense::Zero(kernel.rows(), kernel.rows());
    Column       v;

    PetscFunctionBeginUser;
    PetscCall(MatGetNullSpace(mat, &space));
    if (space) PetscCall(MatNullSpaceGetVecs(space, &constant, &vectors, &vecs));
    PetscCall(CheckInt("dimension of the null space", vectors + (constant ? 1 : 0), kernel.cols()));
    PetscCall(CheckTrue("what C holds is no null space", kernel.cols() || !space));
    for (PetscInt k = 0; k < vectors; k++) {
      PetscCall(Gather(vecs[k], v));
      projector += v * v.adjoint();
    }
    if (vectors)
      PetscCall(CheckEqual("projector onto the null space", projector, kernel * kernel.adjoint(), tolerance));
    PetscFunctionReturn(PETSC_SUCCESS);
  });
}

static Dense Constant(PetscInt n)
{
  return Dense(Column::Ones(n).normalized());
}

/* A right-hand side that has a solution, which is not unique */
static PetscErrorCode Consistent(Live &s)
{
  const Column x = RandomColumn(s.d.f.size(), 81);

  PetscFunctionBeginUser;
  s.d.g = s.d.C * x;
  s.d.f = s.d.A * x + s.d.Upper() * RandomColumn(s.d.g.size(), 80);
  PetscCall(Positive()(s));
  PetscCall(CheckEqual("A x + C' lambda", s.d.A * s.x + s.d.Upper() * s.lambda, s.d.f, 1e-10));
  PetscCall(CheckEqual("C x", s.d.C * s.x, s.d.g, 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A chain of springs without support, cut into two or not; rows of C tie pairs of places, -1 is the ground */
static DenseSystem Floating(PetscInt n, bool cut, const std::vector<PetscInt> &pairs)
{
  DenseSystem d = Chain(n, (PetscInt)pairs.size() / 2, 0.0);

  d.A.setZero();
  d.C.setZero();
  for (PetscInt i = 0; i < n - 1; i++) {
    const PetscReal k = cut && i == n / 2 - 1 ? 0.0 : 1.0 + (PetscReal)i;

    d.A(i, i) += k;
    d.A(i + 1, i + 1) += k;
    d.A(i, i + 1) = d.A(i + 1, i) = -k;
  }
  for (PetscInt i = 0; i < d.C.rows(); i++) {
    d.C(i, pairs[2 * i]) = 1.0;
    if (pairs[2 * i + 1] >= 0) d.C(i, pairs[2 * i + 1]) = -1.0;
  }
  return d;
}

/* 0 as a constant of A, 1 as a vector of A, 2 on the index set of the field, as for PCFIELDSPLIT */
static Action Declared(int way)
{
  return [=](Live &s) -> PetscErrorCode {
    IS  is[2];
    Vec one;

    PetscFunctionBeginUser;
    PetscCall(MatNestGetISs(s.nest, is, NULL));
    PetscCall(MatCreateVecs(s.sys.A, &one, NULL));
    PetscCall(Scatter(Constant(s.d.f.size()), one));
    if (way)
      PetscCall(
        Attach(way == 1 ? (PetscObject)s.sys.A : (PetscObject)is[0], way == 1 ? NULL : "nullspace", false, {one}));
    else {
      PetscCall(VecDestroy(&one));
      PetscCall(Attach((PetscObject)s.sys.A, NULL, true, {}));
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* On Amat, a nest whose multipliers come first in its numbering, where Pmat is another matrix */
static PetscErrorCode MultipliersFirst(Live &s)
{
  Mat      blocks[] = {s.sys.A, s.Ct, s.sys.C, NULL}, P;
  Vec      part[2], v;
  IS       is[2];
  PetscInt n, m, start;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(s.sys.C, &m, &n));
  start = n + m;
  PetscCallMPI(MPI_Scan(MPI_IN_PLACE, &start, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, n, start - n, 1, &is[0]));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, m, start - n - m, 1, &is[1]));
  PetscCall(MatDestroy(&s.nest));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, is, 2, is, blocks, &s.nest));
  PetscCall(MatCreateVecs(s.sys.C, &part[0], &part[1]));
  PetscCall(Scatter(Constant(s.d.f.size()), part[0]));
  PetscCall(VecSet(part[1], 0.0));
  PetscCall(VecCreateNest(PETSC_COMM_WORLD, 2, is, part, &v));
  PetscCall(Attach((PetscObject)s.nest, NULL, false, {v}));
  PetscCall(MatConvert(s.nest, MATAIJ, MAT_INITIAL_MATRIX, &P));
  PetscCall(KSPSetOperators(s.ksp, s.nest, P));
  PetscCall(MatDestroy(&P));
  for (Vec &vec : part) PetscCall(VecDestroy(&vec));
  for (IS &set : is) PetscCall(ISDestroy(&set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ker A has two dimensions, told by vectors neither of which is that of one chain */
static PetscErrorCode TwoVectors(Live &s)
{
  std::vector<Vec> v(2);

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    PetscCall(MatCreateVecs(s.sys.A, &v[k], NULL));
    PetscCall(Scatter(
      Column::NullaryExpr(12, [k](Eigen::Index i) { return k == i / 6 ? 0.8 : (k ? 0.6 : -0.6); }).normalized(), v[k]));
  }
  PetscCall(Attach((PetscObject)s.sys.A, NULL, false, v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the whole matrix: told of both matrices, of Amat alone, with a second vector that is none of K, nor of A */
static Action Whole(int declared)
{
  return [=](Live &s) -> PetscErrorCode {
    const Column     none = Column::Zero(s.d.g.size());
    std::vector<Vec> v(declared == 2 ? 2 : 1);
    Mat              other;

    PetscFunctionBeginUser;
    PetscCall(VecOfFields(s, Column::Ones(9), none, &v[0]));
    if (declared == 2) PetscCall(VecOfFields(s, s.d.f - Column::Constant(9, s.d.f.mean()), none, &v[1]));
    PetscCall(NestCreate(s.sys.A, s.Ct, s.sys.C, NULL, s.storage & FIRST, &other));
    PetscCall(Attach((PetscObject)s.nest, NULL, false, v));
    if (declared == 1) PetscCall(KSPSetOperators(s.ksp, s.nest, other));
    PetscCall(MatDestroy(&other));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* Two equal rows: their multipliers have a null vector, in which the program left a rounding error of x */
static PetscErrorCode Mixed(Live &s)
{
  Vec v;

  PetscFunctionBeginUser;
  PetscCall(VecOfFields(s, 1e-17 * RandomColumn(12, 5), Column::LinSpaced(2, 1.0, -1.0), &v));
  PetscCall(Attach((PetscObject)s.nest, NULL, false, {v}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A near null space, on the matrix or the index set, is the same object inside */
static Action Near(bool onMatrix)
{
  return [=](Live &s) -> PetscErrorCode {
    IS           is[2];
    Vec          v;
    MatNullSpace near;

    PetscFunctionBeginUser;
    PetscCall(MatNestGetISs(s.nest, is, NULL));
    PetscCall(VecDuplicate(s.sys.f, &v));
    PetscCall(SetRandom(v, 81));
    PetscCall(VecNormalize(v, NULL));
    PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 1, &v, &near));
    if (onMatrix) PetscCall(MatSetNearNullSpace(s.sys.A, near));
    else PetscCall(PetscObjectCompose((PetscObject)is[1], "nearnullspace", (PetscObject)near));
    PetscCall(OfBoth([=](Mat mat) -> PetscErrorCode {
      MatNullSpace got;
      PetscInt     bs;

      PetscFunctionBeginUser;
      PetscCall(MatGetNearNullSpace(mat, &got));
      PetscCall(CheckTrue("the near null space that was given", got == near));
      PetscCall(MatGetBlockSize(mat, &bs));
      PetscCall(CheckInt("block size", bs, 3));
      PetscFunctionReturn(PETSC_SUCCESS);
    })(s));
    PetscCall(Kernel(Dense::Zero(24, 0), 0.0)(s));
    PetscCall(MatNullSpaceDestroy(&near));
    PetscCall(VecDestroy(&v));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* lambda, or x, of least norm */
static Action Least(bool lambda, PetscReal tolerance)
{
  return [=](Live &s) -> PetscErrorCode {
    const Eigen::Index n = s.d.f.size(), m = s.d.g.size();
    Dense              K(n + m, n + m);
    Column             b(n + m), y;

    PetscFunctionBeginUser;
    K << s.d.A, s.d.C.adjoint(), s.d.C, Dense::Zero(m, m);
    b << s.d.f, s.d.g;
    y = K.completeOrthogonalDecomposition().solve(b);
    if (lambda) PetscCall(CheckEqual("lambda", s.lambda, y.tail(m), tolerance));
    else PetscCall(CheckEqual("x", s.x, y.head(n), tolerance));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/*
   The sum of all rows of C is zero. With the constant attached to the field of the multipliers they have none of it, as
   those of least norm; a vector that is no null vector of C' is not taken out. Then g is rounding, as at the end of
   Newton's method, whose sum is not zero: it counts relative to f
*/
static PetscErrorCode Multipliers(bool constant, int crossed)
{
  const Action declared = [=](Live &s) -> PetscErrorCode {
    IS  is[2];
    Vec v;

    PetscFunctionBeginUser;
    PetscCall(MatNestGetISs(s.nest, is, NULL));
    PetscCall(VecDuplicate(s.sys.g, &v));
    PetscCall(Scatter(constant ? Column(Constant(6)) : Column(Column::Unit(6, 2)), v));
    PetscCall(Attach((PetscObject)is[1], "nullspace", false, {v}));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  const auto small = [](PetscReal sum) {
    return Edit([=](Saddle &s) { s.f *= sum < 1e-6 ? 1e-6 : 1.0, s.g.setZero(), s.g[1] = sum; });
  };
  DenseSystem d = SpringsCreate(24, 5, 2e6, 17);

  PetscFunctionBeginUser;
  d.C.conservativeResize(6, Eigen::NoChange);
  d.g.conservativeResize(6);
  d.C.row(5)                  = -d.C.topRows(5).colwise().sum();
  d.g[5]                      = -d.g.head(5).sum();
  std::vector<Action> actions = {declared, Solved()};
  if (constant)
    for (const Action &action :
         {Least(true, 1e-9), small(1e-13), Either(Edit([](Saddle &s) { s.g.setZero(); }), nullptr), Least(false, 1e-6),
          small(1e-3), Failed()})
      actions.push_back(action);
  PetscCall(Row(Text("null space of the multipliers, constant %d, crossed %d", constant, crossed), d, jacobi, actions,
                crossed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode NullSpaces()
{
  PetscFunctionBeginUser;
  for (bool grounded : {false, true}) {
    const DenseSystem d      = Floating(12, false, {0, grounded ? -1 : 5, 2, 7, 4, 9});
    const Action      kernel = Kernel(grounded ? Dense::Zero(12, 0) : Constant(12), 1e-14);

    for (int way = 0; way < 3; way++)
      PetscCall(Row(Text("chain, grounded %d, declared %d", grounded, way), d, jacobi,
                    {Declared(way), kernel, Consistent}, EXPLICIT));
    PetscCall(
      Row(Text("chain, grounded %d, declared on Amat", grounded), d, jacobi, {MultipliersFirst, kernel}, EXPLICIT));
  }
  for (int ties = 0; ties < 3; ties++) { /* two chains, of whose kernel the ties between them leave some */
    std::vector<PetscInt> pairs = {0, 2, 7, 9, 1, 8, 3, -1};
    Dense                 stacked(14 + ties, 12);

    pairs.resize(4 + 2 * ties);
    const DenseSystem d = Floating(12, true, pairs);
    stacked << d.A, d.C;
    std::vector<Action> actions = {
      TwoVectors, Kernel(Eigen::JacobiSVD<Dense>(stacked, Eigen::ComputeFullV).matrixV().rightCols(2 - ties), 1e-12)};
    if (ties) actions.push_back(Consistent);
    PetscCall(Row(Text("two chains, %d ties", ties), d, jacobi, actions));
  }
  for (bool onMatrix : {false, true}) {
    Spec spec;

    spec.bs = 3;
    PetscCall(Row(Text("near null space on the matrix %d", onMatrix), spec, jacobi, {Near(onMatrix)}, FIRST));
  }
  for (int crossed : {0, (int)CROSSED}) {
    for (bool constant : {false, true}) PetscCall(Multipliers(constant, crossed));
    for (int declared = 0; declared < 3; declared++)
      for (int first : {0, (int)FIRST}) {
        std::vector<Action> actions = {Whole(declared), Kernel(Constant(9), 1e-13)};

        if (declared < 2) actions.push_back(Consistent);
        PetscCall(Row(Text("null space of the whole, declared %d, first %d, crossed %d", declared, first, crossed),
                      Floating(9, false, {0, 5, 1, 6, 2, 7}), "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13",
                      actions, crossed | first | VIEW));
      }
  }
  for (PetscReal stiffness : {1.0, 1e60}) { /* where lambda is 1e60 times x a KSP makes noise of x */
    DenseSystem d = SpringsCreate(12, 2, stiffness, 4);

    d.C.row(1) = d.C.row(0);
    d.g[1]     = d.g[0];
    PetscCall(Row(Text("a null space with rounding errors, stiffness %g", (double)stiffness), d,
                  jacobi + "-pc_ainsworth_ladder gmres", {Solved(), Mixed, stiffness > 1.0 ? Failed() : Solved()}));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
