/* Operators of the levels and interpolation between them as matrices of PETSc */
#ifndef AINSWORTH_LEVELMAT_H
#define AINSWORTH_LEVELMAT_H

#include "coarsen.h"
#include "product.h"
#include <array>

#define AINSWORTH_LEVEL_MAT         "blocksalevel"
#define AINSWORTH_INTERPOLATION_MAT "blocksainterpolation"

/*
   W M W, W powers of two near diag(A)^{-1/2}: single precision neither overflows nor loses digits, whatever the units of the program

   b^ = s W b and x^ = s W^{-1} x with one more power of two, s, that brings b to the size of 1
*/
struct AinsworthScaled {
  std::shared_ptr<const std::vector<PetscReal>>      w;           /* diagonal of W */
  PetscReal                                          largest = 0; /* of all W on all ranks */
  std::unique_ptr<AinsworthProduct<AinsworthSingle>> product;
  std::vector<AinsworthSingle>                       inverse, x, r, p, q; /* inverse: of the diagonal of W M W */
  PetscReal                                          s    = 1.0;
  std::array<PetscInt64, 4>                          pair = {}; /* b and x that r belongs to, before the product with the last p is taken from it */

  PetscErrorCode mult(Vec x, Vec y);
  PetscErrorCode smooth(PetscInt steps, PetscReal least, PetscReal largest, PetscBool zero, Vec b, Vec x);
  PetscErrorCode residual(Vec b, Vec x, Vec r);
};

/* The operator of a level, in double or single precision */
struct AinsworthLevel {
  std::vector<PetscReal>                         diagonal; /* positive */
  std::unique_ptr<AinsworthProduct<PetscScalar>> product;
  std::unique_ptr<AinsworthScaled>               single;
  PetscReal                                      largest = 1.0; /* estimated largest eigenvalue of D^{-1} M */

  PetscErrorCode estimate(const AinsworthBlockRows *added = NULL);
};

PetscErrorCode AinsworthLevelMatSet(const AinsworthLayout &, PetscInt, std::unique_ptr<AinsworthLevel> &&, Mat *);
PetscErrorCode AinsworthLevelMatGet(Mat, AinsworthLevel **);
PetscErrorCode AinsworthInterpolationMatCreate(const std::shared_ptr<const AinsworthInterpolation> &, const AinsworthLayout &, Mat *);

#endif
