/* Operators of the levels and interpolation between them as matrices of PETSc */
#ifndef AINSWORTH_LEVELMAT_H
#define AINSWORTH_LEVELMAT_H

#include "coarsen.h"
#include "product.h"

#define AINSWORTH_LEVEL_MAT         "blocksalevel"
#define AINSWORTH_INTERPOLATION_MAT "blocksainterpolation"

/*
   W M W, W powers of two near diag(A)^{-1/2}: single precision neither overflows nor loses digits, whatever the units of the program

   b^ = s W b and x^ = s W^{-1} x with one more power of two, s, that brings b to the size of 1
*/
struct AinsworthScaled {
  std::shared_ptr<const std::vector<PetscReal>> w;           /* diagonal of W */
  PetscReal                                     largest = 0; /* of all W on all ranks */
  AinsworthProduct<AinsworthSingle>             product;
  std::vector<AinsworthSingle>                  inverse, x, r, p, q; /* inverse: of the diagonal of W M W */

  /* r before the product with the last p is taken from it belongs to this pair of vectors */
  PetscObjectId    xid = 0, bid = 0;
  PetscObjectState xstate = 0, bstate = 0;
  PetscReal        s = 1.0;
};

/* The operator of a level, in double or single precision */
struct AinsworthLevel {
  std::vector<PetscReal>                         diagonal; /* positive */
  std::unique_ptr<AinsworthProduct<PetscScalar>> product;
  std::unique_ptr<AinsworthScaled>               single;
  PetscReal                                      largest = 1.0; /* estimated largest eigenvalue of D^{-1} M */
};

PetscErrorCode AinsworthLevelMatCreate(PetscLayout, PetscInt, Mat *);
PetscErrorCode AinsworthLevelMatSet(Mat, std::unique_ptr<AinsworthLevel> &&);
PetscErrorCode AinsworthLevelMatGet(Mat, AinsworthLevel **);
PetscErrorCode AinsworthLevelEstimate(AinsworthLevel *);

/* single.cpp: the finest level of the cycle in single precision */
PetscErrorCode AinsworthScaledScale(const AinsworthScaled &, Vec, PetscReal *);
PetscErrorCode AinsworthScaledMult(AinsworthScaled *, Vec, Vec);
PetscErrorCode AinsworthScaledSmooth(AinsworthScaled *, PetscInt, PetscReal, PetscReal, PetscBool, Vec, Vec);
PetscErrorCode AinsworthScaledResidual(AinsworthScaled *, Vec, Vec, Vec);

PetscErrorCode AinsworthInterpolationMatCreate(std::shared_ptr<const AinsworthInterpolation>, PetscLayout, Mat *);

#endif
