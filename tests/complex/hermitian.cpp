/*
   PCBLOCKSA and PCAINSWORTH do on U A U' what they do on A, U a diagonal of unit phases, signs where numbers are real:
   the same iterations and U times the same solution. Phases vary from node to node, or from unknown to unknown
*/
#include <petscainsworth.h>
#include <base/petsccompat.h>
#include <cmath>
#include <vector>

static PetscInt failed = 0;

static PetscErrorCode Check(const char *what, PetscReal got, PetscReal bound)
{
  PetscFunctionBeginUser;
  if (!(got <= bound)) { /* not a number fails */
    failed++;
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "FAILED: %s is %g, more than %g\n", what, (double)got, (double)bound));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bars between neighbors of a grid of n^dim nodes, the first layer held by springs: rigid motions strain no bar */
struct Truss {
  PetscInt dim, n;

  PetscInt nodes() const { return dim == 2 ? n * n : n * n * n; }
  void     position(PetscInt node, PetscInt x[3]) const
  {
    for (PetscInt d = 0; d < 3; d++, node /= n) x[d] = d < dim ? node % n : 0;
  }
};

static PetscErrorCode AddBar(const Truss &truss, PetscInt node, const PetscInt x[3], const PetscInt step[3], Mat A)
{
  const PetscInt           dim = truss.dim;
  PetscInt                 to = 0, length = 0;
  std::vector<PetscScalar> block(dim * dim);

  PetscFunctionBeginUser;
  for (PetscInt d = dim - 1; d >= 0; d--) {
    const PetscInt y = x[d] + step[d];
    if (y < 0 || y >= truss.n) PetscFunctionReturn(PETSC_SUCCESS);
    to = to * truss.n + y;
    length += step[d] * step[d];
  }
  if (!length || length == 3) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt a = 0; a < dim; a++)
    for (PetscInt b = 0; b < dim; b++) block[a * dim + b] = (PetscReal)(step[a] * step[b]) / (PetscReal)length;
  PetscCall(MatSetValuesBlocked(A, 1, &node, 1, &node, block.data(), ADD_VALUES));
  for (PetscScalar &v : block) v = -v;
  PetscCall(MatSetValuesBlocked(A, 1, &node, 1, &to, block.data(), ADD_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TrussCreate(const Truss &truss, Mat *A, Vec *coordinates)
{
  const PetscInt dim = truss.dim, N = truss.nodes() * dim;
  PetscInt       first, last, x[3];
  PetscScalar   *c;

  PetscFunctionBeginUser;
  PetscCall(MatCreate(PETSC_COMM_WORLD, A));
  PetscCall(MatSetSizes(*A, PETSC_DECIDE, PETSC_DECIDE, N, N));
  PetscCall(MatSetBlockSize(*A, dim));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*A, 19 * dim, NULL));
  PetscCall(MatMPIAIJSetPreallocation(*A, 19 * dim, NULL, 19 * dim, NULL));
  PetscCall(MatCreateVecs(*A, coordinates, NULL));
  PetscCall(VecSetBlockSize(*coordinates, dim));
  PetscCall(MatGetOwnershipRange(*A, &first, &last));
  PetscCall(VecGetArrayWrite(*coordinates, &c));
  for (PetscInt node = first / dim; node < last / dim; node++) {
    truss.position(node, x);
    for (PetscInt k = 0; k < 27; k++) {
      const PetscInt step[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
      if (dim == 3 || !step[2]) PetscCall(AddBar(truss, node, x, step, *A));
    }
    for (PetscInt d = 0; d < dim; d++) {
      const PetscInt row = node * dim + d;
      c[row - first]     = (PetscReal)x[d];
      if (!x[0]) PetscCall(MatSetValue(*A, row, row, 1.0, ADD_VALUES));
    }
  }
  PetscCall(VecRestoreArrayWrite(*coordinates, &c));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes of the last layer move together with the one before them along the second direction */
static PetscErrorCode TiesCreate(const Truss &truss, Mat A, Mat *C)
{
  const PetscInt dim = truss.dim;
  PetscInt       local, first, last;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(A, &local, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, local, truss.n - 1, truss.nodes() * dim, 2, NULL, 2, NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &first, &last));
  for (PetscInt row = first; row < last; row++) {
    const PetscInt    node = truss.n * (row + 1) + truss.n - 1, cols[2] = {(node - truss.n) * dim + 1, node * dim + 1};
    const PetscScalar values[2] = {-1.0, 1.0};
    PetscCall(MatSetValues(*C, 1, &row, 2, cols, values, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A number for each l that looks random, the same on any number of ranks, in [0, 1) */
static PetscReal Hash(PetscInt l)
{
  const double s = 43758.5453 * std::sin(12.9898 * (double)l + 1.0);
  return (PetscReal)(s - std::floor(s));
}

static PetscErrorCode PhasesCreate(Mat A, bool nodes, Vec *U)
{
  PetscInt     first, last, bs;
  PetscScalar *u;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, U, NULL));
  PetscCall(MatGetBlockSize(A, &bs));
  PetscCall(VecGetOwnershipRange(*U, &first, &last));
  PetscCall(VecGetArrayWrite(*U, &u));
  for (PetscInt l = first; l < last; l++) {
    const PetscReal h = Hash(nodes ? l / bs : l);
#if defined(PETSC_USE_COMPLEX)
    u[l - first] = PetscExpComplex(PETSC_i * (PetscScalar)(2 * PETSC_PI * h));
#else
    u[l - first] = h < 0.5 ? -1.0 : 1.0;
#endif
  }
  PetscCall(VecRestoreArrayWrite(*U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the program has: A, C, f, and the near null space on A */
struct System {
  Mat A = NULL, C = NULL;
  Vec f = NULL;
};

static PetscErrorCode SystemDestroy(System *sys)
{
  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&sys->A));
  PetscCall(MatDestroy(&sys->C));
  PetscCall(VecDestroy(&sys->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SystemCreate(const Truss &truss, System *sys)
{
  Vec          coordinates;
  MatNullSpace near;
  PetscInt     first, last;

  PetscFunctionBeginUser;
  PetscCall(TrussCreate(truss, &sys->A, &coordinates));
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, &near));
  PetscCall(MatSetNearNullSpace(sys->A, near));
  PetscCall(MatNullSpaceDestroy(&near));
  PetscCall(VecDestroy(&coordinates));
  PetscCall(TiesCreate(truss, sys->A, &sys->C));
  PetscCall(MatCreateVecs(sys->A, NULL, &sys->f));
  PetscCall(VecGetOwnershipRange(sys->f, &first, &last));
  for (PetscInt l = first; l < last; l++) PetscCall(VecSetValue(sys->f, l, 1.0 + Hash(7 * l + 3), INSERT_VALUES));
  PetscCall(VecAssemblyBegin(sys->f));
  PetscCall(VecAssemblyEnd(sys->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U A U', C U', U f, and U times the near null space */
static PetscErrorCode SystemTurn(const System &sys, Vec U, System *turned)
{
  Vec              conjugate;
  MatNullSpace     near;
  PetscInt         n;
  const Vec       *modes;
  std::vector<Vec> v;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(U, &conjugate));
  PetscCall(VecCopy(U, conjugate));
  PetscCall(VecConjugate(conjugate));
  PetscCall(MatDuplicate(sys.A, MAT_COPY_VALUES, &turned->A));
  /* PETSc 3.18 takes what two different vectors scaled for unsymmetric */
  PetscCall(MatDiagonalScale(turned->A, U, PetscDefined(USE_COMPLEX) ? conjugate : U));
  PetscCall(MatDuplicate(sys.C, MAT_COPY_VALUES, &turned->C));
  PetscCall(MatDiagonalScale(turned->C, NULL, conjugate));
  PetscCall(VecDuplicate(sys.f, &turned->f));
  PetscCall(VecPointwiseMult(turned->f, U, sys.f));
  PetscCall(MatGetNearNullSpace(sys.A, &near));
  PetscCall(MatNullSpaceGetVecs(near, NULL, &n, &modes));
  v.resize(n);
  for (PetscInt k = 0; k < n; k++) {
    PetscCall(VecDuplicate(modes[k], &v[k]));
    PetscCall(VecPointwiseMult(v[k], U, modes[k]));
  }
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, n, v.data(), &near));
  PetscCall(MatSetNearNullSpace(turned->A, near));
  PetscCall(MatNullSpaceDestroy(&near));
  for (Vec &mode : v) PetscCall(VecDestroy(&mode));
  PetscCall(VecDestroy(&conjugate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   (v, B u) is the conjugate of (u, B v), (u, B u) is real and positive, B^T u is the conjugate of B applied to that of
   u
*/
static PetscErrorCode CheckHermitian(PC pc, Vec like, PetscReal tolerance)
{
  PetscRandom rand;
  Vec         u, v, Bu, Bv;
  PetscScalar uBv, vBu, uBu;
  PetscReal   norm, size;

  PetscFunctionBeginUser;
  PetscCall(PetscRandomCreate(PETSC_COMM_WORLD, &rand));
  PetscCall(PetscRandomSetInterval(rand, -1.0, 1.0));
#if defined(PETSC_USE_COMPLEX)
  PetscCall(PetscRandomSetInterval(rand, -1.0 - PETSC_i, 1.0 + PETSC_i));
#endif
  for (Vec *w : {&u, &v, &Bu, &Bv}) PetscCall(VecDuplicate(like, w));
  PetscCall(VecSetRandom(u, rand));
  PetscCall(VecSetRandom(v, rand));
  PetscCall(PCApply(pc, u, Bu));
  PetscCall(PCApply(pc, v, Bv));
  PetscCall(VecDot(Bv, u, &uBv));
  PetscCall(VecDot(Bu, v, &vBu));
  PetscCall(VecDot(Bu, u, &uBu));
  size = PetscAbsScalar(uBu);
  PetscCall(Check("asymmetry of the cycle", PetscAbsScalar(uBv - PetscConj(vBu)) / size, tolerance));
  PetscCall(Check("imaginary part of (u, B u)", PetscAbsReal(PetscImaginaryPart(uBu)) / size, tolerance));
  PetscCall(Check("-(u, B u)", -PetscRealPart(uBu), 0.0));
  PetscCall(VecCopy(u, v));
  PetscCall(VecConjugate(v));
  PetscCall(PCApplyTranspose(pc, v, Bv));
  PetscCall(VecConjugate(Bv));
  PetscCall(VecNorm(Bu, NORM_2, &size));
  PetscCall(VecAXPY(Bv, -1.0, Bu));
  PetscCall(VecNorm(Bv, NORM_2, &norm));
  PetscCall(Check("the transpose", norm / size, tolerance));
  for (Vec *w : {&u, &v, &Bu, &Bv}) PetscCall(VecDestroy(w));
  PetscCall(PetscRandomDestroy(&rand));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* CG with PCBLOCKSA */
static PetscErrorCode SolveAlone(const System &sys, PetscReal tolerance, Vec x, PetscInt *iterations)
{
  KSP ksp;
  PC  pc;

  PetscFunctionBeginUser;
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, sys.A, sys.A));
  PetscCall(KSPSetType(ksp, KSPCG));
  PetscCall(KSPSetNormType(ksp, KSP_NORM_NATURAL));
  PetscCall(KSPSetTolerances(ksp, 1e-9, PETSC_DEFAULT, PETSC_DEFAULT, 100));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCBLOCKSA));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSolve(ksp, sys.f, x));
  PetscCall(KSPGetIterationNumber(ksp, iterations));
  PetscCall(CheckHermitian(pc, x, tolerance));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [A C'; C 0] with PCAINSWORTH, whose inner preconditioner shall be PCBLOCKSA of its own accord */
static PetscErrorCode SolveTied(const System &sys, Vec x, PetscInt *iterations)
{
  Mat       Ct, nest, blocks[4];
  Vec       b, y, part[2], first;
  KSP       ksp, inner;
  PC        pc;
  IS        fields[2];
  PetscBool same;

  PetscFunctionBeginUser;
  PetscCall(MatCreateHermitianTranspose(sys.C, &Ct));
  blocks[0] = sys.A;
  blocks[1] = Ct;
  blocks[2] = sys.C;
  blocks[3] = NULL;
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &nest));
  part[0] = sys.f;
  PetscCall(MatCreateVecs(sys.C, NULL, &part[1]));
  PetscCall(VecSet(part[1], 0.0));
  PetscCall(MatNestGetISs(nest, fields, NULL));
  PetscCall(MatCreateVecs(nest, &y, &b));
  for (PetscInt k = 0; k < 2; k++) PetscCall(VecISCopy(b, fields[k], SCATTER_FORWARD, part[k]));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, nest, nest));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetIterationNumber(inner, iterations));
  PetscCall(KSPGetPC(inner, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCBLOCKSA, &same));
  PetscCall(Check("another inner preconditioner than PCBLOCKSA", same ? 0.0 : 1.0, 0.0));
  PetscCall(VecGetSubVector(y, fields[0], &first));
  PetscCall(VecCopy(first, x));
  PetscCall(VecRestoreSubVector(y, fields[0], &first));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(VecDestroy(&part[1]));
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&b));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&Ct));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The difference of U x and y, of the size of y */
static PetscErrorCode Difference(Vec U, Vec x, Vec y, PetscReal *difference)
{
  Vec       d;
  PetscReal norm;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(x, &d));
  PetscCall(VecPointwiseMult(d, U, x));
  PetscCall(VecAXPY(d, -1.0, y));
  PetscCall(VecNorm(d, NORM_2, difference));
  PetscCall(VecNorm(y, NORM_2, &norm));
  PetscCall(VecDestroy(&d));
  *difference /= norm;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckTruss(const Truss &truss, PetscReal tolerance)
{
  System    sys;
  Vec       x, y, U;
  PetscReal difference;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(truss, &sys));
  PetscCall(VecDuplicate(sys.f, &x));
  PetscCall(VecDuplicate(sys.f, &y));
  for (bool nodes : {true, false}) {
    System turned;

    PetscCall(PhasesCreate(sys.A, nodes, &U));
    PetscCall(SystemTurn(sys, U, &turned));
    for (bool tied : {false, true}) {
      PetscInt its = 0, turnedIts = 0;

      PetscCall(tied ? SolveTied(sys, x, &its) : SolveAlone(sys, tolerance, x, &its));
      PetscCall(tied ? SolveTied(turned, y, &turnedIts) : SolveAlone(turned, tolerance, y, &turnedIts));
      PetscCall(Difference(U, x, y, &difference));
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "blocks of %d, phases of %s, %s: %d and %d iterations, difference %.1e\n",
                            (int)truss.dim, nodes ? "nodes" : "unknowns", tied ? "tied" : "alone", (int)its,
                            (int)turnedIts, (double)difference));
      PetscCall(Check("difference of the iterations", PetscAbsReal((PetscReal)(its - turnedIts)), 1.0));
      PetscCall(Check("iterations", (PetscReal)its, 30.0));
      PetscCall(Check("difference of the solutions", difference, 1e-6));
    }
    PetscCall(SystemDestroy(&turned));
    PetscCall(VecDestroy(&U));
  }
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscReal tolerance = 1e-11;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-tolerance", &tolerance, NULL));
  PetscCall(CheckTruss({3, 9}, tolerance));
  PetscCall(CheckTruss({2, 25}, tolerance));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "hermitian: %s\n", failed ? "failed" : "passed"));
  PetscCall(PetscFinalize());
  return failed ? 1 : 0;
}
