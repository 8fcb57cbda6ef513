#include "blocks.h"
#include <petscsection.h>

/* Where rows of different lengths lie after their way along sf, and the way of their entries */
static PetscErrorCode SpreadRows(PetscSF sf, const AinsworthBlockRows &rows, PetscInt arriving, std::vector<PetscInt> *start, PetscSF *entries)
{
  PetscSection from, to;
  PetscInt    *remote;
  MPI_Comm     comm = PetscObjectComm((PetscObject)sf);

  PetscFunctionBegin;
  PetscCall(PetscSectionCreate(comm, &from));
  PetscCall(PetscSectionSetChart(from, 0, rows.n));
  for (PetscInt r = 0; r < rows.n; r++) PetscCall(PetscSectionSetDof(from, r, rows.i[r + 1] - rows.i[r]));
  PetscCall(PetscSectionSetUp(from));
  PetscCall(PetscSectionCreate(comm, &to));
  PetscCall(PetscSFDistributeSection(sf, from, &remote, to));
  PetscCall(PetscSFCreateSectionSF(sf, from, remote, to, entries));
  start->assign(arriving + 1, 0);
  for (PetscInt r = 0; r < arriving; r++) {
    PetscInt n;

    PetscCall(PetscSectionGetDof(to, r, &n));
    (*start)[r + 1] = (*start)[r] + n;
  }
  PetscCall(PetscFree(remote));
  PetscCall(PetscSectionDestroy(&from));
  PetscCall(PetscSectionDestroy(&to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends rows along sf: from its roots, one row each, to its leaves, of which this rank has n */
static PetscErrorCode SendRows(PetscSF sf, const AinsworthBlockRows &rows, PetscInt n, AinsworthBlockRows *arrived)
{
  PetscSF       entries;
  AinsworthUnit unit(rows.size(), MPIU_SCALAR);

  PetscFunctionBegin;
  arrived->n  = n;
  arrived->br = rows.br;
  arrived->bc = rows.bc;
  PetscCall(SpreadRows(sf, rows, n, &arrived->i, &entries));
  arrived->j.resize(arrived->i[n]);
  arrived->a.resize((size_t)arrived->i[n] * rows.size());
  PetscCall(PetscSFBcastBegin(entries, MPIU_INT, rows.j.data(), arrived->j.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(entries, MPIU_INT, rows.j.data(), arrived->j.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastBegin(entries, unit.type, rows.a.data(), arrived->a.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(entries, unit.type, rows.a.data(), arrived->a.data(), MPI_REPLACE));
  PetscCall(PetscSFDestroy(&entries));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthRowsToGhosts - one row of each owned node of cols, to the ranks that have the node as a ghost: a row a ghost. Columns are numbers of nodes */
PetscErrorCode AinsworthRowsToGhosts(const AinsworthColumns &cols, const AinsworthBlockRows &rows, AinsworthBlockRows *ghostRows)
{
  PetscFunctionBegin;
  ghostRows->n  = 0;
  ghostRows->br = rows.br;
  ghostRows->bc = rows.bc;
  ghostRows->i.assign(1, 0);
  if (cols.sf) PetscCall(SendRows(cols.sf, rows, (PetscInt)cols.ghosts.size(), ghostRows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthRowsToOwners - one row of each ghost of cols to the owner of the node. Columns are numbers of nodes

   owner: the owned node, from 0, that each row that arrives belongs to; rising
*/
PetscErrorCode AinsworthRowsToOwners(const AinsworthColumns &cols, const AinsworthBlockRows &rows, std::vector<PetscInt> *owner, AinsworthBlockRows *arrived)
{
  PetscSF         multi, inverse;
  const PetscInt *degree;

  PetscFunctionBegin;
  owner->clear();
  arrived->n = 0;
  arrived->i.assign(1, 0);
  if (!cols.sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFComputeDegreeBegin(cols.sf, &degree));
  PetscCall(PetscSFComputeDegreeEnd(cols.sf, &degree));
  for (PetscInt c = 0; c < cols.local; c++) owner->insert(owner->end(), degree[c], c);
  PetscCall(PetscSFGetMultiSF(cols.sf, &multi));
  PetscCall(PetscSFCreateInverseSF(multi, &inverse));
  PetscCall(SendRows(inverse, rows, (PetscInt)owner->size(), arrived));
  PetscCall(PetscSFDestroy(&inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}
