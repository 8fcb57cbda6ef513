/*
   The Gram matrix S = C W C' + N and its solver, component by component where its rows are placed (docs/method.md, Gram
   matrix)
*/
#ifndef AINSWORTH_GRAM_H
#define AINSWORTH_GRAM_H

#include "factor.h"
#include "placement.h"
#include "surface.h"

struct AinsworthGram {
  MPI_Comm comm = MPI_COMM_NULL; /* of C */
  /* placed: AIJ, the block of the rows of this rank or, if a component is split, m x m on all ranks */
  Mat                S         = NULL;
  PetscBool          hermitian = PETSC_FALSE; /* S is Hermitian, and positive definite unless rows of C are dependent */
  AinsworthPlacement placement;               /* which rank solves for which row of S */
  Vec                scale = NULL;            /* placed: diag(S)^{-1/2} */
  /* the placed S, scaled to a unit diagonal: rows of this rank, or of the group if a component is split */
  Mat             placed = NULL;
  MPI_Comm        group  = MPI_COMM_NULL; /* ranks that share a split component; MPI_COMM_NULL if none is split */
  KSP             ksp    = NULL;          /* on PETSC_COMM_SELF or on group */
  AinsworthFactor factor = {};            /* the factorization of its PC, if it is one */
  Vec             b = NULL, x = NULL;     /* work vectors of `placed`; x has no array of its own */
};

/* Dense inverses of components of up to this many rows take less time than the overhead of a sparse factorization */
static const PetscInt AinsworthSmallComponent = 32;

/* What S is made of, besides the rows of C: all placed */
struct AinsworthGramInputs {
  Mat       C         = NULL;        /* m x n */
  Vec       weight    = NULL;        /* diagonal of W, NULL for W = I */
  Mat       N         = NULL;        /* m x m, may be NULL */
  PetscBool hermitian = PETSC_FALSE; /* S is Hermitian */
  bool      own       = false;       /* with W_p in the place of W */
};

/* Checks whether all components are small, on all ranks */
inline bool AinsworthGramIsSmall(const AinsworthGram *gram)
{
  return gram->placement.largest <= gram->placement.small;
}

/* Gets the solver; NULL on ranks that solve for no row */
inline KSP AinsworthGramGetKSP(const AinsworthGram *gram)
{
  return gram->placement.sizes.empty() ? NULL : gram->ksp;
}

PetscErrorCode AinsworthGramMultiply(Mat, Vec, Mat *, Mat *);
PetscErrorCode AinsworthGramForm(AinsworthGram *, const AinsworthSurface &, const AinsworthGramInputs &);
PetscErrorCode AinsworthGramGetWhole(const AinsworthGram *, Mat *);
PetscErrorCode AinsworthGramFactor(AinsworthGram *, PetscObject);
PetscErrorCode AinsworthGramReset(AinsworthGram *);
PetscErrorCode AinsworthGramSolve(AinsworthGram *, Vec, Vec);
PetscErrorCode AinsworthGramGetFailedReason(AinsworthGram *, PCFailedReason *);
PetscErrorCode AinsworthGramDescribe(const AinsworthGram *, char[], size_t);
PetscErrorCode AinsworthGramView(const AinsworthGram *, PetscViewer);
PetscErrorCode AinsworthGramGetEconomy(const AinsworthGram *, const char **);

#endif
