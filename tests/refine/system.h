/* Systems [A B'; C -D] set up as the preconditioner does it, with their dense twins in long double */
#ifndef TESTS_SYSTEM_H
#define TESTS_SYSTEM_H

#include "blocks.h"
#include "refine/refine.h"

#if defined(PETSC_USE_COMPLEX)
using LongScalar = std::complex<long double>;
#else
using LongScalar = long double;
#endif
using Long       = Eigen::Matrix<LongScalar, Eigen::Dynamic, Eigen::Dynamic>;
using LongColumn = Eigen::Matrix<LongScalar, Eigen::Dynamic, 1>;
using LongReal   = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

/*
   The saddle made from the dense blocks, b and y in its fields, A y.primal and the residual; y and b in all of the
   program's rows
*/
struct Setup {
  Blocks               dense;
  AinsworthSaddleStage sp;
  AinsworthSaddleVec   b, y, left;
  Vec                  Ax;
  Column               s; /* the scale */
};

/*
   What rows of both equations have, by formulas; worst: of primal, dual and dependent rows, as AinsworthBackward has
   them
*/
struct Truth {
  LongColumn        residual;
  LongReal          terms, allowed;
  AinsworthWorstRow worst[3];
  long double       size;
};

/* alone: each rank has all of it; B, D or both may be empty */
PetscErrorCode SetupCreate(const Blocks &, Setup *, bool alone = false);
PetscErrorCode SetupDestroy(Setup *);
PetscErrorCode SetBoth(const Column &, AinsworthSaddleVec);
Column         Times(const Dense &K, const Column &y); /* summed in long double */
Truth          Exact(const Setup &, const std::vector<AinsworthRowKind> &, bool transpose, const AinsworthMeasure[],
                     const Column &b, const Column &y);
Blocks         Handmade(const Column &diagonal, const Dense &C);

/* The tests */
PetscErrorCode TestScale();
PetscErrorCode TestError();
PetscErrorCode TestChange();
PetscErrorCode TestDecide();
PetscErrorCode TestRefine();
PetscErrorCode TestDepend();
PetscErrorCode TestCertify();

#endif
