/* A sparse system as PETSc matrices, and its solve */
#include "structured.h"

/* Rows of this rank, with the diagonal of a square matrix, if asked for */
static PetscErrorCode Fill(const Sparse &values, PetscInt rows, PetscInt columns, PetscInt bs, bool diagonal, Mat *M)
{
  std::vector<PetscInt>    start{0}, column;
  std::vector<PetscScalar> value;
  PetscInt                 end = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Scan(&rows, &end, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  for (PetscInt i = end - rows; i < end; i++) {
    bool stored = !diagonal || values.rows() != values.cols();

    for (Sparse::InnerIterator it(values, (Eigen::Index)i); it; ++it) {
      if (it.value() == 0.0 && it.col() != i) continue;
      if (!stored && it.col() >= i) {
        if (it.col() > i) {
          column.push_back(i);
          value.push_back(0.0);
        }
        stored = true;
      }
      if (it.value() == 0.0 && !diagonal) continue;
      column.push_back((PetscInt)it.col());
      value.push_back((PetscScalar)it.value());
    }
    if (!stored) {
      column.push_back(i);
      value.push_back(0.0);
    }
    start.push_back((PetscInt)column.size());
  }
  PetscCall(MatCreate(PETSC_COMM_WORLD, M));
  PetscCall(MatSetSizes(*M, rows, columns, (PetscInt)values.rows(), (PetscInt)values.cols()));
  PetscCall(MatSetBlockSize(*M, bs));
  PetscCall(MatSetType(*M, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(*M, start.data(), column.data(), value.data()));
  PetscCall(MatMPIAIJSetPreallocationCSR(*M, start.data(), column.data(), value.data()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode StructuredSolve(const Structured &s, const PetscInt local[2], Answer &a)
{
  Mat M[2][2] =
    {
      {NULL, NULL},
      {NULL, NULL}
  },
      nest;
  KSP    ksp;
  Sparse block[2][2];
  Vector rhs[2];

  PetscFunctionBeginUser;
  StructuredBlocks(s, block, rhs);
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++)
      if ((block[i][j].size() || i != j) && !(i < j && (s.form == 1 || s.form == 2)) && !(i > j && s.form == 3))
        PetscCall(Fill(block[i][j], local[i], local[j], i + j ? 1 : s.bs, s.diagonal, &M[i][j]));
  if (s.form == 1) PetscCall(MatCreateHermitianTranspose(M[1][0], &M[0][1]));
  if (std::string(s.type) == MATSBAIJ) PetscCall(MatSetOption(M[0][0], MAT_SYMMETRIC, PETSC_TRUE));
  if (std::string(s.type) != MATAIJ) PetscCall(MatConvert(M[0][0], s.type, MAT_INPLACE_MATRIX, &M[0][0]));
  PetscCall(NestCreate(M[0][0], M[0][1], M[1][0], M[1][1], s.first, &nest));
  for (auto &row : M)
    for (Mat &stored : row) PetscCall(MatDestroy(&stored));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(SaddleSolveNest(nest, &ksp, rhs, local, s.first, a));
  PetscCall(MatDestroy(&nest));
  PetscFunctionReturn(PETSC_SUCCESS);
}
