/* Random saddle-point systems, the same on all ranks and on any number of them, and their dense truth */
#ifndef TESTS_RANDOMSYSTEM_H
#define TESTS_RANDOMSYSTEM_H

#include "layout.h"

/* Whole numbers that depend on the seed alone */
class Random {
public:
  explicit Random(PetscInt64 seed) : state((uint64_t)seed * 0x9e3779b97f4a7c15u + 1) { }
  uint64_t  Bits();
  PetscReal Real(PetscReal low, PetscReal high)
  {
    return low + (high - low) * (PetscReal)(Bits() >> 11) / (PetscReal)(1ull << 53);
  }
  int  Int(int low, int high) { return low + (int)(Bits() % (uint64_t)(high - low + 1)); } /* both included */
  bool Chance(PetscReal p) { return Real(0.0, 1.0) < p; }

private:
  uint64_t state;
};

/* What is wrong, or may be, with a system */
struct RandomSystem {
  int    bs;
  Dense  A, C, Ct, D; /* Ct: the block (0,1), not always the adjoint of C */
  Column f, g;
  bool   symmetric; /* A */
  bool   difficult; /* indefinite or not symmetric: a failure is an answer */
  /* stiffnesses, or scales of rows, some decades apart: nothing for one penalty, or for W = I */
  bool        uneven;
  bool        first, nested, storeZero; /* layout */
  PetscReal   decades;                  /* of stiffness, between the bodies */
  int         form;                     /* of C and C': both, C with a transpose view, C alone, C' alone */
  bool        blockD;                   /* the multipliers' block is there, be it zero */
  std::string text;

  /* now and then a B that is not C, or a D that is not diagonal or of the other sign */
  RandomSystem(Random &, bool general);

private:
  void Stiffness(Random &);
  void Constraints(Random &);
  void MultiplierBlock(Random &, bool general);
  void RightHandSide(Random &);
};

/* By dense linear algebra on the system scaled to unit diagonal of A and unit rows of C */
struct Truth {
  bool      consistent, contradictory; /* neither: too close to tell */
  bool      unique;                    /* x, though not always lambda */
  PetscReal condition;                 /* of the scaled system, without its null space */
  /* condition number of C W C' with W = diag(A)^{-1} and unit diagonal, without its null space */
  PetscReal gram;
  Column    x;
  PetscReal size;  /* of x and lambda together */
  Column    scale; /* of x, then of lambda */
  explicit Truth(const RandomSystem &);
  /* relative residual of the scaled system, and error of the scaled x relative to x and lambda */
  PetscReal Residual(const RandomSystem &, const Column &x, const Column &lambda) const;
  PetscReal Error(const Column &x) const;
};

/* Local lengths that sum up to total, in multiples of bs; empty ranks are common */
PetscInt RandomShare(MPI_Comm, Random &, int total, int bs);
/* The entries that are not zero, the diagonal of a square matrix, and, if asked for, some zeros, as AIJ */
PetscErrorCode RandomFill(MPI_Comm, const Dense &, PetscInt localRows, PetscInt localColumns, int bs, bool storeZero,
                          Mat *);
/* The system as PETSc matrices with random layouts */
PetscErrorCode RandomNestCreate(MPI_Comm, const RandomSystem &, Random &, Mat *nest, Vec *b);
PetscErrorCode RandomNestSplit(const RandomSystem &, Mat nest, Vec y, Column &x, Column &lambda);

#endif
