/* The whole system as one AIJ matrix, and the predicted cost of its factorization */
#include "whole.h"
#include "../base/guard.h"
#include "../projection/factor.h"
#include "../projection/graph.h"

/*
   Creates a copy of M, AIJ with the layout of the rows of `like`, times a scalar, in which every diagonal entry is
   stored; M may be NULL
*/
static PetscErrorCode WithDiagonal(Mat like, PetscScalar scale, Mat M, Mat *copy)
{
  AinsworthEntries zeros;
  PetscInt         start, end;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(like, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    zeros.add(i, 0.0);
    zeros.endRow();
  }
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)like), end - start, zeros, copy));
  PetscCall(AinsworthAddAIJ(scale, {M}, copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthWholeAssemble - creates [A B'; C -D]; each rank has its rows of A, then its rows of C. Packages need every
   diagonal entry stored. Collective
*/
PetscErrorCode AinsworthWholeAssemble(const AinsworthSaddle *sp, Mat *K)
{
  MPI_Comm        comm = PetscObjectComm((PetscObject)sp->A);
  Mat             A, withDiagonal, adjoint, minusD;
  PetscInt        local[2], both, start = 0;
  std::vector<IS> fields(2);

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(sp->kept.C, &local[1], &local[0]));
  both = local[0] + local[1];
  PetscCallMPI(MPI_Exscan(&both, &start, 1, MPIU_INT, MPI_SUM, comm));
  PetscCall(ISCreateStride(comm, local[0], start, 1, &fields[0]));
  PetscCall(ISCreateStride(comm, local[1], start + local[0], 1, &fields[1]));
  PetscCall(AinsworthGetAIJ(sp->A, &A));
  PetscCall(WithDiagonal(A, 1.0, A, &withDiagonal));
  PetscCall(MatDestroy(&A));
  PetscCall(WithDiagonal(sp->kept.C, -1.0, sp->kept.D, &minusD));
  PetscCall(MatHermitianTranspose(sp->kept.B, MAT_INITIAL_MATRIX, &adjoint));
  PetscCall(AinsworthMergeAIJ(comm, fields, fields, {withDiagonal, adjoint, sp->kept.C, minusD}, K));
  PetscAssert(*K, comm, PETSC_ERR_PLIB, "The blocks of the whole system do not fit together");
  for (Mat *mat : {&withDiagonal, &adjoint, &minusD}) PetscCall(MatDestroy(mat));
  for (IS &is : fields) PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Predict(Mat graph, AinsworthCost *cost)
{
  MatOrderingType ordering;
  IS              order;

  PetscFunctionBegin;
  PetscCall(AinsworthFactorPredictBest(graph, 1, cost, &ordering, &order));
  PetscCall(ISDestroy(&order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthWholePredict - predicts the cost of factoring the whole system: L of L D L', or L and U if it is not
   symmetric. Collective, the same on all ranks

   A lower bound: the prediction is of a factorization without pivoting, which delays pivots and so adds fill where the
   system is indefinite
*/
PetscErrorCode AinsworthWholePredict(const AinsworthSaddle *sp, PetscBool symmetric, AinsworthCost *cost)
{
  MPI_Comm        comm    = PetscObjectComm((PetscObject)sp->A);
  const PetscReal factors = symmetric && !PetscDefined(USE_COMPLEX) ? 1.0 : 2.0;
  PetscMPIInt     rank, error = PETSC_SUCCESS;
  Mat             K, *graph;

  PetscFunctionBegin;
  PetscCall(AinsworthWholeAssemble(sp, &K));
  if (!symmetric) PetscCall(AinsworthMakePatternSymmetric(&K));
  PetscCall(AinsworthGraphOfNodes({K}, 1, &graph));
  PetscCall(MatDestroy(&K));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) error = (PetscMPIInt)AinsworthGuarded<Predict>(graph[0], cost);
  PetscCall(MatDestroySubMatrices(1, &graph));
  PetscCallMPI(MPI_Bcast(&error, 1, MPI_INT, 0, comm));
  PetscCall((PetscErrorCode)error);
  PetscCallMPI(MPI_Bcast(cost, 2, MPIU_REAL, 0, comm));
  cost->entries *= factors;
  cost->operations *= factors;
  PetscFunctionReturn(PETSC_SUCCESS);
}
