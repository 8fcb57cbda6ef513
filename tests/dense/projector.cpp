static char help[] = "P, Q, R and S against their dense formulas, for every weight and every way to solve with S.\n\n";

#include "dense.h"

static PetscErrorCode SetWeight(Mat S, MatAinsworthWeightType type, Vec w)
{
  PetscFunctionBeginUser;
  if (type == MAT_AINSWORTH_WEIGHT_USER) PetscCall(MatAinsworthSetWeight(S, w));
  else PetscCall(MatAinsworthSetWeightType(S, type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Column DenseWeight(const DenseSystem &d, MatAinsworthWeightType type)
{
  if (type == MAT_AINSWORTH_WEIGHT_USER) return d.w;
  if (type == MAT_AINSWORTH_WEIGHT_DIAGONAL) return DiagonalWeight(d.A);
  return Column::Ones(d.A.rows());
}

/* What is on the rows of C divided by sqrt(S_ii): no row counts more than another */
static Dense RowScaled(const DenseProjector &p, const Dense &X)
{
  return p.S.diagonal().cwiseSqrt().cwiseInverse().asDiagonal() * X;
}

static PetscErrorCode CheckOperators(Mat S, const DenseSystem &d, const Column &W, PetscReal tolerance)
{
  const DenseProjector p(d.C, W);
  const Eigen::Index   m    = d.C.rows();
  const Column         root = p.S.diagonal().cwiseSqrt();
  Dense                Q, Qt, R, Rt;
  Mat                  A, C;
  Vec                  x, y, g;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(S, &x, &y));
  PetscCall(MatAinsworthGetMats(S, &A, &C));
  PetscCall(MatCreateVecs(C, NULL, &g));
  PetscCall(GatherOperator(
    x, y, [S](Vec u, Vec v) { return MatAinsworthMultProjector(S, u, v); }, Q));
  PetscCall(CheckEqual("Q", Q, p.Q, tolerance));
  PetscCall(GatherOperator(
    x, y, [S](Vec u, Vec v) { return MatAinsworthMultTransposeProjector(S, u, v); }, Qt));
  PetscCall(CheckEqual("Q'", Qt, p.Q.adjoint(), tolerance));
  PetscCall(GatherOperator(
    g, y, [S](Vec u, Vec v) { return MatAinsworthMultRightInverse(S, u, v); }, R));
  PetscCall(CheckEqual("R", R * root.asDiagonal(), p.R * root.asDiagonal(), tolerance));
  PetscCall(GatherOperator(
    x, g, [S](Vec u, Vec v) { return MatAinsworthMultTransposeRightInverse(S, u, v); }, Rt));
  PetscCall(CheckEqual("R'", root.asDiagonal() * Rt, root.asDiagonal() * p.R.adjoint(), tolerance));
  /* x and y may be the same */
  PetscCall(GatherOperator(
    x, y,
    [S](Vec u, Vec v) {
      PetscCall(VecCopy(u, v));
      return MatAinsworthMultProjector(S, v, v);
    },
    Q));
  PetscCall(CheckEqual("Q in place", Q, p.Q, tolerance));
  PetscCall(GatherOperator(
    x, y,
    [S](Vec u, Vec v) {
      PetscCall(VecCopy(u, v));
      return MatAinsworthMultTransposeProjector(S, v, v);
    },
    Qt));
  PetscCall(CheckEqual("Q' in place", Qt, p.Q.adjoint(), tolerance));

  /* what defines them */
  const PetscReal size = RowScaled(p, d.C).norm();
  PetscCall(Check("C Q", RowScaled(p, d.C * Q).norm() / size, tolerance));
  PetscCall(CheckEqual("C R = I", RowScaled(p, d.C * R * root.asDiagonal()), Dense::Identity(m, m), tolerance));
  PetscCall(CheckEqual("Q Q = Q", Q * Q, Q, tolerance));
  PetscCall(Check("Q R", (Q * R * root.asDiagonal()).norm() / (R * root.asDiagonal()).norm(), tolerance));
  PetscCall(CheckEqual("Q + R C = I", Q + R * d.C, Dense::Identity(Q.rows(), Q.rows()), tolerance));
  PetscCall(
    CheckEqual("W^-1 Q = Q' W^-1", W.cwiseInverse().asDiagonal() * Q, Qt * W.cwiseInverse().asDiagonal(), tolerance));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Weights(const Spec &spec)
{
  System      sys;
  DenseSystem d;
  Mat         S;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(MatCreateAinsworth(sys.A, sys.C, &S));
  for (int type = 0; type < 3; type++) {
    const MatAinsworthWeightType set = (MatAinsworthWeightType)type;

    Case("%s, weight %s", spec.name, MatAinsworthWeightTypes[type]);
    PetscCall(SetWeight(S, set, sys.w));
    PetscCall(CheckOperators(S, d, DenseWeight(d, set), 1e-12));
  }
  PetscCall(MatDestroy(&S));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Where an entry of diag(A) is not positive or not stored, the 1-norm of its row, and the smallest weight for a row of
   zeros
*/
static PetscErrorCode IllDiagonals()
{
  Spec        spec;
  System      sys;
  DenseSystem d;
  Mat         A, S;
  Column      expected;
  PetscInt    start, end;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  d.A.row(4).setZero();
  d.A.col(4).setZero();
  d.A(7, 7)   = 0.0;
  d.A(20, 20) = -3.0;
  PetscCall(MatGetOwnershipRange(sys.A, &start, &end));
  PetscCall(
    MatCreateAIJ(PETSC_COMM_WORLD, end - start, end - start, PETSC_DETERMINE, PETSC_DETERMINE, 7, NULL, 7, NULL, &A));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < spec.n; j++)
      if (d.A(i, j) != 0.0) PetscCall(MatSetValue(A, i, j, d.A(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  expected     = d.A.diagonal();
  expected[7]  = d.A.row(7).cwiseAbs().sum();
  expected[20] = d.A.row(20).cwiseAbs().sum();
  expected     = expected.cwiseInverse();
  expected[4]  = 0.0;
  WeighLoose(d.C, expected);
  expected[4] *= 1000.0;
  PetscCall(MatCreateAinsworth(A, sys.C, &S));
  Case("diagonal entries of A that are negative, zero, absent");
  PetscCall(CheckOperators(S, d, expected, 1e-12));
  PetscCall(MatDestroy(&S));
  PetscCall(MatDestroy(&A));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One row of S per rank, and solvers for S from the options */
static PetscErrorCode GramSolvers()
{
  const char *const choices[] = {"", "-ainsworth_gram_ksp_type cg -ainsworth_gram_pc_type jacobi",
                                 "-ainsworth_gram_pc_type lu"};
  PetscMPIInt       size, group;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (PetscInt rows : {1, 4, 100000}) {
    for (const char *choice : choices) {
      for (bool uneven : {false, true}) {
        Options     options(choice + (" -ainsworth_pc_type jacobi"
                                      " -pc_ainsworth_rows_per_rank " +
                                  std::to_string((long long)rows)));
        Spec        spec;
        System      sys;
        DenseSystem d;
        Mat         nest, S;
        KSP         outer, inner, ksp;
        PC          pc;
        PetscMPIInt got = 0;
        int         members;

        spec.n      = 48;
        spec.m      = 20;
        spec.uneven = uneven;
        Case("rows per rank %d, uneven %d, %s", (int)rows, uneven, *choice ? choice : "default");
        PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
        PetscCall(Gather(sys, d));
        PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
        PetscCall(SolverCreate(nest, &outer));
        PetscCall(MatDestroy(&nest));
        PetscCall(KSPSetUp(outer));
        PetscCall(KSPGetPC(outer, &pc));
        PetscCall(PCAinsworthGetKSP(pc, &inner));
        PetscCall(KSPGetOperators(inner, &S, NULL));
        PetscCall(PCAinsworthGetGramKSP(pc, &ksp));
        if (ksp) PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)ksp), &got));
        members = ksp != NULL;
        PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &members, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD));
        /* S is one piece, which MUMPS alone factors in parts */
        group = PetscDefined(HAVE_MUMPS) && spec.m > 16 * rows
                  ? (PetscMPIInt)PetscMin((spec.m + rows - 1) / rows, uneven ? 1 : size)
                  : 1;
        /* METIS may leave parts of so small a graph empty, but not all except one */
        PetscCall(CheckTrue("ranks with a solver", members <= group && members >= PetscMin(2, group)));
        PetscCall(CheckInt("size of their communicator", ksp ? got : members, members));
        PetscCall(CheckOperators(S, d, DiagonalWeight(d.A), 1e-12));
        PetscCall(KSPDestroy(&outer));
        PetscCall(SystemDestroy(&sys));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const Spec &spec : UsualSpecs()) PetscCall(Weights(spec));
  PetscCall(IllDiagonals());
  PetscCall(GramSolvers());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
