/* What the program passed, seen as [A C'; C 0]: the blocks, the fields of its vectors and what becomes of each row of C */
#ifndef AINSWORTH_SADDLE_H
#define AINSWORTH_SADDLE_H

#include "../petsccompat.h"

/* What becomes of a row of the multiplier field, C_i x + d_i lambda_i = g_i */
typedef enum {
  AINSWORTH_ROW_CONSTRAINT, /* d_i = 0: kept */
  AINSWORTH_ROW_ZERO,       /* C_i = 0, d_i = 0: left out, lambda_i = 0 */
  AINSWORTH_ROW_DECOUPLED,  /* C_i = 0: lambda_i = g_i / d_i */
  AINSWORTH_ROW_PENALISED,  /* d_i < 0: lambda_i is eliminated, A gains C_i' C_i / |d_i| */
  AINSWORTH_ROW_DEPENDENT,  /* C_i is a combination of rows that are kept: left out, lambda_i = 0 */
  AINSWORTH_ROW_KINDS
} AinsworthRowKind;

struct AinsworthSaddle {
  Mat       A;        /* n x n: the program's, or with the eliminated rows added */
  Mat       C;        /* rows that are kept, AIJ; none: no constraints */
  IS        rows[2];  /* primal and multiplier fields in the right-hand side, shared with the MatNest */
  IS        cols[2];  /* the same in the solution */
  PetscInt  primal;   /* position of the primal field in the MatNest, 0 or 1 */
  PetscBool negated;  /* block (0,1) is -C': lambda changes its sign */
  char      bad[256]; /* what makes the values unusable, empty where nothing does */

  AinsworthRowKind *kind;                       /* of each local row of the multiplier field */
  PetscScalar      *diag;                       /* d_i of each, NULL where all are zero */
  PetscInt          first;                      /* global number of the first of them */
  PetscInt          local;                      /* their number */
  PetscInt          count[AINSWORTH_ROW_KINDS]; /* on all ranks */
  Mat               all;                        /* C with all of its rows, NULL where all are kept */
  Mat               left[AINSWORTH_ROW_KINDS];  /* the rows of C that are penalised or dependent, NULL where none are */
  Vec               part[AINSWORTH_ROW_KINDS];  /* a vector of their layout each */
  Mat               absolute;                   /* |C|, entry by entry, with all of its rows; NULL: not needed yet */

  Mat              block[4]; /* the program's A, D, (1,0) and (0,1), to see what changed since; a transpose view stands for its source */
  PetscObjectState state[4];
};

PetscErrorCode AinsworthGetAIJ(Mat, Mat *);
PetscErrorCode AinsworthAbsoluteAIJ(Mat, Mat *);
PetscErrorCode AinsworthRowSums(Mat, int, Vec);
PetscErrorCode AinsworthSaddleSetUp(Mat, AinsworthSaddle *);
PetscErrorCode AinsworthSaddleReset(AinsworthSaddle *);
PetscErrorCode AinsworthSaddleChanged(Mat, const AinsworthSaddle *, PetscBool *);
PetscErrorCode AinsworthSaddleGetNearNullSpace(const AinsworthSaddle *, MatNullSpace *);
PetscErrorCode AinsworthSaddleCreateNullSpace(const AinsworthSaddle *, MatNullSpace *);

/* rows.cpp: the rows of C */
PetscErrorCode AinsworthSaddleClassifyRows(AinsworthSaddle *, Mat);
PetscErrorCode AinsworthSaddleDropDependent(AinsworthSaddle *, PetscInt, const PetscInt[]);
PetscErrorCode AinsworthSaddleNameRows(const AinsworthSaddle *, const PetscBool[], char[], size_t);
PetscErrorCode AinsworthSaddleDescribeRows(const AinsworthSaddle *, char[], size_t);

/* symmetry.cpp */
PetscErrorCode AinsworthProbeSymmetry(Mat, PetscBool *);

/* check.cpp: values and symmetry of the blocks */
PetscErrorCode AinsworthMatFindNotFinite(Mat, PetscInt *, PetscInt *);
PetscErrorCode AinsworthMatFindOffDiagonal(Mat, PetscInt *, PetscInt *);
PetscErrorCode AinsworthMatFindDifference(Mat, Mat, PetscInt *, PetscInt *, PetscReal[2]);
PetscErrorCode AinsworthProbeAdjoint(Mat, Mat, PetscBool *, PetscBool *);

/* fields.cpp: right-hand sides and solutions between the program's fields and what is kept */
PetscErrorCode AinsworthSaddleRestrict(const AinsworthSaddle *, Vec, Vec, Vec, Vec);
PetscErrorCode AinsworthSaddleExtend(const AinsworthSaddle *, Vec, Vec, Vec, Vec);

/* residual.cpp: the row with the largest quotient of its residual and what is allowed, above 1 where it is not met; size: what its terms amount to */
struct AinsworthUnmet {
  PetscReal quotient = 0.0, residual = 0.0, size = 0.0;
  PetscInt  row = -1;
};
PetscErrorCode AinsworthSaddleResidual(const AinsworthSaddle *, PetscBool, Vec, Vec, Vec, Vec, Vec, Vec, Vec);
PetscErrorCode AinsworthSaddleCheckPrimal(const AinsworthSaddle *, PetscBool, PetscReal, Vec, Vec, Vec, Vec, Vec, AinsworthUnmet *);
PetscErrorCode AinsworthSaddleCheckDual(AinsworthSaddle *, Vec, Vec, Vec, Vec, AinsworthUnmet *, char[], size_t);

#endif
