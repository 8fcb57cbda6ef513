/* Merges AIJ blocks, some of which may be absent, into one AIJ matrix in one pass over their entries */
#include "saddle.h"
#include <algorithm>

/* Column numbers of a nest: each rank has its parts of all fields, one after the other */
struct Numbering {
  PetscMPIInt                   size = 1;
  std::vector<const PetscInt *> ranges;  /* of each field */
  std::vector<PetscInt>         offsets; /* of each field in the local columns */
  PetscInt                      local = 0;

  /* Returns the global number in the nest of an unknown of any rank */
  PetscInt operator()(size_t field, PetscInt unknown) const
  {
    const PetscInt *range = ranges[field];
    const size_t    rank  = std::upper_bound(range + 1, range + size + 1, unknown) - range - 1;
    PetscInt        whole = unknown - range[rank];

    for (size_t f = 0; f < ranges.size(); f++) whole += ranges[f][rank + (f < field)];
    return whole;
  }
};

static PetscErrorCode AddField(Mat block, Numbering *numbering)
{
  const PetscInt *ranges;
  PetscInt        n;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)block), &numbering->size));
  PetscCall(MatGetOwnershipRangesColumn(block, &ranges));
  PetscCall(MatGetLocalSize(block, NULL, &n));
  numbering->ranges.push_back(ranges);
  numbering->offsets.push_back(numbering->local);
  numbering->local += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells whether the unknowns of the nest are those of its blocks one after the other, as MatCreateNest() numbers them without index sets. Collective */
static PetscErrorCode IsInOrder(MPI_Comm comm, const std::vector<IS> &sets, PetscBool *order)
{
  PetscInt next = 0, all = 0, first, n;

  PetscFunctionBegin;
  *order = PETSC_TRUE;
  for (IS is : sets) {
    PetscCall(ISGetLocalSize(is, &n));
    all += n;
  }
  PetscCallMPI(MPI_Exscan(&all, &next, 1, MPIU_INT, MPI_SUM, comm));
  for (IS is : sets) {
    PetscBool contiguous;

    PetscCall(ISGetLocalSize(is, &n));
    PetscCall(ISContiguousLocal(is, next, next + n, &first, &contiguous));
    if (n && (!contiguous || first)) *order = PETSC_FALSE;
    next += n;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, order, 1, AINSWORTH_MPI_BOOL, MPI_LAND, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block and its column maps, for local columns and for those of other ranks */
struct Block {
  AinsworthCSR          part[2];
  std::vector<PetscInt> map[2];
};

static PetscErrorCode BlockGet(Mat M, size_t field, const Numbering &cols, Block *block)
{
  Mat             seq[2];
  const PetscInt *ghosts;
  PetscInt        n, nghosts;

  PetscFunctionBegin;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthAIJGetParts(M, seq, &ghosts, &nghosts));
  PetscCall(MatGetLocalSize(M, NULL, &n));
  for (PetscInt c = 0; c < n; c++) block->map[0].push_back(cols.offsets[field] + c);
  for (PetscInt c = 0; c < nghosts; c++) block->map[1].push_back(cols(field, ghosts[c]));
  for (int p = 0; p < 2; p++) PetscCall(block->part[p].open(seq[p]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sorts a row: each rank has unknowns of all fields, so columns of other ranks need not be in the order of the fields */
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

/* Appends a row of the merged matrix, field by field */
static void Append(const Block blocks[], size_t nc, int p, PetscInt r, PetscInt *j, PetscScalar *a)
{
  PetscInt n      = 0;
  bool     rising = true;

  for (size_t b = 0; b < nc; b++) {
    const AinsworthCSR &part = blocks[b].part[p];

    if (!part.mat) continue;
    for (PetscInt k = part.ia[r]; k < part.ia[r + 1]; k++) {
      j[n]   = blocks[b].map[p][part.ja[k]];
      a[n]   = part.a[k];
      rising = rising && (n == 0 || j[n] > j[n - 1]);
      n++;
    }
  }
  if (!rising) Sort(n, j, a);
}

/* Merges the rows of all blocks, for local columns (p = 0) or those of other ranks (p = 1) */
static std::unique_ptr<AinsworthRows> Merge(const std::vector<Block> &blocks, size_t nc, int p)
{
  std::unique_ptr<AinsworthRows> rows(new AinsworthRows);

  for (const Block *row = blocks.data(); row < blocks.data() + blocks.size(); row += nc) {
    PetscInt n = 0;

    for (size_t b = 0; b < nc; b++) n = PetscMax(n, row[b].part[0].n);
    for (PetscInt r = 0; r < n; r++) {
      PetscInt length = 0;

      for (size_t b = 0; b < nc; b++) length += row[b].part[p].mat ? row[b].part[p].ia[r + 1] - row[b].part[p].ia[r] : 0;
      rows->i.push_back(rows->i.back() + length);
    }
  }
  rows->reserve(rows->i.back());
  size_t at = 0;

  for (const Block *row = blocks.data(); row < blocks.data() + blocks.size(); row += nc) {
    PetscInt n = 0;

    for (size_t b = 0; b < nc; b++) n = PetscMax(n, row[b].part[0].n);
    for (PetscInt r = 0; r < n; r++, at++) Append(row, nc, p, r, rows->j.get() + rows->i[at], rows->a.get() + rows->i[at]);
  }
  return rows;
}

/*
   AinsworthMergeAIJ - merges AIJ blocks on the index sets of a nest into one AIJ matrix. Collective

   *aij is NULL if these sets are not in the order of the blocks, or if a row or column has no block.
*/
PetscErrorCode AinsworthMergeAIJ(MPI_Comm comm, const std::vector<IS> &rows, const std::vector<IS> &cols, const std::vector<Mat> &mats, Mat *aij)
{
  const size_t       nr = rows.size(), nc = cols.size();
  std::vector<Block> blocks(nr * nc);
  Numbering          numbering;
  PetscBool          order[2];

  PetscFunctionBegin;
  *aij = NULL;
  PetscCall(IsInOrder(comm, rows, &order[0]));
  PetscCall(IsInOrder(comm, cols, &order[1]));
  if (!order[0] || !order[1]) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t i = 0; i < nr; i++) {
    size_t j = 0;

    while (j < nc && !mats[i * nc + j]) j++;
    if (j == nc) PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (size_t j = 0; j < nc; j++) {
    size_t i = 0;

    while (i < nr && !mats[i * nc + j]) i++;
    if (i == nr) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(AddField(mats[i * nc + j], &numbering));
  }
  for (size_t k = 0; k < nr * nc; k++) PetscCall(BlockGet(mats[k], k % nc, numbering, &blocks[k]));
  PetscCall(AinsworthMatCreateFromRows(comm, numbering.local, Merge(blocks, nc, 0), Merge(blocks, nc, 1), aij));
  for (Block &block : blocks)
    for (AinsworthCSR &part : block.part) PetscCall(part.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}
