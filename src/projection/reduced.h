/* The reduced system: the operator in Ker C, and what leads there and back */
#ifndef AINSWORTH_REDUCED_H
#define AINSWORTH_REDUCED_H

#include "matainsworth.h"

/* What to do with rows of C that are linear combinations of other rows */
typedef enum {
  AINSWORTH_REDUNDANT_DROP, /* left out; a right-hand side that contradicts them is a failure, PC_INCONSISTENT_RHS */
  AINSWORTH_REDUNDANT_ERROR /* the set-up stops with an error that names them */
} AinsworthRedundantType;

/* How it is built */
struct AinsworthReducedChoices {
  PetscObject            parent     = NULL; /* the PC, whose prefix and level of indentation it gets */
  MatAinsworthWeightType weightType = {};
  Vec                    weight     = NULL; /* of length n, for MAT_AINSWORTH_WEIGHT_USER */
  AinsworthGramChoices   gram;
  AinsworthRedundantType redundant = {};
};

/* Constant once it is built; its vectors are work space */
struct AinsworthReduced {
  AinsworthRef<Mat> mat; /* the reduced operator; NULL without constraints */
  /* diag(A)^{-1}, length n; weights residuals so that their size does not depend on that of A */
  AinsworthRef<Vec> inverseDiagonal;
  AinsworthRef<Vec> rhs, Ax;   /* f~, and op(A) x with the program's A */
  AinsworthRef<Vec> f;         /* f minus the terms of known x and lambda; NULL if nothing is known */
  AinsworthRef<Vec> g, lambda; /* on the kept rows, if some are not kept */
};
typedef std::unique_ptr<const AinsworthReduced> AinsworthReducedStage;

/* Puts another solver in the place of the reduced system; true: there is one */
typedef std::function<PetscErrorCode(PetscBool *)> AinsworthReplaceFn;

PetscErrorCode AinsworthReducedBuild(const AinsworthReducedChoices &, const AinsworthReplaceFn &,
                                     const AinsworthReduced *, AinsworthSaddleStage *, AinsworthReducedStage *,
                                     PCFailedReason *);

#endif
