/* A saddle-point system from files */
#include "system.h"

struct FileNames {
  char A[PETSC_MAX_PATH_LEN], B[PETSC_MAX_PATH_LEN], C[PETSC_MAX_PATH_LEN], D[PETSC_MAX_PATH_LEN],
    f[PETSC_MAX_PATH_LEN], g[PETSC_MAX_PATH_LEN], X[PETSC_MAX_PATH_LEN];
  PetscBool hasB, hasD, hasG, hasX, alone;
  PetscInt  blockSize; /* 0: not given */
};

static PetscErrorCode FileNamesGet(MPI_Comm comm, FileNames *names, PetscBool *given)
{
  PetscBool A, C, f, blockSize;

  PetscFunctionBeginUser;
  names->blockSize = 0;
  names->alone     = PETSC_FALSE;
  PetscOptionsBegin(comm, NULL, "Saddle-point system from files (PETSc's binary files)", NULL);
  PetscCall(PetscOptionsString("-A", "File of A, n x n", NULL, "", names->A, sizeof(names->A), &A));
  PetscCall(PetscOptionsString("-C", "File of the constraints C, m x n", NULL, "", names->C, sizeof(names->C), &C));
  PetscCall(PetscOptionsString("-B", "File of B, m x n, where the upper right block is not C' but B'", NULL, "",
                               names->B, sizeof(names->B), &names->hasB));
  PetscCall(PetscOptionsString("-D", "File of D, m x m, where the lower right block is -D (default: zero)", NULL, "",
                               names->D, sizeof(names->D), &names->hasD));
  PetscCall(
    PetscOptionsString("-f", "File of the right-hand side f, of length n", NULL, "", names->f, sizeof(names->f), &f));
  PetscCall(PetscOptionsString("-g", "File of the right-hand side g, of length m (default: zero)", NULL, "", names->g,
                               sizeof(names->g), &names->hasG));
  PetscCall(
    PetscOptionsString("-X", "File of the coordinates of the nodes, from which the rigid-body modes are attached to A",
                       NULL, "", names->X, sizeof(names->X), &names->hasX));
  PetscCall(PetscOptionsBool("-alone", "There are no constraints: -B, -C, -D and -g are not read", NULL, names->alone,
                             &names->alone, NULL));
  PetscCall(PetscOptionsInt("-block_size", "Unknowns per node of A (default: as the file's .info says, else 1)", NULL,
                            names->blockSize, &names->blockSize, &blockSize));
  PetscOptionsEnd();
  *given = A || C || f ? PETSC_TRUE : PETSC_FALSE;
  if (!*given) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(A && (C || names->alone) && f, comm, PETSC_ERR_USER_INPUT,
             "Option %s is missing: give the files of the system by -A, -C, -f and, unless they are zero, -g and -D",
             !A                    ? "-A"
             : !C && !names->alone ? "-C"
                                   : "-f");
  PetscCheck(!blockSize || names->blockSize >= 1, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option -block_size is %" PetscInt_FMT ", it must be at least 1", names->blockSize);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LoadA(MPI_Comm comm, const FileNames &names, Mat *A)
{
  FileInfo info;

  PetscFunctionBeginUser;
  PetscCall(FileGetInfo(comm, names.A, PETSC_FALSE, &info));
  PetscCheck(info.rows == info.columns, comm, PETSC_ERR_ARG_SIZ,
             "A in file %s is %" PetscInt_FMT " x %" PetscInt_FMT ", it must be square", names.A, info.rows,
             info.columns);
  PetscCheck(!names.blockSize || info.rows % names.blockSize == 0, comm, PETSC_ERR_ARG_SIZ,
             "A in file %s has %" PetscInt_FMT " rows, which is no multiple of -block_size %" PetscInt_FMT, names.A,
             info.rows, names.blockSize);
  PetscCall(MatCreate(comm, A));
  PetscCall(MatSetSizes(*A, PETSC_DECIDE, PETSC_DECIDE, info.rows, info.rows));
  PetscCall(MatSetBlockSize(*A, names.blockSize ? names.blockSize : info.blockSize));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(FileLoadMat(names.A, *A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B or C, with the columns spread as the rows of A */
static PetscErrorCode LoadRows(Mat A, const FileNames &names, const char name[], const char file[], Mat *C)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)A);
  PetscInt n, N, bs;
  FileInfo info;

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetBlockSize(A, &bs));
  PetscCall(FileGetInfo(comm, file, PETSC_FALSE, &info));
  PetscCheck(info.columns == N, comm, PETSC_ERR_ARG_SIZ,
             "%s in file %s has %" PetscInt_FMT " columns, A in file %s has %" PetscInt_FMT " rows: they must agree",
             name, file, info.columns, names.A, N);
  PetscCall(MatCreate(comm, C));
  PetscCall(MatSetSizes(*C, PETSC_DECIDE, n, info.rows, N));
  PetscCall(MatSetBlockSizes(*C, 1, bs));
  PetscCall(MatSetType(*C, MATAIJ));
  PetscCall(FileLoadMat(file, *C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Spread as the rows of C */
static PetscErrorCode LoadD(Mat C, const FileNames &names, Mat *D)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)C);
  PetscInt m, M;
  FileInfo info;

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(C, &M, NULL));
  PetscCall(MatGetLocalSize(C, &m, NULL));
  PetscCall(FileGetInfo(comm, names.D, PETSC_FALSE, &info));
  PetscCheck(info.rows == M && info.columns == M, comm, PETSC_ERR_ARG_SIZ,
             "D in file %s is %" PetscInt_FMT " x %" PetscInt_FMT ", C in file %s has %" PetscInt_FMT
             " rows: D must be square with as many",
             names.D, info.rows, info.columns, names.C, M);
  PetscCall(MatCreate(comm, D));
  PetscCall(MatSetSizes(*D, m, m, M, M));
  PetscCall(MatSetType(*D, MATAIJ));
  PetscCall(FileLoadMat(names.D, *D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without rows */
static PetscErrorCode CreateNone(Mat A, Mat *C)
{
  PetscInt n, bs;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetBlockSize(A, &bs));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), C));
  PetscCall(MatSetSizes(*C, 0, n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSizes(*C, 1, bs));
  PetscCall(MatSetType(*C, MATAIJ));
  PetscCall(MatSetUp(*C));
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As many coordinates as A has unknowns: two or three a node */
static PetscErrorCode AttachModes(Mat A, const char file[])
{
  MatNullSpace modes;
  PetscInt     rows, bs;
  FileInfo     info;
  Vec          X;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, NULL, &X));
  PetscCall(MatGetSize(A, &rows, NULL));
  PetscCall(MatGetBlockSize(A, &bs));
  PetscCall(FileGetInfo(PetscObjectComm((PetscObject)A), file, PETSC_TRUE, &info));
  PetscCheck(info.rows == rows, PetscObjectComm((PetscObject)A), PETSC_ERR_ARG_SIZ,
             "X in file %s has %" PetscInt_FMT " entries, A has %" PetscInt_FMT " rows: they must agree", file,
             info.rows, rows);
  PetscCall(VecSetBlockSize(X, bs));
  PetscCall(FileLoadVec(file, X));
  PetscCall(MatNullSpaceCreateRigidBody(X, &modes));
  PetscCall(MatSetNearNullSpace(A, modes));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(VecDestroy(&X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Spread as the rows of M; zero without a file */
static PetscErrorCode LoadRhs(Mat M, const char matrix[], const char matrixFile[], const char name[], const char file[],
                              Vec *v)
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
             "%s in file %s has %" PetscInt_FMT " entries, %s in file %s has %" PetscInt_FMT " rows: they must agree",
             name, file, info.rows, matrix, matrixFile, rows);
  PetscCall(FileLoadVec(file, *v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SystemLoad(MPI_Comm comm, PetscBool *given, SaddleBlocks *s, Vec *f, Vec *g)
{
  FileNames names;
  PetscInt  rows, rowsB;

  PetscFunctionBeginUser;
  *s = SaddleBlocks();
  PetscCall(FileNamesGet(comm, &names, given));
  if (!*given) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LoadA(comm, names, &s->A));
  if (names.hasX) PetscCall(AttachModes(s->A, names.X));
  if (names.alone) PetscCall(CreateNone(s->A, &s->C));
  else PetscCall(LoadRows(s->A, names, "C", names.C, &s->C));
  if (names.hasB && !names.alone) {
    PetscCall(LoadRows(s->A, names, "B", names.B, &s->B));
    PetscCall(MatGetSize(s->B, &rowsB, NULL));
    PetscCall(MatGetSize(s->C, &rows, NULL));
    PetscCheck(rows == rowsB, comm, PETSC_ERR_ARG_SIZ,
               "B in file %s has %" PetscInt_FMT " rows, C in file %s has %" PetscInt_FMT ": they must agree", names.B,
               rowsB, names.C, rows);
  }
  if (names.hasD && !names.alone) PetscCall(LoadD(s->C, names, &s->D));
  PetscCall(LoadRhs(s->A, "A", names.A, "f", names.f, f));
  PetscCall(LoadRhs(s->C, "C", names.C, "g", names.hasG && !names.alone ? names.g : NULL, g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SystemDestroy(SaddleBlocks *s)
{
  PetscFunctionBeginUser;
  for (Mat *M : {&s->A, &s->B, &s->C, &s->D}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}
