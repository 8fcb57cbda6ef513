static char help[] = "Every option and its pair of functions, prefixes, and what KSPView() says before and after the set-up.\n\n";

#include "dense.h"

static System sys;
static Mat    nest;

/* What an option must do: the value that the getter shows */
struct Choice {
  const char                                 *option;
  double                                      standard, expected; /* without and with the option */
  std::function<PetscErrorCode(PC, double *)> get;
  std::function<PetscErrorCode(PC)>           set;
};

template <typename T, PetscErrorCode (*Get)(PC, T *)>
static PetscErrorCode Value(PC pc, double *value)
{
  T got;

  PetscFunctionBeginUser;
  PetscCall(Get(pc, &got));
  *value = (double)got;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const std::vector<Choice> choices = {
  {"variant paper",             PC_AINSWORTH_WEIGHTED,         PC_AINSWORTH_PAPER,             Value<PCAinsworthVariant,       PCAinsworthGetVariant>,
   [](PC pc) { return PCAinsworthSetVariant(pc, PC_AINSWORTH_PAPER); }                                                                                                                                                              },
  {"weight identity",           MAT_AINSWORTH_WEIGHT_DIAGONAL, MAT_AINSWORTH_WEIGHT_IDENTITY,  Value<MatAinsworthWeightType,   PCAinsworthGetWeightType>,
   [](PC pc) { return PCAinsworthSetWeightType(pc, MAT_AINSWORTH_WEIGHT_IDENTITY); }                                                                                                                                                },
  {"penalty norm",              PC_AINSWORTH_PENALTY_ROW,      PC_AINSWORTH_PENALTY_NORM,      Value<PCAinsworthPenaltyType,   PCAinsworthGetPenaltyType>,
   [](PC pc) { return PCAinsworthSetPenaltyType(pc, PC_AINSWORTH_PENALTY_NORM); }                                                                                                                                                   },
  {"penalty_factor 0.125",      0.5,                           0.125,                          Value<PetscReal,                PCAinsworthGetPenaltyFactor>,         [](PC pc) { return PCAinsworthSetPenaltyFactor(pc, 0.125); }   },
  {"pmat bj_cg",                PC_AINSWORTH_PMAT_AUTO,        PC_AINSWORTH_PMAT_BJ_CG,        Value<PCAinsworthPmatType,      PCAinsworthGetPmatType>,
   [](PC pc) { return PCAinsworthSetPmatType(pc, PC_AINSWORTH_PMAT_BJ_CG); }                                                                                                                                                        },
  {"pmat_rtol 0.25",            0.1,                           0.25,                           Value<PetscReal,                PCAinsworthGetPmatTolerance>,         [](PC pc) { return PCAinsworthSetPmatTolerance(pc, 0.25); }    },
  {"pmat_max_rows 17",          4000,                          17,                             Value<PetscInt,                 PCAinsworthGetPmatMaxRows>,           [](PC pc) { return PCAinsworthSetPmatMaxRows(pc, 17); }        },
  {"blocks 3",                  PETSC_DECIDE,                  3,                              Value<PetscInt,                 PCAinsworthGetBlocks>,                [](PC pc) { return PCAinsworthSetBlocks(pc, 3); }              },
  {"row_scaling 0",             PETSC_TRUE,                    PETSC_FALSE,                    Value<PetscBool,                PCAinsworthGetRowScaling>,            [](PC pc) { return PCAinsworthSetRowScaling(pc, PETSC_FALSE); }},
  {"rows_per_rank 2",           25000,                         2,                              Value<PetscInt,                 PCAinsworthGetRowsPerRank>,           [](PC pc) { return PCAinsworthSetRowsPerRank(pc, 2); }         },
  {"redundant error",           PC_AINSWORTH_REDUNDANT_DROP,   PC_AINSWORTH_REDUNDANT_ERROR,   Value<PCAinsworthRedundantType, PCAinsworthGetRedundantType>,
   [](PC pc) { return PCAinsworthSetRedundantType(pc, PC_AINSWORTH_REDUNDANT_ERROR); }                                                                                                                                              },
  {"check_transpose",           PETSC_FALSE,                   PETSC_TRUE,                     Value<PetscBool,                PCAinsworthGetCheckTranspose>,
   [](PC pc) { return PCAinsworthSetCheckTranspose(pc, PETSC_TRUE); }                                                                                                                                                               },
  {"stop energy_error",         PC_AINSWORTH_STOP_RESIDUAL,    PC_AINSWORTH_STOP_ENERGY_ERROR, Value<PCAinsworthStopType,      PCAinsworthGetStop>,
   [](PC pc) { return PCAinsworthSetStop(pc, PC_AINSWORTH_STOP_ENERGY_ERROR); }                                                                                                                                                     },
  {"error_rtol 0.125",          1e-6,                          0.125,                          Value<PetscReal,                PCAinsworthGetErrorTolerance>,        [](PC pc) { return PCAinsworthSetErrorTolerance(pc, 0.125); }  },
  {"error_eigenvalue 0.5",      PETSC_DEFAULT,                 0.5,                            Value<PetscReal,                PCAinsworthGetErrorEigenvalue>,       [](PC pc) { return PCAinsworthSetErrorEigenvalue(pc, 0.5); }   },
  {"monitor_error_residuals 0", PETSC_TRUE,                    PETSC_FALSE,                    Value<PetscBool,                PCAinsworthGetErrorMonitorResiduals>,
   [](PC pc) { return PCAinsworthSetErrorMonitorResiduals(pc, PETSC_FALSE); }                                                                                                                                                       }
};

static PetscErrorCode Pairs()
{
  KSP    ksp;
  PC     pc;
  double value;

  PetscFunctionBeginUser;
  for (const Choice &choice : choices) {
    Case("-pc_ainsworth_%s", choice.option);
    for (int way = 0; way < 4; way++) {
      const std::string prefix = way == 3 ? "-foo_" : "-";
      Options           options(way % 2 ? prefix + "pc_ainsworth_" + choice.option : "");

      PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
      if (way == 3) PetscCall(KSPSetOptionsPrefix(ksp, "foo_"));
      PetscCall(KSPGetPC(ksp, &pc));
      PetscCall(PCSetType(pc, PCAINSWORTH));
      if (way == 2) PetscCall(choice.set(pc));
      PetscCall(KSPSetFromOptions(ksp));
      PetscCall(choice.get(pc, &value));
      PetscCall(Check(way == 0 ? "default" : (way == 2 ? "function" : (way == 1 ? "option" : "option with a prefix")),
                      PetscAbsReal(value - (way ? choice.expected : choice.standard)), 0.0));
      PetscCall(KSPDestroy(&ksp));
    }
    /* a choice after the set-up counts at the next solve */
    PetscCall(SolverCreate(nest, &ksp));
    PetscCall(KSPSetUp(ksp));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(choice.set(pc));
    PetscCall(choice.get(pc, &value));
    PetscCall(Check("function after the set-up", PetscAbsReal(value - choice.expected), 0.0));
    PetscCall(KSPSetUp(ksp));
    PetscCall(KSPDestroy(&ksp));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The variants set four things at once, each of which can then be set alone, in whatever order the options come */
static PetscErrorCode Variants()
{
  Options                options("-pc_ainsworth_weight diagonal -pc_ainsworth_variant paper -pc_ainsworth_penalty_factor 7 -ainsworth_ksp_type projectedcg");
  KSP                    ksp, inner;
  PC                     pc;
  KSPType                type;
  MatAinsworthWeightType weight;
  PCAinsworthPenaltyType penalty;
  PetscReal              factor;
  PetscBool              scaling;

  PetscFunctionBeginUser;
  Case("variants");
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  for (PCAinsworthVariant variant : {PC_AINSWORTH_PAPER, PC_AINSWORTH_WEIGHTED}) {
    const bool paper = variant == PC_AINSWORTH_PAPER;

    PetscCall(PCAinsworthSetPenaltyFactor(pc, 3.0));
    PetscCall(PCAinsworthSetVariant(pc, variant));
    PetscCall(PCAinsworthGetWeightType(pc, &weight));
    PetscCall(CheckInt("weight", weight, paper ? MAT_AINSWORTH_WEIGHT_IDENTITY : MAT_AINSWORTH_WEIGHT_DIAGONAL));
    PetscCall(PCAinsworthGetPenaltyType(pc, &penalty));
    PetscCall(CheckInt("penalty", penalty, paper ? PC_AINSWORTH_PENALTY_NORM : PC_AINSWORTH_PENALTY_ROW));
    PetscCall(PCAinsworthGetPenaltyFactor(pc, &factor));
    PetscCall(CheckTrue("factor", factor == (paper ? 5.0 : 0.5)));
    PetscCall(PCAinsworthGetRowScaling(pc, &scaling));
    PetscCall(CheckTrue("row scaling", scaling == (PetscBool)!paper));
    PetscCall(KSPGetType(inner, &type));
    PetscCall(CheckTrue(type, type == std::string(paper ? KSPCG : KSPPROJECTEDCG)));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetWeightType(pc, &weight));
  PetscCall(CheckInt("weight beside the variant", weight, MAT_AINSWORTH_WEIGHT_DIAGONAL));
  PetscCall(PCAinsworthGetPenaltyType(pc, &penalty));
  PetscCall(CheckInt("penalty of the variant", penalty, PC_AINSWORTH_PENALTY_NORM));
  PetscCall(PCAinsworthGetPenaltyFactor(pc, &factor));
  PetscCall(CheckTrue("factor beside the variant", factor == 7.0));
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
    Options           options("-" + p + "ainsworth_ksp_rtol 1e-5 -" + p + "ainsworth_ksp_type cg -" + p + "ainsworth_pc_type jacobi -" + p +
                              "ainsworth_gram_ksp_type cg -" + p + "ainsworth_gram_pc_type jacobi -" + p + "ainsworth_ksp_norm_type preconditioned");
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

  PetscFunctionBeginUser;
  Case("no options read");
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, nest, nest));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  {
    PC pc;
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCSetType(pc, PCAINSWORTH));
  }
  PetscCall(MatGetLocalSize(nest, &n, NULL));
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, n, PETSC_DECIDE, &b));
  PetscCall(VecDuplicate(b, &y));
  PetscCall(SetRandom(b, 5));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(ViewText(ksp, text));
  const char *withoutHypre = PetscDefined(USE_COMPLEX) ? "type: blocksa" : "type: gamg";
  PetscCall(CheckText("view", text, {PetscDefined(HAVE_HYPRE) ? "PMIS" : withoutHypre, "type: projectedcg", "relative=1e-08"}));
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
    Options     options(pmat ? "-pc_ainsworth_variant paper -pc_ainsworth_pmat bj_cg -pc_ainsworth_blocks 2 -ainsworth_pc_type jacobi"
                             : "-ainsworth_pc_type jacobi");
    std::string first  = pmat ? "variant: paper (weight identity, penalty norm with factor 5"
                              : "variant: weighted (weight diagonal, penalty row with factor 0.5)";
    std::string second = pmat ? "preconditioning matrix: bj_cg, relative tolerance 0.1, 2 blocks" : "preconditioning matrix: auto";

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
    PetscCall(CheckText("view", text,
                        {first, second, "constraints: 5", "reduced solve in the primal unknowns",
                         "Gram matrix S = C W C': 1 connected piece, the largest of 5 rows, on 1 rank", "(ainsworth_) ", "(ainsworth_gram_) ",
                         pmat ? "type: cg" : "type: projectedcg", "type: ainsworth", "constraints=5, weight: " + std::string(pmat ? "identity" : "diagonal"),
                         "penalty: "}));
    PetscCall(CheckTrue("no longer not set up", text.find("not set up yet") == std::string::npos));
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

    Case("view with zero rows");
    spec.zeroRows = true;
    PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &zeros));
    PetscCall(NestCreate(zeros.A, NULL, zeros.C, NULL, false, &other));
    PetscCall(SystemDestroy(&zeros));
    PetscCall(SolverCreate(other, &ksp));
    PetscCall(KSPSetUp(ksp));
    PetscCall(ViewText(ksp, text));
    PetscCall(CheckText("view", text, {"constraints: 3, 2 zero rows left out", "bj_cc, one block per 32 constraints"}));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&other));
    Case("view without constraints");
    spec.m        = 0;
    spec.zeroRows = false;
    PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &zeros));
    PetscCall(NestCreate(zeros.A, NULL, zeros.C, NULL, false, &other));
    PetscCall(SystemDestroy(&zeros));
    PetscCall(SolverCreate(other, &ksp));
    PetscCall(KSPSetUp(ksp));
    PetscCall(ViewText(ksp, text));
    PetscCall(CheckText("view", text, {"constraints: 0, A alone is solved", "type: cg"}));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&other));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(SystemCreate(PETSC_COMM_WORLD, Spec(), &sys));
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  PetscCall(Pairs());
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
