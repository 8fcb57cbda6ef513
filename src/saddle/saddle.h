/* What the program passed, seen as [A B'; C -D]: the blocks, the fields of its vectors and what becomes of each row of C */
#ifndef AINSWORTH_SADDLE_H
#define AINSWORTH_SADDLE_H

#include "saddlevec.h"
#include "layout.h"

/* What becomes of a row of the multiplier field, C_i x - (D lambda)_i = g_i */
typedef enum {
  AINSWORTH_ROW_CONSTRAINT, /* kept */
  AINSWORTH_ROW_ZERO,       /* nothing in its row: left out, lambda_i = 0 */
  AINSWORTH_ROW_DECOUPLED,  /* nothing but D_ii in its row: lambda_i = -g_i / D_ii, what it does in other rows goes to the right-hand side */
  AINSWORTH_ROW_PASSIVE,    /* nothing but D_ii in its column: lambda_i follows from x and the other multipliers */
  AINSWORTH_ROW_DEPENDENT,  /* C_i is a combination of rows that are kept: left out, lambda_i = 0 */
  AINSWORTH_ROW_KINDS
} AinsworthRowKind;

/* The blocks of [A B; C D] in the program's matrix, and the primal block of Pmat, that M_* is made of: A itself where there is none */
enum {
  AINSWORTH_BLOCK_A,
  AINSWORTH_BLOCK_B,
  AINSWORTH_BLOCK_C,
  AINSWORTH_BLOCK_D,
  AINSWORTH_BLOCK_P,
  AINSWORTH_BLOCKS
};
struct AinsworthSaddleBlocks {
  MatType   layout;                     /* type of the matrix it was found in; NULL: nothing found yet */
  Mat       block[AINSWORTH_BLOCKS];    /* the program's or made of them, NULL where absent; B or C may be a view of the other, A a copy of a small shell */
  char      name[AINSWORTH_BLOCKS][64]; /* for messages: "Block (1,0) of the MatNest" */
  uint64_t  state[AINSWORTH_BLOCKS];    /* changes when the block, its values or those of anything that it is made of do (state.cpp) */
  IS        rows[2];                    /* primal and multiplier fields in the right-hand side */
  IS        cols[2];                    /* the same in the solution */
  PetscBool made[AINSWORTH_BLOCKS];     /* the block is not the program's */
  PetscInt  bs;                         /* block size of A, which A itself may not know */
  PetscInt  scattered;                  /* unknowns of a node where these are not next to each other, which PCBLOCKSA sorts; 1: bs says it */

  const char       *bsSource;   /* how it is known */
  MatNullSpace      modes;      /* rigid-body modes from coordinates; NULL: none were given */
  PetscInt          located;    /* which coordinates */
  AinsworthFields   fields;     /* of the program's vectors */
  const char       *told;       /* who named them */
  std::vector<bool> multiplier; /* which of them are the multipliers' */
  const char       *chosen;     /* how that is known */
  Vec               sign;       /* of minus a saddle point what the rows of A are multiplied by, see layoutsign.cpp; NULL: it is none */
  PetscBool         extracted;  /* the blocks are submatrices; otherwise they are those of a MatNest */
  PetscObjectId     whole[2];   /* what they were extracted from, Amat and Pmat */
  PetscObjectState  pattern[2]; /* its nonzero state */

  std::shared_ptr<const AinsworthSplit> split[2]; /* how; NULL: by MatCreateSubMatrix() */
};

/*
   The normal form [A B'; C -D] of what the program passed (docs/method.md). Where its block (0,1) is -C', lambda is the negative of the program's

   B is C itself where block (0,1) is its adjoint; D is NULL where it is zero.
*/
struct AinsworthSaddle : AinsworthSaddleBlocks {
  Mat A;                   /* n x n: the program's, or without the columns of unknowns that are known */
  Mat P;                   /* what M_* is made of, the primal block of Pmat: A itself where there is none */
  Mat C, B, D;             /* AIJ, of the rows that are kept, times balance; none: no constraints */
  Mat rowsC, rowsB, rowsD; /* the same with all of the program's rows */
  Mat givenC;              /* rowsC with the columns of known unknowns */

  PetscObjectId    idD;      /* of the block that rowsD is a copy of */
  PetscObjectState patternD; /* of that */

  MatNullSpace whole;     /* null space of the program's matrix, NULL where it has none */
  Mat          numbering; /* that matrix */
  PetscBool    negated;   /* lambda is the negative of the program's */
  char         bad[256];  /* what makes the values unusable, empty where nothing does */

  AinsworthRowKind *kind;                       /* of each local row of the multiplier field */
  PetscInt          first;                      /* global number of the first of them */
  PetscInt          local;                      /* their number */
  PetscInt          count[AINSWORTH_ROW_KINDS]; /* on all ranks */
  PetscBool         nearly;    /* some dependent rows are so only to the digits of the Gram matrix: what contradicts them may have a solution */
  Vec               balance;   /* of the rows of C, B and D, and the columns of D, powers of 2; NULL: 1 */
  Vec               known;     /* n, 1 / A_ii where nothing but A_ii is in the row of an unknown, else 0; NULL: none matters */
  Vec               work[2];   /* n and all rows; NULL: not needed yet */
  Mat               absolute;  /* |C|, entry by entry, with all of its rows; NULL: not needed yet */
  mutable Vec       stiffness; /* AinsworthTermsStiffness(); NULL: not needed yet */
};

/* arrays.cpp */
PetscErrorCode AinsworthGetDiagonal(Mat, Vec);
PetscErrorCode AinsworthAbsoluteMult(Mat, Vec, Vec);

/* aij.cpp */
PetscErrorCode AinsworthFindOpaque(Mat, Mat *);
PetscErrorCode AinsworthGetTransposed(Mat, Mat *, PetscBool *);
PetscErrorCode AinsworthCheckEntries(Mat, const char[], const char[], PetscBool *);
PetscErrorCode AinsworthGetAIJ(Mat, Mat *);
PetscErrorCode AinsworthCreateAIJ(MPI_Comm, PetscInt, const AinsworthEntries &, Mat *);
PetscErrorCode AinsworthCopyNullSpaces(Mat, Mat);
PetscErrorCode AinsworthAbsoluteAIJ(Mat, Mat *);
PetscErrorCode AinsworthRowSums(Mat, int, Vec);
PetscErrorCode AinsworthCountRows(Mat, PetscInt, Vec *);
PetscErrorCode AinsworthSampleRows(Mat, PetscInt, PetscInt, PetscInt, IS *, PetscInt *);
PetscErrorCode AinsworthScaleColumns(Mat, Vec, Mat *);
PetscErrorCode AinsworthRowSquares(Mat, Vec, Vec);
PetscErrorCode AinsworthFormValue(Mat, Vec, PetscReal *);

/* sum.cpp */
PetscErrorCode AinsworthAddAIJ(PetscScalar, const std::vector<Mat> &, Mat *);
PetscErrorCode AinsworthMakePatternSymmetric(Mat *);

/* flat.cpp */
PetscErrorCode AinsworthVecGetFlat(Mat, PetscBool, Vec, Vec *);
PetscErrorCode AinsworthVecRestoreFlat(Mat, PetscBool, Vec, PetscBool, Vec *);
PetscErrorCode AinsworthCreateDiagonal(Mat, Vec *);
PetscErrorCode AinsworthVecGather(Vec, PetscInt, const PetscInt[], Vec *);

/* nodes.cpp */
PetscErrorCode AinsworthFindNodes(Mat, PetscInt *, std::vector<PetscInt> *);

/* merge.cpp */
PetscErrorCode AinsworthMergeAIJ(MPI_Comm, const std::vector<IS> &, const std::vector<IS> &, const std::vector<Mat> &, Mat *);

/* blocks.cpp, state.cpp: what the program passed, and whether it is what it was */
PetscErrorCode AinsworthSaddleFindBlocks(const AinsworthSaddleInputs *, PetscBool, const AinsworthSaddleBlocks *, AinsworthSaddleBlocks *);
PetscErrorCode AinsworthSaddleResetBlocks(AinsworthSaddleBlocks *);
PetscErrorCode AinsworthSaddleDescribeLayout(const AinsworthSaddleBlocks *, char[], size_t);
PetscErrorCode AinsworthCheckAssembled(Mat, const char[]);
PetscErrorCode AinsworthBlockNorm(Mat, PetscReal *);
uint64_t       AinsworthMixState(uint64_t, uint64_t);
PetscErrorCode AinsworthMatGetState(Mat, uint64_t *);
PetscErrorCode AinsworthSaddleChanged(const AinsworthSaddleInputs *, const AinsworthSaddle *, PetscBool *);

PetscErrorCode AinsworthSaddleSetUp(const AinsworthSaddleInputs *, AinsworthSaddle *);
PetscErrorCode AinsworthSaddleReset(AinsworthSaddle *);

/* coordinates.cpp */
PetscErrorCode AinsworthSaddleDescribeModes(const AinsworthSaddle *, char[], size_t);

/* nullspace.cpp */
PetscErrorCode AinsworthSaddleAttachNearNullSpace(const AinsworthSaddleBlocks *, Mat);
PetscErrorCode AinsworthSaddleGetNearNullSpace(const AinsworthSaddle *, MatNullSpace *);
PetscErrorCode AinsworthSaddleCreateNullSpace(const AinsworthSaddle *, MatNullSpace *);
PetscErrorCode AinsworthSaddleRemoveDualNullSpace(const AinsworthSaddle *, Vec);
PetscErrorCode AinsworthSaddleGetWhole(Mat, Mat, MatNullSpace *);
PetscErrorCode AinsworthSaddleRemoveNullSpace(const AinsworthSaddle *, Mat, PetscBool, AinsworthSaddleVec, PetscBool *);

/* rows.cpp: the rows of the multiplier field */
PetscErrorCode AinsworthSaddleClassifyRows(AinsworthSaddle *);
PetscErrorCode AinsworthSaddleDropDependent(AinsworthSaddle *, PetscInt, const PetscInt[]);
PetscErrorCode AinsworthSaddleNameRows(const AinsworthSaddle *, const std::vector<bool> &, char[], size_t);
PetscErrorCode AinsworthSaddleNameKind(const AinsworthSaddle *, AinsworthRowKind, char[], size_t);
PetscErrorCode AinsworthSaddleNameKept(const AinsworthSaddle *, PetscInt, const PetscInt[], char[], size_t);
PetscErrorCode AinsworthSaddleDescribeRows(const AinsworthSaddle *, char[], size_t);

/* symmetry.cpp */
PetscErrorCode AinsworthProbeSymmetry(Mat, PetscBool *);

/* check.cpp: values of the blocks, and whether block (0,1) is the adjoint of C */
PetscErrorCode AinsworthAgreeOnFirst(MPI_Comm, PetscInt *);
PetscErrorCode AinsworthMatEqual(Mat, Mat, PetscBool *);
PetscErrorCode AinsworthMatFindNonzero(Mat, PetscInt *, PetscInt *);
PetscErrorCode AinsworthMatFindNotFinite(Mat, PetscInt *, PetscInt *);
PetscErrorCode AinsworthMatFindOffDiagonal(Mat, PetscInt *, PetscInt *);
PetscErrorCode AinsworthProbeAdjoint(Mat, Mat, PetscBool *, PetscBool *);

/* known.cpp: unknowns that their own row determines */
PetscErrorCode AinsworthSaddleFindKnown(AinsworthSaddle *);
PetscErrorCode AinsworthSaddleMoveColumns(const AinsworthSaddle *, Vec, Vec, Vec, Vec, Vec);
PetscErrorCode AinsworthSaddleSetKnown(const AinsworthSaddle *, Vec, Vec);

/* fields.cpp: right-hand sides and solutions between the program's fields and what is kept */
PetscErrorCode AinsworthSaddleRestrict(AinsworthSaddle *, AinsworthSaddleVec, AinsworthSaddleVec);
PetscErrorCode AinsworthSaddleExtend(AinsworthSaddle *, AinsworthSaddleVec, Vec, AinsworthSaddleVec);
PetscErrorCode AinsworthSaddleNameNotFinite(const AinsworthSaddle *, AinsworthSaddleVec, char[], size_t);

/* residual.cpp: the row with the largest quotient of its residual and what is allowed, above 1 where it is not met; size: what its terms amount to */
struct AinsworthUnmet {
  PetscReal quotient = 0.0, residual = 0.0, size = 0.0;
  PetscInt  row = -1;
};
PetscErrorCode AinsworthSaddleResidual(const AinsworthSaddle *, PetscBool, PetscBool, AinsworthSaddleVec, AinsworthSaddleVec, Vec, AinsworthSaddleVec);
PetscErrorCode AinsworthSaddleCheckPrimal(const AinsworthSaddle *, PetscBool, PetscBool, PetscReal, PetscReal, Vec, AinsworthSaddleVec, Vec, Vec,
                                          AinsworthUnmet *);
PetscErrorCode AinsworthSaddleBackwardError(AinsworthSaddle *, PetscBool, PetscReal, AinsworthSaddleVec, AinsworthSaddleVec, Vec, AinsworthSaddleVec,
                                            AinsworthSaddleVec, PetscReal *);
PetscErrorCode AinsworthSaddleIsVacuous(AinsworthSaddle *, AinsworthSaddleVec, AinsworthSaddleVec, PetscBool *);
PetscErrorCode AinsworthSaddleEnergy(const AinsworthSaddle *, AinsworthSaddleVec, Vec, PetscReal *);
PetscErrorCode AinsworthSaddleCheckDual(AinsworthSaddle *, PetscReal, PetscReal, Vec, Vec, AinsworthSaddleVec, Vec, AinsworthUnmet *, char[], size_t, Vec *);

#endif
