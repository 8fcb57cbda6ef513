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

/* CMake and packages take the version from here */
#define AINSWORTH_VERSION_MAJOR    0
#define AINSWORTH_VERSION_MINOR    2
#define AINSWORTH_VERSION_SUBMINOR 0
#define AINSWORTH_VERSION_GE(MAJOR, MINOR, SUBMINOR) \
  (AINSWORTH_VERSION_MAJOR * 10000 + AINSWORTH_VERSION_MINOR * 100 + AINSWORTH_VERSION_SUBMINOR >= (MAJOR)*10000 + (MINOR)*100 + (SUBMINOR))

#define PCAINSWORTH        "ainsworth"
#define PCBLOCKSA          "blocksa"
#define MATAINSWORTH       "ainsworth"
#define KSPPROJECTEDCG     "projectedcg"
#define KSPCHEBYSHEVSINGLE "chebyshevsingle"

#define SNESAINSWORTHACTIVESET "ainsworthactiveset"

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

.seealso: `MatAinsworthSetWeightType()`, `PCAinsworthSetWeight()`
E*/
typedef enum {
  MAT_AINSWORTH_WEIGHT_DIAGONAL,
  MAT_AINSWORTH_WEIGHT_IDENTITY,
  MAT_AINSWORTH_WEIGHT_USER
} MatAinsworthWeightType;
PETSC_EXTERN const char *const MatAinsworthWeightTypes[];

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

PETSC_EXTERN PetscErrorCode AinsworthInitializePackage(void);
PETSC_EXTERN PetscErrorCode AinsworthFinalizePackage(void);

/* The reduced operator */
PETSC_EXTERN PetscErrorCode MatCreateAinsworth(Mat, Mat, Mat *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetMats(Mat, Mat, Mat);
PETSC_EXTERN PetscErrorCode MatAinsworthGetMats(Mat, Mat *, Mat *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetWeightType(Mat, MatAinsworthWeightType);
PETSC_EXTERN PetscErrorCode MatAinsworthSetWeight(Mat, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthSetPenalty(Mat, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthGetPenalty(Mat, Vec *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetRowsPerRank(Mat, PetscInt);
PETSC_EXTERN PetscErrorCode MatAinsworthGetGramKSP(Mat, KSP *);
PETSC_EXTERN PetscErrorCode MatAinsworthMultProjector(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultTransposeProjector(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultRightInverse(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultTransposeRightInverse(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthComputeRHS(Mat, Vec, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthComputeMultiplier(Mat, Vec, Vec, Vec);

/* The preconditioner */
PETSC_EXTERN PetscErrorCode PCAinsworthSetVariant(PC, PCAinsworthVariant);
PETSC_EXTERN PetscErrorCode PCAinsworthSetWeight(PC, Vec);
PETSC_EXTERN PetscErrorCode PCAinsworthSetPmatType(PC, PCAinsworthPmatType);
PETSC_EXTERN PetscErrorCode PCAinsworthGetKSP(PC, KSP *);
PETSC_EXTERN PetscErrorCode PCAinsworthGetGramKSP(PC, KSP *);
PETSC_EXTERN PetscErrorCode PCAinsworthGetFailure(PC, const char *[]);

/* Error against run time */
PETSC_EXTERN PetscErrorCode PCAinsworthSetReference(PC, Vec);
PETSC_EXTERN PetscErrorCode PCAinsworthGetErrorEstimate(PC, PetscInt *, PetscReal *, PetscReal *);

#endif
