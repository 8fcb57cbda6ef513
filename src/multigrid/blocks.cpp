#include "blocks.h"
#include "../csr.h"
#include <algorithm>

void AinsworthSortUnique(std::vector<PetscInt> &list)
{
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

/* nodes: the numbers of the ghosts, rising. Collective */
PetscErrorCode AinsworthColumns::create(PetscLayout given, std::vector<PetscInt> &&nodes)
{
  PetscMPIInt size;
  PetscInt    last;

  PetscFunctionBegin;
  PetscCall(PetscLayoutReference(given, &layout));
  PetscCall(PetscLayoutGetRange(layout, &first, &last));
  local  = last - first;
  ghosts = std::move(nodes);
  PetscCallMPI(MPI_Comm_size(layout->comm, &size));
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFCreate(layout->comm, &sf));
  PetscCall(PetscSFSetGraphLayout(sf, layout, (PetscInt)ghosts.size(), NULL, PETSC_COPY_VALUES, ghosts.data()));
  PetscCall(PetscSFSetUp(sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthColumns::destroy()
{
  PetscFunctionBegin;
  PetscCall(PetscLayoutDestroy(&layout));
  PetscCall(PetscSFDestroy(&sf));
  ghosts.clear();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values of the ghosts from their owners, one unit a node */
PetscErrorCode AinsworthColumns::toGhosts(MPI_Datatype unit, const void *owned, void *ghost) const
{
  PetscFunctionBegin;
  if (!sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFBcastBegin(sf, unit, owned, ghost, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, unit, owned, ghost, MPI_REPLACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt AinsworthColumns::place(PetscInt node) const
{
  if (node >= first && node < first + local) return node - first;
  return local + (PetscInt)(std::lower_bound(ghosts.begin(), ghosts.end(), node) - ghosts.begin());
}

namespace
{
/* One of the two parts of the local rows of an AIJ matrix: owned columns, or ghost columns */
struct Part : AinsworthCSR {
  std::vector<PetscInt> place; /* of the block column of each ghost column, none for owned columns */
  std::vector<PetscInt> component;
};

/* f(row within the node, block column, component, entry) for all entries of node b */
template <class F>
void ForEach(const std::vector<Part> &parts, PetscInt b, PetscInt bs, F f)
{
  for (const Part &part : parts)
    for (PetscInt r = 0; r < bs; r++)
      for (PetscInt k = part.ia[b * bs + r]; k < part.ia[b * bs + r + 1]; k++) {
        const PetscInt c = part.ja[k];
        if (part.place.empty()) f(r, c / bs, c % bs, part.a[k]);
        else f(r, part.place[c], part.component[c], part.a[k]);
      }
}

/* Are the rows of node b alike, and full in all of their blocks? Then they need no search */
bool FullBlocks(const std::vector<Part> &parts, PetscInt b, PetscInt bs)
{
  const Part     &in    = parts[0];
  const PetscInt  first = in.ia[b * bs], n = in.ia[b * bs + 1] - first;
  const PetscInt *ja = in.ja + first;

  if (parts.size() > 1 && parts[1].ia[b * bs] != parts[1].ia[(b + 1) * bs]) return false;
  if (n % bs || in.ia[(b + 1) * bs] - first != bs * n) return false;
  for (PetscInt k = 0; k < n; k++)
    if (ja[k] != ja[k - k % bs] + k % bs || ja[k - k % bs] % bs) return false;
  for (PetscInt r = 1; r < bs; r++)
    if (in.ia[b * bs + r] - first != r * n || !std::equal(ja, ja + n, in.ja + in.ia[b * bs + r])) return false;
  return true;
}

void CopyBlocks(const Part &in, PetscInt b, PetscInt bs, AinsworthBlockRows *rows)
{
  const PetscInt     first = in.ia[b * bs], n = in.ia[b * bs + 1] - first;
  const size_t       start = rows->a.size();
  const PetscScalar *from  = in.a + first;

  rows->a.resize(start + (size_t)n * bs);
  PetscScalar *to = rows->a.data() + start;
  for (PetscInt k = 0; k < n; k += bs) {
    rows->j.push_back(in.ja[first + k] / bs);
    for (PetscInt r = 0; r < bs; r++)
      for (PetscInt c = 0; c < bs; c++) *to++ = from[r * n + k + c];
  }
}

/* Blocks from the rows of all parts; their places rise along each row */
void FillBlocks(const std::vector<Part> &parts, PetscInt nodes, PetscInt places, PetscInt bs, AinsworthBlockRows *rows)
{
  std::vector<PetscInt> at(places, -1);
  size_t                entries = 0;

  rows->n  = nodes;
  rows->br = rows->bc = bs;
  rows->i.assign(1, 0);
  rows->i.reserve(nodes + 1);
  for (const Part &part : parts) entries += part.ia[nodes * bs];
  rows->j.reserve(entries / (bs * bs) + 1);
  rows->a.reserve(entries);
  for (PetscInt b = 0; b < nodes; b++) {
    const PetscInt start = (PetscInt)rows->j.size();

    if (FullBlocks(parts, b, bs)) {
      CopyBlocks(parts[0], b, bs, rows);
      rows->i.push_back((PetscInt)rows->j.size());
      continue;
    }
    ForEach(parts, b, bs, [&](PetscInt, PetscInt place, PetscInt, PetscScalar) {
      if (at[place] < start) {
        at[place] = start;
        rows->j.push_back(place);
      }
    });
    std::sort(rows->j.begin() + start, rows->j.end());
    for (PetscInt k = start; k < (PetscInt)rows->j.size(); k++) at[rows->j[k]] = k;
    rows->a.resize(rows->j.size() * bs * bs, 0.0);
    ForEach(parts, b, bs, [&](PetscInt r, PetscInt place, PetscInt c, PetscScalar v) { rows->block(at[place])[r * bs + c] = v; });
    rows->i.push_back((PetscInt)rows->j.size());
  }
}
} // namespace

/* AinsworthBlockMatCreate - the rows of an AIJ matrix on this rank, n x n, in blocks of bs, which divides the rows of every rank */
PetscErrorCode AinsworthBlockMatCreate(Mat A, PetscInt bs, AinsworthBlockMat *B)
{
  PetscInt              n, N;
  PetscBool             mpi;
  PetscLayout           layout;
  std::vector<PetscInt> ghosts;
  std::vector<Part>     parts(1);

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(PetscLayoutCreateFromSizes(PetscObjectComm((PetscObject)A), n / bs, N / bs, 1, &layout));
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)A, MATMPIAIJ, &mpi));
  if (mpi) {
    Mat             inside, outside;
    const PetscInt *garray;
    PetscInt        ng;

    PetscCall(MatMPIAIJGetSeqAIJ(A, &inside, &outside, &garray));
    PetscCall(MatGetSize(outside, NULL, &ng));
    parts.resize(2);
    PetscCall(parts[0].open(inside));
    PetscCall(parts[1].open(outside));
    for (PetscInt k = 0; k < ng; k++) ghosts.push_back(garray[k] / bs);
    AinsworthSortUnique(ghosts);
    PetscCall(B->cols.create(layout, std::move(ghosts)));
    parts[1].place.resize(PetscMax(ng, 1));
    parts[1].component.resize(ng);
    for (PetscInt k = 0; k < ng; k++) {
      parts[1].place[k]     = B->cols.place(garray[k] / bs);
      parts[1].component[k] = garray[k] % bs;
    }
  } else {
    PetscCall(B->cols.create(layout, std::move(ghosts)));
    PetscCall(parts[0].open(A));
  }
  PetscCall(PetscLayoutDestroy(&layout));
  FillBlocks(parts, n / bs, B->cols.count(), bs, &B->rows);
  for (Part &part : parts) PetscCall(part.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}
