/* Matrices and vectors in PETSc's binary files, whose kind is known before they are read */
#include "files.h"
#include <petscviewer.h>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

enum Content {
  CONTENT_NO_FILE,
  CONTENT_UNKNOWN,
  CONTENT_MARKET,
  CONTENT_MAT,
  CONTENT_VEC,
  CONTENT_OTHER_INTEGERS
};

static std::int64_t BigEndian(const unsigned char *bytes, size_t size)
{
  std::uint64_t value = 0;

  for (size_t i = 0; i < size; i++) value = value << 8 | bytes[i];
  return (std::int64_t)value;
}

/*
   Of one rank; PETSc's binary files begin with a class number, in integers of the size that the writer was configured
   with
*/
static Content Probe(const char file[])
{
  unsigned char bytes[16] = {};
  FILE         *in        = std::fopen(file, "rb");
  size_t        size;
  Content       content = CONTENT_UNKNOWN;

  if (!in) return CONTENT_NO_FILE;
  size = std::fread(bytes, 1, sizeof(bytes), in);
  std::fclose(in);
  if (size >= 14 && !std::memcmp(bytes, "%%MatrixMarket", 14)) return CONTENT_MARKET;
  for (size_t width : {(size_t)4, (size_t)8}) {
    const std::int64_t number = size < 2 * width ? 0 : BigEndian(bytes, width);

    if (number != MAT_FILE_CLASSID && number != VEC_FILE_CLASSID) continue;
    if (width != sizeof(PetscInt)) content = CONTENT_OTHER_INTEGERS;
    else content = number == MAT_FILE_CLASSID ? CONTENT_MAT : CONTENT_VEC;
  }
  return content;
}

/* Of one rank. PETSc would read the .info file itself, but as options, which then hold for the next matrix too */
static PetscInt ProbeBlockSize(const char file[])
{
  std::ifstream in(std::string(file) + ".info");
  PetscInt      size = 1;

  for (std::string word; in >> word;) {
    if (word == "-matload_block_size" && !(in >> size)) size = 1;
  }
  return PetscMax(size, 1);
}

static PetscErrorCode OpenBinary(MPI_Comm comm, const char file[], PetscFileMode mode, PetscViewer *viewer)
{
  PetscFunctionBeginUser;
  PetscCall(PetscViewerCreate(comm, viewer));
  PetscCall(PetscViewerSetType(*viewer, PETSCVIEWERBINARY));
  if (mode == FILE_MODE_READ) PetscCall(PetscViewerBinarySetSkipInfo(*viewer, PETSC_TRUE));
  PetscCall(PetscViewerFileSetMode(*viewer, mode));
  PetscCall(PetscViewerFileSetName(*viewer, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode BinaryGetInfo(MPI_Comm comm, const char file[], PetscBool vector, FileInfo *info)
{
  PetscInt    header[3] = {0, 0, 1};
  PetscMPIInt rank;
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(OpenBinary(comm, file, FILE_MODE_READ, &viewer));
  PetscCall(PetscViewerBinaryRead(viewer, header, vector ? 2 : 3, NULL, PETSC_INT));
  PetscCall(PetscViewerDestroy(&viewer));
  info->rows    = header[1];
  info->columns = header[2];
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) info->blockSize = ProbeBlockSize(file);
  PetscCallMPI(MPI_Bcast(&info->blockSize, 1, MPIU_INT, 0, comm));
  if (info->rows % info->blockSize) info->blockSize = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileGetInfo(MPI_Comm comm, const char file[], PetscBool vector, FileInfo *info)
{
  PetscMPIInt rank;
  int         content = CONTENT_UNKNOWN;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) content = Probe(file);
  PetscCallMPI(MPI_Bcast(&content, 1, MPI_INT, 0, comm));
  PetscCheck(content != CONTENT_NO_FILE, comm, PETSC_ERR_FILE_OPEN, "File %s does not exist or cannot be read", file);
  PetscCheck(content != CONTENT_MARKET, comm, PETSC_ERR_FILE_UNEXPECTED,
             "File %s is a Matrix Market file: tests/bench/market.py writes it for PETSc", file);
  PetscCheck(content != CONTENT_UNKNOWN, comm, PETSC_ERR_FILE_UNEXPECTED, "File %s is not in PETSc's binary format",
             file);
  PetscCheck(content != CONTENT_OTHER_INTEGERS, comm, PETSC_ERR_FILE_UNEXPECTED,
             "File %s was written with %s-bit integers, this PETSc has %d-bit ones", file,
             sizeof(PetscInt) == 4 ? "64" : "32", (int)(8 * sizeof(PetscInt)));
  PetscCheck(content == (vector ? CONTENT_VEC : CONTENT_MAT), comm, PETSC_ERR_FILE_UNEXPECTED,
             "File %s holds a %s, a %s is wanted", file, vector ? "matrix" : "vector", vector ? "vector" : "matrix");
  PetscCall(BinaryGetInfo(comm, file, vector, info));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileLoadMat(const char file[], Mat M)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(OpenBinary(PetscObjectComm((PetscObject)M), file, FILE_MODE_READ, &viewer));
  PetscCall(MatLoad(M, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileLoadVec(const char file[], Vec v)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(OpenBinary(PetscObjectComm((PetscObject)v), file, FILE_MODE_READ, &viewer));
  PetscCall(VecLoad(v, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileSaveVec(const char file[], Vec v)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(OpenBinary(PetscObjectComm((PetscObject)v), file, FILE_MODE_WRITE, &viewer));
  PetscCall(VecView(v, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
