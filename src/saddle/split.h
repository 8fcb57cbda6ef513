/* Splits the entries of an AIJ matrix into blocks */
#ifndef AINSWORTH_SPLIT_H
#define AINSWORTH_SPLIT_H

#include "../base/arrays.h"
#include "../base/objects.h"

/* Numbers within the fields: 0, 1, ... in the primal field, -1, -2, ... in the multiplier field */
struct AinsworthSplit {
  std::vector<PetscInt> rows;         /* of local rows */
  std::vector<PetscInt> cols[2];      /* of local columns; of columns of other ranks, global */
  PetscInt              size[2] = {}; /* local columns of each field */
};

PetscErrorCode AinsworthSplitCreate(Mat, const AinsworthRef<IS>[2], const AinsworthRef<IS>[2],
                                    std::shared_ptr<const AinsworthSplit> *);
PetscErrorCode AinsworthSplitFill(Mat, const AinsworthSplit *, int, AinsworthRef<Mat>[]);
PetscErrorCode AinsworthSplitRefill(Mat, const AinsworthSplit *, int, AinsworthRef<Mat>[]);

#endif
