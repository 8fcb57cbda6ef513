#include "blocks.h"
#include <petscsection.h>

/*
   AinsworthSendRows - sends block rows from the roots of an SF, one row each, to its n local leaves; columns are global
   node numbers. Collective
*/
PetscErrorCode AinsworthSendRows(PetscSF sf, const AinsworthBlockRows &rows, PetscInt n, AinsworthBlockRows *arrived)
{
  PetscSF       entries;
  PetscSection  from, to;
  PetscInt     *remote;
  AinsworthUnit unit(rows.size(), MPIU_SCALAR);

  PetscFunctionBegin;
  PetscCall(PetscSectionCreate(PetscObjectComm((PetscObject)sf), &from));
  PetscCall(PetscSectionSetChart(from, 0, rows.n));
  for (PetscInt r = 0; r < rows.n; r++) PetscCall(PetscSectionSetDof(from, r, rows.i[r + 1] - rows.i[r]));
  PetscCall(PetscSectionSetUp(from));
  PetscCall(PetscSectionCreate(PetscObjectComm((PetscObject)sf), &to));
  PetscCall(PetscSFDistributeSection(sf, from, &remote, to));
  PetscCall(PetscSFCreateSectionSF(sf, from, remote, to, &entries));
  *arrived   = AinsworthBlockRows(rows.br, rows.bc);
  arrived->n = n;
  for (PetscInt r = 0; r < n; r++) {
    PetscInt length;

    PetscCall(PetscSectionGetDof(to, r, &length));
    arrived->i.push_back(arrived->i[r] + length);
  }
  PetscCall(PetscFree(remote));
  PetscCall(PetscSectionDestroy(&from));
  PetscCall(PetscSectionDestroy(&to));
  arrived->j.resize(arrived->i[n]);
  arrived->a.resize((size_t)arrived->i[n] * rows.size());
  PetscCall(PetscSFBcastBegin(entries, MPIU_INT, rows.j.data(), arrived->j.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(entries, MPIU_INT, rows.j.data(), arrived->j.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastBegin(entries, unit.type, rows.a.data(), arrived->a.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(entries, unit.type, rows.a.data(), arrived->a.data(), MPI_REPLACE));
  PetscCall(PetscSFDestroy(&entries));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthRowsToOwners - sends the row of each ghost of cols to the owner of its node. Collective

   owner: the local node of each received row, ascending
*/
PetscErrorCode AinsworthRowsToOwners(const AinsworthColumns &cols, const AinsworthBlockRows &rows,
                                     std::vector<PetscInt> *owner, AinsworthBlockRows *arrived)
{
  PetscSF         multi, inverse;
  const PetscInt *degree;

  PetscFunctionBegin;
  owner->clear();
  *arrived = AinsworthBlockRows();
  if (!cols.sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFComputeDegreeBegin(cols.sf, &degree));
  PetscCall(PetscSFComputeDegreeEnd(cols.sf, &degree));
  for (PetscInt c = 0; c < cols.local; c++) owner->insert(owner->end(), degree[c], c);
  PetscCall(PetscSFGetMultiSF(cols.sf, &multi));
  PetscCall(PetscSFCreateInverseSF(multi, &inverse));
  PetscCall(AinsworthSendRows(inverse, rows, (PetscInt)owner->size(), arrived));
  PetscCall(PetscSFDestroy(&inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}
