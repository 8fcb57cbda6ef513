static char help[] = "What PCBLOCKSA rebuilds when its matrix, the added part, modes or choices change, alone and in "
                     "PCAINSWORTH.\n\n";

#include "lattice.h"
#include "layout.h"
#include <cstring>
#include <memory>

/* Solves with a random right-hand side; levels: were those of A made anew? */
static PetscErrorCode Solve(KSP ksp, const char *what, bool levels, PetscInt *iterations = NULL)
{
  Mat                M;
  Vec                b, x, r;
  PetscReal          norm, residual;
  PetscInt           before, after;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("%s", what);
  PetscCall(KSPGetOperators(ksp, &M, NULL));
  PetscCall(MatCreateVecs(M, &x, &b));
  PetscCall(VecDuplicate(b, &r));
  PetscCall(SetRandom(b, 7));
  PetscCall(EventCount("BlockSAAggreg", &before));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(EventCount("BlockSAAggreg", &after));
  PetscCall(CheckTrue(levels ? "levels made anew" : "levels kept", levels == (after > before)));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckInt("reason", reason, KSP_CONVERGED_RTOL));
  PetscCall(MatResidual(M, b, x, r));
  PetscCall(MatGetDiagonal(M, x)); /* soft and stiff unknowns count alike */
  PetscCall(VecSqrtAbs(x));
  PetscCall(VecPointwiseDivide(r, r, x));
  PetscCall(VecPointwiseDivide(b, b, x));
  PetscCall(VecNorm(b, NORM_2, &norm));
  PetscCall(VecNorm(r, NORM_2, &residual));
  PetscCall(Check("residual", residual / norm, 1e-6));
  if (iterations) PetscCall(KSPGetIterationNumber(ksp, iterations));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Assemble(Mat mat)
{
  PetscFunctionBeginUser;
  PetscCall(MatAssemblyBegin(mat, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(mat, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A fresh solver needs as many iterations as one that kept what it could */
static PetscErrorCode CheckFresh(Mat M, PetscInt iterations)
{
  KSP      ksp;
  PetscInt fresh;

  PetscFunctionBeginUser;
  PetscCall(MultigridCreate(M, &ksp));
  PetscCall(Solve(ksp, "fresh", true, &fresh));
  PetscCall(CheckInt("iterations", iterations, fresh));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The near null space without its last vector */
static PetscErrorCode FewerModes(Mat A)
{
  MatNullSpace near;
  PetscInt     n;
  const Vec   *v;

  PetscFunctionBeginUser;
  PetscCall(MatGetNearNullSpace(A, &near));
  PetscCall(MatNullSpaceGetVecs(near, NULL, &n, &v));
  PetscCall(MatNullSpaceCreate(PetscObjectComm((PetscObject)A), PETSC_FALSE, n - 1, v, &near));
  PetscCall(MatSetNearNullSpace(A, near));
  PetscCall(MatNullSpaceDestroy(&near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Another object with the values of A is A; one with another entry is not, whichever rank has it */
static PetscErrorCode SameValues(KSP ksp, const Lattice &l, Mat A)
{
  Mat         copy;
  PetscInt    first;
  PetscScalar value = 0;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(Assemble(A));
  PetscCall(Solve(ksp, "A assembled again", false));
  PetscCall(MatDuplicate(A, MAT_COPY_VALUES, &copy));
  PetscCall(LatticeSetNearNullSpace(l, copy));
  PetscCall(KSPSetOperators(ksp, copy, copy));
  PetscCall(Solve(ksp, "a copy with a near null space of its own", false));
  PetscCall(MatScale(copy, 1.0 + 4 * PETSC_MACHINE_EPSILON));
  PetscCall(Solve(ksp, "rounding", false));
  PetscCall(MatGetOwnershipRange(copy, &first, NULL));
  if (!rank) PetscCall(MatGetValue(copy, first, first, &value));
  if (!rank) PetscCall(MatSetValue(copy, first, first, 1e-6 * value, ADD_VALUES));
  PetscCall(Assemble(copy));
  PetscCall(Solve(ksp, "one entry", true));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(Solve(ksp, "and back", true));
  PetscCall(MatDestroy(&copy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Changes(bool single)
{
  auto    options = std::make_unique<Options>(single ? "-pc_blocksa_precision single" : "-pc_blocksa_precision double");
  Lattice l;
  Mat     A, D, M, other;
  KSP     ksp;
  PC      pc;
  PetscInt               its;
  std::vector<PetscReal> x;

  PetscFunctionBeginUser;
  l.n      = 5;
  l.layers = 10;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(LatticeSetNearNullSpace(l, A));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(Solve(ksp, "first", true));
  PetscCall(Solve(ksp, "again", false));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(Solve(ksp, "the same operators again", false));
  PetscCall(MatScale(A, 7.0));
  PetscCall(Solve(ksp, "A changed in place", true));
  PetscCall(FewerModes(A));
  PetscCall(Assemble(A));
  PetscCall(Solve(ksp, "another near null space", true));
  PetscCall(LatticeSetNearNullSpace(l, A));
  PetscCall(Assemble(A));
  PetscCall(Solve(ksp, "all modes again", true));
  PetscCall(SameValues(ksp, l, A));
  PetscCall(LatticeCoordinates(l, A, x));
  PetscCall(PCSetCoordinates(pc, 3, (PetscInt)x.size() / 3, x.data()));
  PetscCall(Assemble(A));
  PetscCall(Solve(ksp, "coordinates", true));

  PetscCall(SurfaceCreate(l, A, 1.0, 6, &D));
  PetscCall(SumCreate(A, D, &M));
  PetscCall(KSPSetOperators(ksp, M, M));
  PetscCall(Solve(ksp, "a part added to A", false, &its));
  PetscCall(CheckFresh(M, its));
  PetscCall(MatScale(D, 1e4));
  PetscCall(Assemble(M));
  PetscCall(Solve(ksp, "the added part changed", false, &its));
  PetscCall(CheckFresh(M, its));
  PetscCall(MatDestroy(&D));
  PetscCall(SurfaceCreate(l, A, 30.0, 9, &D));
  PetscCall(SumCreate(A, D, &other));
  PetscCall(KSPSetOperators(ksp, other, other));
  PetscCall(Solve(ksp, "another added part", false, &its));
  PetscCall(CheckFresh(other, its));
  PetscCall(FewerModes(A)); /* the program sets up anew for the sum: what it was made of counts, though A is the same */
  PetscCall(Assemble(other));
  PetscCall(Solve(ksp, "another near null space, the same A", true));
  PetscCall(PCSetCoordinates(pc, 3, (PetscInt)x.size() / 3, x.data()));
  PetscCall(Assemble(other));
  PetscCall(Solve(ksp, "other coordinates, the same A", true));
  {
    Options choice("-pc_blocksa_coarse_eq_limit 150");
    PetscCall(KSPSetFromOptions(ksp));
    PetscCall(Assemble(other));
    PetscCall(Solve(ksp, "another choice, the same A", true));
    PetscCall(Assemble(other));
    PetscCall(Solve(ksp, "neither", false));
  }
  {
    Options choice("-pc_blocksa_coarse_eq_limit 600");
    PetscCall(KSPSetFromOptions(ksp));
    PetscCall(Assemble(other));
    PetscCall(Solve(ksp, "and back", true));
  }
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(Solve(ksp, "nothing added", false, &its));
  PetscCall(CheckFresh(A, its));
  PetscCall(MatDestroy(&other));
  PetscCall(MatDestroy(&M));
  PetscCall(MatDestroy(&D));

  { /* another number of levels, another precision */
    Options choice("-pc_blocksa_coarse_eq_limit 30");
    PetscCall(KSPSetFromOptions(ksp));
    PetscCall(Assemble(A));
    PetscCall(Solve(ksp, "more levels", true));
  }
  {
    Options choice("-pc_blocksa_coarse_eq_limit 2000");
    PetscCall(KSPSetFromOptions(ksp));
    PetscCall(Assemble(A));
    PetscCall(Solve(ksp, "one level", false, &its));
    PetscCall(CheckTrue("one iteration", its <= 2));
    PetscCall(PCMGGetLevels(pc, &its));
    PetscCall(CheckInt("levels", its, 1));
  }
  options.reset();
  {
    Options choice(std::string("-pc_blocksa_coarse_eq_limit 200 -pc_blocksa_precision ") +
                   (single ? "double" : "single"));
    PetscCall(KSPSetFromOptions(ksp));
    PetscCall(Assemble(A));
    PetscCall(Solve(ksp, "another precision", true));
  }
  PetscCall(KSPReset(ksp));
  PetscCall(KSPReset(ksp));
  PetscCall(PCSetCoordinates(pc, 0, 0, NULL));
  PetscCall(MatDestroy(&A));
  l.layers = 12;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(Solve(ksp, "another size, after a reset", true));
  PetscCall(PCSetType(pc, PCJACOBI));
  PetscCall(PCSetType(pc, PCBLOCKSA));
  PetscCall(Solve(ksp, "another type, and back", true));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(KSPDestroy(&ksp)); /* never set up */
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values that jump too far for single precision come, and go */
static PetscErrorCode Jump()
{
  Lattice     l;
  Mat         A[2];
  KSP         ksp, smoother;
  PC          pc;
  PetscInt    levels;
  std::string text;

  PetscFunctionBeginUser;
  l.n      = 5;
  l.layers = 10;
  l.layout = Lattice::LAST; /* single precision looks at neighbors on the same rank */
  for (int k = 0; k < 2; k++) {
    l.contrast = k ? 1e10 : 1.0;
    PetscCall(LatticeCreate(l, &A[k]));
    PetscCall(LatticeSetNearNullSpace(l, A[k]));
  }
  PetscCall(MultigridCreate(A[0], &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  for (int k : {0, 1, 0}) {
    PetscBool same;

    PetscCall(KSPSetOperators(ksp, A[k], A[k]));
    PetscCall(Solve(ksp, k ? "a jump" : "no jump", true));
    PetscCall(PCMGGetLevels(pc, &levels));
    PetscCall(PCMGGetSmoother(pc, levels - 1, &smoother));
    PetscCall(PetscObjectTypeCompare((PetscObject)smoother, k ? KSPCHEBYSHEV : KSPCHEBYSHEVSINGLE, &same));
    PetscCall(CheckTrue("smoother", same));
    PetscCall(ViewText(ksp, text));
    PetscCall(CheckText("KSPView()", text,
                        {k ? "levels in double precision, as values jump too far" : "levels in single precision;"}));
  }
  PetscCall(KSPDestroy(&ksp));
  for (Mat &mat : A) PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* m rows that tie unknowns below to unknowns above the middle */
static PetscErrorCode Ties(const Lattice &l, Mat A, PetscInt m, Mat *C)
{
  PetscInt       n, start, end;
  const PetscInt layer = l.nodes() / l.layers * l.bs, middle = l.layers / 2 * layer;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, n, m, l.nodes() * l.bs, 2, NULL, 2, NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscCall(MatSetValue(*C, i, middle - layer + i, 1.0, INSERT_VALUES));
    PetscCall(MatSetValue(*C, i, middle + i, -1.0, INSERT_VALUES));
  }
  PetscCall(Assemble(*C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves with A and sys->C, which is given up, by a solver that may exist; anew: are levels of A made? */
static PetscErrorCode CheckStep(System *sys, bool anew, KSP *ksp)
{
  Mat         nest;
  DenseSystem d;
  PetscInt    before, after;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(sys->C, NULL, &sys->g));
  PetscCall(SetRandom(sys->g, 4));
  PetscCall(NestCreate(sys->A, NULL, sys->C, NULL, false, &nest));
  PetscCall(VecDuplicate(sys->f, &sys->w));
  PetscCall(Gather(*sys, d));
  if (*ksp) {
    PetscCall(KSPReset(*ksp));
    PetscCall(KSPSetOperators(*ksp, nest, nest));
  } else PetscCall(SolverCreate(nest, ksp));
  PetscCall(EventCount("BlockSAAggreg", &before));
  PetscCall(CheckSolution(*ksp, *sys, d, false, false, 1e-8));
  PetscCall(EventCount("BlockSAAggreg", &after));
  PetscCall(CheckTrue(anew ? "levels made" : "levels kept", anew == (after > before)));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&sys->C));
  PetscCall(VecDestroy(&sys->g));
  PetscCall(VecDestroy(&sys->w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A's levels outlive a KSPReset() and another number of constraints */
static PetscErrorCode Constraints(bool near)
{
  Options options("-ainsworth_pc_type blocksa -ainsworth_pc_blocksa_coarse_eq_limit 60 -ainsworth_ksp_rtol 1e-11");
  Lattice l;
  System  sys;
  KSP     ksp = NULL;

  PetscFunctionBeginUser;
  l.n     = 3;
  l.apart = true;
  PetscCall(LatticeCreate(l, &sys.A));
  if (near) PetscCall(LatticeSetNearNullSpace(l, sys.A));
  PetscCall(MatCreateVecs(sys.A, &sys.f, NULL));
  PetscCall(SetRandom(sys.f, 3));
  for (PetscInt m : {9, 20, 12, 0, 5}) {
    Case("%d constraints, %s near null space", (int)m, near ? "with" : "without");
    PetscCall(Ties(l, sys.A, m, &sys.C));
    PetscCall(CheckStep(&sys, m == 9, &ksp));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A with a further node on the last rank that has no stiffness */
static PetscErrorCode Extend(const Lattice &l, Mat A, Mat *extended)
{
  PetscMPIInt rank, size;
  PetscInt    n, start, end;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  if (rank == size - 1) n += l.bs;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, n, n, PETSC_DETERMINE, PETSC_DETERMINE, 81, NULL, 81, NULL, extended));
  PetscCall(MatSetBlockSize(*extended, l.bs));
  PetscCall(MatGetOwnershipRange(A, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    const PetscInt    *columns;
    const PetscScalar *values;
    PetscInt           count;

    PetscCall(MatGetRow(A, i, &count, &columns, &values));
    PetscCall(MatSetValues(*extended, 1, &i, count, columns, values, INSERT_VALUES));
    PetscCall(MatRestoreRow(A, i, &count, &columns, &values));
  }
  PetscCall(Assemble(*extended));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ten nodes, every other one from a first one on, that move as the node without stiffness, in units of 1 / scale */
static PetscErrorCode Spider(const Lattice &l, Mat A, PetscInt node, PetscScalar scale, Mat *C)
{
  PetscInt n, start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, n, 10 * l.bs, PETSC_DETERMINE, 2, NULL, 2, NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscCall(MatSetValue(*C, i, (node + 2 * (i / l.bs)) * l.bs + i % l.bs, scale, INSERT_VALUES));
    PetscCall(MatSetValue(*C, i, l.nodes() * l.bs + i % l.bs, -scale, INSERT_VALUES));
  }
  PetscCall(Assemble(*C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node that follows others is made to follow again where its rows tie it to others */
static PetscErrorCode Followers()
{
  static const struct {
    PetscInt    node;
    PetscScalar scale;
    bool        anew;
  } steps[] = {
    {9,  1.0, true },
    {9,  3.0, false},
    {30, 3.0, true }
  };
  Options options("-ainsworth_pc_type blocksa -ainsworth_pc_blocksa_coarse_eq_limit 60 -ainsworth_ksp_rtol 1e-11");
  Lattice l;
  System  sys;
  Mat     A;
  KSP     ksp = NULL;

  PetscFunctionBeginUser;
  l.n = 3;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(Extend(l, A, &sys.A));
  PetscCall(MatDestroy(&A));
  PetscCall(MatCreateVecs(sys.A, &sys.f, NULL));
  PetscCall(SetRandom(sys.f, 3));
  for (const auto &step : steps) {
    std::string text;

    Case("a spider from node %d on, scaled by %g", (int)step.node, (double)PetscRealPart(step.scale));
    PetscCall(Spider(l, sys.A, step.node, step.scale, &sys.C));
    PetscCall(CheckStep(&sys, step.anew, &ksp));
    PetscCall(ViewText(ksp, text));
    PetscCall(CheckText("KSPView()", text, {"with 3 unknowns carried, those of 0 nodes to all levels"}));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All constraints are released in place, and come back: the levels do not stay in a kernel that is gone */
static PetscErrorCode Release()
{
  Options     options("-ainsworth_pc_type blocksa -ainsworth_pc_blocksa_coarse_eq_limit 60 -ainsworth_ksp_rtol 1e-11");
  Lattice     l;
  System      sys;
  DenseSystem d;
  Mat         nest, values;
  KSP         ksp;
  Column      x, lambda;

  PetscFunctionBeginUser;
  Case("all constraints are released");
  l.n     = 3;
  l.apart = true;
  PetscCall(LatticeCreate(l, &sys.A));
  PetscCall(MatCreateVecs(sys.A, &sys.f, NULL));
  PetscCall(SetRandom(sys.f, 3));
  PetscCall(Ties(l, sys.A, 9, &sys.C));
  PetscCall(MatCreateVecs(sys.C, NULL, &sys.g));
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  PetscCall(VecDuplicate(sys.f, &sys.w));
  PetscCall(Gather(sys, d));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(CheckSolution(ksp, sys, d, false, false, 1e-8));
  PetscCall(MatDuplicate(sys.C, MAT_COPY_VALUES, &values));
  PetscCall(MatZeroEntries(sys.C));
  PetscCall(SolveFields(ksp, sys, false, false, x, lambda));
  PetscCall(CheckEqual("x without constraints", x, d.A.fullPivLu().solve(d.f), 1e-8));
  PetscCall(MatCopy(values, sys.C, SAME_NONZERO_PATTERN));
  PetscCall(CheckSolution(ksp, sys, d, false, false, 1e-8));
  PetscCall(KSPDestroy(&ksp));
  for (Mat *M : {&nest, &values}) PetscCall(MatDestroy(M));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The precision follows the method of PCAINSWORTH, back and forth */
static PetscErrorCode Precision()
{
  Options     options("-ainsworth_pc_type blocksa -ainsworth_pc_blocksa_coarse_eq_limit 60");
  Lattice     l;
  Mat         A, C, nest;
  Vec         x, b;
  KSP         ksp, inner;
  PC          pc;
  std::string text;

  PetscFunctionBeginUser;
  l.n     = 3;
  l.apart = true;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(Ties(l, A, 9, &C));
  PetscCall(NestCreate(A, NULL, C, NULL, false, &nest));
  PetscCall(MatCreateVecs(nest, &x, &b));
  PetscCall(SetRandom(b, 3));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  for (KSPType type : {KSPPROJECTEDCG, KSPPIPECG, KSPPROJECTEDCG}) {
    Case("precision with %s", type);
    PetscCall(KSPSetType(inner, type));
    PetscCall(MatScale(A, 2.0));
    PetscCall(KSPSolve(ksp, b, x));
    PetscCall(ViewText(ksp, text));
    PetscCall(CheckText("KSPView()", text,
                        {strcmp(type, KSPPIPECG) ? "levels in single precision;" : "levels in double precision"}));
  }
  PetscCall(KSPDestroy(&ksp));
  for (Vec *v : {&x, &b}) PetscCall(VecDestroy(v));
  for (Mat *mat : {&nest, &A, &C}) PetscCall(MatDestroy(mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscLogDefaultBegin());
  for (bool single : {false, true}) PetscCall(Changes(single));
  PetscCall(Jump());
  PetscCall(Precision());
  for (bool near : {false, true}) PetscCall(Constraints(near));
  PetscCall(Followers());
  PetscCall(Release());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
