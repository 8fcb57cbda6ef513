static char help[] = "Every option, prefixes, options read again, and what KSPView() says before and after the "
                     "set-up.\n\n";

#include "dense.h"

static System sys;
static Mat    nest;

/* What an option must do: what KSPView() says without and with it */
struct Choice {
  const char *option, *standard, *expected;
};

/* clang-format off */
static const std::vector<Choice> choices = {
  {"variant paper", "variant: weighted (weight diagonal, penalty row with factor 0.5)",
   "variant: paper (weight identity, penalty norm with factor 5.)"},
  {"weight identity", "weight diagonal", "variant: weighted (weight identity, "},
  {"penalty norm", "penalty row", "penalty norm with factor 5."},
  {"penalty_factor 0.125", "factor 0.5", "factor 0.125"},
  {"pmat bj_cg", "preconditioning matrix: auto", "preconditioning matrix: bj_cg, relative tolerance 0.1"},
  {"pmat cg -pc_ainsworth_pmat_rtol .3", "preconditioning matrix: auto",
   "preconditioning matrix: cg, relative tolerance 0.3"},
  {"pmat bj_cc -pc_ainsworth_blocks 3", "preconditioning matrix: auto", "preconditioning matrix: bj_cc, 3 blocks"},
  {"monitor_error", "variant", "error against run time: monitored"},
  {"stop energy_error", "variant", "the energy norm of the error is at most 1e-06 times that of x, by an estimate"},
  {"stop energy_error -pc_ainsworth_error_rtol .25", "variant",
   "the energy norm of the error is at most 0.25 times that of x"}
};
/* clang-format on */

static PetscErrorCode Each()
{
  KSP         ksp;
  PC          pc;
  std::string text;

  PetscFunctionBeginUser;
  for (const Choice &choice : choices) {
    Case("-pc_ainsworth_%s", choice.option);
    for (int way = 0; way < 3; way++) {
      std::string line = std::string("-pc_ainsworth_") + choice.option;

      for (size_t at = 0; way == 2 && (at = line.find("-pc", at)) != std::string::npos; at++)
        line.replace(at, 3, "-foo_pc");
      Options options(way ? line : "");

      PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
      if (way == 2) PetscCall(KSPSetOptionsPrefix(ksp, "foo_"));
      PetscCall(KSPSetOperators(ksp, nest, nest));
      PetscCall(KSPGetPC(ksp, &pc));
      PetscCall(PCSetType(pc, PCAINSWORTH));
      PetscCall(KSPSetFromOptions(ksp));
      PetscCall(ViewText(ksp, text));
      PetscCall(CheckText(way == 0 ? "default" : (way == 1 ? "option" : "option with a prefix"), text,
                          {way ? choice.expected : choice.standard}));
      PetscCall(KSPDestroy(&ksp));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Set-ups of the Gram matrix and of M_* so far */
static PetscErrorCode CountSetUps(PetscInt count[2])
{
  PetscFunctionBeginUser;
  PetscCall(EventCount("AinsGramMat", &count[0]));
  PetscCall(EventCount("AinsPMat", &count[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the options again, and solves; anew: all of the set-up, else nothing */
static PetscErrorCode ReadAgain(KSP ksp, Vec b, Vec y, const char *what, bool anew)
{
  PetscInt           before[2], after[2];
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(CountSetUps(before));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(CountSetUps(after));
  for (int k = 0; k < 2; k++) PetscCall(CheckInt(what, after[k] - before[k], anew));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A second KSPSetFromOptions(): what it says again rebuilds nothing, what it changes counts */
static PetscErrorCode Again()
{
  Options   options("-pc_ainsworth_variant paper -pc_ainsworth_penalty_factor 4 -pc_ainsworth_pmat bj_cc "
                      "-pc_ainsworth_monitor_error csv:again.csv "
                      "-pc_ainsworth_stop residual -pc_ainsworth_weight identity");
  KSP       ksp, inner;
  PC        pc, innerPC;
  KSPType   type;
  PCType    pctype;
  PetscReal rtol;
  Vec       b, y;

  PetscFunctionBeginUser;
  Case("options read again");
  PetscCall(MatCreateVecs(nest, &y, &b));
  PetscCall(SetRandom(b, 5));
  {
    Options inside("-pc_ainsworth_blocks 2 -ainsworth_pc_type jacobi -ainsworth_ksp_type projectedcg");

    PetscCall(SolverCreate(nest, &ksp));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCAinsworthGetKSP(pc, &inner));
    PetscCall(KSPSolve(ksp, b, y));
    PetscCall(ReadAgain(ksp, b, y, "nothing is rebuilt", false));
    PetscCall(KSPGetType(inner, &type));
    PetscCall(CheckTrue("inner method beside the variant", type == std::string(KSPPROJECTEDCG)));
  }
  {
    Options more("-ainsworth_ksp_rtol 1e-3");

    PetscCall(ReadAgain(ksp, b, y, "nor for another tolerance", false));
    PetscCall(KSPGetTolerances(inner, &rtol, NULL, NULL, NULL));
    PetscCall(CheckTrue("the tolerance", rtol == 1e-3));
  }
  {
    Options more("-pc_ainsworth_blocks 3");
    PetscCall(ReadAgain(ksp, b, y, "another choice", true));
    PetscCall(ReadAgain(ksp, b, y, "and again", false));
  }
  {
    Options more("-ainsworth_pc_type none -ainsworth_ksp_type cg");

    PetscCall(ReadAgain(ksp, b, y, "another inner solver", true));
    PetscCall(KSPGetPC(inner, &innerPC));
    PetscCall(PCGetType(innerPC, &pctype));
    PetscCall(KSPGetType(inner, &type));
    PetscCall(CheckTrue("its types", pctype == std::string(PCNONE) && type == std::string(KSPCG)));
  }
  PetscCall(KSPDestroy(&ksp)); /* closes the file */
  std::string text;
  PetscCall(FileText("again.csv", text));
  PetscCall(
    CheckTrue("one header", text.find("solve,seconds") == 0 && text.find("solve,seconds", 1) == std::string::npos));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The variants set five things at once, each of which can then be set alone, in whatever order the options come; what
   is set by a call counts too
*/
static PetscErrorCode Variants()
{
  KSP         ksp, inner;
  PC          pc;
  KSPType     type;
  std::string text;

  PetscFunctionBeginUser;
  Case("variants");
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, nest, nest));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  for (bool paper : {true, false}) {
    Options options(paper ? "-pc_ainsworth_variant paper -pc_ainsworth_pmat bj_cg"
                          : "-pc_ainsworth_variant weighted -pc_ainsworth_pmat jcb");

    PetscCall(PCSetFromOptions(pc));
    PetscCall(ViewText(ksp, text));
    PetscCall(CheckText(
      "view", text,
      {paper ? choices[0].expected : choices[0].standard, paper ? "matrix: bj_cg" : "matrix: jcb, rows scaled"}));
    PetscCall(KSPGetType(inner, &type));
    PetscCall(CheckTrue(type, type == std::string(paper ? KSPCG : KSPPROJECTEDCG)));
  }
  PetscCall(KSPDestroy(&ksp));
  Options options("-pc_ainsworth_weight diagonal -pc_ainsworth_variant paper -pc_ainsworth_penalty_factor 7 "
                  "-ainsworth_ksp_type projectedcg");
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(ViewText(ksp, text));
  PetscCall(CheckText("beside the variant", text, {"variant: paper (weight diagonal, penalty norm with factor 7."}));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetType(inner, &type));
  PetscCall(CheckTrue("inner method beside the variant", type == std::string(KSPPROJECTEDCG)));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options of the inner solvers, with and without a prefix, set before and after the type of the PC */
static PetscErrorCode Inner()
{
  PetscFunctionBeginUser;
  for (const char *prefix : {"", "foo_"}) {
    const std::string p(prefix);
    Options           options("-" + p + "ainsworth_ksp_rtol 1e-5 -" + p + "ainsworth_ksp_type cg -" + p +
                              "ainsworth_pc_type jacobi -" + p + "ainsworth_gram_ksp_type cg -" + p +
                              "ainsworth_gram_pc_type jacobi -" + p + "ainsworth_ksp_norm_type preconditioned");
    KSP               ksp, inner, gram;
    PC                pc, sub;
    KSPType           type;
    PCType            pctype;
    KSPNormType       norm;
    PetscReal         rtol;
    const char       *name;

    Case("options of the inner solvers, prefix \"%s\"", prefix);
    PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
    PetscCall(KSPSetOperators(ksp, nest, nest));
    PetscCall(KSPSetType(ksp, KSPPREONLY));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCSetType(pc, PCAINSWORTH));
    PetscCall(KSPSetOptionsPrefix(ksp, prefix)); /* after the type */
    PetscCall(KSPSetFromOptions(ksp));
    PetscCall(KSPSetUp(ksp));
    PetscCall(PCAinsworthGetKSP(pc, &inner));
    PetscCall(KSPGetOptionsPrefix(inner, &name));
    PetscCall(CheckTrue(name, name == p + "ainsworth_"));
    PetscCall(KSPGetTolerances(inner, &rtol, NULL, NULL, NULL));
    PetscCall(CheckTrue("rtol", rtol == 1e-5));
    PetscCall(KSPGetType(inner, &type));
    PetscCall(CheckTrue(type, type == std::string(KSPCG)));
    PetscCall(KSPGetNormType(inner, &norm));
    PetscCall(CheckInt("norm", norm, KSP_NORM_PRECONDITIONED));
    PetscCall(KSPGetPC(inner, &sub));
    PetscCall(PCGetType(sub, &pctype));
    PetscCall(CheckTrue(pctype, pctype == std::string(PCJACOBI)));
    PetscCall(PCAinsworthGetGramKSP(pc, &gram));
    if (gram) {
      PetscCall(KSPGetOptionsPrefix(gram, &name));
      PetscCall(KSPGetType(gram, &type));
    }
    PetscCall(CheckTrue("prefix of the Gram solver", !gram || name == p + "ainsworth_gram_"));
    PetscCall(CheckTrue("type of the Gram solver", !gram || type == std::string(KSPCG)));
    PetscCall(KSPDestroy(&ksp));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A program that reads no options: the defaults are the same */
static PetscErrorCode Unread()
{
  KSP                ksp;
  KSPConvergedReason reason;
  Vec                b, y;
  PetscInt           n;
  std::string        text;
  KSP                reduced;
  PC                 pc;
  const char        *withoutHypre = PetscDefined(USE_COMPLEX) ? PCBLOCKSA : PCGAMG;

  PetscFunctionBeginUser;
  Case("no options read");
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, nest, nest));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(PCAinsworthGetKSP(pc, &reduced));
  PetscCall(KSPGetPC(reduced, &pc));
  /* by itself it would be a factorization, of so few unknowns */
  PetscCall(PCSetType(pc, PetscDefined(HAVE_HYPRE) ? "hypre" : withoutHypre));
  PetscCall(MatGetLocalSize(nest, &n, NULL));
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, n, PETSC_DECIDE, &b));
  PetscCall(VecDuplicate(b, &y));
  PetscCall(SetRandom(b, 5));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(ViewText(ksp, text));
  PetscCall(
    CheckText("view", text, {PetscDefined(HAVE_HYPRE) ? "PMIS" : withoutHypre, "type: projectedcg", "relative=1e-08"}));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Views()
{
  KSP         ksp;
  PC          pc;
  PetscViewer viewer;
  std::string text;
  char        string[512];

  PetscFunctionBeginUser;
  for (int pmat = 0; pmat < 2; pmat++) {
    Options options(
      pmat ? "-pc_ainsworth_variant paper -pc_ainsworth_pmat bj_cg -pc_ainsworth_blocks 2 -ainsworth_pc_type jacobi"
           : "-ainsworth_pc_type jacobi");
    std::string first  = pmat ? "variant: paper (weight identity, penalty norm with factor 5"
                              : "variant: weighted (weight diagonal, penalty row with factor 0.5)";
    std::string second = pmat ? "preconditioning matrix: bj_cg, relative tolerance 0.1, 2 blocks"
                              : "preconditioning matrix: auto";

    Case("view before the set-up, %d", pmat);
    PetscCall(SolverCreate(nest, &ksp));
    PetscCall(ViewText(ksp, text));
    PetscCall(CheckText("view", text, {"type: ainsworth", first, second, "not set up yet"}));
    Case("view after the set-up, %d", pmat);
    if (!pmat) { /* auto is decided from C, and the penalty with it */
      first  = "variant: weighted (weight diagonal, penalty row with factor 10.)";
      second = "preconditioning matrix: id, as the constraints keep components apart\n";
    }
    PetscCall(KSPSetUp(ksp));
    PetscCall(ViewText(ksp, text));
    PetscCall(
      CheckText("view", text,
                {first, second, "constraints: 5", "reduced solve in the primal unknowns",
                 "Gram matrix S = C W C': 1 connected component, the largest of 5 rows, on 1 rank", "(ainsworth_) ",
                 "(ainsworth_gram_) ", pmat ? "type: cg" : "type: projectedcg", "type: ainsworth",
                 "constraints=5, weight: " + std::string(pmat ? "identity" : "diagonal"), "penalty: "}));
    PetscCall(CheckTrue("no longer not set up", text.find("not set up yet") == std::string::npos));
    PetscCall(ViewText(ksp, text, PETSC_VIEWER_DEFAULT));
    PetscCall(
      CheckText("overview", text,
                {"layout: nest", "block size of A: ", "near null space of A: none given", "constraints: 5\n",
                 pmat ? "reduced solve: cg, preconditioned by jacobi, to a relative tolerance of 1e-08\n"
                      : "reduced solve: projectedcg, preconditioned by jacobi, to a relative tolerance of 1e-08\n",
                 "for more: -ksp_view ::ascii_info_detail\n"}));
    PetscCall(CheckTrue("no solver inside", text.find("(ainsworth_") == std::string::npos));
    const size_t ours = text.find("type: ainsworth"), theirs = text.find("linear system matrix");
    PetscCall(CheckTrue("at most ten lines", std::count(text.begin() + ours, text.begin() + theirs, '\n') <= 11));
    PetscCall(PetscViewerStringOpen(PETSC_COMM_WORLD, string, sizeof(string), &viewer));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCView(pc, viewer));
    PetscCall(PetscViewerDestroy(&viewer));
    PetscCall(CheckText("view on a string", string, {pmat ? "paper, pmat bj_cg" : "weighted, pmat auto"}));
    PetscCall(KSPDestroy(&ksp));
  }
  {
    Options options("-ainsworth_pc_type jacobi -pc_ainsworth_pmat bj_cc");
    System  zeros;
    Mat     other;
    Spec    spec;

    for (bool zeroRows : {true, false}) {
      Case("view %s", zeroRows ? "with zero rows" : "without constraints");
      spec.zeroRows = zeroRows;
      if (!zeroRows) spec.m = 0;
      PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &zeros));
      PetscCall(NestCreate(zeros.A, NULL, zeros.C, NULL, false, &other));
      PetscCall(SystemDestroy(&zeros));
      PetscCall(SolverCreate(other, &ksp));
      PetscCall(KSPSetUp(ksp));
      PetscCall(ViewText(ksp, text));
      if (zeroRows)
        PetscCall(
          CheckText("view", text, {"constraints: 3, 2 zero rows left out", "bj_cc, one block per 32 constraints"}));
      else PetscCall(CheckText("view", text, {"constraints: 0, A alone is solved", "type: cg"}));
      PetscCall(KSPDestroy(&ksp));
      PetscCall(MatDestroy(&other));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  PetscCall(SystemCreate(PETSC_COMM_WORLD, Spec(), &sys));
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  PetscCall(Each());
  PetscCall(Again());
  PetscCall(Variants());
  PetscCall(Inner());
  PetscCall(Unread());
  PetscCall(Views());
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
