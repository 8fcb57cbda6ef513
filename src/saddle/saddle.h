/* The program's system in the form [A B'; C -D]: blocks, fields of its vectors, and how each row of C is treated */
#ifndef AINSWORTH_SADDLE_H
#define AINSWORTH_SADDLE_H

#include "../base/matrices.h"
#include "facts.h"
#include "layout.h"
#include "transfer.h"

/* How a row of the multiplier field, C_i x - (D lambda)_i = g_i, is treated */
typedef enum {
  AINSWORTH_ROW_CONSTRAINT, /* kept */
  AINSWORTH_ROW_ZERO,       /* its row is empty: dropped, lambda_i = 0 */
  AINSWORTH_ROW_DECOUPLED,  /* its row has only D_ii: lambda_i = -g_i / D_ii; its column moves to the right-hand side */
  AINSWORTH_ROW_PASSIVE,    /* its column has only D_ii: lambda_i follows from x and the other multipliers */
  AINSWORTH_ROW_DEPENDENT,  /* C_i is a combination of kept rows: dropped, lambda_i = 0 */
  AINSWORTH_ROW_NEAR,       /* as good as one, to the digits of the Gram matrix: dropped, lambda_i = 0 */
  AINSWORTH_ROW_KINDS
} AinsworthRowKind;

/*
   The blocks of the program's matrix [A B; C D], and the primal block P of Pmat, which M_* is made of; P is A if Pmat
   has none
*/
enum {
  AINSWORTH_BLOCK_A,
  AINSWORTH_BLOCK_B,
  AINSWORTH_BLOCK_C,
  AINSWORTH_BLOCK_D,
  AINSWORTH_BLOCK_P,
  AINSWORTH_BLOCKS
};
/* For each block, whether its rows, or its columns, belong to the multipliers */
constexpr int AinsworthBlockRow[] = {0, 0, 1, 1, 0}, AinsworthBlockColumn[] = {0, 1, 0, 1, 0};
struct AinsworthSaddleBlocks {
  const struct AinsworthSaddleLayout *layout = NULL; /* NULL: none found yet */
  MatType                             type   = NULL; /* of the matrix that has the blocks */
  /* the program's or made from them, NULL if absent; B or C may be a view of the other, A a copy of a small shell */
  AinsworthRef<Mat> block[AINSWORTH_BLOCKS];
  char              name[AINSWORTH_BLOCKS][64]{}; /* for messages: "Block (1,0) of the MatNest" */
  /* changes with the block, its values, or anything it is made of (state.cpp) */
  uint64_t         state[AINSWORTH_BLOCKS] = {};
  AinsworthRef<IS> rows[2];                     /* primal and multiplier field in the right-hand side */
  AinsworthRef<IS> cols[2];                     /* the same in the solution */
  PetscBool        made[AINSWORTH_BLOCKS] = {}; /* the block was made here */
  PetscInt         bs                     = 0;  /* block size of A, which A itself may not have */
  /* unknowns of a node if they are not contiguous (PCBLOCKSA sorts them); else 1, and bs holds */
  PetscInt scattered = 0;

  const char                *bsSource = NULL;  /* where bs comes from, in words */
  AinsworthRef<MatNullSpace> modes;            /* rigid-body modes from coordinates, or NULL */
  PetscInt                   located = 0;      /* AinsworthSaddleInputs::located at that time */
  AinsworthFields            fields;           /* of the program's vectors */
  const char                *definedBy = NULL; /* who defined the fields, in words */
  std::vector<bool>          multiplier;       /* for each field: whether it has multipliers */
  const char                *chosen = NULL;    /* how the multipliers were chosen, in words */
  const char                *blame  = "";      /* for messages: the option that chose them */
  /* for minus a saddle point, the factors of the rows of A (layoutsign.cpp); else NULL */
  AinsworthRef<Vec> sign;
  PetscBool         extracted  = PETSC_FALSE; /* blocks are submatrices; otherwise they are blocks of a MatNest */
  PetscObjectId     whole[2]   = {};          /* ids of the matrices they were extracted from, Amat and Pmat */
  PetscObjectState  pattern[2] = {};          /* nonzero states of these */

  std::shared_ptr<const AinsworthSplit> split[2]; /* how they were extracted; NULL: with MatCreateSubMatrix() */
};

/* Rows of the multipliers, AIJ; B is C itself if block (0,1) is its adjoint, and D is NULL if it is zero */
struct AinsworthRowBlocks {
  AinsworthRef<Mat> C, B, D;
};

/*
   The normal form [A B'; C -D] of the program's system (docs/method.md), constant once it is built; if its block (0,1)
   is -C', lambda is the negative of the program's
*/
struct AinsworthSaddle : AinsworthSaddleBlocks {
  AinsworthRef<Mat>  A;    /* n x n: the program's, or a copy without the columns of known unknowns */
  AinsworthRef<Mat>  P;    /* matrix that M_* is made of: the primal block of Pmat, or A */
  AinsworthRowBlocks all;  /* all rows of the program */
  AinsworthRowBlocks kept; /* those that are constraints, without the columns of known unknowns, scaled by `balance` */

  PetscObjectId    idD      = 0; /* id of the block that all.D is a copy of */
  PetscObjectState patternD = 0; /* nonzero state of that block */

  AinsworthRef<MatNullSpace> nullSpace;              /* of the program's matrix, or NULL */
  PetscBool                  negated  = PETSC_FALSE; /* lambda is the negative of the program's */
  char                       bad[256] = {};          /* why the values are unusable; empty if they are usable */

  std::vector<AinsworthRowKind> kind;                            /* of each local row of the multiplier field */
  PetscInt                      first                      = 0;  /* global number of the first local row */
  PetscInt                      count[AINSWORTH_ROW_KINDS] = {}; /* of each kind, on all ranks */
  /* scales the rows of C, B and D and the columns of D, powers of 2; NULL: 1 */
  AinsworthRef<Vec> balance;
  /* n, 1 / A_ii for unknowns whose row has only A_ii, else 0; NULL if not needed */
  AinsworthRef<Vec> known;
  AinsworthRef<Vec> work[2];                /* work vectors, n and all rows */
  std::vector<bool> loose;                  /* for each local unknown: its row of A is zero */
  PetscBool         positive = PETSC_FALSE; /* unknowns that are not loose have positive diagonal entries in A */
  /* for each local row of the multiplier field: its row of D is not zero */
  std::vector<bool> sprung;
  /* of each unknown: A_ii or, where that is not positive, the largest entry of the row */
  AinsworthRef<Vec> stiffness;
  AinsworthTransfer transfer[2]; /* of right-hand sides and solutions */
  /* powers of 2 that bring entries of the system to about 1: of the unknowns and of all rows of the multiplier field */
  AinsworthSaddleVecRef scale;
  PetscBool             symmetric = PETSC_FALSE; /* A = A' */
  PetscBool             adjoint   = PETSC_FALSE; /* B is C, and D = D' */

  PetscInt local() const { return (PetscInt)kind.size(); }                 /* local rows of the multiplier field */
  PetscInt constraints() const { return count[AINSWORTH_ROW_CONSTRAINT]; } /* kept rows of all ranks */
  bool     oneSided() const { return kept.B == kept.C; }                   /* block (0,1) is C' */
};

/* diagonal.cpp */
PetscErrorCode AinsworthRememberDiagonal(Mat, AinsworthRef<Vec>);
PetscErrorCode AinsworthGetDiagonal(Mat, Vec);
PetscErrorCode AinsworthCreateDiagonal(Mat, Vec *);

/* state.cpp */
PetscErrorCode AinsworthMatGetState(Mat, uint64_t *);

/* blocks.cpp: the blocks of what the program passed */
PetscErrorCode AinsworthSaddleFindBlocks(const AinsworthSaddleInputs *, PetscBool, const AinsworthSaddleBlocks *,
                                         AinsworthSaddleBlocks *);
PetscErrorCode AinsworthSaddleDescribeLayout(const AinsworthSaddleBlocks *, char[], size_t);

/* saddle.cpp */
typedef std::unique_ptr<const AinsworthSaddle> AinsworthSaddleStage;
PetscErrorCode AinsworthSaddleChanged(const AinsworthSaddleInputs *, const AinsworthSaddle *, PetscBool *);
PetscErrorCode AinsworthSaddleBuild(const AinsworthSaddleInputs *, AinsworthSaddleStage, AinsworthSaddleStage *);

/* nearnullspace.cpp */
PetscErrorCode AinsworthSaddleAttachNearNullSpace(const AinsworthSaddleBlocks *, Mat);
PetscErrorCode AinsworthSaddleGetNearNullSpace(const AinsworthSaddleBlocks *, MatNullSpace *);
PetscErrorCode AinsworthSaddleDescribeModes(const AinsworthSaddle *, char[], size_t);

/* nullspace.cpp */
PetscErrorCode AinsworthOrthogonalize(const std::vector<Vec> &, Vec);
PetscErrorCode AinsworthSaddleCreateNullSpace(const AinsworthSaddle *, MatNullSpace *);
PetscErrorCode AinsworthSaddleRemoveDualNullSpace(const AinsworthSaddle *, Vec);
PetscErrorCode AinsworthSaddleGetNullSpace(Mat, Mat, MatNullSpace *);
PetscErrorCode AinsworthSaddleRemoveNullSpace(const AinsworthSaddle *, Mat, PetscBool, AinsworthSaddleVec, PetscBool *);

/* rows.cpp: the rows of the multiplier field */
PetscErrorCode AinsworthSaddleClassifyRows(AinsworthSaddle *);
PetscErrorCode AinsworthSaddleDropDependent(AinsworthSaddleStage *, PetscInt, const PetscInt[], AinsworthRowKind);
PetscErrorCode AinsworthNameMarked(MPI_Comm, PetscInt, const std::vector<bool> &, char[], size_t);
PetscErrorCode AinsworthSaddleNameRows(const AinsworthSaddle *, const std::vector<bool> &, char[], size_t);
PetscErrorCode AinsworthSaddleNameKind(const AinsworthSaddle *, AinsworthRowKind, char[], size_t);
PetscErrorCode AinsworthSaddleNameKept(const AinsworthSaddle *, PetscInt, const PetscInt[], char[], size_t);
PetscErrorCode AinsworthSaddleDescribeRows(const AinsworthSaddle *, char[], size_t);

/* unused.cpp: unknowns in no equation */
PetscErrorCode AinsworthSaddleNameUnused(const AinsworthSaddle *, PetscBool, char[], char[], size_t);

/* check.cpp: searches for entries, comparisons of blocks */
PetscErrorCode AinsworthCheckAssembled(Mat, const char[]);
PetscErrorCode AinsworthIsZero(Mat, PetscBool *);
PetscErrorCode AinsworthAgreeOnFirst(MPI_Comm, PetscInt *);
PetscErrorCode AinsworthMatEqual(Mat, Mat, PetscBool *);
typedef bool   AinsworthIsWanted(PetscInt, PetscInt, PetscScalar); /* row, column and value of an entry */
PetscErrorCode AinsworthMatFindEntry(Mat, AinsworthIsWanted *, PetscInt *, PetscInt *);
inline bool    AinsworthIsNonzero(PetscInt, PetscInt, PetscScalar v)
{
  return v != 0.0;
}
inline bool AinsworthIsNotFinite(PetscInt, PetscInt, PetscScalar v)
{
  return PetscIsInfOrNanScalar(v);
}
PetscErrorCode AinsworthProbeAdjoint(Mat, Mat, PetscBool *, PetscBool *);

/* known.cpp: unknowns determined by their own row */
PetscErrorCode AinsworthSaddleFindKnown(AinsworthSaddle *);
PetscErrorCode AinsworthSaddleMoveColumns(const AinsworthSaddle *, Vec, Vec, Vec, Vec, Vec);
PetscErrorCode AinsworthSaddleClearKnown(const AinsworthSaddle *, Vec);

/* fields.cpp: right-hand sides and solutions, between the program's vectors, its fields and the kept rows */
typedef std::function<PetscErrorCode(AinsworthSaddleVec)> AinsworthFieldsUse;
PetscErrorCode AinsworthSaddleUseFields(const AinsworthSaddle *, PetscBool, AinsworthAccess, Vec,
                                        const AinsworthFieldsUse &);
PetscErrorCode AinsworthSaddleGetKept(const AinsworthSaddle *, Vec, Vec);
PetscErrorCode AinsworthSaddleRestrict(const AinsworthSaddle *, AinsworthSaddleVec, AinsworthSaddleVec);
PetscErrorCode AinsworthSaddleExtend(const AinsworthSaddle *, AinsworthSaddleVec, Vec, AinsworthSaddleVec);
PetscErrorCode AinsworthSaddleNameNotFinite(const AinsworthSaddle *, AinsworthSaddleVec, char[], size_t);

/* residual.cpp: of the program's system, and the terms of its rows */
PetscErrorCode AinsworthSaddleResidual(const AinsworthSaddle *, PetscBool, PetscBool, AinsworthSaddleVec,
                                       AinsworthSaddleVec, Vec, AinsworthSaddleVec);
PetscErrorCode AinsworthSaddleMult(const AinsworthSaddle *, PetscBool, AinsworthSaddleVec, Vec, AinsworthSaddleVec);
PetscErrorCode AinsworthSaddlePrimalTerms(const AinsworthSaddle *, PetscBool, AinsworthSaddleVec, AinsworthSaddleVec,
                                          Vec, Vec);
PetscErrorCode AinsworthSaddleDualTerms(const AinsworthSaddle *, AinsworthSaddleVec, AinsworthSaddleVec, Vec);

/* Returns a residual relative to the terms of its row; infinite if either is NaN or the terms overflow */
inline PetscReal AinsworthQuotient(PetscReal residual, PetscReal terms)
{
  if (residual == 0.0) return 0.0;
  const PetscReal quotient = residual / terms;
  return quotient >= 0.0 && !PetscIsInfOrNanReal(terms) ? PetscMin(quotient, PETSC_MAX_REAL) : PETSC_MAX_REAL;
}

/* Rows that others imply, or that are zero, are left out: no solution can change what they are left with */
inline bool AinsworthSaddleIsLeftOut(const AinsworthSaddle *sp, PetscInt i)
{
  return sp->kind[i] == AINSWORTH_ROW_DEPENDENT || sp->kind[i] == AINSWORTH_ROW_NEAR ||
         sp->kind[i] == AINSWORTH_ROW_ZERO;
}

/* scale.cpp */
PetscErrorCode AinsworthSaddleScale(AinsworthSaddle *);

#endif
