#include "system.h"
#include <cmath>

/* Gives each rank a copy of all of the matrix */
static PetscErrorCode TakeAll(AinsworthRef<Mat> *M)
{
  IS       rows, cols;
  PetscInt m, n;
  Mat     *all, copy;

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(*M, &m, &n));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, m, 0, 1, &rows));
  PetscCall(ISCreateStride(PETSC_COMM_SELF, n, 0, 1, &cols));
  PetscCall(MatCreateSubMatrices(*M, 1, &rows, &cols, MAT_INITIAL_MATRIX, &all));
  PetscCall(MatDuplicate(all[0], MAT_COPY_VALUES, &copy));
  PetscCall(MatDestroySubMatrices(1, &all));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&cols));
  *M = AinsworthOwn(copy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetBoth(const Column &values, AinsworthSaddleVec v)
{
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(VecGetSize(v.primal, &n));
  PetscCall(Scatter(values.head(n), v.primal));
  PetscCall(Scatter(values.tail(values.size() - n), v.dual));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetupCreate(const Blocks &dense, Setup *setup, bool alone)
{
  Kind                  kind{"given"};
  AinsworthSaddleInputs in;
  AinsworthSaddle       raw;
  Mat                   nest, Bt;

  PetscFunctionBeginUser;
  kind.symmetric  = dense.B == dense.C;
  kind.compliance = dense.D.size() && dense.D.cwiseAbs().maxCoeff() > 0.0 ? COUPLED : NO_D;
  setup->dense    = dense;
  PetscCall(SaddleCreate(dense, kind, &raw));
  if (alone)
    for (AinsworthRef<Mat> *M : {&raw.A, &raw.kept.C, &raw.kept.B, &raw.kept.D})
      if (*M && !(M == &raw.kept.B && kind.symmetric)) PetscCall(TakeAll(M));
  if (alone && kind.symmetric) raw.kept.B = raw.kept.C;
  PetscCall(MatHermitianTranspose(raw.kept.B, MAT_INITIAL_MATRIX, &Bt));
  if (raw.kept.D) PetscCall(MatScale(raw.kept.D, -1.0));
  const Mat blocks[] = {raw.A, Bt, raw.kept.C, raw.kept.D};

  PetscCall(MatCreateNest(PetscObjectComm((PetscObject)raw.A), 2, NULL, 2, NULL, blocks, &nest));
  in.amat = in.pmat = nest;
  in.multipliers    = {"1"};
  PetscCall(AinsworthSaddleBuild(&in, NULL, &setup->sp));
  const AinsworthSaddle *sp = setup->sp.get();

  PetscCall(CheckTrue((std::string("usable: ") + sp->bad).c_str(), !sp->bad[0] && sp->scale.primal && !sp->negated));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&Bt));
  PetscCall(GatherBoth(sp->scale, setup->s));
  for (AinsworthSaddleVec *v : {&setup->b, &setup->y, &setup->left}) {
    PetscCall(AinsworthSaddleVecDuplicate(sp->scale, v));
    PetscCall(VecZeroEntries(v->primal));
    PetscCall(VecZeroEntries(v->dual));
  }
  PetscCall(VecDuplicate(sp->scale.primal, &setup->Ax));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetupDestroy(Setup *setup)
{
  PetscFunctionBeginUser;
  for (AinsworthSaddleVec *v : {&setup->b, &setup->y, &setup->left}) PetscCall(AinsworthSaddleVecDestroy(v));
  PetscCall(VecDestroy(&setup->Ax));
  setup->sp.reset();
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Long Lengthen(const Dense &M)
{
  return M.cast<LongScalar>();
}

Column Times(const Dense &K, const Column &y)
{
  const LongColumn product = Lengthen(K) * LongColumn(Lengthen(y));
  Column           rounded(product.size());

  for (Eigen::Index i = 0; i < product.size(); i++) rounded[i] = (PetscScalar)product[i];
  return rounded;
}

Truth Exact(const Setup &setup, const std::vector<AinsworthRowKind> &kind, bool transpose,
            const AinsworthMeasure measure[], const Column &b, const Column &y)
{
  Blocks         d = setup.dense;
  const PetscInt n = d.n();
  Truth          truth;

  if (transpose) d.A = Dense(d.A.transpose());
  const Long       K   = Lengthen(d.K());
  const LongColumn rhs = Lengthen(b), x = Lengthen(y);
  const LongReal   s = setup.s.real().cast<long double>();

  truth.residual          = rhs - K * x;
  truth.terms             = K.cwiseAbs() * x.cwiseAbs() + rhs.cwiseAbs();
  const LongReal scaled   = truth.terms.cwiseProduct(s);
  long double    sizes[2] = {scaled.head(n).maxCoeff(),
                          scaled.size() > n ? scaled.tail(scaled.size() - n).maxCoeff() : 0.0L};

  if (sizes[1] <= 10 * PETSC_MACHINE_EPSILON * sizes[0]) sizes[1] = sizes[0];
  truth.size    = (PetscReal)sizes[1];
  truth.allowed = LongReal::Zero(rhs.size());
  for (Eigen::Index i = 0; i < rhs.size(); i++) {
    const bool other          = i >= n && (kind[i - n] == AINSWORTH_ROW_ZERO || kind[i - n] == AINSWORTH_ROW_DEPENDENT);
    const bool held           = (i < n ? setup.dense.A.row(i) : setup.dense.D.row(i - n)).cwiseAbs().maxCoeff() > 0.0;
    const AinsworthMeasure &m = measure[held          ? AINSWORTH_ROWS_HELD
                                        : i >= n      ? AINSWORTH_ROWS_RIGID
                                        : b[i] == 0.0 ? AINSWORTH_ROWS_LOOSE
                                                      : AINSWORTH_ROWS_FORCED];
    const long double       size = std::abs(truth.residual[i]);
    truth.allowed[i]             = m.relative * truth.terms[i] + m.floor * sizes[i >= n] / s[i];
    const PetscReal    omega     = size == 0.0L ? 0.0 : (PetscReal)(size / truth.allowed[i]);
    AinsworthWorstRow &worst     = truth.worst[i < n ? 0 : other ? 2 : 1];

    if (omega > worst.omega)
      worst = {omega, (PetscReal)std::abs(truth.residual[i]), (PetscReal)truth.terms[i], (PetscInt)(i < n ? i : i - n)};
  }
  return truth;
}

/* A diagonal, B = C, no D */
Blocks Handmade(const Column &diagonal, const Dense &C)
{
  Blocks b;

  b.A = diagonal.asDiagonal();
  b.B = b.C = C;
  b.D       = Dense::Zero(C.rows(), C.rows());
  return b;
}
