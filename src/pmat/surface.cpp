#include "surface.h"
#include <petscsf.h>
#include <algorithm>

namespace
{
/* The two parts of the rows that a rank owns: columns that it owns, and ghost columns with their global numbers */
struct Parts {
  Mat             inside, outside = NULL; /* SeqAIJ; no outside on one rank */
  const PetscInt *ghosts  = nullptr;
  PetscInt        nghosts = 0;
};

PetscErrorCode GetParts(Mat M, Parts &parts)
{
  PetscBool mpi;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)M, MATMPIAIJ, &mpi));
  if (mpi) {
    PetscCall(MatMPIAIJGetSeqAIJ(M, &parts.inside, &parts.outside, &parts.ghosts));
    PetscCall(MatGetSize(parts.outside, NULL, &parts.nghosts));
  } else parts.inside = M;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the owners of the columns of M to the ranks that have them as ghosts; NULL on one rank */
PetscErrorCode CreateGhostSF(Mat M, const Parts &parts, PetscSF *sf)
{
  PetscLayout columns;

  PetscFunctionBegin;
  *sf = NULL;
  if (!parts.outside) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLayouts(M, NULL, &columns));
  PetscCall(PetscSFCreate(PetscObjectComm((PetscObject)M), sf));
  PetscCall(PetscSFSetGraphLayout(*sf, columns, parts.nghosts, NULL, PETSC_USE_POINTER, parts.ghosts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* mark[c] = 1 for the columns c of the rows r of M with rows[r]; rows NULL: of all rows */
PetscErrorCode MarkColumns(Mat M, const PetscInt rows[], PetscInt mark[])
{
  Parts                 parts;
  PetscSF               sf;
  std::vector<PetscInt> ghostMark;

  PetscFunctionBegin;
  PetscCall(GetParts(M, parts));
  ghostMark.assign(parts.nghosts, 0);
  for (Mat part : {parts.inside, parts.outside}) {
    PetscInt        n;
    const PetscInt *ia, *ja;
    PetscBool       done;

    if (!part) continue;
    PetscCall(MatGetRowIJ(part, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    for (PetscInt i = 0; i < n; i++) {
      if (rows && !rows[i]) continue;
      for (PetscInt k = ia[i]; k < ia[i + 1]; k++) (part == parts.inside ? mark : ghostMark.data())[ja[k]] = 1;
    }
    PetscCall(MatRestoreRowIJ(part, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  }
  PetscCall(CreateGhostSF(M, parts, &sf));
  if (sf) {
    PetscCall(PetscSFReduceBegin(sf, MPIU_INT, ghostMark.data(), mark, MPI_MAX));
    PetscCall(PetscSFReduceEnd(sf, MPIU_INT, ghostMark.data(), mark, MPI_MAX));
    PetscCall(PetscSFDestroy(&sf));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* mark[r] = 1 for the rows r of M that have an entry in a column c with columns[c] */
PetscErrorCode MarkRows(Mat M, const PetscInt columns[], PetscInt mark[])
{
  Parts                 parts;
  PetscSF               sf;
  std::vector<PetscInt> ghostColumns;

  PetscFunctionBegin;
  PetscCall(GetParts(M, parts));
  ghostColumns.assign(parts.nghosts, 0);
  PetscCall(CreateGhostSF(M, parts, &sf));
  if (sf) {
    PetscCall(PetscSFBcastBegin(sf, MPIU_INT, columns, ghostColumns.data(), MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(sf, MPIU_INT, columns, ghostColumns.data(), MPI_REPLACE));
    PetscCall(PetscSFDestroy(&sf));
  }
  for (Mat part : {parts.inside, parts.outside}) {
    PetscInt        n;
    const PetscInt *ia, *ja;
    PetscBool       done;

    if (!part) continue;
    PetscCall(MatGetRowIJ(part, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
    for (PetscInt i = 0; i < n; i++)
      for (PetscInt k = ia[i]; k < ia[i + 1] && !mark[i]; k++) mark[i] = (part == parts.inside ? columns : ghostColumns.data())[ja[k]];
    PetscCall(MatRestoreRowIJ(part, 0, PETSC_FALSE, PETSC_FALSE, &n, &ia, &ja, &done));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

/*
   AinsworthSurfaceCreate - the degrees of freedom that a row of C touches, and those that A, if given, couples to them

   Each rank holds its own, ascending, so that an AIJ matrix on the surface has them in the order of A. A symmetric pattern spares the look
   at all of A.
*/
PetscErrorCode AinsworthSurfaceCreate(Mat A, Mat C, PetscBool symmetric, IS *dofs)
{
  PetscInt              n, rstart, *owned;
  std::vector<PetscInt> constrained, mark, list;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(C, NULL, &n));
  PetscCall(MatGetOwnershipRangeColumn(C, &rstart, NULL));
  constrained.assign(n, 0);
  PetscCall(MarkColumns(C, NULL, constrained.data()));
  mark = constrained;
  if (A) PetscCall(MarkColumns(A, constrained.data(), mark.data()));
  if (A && !symmetric) PetscCall(MarkRows(A, constrained.data(), mark.data()));
  for (PetscInt i = 0; i < n; i++)
    if (mark[i]) list.push_back(rstart + i);
  PetscCall(PetscMalloc1(list.size(), &owned));
  std::copy(list.begin(), list.end(), owned);
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)C), (PetscInt)list.size(), owned, PETSC_OWN_POINTER, dofs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The degrees of freedom of this rank that a row of C touches */
PetscErrorCode AinsworthSurfaceCountConstrained(Mat C, PetscInt *count)
{
  PetscInt              n;
  std::vector<PetscInt> mark;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(C, NULL, &n));
  mark.assign(n, 0);
  PetscCall(MarkColumns(C, NULL, mark.data()));
  *count = (PetscInt)std::count(mark.begin(), mark.end(), 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The degrees of freedom that the ghost columns of M, a matrix on the surface, stand for; ascending */
PetscErrorCode AinsworthSurfaceGetGhosts(Mat M, IS dofs, std::vector<PetscInt> &ghosts)
{
  Parts           parts;
  PetscSF         sf;
  const PetscInt *owned;

  PetscFunctionBegin;
  PetscCall(GetParts(M, parts));
  ghosts.resize(parts.nghosts);
  PetscCall(CreateGhostSF(M, parts, &sf));
  if (!sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ISGetIndices(dofs, &owned));
  PetscCall(PetscSFBcastBegin(sf, MPIU_INT, owned, ghosts.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, MPIU_INT, owned, ghosts.data(), MPI_REPLACE));
  PetscCall(ISRestoreIndices(dofs, &owned));
  PetscCall(PetscSFDestroy(&sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}
