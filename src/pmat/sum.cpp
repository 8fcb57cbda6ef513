#include "sum.h"
#include "surface.h"
#include <algorithm>

PetscErrorCode AinsworthOperand::open(Mat M)
{
  PetscInt  n;
  PetscBool done;

  PetscFunctionBegin;
  mat = M;
  PetscCall(MatGetRowIJ(M, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  PetscCall(MatSeqAIJGetArrayRead(M, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthOperand::close()
{
  PetscInt  n;
  PetscBool done;

  PetscFunctionBegin;
  if (!mat) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatSeqAIJRestoreArrayRead(mat, &a));
  PetscCall(MatGetLocalSize(mat, &n, NULL));
  PetscCall(MatRestoreRowIJ(mat, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  mat = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* columns, values += factor times a row, both ascending; c and v are work space */
static void MergeRow(const AinsworthOperand &op, PetscInt row, std::vector<PetscInt> &columns, std::vector<PetscScalar> &values, std::vector<PetscInt> &c,
                     std::vector<PetscScalar> &v)
{
  const PetscInt first = op.ia[row], end = op.ia[row + 1];
  const size_t   n = columns.size();
  size_t         i = 0, k = 0;

  if (first == end) return;
  c.resize(n + (end - first));
  v.resize(n + (end - first));
  for (PetscInt e = first; e < end; e++) {
    const PetscInt    column = op.column(e);
    const PetscScalar value  = op.factor * op.a[e];

    for (; i < n && columns[i] < column; i++, k++) {
      c[k] = columns[i];
      v[k] = values[i];
    }
    const bool both = i < n && columns[i] == column;
    c[k]            = column;
    v[k++]          = both ? values[i++] + value : value;
  }
  for (; i < n; i++, k++) {
    c[k] = columns[i];
    v[k] = values[i];
  }
  c.resize(k);
  v.resize(k);
  columns.swap(c);
  values.swap(v);
}

PetscErrorCode AinsworthPart::merge()
{
  std::vector<PetscInt>    c, work;
  std::vector<PetscScalar> v, workValues;

  PetscFunctionBegin;
  start.assign(1, 0);
  for (size_t i = 0; i < surface->size(); i++) {
    const PetscInt s = (*surface)[i];

    if (s < 0) continue;
    c.clear();
    v.clear();
    MergeRow(base, (PetscInt)i, c, v, work, workValues);
    for (const AinsworthOperand &term : terms) MergeRow(term, s, c, v, work, workValues);
    columns.insert(columns.end(), c.begin(), c.end());
    values.insert(values.end(), v.begin(), v.end());
    start.push_back((PetscInt)columns.size());
  }
  for (AinsworthOperand &term : terms) PetscCall(term.close());
  terms.clear();
  PetscFunctionReturn(PETSC_SUCCESS);
}

AinsworthRow AinsworthPart::row(PetscInt i)
{
  const PetscInt s = (*surface)[i], first = base.ia[i], n = base.ia[i + 1] - first;

  if (s >= 0) return {columns.data() + start[s], values.data() + start[s], start[s + 1] - start[s]};
  if (!base.mapped) return {base.ja + first, base.a + first, n};
  buffer.resize(n);
  for (PetscInt k = 0; k < n; k++) buffer[k] = base.column(first + k);
  return {buffer.data(), base.a + first, n};
}

/* Columns `from` are numbered by their place in `ghosts` */
static void MapInto(const std::vector<PetscInt> &ghosts, const PetscInt from[], size_t n, AinsworthOperand &op)
{
  op.mapped = true;
  op.map.resize(n);
  for (size_t k = 0; k < n; k++) op.map[k] = (PetscInt)(std::lower_bound(ghosts.begin(), ghosts.end(), from[k]) - ghosts.begin());
}

PetscErrorCode AinsworthSum::open(Mat matrix, IS dofs, const std::vector<AinsworthTerm> &terms)
{
  PetscInt              rstart, local;
  PetscBool             mpi;
  const PetscInt       *owned;
  std::vector<PetscInt> onSurface;

  PetscFunctionBegin;
  A = matrix;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetOwnershipRange(A, &rstart, NULL));
  PetscCall(ISGetLocalSize(dofs, &local));
  PetscCall(ISGetIndices(dofs, &owned));
  surface.assign(n, -1);
  for (PetscInt s = 0; s < local; s++) {
    surface[owned[s] - rstart] = s;
    onSurface.push_back(owned[s] - rstart);
  }
  PetscCall(ISRestoreIndices(dofs, &owned));
  inside.surface = outside.surface = &surface;
  inside.terms.resize(terms.size());
  outside.terms.resize(terms.size());
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)A, MATMPIAIJ, &mpi));
  parallel = mpi;
  if (parallel) {
    Mat                                in, out;
    const PetscInt                    *garray;
    PetscInt                           ng;
    std::vector<std::vector<PetscInt>> of(terms.size());

    PetscCall(MatMPIAIJGetSeqAIJ(A, &in, &out, &garray));
    PetscCall(MatGetSize(out, NULL, &ng));
    PetscCall(inside.base.open(in));
    PetscCall(outside.base.open(out));
    ghosts.assign(garray, garray + ng);
    for (size_t t = 0; t < terms.size(); t++) {
      PetscCall(AinsworthSurfaceGetGhosts(terms[t].E, dofs, of[t]));
      ghosts.insert(ghosts.end(), of[t].begin(), of[t].end());
      PetscCall(MatMPIAIJGetSeqAIJ(terms[t].E, &in, &out, NULL));
      PetscCall(inside.terms[t].open(in));
      PetscCall(outside.terms[t].open(out));
    }
    std::sort(ghosts.begin(), ghosts.end());
    ghosts.erase(std::unique(ghosts.begin(), ghosts.end()), ghosts.end());
    MapInto(ghosts, garray, ng, outside.base);
    for (size_t t = 0; t < terms.size(); t++) MapInto(ghosts, of[t].data(), of[t].size(), outside.terms[t]);
  } else {
    PetscCall(inside.base.open(A));
    for (size_t t = 0; t < terms.size(); t++) PetscCall(inside.terms[t].open(terms[t].E));
  }
  for (size_t t = 0; t < terms.size(); t++) {
    inside.terms[t].mapped = true;
    inside.terms[t].map    = onSurface;
    inside.terms[t].factor = outside.terms[t].factor = terms[t].factor;
  }
  PetscCall(inside.merge());
  if (parallel) PetscCall(outside.merge());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSum::close()
{
  PetscFunctionBegin;
  PetscCall(inside.base.close());
  PetscCall(outside.base.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The infinity norm, which is the 1-norm where all are symmetric; PETSc's own 1-norm stores a row of the matrix on every rank */
PetscErrorCode AinsworthSum::norm(PetscReal *norm)
{
  PetscReal largest = 0.0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++) {
    PetscReal total = 0.0;

    for (AinsworthPart *part : {&inside, &outside}) {
      if (part == &outside && !parallel) continue;
      const AinsworthRow row = part->row(i);
      for (PetscInt k = 0; k < row.n; k++) total += PetscAbsScalar(row.values[k]);
    }
    largest = PetscMax(largest, total);
  }
  PetscCall(MPIU_Allreduce(&largest, norm, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
