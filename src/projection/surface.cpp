#include "surface.h"
#include "../base/layouts.h"
#include "../base/multivector.h"
#include "../base/unit.h"

/*
   Finds the places, and the star forest to where they are elsewhere; place: of each local unknown, or -1. Collective
*/
PetscErrorCode AinsworthSurface::number(Mat C, std::vector<PetscInt> *place)
{
  Mat                   part[2];
  const PetscInt       *ghosts;
  PetscInt              n;
  AinsworthCSR          rows;
  AinsworthRef<PetscSF> unknowns;
  std::vector<PetscInt> used, one, remote;

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(C, part, &ghosts, &elsewhere));
  PetscCall(MatGetLocalSize(C, NULL, &n));
  used.assign(n, 0);
  PetscCall(rows.open(part[0]));
  for (PetscInt k = 0; k < rows.ia[rows.n]; k++) used[rows.ja[k]] = 1;
  PetscCall(rows.close());
  PetscCall(AinsworthColumnsCreateSF(C, unknowns.out()));
  if (unknowns) {
    one.assign(elsewhere, 1);
    PetscCall(PetscSFReduceBegin(unknowns, MPIU_INT, one.data(), used.data(), MPI_MAX));
    PetscCall(PetscSFReduceEnd(unknowns, MPIU_INT, one.data(), used.data(), MPI_MAX));
  }
  place->assign(n, -1);
  for (PetscInt i = 0; i < n; i++) {
    if (!used[i]) continue;
    (*place)[i] = (PetscInt)here.size();
    here.push_back(i);
  }

  const PetscSFNode *owners;
  PetscSFNode       *leaves;

  PetscCall(PetscMalloc1(here.size(), &leaves));
  for (size_t k = 0; k < here.size(); k++) leaves[k] = {0, here[k]};
  PetscCall(PetscSFCreate(PETSC_COMM_SELF, local.out()));
  PetscCall(PetscSFSetGraph(local, n, (PetscInt)here.size(), NULL, PETSC_OWN_POINTER, leaves, PETSC_OWN_POINTER));
  if (!unknowns) PetscFunctionReturn(PETSC_SUCCESS);

  remote.resize(elsewhere);
  PetscCall(PetscSFBcastBegin(unknowns, MPIU_INT, place->data(), remote.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(unknowns, MPIU_INT, place->data(), remote.data(), MPI_REPLACE));
  PetscCall(PetscSFGetGraph(unknowns, NULL, NULL, NULL, &owners));
  PetscCall(PetscMalloc1(elsewhere, &leaves));
  for (PetscInt k = 0; k < elsewhere; k++) {
    leaves[k].rank  = owners[k].rank;
    leaves[k].index = remote[k];
  }
  PetscCall(PetscSFCreate(PetscObjectComm((PetscObject)C), sf.out()));
  PetscCall(PetscSFSetGraph(sf, (PetscInt)here.size(), elsewhere, NULL, PETSC_OWN_POINTER, leaves, PETSC_OWN_POINTER));
  PetscCall(PetscSFSetUp(sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Copies the entries of x at the places to `taken`. A star forest, so that a vector on a device stays there: only these
   entries are moved
*/
PetscErrorCode AinsworthSurface::take(PetscInt width, Vec x) const
{
  const AinsworthUnit unit(width, MPIU_SCALAR);
  const PetscScalar  *a;
  PetscMemType        type;

  PetscFunctionBegin;
  taken.resize(here.size() * width);
  PetscCall(VecGetArrayReadAndMemType(x, &a, &type));
  PetscCall(PetscSFBcastWithMemTypeBegin(local, unit.type, type, a, PETSC_MEMTYPE_HOST, taken.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(local, unit.type, a, taken.data(), MPI_REPLACE));
  PetscCall(VecRestoreArrayReadAndMemType(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies `taken` to the entries of x at the places */
PetscErrorCode AinsworthSurface::put(PetscInt width, Vec x) const
{
  const AinsworthUnit unit(width, MPIU_SCALAR);
  PetscScalar        *a;
  PetscMemType        type;

  PetscFunctionBegin;
  PetscCall(VecGetArrayAndMemType(x, &a, &type));
  PetscCall(PetscSFReduceWithMemTypeBegin(local, unit.type, PETSC_MEMTYPE_HOST, taken.data(), type, a, MPI_REPLACE));
  PetscCall(PetscSFReduceEnd(local, unit.type, taken.data(), a, MPI_REPLACE));
  PetscCall(VecRestoreArrayAndMemType(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the real parts of a vector's entries at the places, then elsewhere. Collective */
PetscErrorCode AinsworthSurface::gather(Vec v, std::vector<PetscReal> *at) const
{
  const PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(v, &a));
  for (PetscInt i : here) at->push_back(PetscRealPart(a[i]));
  PetscCall(VecRestoreArrayRead(v, &a));
  at->resize(here.size() + elsewhere);
  if (!sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFBcastBegin(sf, MPIU_REAL, at->data(), at->data() + here.size(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, MPIU_REAL, at->data(), at->data() + here.size(), MPI_REPLACE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSurface::create(Mat C, Vec weight, Vec ownWeight)
{
  Mat                    part[2];
  const PetscInt        *ghosts;
  PetscInt               n, entries = 0;
  AinsworthCSR           rows[2];
  std::vector<PetscInt>  place;
  std::vector<PetscReal> wp;

  PetscFunctionBegin;
  PetscCall(number(C, &place));
  if (weight) PetscCall(gather(weight, &w));
  if (ownWeight) PetscCall(gather(ownWeight, &wp));
  PetscCall(AinsworthAIJGetParts(C, part, &ghosts, &n));
  for (int p = 0; p < 2; p++) {
    PetscCall(rows[p].open(part[p]));
    if (part[p]) entries += rows[p].ia[rows[p].n];
  }
  all.reserve(entries);
  all.i.reserve(rows[0].n + 1);
  if (ownWeight) some.reserve(entries); /* untouched memory is not resident */
  for (PetscInt r = 0; r < rows[0].n; r++) {
    PetscInt next = all.i[r], nextOwn = ownWeight ? some.i[r] : 0;

    for (int p = 0; p < 2 && part[p]; p++)
      for (PetscInt k = rows[p].ia[r]; k < rows[p].ia[r + 1]; k++) {
        const PetscInt j = p ? (PetscInt)here.size() + rows[p].ja[k] : place[rows[p].ja[k]];

        all.j[next]   = j;
        all.a[next++] = rows[p].a[k];
        if (!ownWeight || wp[j] == 0.0) continue;
        some.j[nextOwn]   = j;
        some.a[nextOwn++] = rows[p].a[k];
      }
    all.i.push_back(next);
    if (ownWeight) some.i.push_back(nextOwn);
  }
  for (AinsworthCSR &opened : rows) PetscCall(opened.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSurface::createGram(bool own, Mat *S) const
{
  const AinsworthRows     &M = own ? some : all;
  const PetscInt           m = (PetscInt)M.i.size() - 1, n = (PetscInt)here.size() + elsewhere;
  PetscInt                 next = 0;
  std::vector<PetscInt>    i{0}, j;
  std::vector<PetscScalar> a;
  AinsworthRef<Mat>        left, right, adjoint;

  PetscFunctionBegin;
  i.reserve(m + 1);
  j.resize(M.i.back());
  a.resize(M.i.back());
  for (PetscInt r = 0; r < m; r++) {
    for (PetscInt k = M.i[r]; k < M.i[r + 1]; k++) {
      const PetscReal weight = w.empty() ? 1.0 : w[M.j[k]];

      if (weight == 0.0) continue; /* S would be dense (shared.cpp) */
      j[next]   = M.j[k];
      a[next++] = weight * M.a[k];
    }
    i.push_back(next);
  }
  PetscCall(MatCreateSeqAIJWithArrays(PETSC_COMM_SELF, m, n, (PetscInt *)M.i.data(), M.j.get(), M.a.get(), left.out()));
  PetscCall(MatCreateSeqAIJWithArrays(PETSC_COMM_SELF, m, n, i.data(), j.data(), a.data(), right.out()));
  PetscCall(MatHermitianTranspose(right, MAT_INITIAL_MATRIX, adjoint.out()));
  PetscCall(MatMatMult(left, adjoint, MAT_INITIAL_MATRIX, PETSC_DEFAULT, S));
  PetscCall(MatProductClear(*S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = M v for each vector */
template <int W>
static void Multiply(const AinsworthRows &M, const PetscScalar v[], PetscScalar y[])
{
  for (size_t r = 0; r + 1 < M.i.size(); r++) {
    PetscScalar sum[W] = {};

    for (PetscInt k = M.i[r]; k < M.i[r + 1]; k++)
      for (int c = 0; c < W; c++) sum[c] += M.a[k] * v[M.j[k] * W + c];
    for (int c = 0; c < W; c++) y[r * W + c] = sum[c];
  }
}

/* Computes v += M' y for each vector */
template <int W>
static void Spread(const AinsworthRows &M, const PetscScalar y[], PetscScalar v[])
{
  for (size_t r = 0; r + 1 < M.i.size(); r++)
    for (PetscInt k = M.i[r]; k < M.i[r + 1]; k++)
      for (int c = 0; c < W; c++) v[M.j[k] * W + c] += PetscConj(M.a[k]) * y[r * W + c];
}

/* Sets `values` to those of x at the places and elsewhere, times W if weighted. Collective */
PetscErrorCode AinsworthSurface::fetch(PetscInt width, const PetscScalar x[], bool weighted) const
{
  const size_t        n = here.size() * width;
  const AinsworthUnit unit(width, MPIU_SCALAR);

  PetscFunctionBegin;
  values.resize(n + (size_t)elsewhere * width);
  if (sf) {
    PetscCall(PetscSFBcastBegin(sf, unit.type, x, values.data() + n, MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(sf, unit.type, x, values.data() + n, MPI_REPLACE));
  }
  std::copy(x, x + n, values.begin());
  if (weighted)
    for (size_t k = 0; k < w.size(); k++)
      for (PetscInt c = 0; c < width; c++) values[k * width + c] *= w[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds `values`, times W if weighted, to x, those elsewhere to where they belong. Collective */
PetscErrorCode AinsworthSurface::bring(PetscInt width, bool weighted, PetscScalar x[]) const
{
  const size_t        n = here.size() * width;
  const AinsworthUnit unit(width, MPIU_SCALAR);

  PetscFunctionBegin;
  if (weighted)
    for (size_t k = 0; k < w.size(); k++)
      for (PetscInt c = 0; c < width; c++) values[k * width + c] *= w[k];
  for (size_t k = 0; k < n; k++) x[k] += values[k];
  if (!sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscSFReduceBegin(sf, unit.type, values.data() + n, x, MPIU_SUM));
  PetscCall(PetscSFReduceEnd(sf, unit.type, values.data() + n, x, MPIU_SUM));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSurface::multiply(PetscInt width, const PetscScalar x[], PetscScalar y[]) const
{
  PetscFunctionBegin;
  PetscCall(fetch(width, x, false));
  AinsworthDispatchWidth(width, [&](auto W) { Multiply<W>(all, values.data(), y); });
  PetscCall(PetscLogFlops(2.0 * (PetscLogDouble)all.i.back() * (PetscLogDouble)width));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSurface::multiplyWeighted(PetscInt width, const PetscScalar x[], PetscScalar y[],
                                                  PetscScalar yp[]) const
{
  PetscFunctionBegin;
  PetscCall(fetch(width, x, true));
  AinsworthDispatchWidth(width, [&](auto W) {
    Multiply<W>(all, values.data(), y);
    if (yp) Multiply<W>(some, values.data(), yp);
  });
  PetscCall(PetscLogFlops(2.0 * (PetscLogDouble)(all.i.back() + (yp ? some.i.back() : 0)) * (PetscLogDouble)width));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSurface::spread(PetscInt width, const PetscScalar y[], PetscScalar x[]) const
{
  PetscFunctionBegin;
  values.assign((here.size() + elsewhere) * width, 0.0);
  AinsworthDispatchWidth(width, [&](auto W) { Spread<W>(all, y, values.data()); });
  PetscCall(PetscLogFlops(2.0 * (PetscLogDouble)all.i.back() * (PetscLogDouble)width));
  PetscCall(bring(width, false, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSurface::spreadWeighted(PetscInt width, const PetscScalar y[], const PetscScalar yp[],
                                                PetscScalar x[]) const
{
  PetscFunctionBegin;
  values.assign((here.size() + elsewhere) * width, 0.0);
  AinsworthDispatchWidth(width, [&](auto W) {
    Spread<W>(all, y, values.data());
    if (yp) Spread<W>(some, yp, values.data());
  });
  PetscCall(PetscLogFlops(2.0 * (PetscLogDouble)(all.i.back() + (yp ? some.i.back() : 0)) * (PetscLogDouble)width));
  PetscCall(bring(width, true, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}
