#include "levelmat.h"

/* Gets IDs and states that identify the values of two vectors */
static PetscErrorCode Identify(Vec b, Vec x, std::array<PetscInt64, 4> *pair)
{
  PetscInt64 *next = pair->data();

  PetscFunctionBegin;
  for (Vec v : {b, x}) {
    PetscObjectId    id;
    PetscObjectState state;

    PetscCall(PetscObjectGetId((PetscObject)v, &id));
    PetscCall(PetscObjectStateGet((PetscObject)v, &state));
    *next++ = (PetscInt64)id;
    *next++ = (PetscInt64)state;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls f(unknown, place in vectors of single precision) for all local unknowns */
template <class F>
static inline void ForUnknowns(const AinsworthScaled &L, F f)
{
  const PetscInt n = L.product->n(), bs = L.product->bs(), s = L.product->stride();

  for (PetscInt i = 0; i < n; i++)
    for (PetscInt c = 0; c < bs; c++) f(i * bs + c, i * s + c);
}

/* Computes r -= M p and calls then(i) as soon as node i is done. Collective */
template <class F>
static PetscErrorCode Subtract(AinsworthScaled &L, const std::vector<AinsworthSingle> &p, F then)
{
  const PetscInt stride = L.product->stride();

  PetscFunctionBegin;
  PetscCall(L.product->start(p.data(), L.q.data()));
  L.product->pass(p.data(), L.q.data(), [&](PetscInt i, AinsworthSingle *q) {
    for (PetscInt c = 0; c < stride; c++) L.r[i * stride + c] -= q[c];
    then(i);
  });
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* One step of Chebyshev's iteration at a node: x += p, p = f p + g D^{-1} r; the first step begins with p = 0 */
struct Step {
  AinsworthScaled *L      = NULL;
  PetscInt         stride = 0;
  float            f, g;
  bool             first = false;

  void operator()(PetscInt node) const
  {
    const PetscInt   o = node * stride;
    AinsworthSingle *p = L->p.data() + o, *x = L->x.data() + o;
    for (PetscInt c = 0; c < stride; c++) {
      if (!first) x[c] += p[c];
      p[c] = (first ? AinsworthSingle(0) : f * p[c]) + g * L->inverse[o + c] * L->r[o + c];
    }
  }
};
} // namespace

/*
   Projects the step p onto the subspace, where its part g D^{-1} r leaves it; r becomes Q' r, the same force there,
   unless they are equal in Q D^{-1}. Collective
*/
static PetscErrorCode Project(AinsworthScaled &L, float g, const AinsworthLevelSubspace *subspace)
{
  const PetscInt bs = L.product->bs(), stride = L.product->stride();

  PetscFunctionBegin;
  if (!subspace) PetscFunctionReturn(PETSC_SUCCESS);
  auto p = [&](PetscInt l) -> AinsworthSingle & { return L.p[l / bs * stride + l % bs]; };
  if (subspace->space->excess > 0.0)
    PetscCall(subspace->project(
      true, [&](PetscInt l) { return (PetscScalar)L.r[l / bs * stride + l % bs] / (*L.w)[l]; },
      [&](PetscInt l, PetscScalar v) {
        const PetscInt        k   = l / bs * stride + l % bs;
        const AinsworthSingle now = (AinsworthSingle)(v * (*L.w)[l]);

        L.p[k] += g * L.inverse[k] * (now - L.r[k]);
        L.r[k] = now;
      }));
  PetscCall(subspace->project(
    false, [&](PetscInt l) { return (PetscScalar)p(l) * (*L.w)[l]; },
    [&](PetscInt l, PetscScalar v) { p(l) = (AinsworthSingle)(v / (*L.w)[l]); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = M x. Collective */
PetscErrorCode AinsworthScaled::mult(Vec from, Vec to)
{
  const std::vector<PetscReal> &W    = *w;
  PetscReal                     most = 0.0;
  const PetscScalar            *in;
  PetscScalar                  *out;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(from, &in));
  ForUnknowns(*this, [&](PetscInt l, PetscInt) { most = PetscMax(most, PetscAbsScalar(in[l]) / W[l]); });
  if (product->cols.sf)
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)from)));
  const PetscReal scale = AinsworthInversePower(most, 1);
  ForUnknowns(*this, [&](PetscInt l, PetscInt k) { q[k] = (AinsworthSingle)(in[l] * (scale / W[l])); });
  PetscCall(VecRestoreArrayRead(from, &in));
  pair = {}; /* r is overwritten below */
  PetscCall(product->mult(q.data(), r.data()));
  PetscCall(VecGetArrayWrite(to, &out));
  ForUnknowns(*this, [&](PetscInt l, PetscInt k) { out[l] = (PetscScalar)r[k] / (scale * W[l]); });
  PetscCall(VecRestoreArrayWrite(to, &out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthScaled::smooth - does steps of Chebyshev's iteration with Jacobi for M x = b, from x or from zero.
   Collective

   least, most: the damped part of the spectrum of D^{-1} M; subspace: NULL, or x is in it and stays there, with Q
   D^{-1} in place of D^{-1}
*/
PetscErrorCode AinsworthScaled::smooth(PetscInt steps, PetscReal least, PetscReal most, PetscBool zero,
                                       const AinsworthLevelSubspace *subspace, Vec b, Vec to)
{
  const std::vector<PetscReal> &W     = *w;
  const PetscReal               theta = (most + least) / 2, delta = (most - least) / 2, sigma = theta / delta;
  PetscReal                     norm, rho = 1.0 / sigma;
  const PetscScalar            *in;
  PetscScalar                  *out;
  Step                          step = {this, product->stride(), 0.0f, (float)(1.0 / theta), true};

  PetscFunctionBegin;
  PetscCall(VecNorm(b, NORM_2, &norm));
  const PetscReal scale = AinsworthInversePower(norm * largest, 1);
  PetscCall(VecGetArrayRead(b, &in));
  ForUnknowns(*this, [&](PetscInt l, PetscInt k) { r[k] = (AinsworthSingle)(in[l] * (scale * W[l])); });
  PetscCall(VecRestoreArrayRead(b, &in));
  PetscCall(VecGetArray(to, &out));
  if (zero) {
    std::fill(x.begin(), x.end(), AinsworthSingle(0));
    for (PetscInt i = 0; i < product->n(); i++) step(i);
  } else {
    ForUnknowns(*this, [&](PetscInt l, PetscInt k) { x[k] = (AinsworthSingle)(out[l] * (scale / W[l])); });
    PetscCall(Subtract(*this, x, step));
  }
  PetscCall(Project(*this, step.g, subspace));
  step.first = false;
  for (PetscInt k = 1; k < steps; k++) {
    const PetscReal before = rho;

    rho    = 1.0 / (2.0 * sigma - before);
    step.f = (float)(rho * before);
    step.g = (float)(2.0 * rho / delta);
    PetscCall(Subtract(*this, p, step));
    PetscCall(Project(*this, step.g, subspace));
  }
  ForUnknowns(*this, [&](PetscInt l, PetscInt k) { out[l] = (PetscScalar)(x[k] + p[k]) * (W[l] / scale); });
  PetscCall(VecRestoreArray(to, &out));
  s = scale;
  PetscCall(Identify(b, to, &pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes r = b - M x; half of the work is already done directly after smoothing. Collective */
PetscErrorCode AinsworthScaled::residual(Vec b, Vec from, Vec to)
{
  const std::vector<PetscReal> &W = *w;
  std::array<PetscInt64, 4>     now;
  PetscScalar                  *out;

  PetscFunctionBegin;
  PetscCall(Identify(b, from, &now));
  if (now != pair) {
    PetscCall(mult(from, to));
    PetscCall(VecAYPX(to, -1.0, b));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(Subtract(*this, p, [](PetscInt) {}));
  pair = {}; /* r is now the whole residual */
  PetscCall(VecGetArrayWrite(to, &out));
  ForUnknowns(*this, [&](PetscInt l, PetscInt k) { out[l] = (PetscScalar)r[k] / (s * W[l]); });
  PetscCall(VecRestoreArrayWrite(to, &out));
  PetscFunctionReturn(PETSC_SUCCESS);
}
