/* Multigrid in Ker C: what becomes of the rows and unknowns of C, and Q_* of the short rows */
#ifndef AINSWORTH_COARSE_H
#define AINSWORTH_COARSE_H

#include "pmat.h"

/* What becomes of the rows and unknowns of C */
struct AinsworthKernelRoles {
  std::vector<char>     shortRows;     /* local rows: in Q_* */
  std::vector<PetscInt> kept;          /* rows kept as constraints, global numbers of all ranks */
  std::vector<PetscInt> carried;       /* unknowns, global numbers of all ranks */
  Vec                   weight = NULL; /* of Q_*, length n */
};

PetscErrorCode AinsworthKernelFindShares(const AinsworthPmatInputs *, Mat, const AinsworthKernelRoles &,
                                         std::vector<PetscReal> *);
PetscErrorCode AinsworthKernelCreateSpread(const AinsworthPmatInputs *, Mat, const AinsworthPmatOptions *,
                                           const AinsworthKernelRoles &, Mat *);

#endif
