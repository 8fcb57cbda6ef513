/* The program's matrices, in the storage and the numbering that the attack has chosen */
#include "attack.h"

Attack::Attack(PetscInt64 seed, const RandomSystem &system) : r(seed), layout(seed + 77), s(system)
{
  order   = (Order)r.Int(0, ORDERS - 1);
  storage = r.Chance(0.6) ? STORE_AIJ : (Storage)r.Int(0, STORAGES - 1);
  split   = r.Chance(0.2);
  /* with one of C and C' absent no outer Krylov method has an operator */
  if (s.form > 1 && r.Chance(0.7)) s.form = r.Int(0, 1);
}

static PetscErrorCode AllLengths(PetscInt mine, std::vector<PetscInt> &all)
{
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  all.resize(size);
  PetscCallMPI(MPI_Allgather(&mine, 1, MPIU_INT, all.data(), 1, MPIU_INT, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Lengths of both fields; sameTotal: each rank keeps what it has of both together, as KSPSetOperators() demands without
   KSPReset()
*/
static PetscErrorCode Distribute(Attack &a, bool sameTotal)
{
  const PetscInt n = (PetscInt)a.s.A.rows();

  PetscFunctionBeginUser;
  if (!sameTotal) {
    PetscCall(AllLengths(RandomShare(PETSC_COMM_WORLD, a.layout, (int)n, a.s.bs), a.rows[0]));
    PetscCall(AllLengths(RandomShare(PETSC_COMM_WORLD, a.layout, (int)a.s.C.rows(), 1), a.rows[1]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscInt had = 0, left = n;

  for (PetscInt k : a.rows[0]) had += k;
  if (had == n) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t k = 0; k < a.rows[0].size(); k++) {
    const PetscInt total = a.rows[0][k] + a.rows[1][k], mine = PetscMin(total, left);

    a.rows[0][k] = mine;
    a.rows[1][k] = total - mine;
    left -= mine;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Rank(PetscMPIInt *rank)
{
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, rank));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* a.A is what values are written to, the block what the program passes */
static PetscErrorCode BuildStiffness(Attack &a, PetscInt n, Mat *block)
{
  Mat aij, shell;

  PetscFunctionBeginUser;
  if (a.storage == STORE_SBAIJ && !a.s.symmetric) a.storage = STORE_BAIJ;
  PetscCall(RandomFill(PETSC_COMM_WORLD, a.s.A, n, n, a.s.bs, a.s.storeZero && a.storage != STORE_SBAIJ, &aij));
  switch (a.storage) {
  case STORE_BAIJ:
    PetscCall(MatConvert(aij, MATBAIJ, MAT_INITIAL_MATRIX, &a.A));
    break;
  case STORE_SBAIJ:
    PetscCall(MatSetOption(aij, MAT_SYMMETRIC, PETSC_TRUE));
    PetscCall(MatConvert(aij, MATSBAIJ, MAT_INITIAL_MATRIX, &a.A));
    break;
  case STORE_DENSE:
    PetscCall(MatConvert(aij, MATDENSE, MAT_INITIAL_MATRIX, &a.A));
    break;
  default:
    PetscCall(PetscObjectReference((PetscObject)aij));
    a.A = aij;
  }
  PetscCall(MatDestroy(&aij));
  if (a.storage == STORE_SHELL) {
    PetscCall(ShellCreate(a.A, true, true, &shell));
    PetscCall(MatSetBlockSize(shell, a.s.bs));
    *block = shell;
  } else if (a.storage == STORE_NEST) PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 1, NULL, &a.A, block));
  else {
    PetscCall(PetscObjectReference((PetscObject)a.A));
    *block = a.A;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of C that one of two blocks of rows holds: of each rank the first half, or the rest */
static std::vector<PetscInt> Half(const Attack &a, int which, PetscMPIInt rank, PetscInt *local)
{
  std::vector<PetscInt> rows;
  PetscInt              start = 0;

  for (size_t k = 0; k < a.rows[1].size(); k++) {
    const PetscInt m = a.rows[1][k], first = which ? m / 2 : 0, last = which ? m : m / 2;

    for (PetscInt i = first; i < last; i++) rows.push_back(start + i);
    if ((PetscMPIInt)k == rank) *local = last - first;
    start += m;
  }
  return rows;
}

static Dense Rows(const Dense &C, const std::vector<PetscInt> &rows)
{
  Dense part((Eigen::Index)rows.size(), C.cols());

  for (size_t i = 0; i < rows.size(); i++) part.row((Eigen::Index)i) = C.row(rows[i]);
  return part;
}

static PetscErrorCode BuildConstraints(Attack &a, PetscInt n, PetscInt m, PetscMPIInt rank, Mat *block)
{
  PetscFunctionBeginUser;
  if (!a.split) {
    PetscCall(RandomFill(PETSC_COMM_WORLD, a.s.C, m, n, 1, a.s.storeZero, &a.C[0]));
    PetscCall(PetscObjectReference((PetscObject)a.C[0]));
    *block = a.C[0];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (int k = 0; k < 2; k++) {
    PetscInt                    local = 0;
    const std::vector<PetscInt> rows  = Half(a, k, rank, &local);

    PetscCall(RandomFill(PETSC_COMM_WORLD, Rows(a.s.C, rows), local, n, 1, a.s.storeZero, &a.C[k]));
  }
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 1, NULL, a.C, block));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Positions of the rows of x, then of lambda, in the numbering of the nest */
static PetscErrorCode Positions(const Attack &a, std::vector<PetscInt> &position)
{
  IS is[2], all;

  PetscFunctionBeginUser;
  position.clear();
  PetscCall(MatNestGetISs(a.nest, is, NULL));
  for (int field = 0; field < 2; field++) {
    const PetscInt *index;
    PetscInt        n;

    PetscCall(ISAllGather(is[a.s.first ? 1 - field : field], &all));
    PetscCall(ISGetSize(all, &n));
    PetscCall(ISGetIndices(all, &index));
    position.insert(position.end(), index, index + n);
    PetscCall(ISRestoreIndices(all, &index));
    PetscCall(ISDestroy(&all));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The present values into the AIJ; the blocks that the program's nest leaves out are those of C here, too */
static PetscErrorCode FillWhole(Attack &a)
{
  const Eigen::Index    n = a.s.A.rows(), m = a.s.C.rows();
  Dense                 K(n + m, n + m);
  std::vector<PetscInt> position;
  PetscInt              start, end;

  PetscFunctionBeginUser;
  K << a.s.A, a.s.Ct, a.s.C, a.s.D;
  PetscCall(Positions(a, position));
  PetscCall(MatSetOption(a.whole, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatZeroEntries(a.whole));
  PetscCall(MatGetOwnershipRange(a.whole, &start, &end));
  for (Eigen::Index i = 0; i < n + m; i++) {
    if (position[i] < start || position[i] >= end) continue;
    for (Eigen::Index j = 0; j < n + m; j++)
      if (K(i, j) != 0.0 || (i == j && (i < n || a.s.blockD)))
        PetscCall(MatSetValue(a.whole, position[i], position[j], K(i, j), INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(a.whole, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(a.whole, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackNest(Attack &a)
{
  const int             l = a.s.first ? 0 : 1;
  PetscMPIInt           rank;
  PetscInt              start = 0;
  std::vector<PetscInt> index[2];
  IS                    is[2];
  Mat                   blocks[2][2], nest;

  PetscFunctionBeginUser;
  PetscCall(Rank(&rank));
  for (PetscMPIInt k = 0; k < rank; k++) start += a.rows[0][k] + a.rows[1][k];
  const PetscInt n = a.rows[0][rank], m = a.rows[1][rank];

  for (PetscInt p = 0; p < n + m; p++) {
    const PetscInt have       = (PetscInt)index[l].size();
    const bool     multiplier = a.order == AFTER ? p >= n : a.order == BEFORE ? p < m : have < (p + 1) * m / (n + m);

    index[multiplier ? l : 1 - l].push_back(start + p);
  }
  for (int k = 0; k < 2; k++)
    PetscCall(ISCreateGeneral(PETSC_COMM_WORLD, (PetscInt)index[k].size(), index[k].data(), PETSC_COPY_VALUES, &is[k]));
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++) blocks[l ? i : 1 - i][l ? j : 1 - j] = a.block[i][j];
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, is, 2, is, &blocks[0][0], &nest));
  for (IS &field : is) PetscCall(ISDestroy(&field));
  PetscCall(MatDestroy(&a.nest));
  PetscCall(MatDestroy(&a.whole));
  a.nest = nest;
  if (a.shape == SHAPE_NEST) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(
    MatCreateAIJ(PETSC_COMM_WORLD, n + m, n + m, PETSC_DETERMINE, PETSC_DETERMINE, 10, NULL, 10, NULL, &a.whole));
  PetscCall(FillWhole(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackOperators(Attack &a)
{
  Mat op = a.whole ? a.whole : a.nest;
  PC  pc;
  IS  is[2];

  PetscFunctionBeginUser;
  PetscCall(KSPSetOperators(a.ksp, op, op));
  if (a.shape != SHAPE_NAMED) PetscFunctionReturn(PETSC_SUCCESS);
  a.named = true;
  PetscCall(KSPGetPC(a.ksp, &pc));
  PetscCall(MatNestGetISs(a.nest, is, NULL));
  for (int field = 0; field < 2; field++)
    PetscCall(PCFieldSplitSetIS(pc, field ? "lambda" : "x", is[a.s.first ? 1 - field : field]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackClear(Attack &a)
{
  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&a.A));
  for (Mat &M : a.C) PetscCall(MatDestroy(&M));
  for (auto &row : a.block)
    for (Mat &M : row) PetscCall(MatDestroy(&M));
  PetscCall(MatDestroy(&a.nest));
  PetscCall(MatDestroy(&a.whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackBuild(Attack &a, bool sameTotal)
{
  PetscMPIInt rank;
  Mat         C = NULL;

  PetscFunctionBeginUser;
  PetscCall(AttackClear(a));
  PetscCall(Distribute(a, sameTotal));
  PetscCall(Rank(&rank));
  const PetscInt n = a.rows[0][rank], m = a.rows[1][rank];

  PetscCall(BuildStiffness(a, n, &a.block[0][0]));
  if (a.s.form != 3) PetscCall(BuildConstraints(a, n, m, rank, &C));
  if (a.s.form == 0 || a.s.form == 3)
    PetscCall(RandomFill(PETSC_COMM_WORLD, a.s.Ct, n, m, 1, a.s.storeZero, &a.block[0][1]));
  else if (a.s.form == 1) PetscCall(MatCreateHermitianTranspose(C, &a.block[0][1]));
  if (a.s.blockD) PetscCall(RandomFill(PETSC_COMM_WORLD, a.s.D, m, m, 1, a.s.storeZero, &a.block[1][1]));
  a.block[1][0] = C;
  PetscCall(AttackNest(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The entries that are not zero; the program is told of none that it would have to preallocate */
static PetscErrorCode Write(Mat M, const Dense &values)
{
  PetscInt  start, end, bs;
  PetscBool upper;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)M, &upper, MATSEQSBAIJ, MATMPISBAIJ, ""));
  PetscCall(MatGetBlockSize(M, &bs));
  PetscCall(MatSetOption(M, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatZeroEntries(M));
  PetscCall(MatGetOwnershipRange(M, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = upper ? i - i % bs : 0; j < values.cols(); j++)
      if (values(i, j) != 0.0 || (i == j && values.rows() == values.cols()))
        PetscCall(MatSetValue(M, i, j, values(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackWrite(Attack &a, bool stiffness, bool rows)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCall(Rank(&rank));
  if (stiffness) {
    PetscCall(Write(a.A, a.s.A));
    if (a.storage == STORE_SHELL) { /* nobody else could know */
      PetscCall(MatAssemblyBegin(a.block[0][0], MAT_FINAL_ASSEMBLY));
      PetscCall(MatAssemblyEnd(a.block[0][0], MAT_FINAL_ASSEMBLY));
    }
  }
  if (a.whole) PetscCall(FillWhole(a));
  if (!rows) PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 2; k++) {
    PetscInt local;

    if (a.C[k]) PetscCall(Write(a.C[k], a.split ? Rows(a.s.C, Half(a, k, rank, &local)) : a.s.C));
  }
  if (a.s.form == 0 || a.s.form == 3) PetscCall(Write(a.block[0][1], a.s.Ct));
  if (a.block[1][1]) PetscCall(Write(a.block[1][1], a.s.D));
  PetscFunctionReturn(PETSC_SUCCESS);
}
