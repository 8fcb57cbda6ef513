/*
   How a partition of the mesh spreads the rows of A and C over the ranks, and what one projection Q x = x - W C' S^{-1} C x
   sends, counted without a distributed matrix: table 2 of the paper, and what follows from it.
*/
#ifndef TUTORIALS_DISTRIBUTION_H
#define TUTORIALS_DISTRIBUTION_H

#include "cubes.h"

/* Over the ranks that have rows at all */
struct RowCount {
  PetscInt ranks, least, most;
};

struct Exchange {
  PetscInt messages, scalars; /* of the whole projection, over all ranks */
  PetscInt busiest;           /* messages that one rank at most sends or gets */
};

struct Distribution {
  RowCount A, C;     /* a row of C is on the rank of its secondary node, as CubesAssembleContact() has it */
  RowCount grouped;  /* rows of S = C W C' where it is solved with */
  Exchange spread;   /* C in the program's layout: values of x between ranks, C x to the group, the solution back, W C' t between ranks */
  Exchange together; /* C where S is: each rank sends x at the constrained unknowns it has to the group, and gets their change back */
};

/* C: all rows on this rank, with the unknowns in their natural order. The group has ceil(m / rowsPerRank) ranks: those with most rows of C. */
PetscErrorCode DistributionCount(const CubesMesh &, PetscMPIInt parts, Mat C, PetscInt rowsPerRank, Distribution *);

#endif
