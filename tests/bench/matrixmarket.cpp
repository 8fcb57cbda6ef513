/* Matrix Market files: rank 0 reads them line by line and PETSc brings the entries to their ranks */
#include "files.h"
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

struct Market {
  FILE       *in;
  const char *file;
  char        line[1024];
  long long   number; /* of the line, for messages */
  bool        array, complex, pattern;
  int         mirror; /* entry (j,i) follows from (i,j): 0 not at all, 1 equal, 2 negative, 3 conjugate */
  long long   rows, columns, entries;
};

/* The next line that is neither empty nor a comment */
static PetscErrorCode NextLine(Market &m)
{
  PetscFunctionBeginUser;
  while (true) {
    const char *c;

    PetscCheck(std::fgets(m.line, sizeof(m.line), m.in), PETSC_COMM_SELF, PETSC_ERR_FILE_READ, "File %s ends at line %lld, before all of its entries are read",
               m.file, m.number);
    m.number++;
    m.line[std::strcspn(m.line, "\r\n")] = 0;
    for (c = m.line; *c && std::isspace((unsigned char)*c);) c++;
    if (*c && *c != '%') break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Banner and size */
static PetscErrorCode MarketOpen(const char file[], Market &m)
{
  std::string banner, object, format, field, symmetry;
  int         found;

  PetscFunctionBeginUser;
  m.file   = file;
  m.number = 1;
  m.in     = std::fopen(file, "r");
  PetscCheck(m.in && std::fgets(m.line, sizeof(m.line), m.in), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "File %s cannot be read", file);
  m.line[std::strcspn(m.line, "\r\n")] = 0;
  banner                               = m.line;
  std::transform(banner.begin(), banner.end(), banner.begin(), [](unsigned char c) { return (char)std::tolower(c); });
  std::istringstream(banner) >> banner >> object >> format >> field >> symmetry;
  m.array   = format == "array";
  m.complex = field == "complex";
  m.pattern = field == "pattern";
  m.mirror  = symmetry == "symmetric" ? 1 : symmetry == "skew-symmetric" ? 2 : symmetry == "hermitian" ? 3 : 0;
  /* PETSc itself writes `vector` */
  PetscCheck((object == "matrix" || object == "vector") && (m.array || format == "coordinate") && (m.mirror || symmetry == "general"), PETSC_COMM_SELF,
             PETSC_ERR_FILE_UNEXPECTED, "File %s: cannot read what its first line announces: %s", file, m.line);
  PetscCheck(field == "real" || field == "double" || field == "integer" || m.complex || (m.pattern && !m.array), PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "File %s: its first line announces numbers of an unknown kind: %s", file, m.line);
  PetscCheck(!m.array || !m.mirror, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "File %s: the array format is read only if general: %s", file, m.line);
#if !defined(PETSC_USE_COMPLEX)
  PetscCheck(!m.complex, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "File %s holds complex numbers, this PETSc has real ones", file);
#endif
  PetscCall(NextLine(m));
  m.columns = m.entries = 1;
  found                 = std::sscanf(m.line, "%lld %lld %lld", &m.rows, &m.columns, &m.entries);
  PetscCheck(found == (m.array ? 2 : 3) || (found == 1 && object == "vector"), PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "File %s, line %lld: not the sizes: %s", file, m.number, m.line);
  PetscCheck(m.rows >= 0 && m.columns >= 0 && m.entries >= 0 && (PetscReal)m.rows <= (PetscReal)PETSC_MAX_INT &&
               (PetscReal)m.columns <= (PetscReal)PETSC_MAX_INT,
             PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "File %s: its sizes %lld x %lld do not fit the integers of this PETSc", file, m.rows, m.columns);
  if (m.array) m.entries = m.rows * m.columns;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadNumber(Market &m, const char **c, PetscScalar *value)
{
  double parts[2] = {0, 0};

  PetscFunctionBeginUser;
  for (int p = 0; p < (m.complex ? 2 : 1); p++) {
    char *end;

    parts[p] = std::strtod(*c, &end);
    PetscCheck(end != *c, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "File %s, line %lld: a number is missing: %s", m.file, m.number, m.line);
    *c = end;
  }
#if defined(PETSC_USE_COMPLEX)
  *value = PetscCMPLX(parts[0], parts[1]);
#else
  *value                  = parts[0];
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReadIndex(Market &m, const char **c, long long size, PetscInt *index)
{
  char     *end;
  long long value;

  PetscFunctionBeginUser;
  value = std::strtoll(*c, &end, 10);
  PetscCheck(end != *c && value >= 1 && value <= size, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "File %s, line %lld: not an index between 1 and %lld: %s",
             m.file, m.number, size, m.line);
  *index = (PetscInt)(value - 1);
  *c     = end;
  PetscFunctionReturn(PETSC_SUCCESS);
}

struct Entries {
  std::vector<PetscInt>    i, j;
  std::vector<PetscScalar> v;

  void Add(PetscInt row, PetscInt column, PetscScalar value)
  {
    i.push_back(row);
    j.push_back(column);
    v.push_back(value);
  }
};

static PetscErrorCode ReadEntries(const char file[], Entries &entries)
{
  Market m;

  PetscFunctionBeginUser;
  PetscCall(MarketOpen(file, m));
  for (long long e = 0; e < m.entries; e++) {
    const char *c     = m.line;
    PetscScalar value = 1;
    PetscInt    i = 0, j = 0;

    PetscCall(NextLine(m));
    if (m.array) {
      i = (PetscInt)(e % m.rows);
      j = (PetscInt)(e / m.rows);
    } else {
      PetscCall(ReadIndex(m, &c, m.rows, &i));
      PetscCall(ReadIndex(m, &c, m.columns, &j));
    }
    if (!m.pattern) PetscCall(ReadNumber(m, &c, &value));
    if (m.array && value == 0.0) continue;
    entries.Add(i, j, value);
    if (m.mirror && i != j) entries.Add(j, i, m.mirror == 1 ? value : m.mirror == 2 ? -value : PetscConj(value));
  }
  std::fclose(m.in);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MarketGetInfo(MPI_Comm comm, const char file[], FileInfo *info)
{
  PetscInt    sizes[2];
  PetscMPIInt rank;
  Market      m;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) {
    PetscCall(MarketOpen(file, m));
    std::fclose(m.in);
    sizes[0] = (PetscInt)m.rows;
    sizes[1] = (PetscInt)m.columns;
  }
  PetscCallMPI(MPI_Bcast(sizes, 2, MPIU_INT, 0, comm));
  info->format    = FILE_MATRIX_MARKET;
  info->rows      = sizes[0];
  info->columns   = sizes[1];
  info->blockSize = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MarketLoadMat(const char file[], Mat M)
{
  PetscMPIInt rank;
  Entries     entries;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)M), &rank));
  if (rank == 0) PetscCall(ReadEntries(file, entries));
  PetscCall(MatSetPreallocationCOO(M, (PetscCount)entries.i.size(), entries.i.data(), entries.j.data()));
  PetscCall(MatSetValuesCOO(M, entries.v.data(), INSERT_VALUES)); /* repeated entries add up */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MarketLoadVec(const char file[], Vec v)
{
  PetscMPIInt rank;
  Entries     entries;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)v), &rank));
  PetscCall(VecSet(v, 0.0));
  if (rank == 0) {
    PetscCall(ReadEntries(file, entries));
    PetscCall(VecSetValues(v, (PetscInt)entries.i.size(), entries.i.data(), entries.v.data(), ADD_VALUES));
  }
  PetscCall(VecAssemblyBegin(v));
  PetscCall(VecAssemblyEnd(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MarketSaveVec(const char file[], Vec v)
{
#if defined(PETSC_USE_COMPLEX)
  const char *const field = "complex";
#else
  const char *const field = "real";
#endif
  MPI_Comm           comm = PetscObjectComm((PetscObject)v);
  const PetscScalar *a;
  PetscInt           rows, local;
  VecScatter         gather;
  Vec                all;
  FILE              *out;

  PetscFunctionBeginUser;
  PetscCall(VecGetSize(v, &rows));
  PetscCall(VecScatterCreateToZero(v, &gather, &all));
  PetscCall(VecScatterBegin(gather, v, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(gather, v, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(PetscFOpen(comm, file, "w", &out));
  PetscCall(PetscFPrintf(comm, out, "%%%%MatrixMarket matrix array %s general\n%" PetscInt_FMT " 1\n", field, rows));
  PetscCall(VecGetLocalSize(all, &local));
  PetscCall(VecGetArrayRead(all, &a));
  for (PetscInt i = 0; i < local; i++) {
#if defined(PETSC_USE_COMPLEX)
    PetscCall(PetscFPrintf(PETSC_COMM_SELF, out, "%.17g %.17g\n", (double)PetscRealPart(a[i]), (double)PetscImaginaryPart(a[i])));
#else
    PetscCall(PetscFPrintf(PETSC_COMM_SELF, out, "%.17g\n", (double)a[i]));
#endif
  }
  PetscCall(VecRestoreArrayRead(all, &a));
  PetscCall(PetscFClose(comm, out));
  PetscCall(VecScatterDestroy(&gather));
  PetscCall(VecDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}
