/* The Gram matrix S = C W C' + N and its solver, component by component where its rows are placed (docs/method.md, Gram matrix) */
#ifndef AINSWORTH_GRAM_H
#define AINSWORTH_GRAM_H

#include "factor.h"
#include "placement.h"

struct AinsworthGram {
  Mat                S;         /* m x m AIJ, rows distributed as those of C */
  PetscBool          hermitian; /* it is, and positive definite unless rows of C depend on each other */
  AinsworthPlacement placement; /* of the rows of S on the ranks that solve for them */
  Vec                scale;     /* placed: diag(S)^{-1/2} */
  Mat                placed;    /* S in its places, scaled to a unit diagonal: the rows of this rank, or, where a component is split, of the group */
  MPI_Comm           group;     /* the ranks that share a split component; MPI_COMM_NULL: none do */
  KSP                ksp;       /* on PETSC_COMM_SELF or the group */
  AinsworthFactor    factor;    /* what its PC factors, where it does */
  Vec                b, x;      /* of placed; x is lent its array */
};

/* What S is made with, beside C and C W */
struct AinsworthGramInputs {
  Mat                       N;           /* may be NULL */
  PetscBool                 hermitian;   /* it is */
  PetscBool                 samePattern; /* all have the nonzero patterns and the layout of the last time: so do the symbolic product, places and factor */
  PetscInt                  rowsPerRank; /* at most, of larger components */
  PetscObject               parent;      /* the solver has its options prefix */
  Mat                       other;       /* where B is not C: a matrix whose nonzero pattern connects rows, too; otherwise NULL */
  const AinsworthPlacement *placement;   /* where S is that of B: the one that was made for C; otherwise NULL */
};

/* NULL on ranks that solve for no row */
inline KSP AinsworthGramGetKSP(const AinsworthGram *gram)
{
  return gram->placement.sizes.empty() ? NULL : gram->ksp;
}

PetscErrorCode AinsworthGramSetUp(AinsworthGram *, Mat, Mat, const AinsworthGramInputs *);
PetscErrorCode AinsworthGramReset(AinsworthGram *);
PetscErrorCode AinsworthGramSolve(AinsworthGram *, Vec, Vec);
PetscErrorCode AinsworthGramGetFailedReason(AinsworthGram *, PCFailedReason *);
PetscErrorCode AinsworthGramDescribe(const AinsworthGram *, char[], size_t);
PetscErrorCode AinsworthGramView(const AinsworthGram *, PetscViewer);
PetscErrorCode AinsworthGramGetEconomy(const AinsworthGram *, const char **);

#endif
