/* Random systems [A B'; C -D] with their dense twins, as the inner solvers get them */
#ifndef TESTS_BLOCKS_H
#define TESTS_BLOCKS_H

#include "dense.h"
#include "saddle/saddle.h"

enum {
  NO_D,
  DIAGONAL,
  COUPLED
};

/* A system, and how it is stored */
struct Kind {
  const char *name;
  bool        symmetric  = true;
  bool        definite   = true;
  bool        diagonal   = true; /* of A is stored in all rows */
  int         compliance = NO_D;
  PetscReal   decades    = 0.0; /* of the sizes of unknowns and rows, up and down */
  bool        uneven     = false;
  const char *type       = MATAIJ;
  const char *options    = "";
  bool        transpose  = true; /* the package can solve with it */
  int         steps      = 0;    /* of refinement, where the package perturbs pivots */
};

struct Blocks {
  Dense A, B, C, D;

  PetscInt n() const { return (PetscInt)A.rows(); }
  PetscInt m() const { return (PetscInt)C.rows(); }
  Dense    K() const
  {
    Dense K(n() + m(), n() + m());

    K << A, B.adjoint(), C, -D;
    return K;
  }
};

PetscScalar    Entry(PetscInt seed, PetscInt i, PetscInt j);
Blocks         Draw(const Kind &, PetscInt seed);
Column         Equilibrate(const Dense &K); /* powers of 2 that bring the largest entry of each row and column near 1 */
PetscErrorCode SaddleCreate(const Blocks &, const Kind &, AinsworthSaddle *);
PetscErrorCode VecsCreate(const AinsworthSaddle &, const Column &, AinsworthSaddleVec *);
PetscErrorCode GatherBoth(AinsworthSaddleVec, Column &);

#endif
