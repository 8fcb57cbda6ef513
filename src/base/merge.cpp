/* Merges AIJ blocks, some of which may be absent, into one AIJ matrix in one pass over their entries */
#include "matrices.h"
#include "lists.h"
#include <algorithm>

namespace
{
/* A block, and its columns in the nest: local numbers of local columns, global ones of those of other ranks */
struct Block {
  AinsworthCSR          part[2];
  std::vector<PetscInt> map[2];
};

/* Where a row of the nest is */
struct Place {
  size_t   field = 0;
  PetscInt row   = -1;
};
} // namespace

/* Opens a block whose columns have the numbers `cols` in the nest, `first` the first of this rank. Collective */
static PetscErrorCode BlockOpen(Mat M, IS cols, PetscInt first, Block *block)
{
  Mat             seq[2];
  const PetscInt *ghosts;
  PetscInt        n;
  PetscLayout     layout;

  PetscFunctionBegin;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthAIJGetParts(M, seq, &ghosts, &n));
  PetscCall(MatGetLayouts(M, NULL, &layout));
  PetscCall(AinsworthISToList(cols, &block->map[0]));
  PetscCall(AinsworthFetch(PetscObjectComm((PetscObject)M), layout, block->map[0], n, ghosts, &block->map[1]));
  for (PetscInt &column : block->map[0]) column -= first;
  for (int p = 0; p < 2; p++) PetscCall(block->part[p].open(seq[p]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the field and the row in it of each local number of a nest, and the first number of this rank. Collective

   *good becomes false if the index sets are not a numbering of what this rank has.
*/
static PetscErrorCode FindPlaces(MPI_Comm comm, const std::vector<IS> &sets, PetscInt *first,
                                 std::vector<Place> *places, PetscBool *good)
{
  std::vector<PetscInt> numbers;
  PetscInt              n, local = 0;

  PetscFunctionBegin;
  for (IS set : sets) {
    PetscCall(ISGetLocalSize(set, &n));
    local += n;
  }
  *first = 0;
  PetscCallMPI(MPI_Exscan(&local, first, 1, MPIU_INT, MPI_SUM, comm));
  places->resize(local);
  for (size_t i = 0; i < sets.size(); i++) {
    PetscCall(AinsworthISToList(sets[i], &numbers));
    for (PetscInt r = 0; r < (PetscInt)numbers.size(); r++) {
      const PetscInt at = numbers[r] - *first;

      if (at < 0 || at >= local) *good = PETSC_FALSE;
      else (*places)[at] = {i, r};
    }
  }
  for (const Place &place : *places) *good = (PetscBool)(*good && place.row >= 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sorts a row: columns of other ranks are in the order of ranks, not of fields */
static void Sort(PetscInt n, PetscInt j[], PetscScalar a[])
{
  std::vector<std::pair<PetscInt, PetscScalar>> row(n);

  for (PetscInt k = 0; k < n; k++) row[k] = {j[k], a[k]};
  std::sort(row.begin(), row.end(), [](const auto &x, const auto &y) { return x.first < y.first; });
  for (PetscInt k = 0; k < n; k++) {
    j[k] = row[k].first;
    a[k] = row[k].second;
  }
}

/* Merges the rows of nc blocks each, for local columns (p = 0) or those of other ranks (p = 1) */
static std::unique_ptr<AinsworthRows> Merge(const std::vector<Place> &places, const std::vector<Block> &blocks,
                                            size_t nc, int p)
{
  std::unique_ptr<AinsworthRows> rows(new AinsworthRows);
  PetscInt                       n = 0;

  for (const Place &at : places) {
    for (size_t b = at.field * nc; b < (at.field + 1) * nc; b++)
      if (blocks[b].part[p].mat) n += blocks[b].part[p].ia[at.row + 1] - blocks[b].part[p].ia[at.row];
    rows->i.push_back(n);
  }
  rows->reserve(n);
  n = 0;
  for (const Place &at : places) {
    const PetscInt start  = n;
    bool           rising = true;

    for (size_t b = at.field * nc; b < (at.field + 1) * nc; b++) {
      const AinsworthCSR &part = blocks[b].part[p];

      for (PetscInt k = part.mat ? part.ia[at.row] : 0, end = part.mat ? part.ia[at.row + 1] : 0; k < end; k++, n++) {
        rows->j[n] = blocks[b].map[p][part.ja[k]];
        rows->a[n] = part.a[k];
        rising     = rising && (n == start || rows->j[n] > rows->j[n - 1]);
      }
    }
    if (!rising) Sort(n - start, rows->j.get() + start, rows->a.get() + start);
  }
  return rows;
}

/*
   AinsworthMergeAIJ - merges AIJ blocks on the index sets of a nest into one AIJ matrix. Collective

   *aij is NULL if these sets are not a numbering of what each rank has.
*/
PetscErrorCode AinsworthMergeAIJ(MPI_Comm comm, const std::vector<IS> &rows, const std::vector<IS> &cols,
                                 const std::vector<Mat> &mats, Mat *aij)
{
  const size_t       nc = cols.size();
  std::vector<Block> blocks(mats.size());
  std::vector<Place> places[2];
  PetscInt           first[2];
  PetscBool          good = PETSC_TRUE;

  PetscFunctionBegin;
  *aij = NULL;
  PetscCall(FindPlaces(comm, rows, &first[0], &places[0], &good));
  PetscCall(FindPlaces(comm, cols, &first[1], &places[1], &good));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &good, 1, AINSWORTH_MPI_BOOL, MPI_LAND, comm));
  if (!good) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t k = 0; k < mats.size(); k++) PetscCall(BlockOpen(mats[k], cols[k % nc], first[1], &blocks[k]));
  PetscCall(AinsworthMatCreateFromRows(comm, (PetscInt)places[1].size(), Merge(places[0], blocks, nc, 0),
                                       Merge(places[0], blocks, nc, 1), aij));
  for (Block &block : blocks)
    for (AinsworthCSR &part : block.part) PetscCall(part.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}
