/* Distributed to dense and back, and the formulas of the method */
#include "dense.h"

PetscErrorCode Gather(Vec v, Column &column)
{
  PetscInt           size, start, end;
  const PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecGetSize(v, &size));
  PetscCall(VecGetOwnershipRange(v, &start, &end));
  column = Column::Zero(size);
  PetscCall(VecGetArrayRead(v, &a));
  for (PetscInt i = start; i < end; i++) column[i] = a[i - start];
  PetscCall(VecRestoreArrayRead(v, &a));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, column.data(), (PetscMPIInt)size, MPIU_SCALAR, MPIU_SUM,
                             PetscObjectComm((PetscObject)v)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Scatter(const Column &column, Vec v)
{
  PetscInt     start, end;
  PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecGetOwnershipRange(v, &start, &end));
  PetscCall(VecGetArrayWrite(v, &a));
  for (PetscInt i = start; i < end; i++) a[i - start] = column[i];
  PetscCall(VecRestoreArrayWrite(v, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GatherOperator(Vec in, Vec out, const std::function<PetscErrorCode(Vec, Vec)> &op, Dense &dense)
{
  PetscInt           rows, cols, start, end, istart, iend;
  const PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecGetSize(out, &rows));
  PetscCall(VecGetSize(in, &cols));
  PetscCall(VecGetOwnershipRange(out, &start, &end));
  PetscCall(VecGetOwnershipRange(in, &istart, &iend));
  dense = Dense::Zero(rows, cols);
  for (PetscInt j = 0; j < cols; j++) {
    PetscScalar *unit;

    PetscCall(VecGetArrayWrite(in, &unit));
    for (PetscInt i = istart; i < iend; i++) unit[i - istart] = i == j ? 1.0 : 0.0;
    PetscCall(VecRestoreArrayWrite(in, &unit));
    PetscCall(VecSet(out, 12345.0)); /* to be overwritten */
    PetscCall(op(in, out));
    PetscCall(VecGetArrayRead(out, &a));
    for (PetscInt i = start; i < end; i++) dense(i, j) = a[i - start];
    PetscCall(VecRestoreArrayRead(out, &a));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, dense.data(), (PetscMPIInt)dense.size(), MPIU_SCALAR, MPIU_SUM,
                             PetscObjectComm((PetscObject)in)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Gather(Mat mat, Dense &dense)
{
  Vec in, out;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(mat, &in, &out));
  PetscCall(GatherOperator(
    in, out, [mat](Vec x, Vec y) { return MatMult(mat, x, y); }, dense));
  PetscCall(VecDestroy(&in));
  PetscCall(VecDestroy(&out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Gather(const System &sys, DenseSystem &dense)
{
  PetscFunctionBeginUser;
  PetscCall(Gather(sys.A, dense.A));
  PetscCall(Gather(sys.C, dense.C));
  PetscCall(Gather(sys.f, dense.f));
  PetscCall(Gather(sys.g, dense.g));
  PetscCall(Gather(sys.w, dense.w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

DenseProjector::DenseProjector(const Dense &C, const Column &W)
{
  const Eigen::Index m = C.rows(), n = C.cols();

  S = C * W.asDiagonal() * C.adjoint();
  /* rows to unit length: LU sees the angles between them and not their scales */
  const Column d   = S.diagonal().cwiseSqrt().cwiseInverse();
  const Dense  inv = d.asDiagonal() * Dense(d.asDiagonal() * S * d.asDiagonal()).fullPivLu().inverse() * d.asDiagonal();
  R                = m ? Dense(W.asDiagonal() * C.adjoint() * inv) : Dense::Zero(n, 0);
  P                = R * C;
  Q                = Dense::Identity(n, n) - P;
}

Column DiagonalWeight(const Dense &A)
{
  return A.diagonal().cwiseInverse();
}

/*
   Weights that are zero so far: the inverse of the stiffness that an unknown gets through the rows of C, from those
   with a weight to the next
*/
void WeighLoose(const Dense &C, Column &W)
{
  for (bool found = true; found;) {
    const Column before = W;

    found = false;
    for (Eigen::Index l = 0; l < W.size(); l++) {
      PetscReal stiffness = 0.0;

      for (Eigen::Index i = 0; i < C.rows() && before[l] == 0.0; i++) {
        const PetscReal flexible = std::abs(PetscScalar((C.row(i).cwiseAbs2() * before.cwiseAbs()).value()));

        if (flexible > 0.0) stiffness += std::norm(C(i, l)) / flexible;
      }
      if (stiffness > 0.0) {
        W[l]  = 1.0 / stiffness;
        found = true;
      }
    }
  }
}

Column RowPenalty(const Dense &A, const Dense &C, PetscReal factor)
{
  const Dense S = C * DiagonalWeight(A).asDiagonal() * C.adjoint();
  return factor * S.diagonal().cwiseInverse();
}

Dense ReducedOperator(const Dense &A, const Dense &C, const Dense &Q, const Column &B)
{
  return C.adjoint() * B.asDiagonal() * C + Q.adjoint() * A * Q;
}

void SolveSaddle(const DenseSystem &s, Column &x, Column &lambda)
{
  const Eigen::Index n = s.A.rows(), m = s.C.rows();
  const Column       c = m ? Column(s.C.rowwise().norm().cwiseInverse().cast<PetscScalar>()) : Column(0);
  Dense              K = Dense::Zero(n + m, n + m);
  Column             b(n + m), y;
  const PetscReal    a = s.A.cwiseAbs().maxCoeff(); /* rows and columns of the constraints as large as A */

  K.topLeftCorner(n, n)    = s.A;
  K.bottomLeftCorner(m, n) = a * c.asDiagonal() * s.C;
  K.topRightCorner(n, m)   = K.bottomLeftCorner(m, n).adjoint();
  b.head(n)                = s.f;
  b.tail(m)                = a * c.asDiagonal() * s.g;
  const Eigen::FullPivLU<Dense> lu(K);
  y = lu.solve(b);
  y += lu.solve(b - K * y);
  x      = y.head(n);
  lambda = a * c.asDiagonal() * y.tail(m);
}
