#include "sum.h"

void AinsworthNode::read(AinsworthPart &part, PetscInt first)
{
  for (PetscInt k = 0; k < bs; k++) given[k] = part.row(first + k, k);
}

void AinsworthNode::compute(AinsworthPart &part, PetscInt first)
{
  read(part, first);
  if (bs == 1) rows[0] = given[0];
  else if (bs == 2) turn<2>();
  else turn<3>();
}

/* Entries of each row of the node */
PetscInt AinsworthNode::count(AinsworthPart &part, PetscInt first)
{
  read(part, first);
  if (bs == 1) return given[0].n;
  return bs == 2 ? width<2>() : width<3>();
}

/* The next block column where one of the rows has an entry, N: the components of a node */
template <PetscInt N>
static bool NextBlock(const AinsworthRow given[], const PetscInt at[], PetscInt *block)
{
  bool found = false;

  for (PetscInt k = 0; k < N; k++) {
    if (at[k] == given[k].n) continue;
    const PetscInt mine = given[k].columns[at[k]] / N;
    *block              = found ? PetscMin(*block, mine) : mine;
    found               = true;
  }
  return found;
}

template <PetscInt N>
PetscInt AinsworthNode::width() const
{
  PetscInt at[N] = {}, block, n = 0;

  for (; NextBlock<N>(given, at, &block); n += N)
    for (PetscInt k = 0; k < N; k++)
      while (at[k] < given[k].n && given[k].columns[at[k]] < (block + 1) * N) at[k]++;
  return n;
}

/* T M T', block after block, wherever a row has an entry in it */
template <PetscInt N>
void AinsworthNode::turn()
{
  const auto &T     = frame->T;
  PetscInt    at[N] = {}, block, n = 0, most = 0;

  for (PetscInt k = 0; k < N; k++) most += N * given[k].n;
  if ((size_t)most > columns.size()) {
    columns.resize(most);
    for (PetscInt k = 0; k < N; k++) values[k].resize(most);
  }
  for (; NextBlock<N>(given, at, &block); n += N) {
    PetscScalar M[N][N] = {}, MT[N][N] = {};

    for (PetscInt k = 0; k < N; k++)
      for (; at[k] < given[k].n && given[k].columns[at[k]] < (block + 1) * N; at[k]++) M[k][given[k].columns[at[k]] - block * N] = given[k].values[at[k]];
    for (PetscInt k = 0; k < N; k++)
      for (PetscInt l = 0; l < N; l++)
        for (PetscInt j = 0; j < N; j++) MT[k][l] += M[k][j] * T[l][j];
    for (PetscInt k = 0; k < N; k++) {
      columns[n + k] = block * N + k;
      for (PetscInt l = 0; l < N; l++) {
        PetscScalar sum = 0.0;
        for (PetscInt j = 0; j < N; j++) sum += T[k][j] * MT[j][l];
        values[k][n + l] = sum;
      }
    }
  }
  for (PetscInt k = 0; k < N; k++) rows[k] = {columns.data(), values[k].data(), n};
}
