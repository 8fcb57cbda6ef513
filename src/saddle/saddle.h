/* What the program passed, seen as [A C'; C 0]: the blocks, the fields of its vectors and the rows of C that are kept */
#ifndef AINSWORTH_SADDLE_H
#define AINSWORTH_SADDLE_H

#include "../petsccompat.h"

struct AinsworthSaddle {
  Mat      A, C;     /* n x n in the program's own type; m x n AIJ without zero rows, m = 0: no constraints */
  IS       rows[2];  /* primal and multiplier fields in the right-hand side, shared with the MatNest */
  IS       cols[2];  /* the same in the solution */
  IS       kept;     /* rows of the multiplier field with a nonzero row of C, relative to the field; NULL: all */
  PetscInt zeroRows; /* number of rows of C that are zero and therefore dropped */
  PetscInt primal;   /* position of the primal field in the MatNest, 0 or 1 */
  Mat      source;   /* the matrix that C was made from, or of which the program's block is a view */

  PetscObjectState stateA, stateSource; /* states at set-up, to see what changed since */
};

PetscErrorCode AinsworthGetAIJ(Mat, Mat *);
PetscErrorCode AinsworthSaddleSetUp(Mat, AinsworthSaddle *);
PetscErrorCode AinsworthSaddleReset(AinsworthSaddle *);
PetscErrorCode AinsworthSaddleChanged(Mat, const AinsworthSaddle *, PetscBool *, PetscBool *);
PetscErrorCode AinsworthSaddleGetNearNullSpace(const AinsworthSaddle *, MatNullSpace *);
PetscErrorCode AinsworthSaddleCreateNullSpace(const AinsworthSaddle *, MatNullSpace *);

#endif
