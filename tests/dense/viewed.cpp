static char help[] = "KSPView() after set-ups and solves that ended with an error or were refused, and a set-up after it.\n\n";

#include "run.h"
#include <cmath>

/* What makes a set-up or a solve end */
struct Trouble {
  std::string options;
  int         changed = 0;    /* 1: NaN; 2: the last unknown is in no equation */
  bool        again   = true; /* also where a set-up without it has gone well: a kept S does not read its options again, nor does PETSc's CG allocate more */
};

static DenseSystem Troubled(const Trouble &trouble)
{
  DenseSystem d = SpringsCreate(24, 4, 1.0, 6);

  if (trouble.changed == 1) d.A(3, 3) = NAN;
  if (trouble.changed == 2) d.A.row(23).setZero();
  if (trouble.changed == 2) d.A.col(23).setZero();
  return d;
}

/* Catches the error of an action, if there is one */
static PetscErrorCode Catch(const std::function<PetscErrorCode()> &action, PetscErrorCode *code)
{
  PetscFunctionBeginUser;
#if defined(PETSC_USE_DEBUG)
  const PetscStack stack = petscstack; /* an error does not pop it */
#endif
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  *code = action();
#if defined(PETSC_USE_DEBUG)
  petscstack = stack;
#endif
  PetscCall(PetscPopErrorHandler());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Views the solver after it failed: nothing is raised, and the text is that of the same solver on all ranks; first: at its first set-up */
static PetscErrorCode Viewed(const Trouble &trouble, bool first)
{
  const DenseSystem  bad = Troubled(trouble), good = Troubled(Trouble());
  Run                run;
  Vec                b, y;
  std::string        text;
  PetscErrorCode     code   = PETSC_SUCCESS;
  PetscBool          failed = PETSC_FALSE;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("%s, change %d, %s set-up", trouble.options.c_str(), trouble.changed, first ? "first" : "second");
  PetscCall(SystemFromDense(first ? bad : good, false, &run.sys));
  PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, NULL, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(MatCreateVecs(run.nest, &y, &b));
  PetscCall(VecSet(b, 1.0));
  if (!first) {
    PetscCall(KSPSolve(run.ksp, b, y));
    PetscCall(WriteDense(bad.A, run.sys.A));
    PetscCall(MatAssemblyBegin(run.nest, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(run.nest, MAT_FINAL_ASSEMBLY));
  }
  Options options(trouble.options);
  for (const auto &action : std::vector<std::function<PetscErrorCode()>>{
         [&]() { return trouble.options.empty() ? PETSC_SUCCESS : KSPSetFromOptions(run.ksp); },
         [&]() { return KSPSetUp(run.ksp); },
         [&]() { return KSPSolve(run.ksp, b, y); }
  }) {
    PetscCall(Catch(action, &code));
    PetscCall(ViewText(run.ksp, text));
    PetscCall(CheckText("view", text, {"type: ainsworth"}));
    PetscCall(KSPGetConvergedReason(run.ksp, &reason));
    if (code || reason < 0) failed = PETSC_TRUE;
    if (!code && reason < 0) PetscCall(CheckText("view", text, {"last failure: "}));
  }
  PetscCall(CheckTrue("it fails", failed));
  PetscCall(KSPReset(run.ksp));
  PetscCall(ViewText(run.ksp, text));
  PetscCall(CheckText("view after a reset", text, {"type: ainsworth", "not set up yet"}));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const Trouble &trouble : std::vector<Trouble>{{"", 1},
                                                     {"", 2, false},
                                                     {"-ainsworth_pc_type nonsense", 0},
                                                     {"-ainsworth_ksp_type nonsense", 0},
                                                     {"-ainsworth_gram_pc_type nonsense", 0, false},
                                                     {"-ainsworth_gram_ksp_type nonsense", 0, false},
                                                     {"-ainsworth_gram_pc_type lu -ainsworth_gram_pc_factor_mat_solver_type nonsense", 0, false},
                                                     {"-pc_ainsworth_weight user", 0},
                                                     {"-ainsworth_pc_type shell", 0},
                                                     {"-ainsworth_pc_type lu -ainsworth_pc_factor_mat_solver_type nonsense", 0},
                                                     {"-ainsworth_pc_type bjacobi -ainsworth_sub_pc_type nonsense", 0},
                                                     {"-ainsworth_pc_type asm -ainsworth_sub_pc_type nonsense", 0},
                                                     {"-ainsworth_pc_type gamg -ainsworth_mg_coarse_pc_type nonsense", 0},
                                                     {"-ainsworth_pc_type jacobi -ainsworth_ksp_max_it 1", 0},
                                                     {"-ainsworth_pc_type jacobi -pc_ainsworth_stop energy_error -ainsworth_ksp_cg_single_reduction", 0, false}})
    for (bool first : {true, false})
      if (first || trouble.again) PetscCall(Viewed(trouble, first));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
