/* What a solve leaves behind for the next, as matrices, options or vectors change, and what is kept on purpose */
#include "situations.h"

static Action Reset()
{
  return [](Live &s) { return KSPReset(s.ksp); };
}

static Action Reuse(PetscBool reuse)
{
  return [=](Live &s) { return KSPSetReusePreconditioner(s.ksp, reuse); };
}

static Action Renewed(const std::string &some)
{
  return [=](Live &s) { return s.Renew(some); };
}

/* GAMG and ML smooth with their first operator: this must be M_*: products with the reduced one take solves with S */
static PetscErrorCode FewGramSolves(Live &s)
{
  KSP      ksp;
  PC       pc;
  PetscInt levels, steps, before, after;

  PetscFunctionBeginUser;
  PetscCall(KSPSetUp(s.ksp));
  PetscCall(EventCount("AinsGramSolve", &before));
  PetscCall(Positive()(s));
  PetscCall(EventCount("AinsGramSolve", &after));
  PetscCall(PCAinsworthGetKSP(s.pc, &ksp));
  PetscCall(KSPGetIterationNumber(ksp, &steps));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCMGGetLevels(pc, &levels));
  PetscCall(CheckTrue("there is a finest level", levels > 1));
  PetscCall(CheckTrue("solves with S are counted", after > before));
  PetscCall(Check("solves with S", (PetscReal)(after - before), 2.0 * steps + 8.0)); /* C, C', R g and lambda */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Smoothers()
{
  PetscFunctionBeginUser;
  PetscCall(Row("smoothers of GAMG", SpringsCreate(100, 4, 1.0, 24),
                "-ainsworth_ksp_rtol 1e-8 -ainsworth_pc_type gamg -ainsworth_pc_gamg_coarse_eq_limit 8",
                {FewGramSolves}));
#if defined(PETSC_HAVE_ML)
  PetscCall(Row("smoothers of ML", SpringsCreate(100, 4, 1.0, 24),
                "-ainsworth_ksp_rtol 1e-8 -ainsworth_pc_type ml -ainsworth_pc_ml_maxCoarseSize 8", {FewGramSolves}));
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Mended()
{
  const std::string jacobi = "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 ";
  const Action      soft   = Edit([](Saddle &s) { s.A *= 1e-200, s.f *= 1e-200, s.g *= 0.0; });

  PetscFunctionBeginUser;
  /* a set-up that was refused, then the block mended in place: an outer method asks before it applies */
  PetscCall(Row("mended in place", SpringsCreate(20, 4, 1.0, 2), jacobi + "-ksp_type fgmres -ksp_rtol 1e-10",
                {Solved(), Edit([](Saddle &s) { s.C(1, 1) = NAN; }), Negative(), Original(), Solved()}, VIEW));
  /* the squares of f underflow: outer methods take it for zero, and x = 0 for the answer, without a look at A */
  for (const std::string outer : {"fgmres", "gcr"})
    PetscCall(Row("underflow, " + outer, SpringsCreate(20, 4, 1.0, 17),
                  jacobi + "-ksp_rtol 1e-10 -ksp_atol 0 -ksp_reuse_preconditioner -ksp_type " + outer,
                  {Solved(), soft, Failed({"takes the right-hand side for zero", "e-201", "-ksp_type preonly"}),
                   Edit([](Saddle &s) { s.A(2, 2) = NAN; }), Negative(), Original(), Solved()},
                  VIEW));
  /* a variant that is set brings its own method, whose norm and side are not those of the method before */
  PetscCall(Row("variant after another method", SpringsCreate(20, 4, 1.0, 6),
                "-ainsworth_ksp_type gmres -ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10",
                {Solved(), Reread("-pc_ainsworth_variant paper"), Solved()}));
  /* KSPSetFromOptions() after KSPReset() and a set-up that ended before it had an A; then the matrix again */
  PetscCall(Row("options without A", SpringsCreate(20, 4, 1.0, 10), jacobi,
                {Solved(), Reset(), [](Live &s) { return KSPSetOperators(s.ksp, s.sys.A, s.sys.A); },
                 SetUpRaised(PETSC_ERR_ARG_WRONG, {"pass a MatNest"}), [](Live &s) { return KSPSetFromOptions(s.ksp); },
                 Reset(), Renewed(""), Solved()}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At the second solve the program passes something else than a nest of two blocks */
static PetscErrorCode OtherMatrix(Live &s)
{
  Mat       whole, one;
  Vec       b, y, r;
  PetscReal residual, norm;

  PetscFunctionBeginUser;
  PetscCall(MatConvert(s.nest, MATAIJ, MAT_INITIAL_MATRIX, &whole));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 1, NULL, &whole, &one));
  PetscCall(MatCreateVecs(whole, &y, &b));
  PetscCall(SetRandom(b, 71));
  PetscCall(VecDuplicate(b, &r));
  for (Mat mat : {whole, one}) {
    PetscCall(KSPSetOperators(s.ksp, mat, mat));
    PetscCall(KSPSolve(s.ksp, b, y));
    PetscCall(MatMult(whole, y, r));
    PetscCall(VecAXPY(r, -1.0, b));
    PetscCall(VecNorm(b, NORM_2, &norm));
    PetscCall(VecNorm(r, NORM_2, &residual));
    PetscCall(Check("residual", residual, 1e-6 * norm));
  }
  PetscCall(KSPSetOperators(s.ksp, s.nest, s.nest));
  for (Vec v : {b, y, r}) PetscCall(VecDestroy(&v));
  for (Mat mat : {whole, one}) PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing is set up twice, however blocks are stored: some conversions of PETSc's raise the state of their input */
static PetscErrorCode Stored(const std::string &typeA, const std::string &typeC, const std::string &options)
{
  const Parts events = {"AinsGramMat", "AinsPMat"};
  Saddle      d      = SpringsCreate(24, 4, 1.0, 24);

  PetscFunctionBeginUser;
  if (typeC == MATAIJ) d.D = -0.1 * Dense::Identity(4, 4);
  PetscCall(Row("stored as " + typeA + " and " + typeC + ", " + options, d, options,
                {Counted(events), Positive(), Counted(events, 1), Positive(), Counted(events, 0)}, EXPLICIT,
                [=](Live &s) -> PetscErrorCode {
                  Mat nest;

                  PetscFunctionBeginUser;
                  PetscCall(MatSetOption(s.sys.A, MAT_SYMMETRIC, PETSC_TRUE));
                  PetscCall(MatConvert(s.sys.C, typeC.c_str(), MAT_INPLACE_MATRIX, &s.sys.C));
                  if (typeA != MATNEST) {
                    PetscCall(MatConvert(s.sys.A, typeA.c_str(), MAT_INPLACE_MATRIX, &s.sys.A));
                    PetscFunctionReturn(PETSC_SUCCESS);
                  }
                  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 1, NULL, &s.sys.A, &nest));
                  PetscCall(MatDestroy(&s.sys.A));
                  s.sys.A = nest;
                  PetscFunctionReturn(PETSC_SUCCESS);
                }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Sequences()
{
  const std::string jacobi  = "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10 ",
                    blocksa = "-ainsworth_pc_type blocksa -ainsworth_ksp_rtol 1e-10 ";
  const Parts pmat          = {"AinsPMat"};

  PetscFunctionBeginUser;
  /* the inner preconditioner is kept, never the constraints; A changes in place, C too, rows come and go */
  for (const std::string &options : {jacobi, jacobi + "-ainsworth_ksp_type gmres -pc_ainsworth_pmat jcb", blocksa}) {
    std::vector<Action> actions = {Solved(),      Reuse(PETSC_TRUE),
                                   Counted(pmat), Edit([](Saddle &s) { s.C *= 2.0, s.C(0, 12) = 0.7; }),
                                   Solved(),      Edit([](Saddle &s) { s.A *= 1.5; }),
                                   Solved()};

    for (PetscInt m : {7, 0, 3}) { /* another nest with other rows, of the same total length on each rank */
      const DenseSystem other = SpringsCreate(24, m, 1.5, 1);

      for (const Action &action :
           {Edit([=](Saddle &s) { s.C = other.C, s.g = other.g; }), Reset(), Renewed("C"), Solved(),
            Edit([](Saddle &s) { s.C.topRows(PetscMin(1, s.C.rows())) *= 3.0; }), Solved()})
        actions.push_back(action);
    }
    /* of three nests, one has no constraints; levels of blocksa get each surface, and are those of this A */
    for (const Action &action : {Counted(pmat, options == blocksa ? 6 : 2), Reuse(PETSC_FALSE), Solved(),
                                 Counted(pmat, options == blocksa ? 0 : 1)})
      actions.push_back(action);
    PetscCall(Row("reuse, " + options, SpringsCreate(24, 5, 1.0, 1), options, actions));
  }
  /* kept for another nest of the same sizes, or a C that changes in place: PETSc asks for no set-up */
  for (const std::string &options :
       {jacobi, std::string("-ainsworth_ksp_rtol 1e-10 -ainsworth_ksp_type gmres"), blocksa})
    for (bool inPlace : {false, true}) {
      std::vector<Action> actions = {Solved()};

      for (PetscInt k = 0; k < 3; k++)
        for (const Action &action : {Edit([=](Saddle &s) {
                                       s.C.row(k) *= 3.0;
                                       s.C(k, k) -= 0.5;
                                       if (k == 2)
                                         s.C.row(k).head(12).swap(s.C.row(k).tail(12)); /* other columns, too */
                                     }),
                                     inPlace ? Solved() : Both(Renewed("AC"), Solved())})
          actions.push_back(action);
      PetscCall(Row(std::string("kept for ") +
                      (inPlace ? "a C that changes in place, " : "another nest of the same sizes, ") + options,
                    SpringsCreate(24, 5, 1.0, 21), "-ksp_reuse_preconditioner " + options, actions));
    }
  /* the block (0,1) changes while A and C stay: in place, to that of C and back, and in another nest */
  for (const std::string reuse : {"", "-ksp_reuse_preconditioner"}) {
    Saddle d = SpringsCreate(24, 5, 1.0, 22);

    d.B = d.C;
    for (PetscInt i = 0; i < 5; i++) d.B(i, i) += 0.5 * Uniform(23, i, 0), d.B(i, 12) -= 0.3;
    PetscCall(Row("another B, " + reuse, d, "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 " + reuse,
                  {Right(1e-8), Edit([](Saddle &s) { s.B = s.C; }), Either(Equal(1e-8, true), nullptr, true),
                   Right(1e-8), Original(), Right(1e-8), Edit([](Saddle &s) { s.B *= 2.0; }), Right(1e-8),
                   Edit([](Saddle &s) { s.B -= s.C; }), Renewed("B"), Right(1e-8)},
                  EXPLICIT));
  }
  { /* the method that nobody chose follows */
    std::vector<Action> actions;

    for (bool symmetric : {true, false, true})
      for (const Action &action : {symmetric ? Original() : Edit([](Saddle &s) {
                                     s.A += 0.7 * Dense(s.A.triangularView<Eigen::StrictlyUpper>());
                                   }),
                                   Solved(), InnerType(symmetric ? KSPPROJECTEDCG : KSPGMRES)})
        actions.push_back(action);
    PetscCall(Row("A symmetric, not, and again", SpringsCreate(24, 4, 1.0, 25), jacobi, actions));
  }
  for (const std::string options : {"-ainsworth_pc_type jacobi", "-ainsworth_pc_type blocksa -ksp_type fgmres"})
    for (const std::string typeA : {MATAIJ, MATBAIJ, MATSBAIJ, MATDENSE, MATNEST})
      for (const std::string typeC : {MATAIJ, MATBAIJ, MATDENSE})
        if (!PetscDefined(USE_COMPLEX) || typeA != MATSBAIJ) /* of which PETSc does not know that it is Hermitian */
          PetscCall(Stored(typeA, typeC, options));
  PetscCall(Row("the whole as AIJ, or as a nest of one block, at the second solve", Chain(12, 3, 3.0),
                "-ainsworth_pc_type jacobi", {Positive(), OtherMatrix, Exact(1e-6)}, EXPLICIT));
  PetscFunctionReturn(PETSC_SUCCESS);
}
