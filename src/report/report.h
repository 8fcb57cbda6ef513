/* Error against run time of the reduced solve, one row per iteration, and the decision to stop (docs/options.md) */
#ifndef AINSWORTH_REPORT_H
#define AINSWORTH_REPORT_H

#include <petscainsworth.h>
#include "../projection/matainsworth.h"
#include "estimator.h"
#include <petsctime.h>

/* What ends the reduced solve */
typedef enum {
  AINSWORTH_STOP_RESIDUAL,    /* the convergence test of the inner KSP, on a norm of the residual */
  AINSWORTH_STOP_ENERGY_ERROR /* the estimated energy norm of the error */
} AinsworthStopType;

struct AinsworthReportSettings {
  PetscViewer       viewer    = NULL; /* NULL for no monitor */
  PetscViewerFormat format    = PETSC_VIEWER_DEFAULT;
  Vec               reference = NULL; /* exact solution, of length n + m or n; NULL if unknown */
  AinsworthStopType stop      = {};
  PetscReal         rtol      = 0.0;              /* tolerance of the error relative to x */
  char             *monitor = NULL, *file = NULL; /* options that set viewer and reference; NULL if unset */
  PetscReal         eigenvalue = 0.0;             /* lower bound of the spectrum; PETSC_DEFAULT to estimate it */
};

/* The reduced system, set by PCAINSWORTH */
struct AinsworthReportSystem {
  Mat      A = NULL, C = NULL;     /* C has no rows if there are no constraints */
  Mat      reduced         = NULL; /* the reduced operator; NULL without constraints */
  IS       primal          = NULL; /* field of x in the solution of the saddle-point system */
  PetscInt size            = 0;    /* of that solution */
  Vec      inverseDiagonal = NULL; /* diag(A)^{-1} */
};

/* NAN if unknown */
struct AinsworthReportRow {
  PetscReal seconds = 0.0, natural = 0.0, primal = 0.0, constraint = 0.0, error = 0.0, multipliers = 0.0;
};

struct AinsworthReport {
  AinsworthReportSettings *settings = NULL;
  AinsworthReportSystem    system   = {};
  /* the method is conjugate gradients, and its operator is observed to get the coefficients */
  PetscBool estimate = PETSC_FALSE;
  PetscBool kernel   = PETSC_FALSE; /* it iterates in Ker C, without R g */
  PetscBool watch    = PETSC_FALSE; /* there is a monitor, or the error ends the solve */
  /* the convergence test is PETSc's own: stagnation ends the solve, too */
  PetscBool patient = PETSC_FALSE;
  /* the convergence test is PETSc's own, in the natural norm: its tolerance is made relative to x */
  PetscBool                       tighten = PETSC_FALSE;
  AinsworthEstimator              estimator;
  std::vector<AinsworthReportRow> rows;
  size_t                          printed = 0;
  Vec                             exact   = NULL; /* exact x; NULL if unknown */
  AinsworthSaddleVec              b       = {};   /* f and g of the current solve, borrowed */
  Vec                             x = NULL, r = NULL, residual = NULL;
  /* x and lambda of an iterate if D is nonzero; NULL until needed */
  AinsworthSaddleVec springs = {};
  PetscReal          norm[2] = {}; /* of f and g */
  /* norm of C' lambda of the exact solution, in that of diag(A)^{-1} */
  PetscReal held     = 0.0;
  PetscReal energy   = 0.0;         /* energy norm of x, as far as it is known */
  PetscReal bound    = 0.0;         /* error that ends the solve */
  PetscReal least    = 0.0;         /* residual norm when it was last at least halved */
  PetscInt  found    = 0;           /* the iteration then */
  PetscInt  patience = 0;           /* iterations allowed until it is halved again */
  PetscBool wentOn   = PETSC_FALSE; /* because the residual was not small relative to x */
  PetscInt  solve    = 0;           /* its number among those that the viewer shows */
  Vec       work[2]  = {};          /* NULL until needed */
  /* time when this solve began, minus the time of its set-up */
  PetscLogDouble start = 0.0;
  PetscLogDouble spent = 0.0, observing = 0.0; /* seconds spent in the report and in the observer */

  /* what to restore in the KSP */
  PetscBool installed = PETSC_FALSE;
  Mat       operation = NULL, observed = NULL; /* the method's operator and its observer */
  void     *test                                                                      = NULL;
  PetscErrorCode (*converged)(KSP, PetscInt, PetscReal, KSPConvergedReason *, void *) = NULL;
  AinsworthTestDestroyFn *destroy                                                     = NULL;
};

PetscErrorCode AinsworthReportCreate(AinsworthReportSettings *, const AinsworthReportSystem *, AinsworthReport **);
PetscErrorCode AinsworthReportDestroy(AinsworthReport **);
/* start: time when the solve began, minus the seconds of its set-up */
PetscErrorCode AinsworthReportBegin(AinsworthReport *, KSP, AinsworthSaddleVec b, PetscLogDouble start);
PetscErrorCode AinsworthReportEnd(AinsworthReport *, KSP, PetscBool failed);

/*
   errors.cpp; the first gets x of an iterate of the reduced solve, which differs from the iterate if D is nonzero;
   borrowed
*/
PetscErrorCode AinsworthReportGetX(AinsworthReport *, Vec iterate, Vec *x);
PetscErrorCode AinsworthReportSizes(AinsworthReport *);
PetscErrorCode AinsworthReportResiduals(AinsworthReport *, Vec iterate, AinsworthReportRow *);
PetscErrorCode AinsworthReportTrueError(AinsworthReport *, Vec iterate, PetscReal *error);

/* stop.cpp */
PetscErrorCode AinsworthReportSetPatience(AinsworthReport *, KSP);
PetscErrorCode AinsworthEnergy(Mat A, Vec inverseDiagonal, Vec x, const Vec work[2], PetscReal *energy,
                               PetscReal *rounding);
PetscReal AinsworthResidualBound(PetscReal rtol, PetscReal z, PetscReal energy, PetscReal rounding, PetscReal first,
                                 PetscReal ritz);
/*
   Checks whether x is at least as large as z = x - R g in the energy norm, so that the latter may stand for it; start:
   (R g)' A R g, work: f' z, zAz: z' A z = f' z - (R g)' A z
*/
inline bool AinsworthIsLarge(PetscReal start, PetscReal work, PetscReal zAz)
{
  return start + 2 * work >= 2 * zAz;
}
PetscErrorCode AinsworthReportSmallestRitzValue(KSP, PetscReal *);
/*
   Decides whether the solve ends, by the result of its own convergence test and by the estimated error, both relative
   to x
*/
PetscErrorCode AinsworthReportStop(AinsworthReport *, KSP, PetscInt step, PetscReal norm, KSPConvergedReason *);

/* Viewer output: a row as soon as its error is known, all rows at the end */
PetscErrorCode AinsworthReportHeader(AinsworthReport *);
PetscErrorCode AinsworthReportPrint(AinsworthReport *, PetscBool all);
PetscErrorCode AinsworthReportDraw(AinsworthReport *);

#endif
