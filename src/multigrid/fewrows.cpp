#include "fewrows.h"
#include "../base/arrays.h"
#include "../base/bordered.h"
#include "../base/loops.h"
#include "../base/matrices.h"
#include "../base/objects.h"
#include <numeric>

/*
   A row is dependent if orthogonalization leaves at most this part of its length: the squares of lengths are compared,
   and are off by the machine precision
*/
static const PetscReal dependent = 1e-8;

AinsworthFewRows::~AinsworthFewRows()
{
  for (Vec &v : c) (void)VecDestroy(&v);
  for (Vec *v : {&w, &work}) (void)VecDestroy(v);
}

/* Computes y -= C' C x. Collective */
static PetscErrorCode SubtractSquare(const std::vector<Vec> &c, Vec x, Vec y)
{
  std::vector<PetscScalar> t(c.size());

  PetscFunctionBegin;
  PetscCall(VecMDot(x, (PetscInt)c.size(), c.data(), t.data()));
  for (PetscScalar &v : t) v = -v;
  PetscCall(VecMAXPY(y, (PetscInt)c.size(), t.data(), const_cast<Vec *>(c.data())));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Orthonormalizes the rows, given by their adjoints, in two passes, and drops dependent ones. Collective */
PetscErrorCode AinsworthFewRows::create(const std::vector<Vec> &rows, const std::vector<PetscReal> &weight)
{
  PetscFunctionBegin;
  PetscCall(VecDuplicate(rows[0], &w));
  PetscCall(VecDuplicate(rows[0], &work));
  PetscCall(AinsworthUpdate(w, [&](PetscInt l, PetscScalar &v) { v = weight[l]; }));
  for (Vec row : rows) {
    Vec         v;
    PetscScalar squares[3]; /* before and after each pass */

    PetscCall(AinsworthVecClone(row, &v));
    for (int pass = 0;; pass++) {
      PetscCall(VecPointwiseMult(work, w, v));
      PetscCall(VecDot(work, v, &squares[pass]));
      if (pass == 2) break;
      PetscCall(SubtractSquare(c, work, v));
    }
    if (PetscRealPart(squares[2]) > dependent * dependent * PetscRealPart(squares[0])) {
      PetscCall(VecScale(v, 1.0 / PetscSqrtReal(PetscRealPart(squares[2]))));
      c.push_back(v);
    } else PetscCall(VecDestroy(&v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces x by Q x or Q' x. Collective */
PetscErrorCode AinsworthFewRows::project(bool adjoint, Vec x) const
{
  PetscFunctionBegin;
  if (adjoint) {
    PetscCall(VecPointwiseMult(work, w, x));
    PetscCall(SubtractSquare(c, work, x));
  } else {
    PetscCall(VecZeroEntries(work));
    PetscCall(SubtractSquare(c, x, work));
    PetscCall(VecPointwiseMult(work, w, work));
    PetscCall(VecAXPY(x, 1.0, work));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds C' C, which is about as stiff as W^{-1} and acts on what the rows exclude alone, to an AIJ matrix. Collective */
PetscErrorCode AinsworthFewRows::addSquare(Mat *A) const
{
  VecScatter                            scatter;
  Vec                                   all;
  Mat                                   square;
  PetscInt                              rstart, rend;
  AinsworthEntries                      entries;
  std::vector<std::vector<PetscScalar>> rows;
  std::vector<PetscScalar>              sum;
  std::vector<char>                     stored;

  PetscFunctionBegin;
  PetscCall(VecScatterCreateToAll(w, &scatter, &all));
  for (Vec row : c) {
    PetscCall(VecScatterBegin(scatter, row, all, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecScatterEnd(scatter, row, all, INSERT_VALUES, SCATTER_FORWARD));
    rows.emplace_back();
    PetscCall(AinsworthForEntries({all}, [&](PetscInt, PetscScalar v) { rows.back().push_back(v); }));
  }
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(VecDestroy(&all));
  PetscCall(MatGetOwnershipRange(*A, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    for (const std::vector<PetscScalar> &row : rows) {
      if (row[i] == 0.0) continue;
      sum.resize(row.size(), 0.0);
      stored.resize(row.size(), 0);
      for (size_t j = 0; j < row.size(); j++) {
        sum[j] += row[i] * PetscConj(row[j]);
        stored[j] |= row[j] != 0.0;
      }
    }
    for (size_t j = 0; j < sum.size(); j++)
      if (stored[j]) entries.add((PetscInt)j, sum[j]);
    entries.endRow();
    sum.clear();
    stored.clear();
  }
  PetscCall(AinsworthCreateAIJLike(*A, entries, &square));
  PetscCall(AinsworthAddAIJ(1.0, {square}, A));
  PetscCall(MatDestroy(&square));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthFewRowsSubspaceCreate - creates the kernel of the rows as a subspace of their level. Collective */
PetscErrorCode AinsworthFewRowsSubspaceCreate(const std::shared_ptr<const AinsworthFewRows> &rows,
                                              std::shared_ptr<const AinsworthLevelSubspace> *subspace)
{
  auto              space = std::make_shared<AinsworthSubspace>();
  AinsworthRef<Vec> values;

  PetscFunctionBegin;
  PetscCall(
    AinsworthForEntries({rows->w}, [&](PetscInt, PetscScalar w) { space->weight.push_back(PetscRealPart(w)); }));
  space->places.resize(space->weight.size());
  std::iota(space->places.begin(), space->places.end(), 0);
  PetscCall(VecDuplicate(rows->w, values.out()));
  space->values  = values;
  space->project = [rows, values](bool adjoint, Vec x) { return rows->project(adjoint, x); };
  *subspace      = std::make_shared<AinsworthLevelSubspace>(space, std::vector<PetscInt>());
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* The solver of the coarsest level on the kernel of the rows */
struct CoarseSolver {
  std::shared_ptr<const AinsworthFewRows> rows;
  PC                                      inner = NULL; /* referenced by the wrapper */
  AinsworthBordered                       bordered;
};
} // namespace

static PetscErrorCode Apply(PC pc, Vec r, Vec z)
{
  CoarseSolver            *data;
  std::vector<PetscScalar> left;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  PetscCall(PCApply(data->inner, r, z));
  left.resize(data->rows->c.size());
  PetscCall(VecMDot(z, (PetscInt)left.size(), data->rows->c.data(), left.data()));
  PetscCall(data->bordered.correct(left, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(PC pc)
{
  CoarseSolver *data;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  delete data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFewRowsPCCreate - creates the solver on the kernel of the rows from one of M, set up and referenced; NULL if
   C M^{-1} C' cannot be factored. Collective
*/
PetscErrorCode AinsworthFewRowsPCCreate(const std::shared_ptr<const AinsworthFewRows> &rows, PC inner, PC *pc)
{
  auto data = std::make_unique<CoarseSolver>();
  bool apart;

  PetscFunctionBegin;
  *pc = NULL;
  PetscCall(data->bordered.setUp(inner, rows->c, 0.0, &apart));
  if (!apart) PetscFunctionReturn(PETSC_SUCCESS);
  data->rows  = rows;
  data->inner = inner;
  PetscCall(AinsworthSubspacePCWrap(inner, "on the kernel of few rows", pc));
  PetscCall(PCShellSetContext(*pc, data.release()));
  PetscCall(PCShellSetApply(*pc, Apply));
  PetscCall(PCShellSetDestroy(*pc, Destroy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
