/*
   Iterative refinement of a solution of [A B'; C -D] by reduced solves, until the backward error of the whole system
   says that it is one
*/
#ifndef AINSWORTH_REFINE_H
#define AINSWORTH_REFINE_H

#include "backwarderror.h"
#include <functional>
#include <vector>

/* Solves for b, to a relative tolerance of at least `loose`, by whatever rung of the ladder has been reached */
using AinsworthSolveFn = std::function<PetscErrorCode(AinsworthSaddleVec b, PetscReal loose, AinsworthSaddleVec p)>;

/*
   Subtracts from rows that were left out, whose coefficients are w, the combination of kept rows that is next to them
*/
using AinsworthCombination = std::function<PetscErrorCode(Vec w)>;

/* What a solution is asked to be */
struct AinsworthRequest {
  PetscBool transpose = PETSC_FALSE;
  PetscReal tol       = -1.0;        /* relative tolerance; negative if there is none */
  PetscBool energetic = PETSC_FALSE; /* the solver ends by the energy norm of the error, which is fair to all of x */
  PetscBool bounded   = PETSC_TRUE;  /* and that norm bounds what each row is left with, as its W is diag(A)^-1 */
  Vec       earlier   = NULL;        /* terms of rows of C in earlier solves, whose rounding g may be; or NULL */

  AinsworthCombination combination; /* for rows that depend on others; empty: these are not judged */
};

typedef enum {
  AINSWORTH_OUTCOME_SOLVED,
  AINSWORTH_OUTCOME_UNMET,     /* a row has a residual that further solves do not reduce */
  AINSWORTH_OUTCOME_UNSETTLED, /* residuals are small, but further solves move x */
  /* all rows are met but some that depend on others, and a combination of rows of K is zero, but not that of b */
  AINSWORTH_OUTCOME_CONTRADICTION
} AinsworthOutcomeState;

struct AinsworthOutcome {
  AinsworthOutcomeState state = AINSWORTH_OUTCOME_UNMET;
  AinsworthBackward     error;        /* of the solution */
  PetscReal             moved  = 0.0; /* by the last further solve, relative to x; 0 if there was none */
  PetscReal             growth = 0.0; /* of x beside f and g */
  /* how far rounding of A moves x, relative to x, where f and g are nearly nothing of x; else 0 */
  PetscReal rounding = 0.0;
  int       steps    = 0; /* further solves, without the one for that */
  /* for each local row of the multiplier field, where the state is CONTRADICTION */
  std::vector<bool> contradictory;
};

/* What a row that depends on others, and is not met, means for the system */
typedef enum {
  AINSWORTH_DEPENDENCE_CONSISTENT,    /* K' w = 0, and w' b is the rounding of the rows in w, whatever x is */
  AINSWORTH_DEPENDENCE_CONTRADICTION, /* K' w = 0, but not w' b: no solution exists */
  AINSWORTH_DEPENDENCE_NONE           /* w' K is a row of its own, which the system has besides the others */
} AinsworthDependence;

/* State of the loop: what is known when it decides whether to go on */
struct AinsworthProgress {
  PetscReal excess = 0.0, before = 0.0; /* the largest quotient of a row and its bound, now and a step ago */
  PetscReal moved = 0.0, last = 0.0;    /* how far the last step, and the one before, has moved x */
  bool      settles = false;            /* x counts as settled without a step that shows it */
  int       steps   = 0;
};
typedef enum {
  AINSWORTH_WORKING,
  AINSWORTH_CONVERGED,
  AINSWORTH_NO_PROGRESS
} AinsworthProgressState;

AinsworthProgressState AinsworthDecide(const AinsworthProgress &, PetscReal open);
PetscErrorCode         AinsworthCertify(const AinsworthSaddle *, Vec, Vec, PetscReal, Vec, AinsworthDependence *);
PetscErrorCode         AinsworthRefine(const AinsworthSaddle *, const AinsworthRequest *, const AinsworthSolveFn &,
                                       AinsworthSaddleVec, AinsworthSaddleVec, Vec, AinsworthSaddleVec, PetscBool *,
                                       AinsworthOutcome *);

#endif
