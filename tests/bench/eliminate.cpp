/*
   Elimination: each constraint expresses one unknown that no other constraint has, its slave, by the others: x = T y +
   x0. The rows of the slaves stay in T' A T as a multiple of the identity, so that the blocks of the nodes survive for
   multigrid.
*/
#include "forms.h"
#include <vector>

/* For each entry of the local rows of C: is it the only one of its column? */
static PetscErrorCode SoleEntries(Mat C, const std::vector<PetscInt> &columns, std::vector<PetscScalar> &sole)
{
  Mat        Ct;
  Vec        all, local;
  IS         is;
  VecScatter scatter;
  PetscInt   start, end, count;

  PetscFunctionBeginUser;
  PetscCall(MatTranspose(C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(MatCreateVecs(C, &all, NULL));
  PetscCall(MatGetOwnershipRange(Ct, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscCall(MatGetRow(Ct, i, &count, NULL, NULL));
    PetscCall(VecSetValue(all, i, count == 1, INSERT_VALUES));
    PetscCall(MatRestoreRow(Ct, i, &count, NULL, NULL));
  }
  PetscCall(VecAssemblyBegin(all));
  PetscCall(VecAssemblyEnd(all));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, (PetscInt)sole.size(), sole.data(), &local));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, (PetscInt)columns.size(), columns.data(), PETSC_COPY_VALUES, &is));
  PetscCall(VecScatterCreate(all, is, local, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, all, local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, all, local, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(ISDestroy(&is));
  PetscCall(VecDestroy(&local));
  PetscCall(VecDestroy(&all));
  PetscCall(MatDestroy(&Ct));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The local rows of C, one after the other, and the place of the slave in each */
struct Rows {
  std::vector<PetscInt>    first, columns, slave;
  std::vector<PetscScalar> values;
};

/* The largest entry among those that no other row has in its column */
static PetscErrorCode ChooseSlaves(Mat C, Rows *rows)
{
  PetscInt start, end, bad[2] = {PETSC_MAX_INT, 0};

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  rows->first.assign(1, 0);
  for (PetscInt i = start; i < end; i++) {
    const PetscInt    *columns;
    const PetscScalar *values;
    PetscInt           count;

    PetscCall(MatGetRow(C, i, &count, &columns, &values));
    rows->columns.insert(rows->columns.end(), columns, columns + count);
    rows->values.insert(rows->values.end(), values, values + count);
    rows->first.push_back((PetscInt)rows->columns.size());
    PetscCall(MatRestoreRow(C, i, &count, &columns, &values));
  }
  std::vector<PetscScalar> sole(rows->columns.size());
  PetscCall(SoleEntries(C, rows->columns, sole));
  for (PetscInt i = 0; i < end - start; i++) {
    PetscInt best = -1;

    for (PetscInt k = rows->first[i]; k < rows->first[i + 1]; k++)
      if (PetscRealPart(sole[k]) > 0 &&
          (best < 0 || PetscAbsScalar(rows->values[k]) > PetscAbsScalar(rows->values[best])))
        best = k;
    if (best < 0) bad[0] = PetscMin(bad[0], start + i);
    rows->slave.push_back(best);
  }
  PetscCallMPI(MPI_Allreduce(&bad[0], &bad[1], 1, MPIU_INT, MPI_MIN, PetscObjectComm((PetscObject)C)));
  PetscCheck(bad[1] == PETSC_MAX_INT, PetscObjectComm((PetscObject)C), PETSC_ERR_SUP,
             "Row %" PetscInt_FMT " of C has no unknown of its own to eliminate", bad[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of T: of the slaves from the constraints, of the others from the identity */
static PetscErrorCode CreateT(Mat A, const Rows &rows, Vec lengths, Mat *T)
{
  PetscInt              n, N, start, bs;
  const PetscScalar    *length;
  std::vector<PetscInt> count;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(MatGetOwnershipRange(A, &start, NULL));
  PetscCall(MatGetBlockSize(A, &bs));
  PetscCall(VecGetArrayRead(lengths, &length));
  for (PetscInt i = 0; i < n; i++) count.push_back(PetscMax(1, (PetscInt)PetscRealPart(length[i])));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), T));
  PetscCall(MatSetSizes(*T, n, n, N, N));
  PetscCall(MatSetBlockSize(*T, bs));
  PetscCall(MatSetType(*T, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*T, 0, count.data()));
  PetscCall(MatMPIAIJSetPreallocation(*T, 0, count.data(), 0, count.data()));
  for (PetscInt i = 0; i < n; i++)
    if (PetscRealPart(length[i]) == 0) PetscCall(MatSetValue(*T, start + i, start + i, 1.0, INSERT_VALUES));
  PetscCall(VecRestoreArrayRead(lengths, &length));
  for (size_t r = 0; r < rows.slave.size(); r++) {
    const PetscInt s = rows.slave[r];

    for (PetscInt k = rows.first[r]; k < rows.first[r + 1]; k++) /* the stored zero keeps a place for the diagonal */
      PetscCall(MatSetValue(*T, rows.columns[s], rows.columns[k], k == s ? 0.0 : -rows.values[k] / rows.values[s],
                            INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*T, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*T, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FormCreateEliminated(Vec g, Form *form)
{
  Rows                  rows;
  std::vector<PetscInt> slaves;
  Vec                   lengths, diagonal, r;
  const PetscScalar    *value;
  PetscInt              start;

  PetscFunctionBeginUser;
  PetscCall(ChooseSlaves(form->C, &rows));
  PetscCall(MatCreateVecs(form->A, &lengths, &form->x0));
  PetscCall(VecDuplicate(lengths, &diagonal));
  PetscCall(VecDuplicate(lengths, &r));
  PetscCall(VecDuplicate(g, &form->coefficients));
  PetscCall(VecGetOwnershipRange(g, &start, NULL));
  PetscCall(VecGetArrayRead(g, &value));
  for (size_t i = 0; i < rows.slave.size(); i++) {
    const PetscInt s = rows.slave[i];

    slaves.push_back(rows.columns[s]);
    PetscCall(VecSetValue(lengths, rows.columns[s], rows.first[i + 1] - rows.first[i], INSERT_VALUES));
    PetscCall(VecSetValue(form->x0, rows.columns[s], value[i] / rows.values[s], INSERT_VALUES));
    PetscCall(VecSetValue(form->coefficients, start + (PetscInt)i, PetscConj(rows.values[s]), INSERT_VALUES));
  }
  PetscCall(VecRestoreArrayRead(g, &value));
  for (Vec v : {lengths, form->x0, form->coefficients}) {
    PetscCall(VecAssemblyBegin(v));
    PetscCall(VecAssemblyEnd(v));
  }
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)g), (PetscInt)slaves.size(), slaves.data(), PETSC_COPY_VALUES,
                            &form->slaves));
  PetscCall(CreateT(form->A, rows, lengths, &form->T));
  PetscCall(MatPtAP(form->A, form->T, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &form->K));
  /* the stiffness of the slaves on the diagonal of their rows, which are zero */
  PetscCall(MatGetDiagonal(form->A, diagonal));
  PetscCall(VecPointwiseDivide(r, lengths, lengths)); /* one, or zero where there is no slave */
  PetscCall(VecPointwiseMult(diagonal, diagonal, r));
  PetscCall(MatDiagonalSet(form->K, diagonal, ADD_VALUES));
  PetscCall(MatSetOption(form->K, MAT_SPD, PETSC_TRUE));
  PetscCall(FormCopyNearNullSpace(form->A, form->K));
  form->M = form->K;
  PetscCall(PetscObjectReference((PetscObject)form->M));
  PetscCall(MatMult(form->A, form->x0, r));
  PetscCall(VecAYPX(r, -1.0, form->f));
  PetscCall(MatCreateVecs(form->K, &form->y, &form->rhs));
  PetscCall(MatMultHermitianTranspose(form->T, r, form->rhs));
  PetscCall(VecDestroy(&lengths));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(VecDestroy(&r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residual in the row of a slave is that of its constraint alone */
PetscErrorCode FormGetEliminated(const Form &form, Vec x, Vec lambda)
{
  Vec        r;
  VecScatter scatter;

  PetscFunctionBeginUser;
  PetscCall(MatMultAdd(form.T, form.y, form.x0, x));
  PetscCall(VecDuplicate(x, &r));
  PetscCall(MatMult(form.A, x, r));
  PetscCall(VecAYPX(r, -1.0, form.f));
  PetscCall(VecScatterCreate(r, form.slaves, lambda, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, r, lambda, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, r, lambda, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(VecPointwiseDivide(lambda, lambda, form.coefficients));
  PetscCall(VecDestroy(&r));
  PetscFunctionReturn(PETSC_SUCCESS);
}
