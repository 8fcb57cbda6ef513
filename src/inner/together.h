/* Reduced solves for several right-hand sides: conjugate gradients side by side, with products of multivectors */
#ifndef AINSWORTH_TOGETHER_H
#define AINSWORTH_TOGETHER_H

#include "solver.h"
#include "../projection/wideprojector.h"

/* One of the right-hand sides */
struct AinsworthTogetherColumn {
  AinsworthRef<Vec> g;            /* NULL for zero */
  PetscReal         energy = 0.0; /* (R g)' A R g, scaled */
  PetscReal         scale  = 1.0; /* a power of two that brings the right-hand side to about unit size */
  /* on return */
  KSPConvergedReason reason     = KSP_CONVERGED_ITERATING; /* this: it has to be solved for by itself */
  PetscInt           iterations = 0;
  PetscReal          norm       = 0.0; /* of the last residual, as the method measures it */
};

/*
   Solves with the method and the preconditioner of the inner solver, whose operators it shares, as long as these are
   not set up again
*/
class AinsworthTogether {
public:
  /*
     Checks whether the inner solver is conjugate gradients, or one application, with PCBLOCKSA and tests as by default.
     Not collective
  */
  static PetscErrorCode can(const AinsworthSolver *solver, PetscBool *can);

  PetscErrorCode create(AinsworthSolver *solver, PetscInt width);
  /* Checks whether it can solve for so many more, as nothing was set up since, and forgets the last ones */
  PetscErrorCode again(PetscInt width, PetscBool *can);
  /*
     Sets right-hand side k: that of the reduced system, which is scaled, and f and g; energy: (R g)' A R g, for g != 0.
     Collective
  */
  PetscErrorCode set(PetscInt k, Vec rhs, AinsworthSaddleVec fields, bool homogeneous, PetscReal energy);
  /*
     Solves, also for x with C x = g, and multiplies x by the program's A if there are constraints; then gets a
     solution, or a product. The first is collective
  */
  PetscErrorCode solve();
  PetscErrorCode get(PetscInt k, Vec x) const;
  PetscErrorCode getProduct(PetscInt k, Vec Ax) const;

  std::vector<AinsworthTogetherColumn> columns; /* as many as the width; those without a right-hand side are zero */

private:
  PetscErrorCode multiply(Vec x, Vec y) const;
  PetscErrorCode precondition(Vec r, Vec z) const;
  PetscErrorCode preconditionAndCorrect(Vec r, Vec z) const;
  PetscErrorCode findDeflation();
  PetscErrorCode finish();
  PetscErrorCode complete(PetscInt k, Vec v) const;
  PetscErrorCode energyOf(PetscInt k, PetscReal *energy, PetscReal *rounding);
  template <int W>
  PetscErrorCode iterate();

  AinsworthSolver *solver   = NULL;
  PetscObjectId    around   = 0; /* of the preconditioner of the method, which each set-up makes anew */
  PetscInt         width    = 1;
  bool             projects = false;
  /* for products of multivectors: A, in the form with the fastest ones, and the program's; NULL until needed */
  AinsworthRef<Mat>      A, program;
  AinsworthRef<PC>       cycle;
  AinsworthWideProjector projector;
  AinsworthRef<Vec>      x, r, p, z; /* z: A p as well; p and z: NULL until needed */
  AinsworthRef<Vec>      f;          /* NULL as long as all g are zero */
  /* what the preconditioner corrects, vector by vector; NULL: nothing */
  const AinsworthDeflation *deflation = NULL;
  AinsworthRef<Vec>         rest, v, w; /* NULL without it */
};

#endif
