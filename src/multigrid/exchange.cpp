#include "blocks.h"

/* Where the blocks of sent rows are: of row r, `length[r]` of them, the first at `start[r]` where they are received */
struct Runs {
  std::vector<PetscInt> length, start;
};

/*
   Moves blocks along a star forest of single blocks, of leaves that stand for runs of them: from the roots to the
   leaves or, if up, from the leaves to the roots, where no two leaves have the same. Collective

   sf: a leaf for each run; runs: of each of its leaves, with the start among the blocks of the root's rank
*/
static PetscErrorCode Move(PetscSF sf, const Runs &runs, PetscInt nroots, bool up, const AinsworthBlockRows &from,
                           AinsworthBlockRows *to)
{
  AinsworthRef<PetscSF> blocks;
  const PetscSFNode    *remote;
  const PetscInt       *leaf;
  PetscSFNode          *each;
  PetscInt              nleaves, n = 0, total = 0;
  const AinsworthUnit   unit(from.size(), MPIU_SCALAR);

  PetscFunctionBegin;
  PetscCall(PetscSFGetGraph(sf, NULL, &nleaves, &leaf, &remote));
  for (PetscInt length : runs.length) total += length;
  PetscCall(PetscMalloc1(total, &each));
  std::vector<PetscSFNode> of(runs.length.size());
  for (PetscInt k = 0; k < nleaves; k++) of[leaf ? leaf[k] : k] = remote[k];
  for (size_t r = 0; r < of.size(); r++)
    for (PetscInt b = 0; b < runs.length[r]; b++) {
      each[n].rank    = of[r].rank;
      each[n++].index = runs.start[r] + b;
    }
  PetscCall(PetscSFCreate(PetscObjectComm((PetscObject)sf), blocks.out()));
  PetscCall(PetscSFSetGraph(blocks, nroots, total, NULL, PETSC_OWN_POINTER, each, PETSC_OWN_POINTER));
  if (up) {
    PetscCall(PetscSFReduceBegin(blocks, MPIU_INT, from.j.data(), to->j.data(), MPI_REPLACE));
    PetscCall(PetscSFReduceEnd(blocks, MPIU_INT, from.j.data(), to->j.data(), MPI_REPLACE));
    PetscCall(PetscSFReduceBegin(blocks, unit.type, from.a.data(), to->a.data(), MPI_REPLACE));
    PetscCall(PetscSFReduceEnd(blocks, unit.type, from.a.data(), to->a.data(), MPI_REPLACE));
  } else {
    PetscCall(PetscSFBcastBegin(blocks, MPIU_INT, from.j.data(), to->j.data(), MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(blocks, MPIU_INT, from.j.data(), to->j.data(), MPI_REPLACE));
    PetscCall(PetscSFBcastBegin(blocks, unit.type, from.a.data(), to->a.data(), MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(blocks, unit.type, from.a.data(), to->a.data(), MPI_REPLACE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes room for rows of these lengths */
static void Receive(const AinsworthBlockRows &like, const std::vector<PetscInt> &lengths, AinsworthBlockRows *arrived)
{
  *arrived   = AinsworthBlockRows(like.br, like.bc);
  arrived->n = (PetscInt)lengths.size();
  for (PetscInt length : lengths) arrived->i.push_back(arrived->i.back() + length);
  arrived->j.resize(arrived->i.back());
  arrived->a.resize((size_t)arrived->i.back() * like.size());
}

/*
   AinsworthSendRows - sends block rows from the roots of an SF, one row each, to its n local leaves; columns are global
   node numbers. Collective
*/
PetscErrorCode AinsworthSendRows(PetscSF sf, const AinsworthBlockRows &rows, PetscInt n, AinsworthBlockRows *arrived)
{
  const AinsworthUnit   pair(2, MPIU_INT);
  std::vector<PetscInt> from, to(2 * n, 0);
  Runs                  runs;

  PetscFunctionBegin;
  for (PetscInt r = 0; r < rows.n; r++) from.insert(from.end(), {rows.i[r + 1] - rows.i[r], rows.i[r]});
  PetscCall(PetscSFBcastBegin(sf, pair.type, from.data(), to.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, pair.type, from.data(), to.data(), MPI_REPLACE));
  for (PetscInt r = 0; r < n; r++) {
    runs.length.push_back(to[2 * r]);
    runs.start.push_back(to[2 * r + 1]);
  }
  Receive(rows, runs.length, arrived);
  PetscCall(Move(sf, runs, rows.i[rows.n], false, rows, arrived));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthRowsToOwners - sends the row of each ghost of cols to the owner of its node. Collective

   owner: the local node of each received row, ascending
*/
PetscErrorCode AinsworthRowsToOwners(const AinsworthColumns &cols, const AinsworthBlockRows &rows,
                                     std::vector<PetscInt> *owner, AinsworthBlockRows *arrived)
{
  const PetscInt       *degree;
  std::vector<PetscInt> lengths, starts;
  Runs                  runs;

  PetscFunctionBegin;
  owner->clear();
  *arrived = AinsworthBlockRows();
  if (!cols.sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFComputeDegreeBegin(cols.sf, &degree));
  PetscCall(PetscSFComputeDegreeEnd(cols.sf, &degree));
  for (PetscInt c = 0; c < cols.local; c++) owner->insert(owner->end(), degree[c], c);
  for (PetscInt r = 0; r < rows.n; r++) runs.length.push_back(rows.i[r + 1] - rows.i[r]);
  lengths.resize(owner->size());
  PetscCall(PetscSFGatherBegin(cols.sf, MPIU_INT, runs.length.data(), lengths.data()));
  PetscCall(PetscSFGatherEnd(cols.sf, MPIU_INT, runs.length.data(), lengths.data()));
  Receive(rows, lengths, arrived);
  starts.assign(arrived->i.begin(), arrived->i.end() - 1);
  runs.start.resize(rows.n);
  PetscCall(PetscSFScatterBegin(cols.sf, MPIU_INT, starts.data(), runs.start.data()));
  PetscCall(PetscSFScatterEnd(cols.sf, MPIU_INT, starts.data(), runs.start.data()));
  PetscCall(Move(cols.sf, runs, arrived->i.back(), true, rows, arrived));
  PetscFunctionReturn(PETSC_SUCCESS);
}
