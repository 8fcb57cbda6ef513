/*
   Public face of ainsworth: Ainsworth's projection for saddle-point systems

       [ A  C' ] [ x ]   [ f ]
       [ C  0  ] [ l ] = [ g ]     A: n x n,  C: m x n,  m << n

   as a PETSc preconditioner (PCAINSWORTH), a matrix-free reduced operator (MATAINSWORTH)
   and a Krylov method in Ker C (KSPPROJECTEDCG); multigrid for its A, and for any other (PCBLOCKSA).
   See docs/method.md and docs/multigrid.md for the mathematics.
*/
#ifndef PETSCAINSWORTH_H
#define PETSCAINSWORTH_H

#include <petscksp.h>

#define PCAINSWORTH        "ainsworth"
#define PCBLOCKSA          "blocksa"
#define MATAINSWORTH       "ainsworth"
#define KSPPROJECTEDCG     "projectedcg"
#define KSPCHEBYSHEVSINGLE "chebyshevsingle"

/*E
   PCAinsworthVariant - the configuration of `PCAINSWORTH`: sets weight, penalty, penalty factor, row scaling and inner Krylov method at once

+  `PC_AINSWORTH_WEIGHTED` (default) - W = diag(A)^{-1}, one penalty per row, `KSPPROJECTEDCG`
-  `PC_AINSWORTH_PAPER`              - W = I, one penalty beta, `KSPCG`: Robert, Jolivet, Jamond, Badri, sections 3 and 4

   Level: intermediate

.seealso: `PCAinsworthSetVariant()`
E*/
typedef enum {
  PC_AINSWORTH_WEIGHTED,
  PC_AINSWORTH_PAPER
} PCAinsworthVariant;
PETSC_EXTERN const char *const PCAinsworthVariants[];

/*E
   MatAinsworthWeightType - the diagonal weight W of the projector

+  `MAT_AINSWORTH_WEIGHT_DIAGONAL` (default) - W = diag(A)^{-1}
.  `MAT_AINSWORTH_WEIGHT_IDENTITY`           - W = I
-  `MAT_AINSWORTH_WEIGHT_USER`               - given by `MatAinsworthSetWeight()` or `PCAinsworthSetWeight()`

   Level: intermediate

.seealso: `PCAinsworthSetWeightType()`, `MatAinsworthSetWeightType()`
E*/
typedef enum {
  MAT_AINSWORTH_WEIGHT_DIAGONAL,
  MAT_AINSWORTH_WEIGHT_IDENTITY,
  MAT_AINSWORTH_WEIGHT_USER
} MatAinsworthWeightType;
PETSC_EXTERN const char *const MatAinsworthWeightTypes[];

/*E
   PCAinsworthPenaltyType - the diagonal penalty B of the reduced operator

+  `PC_AINSWORTH_PENALTY_ROW` (default) - B_ii = gamma / (C diag(A)^{-1} C')_ii
-  `PC_AINSWORTH_PENALTY_NORM`          - B = beta I, beta = gamma ||Q_*' A Q_*||_1 / ||C' C||_1

   Level: intermediate

.seealso: `PCAinsworthSetPenaltyType()`, `PCAinsworthSetPenaltyFactor()`
E*/
typedef enum {
  PC_AINSWORTH_PENALTY_ROW,
  PC_AINSWORTH_PENALTY_NORM
} PCAinsworthPenaltyType;
PETSC_EXTERN const char *const PCAinsworthPenaltyTypes[];

/*E
   PCAinsworthPmatType - Inv(S), the sparse approximation of the inverse Gram matrix in the preconditioning matrix M_*
   (paper, Table 1)

+  `PC_AINSWORTH_PMAT_JCB`           - diagonal of the inverse 1-norms of the rows of S, or of S scaled to a unit diagonal
.  `PC_AINSWORTH_PMAT_ID`            - Inv(S) = 0, that is Q_* = I and M_* = A + C' B C
.  `PC_AINSWORTH_PMAT_CC`            - the exact inverse, by Cholesky; dense
.  `PC_AINSWORTH_PMAT_CG`            - conjugate gradients per column to a loose tolerance; entries not reached stay zero
.  `PC_AINSWORTH_PMAT_BJ_CC`         - block Jacobi, blocks cut by METIS, exact inverse in each block
.  `PC_AINSWORTH_PMAT_BJ_CG`         - block Jacobi, conjugate gradients in each block
-  `PC_AINSWORTH_PMAT_AUTO` (default) - ID with PCBLOCKSA or where the constraints keep the components of each node apart (docs/method.md), otherwise JCB

   Level: intermediate

.seealso: `PCAinsworthSetPmatType()`
E*/
typedef enum {
  PC_AINSWORTH_PMAT_JCB,
  PC_AINSWORTH_PMAT_ID,
  PC_AINSWORTH_PMAT_CC,
  PC_AINSWORTH_PMAT_CG,
  PC_AINSWORTH_PMAT_BJ_CC,
  PC_AINSWORTH_PMAT_BJ_CG,
  PC_AINSWORTH_PMAT_AUTO
} PCAinsworthPmatType;
PETSC_EXTERN const char *const PCAinsworthPmatTypes[];

/*E
   PCAinsworthRedundantType - what to do with rows of C that are linear combinations of other rows

+  `PC_AINSWORTH_REDUNDANT_DROP` (default) - they are left out; a right-hand side that contradicts them is a failure, `PC_INCONSISTENT_RHS`
-  `PC_AINSWORTH_REDUNDANT_ERROR`          - the set-up stops with an error that names them

   Level: intermediate

.seealso: `PCAinsworthSetRedundantType()`
E*/
typedef enum {
  PC_AINSWORTH_REDUNDANT_DROP,
  PC_AINSWORTH_REDUNDANT_ERROR
} PCAinsworthRedundantType;
PETSC_EXTERN const char *const PCAinsworthRedundantTypes[];

/*E
   PCAinsworthStopType - what ends the reduced solve

+  `PC_AINSWORTH_STOP_RESIDUAL` (default)  - the convergence test of the inner `KSP`, on a norm of the residual
-  `PC_AINSWORTH_STOP_ENERGY_ERROR`        - the estimated energy norm of the error

   Level: intermediate

.seealso: `PCAinsworthSetStop()`, `PCAinsworthSetErrorTolerance()`
E*/
typedef enum {
  PC_AINSWORTH_STOP_RESIDUAL,
  PC_AINSWORTH_STOP_ENERGY_ERROR
} PCAinsworthStopType;
PETSC_EXTERN const char *const PCAinsworthStopTypes[];

PETSC_EXTERN PetscErrorCode AinsworthInitializePackage(void);
PETSC_EXTERN PetscErrorCode AinsworthFinalizePackage(void);

/* The reduced operator */
PETSC_EXTERN PetscErrorCode MatCreateAinsworth(Mat, Mat, Mat *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetMats(Mat, Mat, Mat);
PETSC_EXTERN PetscErrorCode MatAinsworthGetMats(Mat, Mat *, Mat *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetWeightType(Mat, MatAinsworthWeightType);
PETSC_EXTERN PetscErrorCode MatAinsworthGetWeightType(Mat, MatAinsworthWeightType *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetWeight(Mat, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthGetWeight(Mat, Vec *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetPenalty(Mat, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthGetPenalty(Mat, Vec *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetRowsPerRank(Mat, PetscInt);
PETSC_EXTERN PetscErrorCode MatAinsworthGetGramMat(Mat, Mat *);
PETSC_EXTERN PetscErrorCode MatAinsworthGetGramKSP(Mat, KSP *);
PETSC_EXTERN PetscErrorCode MatAinsworthMultProjector(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultTransposeProjector(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultRightInverse(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultTransposeRightInverse(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthSolveRange(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthComputeRHS(Mat, Vec, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthComputeMultiplier(Mat, Vec, Vec, Vec);

/* The preconditioner */
PETSC_EXTERN PetscErrorCode PCAinsworthSetVariant(PC, PCAinsworthVariant);
PETSC_EXTERN PetscErrorCode PCAinsworthGetVariant(PC, PCAinsworthVariant *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetWeightType(PC, MatAinsworthWeightType);
PETSC_EXTERN PetscErrorCode PCAinsworthGetWeightType(PC, MatAinsworthWeightType *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetWeight(PC, Vec);
PETSC_EXTERN PetscErrorCode PCAinsworthSetPenaltyType(PC, PCAinsworthPenaltyType);
PETSC_EXTERN PetscErrorCode PCAinsworthGetPenaltyType(PC, PCAinsworthPenaltyType *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetPenaltyFactor(PC, PetscReal);
PETSC_EXTERN PetscErrorCode PCAinsworthGetPenaltyFactor(PC, PetscReal *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetPmatType(PC, PCAinsworthPmatType);
PETSC_EXTERN PetscErrorCode PCAinsworthGetPmatType(PC, PCAinsworthPmatType *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetPmatTolerance(PC, PetscReal);
PETSC_EXTERN PetscErrorCode PCAinsworthGetPmatTolerance(PC, PetscReal *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetPmatMaxRows(PC, PetscInt);
PETSC_EXTERN PetscErrorCode PCAinsworthGetPmatMaxRows(PC, PetscInt *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetBlocks(PC, PetscInt);
PETSC_EXTERN PetscErrorCode PCAinsworthGetBlocks(PC, PetscInt *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetRowScaling(PC, PetscBool);
PETSC_EXTERN PetscErrorCode PCAinsworthGetRowScaling(PC, PetscBool *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetRowsPerRank(PC, PetscInt);
PETSC_EXTERN PetscErrorCode PCAinsworthGetRowsPerRank(PC, PetscInt *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetRedundantType(PC, PCAinsworthRedundantType);
PETSC_EXTERN PetscErrorCode PCAinsworthGetRedundantType(PC, PCAinsworthRedundantType *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetCheckTranspose(PC, PetscBool);
PETSC_EXTERN PetscErrorCode PCAinsworthGetCheckTranspose(PC, PetscBool *);
PETSC_EXTERN PetscErrorCode PCAinsworthGetKSP(PC, KSP *);
PETSC_EXTERN PetscErrorCode PCAinsworthGetGramKSP(PC, KSP *);

/* Error against run time */
PETSC_EXTERN PetscErrorCode PCAinsworthSetErrorMonitor(PC, PetscViewer, PetscViewerFormat);
PETSC_EXTERN PetscErrorCode PCAinsworthGetErrorMonitor(PC, PetscViewer *, PetscViewerFormat *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetErrorMonitorResiduals(PC, PetscBool);
PETSC_EXTERN PetscErrorCode PCAinsworthGetErrorMonitorResiduals(PC, PetscBool *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetReference(PC, Vec);
PETSC_EXTERN PetscErrorCode PCAinsworthGetReference(PC, Vec *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetStop(PC, PCAinsworthStopType);
PETSC_EXTERN PetscErrorCode PCAinsworthGetStop(PC, PCAinsworthStopType *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetErrorTolerance(PC, PetscReal);
PETSC_EXTERN PetscErrorCode PCAinsworthGetErrorTolerance(PC, PetscReal *);
PETSC_EXTERN PetscErrorCode PCAinsworthSetErrorEigenvalue(PC, PetscReal);
PETSC_EXTERN PetscErrorCode PCAinsworthGetErrorEigenvalue(PC, PetscReal *);
PETSC_EXTERN PetscErrorCode PCAinsworthGetErrorEstimate(PC, PetscInt *, PetscReal *, PetscReal *);

#endif
