/* The pencil (K + sigma M, M) of the program's matrices, with a preconditioner of K + sigma M */
#ifndef AINSWORTH_PENCIL_H
#define AINSWORTH_PENCIL_H

#include "slepccompat.h"
#include "../base/objects.h"
#include <vector>

/*
   K = [A C'; C 0] and M = [M 0; 0 0] in any layout that PCAINSWORTH takes

   Vectors have all rows of K in the order of the local entries, are never nested, and have zeros for the multipliers
   unless said otherwise
*/
class AinsworthPencil {
public:
  /* Sets the preconditioner up; ksp: with a PC of type PCAINSWORTH; borrowed. Collective */
  PetscErrorCode build(Mat K, Mat M, KSP ksp, PetscReal sigma);
  /* Fails if x shows that K + sigma M is singular where the constraints are met; x' (K + sigma M) x = 1. Collective */
  PetscErrorCode checkDefinite(Vec x) const;
  /* Fails with words for that */
  PetscErrorCode refuseIndefinite() const;
  /* Does so for another sigma. Collective */
  PetscErrorCode changeShift(PetscReal sigma);

  PetscErrorCode createVec(Vec *) const;
  PetscErrorCode multShifted(Vec x, Vec y) const; /* y = (K + sigma M) x */
  PetscErrorCode multMass(Vec x, Vec y) const;
  /*
     Multiplies the columns of X, which have no multipliers, by K + sigma M and M; the multipliers' rows of the products
     may be left out, as they are rounding. Collective
  */
  PetscErrorCode multAll(Mat X, Mat KX, Mat MX);
  /* Applies the preconditioner; z: with multipliers, and C z = the multipliers' rows of r */
  PetscErrorCode precondition(Vec r, Vec z) const;
  /* Does so for the columns of a dense matrix. Collective */
  PetscErrorCode precondition(Mat R, Mat Z) const;
  /* Removes the multipliers from a vector, or all but them */
  PetscErrorCode removeMultipliers(Vec) const;
  PetscErrorCode keepMultipliers(Vec) const;
  /* Copies between such a vector and one of the program */
  PetscErrorCode copy(Vec from, Vec to) const;

  PetscReal sigma() const { return shift; }

private:
  struct Sum {
    AinsworthRef<Mat> sum, mass; /* a block of K + sigma M, and what it has of M */
  };
  PetscErrorCode createSum(Mat K, Mat M, AinsworthRef<Mat> *);
  PetscErrorCode mult(Mat, Vec, Vec) const;
  PetscErrorCode createSums();
  PetscErrorCode setUp();
  PetscErrorCode findMultipliers();
  PetscErrorCode checkMass() const;
  PetscErrorCode findBlock();
  PetscErrorCode multBlock(int k, Mat X, Mat Y);

  AinsworthRef<Mat>     K, M, shifted;
  std::vector<Sum>      sums;
  KSP                   ksp   = NULL;
  PetscReal             shift = 0.0;
  AinsworthRef<Vec>     in, out;     /* of the program's type; NULL where this is no nest */
  std::vector<PetscInt> multipliers; /* their local places */
  /*
     AIJ, the blocks of K + sigma M and M that have all rows and columns but multipliers, or these as well; NULL where
     there is none. PETSc reads such a matrix once for several columns of a dense one
  */
  AinsworthRef<Mat> block[2], from, to[2];
  PetscInt          offset = 0, rows = 0; /* their place among the local rows */
};

/* Estimates the order of magnitude of the lowest eigenvalue that is not 0. Collective */
PetscErrorCode AinsworthEstimateLowest(Mat K, Mat M, PetscReal *lowest);

#endif
