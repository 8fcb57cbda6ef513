/* Gaussian elimination of sparse rows, which yields the distance of each row from the span of others */
#ifndef AINSWORTH_ELIMINATION_H
#define AINSWORTH_ELIMINATION_H

#include "../base/petsccompat.h"
#include <vector>

struct AinsworthRow {
  std::vector<PetscInt>    column; /* ascending before the elimination */
  std::vector<PetscScalar> value;

  PetscReal largest() const;
};

/*
   Each row is taken as a pivot row, or it vanishes when the pivots of the taken rows are eliminated. Nearly dependent
   rows are considered last
*/
class AinsworthElimination {
public:
  void run(const std::vector<PetscInt> &order, size_t columns, PetscReal vanished);
  bool taken(PetscInt i) const { return state[i] == TAKEN; }

  std::vector<AinsworthRow> rows; /* scaled to a largest entry of 1; overwritten */

private:
  enum State : char {
    LEFT,
    TAKEN,
    VANISHED
  };

  void     peel();
  void     reduce(AinsworthRow &row);
  PetscInt choose(const AinsworthRow &row, PetscReal largest) const;
  void     pass(const std::vector<PetscInt> &order, PetscReal level, PetscReal vanished);

  std::vector<State>       state;   /* for each row */
  std::vector<PetscInt>    pivotOf; /* for each column: the step that chose its pivot, or -1 */
  std::vector<PetscInt>    rowOf;   /* for each step: the row taken */
  std::vector<PetscInt>    entries; /* for each column: number of entries in rows that are not peeled */
  std::vector<PetscScalar> x;       /* the row being reduced, with all columns */
  std::vector<char>        touched;
};

#endif
