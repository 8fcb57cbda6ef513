#include "dense.h"
#include <cmath>
#include <cstdint>
#include <sstream>

PetscReal Uniform(PetscInt seed, PetscInt i, PetscInt j)
{
  uint64_t z = (uint64_t)seed * 0x9e3779b97f4a7c15u + (uint64_t)i * 0xd1b54a32d192ed03u +
               (uint64_t)j * 0x8cb92ba72f3d8dd7u;
  for (int round = 0; round < 2; round++) { /* splitmix64 */
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
  }
  return (PetscReal)(z >> 11) / (PetscReal)(1ull << 52) - 1.0;
}

/* a factor of modulus 1: in complex arithmetic A and C are truly complex */
static PetscScalar Phase(PetscInt seed, PetscInt i, PetscInt j)
{
#if defined(PETSC_USE_COMPLEX)
  return std::polar(1.0, PETSC_PI * Uniform(seed, i, j));
#else
  (void)seed, (void)i, (void)j;
  return 1.0;
#endif
}

PetscErrorCode SetRandom(Vec v, PetscInt seed)
{
  PetscInt     start, end;
  PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecGetOwnershipRange(v, &start, &end));
  PetscCall(VecGetArrayWrite(v, &a));
  for (PetscInt i = start; i < end; i++) a[i - start] = Uniform(seed, i, 0) * Phase(seed, i, 1);
  PetscCall(VecRestoreArrayWrite(v, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Local length; constraints: of a vector of multipliers */
static PetscErrorCode Share(MPI_Comm comm, const Spec &spec, bool constraints, PetscInt *local)
{
  PetscInt    total = constraints ? spec.m : spec.n, bs = constraints ? 1 : spec.bs, blocks = total / bs;
  PetscMPIInt rank, size, ranks, place;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  ranks = size;
  place = rank;
  if (spec.uneven && size > 1) {
    if (constraints) {
      *local = rank == size - 1 ? total : 0;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    ranks = size - 1;
    place = rank > 1 ? rank - 1 : rank;
    if (rank == 1) {
      *local = 0;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  *local = bs * (blocks / ranks + (place < blocks % ranks));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FillA(const Spec &s, Mat A)
{
  const PetscInt half = s.n / 2;
  PetscInt       start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(A, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    const bool      upper = i >= half;
    const PetscReal E     = upper ? s.jump : 1.0;
    PetscScalar     diagonal;

    diagonal = upper && s.semidefinite ? 0.0 : 0.2 * E * (1.0 + 0.5 * Uniform(s.seed, i, i));
    for (PetscInt d : {-3, -1, 1, 3}) {
      const PetscInt j = i + d;
      if (j < 0 || j >= s.n || (j >= half) != upper) continue;
      const PetscReal w     = E * (1.0 + 0.5 * Uniform(s.seed, PetscMin(i, j), PetscMax(i, j)));
      PetscScalar     value = -w * Phase(s.seed, i, -7) * PetscConj(Phase(s.seed, j, -7));
      if (!s.symmetric && PetscAbsInt(d) == 1) value += 0.4 * d * w;
      PetscCall(MatSetValue(A, i, j, value, INSERT_VALUES));
      diagonal += w;
    }
    PetscCall(MatSetValue(A, i, i, diagonal, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FillC(const Spec &s, Mat C)
{
  const PetscInt half = s.n / 2, step = s.m ? PetscMax(1, half / s.m) : 1;
  PetscInt       start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    const PetscReal scale   = PetscPowReal(10.0, s.rowscale * Uniform(s.seed + 100, i, 0));
    const PetscInt  own     = half + (i * step) % half,
                   column[] = {own, (i * step) % half, (i * step + 1) % half, half + (own - half + step) % half};
    const PetscReal size[]  = {1.0, -0.7, -0.4, 0.3};

    if (s.zeroRows && i % 3 == 1) {
      if (i % 2) PetscCall(MatSetValue(C, i, own, 0.0, INSERT_VALUES));
      continue;
    }
    for (int k = 0; k < 4; k++)
      PetscCall(
        MatSetValue(C, i, column[k],
                    scale * size[k] * (1.0 + 0.3 * Uniform(s.seed + 1, i, column[k])) * Phase(s.seed + 2, i, column[k]),
                    INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SystemCreate(MPI_Comm comm, const Spec &spec, System *sys)
{
  PetscInt     n, m, start;
  PetscScalar *w;

  PetscFunctionBeginUser;
  PetscCall(Share(comm, spec, false, &n));
  PetscCall(Share(comm, spec, true, &m));
  PetscCall(MatCreate(comm, &sys->A));
  PetscCall(MatSetSizes(sys->A, n, n, spec.n, spec.n));
  PetscCall(MatSetBlockSize(sys->A, spec.bs));
  PetscCall(MatSetType(sys->A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(sys->A, 5, NULL));
  PetscCall(MatMPIAIJSetPreallocation(sys->A, 5, NULL, 5, NULL));
  PetscCall(FillA(spec, sys->A));
  PetscCall(MatCreate(comm, &sys->C));
  PetscCall(MatSetSizes(sys->C, m, n, spec.m, spec.n));
  PetscCall(MatSetType(sys->C, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(sys->C, 4, NULL));
  PetscCall(MatMPIAIJSetPreallocation(sys->C, 4, NULL, 4, NULL));
  PetscCall(FillC(spec, sys->C));
  PetscCall(MatCreateVecs(sys->C, &sys->f, &sys->g));
  PetscCall(SetRandom(sys->f, spec.seed + 10));
  PetscCall(SetRandom(sys->g, spec.seed + 11));
  PetscCall(VecDuplicate(sys->f, &sys->w));
  PetscCall(VecGetOwnershipRange(sys->w, &start, NULL));
  PetscCall(VecGetArrayWrite(sys->w, &w));
  for (PetscInt i = 0; i < n; i++) w[i] = PetscPowReal(10.0, Uniform(spec.seed + 12, start + i, 0));
  PetscCall(VecRestoreArrayWrite(sys->w, &w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SystemDestroy(System *sys)
{
  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&sys->A));
  PetscCall(MatDestroy(&sys->C));
  PetscCall(VecDestroy(&sys->f));
  PetscCall(VecDestroy(&sys->g));
  PetscCall(VecDestroy(&sys->w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

std::vector<Spec> UsualSpecs()
{
  std::vector<Spec> specs(6);

  specs[1].name         = "floating, stiff, uneven";
  specs[1].semidefinite = specs[1].uneven = true;
  specs[1].jump                           = 1e6;
  specs[1].seed                           = 2;
  specs[2].name                           = "not symmetric";
  specs[2].symmetric                      = false;
  specs[2].seed                           = 3;
  specs[3].name                           = "rows scaled, soft";
  specs[3].rowscale                       = 3.0;
  specs[3].jump                           = 1e-6;
  specs[3].m                              = 9;
  specs[4].name                           = "one constraint";
  specs[4].m                              = 1;
  specs[4].uneven                         = true;
  specs[5].name                           = "blocks of 3";
  specs[5].bs                             = 3;
  specs[5].m                              = 12;
  return specs;
}

static PetscErrorCode ShellMult(Mat shell, Vec x, Vec y)
{
  Mat M;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(shell, &M));
  PetscCall(MatMult(M, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ShellMultTranspose(Mat shell, Vec x, Vec y)
{
  Mat M;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(shell, &M));
  PetscCall(MatMultTranspose(M, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ShellDiagonal(Mat shell, Vec d)
{
  Mat M;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(shell, &M));
  PetscCall(MatGetDiagonal(M, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ShellCreate(Mat M, bool diagonal, bool transpose, Mat *shell)
{
  PetscInt m, n;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(M, &m, &n));
  PetscCall(MatCreateShell(PETSC_COMM_WORLD, m, n, PETSC_DETERMINE, PETSC_DETERMINE, M, shell));
  PetscCall(MatShellSetOperation(*shell, MATOP_MULT, (void (*)(void))ShellMult));
  if (transpose) PetscCall(MatShellSetOperation(*shell, MATOP_MULT_TRANSPOSE, (void (*)(void))ShellMultTranspose));
  if (diagonal) PetscCall(MatShellSetOperation(*shell, MATOP_GET_DIAGONAL, (void (*)(void))ShellDiagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode NestCreate(Mat A, Mat Ct, Mat C, Mat D, bool first, Mat *nest)
{
  MPI_Comm  comm      = PetscObjectComm((PetscObject)A);
  Mat       blocks[4] = {A, Ct, C, D}, reversed[4] = {D, C, Ct, A};
  const int multiplier = first ? 0 : 1;
  PetscInt  local[2], start, sum;
  IS        is[2];

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(A, &local[1 - multiplier], NULL));
  if (C) PetscCall(MatGetLocalSize(C, &local[multiplier], NULL));
  else PetscCall(MatGetLocalSize(Ct ? Ct : D, NULL, &local[multiplier]));
  /* PETSc's own numbering of the fields, told explicitly: where a row or a column has no block it cannot be found */
  sum = local[0] + local[1];
  PetscCallMPI(MPI_Scan(&sum, &start, 1, MPIU_INT, MPI_SUM, comm));
  start -= sum;
  PetscCall(ISCreateStride(comm, local[0], start, 1, &is[0]));
  PetscCall(ISCreateStride(comm, local[1], start + local[0], 1, &is[1]));
  PetscCall(MatCreateNest(comm, 2, is, 2, is, first ? reversed : blocks, nest));
  PetscCall(ISDestroy(&is[0]));
  PetscCall(ISDestroy(&is[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SolverCreate(Mat mat, KSP *ksp)
{
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)mat), ksp));
  PetscCall(KSPSetOperators(*ksp, mat, mat));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

Options::Options(const std::string &line)
{
  std::istringstream words(line);
  std::string        word;

  while (words >> word)
    if (word[0] == '-' && (word.size() < 2 || !isdigit(word[1]))) names.push_back(word);
  PetscCallAbort(PETSC_COMM_WORLD, PetscOptionsInsertString(NULL, line.c_str()));
}

Options::~Options()
{
  PetscMPIInt rank;

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  for (const std::string &name : names) {
    PetscBool used;
    PetscCallAbort(PETSC_COMM_WORLD, PetscOptionsUsed(NULL, name.c_str() + 1, &used));
    if (!used && !rank) unusedOptions += name + " "; /* some are for a few ranks, rank 0 among them */
    PetscCallAbort(PETSC_COMM_WORLD, PetscOptionsClearValue(NULL, name.c_str()));
  }
}
