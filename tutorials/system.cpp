/* A saddle-point system from files */
#include "system.h"

struct FileNames {
  char      A[PETSC_MAX_PATH_LEN], C[PETSC_MAX_PATH_LEN], f[PETSC_MAX_PATH_LEN], g[PETSC_MAX_PATH_LEN];
  PetscBool hasG;
  PetscInt  blockSize; /* 0: not given */
};

static PetscErrorCode FileNamesGet(MPI_Comm comm, FileNames *names, PetscBool *given)
{
  PetscBool A, C, f, blockSize;

  PetscFunctionBeginUser;
  names->blockSize = 0;
  PetscOptionsBegin(comm, NULL, "Saddle-point system from files (PETSc binary or Matrix Market, seen from each file)", NULL);
  PetscCall(PetscOptionsString("-A", "File of A, n x n", NULL, "", names->A, sizeof(names->A), &A));
  PetscCall(PetscOptionsString("-C", "File of the constraints C, m x n", NULL, "", names->C, sizeof(names->C), &C));
  PetscCall(PetscOptionsString("-f", "File of the right-hand side f, of length n", NULL, "", names->f, sizeof(names->f), &f));
  PetscCall(PetscOptionsString("-g", "File of the right-hand side g, of length m (default: zero)", NULL, "", names->g, sizeof(names->g), &names->hasG));
  PetscCall(PetscOptionsInt("-block_size", "Unknowns per node of A (default: as the file's .info says, else 1)", NULL, names->blockSize, &names->blockSize,
                            &blockSize));
  PetscOptionsEnd();
  *given = A || C || f ? PETSC_TRUE : PETSC_FALSE;
  if (!*given) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(A && C && f, comm, PETSC_ERR_USER_INPUT, "Option %s is missing: give the files of the system by -A, -C, -f and, unless it is zero, -g",
             !A   ? "-A"
             : !C ? "-C"
                  : "-f");
  PetscCheck(!blockSize || names->blockSize >= 1, comm, PETSC_ERR_ARG_OUTOFRANGE, "Option -block_size is %" PetscInt_FMT ", it must be at least 1",
             names->blockSize);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadA(MPI_Comm comm, const FileNames &names, Mat *A)
{
  FileInfo info;

  PetscFunctionBeginUser;
  PetscCall(FileGetInfo(comm, names.A, PETSC_FALSE, &info));
  PetscCheck(info.rows == info.columns, comm, PETSC_ERR_ARG_SIZ, "A in file %s is %" PetscInt_FMT " x %" PetscInt_FMT ", it must be square", names.A, info.rows,
             info.columns);
  PetscCheck(!names.blockSize || info.rows % names.blockSize == 0, comm, PETSC_ERR_ARG_SIZ,
             "A in file %s has %" PetscInt_FMT " rows, which is no multiple of -block_size %" PetscInt_FMT, names.A, info.rows, names.blockSize);
  PetscCall(MatCreate(comm, A));
  PetscCall(MatSetSizes(*A, PETSC_DECIDE, PETSC_DECIDE, info.rows, info.rows));
  PetscCall(MatSetBlockSize(*A, names.blockSize ? names.blockSize : info.blockSize));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(FileLoadMat(names.A, info, *A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With the columns spread as the rows of A */
static PetscErrorCode LoadC(Mat A, const FileNames &names, Mat *C)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)A);
  PetscInt n, N, bs;
  FileInfo info;

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetBlockSize(A, &bs));
  PetscCall(FileGetInfo(comm, names.C, PETSC_FALSE, &info));
  PetscCheck(info.columns == N, comm, PETSC_ERR_ARG_SIZ, "C in file %s has %" PetscInt_FMT " columns, A in file %s has %" PetscInt_FMT " rows: they must agree",
             names.C, info.columns, names.A, N);
  PetscCall(MatCreate(comm, C));
  PetscCall(MatSetSizes(*C, PETSC_DECIDE, n, info.rows, N));
  PetscCall(MatSetBlockSizes(*C, 1, bs));
  PetscCall(MatSetType(*C, MATAIJ));
  PetscCall(FileLoadMat(names.C, info, *C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Spread as the rows of M; zero without a file */
static PetscErrorCode LoadRhs(Mat M, const char matrix[], const char matrixFile[], const char name[], const char file[], Vec *v)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)M);
  PetscInt rows;
  FileInfo info;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(M, NULL, v));
  PetscCall(VecSet(*v, 0.0));
  if (!file) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetSize(M, &rows, NULL));
  PetscCall(FileGetInfo(comm, file, PETSC_TRUE, &info));
  PetscCheck(info.rows == rows, comm, PETSC_ERR_ARG_SIZ,
             "%s in file %s has %" PetscInt_FMT " entries, %s in file %s has %" PetscInt_FMT " rows: they must agree", name, file, info.rows, matrix,
             matrixFile, rows);
  PetscCall(FileLoadVec(file, info, *v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SystemLoad(MPI_Comm comm, PetscBool *given, Mat *A, Mat *C, Vec *f, Vec *g)
{
  FileNames names;

  PetscFunctionBeginUser;
  PetscCall(FileNamesGet(comm, &names, given));
  if (!*given) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LoadA(comm, names, A));
  PetscCall(LoadC(*A, names, C));
  PetscCall(LoadRhs(*A, "A", names.A, "f", names.f, f));
  PetscCall(LoadRhs(*C, "C", names.C, "g", names.hasG ? names.g : NULL, g));
  PetscFunctionReturn(PETSC_SUCCESS);
}
