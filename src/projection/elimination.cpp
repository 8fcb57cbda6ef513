#include "elimination.h"
#include <algorithm>
#include <functional>
#include <queue>

/*
   A pivot is at least this fraction of the largest entry of its row, which leaves room to choose one in a column with
   few entries
*/
static const PetscReal threshold = 0.1;
/*
   Rows at a smaller distance are deferred until all others are taken; then this bound is lowered by `step`, again and
   again
*/
static const PetscReal sound = 3e-1;
static const PetscReal step  = 1e-1;
/* Entries below this fraction of the largest of the row are rounded zeros */
static const PetscReal cancelled = 8 * PETSC_MACHINE_EPSILON;

PetscReal AinsworthRow::largest() const
{
  PetscReal most = 0.0;

  for (const PetscScalar &v : value) most = PetscMax(most, PetscAbsScalar(v));
  return most;
}

/* Takes rows that alone have an entry in some column, until there are none; this changes no other row */
void AinsworthElimination::peel()
{
  /* sum: XOR of the numbers of the rows with an entry in the column; of one row, its number */
  std::vector<PetscInt>  sum(x.size(), 0), alone;
  std::vector<PetscReal> largest;

  for (size_t i = 0; i < rows.size(); i++) {
    largest.push_back(rows[i].largest());
    for (PetscInt c : rows[i].column) {
      entries[c]++;
      sum[c] ^= (PetscInt)i;
    }
  }
  for (size_t c = 0; c < x.size(); c++)
    if (entries[c] == 1) alone.push_back((PetscInt)c);
  while (alone.size()) {
    const PetscInt c = alone.back(), i = sum[c];

    alone.pop_back();
    if (entries[c] != 1) continue;
    const AinsworthRow &row = rows[i];
    const size_t        k   = std::lower_bound(row.column.begin(), row.column.end(), c) - row.column.begin();

    if (!(PetscAbsScalar(row.value[k]) >= threshold * largest[i]) || largest[i] < sound) continue;
    state[i] = TAKEN;
    for (PetscInt j : row.column) {
      sum[j] ^= i;
      if (--entries[j] == 1) alone.push_back(j);
    }
  }
}

/* Eliminates the pivots of the taken rows from a row */
void AinsworthElimination::reduce(AinsworthRow &row)
{
  std::priority_queue<PetscInt, std::vector<PetscInt>, std::greater<PetscInt>> steps;
  std::vector<PetscInt>                                                        pattern;
  const auto                                                                   touch = [&](PetscInt c) {
    if (touched[c]) return;
    touched[c] = 1;
    pattern.push_back(c);
    if (pivotOf[c] >= 0) steps.push(pivotOf[c]);
  };
  PetscReal noise;

  for (size_t k = 0; k < row.column.size(); k++) {
    x[row.column[k]] = row.value[k];
    touch(row.column[k]);
  }
  if (steps.empty()) {
    for (PetscInt c : row.column) {
      x[c]       = 0.0;
      touched[c] = 0;
    }
    return;
  }
  noise = cancelled * row.largest();
  while (!steps.empty()) { /* ascending steps: a taken row has no entry in the pivot columns of earlier steps */
    const AinsworthRow &taken = rows[rowOf[steps.top()]];
    const PetscScalar   head = x[taken.column[0]], factor = head / taken.value[0];

    steps.pop();
    if (PetscAbsScalar(head) <= noise) continue;
    for (size_t k = 1; k < taken.column.size(); k++) {
      touch(taken.column[k]);
      x[taken.column[k]] -= factor * taken.value[k];
    }
  }
  row.column.clear();
  row.value.clear();
  for (PetscInt c : pattern) {
    if (pivotOf[c] < 0 && PetscAbsScalar(x[c]) > noise) {
      row.column.push_back(c);
      row.value.push_back(x[c]);
    }
    x[c]       = 0.0;
    touched[c] = 0;
  }
}

/* Returns the position in the row of its pivot: in the column with the fewest entries, the largest of such columns */
PetscInt AinsworthElimination::choose(const AinsworthRow &row, PetscReal largest) const
{
  PetscInt best = -1;

  for (size_t k = 0; k < row.column.size(); k++) {
    const PetscReal size = PetscAbsScalar(row.value[k]);

    if (size < threshold * largest) continue;
    if (best >= 0) {
      const PetscInt more = entries[row.column[k]] - entries[row.column[best]];

      if (more > 0 || (!more && size <= PetscAbsScalar(row.value[best]))) continue;
    }
    best = (PetscInt)k;
  }
  return best;
}

/* Takes the rows whose distance from the span of those taken is above `level` */
void AinsworthElimination::pass(const std::vector<PetscInt> &order, PetscReal level, PetscReal vanished)
{
  for (PetscInt i : order) {
    AinsworthRow &row = rows[i];

    if (state[i] != LEFT) continue;
    reduce(row);
    const PetscReal largest = row.largest();
    if (!(largest > vanished)) state[i] = VANISHED;
    if (!(largest > level)) continue;
    const PetscInt pivot = choose(row, largest);
    std::swap(row.column[0], row.column[pivot]);
    std::swap(row.value[0], row.value[pivot]);
    pivotOf[row.column[0]] = (PetscInt)rowOf.size();
    rowOf.push_back(i);
    state[i] = TAKEN;
  }
}

/*
   AinsworthElimination::run - takes rows until the others have vanished, that is, are within `vanished` of the span of
   those taken

   order: of the rows, for little fill; columns: how many the rows have
*/
void AinsworthElimination::run(const std::vector<PetscInt> &order, size_t columns, PetscReal vanished)
{
  PetscReal level = sound;

  state.assign(rows.size(), LEFT);
  pivotOf.assign(columns, -1);
  entries.assign(columns, 0);
  x.assign(columns, 0.0);
  touched.assign(columns, 0);
  rowOf.clear();
  peel();
  for (pass(order, level, vanished); level > vanished; pass(order, level, vanished))
    level = PetscMax(step * level, vanished);
}
