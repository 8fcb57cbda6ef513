/*
   The rows of C on the ranks that solve for them, and the unknowns in them: all that the projectors read and change

   C W and C W_p are C times diagonal matrices: one copy of the entries and one exchange of values serve C, C W and
   C W_p, and their adjoints
*/
#ifndef AINSWORTH_SURFACE_H
#define AINSWORTH_SURFACE_H

#include "../base/arrays.h"
#include "../base/objects.h"
#include <vector>

class AinsworthSurface {
public:
  /*
     C: AIJ, placed. weight: diagonal of W; NULL for W = I. own: diagonal of W_p, which is W or 0; NULL if nothing asks
     for it. Collective
  */
  PetscErrorCode create(Mat C, Vec weight, Vec own);

  const std::vector<PetscInt>  &places() const { return here; }
  const std::vector<PetscReal> &weights() const { return w; } /* at the places, then elsewhere; empty for W = I */

  /* Creates C (C W)' or, if own, C (C W_p)', of the rows of this rank alone, without a parallel matrix */
  PetscErrorCode createGram(bool own, Mat *S) const;

  /*
     Values x at the places, and values y of the rows, are those of `width` vectors, unknown by unknown
     (base/multivector.h). All are collective
  */
  /* Computes y = C x */
  PetscErrorCode multiply(PetscInt width, const PetscScalar x[], PetscScalar y[]) const;
  /* Computes y = C W x and, unless yp is NULL, yp = C W_p x */
  PetscErrorCode multiplyWeighted(PetscInt width, const PetscScalar x[], PetscScalar y[], PetscScalar yp[]) const;
  /* Computes x += C' y */
  PetscErrorCode spread(PetscInt width, const PetscScalar y[], PetscScalar x[]) const;
  /* Computes x += W C' y and, unless yp is NULL, x += W_p C' yp */
  PetscErrorCode spreadWeighted(PetscInt width, const PetscScalar y[], const PetscScalar yp[], PetscScalar x[]) const;

  /* Calls f(v) with the values v of x at the places. Collective if f is */
  template <class F>
  PetscErrorCode read(Vec x, F f) const
  {
    PetscFunctionBegin;
    PetscCall(take(1, x));
    PetscCall(f((const PetscScalar *)taken.data()));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* The same for a multivector, where f may change the values; x changes with them */
  template <class F>
  PetscErrorCode change(PetscInt width, Vec x, F f) const
  {
    PetscFunctionBegin;
    PetscCall(take(width, x));
    PetscCall(f(taken.data()));
    PetscCall(put(width, x));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

private:
  std::vector<PetscInt>            here;          /* the local unknowns in rows of any rank, ascending */
  PetscInt                         elsewhere = 0; /* unknowns of other ranks in rows of this one */
  AinsworthRef<PetscSF>            local;         /* from a vector's entries on this rank to those at the places */
  AinsworthRef<PetscSF>            sf;            /* from the places to where they are elsewhere; NULL on one rank */
  AinsworthRows                    all, some;     /* C, and C where W_p is not zero; columns: places, then elsewhere */
  std::vector<PetscReal>           w;             /* see weights() */
  mutable std::vector<PetscScalar> values;        /* at the places, then elsewhere */
  mutable std::vector<PetscScalar> taken;         /* those of a vector at the places */

  PetscErrorCode number(Mat C, std::vector<PetscInt> *place);
  PetscErrorCode fetch(PetscInt width, const PetscScalar x[], bool weighted) const;
  PetscErrorCode bring(PetscInt width, bool weighted, PetscScalar x[]) const;
  PetscErrorCode gather(Vec v, std::vector<PetscReal> *at) const;
  PetscErrorCode take(PetscInt width, Vec x) const;
  PetscErrorCode put(PetscInt width, Vec x) const;
};

#endif
