static char help[] = "Multigrid gives way to a factorization where that takes less time, and only there: against a "
                     "direct solver.\n\n";

#include "dense.h"

/*
   Two displacements on each node of a grid of n x n cells. A cell has the energy of its edges, times `edges`, and
   `stiffness` times the square of its change of volume, for which multigrid is slow. Nodes on the left are held, those
   on the right have the same horizontal displacement
*/
static PetscErrorCode Assemble(PetscInt n, PetscReal stiffness, PetscReal edges, Mat A)
{
  PetscInt rstart, rend;

  PetscFunctionBeginUser;
  PetscCall(MatZeroEntries(A));
  PetscCall(MatGetOwnershipRange(A, &rstart, &rend));
  for (PetscInt cell = 0; cell < n * n; cell++) {
    const PetscInt i = cell % n, j = cell / n,
                   corner[4] = {j * (n + 1) + i, j * (n + 1) + i + 1, (j + 1) * (n + 1) + i, (j + 1) * (n + 1) + i + 1};
    const PetscReal volume[8] = {-0.5, -0.5, 0.5, -0.5, -0.5, 0.5, 0.5, 0.5};
    PetscScalar     K[8][8];

    for (int a = 0; a < 8; a++)
      for (int b = 0; b < 8; b++) {
        const bool diagonal = a / 2 + b / 2 == 3; /* of the cell */

        K[a][b] = stiffness * volume[a] * volume[b] + edges * (a % 2 != b % 2 ? 0.0
                                                               : a == b       ? 1.0
                                                               : diagonal     ? 0.0
                                                                              : -0.5);
      }
    for (int a = 0; a < 8; a++) {
      const PetscInt row = 2 * corner[a / 2] + a % 2;

      for (int b = 0; b < 8 && row >= rstart && row < rend && corner[a / 2] % (n + 1); b++) {
        const PetscInt column = 2 * corner[b / 2] + b % 2;

        if (corner[b / 2] % (n + 1)) PetscCall(MatSetValue(A, row, column, K[a][b], ADD_VALUES));
        else PetscCall(MatSetValue(A, row, column, 0.0, ADD_VALUES));
      }
    }
  }
  for (PetscInt row = rstart; row < rend; row++)
    if ((row / 2) % (n + 1) == 0) PetscCall(MatSetValue(A, row, row, 1.0 + stiffness, ADD_VALUES));
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

struct Grid {
  Mat A, C, nest;
  KSP ksp;
  PC  inner;
};

static PetscErrorCode GridCreate(PetscInt n, PetscReal stiffness, Grid *grid)
{
  const PetscInt nodes = (n + 1) * (n + 1);
  PetscInt       local = PETSC_DECIDE, all = nodes, rstart, rend;
  Mat            Ct, blocks[4];
  PC             pc;
  KSP            reduced;

  PetscFunctionBeginUser;
  PetscCall(PetscSplitOwnership(PETSC_COMM_WORLD, &local, &all));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, 2 * local, 2 * local, 2 * nodes, 2 * nodes, 18, NULL, 18, NULL, &grid->A));
  PetscCall(MatSetBlockSize(grid->A, 2));
  PetscCall(Assemble(n, stiffness, 1.0, grid->A));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, 2 * local, n, 2 * nodes, 2, NULL, 2, NULL, &grid->C));
  PetscCall(MatGetOwnershipRange(grid->C, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscCall(MatSetValue(grid->C, i, 2 * ((i + 1) * (n + 1) + n), 1.0, INSERT_VALUES));
    PetscCall(MatSetValue(grid->C, i, 2 * (i * (n + 1) + n), -1.0, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(grid->C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(grid->C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatTranspose(grid->C, MAT_INITIAL_MATRIX, &Ct));
  blocks[0] = grid->A;
  blocks[1] = Ct;
  blocks[2] = grid->C;
  blocks[3] = NULL;
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &grid->nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(SolverCreate(grid->nest, &grid->ksp));
  PetscCall(KSPGetPC(grid->ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &reduced));
  PetscCall(KSPGetPC(reduced, &grid->inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GridDestroy(Grid *grid)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&grid->ksp));
  PetscCall(MatDestroy(&grid->nest));
  PetscCall(MatDestroy(&grid->C));
  PetscCall(MatDestroy(&grid->A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves for a solution that is known */
static PetscErrorCode SolveKnown(const char *what, const Grid &grid, bool transpose)
{
  Vec                x, y, b;
  PetscReal          norm, error;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("%s", what);
  PetscCall(MatCreateVecs(grid.nest, &x, &b));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(SetRandom(x, 7));
  PetscCall(MatMult(grid.nest, x, b)); /* which is symmetric */
  PetscCall(transpose ? KSPSolveTranspose(grid.ksp, b, y) : KSPSolve(grid.ksp, b, y));
  PetscCall(KSPGetConvergedReason(grid.ksp, &reason));
  PetscCall(CheckTrue("converged", reason > 0));
  PetscCall(VecNorm(x, NORM_2, &norm));
  PetscCall(VecAXPY(y, -1.0, x));
  PetscCall(VecNorm(y, NORM_2, &error));
  PetscCall(Check("the error of x and lambda", error / norm, 1e-5));
  for (Vec *v : {&x, &y, &b}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Is M_* factored then, in few iterations? */
static PetscErrorCode Solve(const char *what, const Grid &grid, bool transpose, bool factored)
{
  const PetscInt few = 8;
  PetscInt       iterations;
  PetscBool      is;
  KSP            reduced;
  PC             pc;
  std::string    view;

  PetscFunctionBeginUser;
  PetscCall(SolveKnown(what, grid, transpose));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)grid.inner, &is, PCCHOLESKY, PCLU, ""));
  PetscCall(CheckInt("a factorization", is, factored));
  PetscCall(KSPGetPC(grid.ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &reduced));
  PetscCall(KSPGetIterationNumber(reduced, &iterations));
  PetscCall(CheckTrue(factored ? "few iterations" : "more iterations", (iterations <= few) == factored));
  PetscCall(ViewText(grid.ksp, view));
  PetscCall(CheckTrue("what the view says of it",
                      (view.find("preconditioning matrix factored") != std::string::npos) == factored));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where multigrid is quick it stays; where it is slow it gives way in the first solve, and does so no more */
static PetscErrorCode Sequence()
{
  const PetscInt  n    = 36;
  const PetscReal soft = 1.0, stiff = 1e3;
  Options         options("-ainsworth_ksp_rtol 1e-12 -pc_ainsworth_rebuild always");
  Grid            grid, other;
  PetscInt        before, after;

  PetscFunctionBeginUser;
  PetscCall(GridCreate(n, soft, &grid));
  PetscCall(Solve("multigrid is quick", grid, false, false));
  PetscCall(Assemble(n, stiff, 1.0, grid.A));
  PetscCall(Solve("it is slow with other values", grid, false, true));
  PetscCall(EventCount("BlockSALevels", &before));
  PetscCall(Solve("the same again", grid, false, true));
  PetscCall(Assemble(n, 2 * stiff, 3.0, grid.A));
  PetscCall(Solve("other values, the choice is kept", grid, false, true));
  PetscCall(Solve("the transpose", grid, true, true));
  PetscCall(KSPReset(grid.ksp));
  PetscCall(KSPSetOperators(grid.ksp, grid.nest, grid.nest));
  PetscCall(Solve("after KSPReset()", grid, false, true));
  PetscCall(EventCount("BlockSALevels", &after));
  PetscCall(CheckInt("levels of multigrid made since", after - before, 0));
  PetscCall(GridCreate(n - 8, soft, &other));
  PetscCall(KSPReset(grid.ksp));
  PetscCall(KSPSetOperators(grid.ksp, other.nest, other.nest));
  std::swap(grid.nest, other.nest);
  PetscCall(Solve("another matrix, for which multigrid is tried again", grid, false, false));
  std::swap(grid.nest, other.nest);
  PetscCall(GridDestroy(&other));
  PetscCall(KSPReset(grid.ksp));
  PetscCall(KSPSetOperators(grid.ksp, grid.nest, grid.nest));
  {
    Options chosen("-ainsworth_pc_type blocksa");
    PetscCall(KSPSetFromOptions(grid.ksp));
    PetscCall(Solve("the options choose multigrid", grid, false, false));
  }
  PetscCall(GridDestroy(&grid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_HAVE_SUITESPARSE) && !defined(PETSC_USE_COMPLEX)
/*
   CHOLMOD gets an ordering of the nodes, unless the program chooses one, or the type by a call; another one for another
   matrix of the same size
*/
static PetscErrorCode Ordering(bool call, const char *given, const char *expected)
{
  const PetscInt n = 20, nodes = (n + 1) * (n + 1), stride = 100; /* no divisor in common with nodes */
  Options options(std::string("-ainsworth_ksp_rtol 1e-12 ") + (call ? "" : "-ainsworth_pc_type cholesky ") + given);
  Grid    grid;
  Mat     A, C, Ct, nest;
  IS      rows, order;
  std::vector<PetscInt> numbers;
  std::string           view;

  PetscFunctionBeginUser;
  PetscCall(GridCreate(n, 1.0, &grid));
  if (call) PetscCall(PCSetType(grid.inner, PCCHOLESKY));
  for (bool renumbered : {false, true}) {
    PetscCall(SolveKnown(renumbered ? "the nodes in another order" : "an ordering", grid, false));
    PetscCall(ViewText(grid.ksp, view));
    PetscCall(CheckText("the view", view.c_str(), {"package used to perform factorization: cholmod", expected}));
    if (renumbered) break;
    for (PetscInt i = 0; i < nodes; i++) numbers.push_back(i * stride % nodes);
    PetscCall(ISCreateBlock(PETSC_COMM_SELF, 2, nodes, numbers.data(), PETSC_COPY_VALUES, &order));
    PetscCall(ISCreateStride(PETSC_COMM_SELF, n, 0, 1, &rows));
    PetscCall(MatPermute(grid.A, order, order, &A));
    PetscCall(MatPermute(grid.C, rows, order, &C));
    PetscCall(MatTranspose(C, MAT_INITIAL_MATRIX, &Ct));
    PetscCall(NestCreate(A, Ct, C, NULL, false, &nest));
    PetscCall(KSPSetOperators(grid.ksp, nest, nest));
    for (IS *is : {&rows, &order}) PetscCall(ISDestroy(is));
    for (Mat *mat : {&Ct, &grid.A, &grid.C, &grid.nest}) PetscCall(MatDestroy(mat));
    grid.A    = A;
    grid.C    = C;
    grid.nest = nest;
  }
  PetscCall(GridDestroy(&grid));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif

/*
   A small system is factored at once; where that is not possible multigrid says what is wrong, as it does where it is
   chosen
*/
static PetscErrorCode Small()
{
  const PetscInt     n = 8;
  Options            options("-ainsworth_ksp_rtol 1e-12");
  Grid               grid;
  Vec                x, b;
  Vec                left;
  PetscReal          norms[2];
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(GridCreate(n, 1.0, &grid));
  PetscCall(Solve("a small system", grid, false, true));
  Case("an indefinite one, by GMRES");
  PetscCall(Assemble(n, 1.0, -1.0, grid.A));
  PetscCall(MatCreateVecs(grid.nest, &x, &b));
  PetscCall(SetRandom(b, 3));
  PetscCall(KSPSolve(grid.ksp, b, x));
  PetscCall(KSPGetConvergedReason(grid.ksp, &reason));
  PetscCall(CheckTrue("solved", reason > 0));
  PetscCall(VecDuplicate(b, &left));
  PetscCall(MatMult(grid.nest, x, left));
  PetscCall(VecAXPY(left, -1.0, b));
  PetscCall(VecNorm(left, NORM_2, &norms[0]));
  PetscCall(VecNorm(b, NORM_2, &norms[1]));
  PetscCall(Check("residual", norms[0] / norms[1], 1e-9));
  PetscCall(VecDestroy(&left));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&b));
  PetscCall(GridDestroy(&grid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_HAVE_HYPRE)
/*
   Where neither a factorization nor what takes its place will do, the failure says why: a matrix with a negative
   diagonal entry, which is not symmetric
*/
static PetscErrorCode Neither()
{
  const PetscInt     n = 20;
  Options            options("-ainsworth_ksp_divtol 1e-3"); /* every solve diverges */
  Mat                A, C, nest;
  KSP                ksp;
  PC                 pc;
  Vec                x, b;
  PetscInt           rstart, rend;
  KSPConvergedReason reason;
  const char        *why;

  PetscFunctionBeginUser;
  Case("neither a factorization nor multigrid");
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, 3, NULL, 3, NULL, &A));
  PetscCall(MatGetOwnershipRange(A, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscCall(MatSetValue(A, i, i, i == 5 ? -4.0 : 4.0, INSERT_VALUES));
    if (i) PetscCall(MatSetValue(A, i, i - 1, -1.5, INSERT_VALUES));
    if (i + 1 < n) PetscCall(MatSetValue(A, i, i + 1, -0.5, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatGetLocalSize(A, &rend, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, rend, 1, n, 2, NULL, 2, NULL, &C));
  for (PetscInt j : {0, 19}) PetscCall(MatSetValue(C, 0, j, j ? -1.0 : 1.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(C, MAT_FINAL_ASSEMBLY));
  PetscCall(NestCreate(A, NULL, C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(MatCreateVecs(nest, &x, &b));
  PetscCall(VecSet(b, 1.0));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue("refused", reason < 0));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCall(CheckText("the failure", why, {"DIVERGED_DTOL"}));
  for (Vec *v : {&x, &b}) PetscCall(VecDestroy(v));
  PetscCall(KSPDestroy(&ksp));
  for (Mat *mat : {&nest, &A, &C}) PetscCall(MatDestroy(mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif

/*
   Where block smoothed aggregation does not fit, another multigrid takes its place: for pairs of nodes, whose three
   modes are more than half of their unknowns, or a network between any nodes, in which all are soon neighbors of all
*/
static PetscErrorCode OtherMultigrid(bool network)
{
  const PetscInt n = 27, nodes = (n + 1) * (n + 1), most = 100;
  Options        options("-ainsworth_ksp_rtol 1e-12");
  Grid           grid;
  Mat            A;
  Vec            coordinates;
  MatNullSpace   modes;
  PetscInt       local, rstart, rend;
  PetscMPIInt    size;
  PetscBool      is;

  PetscFunctionBeginUser;
  PetscCall(GridCreate(n, 1.0, &grid));
  PetscCall(MatGetLocalSize(grid.A, &local, NULL));
  PetscCall(MatGetOwnershipRange(grid.A, &rstart, &rend));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, local, local, 2 * nodes, 2 * nodes, most, NULL, most, NULL, &A));
  PetscCall(MatSetBlockSize(A, 2));
  for (PetscInt i = 0; i < nodes; i++) {
    for (PetscInt k = 0; k < (network ? 2 : 1); k++) {
      const PetscInt j = network ? (PetscInt)((0.5 + 0.5 * Uniform(5, i, k)) * nodes) : i ^ 1;

      for (PetscInt d = 0; d < 2 && i != j; d++)
        for (PetscInt a : {2 * i + d, 2 * j + d})
          for (PetscInt b : {2 * i + d, 2 * j + d})
            if (a >= rstart && a < rend) PetscCall(MatSetValue(A, a, b, a == b ? 1.0 : -1.0, ADD_VALUES));
    }
    /* the ground couples both directions: no mode is a null vector of more rows than another */
    for (PetscInt a : {2 * i, 2 * i + 1})
      for (PetscInt b : {2 * i, 2 * i + 1})
        if (a >= rstart && a < rend) PetscCall(MatSetValue(A, a, b, a == b ? 0.2 : 0.1, ADD_VALUES));
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateVecs(A, &coordinates, NULL));
  PetscCall(VecSetBlockSize(coordinates, 2));
  PetscCall(SetRandom(coordinates, 6));
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, &modes));
  PetscCall(VecDestroy(&coordinates));
  PetscCall(MatSetNearNullSpace(A, modes));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(MatNestSetSubMat(grid.nest, 0, 0, A));
  PetscCall(MatDestroy(&grid.A));
  grid.A = A;
  PetscCall(SolveKnown(network ? "a network" : "pairs of nodes", grid, false));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)grid.inner, &is, PCHYPRE, PCGAMG, ""));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  /* on more ranks the next level goes to fewer */
  if (size < 3) PetscCall(CheckInt("another multigrid", is, PETSC_TRUE));
  PetscCall(GridDestroy(&grid));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int         code;
  PetscMPIInt size;

  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  if (size == 1 || PetscDefined(HAVE_MUMPS)) { /* which alone factors on several ranks */
    PetscCall(Sequence());
    PetscCall(Small());
#if defined(PETSC_HAVE_HYPRE)
    PetscCall(Neither());
#endif
  }
#if defined(PETSC_HAVE_SUITESPARSE) && !defined(PETSC_USE_COMPLEX)
  if (size == 1) {
    PetscCall(Ordering(false, "", "matrix ordering: ainsworthpredicted"));
    PetscCall(Ordering(false, "-ainsworth_pc_factor_mat_ordering_type rcm", "matrix ordering: rcm"));
    PetscCall(Ordering(true, "", "matrix ordering: external"));
  }
#endif
  for (bool network : {false, true}) PetscCall(OtherMultigrid(network));
  PetscCall(ChecksFinish(&code));
  PetscCall(PetscFinalize());
  return code;
}
