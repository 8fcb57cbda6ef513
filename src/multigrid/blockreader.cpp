#include "blockreader.h"
#include "../base/arrays.h"
#include <algorithm>

AinsworthBlockReader::~AinsworthBlockReader()
{
  for (Part &part : parts) (void)part.close();
}

/* Calls f(row within the node, block column, component, value) for all entries of a node */
template <class F>
void AinsworthBlockReader::forEach(PetscInt node, F f) const
{
  for (const Part &part : parts)
    for (PetscInt r = 0; r < bs; r++) {
      const PetscInt row = order.empty() ? node * bs + r : order[node * bs + r];

      for (PetscInt k = part.ia[row]; k < part.ia[row + 1]; k++) {
        const PetscInt c = part.columns.empty() ? part.ja[k] : part.columns[part.ja[k]];
        f(r, c / bs, c % bs, part.a[k]);
      }
    }
}

bool AinsworthBlockReader::hasFullBlocks(PetscInt node) const
{
  const Part     &in = parts[0];
  const PetscInt *ia = in.ia + node * bs;
  const PetscInt  n  = ia[1] - ia[0];
  const PetscInt *ja = in.ja + ia[0];

  if (!order.empty() || (parts.size() > 1 && parts[1].ia[node * bs] != parts[1].ia[(node + 1) * bs])) return false;
  if (n % bs || ia[bs] - ia[0] != bs * n) return false;
  for (PetscInt k = 0; k < n; k += bs) {
    if (ja[k] % bs) return false;
    for (PetscInt c = 1; c < bs; c++)
      if (ja[k + c] != ja[k] + c) return false;
  }
  for (PetscInt r = 1; r < bs; r++)
    if (ia[r] - ia[0] != r * n || !std::equal(ja, ja + n, in.ja + ia[r])) return false;
  return true;
}

/* Appends the columns of a node to the pattern, in ascending order */
void AinsworthBlockReader::findColumns(PetscInt node, AinsworthBlockRows *pattern)
{
  const PetscInt start = (PetscInt)pattern->j.size();

  if (full[node]) {
    const Part &in = parts[0];

    for (PetscInt k = in.ia[node * bs]; k < in.ia[node * bs + 1]; k += bs) pattern->j.push_back(in.ja[k] / bs);
    return;
  }
  forEach(node, [&](PetscInt, PetscInt place, PetscInt, PetscScalar) {
    if (at[place] == node) return;
    at[place] = node;
    pattern->j.push_back(place);
  });
  std::sort(pattern->j.begin() + start, pattern->j.end());
}

/*
   Numbers the unknowns node by node: owned ones locally, ghosts globally; without an order, owned columns have no
   numbers and ghosts keep theirs. Collective
*/
PetscErrorCode AinsworthBlockReader::numberUnknowns(PetscInt ng, const PetscInt garray[], std::vector<PetscInt> *ghosts)
{
  MPI_Comm              comm = PetscObjectComm((PetscObject)(Mat)mat);
  PetscLayout           layout;
  PetscInt              first;
  std::vector<PetscInt> all;
  PetscMPIInt           sorted = !order.empty();

  PetscFunctionBegin;
  ghosts->assign(garray, garray + ng);
  parts[0].columns = AinsworthInverse(order);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &sorted, 1, MPI_INT, MPI_MAX, comm));
  if (!sorted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetOwnershipRangeColumn(mat, &first, NULL));
  for (PetscInt l : parts[0].columns) all.push_back(first + l);
  PetscCall(MatGetLayouts(mat, NULL, &layout));
  PetscCall(AinsworthFetch(comm, layout, all, ng, garray, ghosts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBlockReader::open - opens a square AIJ matrix whose blocks have size b, which divides the number of rows on
   every rank, and finds the pattern of B. Collective

   rows: the local rows node by node; empty if they are stored so. marked: the local nodes whose rows are wanted, the
   others are empty in B; NULL: all
*/
PetscErrorCode AinsworthBlockReader::open(Mat A, PetscInt b, const std::vector<PetscInt> &rows,
                                          const std::vector<char> *marked, AinsworthBlockMat *B)
{
  PetscInt              n, ng;
  Mat                   part[2];
  const PetscInt       *garray;
  AinsworthLayout       nodes;
  std::vector<PetscInt> ghosts, numbers;
  size_t                most = 0; /* blocks */

  PetscFunctionBegin;
  bs    = b;
  order = rows;
  PetscCall(AinsworthShare(A, mat.out()));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(AinsworthLayoutCreate(PetscObjectComm((PetscObject)A), n / bs, &nodes));
  PetscCall(AinsworthAIJGetParts(A, part, &garray, &ng));
  parts.resize(part[1] ? 2 : 1);
  PetscCall(numberUnknowns(ng, garray, &numbers));
  for (PetscInt number : numbers) ghosts.push_back(number / bs);
  PetscCall(B->cols.create(nodes, std::move(ghosts)));
  for (PetscInt number : numbers) parts[1].columns.push_back(B->cols.place(number / bs) * bs + number % bs);
  for (size_t p = 0; p < parts.size(); p++) PetscCall(parts[p].open(part[p]));

  at.assign(B->cols.count(), -1);
  full.assign(n / bs, 0);
  B->rows = AinsworthBlockRows(bs, bs);
  B->rows.i.reserve(n / bs + 1);
  for (PetscInt i = 0; i < n / bs; i++) {
    size_t entries = 0;

    if (marked && !(*marked)[i]) continue;
    full[i] = hasFullBlocks(i);
    for (PetscInt r = i * bs; r < (i + 1) * bs; r++) {
      const PetscInt row = order.empty() ? r : order[r];

      for (const Part &in : parts) entries += in.ia[row + 1] - in.ia[row];
    }
    most += full[i] ? entries / (bs * bs) : entries;
  }
  B->rows.j.reserve(most);
  for (PetscInt i = 0; i < n / bs; i++, B->rows.endRow())
    if (!marked || (*marked)[i]) findColumns(i, &B->rows);
  PetscFunctionReturn(PETSC_SUCCESS);
}

const PetscScalar *AinsworthBlockReader::read(const AinsworthBlockRows &pattern, PetscInt row)
{
  const PetscInt start = pattern.i[row], blocks = pattern.i[row + 1] - start, size = bs * bs;

  if (room.size() < (size_t)blocks * size) room.resize((size_t)blocks * size);
  if (blocks && full[row]) {
    const PetscScalar *from = parts[0].a + parts[0].ia[row * bs];
    const PetscInt     n    = blocks * bs;

    AinsworthDispatch(bs, [&](auto B) {
      const PetscInt b  = B() ? B() : bs;
      PetscScalar   *to = room.data();

      for (PetscInt k = 0; k < n; k += b)
        for (PetscInt r = 0; r < b; r++)
          for (PetscInt c = 0; c < b; c++) *to++ = from[r * n + k + c];
    });
    return room.data();
  }
  for (PetscInt k = 0; k < blocks; k++) at[pattern.j[start + k]] = k;
  std::fill_n(room.begin(), (size_t)blocks * size, 0.0);
  if (blocks)
    forEach(row,
            [&](PetscInt r, PetscInt place, PetscInt c, PetscScalar v) { room[at[place] * size + r * bs + c] = v; });
  return room.data();
}

/*
   AinsworthBlockMatOpen - opens the rows of a square AIJ matrix, or the marked ones; see AinsworthBlockReader::open().
   Collective
*/
PetscErrorCode AinsworthBlockMatOpen(Mat A, PetscInt bs, const std::vector<PetscInt> &order,
                                     const std::vector<char> *marked, AinsworthBlockMat *B)
{
  auto reader = std::make_shared<AinsworthBlockReader>();

  PetscFunctionBegin;
  PetscCall(reader->open(A, bs, order, marked, B));
  B->reader = reader;
  PetscFunctionReturn(PETSC_SUCCESS);
}
