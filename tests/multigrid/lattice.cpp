#include "lattice.h"

static PetscErrorCode LocalNodes(const Lattice &l, PetscInt *local)
{
  PetscMPIInt    rank, size;
  const PetscInt nodes = l.nodes();

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  if (size == 1 || l.layout == Lattice::EVEN) *local = nodes / size + (rank < nodes % size);
  else if (l.layout == Lattice::LAST) *local = rank == size - 1 ? nodes : 0;
  else {
    const PetscInt special = l.layout == Lattice::SMALL ? 1 : 0, others = nodes - special, place = rank - (rank > 1);

    *local = rank == 1 ? special : others / (size - 1) + (place < others % (size - 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LayoutName(const Lattice &l, const char **name)
{
  static const char *const names[] = {"even", "a rank without nodes", "a rank with one node", "all on one rank"};

  PetscFunctionBeginUser;
  *name = names[l.layout];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Places on the grid, the last direction being that of the layers */
static void Place(const Lattice &l, PetscInt node, PetscInt x[3])
{
  const PetscInt d = l.dim();

  x[2] = 0;
  for (PetscInt k = 0; k < d; k++) {
    x[k] = k < d - 1 ? node % l.n : node;
    node /= l.n;
  }
}

static PetscInt Number(const Lattice &l, const PetscInt x[3])
{
  return l.dim() == 2 ? x[0] + l.n * x[1] : x[0] + l.n * (x[1] + l.n * x[2]);
}

/* bs x bs, row by row */
static std::vector<PetscReal> Stiffness(const Lattice &l, PetscInt a, PetscInt b, const PetscInt *x, const PetscInt *y)
{
  const PetscInt         bs = l.bs, first = PetscMin(a, b), second = PetscMax(a, b);
  const PetscReal        E = 1.0 + 0.5 * Uniform(1, first, second);
  std::vector<PetscReal> K(bs * bs, 0.0);

  if (bs == 2 || bs == 3) {
    PetscReal square = 0.0;

    for (PetscInt c = 0; c < bs; c++) square += (PetscReal)((x[c] - y[c]) * (x[c] - y[c]));
    for (PetscInt r = 0; r < bs; r++)
      for (PetscInt c = 0; c < bs; c++) K[r * bs + c] = E * (PetscReal)((x[r] - y[r]) * (x[c] - y[c])) / square;
  } else
    for (PetscInt r = 0; r < bs; r++)
      for (PetscInt c = 0; c < bs; c++)
        K[r * bs + c] = r == c ? E
                               : 0.3 / (PetscReal)bs * Uniform(2 + PetscMin(r, c) * bs + PetscMax(r, c), first, second);
  return K;
}

static PetscErrorCode Add(Mat A, PetscInt bs, PetscInt row, PetscInt col, const std::vector<PetscReal> &K,
                          PetscReal factor)
{
  PetscFunctionBeginUser;
  for (PetscInt r = 0; r < bs; r++)
    for (PetscInt c = 0; c < bs; c++)
      if (K[r * bs + c] != 0.0 || (row == col && r == c))
        PetscCall(MatSetValue(A, row * bs + r, col * bs + c, factor * K[r * bs + c], ADD_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of node a */
static PetscErrorCode AddNode(const Lattice &l, Mat A, PetscInt a)
{
  const PetscInt         half = l.layers / 2, d = l.dim();
  std::vector<PetscReal> identity(l.bs * l.bs, 0.0);
  PetscInt               x[3], y[3];

  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < l.bs; c++) identity[c * l.bs + c] = 1.0;
  Place(l, a, x);
  const bool      upper = x[d - 1] >= half;
  const PetscReal own   = upper ? l.contrast : 1.0;
  const bool      held  = x[d - 1] == 0 ? !l.floating || l.apart : (l.apart && !l.floating && x[d - 1] == l.layers - 1);
  PetscCall(Add(A, l.bs, a, a, identity, held ? own : 0.0));
  if (l.alone && a % 7 == 3) {
    PetscCall(Add(A, l.bs, a, a, identity, own));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt k = 0; k < 27; k++) {
    const PetscInt step[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
    bool           inside  = k != 13 && (d == 3 || !step[2]);

    for (PetscInt c = 0; c < 3; c++) {
      y[c]   = x[c] + step[c];
      inside = inside && y[c] >= 0 && y[c] < (c >= d ? 1 : c == d - 1 ? l.layers : l.n);
    }
    if (!inside) continue;
    const PetscInt b     = Number(l, y);
    const bool     other = y[d - 1] >= half;
    if ((l.alone && b % 7 == 3) || (l.apart && other != upper)) continue;
    const std::vector<PetscReal> K = Stiffness(l, a, b, x, y);
    const PetscReal              E = upper && other ? l.contrast : 1.0; /* the softer of the two holds them together */
    PetscCall(Add(A, l.bs, a, a, K, E));
    PetscCall(Add(A, l.bs, a, b, K, -E));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LatticeCreate(const Lattice &l, Mat *A)
{
  PetscInt local, start, end;

  PetscFunctionBeginUser;
  PetscCall(LocalNodes(l, &local));
  PetscCall(MatCreate(PETSC_COMM_WORLD, A));
  PetscCall(MatSetSizes(*A, local * l.bs, local * l.bs, l.nodes() * l.bs, l.nodes() * l.bs));
  PetscCall(MatSetBlockSize(*A, l.bs));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*A, 27 * l.bs, NULL));
  PetscCall(MatMPIAIJSetPreallocation(*A, 27 * l.bs, NULL, 26 * l.bs, NULL));
  PetscCall(MatGetOwnershipRange(*A, &start, &end));
  for (PetscInt a = start / l.bs; a < end / l.bs; a++) PetscCall(AddNode(l, *A, a));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LatticeScale(Mat A)
{
  Vec          left, right;
  PetscInt     start, end;
  PetscScalar *s;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, &right, &left));
  PetscCall(VecGetOwnershipRange(left, &start, &end));
  PetscCall(VecGetArrayWrite(left, &s));
  for (PetscInt i = start; i < end; i++) {
    s[i - start] = 1.0 + 0.5 * Uniform(60, i, 0);
#if defined(PETSC_USE_COMPLEX)
    s[i - start] *= PetscExpScalar(PETSC_i * PETSC_PI * Uniform(61, i, 0));
#endif
  }
  PetscCall(VecRestoreArrayWrite(left, &s));
  PetscCall(VecCopy(left, right));
  PetscCall(VecConjugate(right));
  PetscCall(MatDiagonalScale(A, left, right));
  PetscCall(VecDestroy(&left));
  PetscCall(VecDestroy(&right));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LatticeCoordinates(const Lattice &l, Mat A, std::vector<PetscReal> &coordinates)
{
  PetscInt start, end, x[3];

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(A, &start, &end));
  coordinates.clear();
  for (PetscInt a = start / l.bs; a < end / l.bs; a++) {
    Place(l, a, x);
    for (PetscInt c = 0; c < l.dim(); c++) coordinates.push_back((PetscReal)x[c]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode LatticeSetNearNullSpace(const Lattice &l, Mat A)
{
  MatNullSpace           near;
  std::vector<PetscReal> coordinates;
  Vec                    x;
  PetscScalar           *a;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, &x, NULL));
  if (l.bs == 2 || l.bs == 3) {
    PetscCall(VecSetBlockSize(x, l.bs));
    PetscCall(LatticeCoordinates(l, A, coordinates));
    PetscCall(VecGetArrayWrite(x, &a));
    std::copy(coordinates.begin(), coordinates.end(), a);
    PetscCall(VecRestoreArrayWrite(x, &a));
    PetscCall(MatNullSpaceCreateRigidBody(x, &near));
  } else {
    std::vector<Vec> modes(l.bs);

    for (PetscInt c = 0; c < l.bs; c++) {
      PetscCall(VecDuplicate(x, &modes[c]));
      PetscCall(VecSetBlockSize(modes[c], l.bs));
      PetscCall(VecStrideSet(modes[c], c, 1.0));
      PetscCall(VecNormalize(modes[c], NULL));
    }
    PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, l.bs, modes.data(), &near));
    for (Vec &mode : modes) PetscCall(VecDestroy(&mode));
  }
  PetscCall(MatSetNearNullSpace(A, near));
  PetscCall(MatNullSpaceDestroy(&near));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SurfaceCreate(const Lattice &l, Mat A, PetscReal stiffness, PetscInt pairs, Mat *D)
{
  PetscInt n, N, start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetSize(A, &N, NULL));
  PetscCall(MatCreate(PETSC_COMM_WORLD, D));
  PetscCall(MatSetSizes(*D, n, n, N, N));
  PetscCall(MatSetBlockSize(*D, l.bs));
  PetscCall(MatSetType(*D, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*D, 4 * l.bs, NULL));
  PetscCall(MatMPIAIJSetPreallocation(*D, 4 * l.bs, NULL, 4 * l.bs, NULL));
  PetscCall(MatGetOwnershipRange(*D, &start, &end));
  for (PetscInt p = 0; p < pairs; p++) {
    const PetscInt           node[2] = {2 * p, l.nodes() - 1 - p};
    std::vector<PetscInt>    column;
    std::vector<PetscScalar> v;

    for (int k = 0; k < 2; k++)
      for (PetscInt c = 0; c < l.bs; c++) {
        column.push_back(node[k] * l.bs + c);
        v.push_back(Uniform(50 + k, p, c));
      }
    for (size_t i = 0; i < v.size(); i++)
      for (size_t j = 0; j < v.size(); j++)
        if (column[i] >= start && column[i] < end)
          PetscCall(MatSetValue(*D, column[i], column[j], stiffness * v[i] * PetscConj(v[j]), ADD_VALUES));
  }
  PetscCall(MatAssemblyBegin(*D, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*D, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SumCreate(Mat A, Mat D, Mat *sum)
{
  Mat parts[] = {A, D};

  PetscFunctionBeginUser;
  PetscCall(MatCreateComposite(PetscObjectComm((PetscObject)A), 2, parts, sum));
  PetscCall(MatCompositeSetType(*sum, MAT_COMPOSITE_ADDITIVE));
  PetscCall(MatAssemblyBegin(*sum, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*sum, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MultigridCreate(Mat mat, KSP *ksp)
{
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPCreate(PETSC_COMM_WORLD, ksp));
  PetscCall(KSPSetOperators(*ksp, mat, mat));
  PetscCall(KSPSetType(*ksp, KSPCG));
  PetscCall(KSPSetNormType(*ksp, KSP_NORM_NATURAL));
  PetscCall(KSPSetTolerances(*ksp, 1e-8, PETSC_DEFAULT, PETSC_DEFAULT, 300));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, PCBLOCKSA));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}
