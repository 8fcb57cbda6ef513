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
  (AINSWORTH_VERSION_MAJOR * 10000 + AINSWORTH_VERSION_MINOR * 100 + AINSWORTH_VERSION_SUBMINOR >= \
   (MAJOR)*10000 + (MINOR)*100 + (SUBMINOR))

#define PCAINSWORTH        "ainsworth"
#define PCBLOCKSA          "blocksa"
#define MATAINSWORTH       "ainsworth"
#define KSPPROJECTEDCG     "projectedcg"
#define KSPCHEBYSHEVSINGLE "chebyshevsingle"

#define SNESAINSWORTHACTIVESET "ainsworthactiveset"

/*E
   MatAinsworthWeightType - the type of the diagonal weight W of the projector

+  `MAT_AINSWORTH_WEIGHT_DIAGONAL` (default) - W = diag(A)^{-1}
.  `MAT_AINSWORTH_WEIGHT_IDENTITY`           - W = I
-  `MAT_AINSWORTH_WEIGHT_USER`               - W is given by `MatAinsworthSetWeight()` or `PCAinsworthSetWeight()`

   Level: intermediate

.seealso: `MatAinsworthSetWeightType()`, `PCAinsworthSetWeight()`
E*/
typedef enum {
  MAT_AINSWORTH_WEIGHT_DIAGONAL,
  MAT_AINSWORTH_WEIGHT_IDENTITY,
  MAT_AINSWORTH_WEIGHT_USER
} MatAinsworthWeightType;
PETSC_EXTERN const char *const MatAinsworthWeightTypes[];

PETSC_EXTERN PetscErrorCode AinsworthInitializePackage(void);

/* The reduced operator */
PETSC_EXTERN PetscErrorCode MatCreateAinsworth(Mat, Mat, Mat *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetMats(Mat, Mat, Mat);
PETSC_EXTERN PetscErrorCode MatAinsworthGetMats(Mat, Mat *, Mat *);
PETSC_EXTERN PetscErrorCode MatAinsworthSetWeightType(Mat, MatAinsworthWeightType);
PETSC_EXTERN PetscErrorCode MatAinsworthSetWeight(Mat, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthSetPenalty(Mat, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultProjector(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultTransposeProjector(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultRightInverse(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthMultTransposeRightInverse(Mat, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthComputeRHS(Mat, Vec, Vec, Vec);
PETSC_EXTERN PetscErrorCode MatAinsworthComputeMultiplier(Mat, Vec, Vec, Vec);

/* The preconditioner */
PETSC_EXTERN PetscErrorCode PCAinsworthSetWeight(PC, Vec);
PETSC_EXTERN PetscErrorCode PCAinsworthGetKSP(PC, KSP *);
PETSC_EXTERN PetscErrorCode PCAinsworthGetGramKSP(PC, KSP *);
PETSC_EXTERN PetscErrorCode PCAinsworthGetFields(PC, IS *, IS *);
PETSC_EXTERN PetscErrorCode PCAinsworthGetFailure(PC, const char *[]);

/* Error against run time */
PETSC_EXTERN PetscErrorCode PCAinsworthSetReference(PC, Vec);
PETSC_EXTERN PetscErrorCode PCAinsworthGetErrorEstimate(PC, PetscInt *, PetscReal *, PetscReal *);

#endif
