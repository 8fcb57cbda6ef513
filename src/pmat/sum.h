/* A + sum of f_k E_k, where the E_k live on the surface (surface.h): its norm, and the assembled sum */
#ifndef AINSWORTH_SUM_H
#define AINSWORTH_SUM_H

#include "../petsccompat.h"
#include <vector>

struct AinsworthTerm {
  Mat       E;
  PetscReal factor;
};

/* Read access to a SeqAIJ whose columns are renumbered in ascending order; no map: they keep their numbers */
struct AinsworthOperand {
  Mat                   mat = NULL;
  const PetscInt       *ia = nullptr, *ja = nullptr;
  const PetscScalar    *a      = nullptr;
  PetscReal             factor = 1.0;
  bool                  mapped = false;
  std::vector<PetscInt> map;

  PetscErrorCode open(Mat);
  PetscErrorCode close();
  PetscInt       column(PetscInt k) const { return mapped ? map[ja[k]] : ja[k]; }
};

struct AinsworthRow {
  const PetscInt    *columns;
  const PetscScalar *values;
  PetscInt           n;
};

/* The columns that this rank owns, or its ghost columns, of the whole sum: rows of A as they stand, those of the surface merged */
class AinsworthPart {
public:
  AinsworthOperand              base;
  std::vector<AinsworthOperand> terms;
  const std::vector<PetscInt>  *surface; /* row of the terms of each row of the base, -1: none */

  PetscErrorCode merge();         /* the terms are no longer needed then */
  AinsworthRow   row(PetscInt i); /* valid until the next call */

private:
  std::vector<PetscInt>    start, columns, buffer;
  std::vector<PetscScalar> values;
};

/* A, opened for reading, with the terms merged into it on the surface: open() has done with them */
class AinsworthSum {
public:
  PetscErrorCode open(Mat A, IS dofs, const std::vector<AinsworthTerm> &terms);
  PetscErrorCode close();
  PetscErrorCode norm(PetscReal *);

  AinsworthPart         inside, outside; /* nothing outside on one rank */
  bool                  parallel = false;
  Mat                   A        = NULL;
  PetscInt              n;      /* local rows */
  std::vector<PetscInt> ghosts; /* ghost columns of the sum, ascending */

private:
  std::vector<PetscInt> surface;
};

PetscErrorCode AinsworthAssembleAIJ(AinsworthSum *, Mat *);
PetscErrorCode AinsworthAssembleHypre(AinsworthSum *, Mat *);

#endif
