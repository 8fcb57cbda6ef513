/* Level operators and interpolation as PETSc matrices */
#ifndef AINSWORTH_LEVELMAT_H
#define AINSWORTH_LEVELMAT_H

#include "coarsen.h"
#include "product.h"
#include "subspace.h"
#include <array>

#define AINSWORTH_LEVEL_MAT         "blocksalevel"
#define AINSWORTH_INTERPOLATION_MAT "blocksainterpolation"

/*
   W M W with powers of two W near diag(A)^{-1/2}, so that single precision neither overflows nor loses digits, whatever
   the units of the program

   The scaled vectors are b^ = s W b and x^ = s W^{-1} x, where the power of two s brings b to about unit size
*/
struct AinsworthScaled {
  std::shared_ptr<const std::vector<PetscReal>>      w;           /* diagonal of W */
  PetscReal                                          largest = 0; /* largest entry of W on all ranks */
  std::unique_ptr<AinsworthProduct<AinsworthSingle>> product;     /* has the width of the multivectors */
  /* inverse holds that of the diagonal of W M W */
  std::vector<AinsworthSingle> inverse;
  std::vector<AinsworthSingle> x, r, p; /* r: M x - b */
  PetscReal                    s = 1.0;
  /* identifies the b and x whose residual is -r minus the product with p; zero if there is none */
  std::array<PetscInt64, 4> pair = {};

  void           createWork();
  PetscErrorCode mult(Vec x, Vec y);
  PetscErrorCode smooth(PetscInt steps, PetscReal least, PetscReal largest, PetscBool zero,
                        const AinsworthLevelSubspace *, Vec b, Vec x);
  PetscErrorCode residual(Vec b, Vec x, Vec r);
};

/* The operator of a level, in double or single precision, for vectors or for multivectors of some width */
struct AinsworthLevel {
  PetscInt                                       width = 1;
  std::shared_ptr<const std::vector<PetscReal>>  diagonal; /* positive */
  std::unique_ptr<AinsworthProduct<PetscScalar>> product;
  std::unique_ptr<AinsworthScaled>               single;
  PetscReal                                      largest = 1.0; /* estimated largest eigenvalue of D^{-1} M */
  std::shared_ptr<const AinsworthLevelSubspace>  subspace;      /* NULL: the whole space */

  void stay(const std::shared_ptr<const AinsworthLevelSubspace> &);
  /* Creates the same operator for multivectors, which shares the matrix */
  std::unique_ptr<AinsworthLevel> widen(PetscInt width) const;
};

PetscErrorCode AinsworthLevelMatSet(const AinsworthLayout &, PetscInt, std::unique_ptr<AinsworthLevel> &&, Mat *);
PetscErrorCode AinsworthLevelMatGet(Mat, AinsworthLevel **);
PetscErrorCode AinsworthLevelMatEstimate(Mat, const AinsworthBlockRows *added, const std::vector<char> &embedded);
PetscErrorCode AinsworthInterpolationMatSet(Mat, const std::shared_ptr<const AinsworthInterpolation> &);
PetscErrorCode AinsworthInterpolationMatSetSubspace(Mat, const std::shared_ptr<const AinsworthLevelSubspace> &,
                                                    const std::shared_ptr<const AinsworthInterpolation> &);
PetscErrorCode AinsworthInterpolationMatCreate(const std::shared_ptr<const AinsworthInterpolation> &,
                                               const AinsworthLayout &, PetscInt width, Mat *);

#endif
