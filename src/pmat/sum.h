/* A + sum of f_k E_k, where the E_k live on the surface (surface.h): its norm, and the assembled sum, seen in a frame */
#ifndef AINSWORTH_SUM_H
#define AINSWORTH_SUM_H

#include "../projector/frame.h"
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

  PetscErrorCode merge();                             /* the terms are no longer needed then */
  AinsworthRow   row(PetscInt i, PetscInt place = 0); /* valid until the next call with this place, 0 to 2 */

private:
  std::vector<PetscInt>    start, columns, bufferColumns[3];
  std::vector<PetscScalar> values;
};

/* A, opened for reading, with the terms merged into it on the surface: open() has done with them */
class AinsworthSum {
public:
  PetscErrorCode open(Mat A, IS dofs, const std::vector<AinsworthTerm> &terms, PetscInt bs);
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

/* The rows of one node of T M T', dense by blocks; without a frame one row as it stands */
class AinsworthNode {
public:
  explicit AinsworthNode(const AinsworthFrame *f) : frame(f), bs(f->bs ? f->bs : 1) { }
  void     compute(AinsworthPart &part, PetscInt first);
  PetscInt count(AinsworthPart &part, PetscInt first);

  const AinsworthFrame *frame;
  const PetscInt        bs;
  AinsworthRow          rows[3];

private:
  void read(AinsworthPart &part, PetscInt first);
  template <PetscInt N>
  PetscInt width() const;
  template <PetscInt N>
  void                     turn();
  AinsworthRow             given[3];
  std::vector<PetscInt>    columns;
  std::vector<PetscScalar> values[3];
};

PetscErrorCode AinsworthAssembleAIJ(AinsworthSum *, const AinsworthFrame *, Mat *);
PetscErrorCode AinsworthAssembleHypre(AinsworthSum *, const AinsworthFrame *, Mat *);

#endif
