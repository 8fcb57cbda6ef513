/*
   What the inner solver is, from facts of the system, what the program chose, and what was tried before. Plain C++,
   without MPI and PETSc
*/
#ifndef AINSWORTH_PLAN_H
#define AINSWORTH_PLAN_H

#include "ladder.h"

/* The method of the reduced solve */
typedef enum {
  AINSWORTH_METHOD_GIVEN, /* that of the program, or before the first plan */
  AINSWORTH_METHOD_PROJECTED,
  AINSWORTH_METHOD_CG,
  AINSWORTH_METHOD_GMRES
} AinsworthMethod;

/* Its norm, and the side of its preconditioner */
typedef enum {
  AINSWORTH_NORM_GIVEN,   /* that of the program, or the default of the method */
  AINSWORTH_NORM_NATURAL, /* the energy: fair to all unknowns if the preconditioner is */
  AINSWORTH_NORM_TRUE     /* the true residual, preconditioned from the right */
} AinsworthNorm;

/* Its preconditioner */
typedef enum {
  AINSWORTH_INNER_GIVEN,
  AINSWORTH_INNER_BLOCKS, /* block smoothed aggregation */
  AINSWORTH_INNER_AMG,    /* BoomerAMG or another */
  AINSWORTH_INNER_FACTOR  /* a factorization of M_* */
} AinsworthPreconditioner;

/* What became of a solver that was tried for this matrix */
typedef enum {
  AINSWORTH_UNTRIED,
  AINSWORTH_TAKEN,
  AINSWORTH_FAILED
} AinsworthTried;

struct AinsworthHistory {
  AinsworthTried factor = AINSWORTH_UNTRIED; /* M_* factored, in place of multigrid */
  AinsworthTried gmres  = AINSWORTH_UNTRIED; /* GMRES, in place of conjugate gradients */
  AinsworthTried whole  = AINSWORTH_UNTRIED; /* the whole system factored */
  AinsworthTried blocks = AINSWORTH_UNTRIED; /* failed: block smoothed aggregation does not fit A */
};

/* What a plan depends on; the defaults are those of a usual system */
struct AinsworthPlanFacts {
  bool constraints = true;
  bool symmetric   = true;  /* A = A' */
  bool adjoint     = true;  /* B is C, and D = D' */
  bool nodes       = true;  /* A couples nodes that block smoothed aggregation can handle */
  bool rows        = true;  /* one penalty per row of C; otherwise that of the paper */
  bool tiny        = false; /* a factorization is cheaper than the set-up of multigrid, and possible */
  bool projected   = true;  /* the program leaves the method as it is, KSPPROJECTEDCG, or names that */
  bool open        = true;  /* it chose neither a method nor a norm: any may be taken */
  /* its method is one of conjugate gradients, or applies the preconditioner once */
  bool             conjugate = true;
  bool             own       = true; /* it chose no preconditioner */
  AinsworthHistory history;
};

struct AinsworthPlan {
  AinsworthMethod method = AINSWORTH_METHOD_GIVEN;
  /* chosen once the method is there, which has to support it */
  AinsworthNorm           norm           = AINSWORTH_NORM_GIVEN;
  AinsworthPreconditioner preconditioner = AINSWORTH_INNER_GIVEN;
  const char             *why[2]         = {"", ""}; /* of the method and of the preconditioner */
};

AinsworthPlan AinsworthPlanInner(const AinsworthPlanFacts &);
AinsworthRung AinsworthPlanRung(const AinsworthHistory &);

#endif
