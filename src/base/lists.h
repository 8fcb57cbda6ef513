/* Lists of indices: local, gathered from all ranks, or from an index set */
#ifndef AINSWORTH_LISTS_H
#define AINSWORTH_LISTS_H

#include "petsccompat.h"
#include <petscsf.h>
#include <algorithm>
#include <vector>

/* Sorts a list in ascending order and removes duplicates */
static inline void AinsworthSortUnique(std::vector<PetscInt> *list)
{
  std::sort(list->begin(), list->end());
  list->erase(std::unique(list->begin(), list->end()), list->end());
}

/* Returns the place of each number in an order of 0, 1, ... */
static inline std::vector<PetscInt> AinsworthInverse(const std::vector<PetscInt> &order)
{
  std::vector<PetscInt> place(order.size());

  for (size_t l = 0; l < order.size(); l++) place[order[l]] = (PetscInt)l;
  return place;
}

/* Copies the local indices of an index set to a list */
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

/* Replaces two sizes by those of the first rank on which they differ, if there is one; collective */
static inline PetscErrorCode AinsworthFirstMismatch(MPI_Comm comm, PetscInt *a, PetscInt *b)
{
  PetscMPIInt rank, size, first;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  first = *a == *b ? size : rank;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, comm));
  if (first == size) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt *number : {a, b}) PetscCallMPI(MPI_Bcast(number, 1, MPIU_INT, first, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Concatenates the lists of all ranks in rank order; collective */
static inline PetscErrorCode AinsworthGatherLists(MPI_Comm comm, const std::vector<PetscInt> &mine,
                                                  std::vector<PetscInt> *all)
{
  PetscMPIInt              size, n;
  PetscInt                 total = 0;
  std::vector<PetscMPIInt> counts, starts;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscMPIIntCast((PetscInt)mine.size(), &n));
  counts.resize(size);
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, counts.data(), 1, MPI_INT, comm));
  for (PetscMPIInt count : counts) {
    starts.emplace_back();
    PetscCall(PetscMPIIntCast(total, &starts.back()));
    total += count;
  }
  all->resize(total);
  PetscCallMPI(MPI_Allgatherv(mine.data(), n, MPIU_INT, all->data(), counts.data(), starts.data(), MPIU_INT, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Fetches the values at some global indices of a layout; `values` has one value for each index that this rank owns.
   Collective
*/
static inline PetscErrorCode AinsworthFetch(MPI_Comm comm, PetscLayout layout, const std::vector<PetscInt> &values,
                                            PetscInt n, const PetscInt places[], std::vector<PetscInt> *fetched)
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
