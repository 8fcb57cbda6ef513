#include "small.h"
#include "../base/eigen.h"
#include <cmath>

AinsworthSmall AinsworthSmallProduct(const AinsworthSmall &A, const AinsworthSmall &B)
{
  AinsworthSmall C(A.rows, B.cols);

  for (PetscInt j = 0; j < B.cols; j++)
    for (PetscInt k = 0; k < A.cols; k++)
      for (PetscInt i = 0; i < A.rows; i++) C(i, j) += A(i, k) * B(k, j);
  return C;
}

AinsworthSmall AinsworthSmallAdjointProduct(const AinsworthSmall &A, const AinsworthSmall &B)
{
  AinsworthSmall C(A.cols, B.cols);

  for (PetscInt j = 0; j < B.cols; j++)
    for (PetscInt i = 0; i < A.cols; i++)
      for (PetscInt k = 0; k < A.rows; k++) C(i, j) += PetscConj(A(k, i)) * B(k, j);
  return C;
}

PetscErrorCode AinsworthSmallEigen(MPI_Comm comm, AinsworthSmall *A, std::vector<PetscReal> *w)
{
  PetscMPIInt  rank, n, size;
  PetscBLASInt info = 0;
  int          failed;

  PetscFunctionBegin;
  w->resize(A->rows);
  if (!A->rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(PetscMPIIntCast(A->rows, &n));
  PetscCall(PetscMPIIntCast((PetscInt)A->a.size(), &size));
  if (!rank) PetscCall(AinsworthHermitianEigen(A->rows, A->a.data(), w->data(), &info));
  failed = (int)info;
  PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, comm)); /* the others would wait for its results */
  PetscCheck(!failed, comm, PETSC_ERR_LIB, "Error in LAPACK syev: info=%d", failed);
  PetscCallMPI(MPI_Bcast(w->data(), n, MPIU_REAL, 0, comm));
  PetscCallMPI(MPI_Bcast(A->a.data(), size, MPIU_SCALAR, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSmallOrthonormalize(MPI_Comm comm, AinsworthSmall G, std::vector<PetscReal> diagonal,
                                            PetscReal least, AinsworthSmall *T, PetscReal *smallest)
{
  const PetscInt         n = G.rows;
  std::vector<PetscReal> w;
  PetscInt               left = 0;

  PetscFunctionBegin;
  if (diagonal.empty())
    for (PetscInt i = 0; i < n; i++) diagonal.push_back(PetscRealPart(G(i, i)));
  for (PetscReal &d : diagonal) d = d > 0.0 ? 1.0 / std::sqrt(d) : 0.0;
  for (PetscInt j = 0; j < n; j++)
    for (PetscInt i = 0; i < n; i++) G(i, j) *= diagonal[i] * diagonal[j];
  PetscCall(AinsworthSmallEigen(comm, &G, &w));
  *smallest = n ? w[0] : 1.0;
  while (left < n && w[left] <= least) left++;
  *T = AinsworthSmall(n, n - left);
  for (PetscInt j = left; j < n; j++)
    for (PetscInt i = 0; i < n; i++) (*T)(i, j - left) = diagonal[i] * G(i, j) / std::sqrt(w[j]);
  PetscFunctionReturn(PETSC_SUCCESS);
}
