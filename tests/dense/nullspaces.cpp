static char help[] = "Null spaces, near null spaces and block sizes reach both inner matrices; singular systems are solved.\n\n";

#include "run.h"
#include <cmath>

/* A chain of springs without support, A 1 = 0; C ties nodes to each other, C 1 = 0, or one to the ground too */
static PetscErrorCode Chain(bool grounded, Mat *A, Mat *C)
{
  const PetscInt n = 12, m = 3;
  PetscInt       start, end, local;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, 3, NULL, 3, NULL, A));
  PetscCall(MatGetOwnershipRange(*A, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    for (PetscInt j : {i - 1, i + 1}) {
      if (j < 0 || j >= n) continue;
      PetscCall(MatSetValue(*A, i, j, -1.0 - PetscMin(i, j), ADD_VALUES));
      PetscCall(MatSetValue(*A, i, i, 1.0 + PetscMin(i, j), ADD_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatGetLocalSize(*A, &local, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, local, m, n, 2, NULL, 2, NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscCall(MatSetValue(*C, i, 2 * i, 1.0, INSERT_VALUES));
    if (!grounded || i) PetscCall(MatSetValue(*C, i, 2 * i + 5, -1.0, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A right-hand side that has a solution, which is not unique */
static PetscErrorCode SolveConsistent(KSP ksp, Mat nest)
{
  KSPConvergedReason reason;
  PetscInt           n;
  Dense              K;
  Column             db, dy;
  Vec                b, y;

  PetscFunctionBeginUser;
  PetscCall(Gather(nest, K));
  PetscCall(MatGetLocalSize(nest, &n, NULL));
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, n, PETSC_DECIDE, &y));
  PetscCall(VecDuplicate(y, &b));
  PetscCall(SetRandom(y, 80));
  PetscCall(MatMult(nest, y, b));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(Gather(b, db));
  PetscCall(Gather(y, dy));
  PetscCall(CheckEqual("residual of the full system", K * dy, db, 1e-10));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A nest whose multipliers come first in its numbering, with (one, 0) as its null space */
static PetscErrorCode MultipliersFirst(Mat A, Mat Ct, Mat C, Vec one, Mat *nest)
{
  Mat          blocks[] = {A, Ct, C, NULL};
  PetscInt     n, m, start;
  IS           is[2];
  Vec          part[2] = {one, NULL}, v;
  MatNullSpace nullsp;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(C, &m, &n));
  start = n + m;
  PetscCallMPI(MPI_Scan(MPI_IN_PLACE, &start, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, n, start - n, 1, &is[0]));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, m, start - n - m, 1, &is[1]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, is, 2, is, blocks, nest));
  PetscCall(MatCreateVecs(C, NULL, &part[1]));
  PetscCall(VecSet(part[1], 0.0));
  PetscCall(VecCreateNest(PETSC_COMM_WORLD, 2, is, part, &v));
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 1, &v, &nullsp));
  PetscCall(MatSetNullSpace(*nest, nullsp));
  PetscCall(MatNullSpaceDestroy(&nullsp));
  for (Vec *vec : {&v, &part[1]}) PetscCall(VecDestroy(vec));
  for (IS &set : is) PetscCall(ISDestroy(&set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* declared: 0 as a constant of A, 1 as a vector of A, 2 on the index set of the field, as for PCFIELDSPLIT, 3 on Amat, where Pmat is another matrix */
static PetscErrorCode Singular(bool grounded, int declared)
{
  Mat          A, C, Ct, nest, S, M, P = NULL;
  IS           is[2];
  Vec          one;
  MatNullSpace nullsp, got;
  KSP          ksp, inner;
  PC           pc;
  Column       v;

  PetscFunctionBeginUser;
  Case("chain, grounded %d, declared %d", grounded, declared);
  PetscCall(Chain(grounded, &A, &C));
  PetscCall(MatHermitianTranspose(C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(MatCreateVecs(A, &one, NULL));
  PetscCall(VecSet(one, 1.0));
  PetscCall(VecNormalize(one, NULL));
  if (declared < 3) PetscCall(NestCreate(A, Ct, C, NULL, false, &nest));
  else PetscCall(MultipliersFirst(A, Ct, C, one, &nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatNestGetISs(nest, is, NULL));
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, (PetscBool)(declared == 0), declared == 0 ? 0 : 1, &one, &nullsp));
  if (declared < 2) PetscCall(MatSetNullSpace(A, nullsp));
  else if (declared == 2) PetscCall(PetscObjectCompose((PetscObject)is[0], "nullspace", (PetscObject)nullsp));
  PetscCall(MatNullSpaceDestroy(&nullsp));
  PetscCall(SolverCreate(nest, &ksp));
  if (declared == 3) {
    PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, &P));
    PetscCall(KSPSetOperators(ksp, nest, P));
  }
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(KSPSetUp(ksp));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetOperators(inner, &S, &M));
  for (Mat mat : {S, M}) {
    PetscCall(MatGetNullSpace(mat, &got));
    if (grounded) PetscCall(CheckTrue("what C holds is no null space", !got));
    else {
      PetscBool  constant;
      PetscInt   nv = 0;
      const Vec *vecs;

      PetscCall(CheckTrue("null space", got != NULL));
      if (!got) continue;
      PetscCall(MatNullSpaceGetVecs(got, &constant, &nv, &vecs));
      PetscCall(CheckInt("dimension", nv + (constant ? 1 : 0), 1));
      if (nv != 1) continue;
      PetscCall(Gather(vecs[0], v));
      PetscCall(Check("distance from a constant",
                      PetscMin((v - Column::Constant(12, 1.0 / std::sqrt(12.0))).norm(), (v + Column::Constant(12, 1.0 / std::sqrt(12.0))).norm()), 1e-14));
    }
  }

  if (declared < 3) PetscCall(SolveConsistent(ksp, nest));
  PetscCall(VecDestroy(&one));
  PetscCall(KSPDestroy(&ksp));
  for (Mat *mat : {&A, &C, &nest, &P}) PetscCall(MatDestroy(mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two chains side by side: Ker A has two dimensions, of which the ties between them leave some; against the kernel by SVD */
static PetscErrorCode Chains(PetscInt ties)
{
  const PetscInt n = 12;
  PetscInt       start, end, local;
  Mat            A, C, nest, S, M;
  Vec            v[2];
  MatNullSpace   got;
  KSP            ksp, inner;
  PC             pc;
  Dense          dense[2], stacked;

  PetscFunctionBeginUser;
  Case("two chains, %d ties", (int)ties);
  PetscCall(Chain(false, &A, &C));
  PetscCall(MatDestroy(&C));
  PetscCall(MatGetLocalSize(A, &local, NULL));
  PetscCall(MatGetOwnershipRange(A, &start, &end));
  for (PetscInt i : {5, 6}) { /* cut between them */
    if (i < start || i >= end) continue;
    PetscCall(MatSetValue(A, i, i, -6.0, ADD_VALUES));
    PetscCall(MatSetValue(A, i, 11 - i, 6.0, ADD_VALUES));
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, local, 2 + ties, n, 2, NULL, 2, NULL, &C));
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  for (PetscInt i = start; i < end; i++) { /* 0 and 2, 7 and 9: in one chain; 1 and 8: a tie; 3: to the ground */
    const PetscInt at[4][2] = {
      {0, 2 },
      {7, 9 },
      {1, 8 },
      {3, -1}
    };
    for (int k = 0; k < 2; k++)
      if (at[i][k] >= 0) PetscCall(MatSetValue(C, i, at[i][k], k ? -1.0 : 1.0, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(C, MAT_FINAL_ASSEMBLY));
  for (int k = 0; k < 2; k++) { /* neither is that of one chain */
    PetscCall(MatCreateVecs(A, &v[k], NULL));
    PetscCall(MatGetOwnershipRange(A, &start, &end));
    for (PetscInt i = start; i < end; i++) PetscCall(VecSetValue(v[k], i, k == i / 6 ? 0.8 : (k ? 0.6 : -0.6), INSERT_VALUES));
    PetscCall(VecAssemblyBegin(v[k]));
    PetscCall(VecAssemblyEnd(v[k]));
    PetscCall(VecNormalize(v[k], NULL));
  }
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 2, v, &got));
  PetscCall(MatSetNullSpace(A, got));
  PetscCall(MatNullSpaceDestroy(&got));
  PetscCall(Gather(A, dense[0]));
  PetscCall(Gather(C, dense[1]));
  stacked.resize(n + 2 + ties, n);
  stacked << dense[0], dense[1];
  const Dense kernel = Eigen::JacobiSVD<Dense>(stacked, Eigen::ComputeFullV).matrixV().rightCols(2 - ties);

  PetscCall(NestCreate(A, NULL, C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(KSPSetUp(ksp));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetOperators(inner, &S, &M));
  for (Mat mat : {S, M}) {
    PetscBool  constant = PETSC_FALSE;
    PetscInt   nv       = 0;
    const Vec *vecs;
    Dense      projector = Dense::Zero(n, n);
    Column     one;

    PetscCall(MatGetNullSpace(mat, &got));
    if (got) PetscCall(MatNullSpaceGetVecs(got, &constant, &nv, &vecs));
    PetscCall(CheckInt("dimension", nv + (constant ? 1 : 0), 2 - ties));
    for (PetscInt k = 0; k < nv; k++) {
      PetscCall(Gather(vecs[k], one));
      projector += one * one.adjoint();
    }
    if (ties < 2) PetscCall(CheckEqual("projector onto the null space", projector, kernel * kernel.adjoint(), 1e-12));
  }
  if (ties) PetscCall(SolveConsistent(ksp, nest));
  PetscCall(KSPDestroy(&ksp));
  for (Vec &vec : v) PetscCall(VecDestroy(&vec));
  for (Mat *mat : {&A, &C, &nest}) PetscCall(MatDestroy(mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* on: the matrix or the index set */
static PetscErrorCode Near(bool onMatrix)
{
  Spec         spec;
  System       sys;
  Mat          nest, S, M;
  IS           is[2];
  Vec          v;
  MatNullSpace near, got;
  KSP          ksp, inner;
  PC           pc;
  PetscInt     bs;

  PetscFunctionBeginUser;
  Case("near null space on the %s", onMatrix ? "matrix" : "index set");
  spec.bs = 3;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, true, &nest));
  PetscCall(MatNestGetISs(nest, is, NULL));
  PetscCall(VecDuplicate(sys.f, &v));
  PetscCall(SetRandom(v, 81));
  PetscCall(VecNormalize(v, NULL));
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 1, &v, &near));
  if (onMatrix) PetscCall(MatSetNearNullSpace(sys.A, near));
  else PetscCall(PetscObjectCompose((PetscObject)is[1], "nearnullspace", (PetscObject)near));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(KSPSetUp(ksp));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetOperators(inner, &S, &M));
  for (Mat mat : {S, M}) {
    PetscCall(MatGetNearNullSpace(mat, &got));
    PetscCall(CheckTrue("the near null space that was given", got == near));
    PetscCall(MatGetBlockSize(mat, &bs));
    PetscCall(CheckInt("block size", bs, 3));
    PetscCall(MatGetNullSpace(mat, &got));
    PetscCall(CheckTrue("no null space", !got));
  }
  PetscCall(MatNullSpaceDestroy(&near));
  PetscCall(VecDestroy(&v));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The sum of all rows of C is zero. With the constant attached to the field of the multipliers they have none of it, as those of least norm; a vector that is no
   null vector of C' is not taken out. Then g is rounding, as at the end of Newton's method, whose sum is not zero: it counts relative to f
*/
static PetscErrorCode Multipliers(bool constant, bool crossed)
{
  const PetscInt n = 24, m = 6;
  DenseSystem    d = SpringsCreate(n, m - 1, 2e6, 17);
  Dense          K = Dense::Zero(n + m, n + m);
  Column         b(n + m);
  Run            run;
  IS             is[2];
  Vec            v;
  MatNullSpace   nullsp;

  PetscFunctionBeginUser;
  Case("null space of the multipliers, constant %d, crossed %d", constant, crossed);
  d.C.conservativeResize(m, Eigen::NoChange);
  d.g.conservativeResize(m);
  d.C.row(m - 1) = -d.C.topRows(m - 1).colwise().sum();
  d.g[m - 1]     = -d.g.head(m - 1).sum();
  K << d.A, d.C.adjoint(), d.C, Dense::Zero(m, m);
  b << d.f, d.g;
  PetscCall(RunCreate(d, crossed, &run));
  PetscCall(MatNestGetISs(run.nest, is, NULL));
  PetscCall(MatCreateVecs(run.sys.C, NULL, &v));
  PetscCall(Scatter(constant ? Column(Column::Ones(m).normalized()) : Column(Column::Unit(m, 2)), v));
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 1, &v, &nullsp));
  PetscCall(PetscObjectCompose((PetscObject)is[1], "nullspace", (PetscObject)nullsp));
  PetscCall(MatNullSpaceDestroy(&nullsp));
  PetscCall(VecDestroy(&v));
  PetscCall(CheckSolved(&run, d));
  if (constant) {
    PetscCall(CheckEqual("lambda", run.lambda, K.completeOrthogonalDecomposition().solve(b).tail(m), 1e-9));
    for (PetscReal sum : {1e-13, 1e-3}) {
      Case("null space of the multipliers, crossed %d, the sum of g %g", crossed, (double)sum);
      d.g.setZero();
      d.g[1] = sum;
      PetscCall(Scatter(1e-6 * d.f, run.sys.f));
      PetscCall(Scatter(d.g, run.sys.g));
      PetscCall(RunSolve(&run));
      b << 1e-6 * d.f, Column::Zero(m);
      if (sum > 1e-6) PetscCall(CheckFailed(run));
      else PetscCall(CheckEqual("x", run.x, K.completeOrthogonalDecomposition().solve(b).head(n), 1e-6));
    }
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  {
    Options options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
    for (bool grounded : {false, true})
      for (int declared = 0; declared < 4; declared++) PetscCall(Singular(grounded, declared));
    for (PetscInt ties = 0; ties < 3; ties++) PetscCall(Chains(ties));
    for (bool onMatrix : {false, true}) PetscCall(Near(onMatrix));
    for (bool constant : {false, true})
      for (bool crossed : {false, true}) PetscCall(Multipliers(constant, crossed));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
