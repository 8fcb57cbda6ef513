/* Block rows and levels of the multigrid, which only programs linked to its objects see */
#ifndef TESTS_INTERNAL_H
#define TESTS_INTERNAL_H

#include "lattice.h"
#include "multigrid/half.h"
#include "multigrid/hierarchy.h"

/* Everything on every rank; first: number of the first row's node, of N on all ranks */
PetscErrorCode Gather(const AinsworthBlockRows &, const AinsworthColumns &, PetscInt first, PetscInt N, Dense &);
/* stored or not */
inline PetscErrorCode Gather(const AinsworthBlockMat &X, Dense &d)
{
  AinsworthBlockMat stored(X);

  stored.store();
  return Gather(stored.rows, X.cols, X.cols.first, X.cols.layout->N, d);
}
/* the whole of a matrix of which half is stored */
inline PetscErrorCode OpenHalf(const AinsworthHalf &half, AinsworthBlockMat *X)
{
  PetscFunctionBeginUser;
  PetscCall(AinsworthBlockMatOpenHalf(half.upper, AinsworthBlockRows(half.outside.rows), half.outside.cols, X));
  PetscFunctionReturn(PETSC_SUCCESS);
}
AinsworthHierarchyOptions UsualOptions();
/* the values of modes at all nodes, bs rows for each; bs is k on coarser levels */
PetscErrorCode GatherModes(const AinsworthModes &, PetscInt bs, const PetscLayout nodes, Dense *);
/* the modes that a program would give; dense: the same with N rows */
PetscErrorCode Modes(const Lattice &, Mat A, AinsworthModes *, Dense *);
/* Tentative interpolation as the hierarchy makes it, to nodes that stay where they were made or are all on rank 0 */
PetscErrorCode TentativeCreate(AinsworthAggregates *, PetscInt bs, bool together, AinsworthModes *, AinsworthTies *,
                               AinsworthTentative *);
PetscErrorCode HierarchyCreate(const Lattice &, Mat A, const AinsworthHierarchyOptions &, AinsworthHierarchy *);
/*
   P' X P where those of X and P are known, and the norm of D^{-1/2} X D^{-1/2} for comparisons that see soft and stiff
   rows alike
*/
Dense Scaled(const Dense &X, const Dense &diagonalOf);

#endif
