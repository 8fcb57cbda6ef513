/* Gaussian elimination of sparse rows, to tell how far each is from the span of others */
#ifndef AINSWORTH_ELIMINATION_H
#define AINSWORTH_ELIMINATION_H

#include "../petsccompat.h"
#include <vector>

struct AinsworthRow {
  std::vector<PetscInt>    column; /* ascending at first */
  std::vector<PetscScalar> value;

  PetscReal largest() const;
};

/* A row is taken, or it vanishes in the elimination of the pivots of those taken. Nearly dependent rows come last */
class AinsworthElimination {
public:
  void run(const std::vector<PetscInt> &order, PetscReal vanished, bool partly);
  bool taken(PetscInt i) const { return state[i] == TAKEN; }
  bool left(PetscInt i) const { return state[i] == LEFT; }

  std::vector<AinsworthRow> rows; /* their largest entries are 1, or what an elimination left of that; they are changed */
  std::vector<char>         free; /* the columns; 0: those that may not have a pivot, because rows elsewhere share them */

private:
  enum State : char {
    LEFT,
    TAKEN,
    VANISHED
  };

  void     peel();
  void     reduce(AinsworthRow &row);
  PetscInt choose(const AinsworthRow &row, PetscReal largest) const;
  bool     pass(const std::vector<PetscInt> &order, PetscReal level, PetscReal vanished);

  std::vector<State>       state;   /* of the rows */
  std::vector<PetscInt>    pivotOf; /* the step in which a column had the pivot, or -1 */
  std::vector<PetscInt>    rowOf;   /* and the row */
  std::vector<PetscInt>    entries; /* of the rows that were not peeled, by column */
  std::vector<PetscScalar> x;       /* a row that is reduced, all columns */
  std::vector<char>        touched;
};

#endif
