static char help[] = "Every error message of the plugin, reached on purpose: each names the block, the row, the value or the option.\n\n";

#include "dense.h"

static System sys; /* a good system, made bad in one point at a time */

/* Sets up PCAINSWORTH on this matrix and expects an error */
static PetscErrorCode ExpectSetUp(const char *what, Mat mat, PetscErrorCode code, const std::vector<std::string> &parts)
{
  KSP ksp;

  PetscFunctionBeginUser;
  PetscCall(SolverCreate(mat, &ksp));
  PetscCall(CheckError(
    what, [ksp]() { return KSPSetUp(ksp); }, code, parts));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An m x n AIJ with ones where the row and the column agree modulo the smaller size, laid out as given; PETSC_DECIDE for the local sizes */
static PetscErrorCode Ones(PetscInt lm, PetscInt ln, PetscInt m, PetscInt n, bool filled, Mat *mat)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, lm, ln, m, n, 1, NULL, 1, NULL, mat));
  PetscCall(MatGetOwnershipRange(*mat, &start, &end));
  for (PetscInt i = start; i < end && filled; i++) PetscCall(MatSetValue(*mat, i, i % n, 1.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*mat, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*mat, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The MatNest is not [A C'; C 0] */
static PetscErrorCode Blocks()
{
  Mat      nest, Z, T, empty, wide, tall, blocks[9] = {NULL};
  PetscInt m, n, start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(sys.C, &m, &n));
  PetscCall(MatCreateTranspose(sys.C, &T));
  PetscCall(Ones(n, n, PETSC_DETERMINE, PETSC_DETERMINE, false, &Z));
  PetscCall(Ones(m, m, PETSC_DETERMINE, PETSC_DETERMINE, false, &empty));

  PetscCall(ExpectSetUp("no saddle point", sys.A, PETSC_ERR_ARG_WRONG, {"no saddle point", "aij", "every diagonal entry is positive", "PCFieldSplitSetIS()"}));
  blocks[0] = blocks[4] = blocks[8] = sys.A;
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 3, NULL, 3, NULL, blocks, &nest));
  PetscCall(ExpectSetUp("3 x 3 blocks", nest, PETSC_ERR_ARG_WRONG, {"no multipliers", "all 3 fields", "-pc_ainsworth_multiplier_fields"}));
  PetscCall(MatDestroy(&nest));
  for (bool first : {false, true}) {
    PetscCall(NestCreate(Z, T, sys.C, NULL, first, &nest));
    PetscCall(ExpectSetUp("no primal block", nest, PETSC_ERR_ARG_WRONG, {"no primal block", "(0,0) and (1,1)"}));
    PetscCall(MatDestroy(&nest));
    PetscCall(NestCreate(sys.A, NULL, NULL, empty, first, &nest));
    PetscCall(ExpectSetUp("no constraints", nest, PETSC_ERR_ARG_WRONG, {first ? "Block (0,1)" : "Block (1,0)", "is absent"}));
    PetscCall(MatDestroy(&nest));
    PetscCall(NestCreate(sys.A, T, sys.C, NULL, first, &nest));
    PetscCall(MatGetOwnershipRange(sys.C, &start, &end));
    for (PetscInt i = start; i < end; i++) PetscCall(MatSetValue(sys.C, i, 12 + 2 * i, 0.0, ADD_VALUES)); /* an entry that is there */
    PetscCall(ExpectSetUp("block not assembled", nest, PETSC_ERR_ARG_WRONGSTATE, {first ? "Block (0,1)" : "Block (1,0)", "not assembled"}));
    PetscCall(MatAssemblyBegin(sys.C, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(sys.C, MAT_FINAL_ASSEMBLY));
    PetscCall(MatDestroy(&nest));
  }
  PetscCall(NestCreate(sys.A, T, sys.C, NULL, false, &nest));
  PetscCall(MatGetOwnershipRange(sys.A, &start, &end));
  for (PetscInt i = start; i < end; i++) PetscCall(MatSetValue(sys.A, i, i, 0.0, ADD_VALUES));
  PetscCall(ExpectSetUp("A not assembled", nest, PETSC_ERR_ARG_WRONGSTATE, {"Block (0,0)", "not assembled"}));
  PetscCall(MatAssemblyBegin(sys.A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(sys.A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&T));
  PetscCall(MatDestroy(&Z));
  PetscCall(MatDestroy(&empty));

  /* 6 x 7 for A in a nest that is square, 9 x 9 */
  PetscCall(Ones(PETSC_DECIDE, PETSC_DECIDE, 6, 7, true, &wide));
  PetscCall(Ones(PETSC_DECIDE, PETSC_DECIDE, 3, 7, true, &tall));
  PetscCall(Ones(PETSC_DECIDE, PETSC_DECIDE, 3, 2, false, &Z));
  PetscCall(Ones(PETSC_DECIDE, PETSC_DECIDE, 6, 2, true, &T));
  Mat square[4] = {wide, T, tall, Z};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, square, &nest));
  PetscCall(ExpectSetUp("matrix not square", wide, PETSC_ERR_ARG_SIZ, {"matrix is not square: 6 x 7"}));
  PetscCall(ExpectSetUp("A not square", nest, PETSC_ERR_ARG_SIZ, {"Block (0,0)", "6 x 7"}));
  for (Mat *mat : {&nest, &wide, &tall, &Z, &T}) PetscCall(MatDestroy(mat));

  /* more columns of blocks than rows, 9 x 9 */
  Mat parts[6];
  for (PetscInt k = 0; k < 6; k++) PetscCall(Ones(PETSC_DECIDE, PETSC_DECIDE, k < 3 ? 6 : 3, 4 - k % 3, true, &parts[k]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 3, NULL, parts, &nest));
  PetscCall(ExpectSetUp("2 x 3 blocks", nest, PETSC_ERR_ARG_SIZ, {"MatNest has 2 x 3 blocks", "as many rows of blocks as columns"}));
  PetscCall(MatDestroy(&nest));
  for (Mat &part : parts) PetscCall(MatDestroy(&part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the program tells of A does not fit to it */
static PetscErrorCode Told()
{
  Mat                    nest, T;
  KSP                    ksp;
  PC                     pc;
  PetscInt               n;
  std::vector<PetscReal> x;

  PetscFunctionBeginUser;
  PetscCall(MatCreateTranspose(sys.C, &T));
  Mat blocks[4] = {NULL, T, sys.C, NULL};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &nest));
  {
    Options options("-pc_ainsworth_multiplier_fields 1");
    PetscCall(ExpectSetUp("no A", nest, PETSC_ERR_ARG_WRONG, {"Block (0,0)", "A, is absent"}));
  }
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&T));
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  Options options("-pc_ainsworth_block_size 2");
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(MatGetLocalSize(nest, &n, NULL));
  x.resize(2 * (n + 1));
  PetscCall(PCSetCoordinates(pc, 2, n + 1, x.data()));
  PetscCall(CheckError("one node more than rows", [ksp]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_SIZ,
                       {"PCSetCoordinates()", std::to_string(n + 1) + " nodes", "Block (0,0)"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bad choices for PCAINSWORTH */
static PetscErrorCode Choices()
{
  Mat nest;
  KSP ksp, gram;
  PC  pc;
  Vec w, longer;

  PetscFunctionBeginUser;
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(CheckError("Gram solver before set-up", [&]() { return PCAinsworthGetGramKSP(pc, &gram); }, PETSC_ERR_ORDER, {"PCSetUp()"}));
  PetscCall(KSPDestroy(&ksp));

  for (const char *option :
       {"-pc_ainsworth_penalty_factor -3", "-pc_ainsworth_penalty_factor 0", "-pc_ainsworth_penalty_factor inf", "-pc_ainsworth_penalty_factor nan",
        "-pc_ainsworth_pmat_rtol 3", "-pc_ainsworth_pmat_rtol 0", "-pc_ainsworth_pmat_rtol 1", "-pc_ainsworth_blocks -5", "-pc_ainsworth_blocks 0",
        "-pc_ainsworth_rows_per_rank 0", "-pc_ainsworth_rows_per_rank -3", "-pc_ainsworth_block_size 0"}) {
    const std::string line(option), name = line.substr(0, line.find(' ')), value = line.substr(line.find(' ') + 1);
    const bool        other = PETSC_VERSION_GE(3, 19, 0) && (value == "inf" || value == "nan"); /* a later PETSc refuses them itself, in its words */
    Options           options(line);
    KSP               bad;

    PetscCall(CheckError(option, [&]() { return SolverCreate(nest, &bad); }, PETSC_ERR_ARG_OUTOFRANGE, {other ? "" : name, other ? "" : "not " + value}));
    PetscCall(KSPDestroy(&bad));
  }
  {
    Options options("-pc_ainsworth_weight user");
    PetscCall(ExpectSetUp("weight user without a vector", nest, PETSC_ERR_ARG_WRONGSTATE, {"-pc_ainsworth_weight user", "PCAinsworthSetWeight()"}));
  }
  PetscCall(VecDuplicate(sys.w, &w));
  PetscCall(VecCopy(sys.w, w));
  PetscCall(SetRandom(w, 3));
  PetscCall(VecShift(w, 1.5));
  PetscCall(VecSetValue(w, 5, -2.0, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(w));
  PetscCall(VecAssemblyEnd(w));
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, PETSC_DECIDE, 25, &longer));
  PetscCall(VecSet(longer, 1.0));
  for (Vec weight : {w, longer}) {
    PetscCall(SolverCreate(nest, &ksp));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCAinsworthSetWeight(pc, weight));
    if (weight == w) PetscCall(CheckError("negative weight", [=]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_OUTOFRANGE, {"Entry 5 of the weight is -2"}));
    else PetscCall(CheckError("weight too long", [=]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_SIZ, {"length 25", "columns of A are 24"}));
    PetscCall(KSPDestroy(&ksp));
  }
  PetscCall(VecDestroy(&w));
  PetscCall(VecDestroy(&longer));
  PetscCall(MatDestroy(&nest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factorization of S fails on ranks with rows of it: rank 1 has none */
static PetscErrorCode Factorization()
{
  Options options("-ainsworth_gram_pc_type lu -ainsworth_gram_pc_factor_mat_ordering_type ainsworthpredicted");
  Spec    spec;
  System  uneven;
  Mat     nest;

  PetscFunctionBeginUser;
  spec.uneven = true;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &uneven));
  PetscCall(NestCreate(uneven.A, NULL, uneven.C, NULL, false, &nest));
  PetscCall(ExpectSetUp("ordering of S", nest, PETSC_ERR_ORDER, {"ainsworthpredicted is for factorizations that the plugin chooses"}));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&uneven));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Getters on a PC, and functions on a Mat, of another type */
static PetscErrorCode OtherTypes()
{
  const Mat   A = sys.A;
  const Vec   f = sys.f, g = sys.g, w = sys.w;
  Mat         mat;
  KSP         ksp;
  PC          pc;
  const char *why;

  PetscFunctionBeginUser;
  PetscCall(PCCreate(PETSC_COMM_WORLD, &pc));
  const std::vector<std::function<PetscErrorCode()>> getters = {
    [&]() { return PCAinsworthGetKSP(pc, &ksp); }, [&]() { return PCAinsworthGetGramKSP(pc, &ksp); }, [&]() { return PCAinsworthGetFailure(pc, &why); },
    [&]() { return PCAinsworthGetErrorEstimate(pc, NULL, NULL, NULL); }};
  for (size_t k = 0; k < getters.size(); k++)
    PetscCall(CheckError(("getter " + std::to_string(k) + " without a type").c_str(), getters[k], PETSC_ERR_ARG_WRONG, {"(not set)", "not ainsworth"}));
  PetscCall(PCSetType(pc, PCNONE));
  for (size_t k = 0; k < getters.size(); k++)
    PetscCall(CheckError(("getter " + std::to_string(k)).c_str(), getters[k], PETSC_ERR_ARG_WRONG, {"type none", "not ainsworth"}));
  PetscCall(PCDestroy(&pc));

  const std::vector<std::function<PetscErrorCode()>> functions = {[&]() { return MatAinsworthSetMats(A, A, sys.C); },
                                                                  [&]() { return MatAinsworthGetMats(A, &mat, &mat); },
                                                                  [&]() { return MatAinsworthSetWeightType(A, MAT_AINSWORTH_WEIGHT_IDENTITY); },
                                                                  [&]() { return MatAinsworthSetWeight(A, w); },
                                                                  [&]() { return MatAinsworthSetPenalty(A, g); },
                                                                  [&]() { return MatAinsworthMultProjector(A, f, w); },
                                                                  [&]() { return MatAinsworthMultTransposeProjector(A, f, w); },
                                                                  [&]() { return MatAinsworthMultRightInverse(A, g, w); },
                                                                  [&]() { return MatAinsworthMultTransposeRightInverse(A, f, g); },
                                                                  [&]() { return MatAinsworthComputeRHS(A, f, g, w); },
                                                                  [&]() { return MatAinsworthComputeMultiplier(A, f, w, g); }};
  for (size_t k = 0; k < functions.size(); k++)
    PetscCall(
      CheckError(("function " + std::to_string(k)).c_str(), functions[k], PETSC_ERR_ARG_WRONG, {"aij, not ainsworth", "no projector", "MatCreateAinsworth()"}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bad blocks and settings of MATAINSWORTH */
static PetscErrorCode Operator()
{
  Mat         S, wide, dense, G;
  Vec         bad, longer;
  PetscInt    m, n;
  PetscMPIInt rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(MatGetLocalSize(sys.C, &m, &n));
  PetscCall(MatCreate(PETSC_COMM_WORLD, &S));
  PetscCall(MatSetSizes(S, n, n, PETSC_DETERMINE, PETSC_DETERMINE)); /* later PETScs want them before any operation */
  PetscCall(MatSetType(S, MATAINSWORTH));
  PetscCall(
    CheckError("no blocks", [&]() { return MatAinsworthMultProjector(S, sys.w, bad); }, PETSC_ERR_ARG_WRONGSTATE, {"no A and C", "MatAinsworthSetMats()"}));
  PetscCall(CheckError("MatDuplicate() without blocks", [&]() { return MatDuplicate(S, MAT_COPY_VALUES, &G); }, PETSC_ERR_ARG_WRONGSTATE,
                       {"no A and C", "MatAinsworthSetMats()"}));
  PetscCall(CheckError("weight before the blocks", [&]() { return MatAinsworthSetWeight(S, sys.w); }, PETSC_ERR_ARG_WRONGSTATE,
                       {"MatAinsworthSetMats()", "MatAinsworthSetWeight()"}));
  PetscCall(CheckError("penalty before the blocks", [&]() { return MatAinsworthSetPenalty(S, sys.g); }, PETSC_ERR_ARG_WRONGSTATE,
                       {"MatAinsworthSetMats()", "MatAinsworthSetPenalty()"}));
  PetscCall(CheckError("weight user without a vector", [&]() { return MatAinsworthSetWeightType(S, MAT_AINSWORTH_WEIGHT_USER); }, PETSC_ERR_ARG_WRONGSTATE,
                       {"MatAinsworthSetWeight()"}));

  PetscCall(Ones(PETSC_DECIDE, PETSC_DECIDE, 24, 25, true, &wide));
  PetscCall(CheckError("A not square", [&]() { return MatAinsworthSetMats(S, wide, sys.C); }, PETSC_ERR_ARG_SIZ, {"A is not square", "24 x 25"}));
  PetscCall(CheckError("columns of C", [&]() { return MatAinsworthSetMats(S, sys.A, wide); }, PETSC_ERR_ARG_SIZ, {"C has 25 columns", "A has 24"}));
  PetscCall(MatDestroy(&wide));
  if (size > 1) { /* another layout on two ranks */
    PetscCall(Ones(m, rank ? n - (rank == 1) : n + 1, PETSC_DETERMINE, 24, true, &wide));
    PetscCall(CheckError("layout of C", [&]() { return MatAinsworthSetMats(S, sys.A, wide); }, PETSC_ERR_ARG_SIZ, {"local columns", "column layout of A"}));
    PetscCall(MatDestroy(&wide));
  }
  PetscCall(MatConvert(sys.C, MATDENSE, MAT_INITIAL_MATRIX, &dense));
  PetscCall(CheckError("type of C", [&]() { return MatAinsworthSetMats(S, sys.A, dense); }, PETSC_ERR_ARG_WRONG, {"C has type", "dense", "MatConvert()"}));
  PetscCall(MatDestroy(&dense));

  PetscCall(MatAinsworthSetMats(S, sys.A, sys.C));
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, PETSC_DECIDE, 25, &longer));
  PetscCall(
    CheckError("length of the weight", [&]() { return MatAinsworthSetWeight(S, longer); }, PETSC_ERR_ARG_SIZ, {"weight has length 25", "columns of A are 24"}));
  PetscCall(
    CheckError("length of the penalty", [&]() { return MatAinsworthSetPenalty(S, longer); }, PETSC_ERR_ARG_SIZ, {"penalty has length 25", "rows of C are 5"}));
  PetscCall(VecDestroy(&longer));
  if (size > 1) {
    for (bool weight : {false, true}) {
      PetscCall(VecCreateMPI(PETSC_COMM_WORLD, rank ? 0 : weight ? 24 : 5, PETSC_DETERMINE, &bad));
      PetscCall(VecSet(bad, 1.0));
      PetscCall(CheckError("layout of the weight or the penalty", [&]() { return weight ? MatAinsworthSetWeight(S, bad) : MatAinsworthSetPenalty(S, bad); },
                           PETSC_ERR_ARG_SIZ, {"not laid out over the ranks", weight ? "columns of A" : "rows of C"}));
      PetscCall(VecDestroy(&bad));
    }
  }
  for (Vec like : {sys.w, sys.g}) {
    PetscCall(VecDuplicate(like, &bad));
    PetscCall(VecSet(bad, 1.0));
    PetscCall(VecSetValue(bad, 3, 0.0, INSERT_VALUES));
    PetscCall(VecAssemblyBegin(bad));
    PetscCall(VecAssemblyEnd(bad));
    if (like == sys.w)
      PetscCall(CheckError("weight 0", [&]() { return MatAinsworthSetWeight(S, bad); }, PETSC_ERR_ARG_OUTOFRANGE, {"Entry 3 of the weight is 0"}));
    else PetscCall(CheckError("penalty 0", [&]() { return MatAinsworthSetPenalty(S, bad); }, PETSC_ERR_ARG_OUTOFRANGE, {"Entry 3 of the penalty is 0"}));
    PetscCall(VecDestroy(&bad));
  }
  PetscCall(CheckError("f in place", [&]() { return MatAinsworthComputeRHS(S, sys.f, sys.g, sys.f); }, PETSC_ERR_ARG_IDN, {"f and rhs"}));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_HAVE_HYPRE)
/* After an error in an option of the inner solver, our defaults for BoomerAMG are no options of the program */
static PetscErrorCode Defaults()
{
  Mat       nest;
  PetscBool given;

  PetscFunctionBeginUser;
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  {
    Options options("-ainsworth_pc_type hypre -ainsworth_ksp_norm_type unheard");
    PetscCall(ExpectSetUp("a norm", nest, PETSC_ERR_USER, {"unheard", "ksp_norm_type"}));
  }
  PetscCall(PetscOptionsHasName(NULL, "ainsworth_", "-pc_hypre_boomeramg_P_max", &given));
  PetscCall(CheckTrue("no option is left", !given));
  PetscCall(MatDestroy(&nest));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(SystemCreate(PETSC_COMM_WORLD, Spec(), &sys));
  Case("errors");
  PetscCall(Blocks());
  PetscCall(Told());
  PetscCall(Choices());
  PetscCall(Factorization());
  PetscCall(OtherTypes());
  PetscCall(Operator());
#if defined(PETSC_HAVE_HYPRE)
  PetscCall(Defaults());
#endif
  PetscCall(SystemDestroy(&sys));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
