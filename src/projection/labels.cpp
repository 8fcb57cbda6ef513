#include "labels.h"
#include <numeric>

/* Returns the first row of a component on this rank */
PetscInt AinsworthLabels::find(PetscInt row)
{
  while (parent[row] != row) row = parent[row] = parent[parent[row]];
  return row;
}

/* Joins a row to the one that stands for a column, or lets it stand for that */
void AinsworthLabels::link(PetscInt row, PetscInt *stands)
{
  if (*stands < 0) {
    *stands = row;
    return;
  }
  const PetscInt a = find(row), b = find(*stands);

  parent[PetscMax(a, b)] = PetscMin(a, b);
}

/* Finds the homes of rows; weight: of the columns of this rank and of others, NULL: all count */
PetscErrorCode AinsworthLabels::findHomes(Mat M, const PetscScalar *const weight[2])
{
  Mat                      part[2];
  const PetscInt          *ghosts;
  PetscInt                 n;
  PetscMPIInt              rank;
  PetscLayout              layout;
  std::vector<PetscMPIInt> owner;
  AinsworthCSR             own, others;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  home.assign(label.size(), rank);
  PetscCall(AinsworthAIJGetParts(M, part, &ghosts, &n));
  if (!part[1]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLayouts(M, NULL, &layout));
  owner.resize(n);
  for (PetscInt c = 0; c < n; c++) PetscCall(PetscLayoutFindOwner(layout, ghosts[c], &owner[c]));
  PetscCall(own.open(part[0]));
  PetscCall(others.open(part[1]));
  const auto counts = [&](int p, PetscInt c) { return !weight[p] || weight[p][c] != 0.0; };
  for (PetscInt r = 0; r < own.n; r++) {
    PetscInt    most = 0, count = 0;
    PetscMPIInt previous = -1;

    for (PetscInt k = own.ia[r]; k < own.ia[r + 1]; k++) most += counts(0, own.ja[k]);
    for (PetscInt k = others.ia[r]; k < others.ia[r + 1]; k++) { /* columns of one owner are consecutive */
      if (!counts(1, others.ja[k])) continue;
      count    = owner[others.ja[k]] == previous ? count + 1 : 1;
      previous = owner[others.ja[k]];
      if (count < most || (count == most && previous > home[r])) continue;
      most    = count;
      home[r] = previous;
    }
  }
  PetscCall(others.close());
  PetscCall(own.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Joins rows that have a column in common. Collective */
PetscErrorCode AinsworthLabels::add(const AinsworthLinks &links, Columns *columns)
{
  Mat                      part[2];
  const PetscInt          *ghosts;
  PetscInt                 n, nghosts;
  const PetscScalar       *weight[2] = {NULL, NULL}; /* of the columns of this rank, and of others */
  std::vector<PetscScalar> there;

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(links.M, part, &ghosts, &nghosts));
  PetscCall(MatGetLocalSize(links.M, NULL, &n));
  columns->own.assign(n, -1);
  columns->others.assign(nghosts, -1);
  if (links.square) std::iota(columns->own.begin(), columns->own.end(), 0);
  if (links.weight) PetscCall(VecGetArrayRead(links.weight, &weight[0]));
  PetscCall(AinsworthColumnsCreateSF(links.M, columns->sf.out()));
  if (columns->sf && links.weight) {
    there.resize(nghosts);
    PetscCall(PetscSFBcastBegin(columns->sf, MPIU_SCALAR, weight[0], there.data(), MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(columns->sf, MPIU_SCALAR, weight[0], there.data(), MPI_REPLACE));
    weight[1] = there.data();
  }
  for (int p = 0; p < 2 && part[p]; p++) {
    std::vector<PetscInt> &stands = p ? columns->others : columns->own;
    AinsworthCSR           rows;

    PetscCall(rows.open(part[p]));
    for (PetscInt r = 0; r < rows.n; r++) {
      for (PetscInt k = rows.ia[r]; k < rows.ia[r + 1]; k++)
        if (!links.weight || weight[p][rows.ja[k]] != 0.0) link(r, &stands[rows.ja[k]]);
      entries[r] += rows.ia[r + 1] - rows.ia[r];
    }
    PetscCall(rows.close());
  }
  if (columns == &all.front()) PetscCall(findHomes(links.M, weight));
  if (links.weight) PetscCall(VecRestoreArrayRead(links.weight, &weight[0]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthLabels::open(const std::vector<AinsworthLinks> &links)
{
  PetscInt n;

  PetscFunctionBegin;
  comm = PetscObjectComm((PetscObject)links[0].M);
  PetscCall(MatGetOwnershipRange(links[0].M, &rstart, NULL));
  PetscCall(MatGetLocalSize(links[0].M, &n, NULL));
  entries.assign(n, 0);
  parent.resize(n);
  std::iota(parent.begin(), parent.end(), 0);
  label.resize(n);
  for (const AinsworthLinks &one : links) {
    all.emplace_back();
    PetscCall(add(one, &all.back()));
  }
  for (PetscInt r = 0; r < n; r++) label[r] = rstart + find(r);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The smallest label wins, until no rank changes any */
PetscErrorCode AinsworthLabels::connect()
{
  PetscMPIInt           changed = 1;
  std::vector<PetscInt> owner, leaf;

  PetscFunctionBegin;
  if (!all[0].sf) PetscFunctionReturn(PETSC_SUCCESS);
  /* from here on the label of a component is that of its first row on this rank */
  while (changed) {
    changed = 0;
    for (Columns &columns : all) {
      const auto look = [&](const std::vector<PetscInt> &stands, std::vector<PetscInt> *at) {
        at->clear();
        for (PetscInt row : stands) at->push_back(row < 0 ? PETSC_MAX_INT : label[find(row)]);
      };
      const auto take = [&](const std::vector<PetscInt> &stands, const std::vector<PetscInt> &at) {
        for (size_t c = 0; c < stands.size(); c++) {
          if (stands[c] < 0 || at[c] >= label[find(stands[c])]) continue;
          label[find(stands[c])] = at[c];
          changed                = 1;
        }
      };

      look(columns.own, &owner);
      look(columns.others, &leaf);
      PetscCall(PetscSFReduceBegin(columns.sf, MPIU_INT, leaf.data(), owner.data(), MPI_MIN));
      PetscCall(PetscSFReduceEnd(columns.sf, MPIU_INT, leaf.data(), owner.data(), MPI_MIN));
      PetscCall(PetscSFBcastBegin(columns.sf, MPIU_INT, owner.data(), leaf.data(), MPI_REPLACE));
      PetscCall(PetscSFBcastEnd(columns.sf, MPIU_INT, owner.data(), leaf.data(), MPI_REPLACE));
      take(columns.own, owner);
      take(columns.others, leaf);
    }
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, comm));
  }
  for (PetscInt r = 0; r < (PetscInt)label.size(); r++) label[r] = label[find(r)];
  PetscFunctionReturn(PETSC_SUCCESS);
}
