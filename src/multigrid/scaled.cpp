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

/*
   Calls f(unknown, place in multivectors, place in those of single precision) for all local unknowns and vectors
*/
template <int W, class F>
static inline void ForUnknowns(const AinsworthScaled &L, F f)
{
  AinsworthDispatch(L.product->bs(), [&](auto B) {
    const PetscInt n = L.product->n(), bs = B() ? B() : L.product->bs(), s = AinsworthStride<AinsworthSingle>(bs, W);

    for (PetscInt i = 0; i < n; i++)
      for (PetscInt c = 0; c < bs; c++)
        for (PetscInt k = 0; k < W; k++) f(i * bs + c, (i * bs + c) * W + k, i * s + c * W + k);
  });
}

/* AinsworthScaled::createWork - creates the work vectors for the width of the product */
void AinsworthScaled::createWork()
{
  for (auto *v : {&x, &r, &p}) v->assign((size_t)product->n() * product->stride(), AinsworthSingle(0));
  if (factor) z = x;
}

/* Computes r += M p and calls then(AinsworthSize<bs>, i) as soon as node i is done. Collective */
template <int W, class F>
static PetscErrorCode Add(AinsworthScaled &L, const std::vector<AinsworthSingle> &p, F then)
{
  PetscFunctionBegin;
  PetscCall(L.product->start(p.data(), L.r.data()));
  L.product->pass<W>(p.data(), L.r.data(), [&](auto B, PetscInt i, AinsworthSingle *) { then(B, i); });
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/*
   One step of Chebyshev's iteration at a node: x += p, p = f p - g D^{-1} r or, with a factor, p = f p - g z; the first
   step begins with p = 0, and the next one with x = 0 if the iteration does
*/
template <int W>
struct Step {
  AinsworthScaled *L = NULL;
  float            f, g;
  bool             first = false, zero = false;

  template <class Size>
  void operator()(Size B, PetscInt node) const
  {
    const PetscInt         bs = B() ? B() : L->product->bs(), n = AinsworthStride<AinsworthSingle>(bs, W);
    const AinsworthSingle *d = L->inverse.data() + node * AinsworthStride<AinsworthSingle>(bs),
                          *r = L->r.data() + node * n, *z = L->factor ? L->z.data() + node * n : NULL;
    AinsworthSingle *p = L->p.data() + node * n, *x = L->x.data() + node * n;

    for (PetscInt k = 0; k < n; k++) {
      if (!first) x[k] = zero ? p[k] : x[k] + p[k];
      p[k] = (first ? AinsworthSingle(0) : f * p[k]) - g * (z ? z[k] : d[k / W] * r[k]);
    }
  }
};
} // namespace

/*
   Replaces forces r by Q' r, the same in the subspace, and calls then(place, old value) where they change. Collective
*/
template <class F>
static PetscErrorCode ProjectForce(const AinsworthScaled &L, const AinsworthLevelSubspace &subspace,
                                   std::vector<AinsworthSingle> *r, F then)
{
  const PetscInt bs = L.product->bs(), stride = L.product->stride(), width = L.product->width;
  auto           at = [=](PetscInt l, PetscInt j) { return l / bs * stride + l % bs * width + j; };

  PetscFunctionBegin;
  PetscCall(subspace.project(
    true, width, [&](PetscInt l, PetscInt j) { return (PetscScalar)(*r)[at(l, j)] / (*L.w)[l]; },
    [&](PetscInt l, PetscInt j, PetscScalar v) {
      const AinsworthSingle before = (*r)[at(l, j)];

      (*r)[at(l, j)] = (AinsworthSingle)(v * (*L.w)[l]);
      then(l, at(l, j), before);
    }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Projects a step p onto the subspace. Collective */
static PetscErrorCode ProjectStep(const AinsworthScaled &L, const AinsworthLevelSubspace &subspace,
                                  std::vector<AinsworthSingle> *p)
{
  const PetscInt bs = L.product->bs(), stride = L.product->stride(), width = L.product->width;
  auto           at = [=](PetscInt l, PetscInt j) { return l / bs * stride + l % bs * width + j; };

  PetscFunctionBegin;
  PetscCall(subspace.project(
    false, width, [&](PetscInt l, PetscInt j) { return (PetscScalar)(*p)[at(l, j)] * (*L.w)[l]; },
    [&](PetscInt l, PetscInt j, PetscScalar v) { (*p)[at(l, j)] = (AinsworthSingle)(v / (*L.w)[l]); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthScaled::solve - replaces z by what the factor makes of it. Collective

   subspace: NULL, or that of Q, whose nodes come last. With L the factor that ends there, L^{-H} diag(D^{-1}, Q W Q')
   L^{-1} is what Q W Q' is for Jacobi: L leaves the constrained unknowns as they are, so that Q is orthogonal for the
   block-diagonal matrix, too
*/
PetscErrorCode AinsworthScaled::solve(const AinsworthLevelSubspace *subspace)
{
  const PetscInt bs = product->bs(), width = product->width, stride = product->stride(),
                 inverses = AinsworthStride<AinsworthSingle>(bs);

  PetscFunctionBegin;
  factor->forward(width, z.data());
  if (subspace) {
    if (subspace->space->excess > 0.0)
      PetscCall(ProjectForce(*this, *subspace, &z, [](PetscInt, PetscInt, AinsworthSingle) {}));
    for (PetscInt i = 0; i < product->n(); i++)
      for (PetscInt k = 0; factor->comesLast(i) && k < bs * width; k++)
        z[i * stride + k] *= inverse[i * inverses + k / width];
    PetscCall(ProjectStep(*this, *subspace, &z));
  }
  factor->backward(width, z.data());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthScaled::precondition - applies the factor to a vector of width 1, as solve(). Collective */
PetscErrorCode AinsworthScaled::precondition(const AinsworthLevelSubspace *subspace, PetscScalar *v)
{
  const PetscInt bs = product->bs(), stride = product->stride();

  PetscFunctionBegin;
  for (size_t u = 0; u < w->size(); u++) z[u / bs * stride + u % bs] = (AinsworthSingle)(v[u] * (*w)[u]);
  PetscCall(solve(subspace));
  for (size_t u = 0; u < w->size(); u++) v[u] = (PetscScalar)z[u / bs * stride + u % bs] * (*w)[u];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Adds M v to r unless v is NULL, and makes a step, which stays in the subspace. Collective

   With Jacobi the step is made while the product is; its part -g D^{-1} r leaves the subspace, where Q' r replaces r
   unless they are equal in Q D^{-1}
*/
template <int W>
static PetscErrorCode Advance(AinsworthScaled &L, const std::vector<AinsworthSingle> *v, const Step<W> &step,
                              const AinsworthLevelSubspace *subspace)
{
  const PetscInt bs = L.product->bs(), inverses = AinsworthStride<AinsworthSingle>(bs);
  auto           everywhere = [&]() {
    AinsworthDispatch(bs, [&](auto B) {
      for (PetscInt i = 0; i < L.product->n(); i++) step(B, i);
    });
  };

  PetscFunctionBegin;
  if (L.factor) {
    if (v) PetscCall(Add<W>(L, *v, [](auto, PetscInt) {}));
    L.z = L.r;
    PetscCall(L.solve(subspace));
    everywhere();
  } else {
    if (v) PetscCall(Add<W>(L, *v, step));
    else everywhere();
    if (subspace && subspace->space->excess > 0.0)
      PetscCall(ProjectForce(L, *subspace, &L.r, [&](PetscInt l, PetscInt k, AinsworthSingle before) {
        L.p[k] -= step.g * L.inverse[l / bs * inverses + l % bs] * (L.r[k] - before);
      }));
  }
  if (subspace) PetscCall(ProjectStep(L, *subspace, &L.p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = M x. Collective */
template <int W>
static PetscErrorCode Mult(AinsworthScaled &L, PetscReal scale, const PetscScalar *in, PetscScalar *out)
{
  const std::vector<PetscReal> &w       = *L.w;
  const PetscReal               unscale = 1.0 / scale;

  PetscFunctionBegin;
  ForUnknowns<W>(L, [&](PetscInt u, PetscInt l, PetscInt k) {
    L.p[k] = (AinsworthSingle)(in[l] * (scale * AinsworthReciprocal(w[u])));
  });
  L.pair = {}; /* p and r are overwritten below */
  PetscCall(L.product->mult(L.p.data(), L.r.data()));
  ForUnknowns<W>(L, [&](PetscInt u, PetscInt l, PetscInt k) {
    out[l] = (PetscScalar)L.r[k] * (unscale * AinsworthReciprocal(w[u]));
  });
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthScaled::mult(PetscReal scale, const PetscScalar *from, PetscScalar *to)
{
  PetscFunctionBegin;
  PetscCall(AinsworthDispatchWidth(product->width, [&](auto W) { return Mult<W()>(*this, scale, from, to); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthScaled::findScale - finds the power of two that brings a vector, in the units of W^{-1}, to 1. Collective */
PetscErrorCode AinsworthScaled::findScale(const PetscScalar *from, PetscReal *scale) const
{
  const PetscInt width = product->width;
  PetscReal      most  = 0.0;

  PetscFunctionBegin;
  for (size_t u = 0; u < w->size(); u++)
    for (PetscInt j = 0; j < width; j++)
      most = PetscMax(most, PetscAbsScalar(from[u * width + j]) * AinsworthReciprocal((*w)[u]));
  if (product->cols->sf)
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, product->cols->layout->comm));
  *scale = AinsworthInversePower(most, 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <int W>
static PetscErrorCode Smooth(AinsworthScaled &L, PetscInt steps, PetscReal least, PetscReal most, PetscBool zero,
                             const AinsworthLevelSubspace *subspace, Vec b, Vec to)
{
  const std::vector<PetscReal> &w     = *L.w;
  const PetscReal               theta = (most + least) / 2, delta = (most - least) / 2, sigma = theta / delta;
  const PetscReal               scale = *L.s, unscale = 1.0 / scale;
  PetscReal                     rho = 1.0 / sigma;
  const PetscScalar            *in;
  PetscScalar                  *out;
  Step<W>                       step = {&L, 0.0f, (float)(1.0 / theta), true, zero == PETSC_TRUE};

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(b, &in));
  ForUnknowns<W>(L, [&](PetscInt u, PetscInt l, PetscInt k) { L.r[k] = (AinsworthSingle)(-in[l] * (scale * w[u])); });
  PetscCall(VecRestoreArrayRead(b, &in));
  /* PCMG's zeros may be on a device */
  PetscCall(zero ? VecGetArrayWrite(to, &out) : VecGetArray(to, &out));
  if (zero) PetscCall(Advance<W>(L, NULL, step, subspace));
  else {
    ForUnknowns<W>(L, [&](PetscInt u, PetscInt l, PetscInt k) {
      L.x[k] = (AinsworthSingle)(out[l] * (scale * AinsworthReciprocal(w[u])));
    });
    PetscCall(Advance<W>(L, &L.x, step, subspace));
  }
  step.first = false;
  for (PetscInt k = 1; k < steps; k++) {
    const PetscReal before = rho;

    rho    = 1.0 / (2.0 * sigma - before);
    step.f = (float)(rho * before);
    step.g = (float)(2.0 * rho / delta);
    PetscCall(Advance<W>(L, &L.p, step, subspace));
    step.zero = false;
  }
  ForUnknowns<W>(L, [&](PetscInt u, PetscInt l, PetscInt k) {
    out[l] = (PetscScalar)(step.zero ? L.p[k] : L.x[k] + L.p[k]) * (w[u] * unscale);
  });
  PetscCall(zero ? VecRestoreArrayWrite(to, &out) : VecRestoreArray(to, &out));
  L.rounded = !zero;
  PetscCall(Identify(b, to, &L.pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthScaled::smooth - does steps of Chebyshev's iteration with Jacobi, or with the factor, for M x = b, from x or
   from zero. Collective

   least, most: the damped part of the spectrum of D^{-1} M; subspace: NULL, or x is in it and stays there, with Q
   D^{-1} Q' in place of D^{-1}. The vectors of a multivector have one scale: they may differ by 1e20
*/
PetscErrorCode AinsworthScaled::smooth(PetscInt steps, PetscReal least, PetscReal most, PetscBool zero,
                                       const AinsworthLevelSubspace *subspace, Vec b, Vec to)
{
  PetscFunctionBegin;
  PetscCall(AinsworthDispatchWidth(
    product->width, [&](auto W) { return Smooth<W()>(*this, steps, least, most, zero, subspace, b, to); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

template <int W>
static PetscErrorCode Residual(AinsworthScaled &L, Vec to)
{
  const std::vector<PetscReal> &w       = *L.w;
  const PetscReal               unscale = -1.0 / *L.s;
  PetscScalar                  *out;

  PetscFunctionBegin;
  PetscCall(Add<W>(L, L.p, [](auto, PetscInt) {}));
  L.pair = {}; /* r is now the whole residual */
  PetscCall(VecGetArrayWrite(to, &out));
  ForUnknowns<W>(L, [&](PetscInt u, PetscInt l, PetscInt k) {
    out[l] = (PetscScalar)L.r[k] * (unscale * AinsworthReciprocal(w[u]));
  });
  PetscCall(VecRestoreArrayWrite(to, &out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthScaled::residual - computes r = b - M x if x was made by the last call of smooth(), when half of the work is
   done. Collective

   exact: there is a product in double precision as well, for an x with what coarser levels found: rounding of M x has a
   smooth part, which they amplify by the condition number of M. Smoothing alone leaves x small
*/
PetscErrorCode AinsworthScaled::residual(bool exact, Vec b, Vec from, Vec to, bool *found)
{
  std::array<PetscInt64, 4> now;

  PetscFunctionBegin;
  PetscCall(Identify(b, from, &now));
  *found = now == pair && !(exact && rounded);
  if (*found) PetscCall(AinsworthDispatchWidth(product->width, [&](auto W) { return Residual<W()>(*this, to); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}
