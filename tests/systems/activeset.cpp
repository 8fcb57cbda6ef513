static char help[] = "Primal-dual active sets in the textbook's layout [A B'; P_A B, P_I], one KSP kept over the "
                     "steps.\n"
                     "Each step is compared with dense LU; at the end no row is open that should be closed, and none "
                     "pulls.\n\n";

#include "contact.h"

static const PetscInt most = 30; /* steps */

/* A membrane that a load presses on an obstacle: one row for each unknown inside */
static void Obstacle(Saddle &s)
{
  const Grid grid = {14, 12};

  s.A = Laplacian(grid, [](int i, int j) { return i < 7 ? 1.0 : 1e3 + j; });
  s.f = Vector::Zero(grid.Nodes());
  for (int j = 1; j < grid.ny; j++)
    for (int i = 1; i < grid.nx; i++) s.f[grid.Node(i, j)] = 0.05 * (i < 7 ? 1.0 : 1e3);
  std::vector<int> inside;
  for (int j = 0; j <= grid.ny; j++)
    for (int i = 0; i <= grid.nx; i++)
      if (i == 0 || j == 0 || i == grid.nx || j == grid.ny) Clamp(s.A, s.f, grid.Node(i, j));
      else inside.push_back(grid.Node(i, j));
  s.B = Matrix::Zero((Eigen::Index)inside.size(), s.A.rows());
  s.g = Vector::Zero(s.B.rows());
  for (size_t k = 0; k < inside.size(); k++) {
    s.B((Eigen::Index)k, inside[k]) = 1.0;
    s.g[(Eigen::Index)k]            = 0.1 + 0.02 * std::sin((double)inside[k]);
  }
}

/* Two blocks, the upper one pressed down at one end and lifted at the other: B x >= g is -B x <= -g */
static void Contact(Saddle &s)
{
  double load = -1.0;

  ContactMake(s, BlocksMake(16, 12, 10.0));
  s.A.diagonal().array() += 1e-2; /* where nothing touches yet */
  for (double &f : s.f)
    if (f != 0.0) f *= load += 0.3;
  for (Eigen::Index i = 0; i < s.g.size(); i++) s.g[i] = -2e-2 * (double)((7 * i) % 5);
  s.B = -s.B;
  s.g = -s.g;
}

/* The rows of the active set, and of the others, as the textbook has them: lambda_i = 0 */
static void SetRows(Saddle &s, const std::vector<char> &active)
{
  s.C = s.B;
  s.D = Matrix::Zero(s.B.rows(), s.B.rows());
  for (Eigen::Index i = 0; i < s.B.rows(); i++) {
    if (active[(size_t)i]) continue;
    s.C.row(i).setZero();
    s.D(i, i) = -1.0;
  }
}

/* Values of a matrix, for which it has places; those of the other rows become zeros */
static PetscErrorCode SetValues(Mat M, const Matrix &values, const Matrix &places)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(M, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < (PetscInt)values.cols(); j++)
      if (places(i, j) != 0.0) PetscCall(MatSetValue(M, i, j, values(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt Share(PetscInt total, PetscInt bs)
{
  PetscMPIInt rank, size;

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return bs * (total / bs / size + (rank < total / bs % size));
}

/* One step: x and lambda, right to what dense LU says */
static PetscErrorCode Step(KSP ksp, Mat nest, const Saddle &s, Column &x, Column &lambda, PetscInt *iterations)
{
  const Eigen::Index n = s.A.rows(), m = s.B.rows();
  const Matrix       D = -s.D;
  Matrix             K(n + m, n + m);
  Vector             b(n + m), y;
  IS                 is[2];
  Vec                rhs, sol, sub;
  KSPConvergedReason reason;
  PC                 pc;
  KSP                inner;
  const char        *why;

  PetscFunctionBeginUser;
  K << s.A, s.B.transpose(), s.C, D;
  b << s.f, s.g;
  for (Eigen::Index i = 0; i < m; i++)
    if (s.D(i, i) != 0.0) b[n + i] = 0.0;
  y = K.partialPivLu().solve(b);
  PetscCall(MatCreateVecs(nest, &sol, &rhs));
  PetscCall(MatNestGetISs(nest, is, NULL));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(rhs, is[k], &sub));
    PetscCall(Scatter(Column((k ? b.tail(m) : b.head(n)).cast<PetscScalar>()), sub));
    PetscCall(VecRestoreSubVector(rhs, is[k], &sub));
  }
  PetscCall(KSPSolve(ksp, rhs, sol));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCheck(reason > 0, PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED, "%s: %s", KSPConvergedReasons[reason], why);
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetIterationNumber(inner, iterations));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(sol, is[k], &sub));
    PetscCall(Gather(sub, k ? lambda : x));
    PetscCall(VecRestoreSubVector(sol, is[k], &sub));
  }
  const double errors[2] = {(x.real() - y.head(n)).norm() / y.head(n).norm(),
                            (lambda.real() - y.tail(m)).norm() / std::max(y.tail(m).norm(), 1e-3 * s.f.norm())};
  PetscCheck(errors[0] < 1e-7 && errors[1] < 1e-6, PETSC_COMM_WORLD, PETSC_ERR_PLIB,
             "the errors of x and lambda are %g and %g", errors[0], errors[1]);
  PetscCall(VecDestroy(&rhs));
  PetscCall(VecDestroy(&sol));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Loop(const char name[], void (*make)(Saddle &), bool none)
{
  Saddle   s;
  Mat      blocks[4], nest;
  KSP      ksp;
  Column   x, lambda;
  PetscInt step = 0, iterations, changes = 1;

  PetscFunctionBeginUser;
  make(s);
  const Eigen::Index m        = s.B.rows();
  const PetscInt     local[2] = {Share((PetscInt)s.A.rows(), s.bs), Share((PetscInt)m, 1)};
  std::vector<char>  active((size_t)m, none ? 0 : 1), first;

  const Matrix unit = Matrix::Identity(m, m);

  s.C = s.B;
  PetscCall(RandomFill(PETSC_COMM_WORLD, s.A.cast<PetscScalar>(), local[0], local[0], s.bs, false, &blocks[0]));
  PetscCall(
    RandomFill(PETSC_COMM_WORLD, s.B.transpose().cast<PetscScalar>(), local[0], local[1], 1, false, &blocks[1]));
  PetscCall(RandomFill(PETSC_COMM_WORLD, s.C.cast<PetscScalar>(), local[1], local[0], 1, false, &blocks[2]));
  PetscCall(RandomFill(PETSC_COMM_WORLD, unit.cast<PetscScalar>(), local[1], local[1], 1, false, &blocks[3]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  for (; changes && step < most; step++) {
    SetRows(s, active);
    PetscCall(SetValues(blocks[2], s.C, s.B));
    PetscCall(SetValues(blocks[3], -s.D, unit));
    PetscCall(Step(ksp, nest, s, x, lambda, &iterations));
    changes               = 0;
    const Vector distance = s.B * x.real() - s.g;
    if (!step) first = active;
    for (Eigen::Index i = 0; i < m; i++) {
      const char now = PetscRealPart(lambda[i]) + 10.0 * distance[i] > 0.0;

      changes += now != active[(size_t)i];
      active[(size_t)i] = now;
    }
    PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                          "%s step %" PetscInt_FMT ": %d active, %" PetscInt_FMT " change, %" PetscInt_FMT
                          " iterations\n",
                          name, step, (int)std::count(active.begin(), active.end(), 1), changes, iterations));
  }
  PetscCheck(!changes, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "%s: the active set does not settle", name);
  PetscCheck(step > 2 && first != active && std::count(active.begin(), active.end(), 1) &&
               std::count(active.begin(), active.end(), 0),
             PETSC_COMM_WORLD, PETSC_ERR_PLIB, "%s: nothing was to be found", name);
  const Vector distance = s.B * x.real() - s.g;
  for (Eigen::Index i = 0; i < m; i++)
    PetscCheck(distance[i] < 1e-7 && PetscRealPart(lambda[i]) > -1e-7 * s.f.cwiseAbs().maxCoeff(), PETSC_COMM_WORLD,
               PETSC_ERR_PLIB, "%s: row %d pulls, or overlaps", name, (int)i);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: found in %" PetscInt_FMT " steps\n", name, step));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  for (Mat &M : blocks) PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscOptionsSetValue(NULL, "-ainsworth_ksp_rtol", "1e-10"));
  for (bool none : {false, true}) {
    PetscCall(Loop(none ? "obstacle, none active" : "obstacle, all active", Obstacle, none));
    PetscCall(Loop(none ? "contact, none active" : "contact, all active", Contact, none));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "active sets: found\n"));
  PetscCall(PetscFinalize());
  return 0;
}
