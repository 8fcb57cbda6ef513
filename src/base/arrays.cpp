/* AIJ matrices made of arrays, which they may own, and the arrays of others */
#include "arrays.h"
#include "layouts.h"
#include "objects.h"

/*
   AinsworthMatCreateFromRows - creates an AIJ matrix with n local columns from arrays that it takes over. Collective

   own: entries in local columns, with local numbers. others: entries in columns of other ranks, with global numbers.
*/
PetscErrorCode AinsworthMatCreateFromRows(MPI_Comm comm, PetscInt n, std::unique_ptr<AinsworthRows> own,
                                          std::unique_ptr<AinsworthRows> others, Mat *mat)
{
  const PetscInt m = (PetscInt)own->i.size() - 1;
  PetscMPIInt    size;
  Mat            part[2];

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (size == 1) {
    PetscCall(MatCreateSeqAIJWithArrays(comm, m, n, own->i.data(), own->j.get(), own->a.get(), mat));
    PetscCall(AinsworthAttach((PetscObject)*mat, "AinsworthRows", std::move(own)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatCreateMPIAIJWithSplitArrays(comm, m, n, PETSC_DETERMINE, PETSC_DETERMINE, own->i.data(), own->j.get(),
                                           own->a.get(), others->i.data(), others->j.get(), others->a.get(), mat));
  PetscCall(MatMPIAIJGetSeqAIJ(*mat, &part[0], &part[1], NULL));
  PetscCall(AinsworthAttach((PetscObject)part[0], "AinsworthRows", std::move(own)));
  PetscCall(AinsworthAttach((PetscObject)part[1], "AinsworthRows", std::move(others)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthAIJGetParts - gets the sequential parts of an AIJ matrix: its local columns, and its columns of other ranks
   (or NULL) with their global numbers
*/
PetscErrorCode AinsworthAIJGetParts(Mat aij, Mat part[2], const PetscInt *ghosts[], PetscInt *n)
{
  PetscBool mpi;

  PetscFunctionBegin;
  part[0] = aij;
  part[1] = NULL;
  *ghosts = NULL;
  *n      = 0;
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)aij, MATMPIAIJ, &mpi));
  if (!mpi) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatMPIAIJGetSeqAIJ(aij, &part[0], &part[1], ghosts));
  PetscCall(MatGetLocalSize(part[1], NULL, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthColumnsCreateSF - creates the star forest from the columns of an AIJ matrix to other ranks that have them in
   rows, in the order of AinsworthAIJGetParts(); NULL on one rank. Collective
*/
PetscErrorCode AinsworthColumnsCreateSF(Mat aij, PetscSF *sf)
{
  Mat             part[2];
  const PetscInt *ghosts;
  PetscInt        n;
  PetscLayout     columns;

  PetscFunctionBegin;
  *sf = NULL;
  PetscCall(AinsworthAIJGetParts(aij, part, &ghosts, &n));
  if (!part[1]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLayouts(aij, NULL, &columns));
  PetscCall(PetscSFCreate(PetscObjectComm((PetscObject)aij), sf));
  PetscCall(PetscSFSetGraphLayout(*sf, columns, n, NULL, PETSC_USE_POINTER, ghosts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives a matrix with sizes its type and entries. Collective */
static PetscErrorCode Fill(const AinsworthEntries &rows, Mat aij)
{
  const PetscInt    column = 0, *j = rows.columns.empty() ? &column : rows.columns.data(); /* avoid null pointers */
  const PetscScalar value = 0.0, *a = rows.values.empty() ? &value : rows.values.data();

  PetscFunctionBegin;
  PetscCall(MatSetType(aij, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(aij, rows.start.data(), j, a));
  PetscCall(MatMPIAIJSetPreallocationCSR(aij, rows.start.data(), j, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCreateAIJ - creates an AIJ matrix from its local rows, with n local columns. Collective */
PetscErrorCode AinsworthCreateAIJ(MPI_Comm comm, PetscInt n, const AinsworthEntries &rows, Mat *aij)
{
  PetscLayout layout[2];

  PetscFunctionBegin;
  PetscCall(AinsworthLayoutOfSize(comm, (PetscInt)rows.start.size() - 1, &layout[0]));
  PetscCall(AinsworthLayoutOfSize(comm, n, &layout[1]));
  PetscCall(MatCreate(comm, aij));
  PetscCall(MatSetLayouts(*aij, layout[0], layout[1]));
  for (PetscLayout &l : layout) PetscCall(PetscLayoutDestroy(&l));
  PetscCall(Fill(rows, *aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCreateAIJLike - creates an AIJ matrix of the rows and columns of `like` from its local rows. Collective */
PetscErrorCode AinsworthCreateAIJLike(Mat like, const AinsworthEntries &rows, Mat *aij)
{
  PetscLayout layout[2];

  PetscFunctionBegin;
  PetscCall(MatGetLayouts(like, &layout[0], &layout[1]));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)like), aij));
  PetscCall(MatSetLayouts(*aij, layout[0], layout[1]));
  PetscCall(Fill(rows, *aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}
