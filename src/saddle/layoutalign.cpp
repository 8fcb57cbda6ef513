/*
   Rows whose only entry is on the diagonal may belong to either field: Dirichlet conditions, but also pressures at
   hanging nodes. Nodes of A tell
*/
#include "saddle.h"
#include "../base/loops.h"
#include <algorithm>

/* Nodes of each rank that are looked at, about */
static const PetscInt voters = 1000;

namespace
{
/* Consecutive rows of this rank with a positive diagonal entry: which all are plain, or none is */
struct Run {
  PetscInt first = 0, n = 0;
  bool     plain = false;
};
} // namespace

static PetscErrorCode FindRuns(Vec entries, std::vector<Run> *runs)
{
  PetscReal last = AINSWORTH_ENTRY_ZERO;

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({entries}, [&](PetscInt i, PetscScalar entry) {
    const PetscReal kind = PetscRealPart(entry);

    if (kind > 0.0 && kind != last) runs->push_back({i, 0, kind == AINSWORTH_ENTRY_PLAIN});
    if (kind > 0.0) runs->back().n++;
    last = kind;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Of the nodes of bs rows that the runs consist of some: their number, and that of those whose rows have the same
   columns
*/
static PetscErrorCode CountNodes(Mat mat, const std::vector<Run> &runs, PetscInt bs, PetscInt *yes, PetscInt *all)
{
  PetscInt          start, rows = 0;
  AinsworthNodeRows node;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(mat, &start, NULL));
  for (const Run &run : runs) rows += run.plain ? 0 : run.n;
  for (const Run &run : runs) {
    for (PetscInt i = 0; !run.plain && i < run.n; i += bs * PetscMax(1, rows / bs / voters)) {
      PetscCall(AinsworthCompareRows(
        mat, start + run.first + i, 1, bs, [](std::vector<PetscInt> *) {}, &node));
      *yes += node.same;
      *all += 1;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthAlignFields - gives plain rows to the multipliers where the nodes of A would not be blocks of consecutive
   rows with them; collective

   entries: of AinsworthClassifyDiagonal(), zero afterwards where a row became one of the multipliers. Runs of other
   rows that are multiples of some number, and whose nodes have the same columns in all of their rows, tell the block
   size. Of a run of plain rows, which A couples with nothing, the number counts.
*/
PetscErrorCode AinsworthAlignFields(Mat mat, Vec entries)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)mat);
  /* a bit for each size that fits; rows that would move, nodes that agree, all */
  PetscInt         sizes = 0, bs, count[3] = {0, 0, 0};
  std::vector<Run> runs;
  PetscBool        aij;
  PetscScalar     *entry;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)mat, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (!aij) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FindRuns(entries, &runs));
  for (PetscInt b = 2; b <= AinsworthNodesLargest; b++)
    if (std::all_of(runs.begin(), runs.end(), [b](const Run &run) { return run.plain || run.n % b == 0; }))
      sizes |= 1 << b;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &sizes, 1, MPIU_INT, MPI_BAND, comm));
  for (bs = AinsworthNodesLargest; bs > 1 && !(sizes & (1 << bs)); bs--) { }
  if (bs < 2) PetscFunctionReturn(PETSC_SUCCESS);
  for (const Run &run : runs) count[0] += run.plain ? run.n % bs : 0;
  if (count[0]) PetscCall(CountNodes(mat, runs, bs, &count[1], &count[2]));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, count, 3, MPIU_INT, MPI_SUM, comm));
  if (!count[0] || !count[2] || count[1] < AinsworthNodesEnough * count[2]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(
    mat, "%" PetscInt_FMT " rows with one entry are rows of multipliers: nodes have %" PetscInt_FMT " unknowns\n",
    count[0], bs));
  PetscCall(VecGetArray(entries, &entry));
  for (const Run &run : runs)
    if (run.plain) std::fill_n(entry + run.first + run.n - run.n % bs, run.n % bs, AINSWORTH_ENTRY_ZERO);
  PetscCall(VecRestoreArray(entries, &entry));
  PetscFunctionReturn(PETSC_SUCCESS);
}
