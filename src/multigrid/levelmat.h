/* Level operators and interpolation as PETSc matrices */
#ifndef AINSWORTH_LEVELMAT_H
#define AINSWORTH_LEVELMAT_H

#include "coarsen.h"
#include "incomplete.h"
#include "product.h"
#include "subspace.h"
#include <array>

#define AINSWORTH_LEVEL_MAT         "blocksalevel"
#define AINSWORTH_INTERPOLATION_MAT "blocksainterpolation"

/*
   W M W with powers of two W near diag(A)^{-1/2}, so that single precision neither overflows nor loses digits, whatever
   the units of the program

   The scaled vectors are b^ = s W b and x^ = s W^{-1} x. The power of two s, the same on all levels, brings the
   right-hand side of the cycle to about unit size on the finest one: on coarser ones |P' r| is at most |r| in the norms
   of A^{-1}, so that D^{-1} P' r is larger by at most the root of the condition number of D^{-1} A
*/
struct AinsworthScaled {
  std::shared_ptr<const std::vector<PetscReal>>      w;       /* diagonal of W */
  std::shared_ptr<const PetscReal>                   s;       /* set by the cycle */
  std::unique_ptr<AinsworthProduct<AinsworthSingle>> product; /* has the width of the multivectors */
  /* inverse holds that of the diagonal of W M W */
  std::vector<AinsworthSingle>               inverse;
  std::shared_ptr<const AinsworthIncomplete> factor;     /* smooths in the place of the diagonal if not NULL */
  std::vector<AinsworthSingle>               x, r, p, z; /* r: M x - b; z: what the factor makes of r */
  /* identifies the b and x whose residual is -r minus the product with p; zero if there is none */
  std::array<PetscInt64, 4> pair    = {};
  bool                      rounded = false; /* x of the pair began with what coarser levels found */

  void           createWork();
  PetscErrorCode solve(const AinsworthLevelSubspace *);
  PetscErrorCode precondition(const AinsworthLevelSubspace *, PetscScalar *);
  PetscErrorCode findScale(const PetscScalar *x, PetscReal *scale) const;
  PetscErrorCode mult(PetscReal scale, const PetscScalar *x, PetscScalar *y);
  PetscErrorCode smooth(PetscInt steps, PetscReal least, PetscReal largest, PetscBool zero,
                        const AinsworthLevelSubspace *, Vec b, Vec x);
  PetscErrorCode residual(bool exact, Vec b, Vec x, Vec r, bool *found);
};

/* The operator in double precision from values that the cycle shares, M = W^{-1} (W M W) W^{-1}: W loses no bit */
class AinsworthJoined {
public:
  typedef AinsworthProduct<PetscScalar, AinsworthSplitRows> Product;

  const std::shared_ptr<const std::vector<PetscReal>> w;
  const std::unique_ptr<Product>                      product;

  AinsworthJoined(const std::shared_ptr<const std::vector<PetscReal>> &scale, std::unique_ptr<Product> &&scaled)
    : w(scale), product(std::move(scaled)), x(scale->size() * product->width)
  {
  }
  PetscErrorCode                            mult(const PetscScalar *x, PetscScalar *y);
  PetscErrorCode                            unscale(Mat) const;
  std::shared_ptr<const AinsworthBlockRows> join() const;

private:
  std::vector<PetscScalar> x; /* W^{-1} x */
};

/*
   The operator of a level for vectors or for multivectors of some width, in double precision, for smoothing in single
   precision, or both: the finest level has one of them, as it is visited once
*/
struct AinsworthLevel {
  PetscInt                                       width = 1;
  std::shared_ptr<const std::vector<PetscReal>>  diagonal; /* positive */
  std::unique_ptr<AinsworthProduct<PetscScalar>> product;
  std::unique_ptr<AinsworthJoined>               joined; /* replaces the product if not NULL */
  std::unique_ptr<AinsworthScaled>               single;
  /* estimated largest eigenvalue of D^{-1} M, with the factor in the place of D where there is one */
  PetscReal                                     largest = 1.0;
  std::shared_ptr<const AinsworthLevelSubspace> subspace; /* NULL: the whole space */

  bool                   exact() const { return product || joined; }           /* in double precision */
  bool                   factored() const { return single && single->factor; } /* a factor smooths it, not Jacobi */
  const AinsworthLayout &nodes() const
  {
    return (product ? product->cols : joined ? joined->product->cols : single->product->cols)->layout;
  }
  void stay(const std::shared_ptr<const AinsworthLevelSubspace> &);
  /* Computes y = M x; scale: brings W^{-1} x to about 1, where the product is in single precision. Collective */
  PetscErrorCode mult(PetscReal scale, const PetscScalar *x, PetscScalar *y);
  PetscErrorCode giveFactor(const AinsworthBlockRows *added);
  PetscErrorCode estimate(const AinsworthBlockRows *added, const std::vector<char> &embedded);
  /* Creates the same operator for multivectors, which shares the matrix */
  std::unique_ptr<AinsworthLevel> widen(PetscInt width) const;
};

PetscErrorCode AinsworthLevelMatSet(const AinsworthLayout &, PetscInt, std::unique_ptr<AinsworthLevel> &&, Mat *);
PetscErrorCode AinsworthLevelMatSetDefinite(Mat);
PetscErrorCode AinsworthLevelMatGet(Mat, AinsworthLevel **);
PetscErrorCode AinsworthInterpolationMatSet(Mat, const std::shared_ptr<const AinsworthInterpolation> &);
PetscErrorCode AinsworthInterpolationMatSetSubspace(Mat, const std::shared_ptr<const AinsworthLevelSubspace> &,
                                                    const std::shared_ptr<const AinsworthInterpolation> &);
PetscErrorCode AinsworthInterpolationMatCreate(const std::shared_ptr<const AinsworthInterpolation> &,
                                               const AinsworthLayout &, PetscInt width, Mat *);

#endif
