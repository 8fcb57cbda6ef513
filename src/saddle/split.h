/* Which entry of an AIJ goes to which block */
#ifndef AINSWORTH_SPLIT_H
#define AINSWORTH_SPLIT_H

#include "arrays.h"

/* Numbers in fields: 0, 1, ... in the primal one, -1, -2, ... in that of the multipliers */
struct AinsworthSplit {
  std::vector<PetscInt> rows;    /* of this rank */
  std::vector<PetscInt> cols[2]; /* of this rank; of other ranks, global numbers */
  PetscInt              size[2]; /* columns of the fields on this rank */
};

PetscErrorCode AinsworthSplitCreate(Mat, const IS[2], const IS[2], std::shared_ptr<const AinsworthSplit> *);
PetscErrorCode AinsworthSplitFill(Mat, const AinsworthSplit *, int, const PetscReal[], Mat[]);
PetscErrorCode AinsworthSplitRefill(Mat, const AinsworthSplit *, int, const PetscReal[], Mat[]);

#endif
