/*
   How the modes move nodes that A knows nothing of: as their rows of C ask for

   A program may know no better than that a rotation of a reference node is a displacement, or give no coordinates of it
*/
#include "coarsen.h"
#include "../base/columns.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include <algorithm>

/* Modes are found up to this part of themselves; what they move by a hundred times more is no rounding */
static const PetscReal precise = 1e-10, rounding = 1e-8;
/* Rigid parts of which each has its own reference node take 1 to 4; what takes more than this is carried */
static const PetscInt mostIterations = 100;

/* Sets the values at some columns, global numbers, to 1. Collective */
static PetscErrorCode Mark(std::vector<PetscInt> &columns, Vec marks)
{
  PetscFunctionBegin;
  AinsworthSortUnique(&columns);
  for (PetscInt j : columns) PetscCall(VecSetValue(marks, j, 1.0, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(marks));
  PetscCall(VecAssemblyEnd(marks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Marks the unknowns in rows of C that a mode does not satisfy, and those that a mode moves. Collective

   What is left of a row, or one term of it, is measured by its entries and by how far any mode, scaled to 1, moves
   them: a mode may not move them at all but for rounding
*/
static PetscErrorCode MarkFit(Mat C, const std::vector<AinsworthRef<Vec>> &modes, Vec unfit, Vec moved)
{
  std::vector<AinsworthAtColumns> at(modes.size());
  std::vector<PetscReal>          scale(modes.size());
  std::vector<PetscScalar>        left(modes.size());
  std::vector<PetscReal>          most;
  std::vector<PetscInt>           contradicted, moving;

  PetscFunctionBegin;
  for (size_t c = 0; c < modes.size(); c++) {
    PetscCall(at[c].create(C, modes[c]));
    PetscCall(VecNorm(modes[c], NORM_INFINITY, &scale[c]));
    scale[c] = scale[c] > 0.0 ? 1.0 / scale[c] : 0.0;
  }
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    PetscReal terms = 0.0;

    most.assign(row.n, 0.0);
    std::fill(left.begin(), left.end(), 0.0);
    for (PetscInt e = 0; e < row.n; e++) {
      for (size_t c = 0; c < modes.size(); c++) {
        const PetscScalar term = scale[c] * row.a[e] * at[c](row.j[e]);
        left[c] += term;
        most[e] = PetscMax(most[e], PetscAbsScalar(term));
      }
      terms += most[e];
    }
    for (PetscInt e = 0; e < row.n; e++)
      if (most[e] > rounding * terms) moving.push_back(row.j[e]);
    if (std::any_of(left.begin(), left.end(),
                    [=](PetscScalar l) { return !(PetscAbsScalar(l) <= AinsworthModeSatisfied * terms); }))
      contradicted.insert(contradicted.end(), row.j, row.j + row.n);
  }));
  PetscCall(Mark(contradicted, unfit));
  PetscCall(Mark(moving, moved));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates C restricted to the local unknowns of a list, and the square matrix R^H R. Collective */
static PetscErrorCode CreateNormal(Mat C, const std::vector<PetscInt> &unknowns, Mat *R, Mat *Rh, Mat *normal)
{
  IS       rows, columns;
  PetscInt start, end;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  PetscCall(ISCreateStride(PetscObjectComm((PetscObject)C), end - start, start, 1, &rows));
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)C), (PetscInt)unknowns.size(), unknowns.data(),
                            PETSC_USE_POINTER, &columns));
  PetscCall(MatCreateSubMatrix(C, rows, columns, MAT_INITIAL_MATRIX, R));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  PetscCall(MatHermitianTranspose(*R, MAT_INITIAL_MATRIX, Rh));
  PetscCall(MatMatMult(*Rh, *R, MAT_INITIAL_MATRIX, PETSC_DEFAULT, normal));
  PetscCall(MatProductClear(*normal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gives some local unknowns, global numbers, the values with which modes satisfy rows of C best, whatever they had: a
   program may know no better than that a rotation is a displacement of its node. Collective
*/
static PetscErrorCode FitModes(Mat C, const std::vector<PetscInt> &unknowns,
                               const std::vector<AinsworthRef<Vec>> &modes)
{
  AinsworthRef<Mat> R, Rh, normal;
  AinsworthRef<Vec> rows, force, motion;
  AinsworthRef<KSP> ksp;
  PetscInt          start;
  PC                pc;

  PetscFunctionBegin;
  PetscCall(CreateNormal(C, unknowns, R.out(), Rh.out(), normal.out()));
  PetscCall(AinsworthCreateVecs(R, motion.out(), rows.out()));
  PetscCall(VecDuplicate(motion, force.out()));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)C), ksp.out()));
  PetscCall(KSPSetOperators(ksp, normal, normal));
  PetscCall(KSPSetType(ksp, KSPCG));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCJACOBI)); /* the rows may leave some motions open: nothing is factored */
  PetscCall(KSPSetTolerances(ksp, precise, PETSC_DEFAULT, PETSC_DEFAULT, mostIterations));
  PetscCall(VecGetOwnershipRange(modes[0], &start, NULL));
  for (Vec mode : modes) {
    const PetscScalar *found;
    PetscScalar       *values;

    PetscCall(VecGetArray(mode, &values));
    for (PetscInt u : unknowns) values[u - start] = 0.0;
    PetscCall(VecRestoreArray(mode, &values));
    PetscCall(MatMult(C, mode, rows));
    PetscCall(MatMult(Rh, rows, force));
    PetscCall(VecScale(force, -1.0));
    PetscCall(KSPSolve(ksp, force, motion));
    PetscCall(VecGetArray(mode, &values));
    PetscCall(VecGetArrayRead(motion, &found));
    for (size_t l = 0; l < unknowns.size(); l++) values[unknowns[l] - start] = found[l];
    PetscCall(VecRestoreArrayRead(motion, &found));
    PetscCall(VecRestoreArray(mode, &values));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether modes move the bs unknowns of a node in all ways */
static bool Moves(PetscInt bs, PetscInt k, const PetscScalar *block)
{
  std::vector<PetscScalar> q(block, block + bs * k), r((size_t)bs * bs, 0.0);

  AinsworthOrthonormalize(k, bs, q.data(), r.data());
  for (PetscInt c = 0; c < bs; c++)
    if (r[(size_t)c * bs + c] == 0.0) return false;
  return true;
}

/* Gets the local unknowns, global numbers, of carried nodes with entries in C. Collective */
static PetscErrorCode FindOccurring(Mat C, PetscInt bs, const std::vector<PetscInt> &place,
                                    const std::vector<char> &carried, std::vector<PetscInt> *unknowns)
{
  AinsworthRef<Vec>     occurs;
  std::vector<PetscInt> columns;
  PetscInt              start;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(C, occurs.out(), NULL));
  PetscCall(VecZeroEntries(occurs));
  PetscCall(VecGetOwnershipRange(occurs, &start, NULL));
  PetscCall(
    AinsworthForRows(C, [&](const AinsworthMatRow &row) { columns.insert(columns.end(), row.j, row.j + row.n); }));
  PetscCall(Mark(columns, occurs));
  PetscCall(AinsworthForEntries({occurs}, [&](PetscInt l, PetscScalar v) {
    if (v != 0.0 && carried[(place.empty() ? l : place[l]) / bs]) unknowns->push_back(start + l);
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthModesOfCarried - gives carried nodes the modes with which their rows of C are satisfied best. Collective

   Input Parameters:
+  C     - the rows with carried unknowns
.  bs    - unknowns per node
.  order - the local rows of A node by node; empty if they are stored so
-  modes - the near null space, and the carried nodes

   Output Parameters:
+  modes - with values at carried nodes
.  marks - a value for each unknown: 1 where the node is carried, all of its rows are satisfied, and modes move it in
           all ways; 2 where a carried node does not move so; otherwise 0
-  some  - there are nodes marked by 1
*/
PetscErrorCode AinsworthModesOfCarried(Mat C, PetscInt bs, const std::vector<PetscInt> &order, AinsworthModes *modes,
                                       Vec *marks, PetscBool *some)
{
  const PetscInt                 k     = modes->k;
  const size_t                   n     = modes->carried.size();
  const std::vector<PetscInt>    place = AinsworthInverse(order);
  auto                           at    = [&](size_t l) { return place.empty() ? l : (size_t)place[l]; };
  std::vector<AinsworthRef<Vec>> mode(k);
  std::vector<PetscInt>          unknowns;
  std::vector<char>              fits(modes->carried);
  AinsworthRef<Vec>              moved;

  PetscFunctionBegin;
  PetscCall(FindOccurring(C, bs, place, modes->carried, &unknowns));
  PetscCall(AinsworthCreateVecs(C, marks, NULL));
  for (PetscInt c = 0; c < k; c++) {
    PetscCall(VecDuplicate(*marks, mode[c].out()));
    PetscCall(AinsworthUpdate(mode[c], [&](PetscInt l, PetscScalar &v) { v = modes->values[at(l) * k + c]; }));
  }
  PetscCall(FitModes(C, unknowns, mode));
  for (PetscInt c = 0; c < k; c++)
    PetscCall(AinsworthForEntries({mode[c]}, [&](PetscInt l, PetscScalar v) { modes->values[at(l) * k + c] = v; }));
  PetscCall(VecZeroEntries(*marks));
  PetscCall(VecDuplicate(*marks, moved.out()));
  PetscCall(VecZeroEntries(moved));
  PetscCall(MarkFit(C, mode, *marks, moved));
  PetscCall(AinsworthForEntries({*marks, moved}, [&](PetscInt l, PetscScalar unfit, PetscScalar moves) {
    if (unfit != 0.0 || moves == 0.0) fits[at(l) / bs] = 0;
  }));
  *some = PETSC_FALSE;
  for (size_t i = 0; i < n; i++) {
    if (fits[i]) fits[i] = Moves(bs, k, &modes->values[i * bs * k]);
    if (fits[i]) *some = PETSC_TRUE;
  }
  PetscCall(AinsworthUpdate(*marks, [&](PetscInt l, PetscScalar &v) {
    const size_t i = at(l) / bs;
    v              = fits[i] ? 1.0 : (modes->carried[i] ? 2.0 : 0.0);
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, some, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)C)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
