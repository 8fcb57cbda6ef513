/* Input that cannot be used, made on purpose: each message names the block, the row, the value or the option */
#include "situations.h"

static System sys; /* a good system, made bad in one point at a time */

/* Sets up PCAINSWORTH on this matrix, which is destroyed, and expects an error */
static PetscErrorCode Refused(const std::string &what, Mat mat, PetscErrorCode code, const Parts &parts)
{
  KSP ksp;

  PetscFunctionBeginUser;
  Case("%s", what.c_str());
  PetscCall(SolverCreate(mat, &ksp));
  PetscCall(CheckError(
    what.c_str(), [ksp]() { return KSPSetUp(ksp); }, code, parts));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An m x n AIJ with ones where the row and the column agree modulo n */
static Mat Ones(PetscInt m, PetscInt n, bool filled = true, PetscInt lm = PETSC_DECIDE, PetscInt ln = PETSC_DECIDE)
{
  PetscInt start, end;
  Mat      mat;

  PetscCallAbort(PETSC_COMM_WORLD, MatCreateAIJ(PETSC_COMM_WORLD, lm, ln, m, n, 1, NULL, 1, NULL, &mat));
  PetscCallAbort(PETSC_COMM_WORLD, MatGetOwnershipRange(mat, &start, &end));
  for (PetscInt i = start; i < end && filled; i++)
    PetscCallAbort(PETSC_COMM_WORLD, MatSetValue(mat, i, i % n, 1.0, INSERT_VALUES));
  PetscCallAbort(PETSC_COMM_WORLD, MatAssemblyBegin(mat, MAT_FINAL_ASSEMBLY));
  PetscCallAbort(PETSC_COMM_WORLD, MatAssemblyEnd(mat, MAT_FINAL_ASSEMBLY));
  return mat;
}

static Mat Nest(PetscInt rows, PetscInt columns, const std::vector<Mat> &blocks)
{
  Mat nest;

  PetscCallAbort(PETSC_COMM_WORLD, MatCreateNest(PETSC_COMM_WORLD, rows, NULL, columns, NULL, blocks.data(), &nest));
  return nest;
}

static Mat Saddled(Mat A, Mat Ct, Mat C, Mat D, bool first = false)
{
  Mat nest;

  PetscCallAbort(PETSC_COMM_WORLD, NestCreate(A, Ct, C, D, first, &nest));
  return nest;
}

static Vec Long(PetscInt N, PetscInt n = PETSC_DECIDE)
{
  Vec v;

  PetscCallAbort(PETSC_COMM_WORLD, VecCreateMPI(PETSC_COMM_WORLD, n, N, &v));
  PetscCallAbort(PETSC_COMM_WORLD, VecSet(v, 1.0));
  return v;
}

/* Ones, but for an entry */
static Vec Bad(Vec like, PetscInt entry, PetscScalar value)
{
  Vec v;

  PetscCallAbort(PETSC_COMM_WORLD, VecDuplicate(like, &v));
  PetscCallAbort(PETSC_COMM_WORLD, VecSet(v, 1.0));
  PetscCallAbort(PETSC_COMM_WORLD, VecSetValue(v, entry, value, INSERT_VALUES));
  PetscCallAbort(PETSC_COMM_WORLD, VecAssemblyBegin(v));
  PetscCallAbort(PETSC_COMM_WORLD, VecAssemblyEnd(v));
  return v;
}

/* The MatNest is not [A C'; C 0] */
static PetscErrorCode Blocks()
{
  Mat              Z, T, Ct, empty, nest;
  std::vector<Mat> parts;
  PetscInt         m, n;
  Run              run;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(sys.C, &m, &n));
  PetscCall(MatCreateTranspose(sys.C, &T));
  PetscCall(MatTranspose(sys.C, MAT_INITIAL_MATRIX, &Ct));
  Z     = Ones(PETSC_DETERMINE, PETSC_DETERMINE, false, n, n);
  empty = Ones(PETSC_DETERMINE, PETSC_DETERMINE, false, m, m);
  PetscCall(PetscObjectReference((PetscObject)sys.A));
  PetscCall(Refused("no saddle point", sys.A, PETSC_ERR_ARG_WRONG,
                    {"no saddle point", "aij", "every diagonal entry is positive", "PCFieldSplitSetIS()"}));
  PetscCall(Refused("3 x 3 blocks", Nest(3, 3, {sys.A, NULL, NULL, NULL, sys.A, NULL, NULL, NULL, sys.A}),
                    PETSC_ERR_ARG_WRONG, {"no multipliers", "all 3 fields", "-pc_ainsworth_multiplier_fields"}));
  for (bool first : {false, true}) {
    const std::string C = first ? "Block (0,1)" : "Block (1,0)";

    PetscCall(Refused("no primal block", Saddled(Z, T, sys.C, NULL, first), PETSC_ERR_ARG_WRONG,
                      {"no primal block", "(0,0) and (1,1)"}));
    PetscCall(
      Refused("no constraints", Saddled(sys.A, NULL, NULL, empty, first), PETSC_ERR_ARG_WRONG, {C, "is absent"}));
    PetscCall(MatGetOwnershipRange(sys.C, &m, &n));
    nest = Saddled(sys.A, T, sys.C, NULL, first);
    for (PetscInt i = m; i < n; i++)
      PetscCall(MatSetValue(sys.C, i, 12 + 2 * i, 0.0, ADD_VALUES)); /* an entry that is there */
    PetscCall(Refused("block not assembled", nest, PETSC_ERR_ARG_WRONGSTATE, {C, "not assembled"}));
    PetscCall(MatAssemblyBegin(sys.C, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(sys.C, MAT_FINAL_ASSEMBLY));
  }
  {
    Options options("-pc_ainsworth_multiplier_fields 1");

    PetscCall(
      Refused("no A", Nest(2, 2, {NULL, T, sys.C, NULL}), PETSC_ERR_ARG_WRONG, {"Block (0,0)", "A, is absent"}));
  }
  {
    Options options("-pc_ainsworth_multiplier_rows 24-29");

    PetscCall(Refused("rows of a MatNest", Nest(2, 2, {sys.A, T, sys.C, NULL}), PETSC_ERR_ARG_WRONG,
                      {"-pc_ainsworth_multiplier_rows names rows of one matrix", "-pc_ainsworth_multiplier_fields"}));
  }
  PetscCall(Refused("C in the place of C', nothing below", Nest(2, 2, {sys.A, sys.C, NULL, Z}), PETSC_ERR_ARG_SIZ,
                    {"Block (0,1)", "it looks like C, which belongs in the block below A"}));
  {
    Options options("-pc_ainsworth_multiplier_fields 0");

    PetscCall(Refused("the option names A", Nest(2, 2, {sys.A, T, sys.C, NULL}), PETSC_ERR_ARG_WRONG,
                      {"Block (1,1)", "A, is absent", "-pc_ainsworth_multiplier_fields", "does it name those of x?"}));
  }
  /* C itself, and not its transpose, beside A; below it C, or its transpose */
  for (bool below : {false, true}) {
    const Parts said = below ? Parts{"Block (1,0) of the MatNest, C, has 5 columns, A has 24",
                                     "it looks like C', which belongs in the block beside A"}
                             : Parts{"Block (0,1) of the MatNest, C', is 5 x 24, not 24 x 5: it is C, or of its size",
                                     "pass its transpose"};

    Mat blocks[] = {sys.A, sys.C, below ? Ct : sys.C, NULL};

    Case("C in the place of C', C' below %d", below);
    PetscCall(CheckError(
      "C in the place of C'",
      [&]() -> PetscErrorCode {
        PetscFunctionBeginUser;
        PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &run.nest));
        PetscCall(SolverCreate(run.nest, &run.ksp));
        PetscCall(KSPSetUp(run.ksp));
        PetscFunctionReturn(PETSC_SUCCESS);
      },
      PETSC_ERR_ARG_SIZ, said));
  }
  for (Mat mat : {T, Ct, Z, empty}) PetscCall(MatDestroy(&mat));
  /* 6 x 7 for A in a nest that is square, and more columns of blocks than rows, 9 x 9 */
  parts = {Ones(6, 7), Ones(6, 2), Ones(3, 7), Ones(3, 2, false)};
  PetscCall(Refused("A not square", Nest(2, 2, parts), PETSC_ERR_ARG_SIZ, {"Block (0,0)", "6 x 7"}));
  PetscCall(Refused("matrix not square", parts[0], PETSC_ERR_ARG_SIZ, {"matrix is not square: 6 x 7"}));
  for (int k = 1; k < 4; k++) PetscCall(MatDestroy(&parts[k]));
  parts.clear();
  for (PetscInt k = 0; k < 6; k++) parts.push_back(Ones(k < 3 ? 6 : 3, 4 - k % 3));
  PetscCall(Refused("2 x 3 blocks", Nest(2, 3, parts), PETSC_ERR_ARG_SIZ,
                    {"MatNest has 2 x 3 blocks", "as many rows of blocks as columns"}));
  for (Mat &part : parts) PetscCall(MatDestroy(&part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block, or a part of one, of many unknowns has no entries */
static PetscErrorCode Shells()
{
  Mat A = Ones(1200, 1200), C = Ones(1, 1200), shell, shellC, parts, composite;

  PetscFunctionBeginUser;
  PetscCall(ShellCreate(A, true, false, &shell));
  PetscCall(ShellCreate(C, false, false, &shellC));
  PetscCall(MatCreateComposite(PETSC_COMM_WORLD, 1, &A, &composite));
  parts = Nest(1, 1, {shell});
  for (Mat block : {shell, parts, composite}) {
    const std::string what = block == shell   ? "has type shell"
                             : block == parts ? "has a part of type shell"
                                              : "has type composite";

    PetscCall(Refused(what, Saddled(block, NULL, C, NULL), PETSC_ERR_SUP,
                      {"Block (0,0) of the MatNest, A, " + what, "1200 products", "MATAIJ"}));
  }
  for (const std::string place : {"(1,0)", "(0,1)"})
    PetscCall(Refused("C", Saddled(A, NULL, shellC, NULL, place == "(0,1)"), PETSC_ERR_SUP,
                      {"Block " + place + " of the MatNest, C, has type shell", "1200 products"}));
  for (Mat mat : {A, C, shell, shellC, parts, composite}) PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options that are refused when they are read, or at the solve */
static PetscErrorCode OptionRefused(const std::string &line, PetscErrorCode code, const Parts &parts,
                                    PetscInt reference = 0)
{
  PetscFunctionBeginUser;
  PetscCall(Row(line, Spec(), "", {[=](Live &s) -> PetscErrorCode {
                  PetscFunctionBeginUser;
                  if (reference) {
                    Vec v = Long(reference);

                    PetscCall(PCAinsworthSetReference(s.pc, v));
                    PetscCall(VecDestroy(&v));
                  }
                  PetscCall(CheckError(
                    "refused",
                    [&]() -> PetscErrorCode {
                      PetscFunctionBeginUser;
                      PetscCall(Reread(line)(s));
                      PetscCall(s.Solve());
                      PetscFunctionReturn(PETSC_SUCCESS);
                    },
                    code, parts));
                  PetscFunctionReturn(PETSC_SUCCESS);
                }}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options, and what the program tells of A, that do not fit */
static PetscErrorCode Choices()
{
  const Vec              negative = Bad(sys.w, 5, -2.0), longer = Long(25);
  std::vector<PetscReal> x;
  PetscInt               m, n;
  PetscBool              given;
  Spec                   spec;
  const std::string      stop = "-ainsworth_pc_type jacobi -pc_ainsworth_stop energy_error ";

  PetscFunctionBeginUser;
  for (const std::string line :
       {"-pc_ainsworth_penalty_factor -3", "-pc_ainsworth_penalty_factor 0", "-pc_ainsworth_penalty_factor inf",
        "-pc_ainsworth_penalty_factor nan", "-pc_ainsworth_pmat_rtol 3", "-pc_ainsworth_pmat_rtol 0",
        "-pc_ainsworth_pmat_rtol 1", "-pc_ainsworth_blocks -5", "-pc_ainsworth_blocks 0",
        "-pc_ainsworth_rows_per_rank 0", "-pc_ainsworth_rows_per_rank -3", "-pc_ainsworth_block_size 0",
        "-pc_ainsworth_rate 0", "-pc_ainsworth_message -1"}) {
    const std::string name = line.substr(0, line.find(' ')), value = line.substr(line.find(' ') + 1);

    if (PETSC_VERSION_GE(3, 19, 0) &&
        (value == "inf" || value == "nan")) /* a later PETSc refuses them itself, in its words */
      PetscCall(OptionRefused(line, PETSC_ERR_ARG_OUTOFRANGE, {}));
    else PetscCall(OptionRefused(line, PETSC_ERR_ARG_OUTOFRANGE, {name, "not " + value}));
  }
  PetscCall(OptionRefused("-pc_ainsworth_error_rtol 1e-3", PETSC_ERR_ARG_INCOMP,
                          {"-pc_ainsworth_error_rtol has no effect without -pc_ainsworth_stop energy_error"}));
  for (const std::string value : {"0", "1", "-1e-6"})
    PetscCall(OptionRefused("-pc_ainsworth_error_rtol " + value, PETSC_ERR_ARG_OUTOFRANGE,
                            {"-pc_ainsworth_error_rtol", value == "1" ? "less than 1" : "positive"}));
  for (const std::string value : {"0", "-2"})
    PetscCall(OptionRefused("-pc_ainsworth_error_eigenvalue " + value, PETSC_ERR_ARG_OUTOFRANGE,
                            {"-pc_ainsworth_error_eigenvalue", "positive", value}));
  for (const std::string value : {"foo", "csvfile", "binary:file"})
    PetscCall(OptionRefused("-pc_ainsworth_monitor_error " + value, PETSC_ERR_ARG_WRONG,
                            {"-pc_ainsworth_monitor_error", value, "csv[:file]"}));
  PetscCall(OptionRefused("-ainsworth_pc_type jacobi -pc_ainsworth_monitor_error csv:refused.csv", PETSC_ERR_ARG_SIZ,
                          {"has 7 entries", "29", "24", "-pc_ainsworth_reference"}, 7));
  PetscCall(OptionRefused(stop + "-ainsworth_ksp_type gmres", PETSC_ERR_SUP, {"energy_error", "gmres", "projectedcg"}));
  PetscCall(OptionRefused(stop + "-pc_ainsworth_variant paper -ainsworth_ksp_norm_type unpreconditioned", PETSC_ERR_SUP,
                          {"energy_error", "UNPRECONDITIONED", "-ksp_norm_type natural"}));
  PetscCall(OptionRefused(stop + "-pc_ainsworth_variant paper -ainsworth_ksp_cg_single_reduction", PETSC_ERR_SUP,
                          {"-ksp_cg_single_reduction"}));
  PetscCall(Row("a solve that is too short has no estimate", Spec(), stop + "-ainsworth_ksp_max_it 1",
                {[](Live &s) { return s.Solve(); },
                 [](Live &s) {
                   return CheckError("estimate", [&]() { return PCAinsworthGetErrorEstimate(s.pc, NULL, NULL, NULL); },
                                     PETSC_ERR_ARG_WRONGSTATE, {"too short"});
                 }}));
  PetscCall(MatGetLocalSize(sys.C, &m, &n));
  n += m + 1;
  x.resize(2 * n);
  PetscCall(Row("weight user without a vector", Spec(), "-pc_ainsworth_weight user",
                {SetUpRaised(PETSC_ERR_ARG_WRONGSTATE, {"-pc_ainsworth_weight user", "PCAinsworthSetWeight()"})}));
  PetscCall(Row("one node more than rows", Spec(), "-pc_ainsworth_block_size 2",
                {[&](Live &s) { return PCSetCoordinates(s.pc, 2, n, x.data()); },
                 SetUpRaised(PETSC_ERR_ARG_SIZ, {"PCSetCoordinates()", std::to_string(n) + " nodes", "Block (0,0)"})}));
  PetscCall(Row("a negative weight, and one that is too long", Spec(), "",
                {[=](Live &s) { return PCAinsworthSetWeight(s.pc, negative); },
                 SetUpRaised(PETSC_ERR_ARG_OUTOFRANGE, {"Entry 5 of the weight is -2"}),
                 [=](Live &s) { return PCAinsworthSetWeight(s.pc, longer); },
                 SetUpRaised(PETSC_ERR_ARG_SIZ, {"length 25", "columns of A are 24"})}));
  for (Vec v : {negative, longer}) PetscCall(VecDestroy(&v));
  spec.uneven = true; /* the factorization of S fails on ranks with rows of it: rank 1 has none */
  PetscCall(Row("ordering of S", spec,
                "-ainsworth_gram_pc_type lu -ainsworth_gram_pc_factor_mat_ordering_type ainsworthpredicted",
                {SetUpRaised(PETSC_ERR_ORDER, {"ainsworthpredicted is for factorizations that the plugin chooses"})}));
#if defined(PETSC_HAVE_HYPRE)
  PetscCall(Row("a norm", Spec(), "-ainsworth_pc_type hypre -ainsworth_ksp_norm_type unheard",
                {SetUpRaised(PETSC_ERR_USER, {"unheard", "ksp_norm_type"})}));
  PetscCall(PetscOptionsHasName(NULL, "ainsworth_", "-pc_hypre_boomeramg_P_max", &given));
  PetscCall(CheckTrue("our defaults for BoomerAMG are no options of the program", !given));
#else
  (void)given;
#endif
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
  Case("a PC or a Mat of another type");
  PetscCall(PCCreate(PETSC_COMM_WORLD, &pc));
  for (const std::string type : {"(not set)", "type none"}) {
    if (type == "type none") PetscCall(PCSetType(pc, PCNONE));
    for (const std::function<PetscErrorCode()> &getter : std::vector<std::function<PetscErrorCode()>>{
           [&]() { return PCAinsworthGetKSP(pc, &ksp); }, [&]() { return PCAinsworthGetGramKSP(pc, &ksp); },
           [&]() { return PCAinsworthGetFailure(pc, &why); },
           [&]() { return PCAinsworthGetErrorEstimate(pc, NULL, NULL, NULL); }})
      PetscCall(CheckError("a getter", getter, PETSC_ERR_ARG_WRONG, {type, "not ainsworth"}));
  }
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(CheckError("Gram solver before set-up", [&]() { return PCAinsworthGetGramKSP(pc, &ksp); }, PETSC_ERR_ORDER,
                       {"PCSetUp()"}));
  PetscCall(PCDestroy(&pc));
  const std::vector<std::function<PetscErrorCode()>> functions = {
    [&]() { return MatAinsworthSetMats(A, A, sys.C); },
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
    PetscCall(CheckError(("function " + std::to_string(k)).c_str(), functions[k], PETSC_ERR_ARG_WRONG,
                         {"aij, not ainsworth", "no projector", "MatCreateAinsworth()"}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bad blocks and settings of MATAINSWORTH */
static PetscErrorCode Operator()
{
  const Parts noBlocks = {"no A and C", "MatAinsworthSetMats()"};
  Mat         S, dense, G, wide = Ones(24, 25);
  PetscInt    m, n;
  PetscMPIInt rank, size;
  Vec         longer = Long(25), weight = Bad(sys.w, 3, 0.0), penalty = Bad(sys.g, 3, 0.0), v;

  PetscFunctionBeginUser;
  Case("MATAINSWORTH");
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(MatGetLocalSize(sys.C, &m, &n));
  PetscCall(MatCreate(PETSC_COMM_WORLD, &S));
  PetscCall(MatSetSizes(S, n, n, PETSC_DETERMINE, PETSC_DETERMINE)); /* later PETScs want them before any operation */
  PetscCall(MatSetType(S, MATAINSWORTH));
  PetscCall(MatConvert(sys.C, MATDENSE, MAT_INITIAL_MATRIX, &dense));
  const auto wrong = [](const char *what, PetscErrorCode code, const Parts &parts,
                        const std::function<PetscErrorCode()> &call) { return CheckError(what, call, code, parts); };

  PetscCall(wrong("no blocks", PETSC_ERR_ARG_WRONGSTATE, noBlocks,
                  [&]() { return MatAinsworthMultProjector(S, sys.w, longer); }));
  PetscCall(wrong("MatDuplicate() without blocks", PETSC_ERR_ARG_WRONGSTATE, noBlocks,
                  [&]() { return MatDuplicate(S, MAT_COPY_VALUES, &G); }));
  PetscCall(wrong("weight before the blocks", PETSC_ERR_ARG_WRONGSTATE,
                  {"MatAinsworthSetMats()", "MatAinsworthSetWeight()"},
                  [&]() { return MatAinsworthSetWeight(S, sys.w); }));
  PetscCall(wrong("penalty before the blocks", PETSC_ERR_ARG_WRONGSTATE,
                  {"MatAinsworthSetMats()", "MatAinsworthSetPenalty()"},
                  [&]() { return MatAinsworthSetPenalty(S, sys.g); }));
  PetscCall(wrong("weight user without a vector", PETSC_ERR_ARG_WRONGSTATE, {"MatAinsworthSetWeight()"},
                  [&]() { return MatAinsworthSetWeightType(S, MAT_AINSWORTH_WEIGHT_USER); }));
  PetscCall(wrong("A not square", PETSC_ERR_ARG_SIZ, {"A is not square", "24 x 25"},
                  [&]() { return MatAinsworthSetMats(S, wide, sys.C); }));
  PetscCall(wrong("columns of C", PETSC_ERR_ARG_SIZ, {"C has 25 columns", "A has 24"},
                  [&]() { return MatAinsworthSetMats(S, sys.A, wide); }));
  PetscCall(wrong("type of C", PETSC_ERR_ARG_WRONG, {"C has type", "dense", "MatConvert()"},
                  [&]() { return MatAinsworthSetMats(S, sys.A, dense); }));
  if (size > 1) { /* another layout on two ranks */
    PetscCall(MatDestroy(&wide));
    wide = Ones(PETSC_DETERMINE, 24, true, m, rank ? n - (rank == 1) : n + 1);
    PetscCall(wrong("layout of C", PETSC_ERR_ARG_SIZ, {"local columns", "column layout of A"},
                    [&]() { return MatAinsworthSetMats(S, sys.A, wide); }));
  }
  PetscCall(MatAinsworthSetMats(S, sys.A, sys.C));
  PetscCall(wrong("length of the weight", PETSC_ERR_ARG_SIZ, {"weight has length 25", "columns of A are 24"},
                  [&]() { return MatAinsworthSetWeight(S, longer); }));
  PetscCall(wrong("length of the penalty", PETSC_ERR_ARG_SIZ, {"penalty has length 25", "rows of C are 5"},
                  [&]() { return MatAinsworthSetPenalty(S, longer); }));
  PetscCall(wrong("weight 0", PETSC_ERR_ARG_OUTOFRANGE, {"Entry 3 of the weight is 0"},
                  [&]() { return MatAinsworthSetWeight(S, weight); }));
  PetscCall(wrong("penalty 0", PETSC_ERR_ARG_OUTOFRANGE, {"Entry 3 of the penalty is 0"},
                  [&]() { return MatAinsworthSetPenalty(S, penalty); }));
  PetscCall(wrong("f in place", PETSC_ERR_ARG_IDN, {"f and rhs"},
                  [&]() { return MatAinsworthComputeRHS(S, sys.f, sys.g, sys.f); }));
  for (PetscInt length : {24, 5})
    if (size > 1) {
      v = Long(PETSC_DETERMINE, rank ? 0 : length);
      PetscCall(wrong("layout of the weight or the penalty", PETSC_ERR_ARG_SIZ,
                      {"not laid out over the ranks", length == 24 ? "columns of A" : "rows of C"},
                      [&]() { return length == 24 ? MatAinsworthSetWeight(S, v) : MatAinsworthSetPenalty(S, v); }));
      PetscCall(VecDestroy(&v));
    }
  for (Vec *vec : {&longer, &weight, &penalty}) PetscCall(VecDestroy(vec));
  for (Mat *mat : {&S, &dense, &wide}) PetscCall(MatDestroy(mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Refusals()
{
  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, Spec(), &sys));
  for (auto table : {Blocks, Shells, OtherTypes, Operator, Choices}) PetscCall(table());
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}
