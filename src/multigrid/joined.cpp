/* The operator of a level in double precision, from values that it shares with the smoother in single precision */
#include "levelmat.h"

PetscErrorCode AinsworthJoined::mult(const PetscScalar *from, PetscScalar *to)
{
  const std::vector<PetscReal> &scale = *w;
  const PetscInt                each  = product->width;

  PetscFunctionBegin;
  for (size_t u = 0, l = 0; u < scale.size(); u++)
    for (PetscInt k = 0; k < each; k++, l++) x[l] = from[l] * AinsworthReciprocal(scale[u]);
  PetscCall(product->mult(x.data(), to, [this, &scale, each](auto B, PetscInt i, PetscScalar *y) {
    const PetscInt bs = B() ? B() : product->bs();

    for (PetscInt c = 0; c < bs; c++)
      for (PetscInt k = 0; k < each; k++) *y++ *= AinsworthReciprocal(scale[i * bs + c]);
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthJoined::unscale - computes W^{-1} M W^{-1} for an assembled M = W A W. Collective */
PetscErrorCode AinsworthJoined::unscale(Mat M) const
{
  Vec          d;
  PetscScalar *values;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(M, &d, NULL));
  PetscCall(VecGetArrayWrite(d, &values));
  for (PetscReal v : *w) *values++ = 1.0 / v;
  values -= w->size();
  PetscCall(VecRestoreArrayWrite(d, &values));
  PetscCall(MatDiagonalScale(M, d, d));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthJoined::join - returns the upper half of W A W */
std::shared_ptr<const AinsworthBlockRows> AinsworthJoined::join() const
{
  const auto                             &places = AinsworthPattern(*product->upper);
  auto                                    joined = std::make_shared<AinsworthBlockRows>(places.br, places.bc);
  AinsworthHalfValues<AinsworthSplitRows> values(*product->upper, 0);
  const size_t                            n = places.a.size();

  joined->n = places.n;
  joined->i = places.i;
  joined->j = places.j;
  joined->a.reserve(n);
  for (; joined->a.size() < n; values.advance(1)) joined->a.push_back(values.one(0));
  return joined;
}
