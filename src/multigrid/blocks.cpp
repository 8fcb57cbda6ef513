#include "blocks.h"
#include "../base/arrays.h"
#include "../base/layouts.h"
#include <algorithm>
#include <numeric>

/*
   Creates the layout of the nodes, of which this rank owns `local`; it keeps its communicator, as it may outlive the
   matrix. Collective
*/
PetscErrorCode AinsworthLayoutCreate(MPI_Comm comm, PetscInt local, AinsworthLayout *nodes)
{
  PetscLayout layout;
  MPI_Comm    own;

  PetscFunctionBegin;
  PetscCall(PetscCommDuplicate(comm, &own, NULL));
  PetscCall(AinsworthLayoutOfSize(own, local, &layout));
  nodes->reset(layout, [own](PetscLayout l) {
    MPI_Comm kept = own;

    (void)PetscLayoutDestroy(&l);
    (void)PetscCommDestroy(&kept);
  });
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the columns; nodes: the global numbers of the ghosts, in any order. Collective */
PetscErrorCode AinsworthColumns::create(const AinsworthLayout &owned, std::vector<PetscInt> &&nodes)
{
  PetscFunctionBegin;
  layout = owned;
  first  = layout->rstart;
  local  = layout->rend - first;
  ghosts = std::move(nodes);
  AinsworthSortUnique(&ghosts);
  if (layout->size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFCreate(layout->comm, sf.out()));
  PetscCall(PetscSFSetGraphLayout(sf, layout.get(), (PetscInt)ghosts.size(), NULL, PETSC_COPY_VALUES, ghosts.data()));
  PetscCall(PetscSFSetUp(sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets up the columns of nodes, whose global numbers become places; -1 remains. Collective */
PetscErrorCode AinsworthColumns::createAt(const AinsworthLayout &owned, std::vector<PetscInt> *nodes)
{
  std::vector<PetscInt> outside;

  PetscFunctionBegin;
  for (PetscInt node : *nodes)
    if (node >= 0 && (node < owned->rstart || node >= owned->rend)) outside.push_back(node);
  PetscCall(create(owned, std::move(outside)));
  for (PetscInt &node : *nodes)
    if (node >= 0) node = place(node);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Sets up columns whose ghosts are the nodes that this rank has made, whoever owns them, numbered rank by rank.
   Collective
*/
PetscErrorCode AinsworthColumns::createMade(const AinsworthLayout &owned, PetscInt made)
{
  PetscInt              before = 0;
  std::vector<PetscInt> nodes(made);

  PetscFunctionBegin;
  PetscCallMPI(MPI_Exscan(&made, &before, 1, MPIU_INT, MPI_SUM, owned->comm));
  std::iota(nodes.begin(), nodes.end(), before);
  PetscCall(create(owned, std::move(nodes)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the owned nodes that are ghosts of other ranks. Collective */
PetscErrorCode AinsworthColumns::findShared(std::vector<char> *shared) const
{
  const PetscInt *degree;

  PetscFunctionBegin;
  shared->assign(local, 0);
  if (!sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFComputeDegreeBegin(sf, &degree));
  PetscCall(PetscSFComputeDegreeEnd(sf, &degree));
  for (PetscInt i = 0; i < local; i++) (*shared)[i] = degree[i] > 0;
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

/* Stores the values, so that what has them now need not be there any longer */
void AinsworthBlockMat::store()
{
  if (!reader) return;
  rows.a.reserve(rows.j.size() * rows.size());
  for (PetscInt i = 0; i < rows.n; i++) {
    const PetscScalar *a = row(i);

    rows.a.insert(rows.a.end(), a, a + (size_t)(rows.i[i + 1] - rows.i[i]) * rows.size());
  }
  reader.reset();
}

/* Appends the sum of the pieces in one place, in [piece, end) */
static void AppendSum(const AinsworthPiece *piece, const AinsworthPiece *end, PetscInt place, AinsworthBlockRows *rows)
{
  const PetscInt bs = rows->br;

  rows->j.push_back(place);
  rows->a.resize(rows->a.size() + bs * bs, 0.0);
  PetscScalar *sum = &rows->a[rows->a.size() - bs * bs];
  for (; piece != end; ++piece)
    for (PetscInt p = 0; p < bs; p++)
      for (PetscInt q = 0; q < bs; q++)
        sum[p * bs + q] += piece->adjoint ? PetscConj(piece->values[q * bs + p]) : piece->values[p * bs + q];
}

/*
   AinsworthHalfAssemble - creates a Hermitian matrix from pieces of the local rows, of which those below the diagonal
   are not needed; pieces in the same place are added. Collective
*/
PetscErrorCode AinsworthHalfAssemble(const AinsworthLayout &nodes, PetscInt bs,
                                     std::vector<std::vector<AinsworthPiece>> &pieces, AinsworthHalf *half)
{
  std::vector<PetscInt> ghosts;
  auto                  upper   = std::make_shared<AinsworthBlockRows>(bs, bs);
  AinsworthBlockRows   &outside = half->outside.rows;
  AinsworthColumns     &cols    = half->outside.cols;
  size_t                blocks  = 0;

  PetscFunctionBegin;
  for (size_t i = 0; i < pieces.size(); i++) {
    auto &row = pieces[i];

    row.erase(std::remove_if(row.begin(), row.end(),
                             [&](const AinsworthPiece &p) {
                               return p.node >= nodes->rstart && p.node < nodes->rstart + (PetscInt)i;
                             }),
              row.end());
    std::stable_sort(row.begin(), row.end(),
                     [](const AinsworthPiece &a, const AinsworthPiece &b) { return a.node < b.node; });
    for (size_t k = 0; k < row.size(); k++) {
      const bool owned = row[k].node >= nodes->rstart && row[k].node < nodes->rend;

      if (!owned) ghosts.push_back(row[k].node);
      else blocks += k == 0 || row[k].node != row[k - 1].node;
    }
  }
  PetscCall(cols.create(nodes, std::move(ghosts)));
  outside = AinsworthBlockRows(bs, bs);
  upper->j.reserve(blocks + pieces.size());
  upper->a.reserve((blocks + pieces.size()) * bs * bs + 4);
  for (const auto &row : pieces) {
    const PetscInt        i     = upper->n;
    const AinsworthPiece *piece = row.data(), *last = piece + row.size(), *next;
    const bool has = std::any_of(piece, last, [&](const AinsworthPiece &p) { return p.node == cols.first + i; });

    if (!has) AppendSum(last, last, i, upper.get());
    for (; piece != last; piece = next) {
      next = std::find_if(piece, last, [piece](const AinsworthPiece &p) { return p.node != piece->node; });
      AppendSum(piece, next, cols.place(piece->node), cols.owns(piece->node) ? upper.get() : &outside);
    }
    upper->endRow();
    outside.endRow();
  }
  upper->a.resize(upper->a.size() + 4, 0.0); /* the last load of four may read beyond the last block */
  half->upper = upper;
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* The rows of a Hermitian matrix of which half is stored, and a rest with blocks anywhere */
class HalfReader : public AinsworthRowReader {
public:
  HalfReader(const std::shared_ptr<const AinsworthBlockRows> &half, AinsworthBlockRows &&others, PetscInt places)
    : upper(half), rest(std::move(others)), below(half->n + 1, 0), at(places, -1)
  {
    const AinsworthBlockRows &U = *upper;

    for (PetscInt i = 0; i < U.n; i++)
      for (PetscInt k = U.i[i] + 1; k < U.i[i + 1]; k++) below[U.j[k] + 1]++;
    for (PetscInt i = 0; i < U.n; i++) below[i + 1] += below[i];
    row.resize(below[U.n]);
    block.resize(below[U.n]);
    std::vector<PetscInt> next(below);
    for (PetscInt i = 0; i < U.n; i++)
      for (PetscInt k = U.i[i] + 1; k < U.i[i + 1]; k++) {
        row[next[U.j[k]]]     = i;
        block[next[U.j[k]]++] = k;
      }
  }

  void findColumns(PetscInt i, AinsworthBlockRows *pattern)
  {
    const size_t start = pattern->j.size();

    forEach(i, [&](PetscInt j, const PetscScalar *, bool) {
      if (at[j] == i) return;
      at[j] = i;
      pattern->j.push_back(j);
    });
    std::sort(pattern->j.begin() + start, pattern->j.end());
  }

  const PetscScalar *read(const AinsworthBlockRows &pattern, PetscInt i) override
  {
    const PetscInt start = pattern.i[i], bs = pattern.br, size = bs * bs;

    room.assign((size_t)(pattern.i[i + 1] - start) * size, 0.0);
    for (PetscInt k = start; k < pattern.i[i + 1]; k++) at[pattern.j[k]] = k - start;
    forEach(i, [&](PetscInt j, const PetscScalar *a, bool adjoint) {
      PetscScalar *to = &room[(size_t)at[j] * size];

      if (!adjoint)
        for (PetscInt q = 0; q < size; q++) to[q] += a[q];
      else
        for (PetscInt p = 0; p < bs; p++)
          for (PetscInt q = 0; q < bs; q++) to[p * bs + q] += PetscConj(a[q * bs + p]);
    });
    return room.data();
  }

private:
  std::shared_ptr<const AinsworthBlockRows> upper;
  AinsworthBlockRows                        rest;
  std::vector<PetscInt>                     below, row, block; /* by columns: the blocks above the diagonal */
  std::vector<PetscInt>                     at;                /* where in the row being read each place is */
  std::vector<PetscScalar>                  room;              /* the row being read */

  /* Calls f(column, block, whether its adjoint is meant) for all blocks of a row */
  template <class F>
  void forEach(PetscInt i, F f) const
  {
    for (PetscInt k = below[i]; k < below[i + 1]; k++) f(row[k], upper->block(block[k]), true);
    for (PetscInt k = upper->i[i]; k < upper->i[i + 1]; k++) f(upper->j[k], upper->block(k), false);
    for (PetscInt k = rest.i[i]; k < rest.i[i + 1]; k++) f(rest.j[k], rest.block(k), false);
  }
};
} // namespace

/*
   AinsworthBlockMatOpenHalf - opens the rows of a Hermitian matrix, of whose blocks between owned nodes only half are
   stored, plus a rest, whose columns are places in cols
*/
PetscErrorCode AinsworthBlockMatOpenHalf(const std::shared_ptr<const AinsworthBlockRows> &upper,
                                         AinsworthBlockRows &&rest, const AinsworthColumns &cols, AinsworthBlockMat *B)
{
  PetscFunctionBegin;
  auto reader = std::make_shared<HalfReader>(upper, std::move(rest), cols.count());
  B->cols     = cols;
  B->rows     = AinsworthBlockRows(upper->br, upper->bc);
  B->reader   = reader;
  for (; B->rows.n < upper->n; B->rows.endRow()) reader->findColumns(B->rows.n, &B->rows);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBlocksToAIJ - converts block rows, with columns ascending by node number, to AIJ with the layouts of
   another matrix, whose blocks are the same. Collective
*/
PetscErrorCode AinsworthBlocksToAIJ(const AinsworthBlockRows &rows, const AinsworthColumns &cols, Mat like, Mat *aij)
{
  AinsworthEntries entries;

  PetscFunctionBegin;
  for (PetscInt l = 0; l < rows.n * rows.br; l++, entries.endRow()) {
    for (PetscInt k = rows.i[l / rows.br]; k < rows.i[l / rows.br + 1]; k++) {
      const PetscScalar *row = rows.block(k) + l % rows.br * rows.bc;

      for (PetscInt c = 0; c < rows.bc; c++) entries.add(cols.node(rows.j[k]) * rows.bc + c, row[c]);
    }
  }
  PetscCall(AinsworthCreateAIJLike(like, entries, aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}
