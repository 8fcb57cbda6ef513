/* AIJ matrices that own arrays filled here, without a copy */
#include "arrays.h"
#include "saddle.h"
#include "../objects.h"
#include <algorithm>

/*
   AinsworthMatCreateFromRows - creates an AIJ matrix with n local columns from arrays that it takes over. Collective

   own: entries in local columns, with local numbers. others: entries in columns of other ranks, with global numbers.
*/
PetscErrorCode AinsworthMatCreateFromRows(MPI_Comm comm, PetscInt n, std::unique_ptr<AinsworthRows> own, std::unique_ptr<AinsworthRows> others, Mat *mat)
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
  PetscCall(MatCreateMPIAIJWithSplitArrays(comm, m, n, PETSC_DETERMINE, PETSC_DETERMINE, own->i.data(), own->j.get(), own->a.get(), others->i.data(),
                                           others->j.get(), others->a.get(), mat));
  PetscCall(MatMPIAIJGetSeqAIJ(*mat, &part[0], &part[1], NULL));
  PetscCall(AinsworthAttach((PetscObject)part[0], "AinsworthRows", std::move(own)));
  PetscCall(AinsworthAttach((PetscObject)part[1], "AinsworthRows", std::move(others)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthAIJGetParts - gets the sequential parts of an AIJ matrix: its local columns, and its columns of other ranks (or NULL) with their global numbers */
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

/* Reads the diagonal of an AIJ matrix by bisection of each row; MatGetDiagonal() searches linearly */
static PetscErrorCode ReadDiagonal(Mat aij, Vec diagonal)
{
  Mat             mat[2];
  const PetscInt *ghosts;
  PetscInt        nghosts;
  PetscScalar    *d;
  AinsworthCSR    part;

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(aij, mat, &ghosts, &nghosts));
  PetscCall(part.open(mat[0]));
  PetscCall(VecGetArrayWrite(diagonal, &d));
  for (PetscInt r = 0; r < part.n; r++) {
    const PetscInt *end = part.ja + part.ia[r + 1], *at = std::lower_bound(part.ja + part.ia[r], end, r);

    d[r] = at < end && *at == r ? part.a[at - part.ja] : 0.0;
  }
  PetscCall(VecRestoreArrayWrite(diagonal, &d));
  PetscCall(part.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGetDiagonal - gets the diagonal of any matrix

   Caches the diagonal of an AIJ matrix with the matrix, until its state changes: every row is a memory access, and a set-up after a change of C alone would
   spend a quarter of its time here.
*/
PetscErrorCode AinsworthGetDiagonal(Mat M, Vec diagonal)
{
  static const char name[] = "AinsworthDiagonal", mark[] = "AinsworthDiagonalKept";
  PetscBool         aij, kept, current;
  Vec               copy;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)M, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (!aij) {
    PetscCall(MatGetDiagonal(M, diagonal));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthRecall((PetscObject)M, mark, &kept, &current));
  PetscCall(PetscObjectQuery((PetscObject)M, name, (PetscObject *)&copy));
  if (copy && current) {
    PetscCall(VecCopy(copy, diagonal));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(ReadDiagonal(M, diagonal));
  if (!copy) {
    PetscCall(VecDuplicate(diagonal, &copy));
    PetscCall(PetscObjectCompose((PetscObject)M, name, (PetscObject)copy));
    PetscCall(PetscObjectDereference((PetscObject)copy)); /* M holds the reference */
  }
  PetscCall(VecCopy(diagonal, copy));
  PetscCall(AinsworthRemember((PetscObject)M, mark, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthAbsoluteMult - computes y = |M| |x|, entrywise, for an AIJ matrix, without a copy of M */
PetscErrorCode AinsworthAbsoluteMult(Mat M, Vec x, Vec y)
{
  Mat             mat[2];
  Vec             from[2] = {x, NULL};
  const PetscInt *ghosts;
  PetscInt        nghosts;
  PetscScalar    *sum;
  AinsworthCSR    part;

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(M, mat, &ghosts, &nghosts));
  if (mat[1]) PetscCall(AinsworthVecGather(x, nghosts, ghosts, &from[1]));
  PetscCall(VecZeroEntries(y));
  PetscCall(VecGetArray(y, &sum));
  for (int k = 0; k < 2 && mat[k]; k++) {
    const PetscScalar *v;

    PetscCall(part.open(mat[k]));
    PetscCall(VecGetArrayRead(from[k], &v));
    for (PetscInt r = 0; r < part.n; r++) {
      PetscReal terms = 0.0;

      for (PetscInt e = part.ia[r]; e < part.ia[r + 1]; e++) terms += PetscAbsScalar(part.a[e]) * PetscAbsScalar(v[part.ja[e]]);
      sum[r] += terms;
    }
    PetscCall(VecRestoreArrayRead(from[k], &v));
    PetscCall(part.close());
  }
  PetscCall(VecRestoreArray(y, &sum));
  PetscCall(VecDestroy(&from[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthAbsoluteMultTranspose - computes y = |M|' |x|, entrywise, for an AIJ matrix */
PetscErrorCode AinsworthAbsoluteMultTranspose(Mat M, Vec x, Vec y)
{
  Mat entries;
  Vec sizes;

  PetscFunctionBegin;
  PetscCall(AinsworthAbsoluteAIJ(M, &entries));
  PetscCall(AinsworthVecClone(x, &sizes));
  PetscCall(VecAbs(sizes));
  PetscCall(MatMultTranspose(entries, sizes, y));
  PetscCall(VecDestroy(&sizes));
  PetscCall(MatDestroy(&entries));
  PetscFunctionReturn(PETSC_SUCCESS);
}
