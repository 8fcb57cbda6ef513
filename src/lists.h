/* Lists of indices: of one rank, of all ranks, of an index set */
#ifndef AINSWORTH_LISTS_H
#define AINSWORTH_LISTS_H

#include "petsccompat.h"
#include <petscsf.h>
#include <algorithm>
#include <vector>

/* Ascending, each once */
static inline void AinsworthSortUnique(std::vector<PetscInt> *list)
{
  std::sort(list->begin(), list->end());
  list->erase(std::unique(list->begin(), list->end()), list->end());
}

/* What is on this rank */
static inline PetscErrorCode AinsworthISToList(IS is, std::vector<PetscInt> *list)
{
  PetscInt        n;
  const PetscInt *index;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(is, &n));
  PetscCall(ISGetIndices(is, &index));
  list->assign(index, index + n);
  PetscCall(ISRestoreIndices(is, &index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The lists of all ranks, one after the other; collective */
static inline PetscErrorCode AinsworthGatherLists(MPI_Comm comm, const std::vector<PetscInt> &mine, std::vector<PetscInt> *all)
{
  IS own, whole;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(comm, (PetscInt)mine.size(), mine.data(), PETSC_USE_POINTER, &own));
  PetscCall(ISAllGather(own, &whole));
  PetscCall(AinsworthISToList(whole, all));
  PetscCall(ISDestroy(&whole));
  PetscCall(ISDestroy(&own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the ranks that own some places of a layout have there, of values of which each rank has those of its own; collective */
static inline PetscErrorCode AinsworthFetch(MPI_Comm comm, PetscLayout layout, const std::vector<PetscInt> &values, PetscInt n, const PetscInt places[],
                                            std::vector<PetscInt> *fetched)
{
  PetscSF sf;

  PetscFunctionBegin;
  fetched->resize(n);
  PetscCall(PetscSFCreate(comm, &sf));
  PetscCall(PetscSFSetGraphLayout(sf, layout, n, NULL, PETSC_USE_POINTER, places));
  PetscCall(PetscSFBcastBegin(sf, MPIU_INT, values.data(), fetched->data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, MPIU_INT, values.data(), fetched->data(), MPI_REPLACE));
  PetscCall(PetscSFDestroy(&sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
