#include "levelmat.h"
#include <petsc/private/petscimpl.h>

/* The power of two next to 1/v */
static PetscReal InversePower(PetscReal v)
{
  int exponent = 0;

  if (v > 0.0) (void)frexp((double)v, &exponent);
  return (PetscReal)ldexp(1.0, -exponent);
}

/* s with s W b about 1 at most; collective, but for a norm of b that is known already */
PetscErrorCode AinsworthScaledScale(const AinsworthScaled &L, Vec b, PetscReal *s)
{
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(VecNorm(b, NORM_2, &norm));
  *s = InversePower(norm * L.largest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* f(component l, place in vectors of single precision) for all unknowns */
template <class F>
inline void ForUnknowns(const AinsworthScaled &L, F f)
{
  const PetscInt n = L.product.n(), bs = L.product.bs(), s = L.product.stride();

  for (PetscInt i = 0; i < n; i++)
    for (PetscInt c = 0; c < bs; c++) f(i * bs + c, i * s + c);
}

/* One step of Chebyshev's iteration: p = f p + g D^{-1} r, x += p */
struct Step {
  AinsworthScaled *L;
  float            f, g;

  void operator()(PetscInt first) const
  {
    const PetscInt   stride = L->product.stride(), o = first * stride;
    AinsworthSingle *p = L->p.data() + o, *x = L->x.data() + o;
    for (PetscInt c = 0; c < stride; c++) {
      p[c] = f * p[c] + g * L->inverse[o + c] * L->r[o + c];
      x[c] += p[c];
    }
  }
};
} // namespace

/* y = M x */
PetscErrorCode AinsworthScaledMult(AinsworthScaled *L, Vec x, Vec y)
{
  const std::vector<PetscReal> &w    = *L->w;
  PetscReal                     most = 0.0;
  const PetscScalar            *from;
  PetscScalar                  *to;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(x, &from));
  ForUnknowns(*L, [&](PetscInt l, PetscInt) { most = PetscMax(most, PetscAbsScalar(from[l]) / w[l]); });
  if (L->product.cols.sf) PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)x)));
  const PetscReal s = InversePower(most);
  ForUnknowns(*L, [&](PetscInt l, PetscInt k) { L->q[k] = (AinsworthSingle)(from[l] * (s / w[l])); });
  PetscCall(VecRestoreArrayRead(x, &from));
  L->xid = 0; /* r is taken from here on */
  PetscCall(L->product.mult(L->q.data(), L->r.data()));
  PetscCall(VecGetArrayWrite(y, &to));
  ForUnknowns(*L, [&](PetscInt l, PetscInt k) { to[l] = (PetscScalar)L->r[k] / (s * w[l]); });
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthScaledSmooth - steps of Chebyshev's iteration with Jacobi for M x = b, from x, or from zero

   least, largest: the part of the spectrum of D^{-1} M that is damped
*/
PetscErrorCode AinsworthScaledSmooth(AinsworthScaled *L, PetscInt steps, PetscReal least, PetscReal largest, PetscBool zero, Vec b, Vec x)
{
  const std::vector<PetscReal> &w     = *L->w;
  const PetscReal               theta = (largest + least) / 2, delta = (largest - least) / 2, sigma = theta / delta;
  const PetscInt                n = L->product.n(), stride = L->product.stride();
  PetscReal                     s = 1.0, rho = 1.0 / sigma;
  const PetscScalar            *from;
  PetscScalar                  *to;
  Step                          step = {L, 0.0f, (float)(1.0 / theta)};

  PetscFunctionBegin;
  PetscCall(AinsworthScaledScale(*L, b, &s));
  PetscCall(VecGetArrayRead(b, &from));
  ForUnknowns(*L, [&](PetscInt l, PetscInt k) { L->r[k] = (AinsworthSingle)(from[l] * (s * w[l])); });
  PetscCall(VecRestoreArrayRead(b, &from));
  PetscCall(VecGetArray(x, &to));
  if (zero) {
    std::fill(L->x.begin(), L->x.end(), AinsworthSingle(0));
    std::fill(L->p.begin(), L->p.end(), AinsworthSingle(0));
    for (PetscInt i = 0; i < n; i++) step(i);
  } else {
    ForUnknowns(*L, [&](PetscInt l, PetscInt k) { L->x[k] = (AinsworthSingle)(to[l] * (s / w[l])); });
    PetscCall(L->product.start(L->x.data(), L->q.data()));
    L->product.pass(L->x.data(), L->q.data(), [&](PetscInt i, AinsworthSingle *q) {
      for (PetscInt c = 0; c < stride; c++) L->r[i * stride + c] -= q[c];
      step(i);
    });
  }
  for (PetscInt k = 1; k < steps; k++) {
    const PetscReal before = rho;

    rho    = 1.0 / (2.0 * sigma - before);
    step.f = (float)(rho * before);
    step.g = (float)(2.0 * rho / delta);
    PetscCall(L->product.start(L->p.data(), L->q.data()));
    L->product.pass(L->p.data(), L->q.data(), [&](PetscInt i, AinsworthSingle *q) {
      for (PetscInt c = 0; c < stride; c++) L->r[i * stride + c] -= q[c];
      step(i);
    });
  }
  ForUnknowns(*L, [&](PetscInt l, PetscInt k) { to[l] = (PetscScalar)L->x[k] * (w[l] / s); });
  PetscCall(VecRestoreArray(x, &to));
  L->s = s;
  PetscCall(PetscObjectGetId((PetscObject)x, &L->xid));
  PetscCall(PetscObjectGetId((PetscObject)b, &L->bid));
  PetscCall(PetscObjectStateGet((PetscObject)x, &L->xstate));
  PetscCall(PetscObjectStateGet((PetscObject)b, &L->bstate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r = b - M x; straight after smoothing half of the work is done already */
PetscErrorCode AinsworthScaledResidual(AinsworthScaled *L, Vec b, Vec x, Vec r)
{
  const std::vector<PetscReal> &w      = *L->w;
  const PetscInt                stride = L->product.stride();
  PetscObjectId                 xid, bid;
  PetscObjectState              xstate, bstate;
  PetscScalar                  *to;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)x, &xid));
  PetscCall(PetscObjectGetId((PetscObject)b, &bid));
  PetscCall(PetscObjectStateGet((PetscObject)x, &xstate));
  PetscCall(PetscObjectStateGet((PetscObject)b, &bstate));
  if (xid != L->xid || xstate != L->xstate || bid != L->bid || bstate != L->bstate) {
    PetscCall(AinsworthScaledMult(L, x, r));
    PetscCall(VecAYPX(r, -1.0, b));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(L->product.start(L->p.data(), L->q.data()));
  L->product.pass(L->p.data(), L->q.data(), [&](PetscInt i, AinsworthSingle *q) {
    for (PetscInt c = 0; c < stride; c++) L->r[i * stride + c] -= q[c];
  });
  L->xid = 0; /* r is now the residual itself */
  PetscCall(VecGetArrayWrite(r, &to));
  ForUnknowns(*L, [&](PetscInt l, PetscInt k) { to[l] = (PetscScalar)L->r[k] / (L->s * w[l]); });
  PetscCall(VecRestoreArrayWrite(r, &to));
  PetscFunctionReturn(PETSC_SUCCESS);
}
