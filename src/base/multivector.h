/*
   Multivectors: vectors that hold `width` vectors of one layout unknown by unknown, v_k(l) at l width + k, as those of
   PETSc's MATMAIJ. What a matrix does to all of them reads it once. Their block size is the width, so that
   VecStrideGather() and VecStrideScatter() get and set one of them
*/
#ifndef AINSWORTH_MULTIVECTOR_H
#define AINSWORTH_MULTIVECTOR_H

#include "petsccompat.h"
#include <type_traits>

template <int N>
using AinsworthSize = std::integral_constant<int, N>;

/* The widths that loops are compiled for */
static constexpr int AinsworthWidest = 8, AinsworthNarrow = 4;

/* Returns f of the width of a multivector: 1, AinsworthNarrow or AinsworthWidest */
template <class F>
inline auto AinsworthDispatchWidth(PetscInt width, F f)
{
  if (width == 1) return f(AinsworthSize<1>());
  if (width == AinsworthNarrow) return f(AinsworthSize<AinsworthNarrow>());
  return f(AinsworthSize<AinsworthWidest>());
}

/* Creates a multivector of vectors that have the layout of v. Collective */
static inline PetscErrorCode AinsworthMultivectorCreate(Vec v, PetscInt width, Vec *multi)
{
  PetscInt n, N;
  VecType  type;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(v, &n));
  PetscCall(VecGetSize(v, &N));
  PetscCall(VecGetType(v, &type));
  PetscCall(VecCreate(PetscObjectComm((PetscObject)v), multi));
  PetscCall(VecSetSizes(*multi, n * width, N * width));
  PetscCall(VecSetBlockSize(*multi, width));
  PetscCall(VecSetType(*multi, type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls f(v, w) for each vector v of x; w becomes that of y. v and w are work space. Collective if f is */
template <class F>
static inline PetscErrorCode AinsworthMultivectorForEach(Vec x, PetscInt width, Vec y, Vec v, Vec w, F f)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < width; k++) {
    PetscCall(VecStrideGather(x, k, v, INSERT_VALUES));
    PetscCall(f(v, w));
    PetscCall(VecStrideScatter(w, k, y, INSERT_VALUES));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
