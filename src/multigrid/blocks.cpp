#include "blocks.h"
#include "../base/csr.h"
#include "../base/arrays.h"
#include <algorithm>

/* Creates the layout of the nodes, of which this rank owns `local`. Collective */
PetscErrorCode AinsworthLayoutCreate(MPI_Comm comm, PetscInt local, AinsworthLayout *nodes)
{
  PetscLayout layout;

  PetscFunctionBegin;
  PetscCall(PetscLayoutCreateFromSizes(comm, local, PETSC_DETERMINE, 1, &layout));
  nodes->reset(layout, [](PetscLayout l) { (void)PetscLayoutDestroy(&l); });
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the columns; nodes: the global numbers of the ghosts in ascending order. Collective */
PetscErrorCode AinsworthColumns::create(const AinsworthLayout &owned, std::vector<PetscInt> &&nodes)
{
  PetscFunctionBegin;
  layout = owned;
  first  = layout->rstart;
  local  = layout->rend - first;
  ghosts = std::move(nodes);
  if (layout->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFCreate(layout->comm, sf.out()));
  PetscCall(PetscSFSetGraphLayout(sf, layout.get(), (PetscInt)ghosts.size(), NULL, PETSC_COPY_VALUES, ghosts.data()));
  PetscCall(PetscSFSetUp(sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sends values from owners to ghosts, one unit per node. Collective */
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
  if (owns(node)) return node - first;
  return local + (PetscInt)(std::lower_bound(ghosts.begin(), ghosts.end(), node) - ghosts.begin());
}

namespace
{
/* One of the two parts of the local rows of an AIJ matrix: owned or ghost columns */
struct Part : AinsworthCSR {
  std::vector<PetscInt> columns;         /* new number of each column, ghosts after owned columns; empty if unchanged */
  const PetscInt       *order = nullptr; /* local rows node by node; NULL if they are stored so */

  PetscInt row(PetscInt l) const { return order ? order[l] : l; }
};

/* Calls f(row within the node, block column, component, value) for all entries of node b */
template <class F>
void ForEach(const std::vector<Part> &parts, PetscInt b, PetscInt bs, F f)
{
  for (const Part &part : parts)
    for (PetscInt r = 0; r < bs; r++)
      for (PetscInt row = part.row(b * bs + r), k = part.ia[row]; k < part.ia[row + 1]; k++) {
        const PetscInt c = part.columns.empty() ? part.ja[k] : part.columns[part.ja[k]];
        f(r, c / bs, c % bs, part.a[k]);
      }
}

/* Checks whether all rows of node b have the same pattern of full blocks, which CopyBlocks() copies without a search */
bool FullBlocks(const std::vector<Part> &parts, PetscInt b, PetscInt bs)
{
  const Part     &in    = parts[0];
  const PetscInt  first = in.ia[b * bs], n = in.ia[b * bs + 1] - first;
  const PetscInt *ja = in.ja + first;

  if (in.order || (parts.size() > 1 && parts[1].ia[b * bs] != parts[1].ia[(b + 1) * bs])) return false;
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

/* Fills block rows, of marked nodes alone unless that is NULL, from all parts, with ascending columns in each row */
void FillBlocks(const std::vector<Part> &parts, PetscInt nodes, PetscInt places, PetscInt bs,
                const std::vector<char> *marked, AinsworthBlockRows *rows)
{
  std::vector<PetscInt> at(places, -1);
  size_t                entries = 0;

  *rows = AinsworthBlockRows(bs, bs);
  rows->i.reserve(nodes + 1);
  for (const Part &part : parts)
    for (PetscInt b = 0; b < nodes; b++)
      for (PetscInt r = 0; r < bs && (!marked || (*marked)[b]); r++)
        entries += part.ia[part.row(b * bs + r) + 1] - part.ia[part.row(b * bs + r)];
  rows->j.reserve(entries / (bs * bs) + 1);
  rows->a.reserve(entries);
  for (PetscInt b = 0; b < nodes; b++, rows->endRow()) {
    const PetscInt start = (PetscInt)rows->j.size();

    if (marked && !(*marked)[b]) continue;
    if (FullBlocks(parts, b, bs)) {
      CopyBlocks(parts[0], b, bs, rows);
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
    ForEach(parts, b, bs,
            [&](PetscInt r, PetscInt place, PetscInt c, PetscScalar v) { rows->block(at[place])[r * bs + c] = v; });
  }
}
} // namespace

/*
   Numbers the unknowns node by node: owned ones locally, ghosts globally; without an order, owned is empty and ghosts
   keep their numbers. Collective
*/
static PetscErrorCode NumberUnknowns(Mat A, const std::vector<PetscInt> &order, PetscInt ng, const PetscInt garray[],
                                     std::vector<PetscInt> *owned, std::vector<PetscInt> *ghosts)
{
  PetscLayout           layout;
  PetscInt              first;
  std::vector<PetscInt> all;
  PetscMPIInt           sorted = !order.empty();

  PetscFunctionBegin;
  ghosts->assign(garray, garray + ng);
  *owned = AinsworthInverse(order);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &sorted, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)A)));
  if (!sorted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRangeColumn(A, &first, NULL));
  for (PetscInt l : *owned) all.push_back(first + l);
  PetscCall(MatGetLayouts(A, NULL, &layout));
  PetscCall(AinsworthFetch(PetscObjectComm((PetscObject)A), layout, all, ng, garray, ghosts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBlockMatCreate - converts a square AIJ matrix to blocks of size bs, which divides the number of rows on
   every rank. Collective

   order: the local rows node by node; empty if they are stored so. marked: the local nodes whose rows are wanted, the
   others are left empty; NULL: all
*/
PetscErrorCode AinsworthBlockMatCreate(Mat A, PetscInt bs, const std::vector<PetscInt> &order,
                                       const std::vector<char> *marked, AinsworthBlockMat *B)
{
  PetscInt              n, ng;
  Mat                   part[2];
  const PetscInt       *garray;
  AinsworthLayout       nodes;
  std::vector<PetscInt> ghosts, numbers;
  std::vector<Part>     parts;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(AinsworthLayoutCreate(PetscObjectComm((PetscObject)A), n / bs, &nodes));
  PetscCall(AinsworthAIJGetParts(A, part, &garray, &ng));
  parts.resize(part[1] ? 2 : 1);
  PetscCall(NumberUnknowns(A, order, ng, garray, &parts[0].columns, &numbers));
  for (PetscInt number : numbers) ghosts.push_back(number / bs);
  AinsworthSortUnique(&ghosts);
  PetscCall(B->cols.create(nodes, std::move(ghosts)));
  for (size_t p = 0; p < parts.size(); p++) PetscCall(parts[p].open(part[p]));
  for (PetscInt number : numbers) parts[1].columns.push_back(B->cols.place(number / bs) * bs + number % bs);
  for (Part &part : parts) part.order = order.empty() ? NULL : order.data();
  FillBlocks(parts, n / bs, B->cols.count(), bs, marked, &B->rows);
  for (Part &part : parts) PetscCall(part.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBlockMatAssemble - creates a matrix from pieces of the local rows; pieces in the same place are added.
   Collective
*/
PetscErrorCode AinsworthBlockMatAssemble(const AinsworthLayout &nodes, PetscInt bs,
                                         std::vector<std::vector<AinsworthPiece>> &pieces, AinsworthBlockMat *B)
{
  std::vector<PetscInt> ghosts;
  AinsworthBlockRows   &rows = B->rows;

  PetscFunctionBegin;
  for (const auto &row : pieces)
    for (const AinsworthPiece &piece : row)
      if (piece.node < nodes->rstart || piece.node >= nodes->rend) ghosts.push_back(piece.node);
  AinsworthSortUnique(&ghosts);
  PetscCall(B->cols.create(nodes, std::move(ghosts)));
  rows = AinsworthBlockRows(bs, bs);
  for (auto &row : pieces) {
    std::stable_sort(row.begin(), row.end(),
                     [](const AinsworthPiece &a, const AinsworthPiece &b) { return a.node < b.node; });
    for (auto piece = row.begin(); piece != row.end();) {
      const PetscInt node = piece->node;

      rows.j.push_back(B->cols.place(node));
      rows.a.resize(rows.a.size() + bs * bs, 0.0);
      PetscScalar *sum = &rows.a[rows.a.size() - bs * bs];
      for (; piece != row.end() && piece->node == node; ++piece)
        for (PetscInt p = 0; p < bs; p++)
          for (PetscInt q = 0; q < bs; q++)
            sum[p * bs + q] += piece->adjoint ? PetscConj(piece->values[q * bs + p]) : piece->values[p * bs + q];
    }
    rows.endRow();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBlocksToAIJ - converts block rows, with columns ascending by node number, to AIJ with the sizes of another
   matrix. Collective
*/
PetscErrorCode AinsworthBlocksToAIJ(const AinsworthBlockRows &rows, const AinsworthColumns &cols, Mat like, Mat *aij)
{
  PetscInt                 m, n, M, N;
  std::vector<PetscInt>    i = {0}, j;
  std::vector<PetscScalar> a;

  PetscFunctionBegin;
  for (PetscInt l = 0; l < rows.n * rows.br; l++) {
    for (PetscInt k = rows.i[l / rows.br]; k < rows.i[l / rows.br + 1]; k++) {
      const PetscScalar *row = rows.block(k) + l % rows.br * rows.bc;

      for (PetscInt c = 0; c < rows.bc; c++) j.push_back(cols.node(rows.j[k]) * rows.bc + c);
      a.insert(a.end(), row, row + rows.bc);
    }
    i.push_back((PetscInt)j.size());
  }
  PetscCall(MatGetLocalSize(like, &m, &n));
  PetscCall(MatGetSize(like, &M, &N));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)like), aij));
  PetscCall(MatSetSizes(*aij, m, n, M, N));
  PetscCall(MatSetBlockSizes(*aij, rows.br, rows.bc));
  PetscCall(MatSetType(*aij, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(*aij, i.data(), j.data(), a.data()));
  PetscCall(MatMPIAIJSetPreallocationCSR(*aij, i.data(), j.data(), a.data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}
