/* KSPView() after set-ups and solves that ended with an error or were refused, and after a reset */
#include "situations.h"

/* Catches the error of an action, if there is one */
static PetscErrorCode Catch(const Action &action, Live &s, PetscErrorCode *code)
{
  PetscFunctionBeginUser;
#if defined(PETSC_USE_DEBUG)
  const PetscStack stack = petscstack; /* an error does not pop it */
#endif
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  *code = action(s);
#if defined(PETSC_USE_DEBUG)
  petscstack = stack;
#endif
  PetscCall(PetscPopErrorHandler());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing is raised, and the text is that of the same solver on all ranks */
static Action ViewedAfter(const std::string &options)
{
  return [=](Live &s) -> PetscErrorCode {
    std::vector<Action> steps  = {[](Live &l) { return KSPSetUp(l.ksp); }, [](Live &l) { return l.Solve(); }};
    bool                failed = false;

    PetscFunctionBeginUser;
    if (!options.empty()) steps.insert(steps.begin(), Reread(options));
    PetscCall(s.Write());
    for (const Action &step : steps) {
      PetscErrorCode     code = PETSC_SUCCESS;
      KSPConvergedReason reason;

      PetscCall(Catch(step, s, &code));
      PetscCall(KSPGetConvergedReason(s.ksp, &reason));
      failed = failed || code || reason < 0;
      PetscCall(Viewed({"type: ainsworth", !code && reason < 0 ? "last failure: " : ""})(s));
    }
    PetscCall(CheckTrue("it fails", failed));
    PetscCall(KSPReset(s.ksp));
    PetscCall(Viewed({"type: ainsworth", "not set up yet"})(s));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

PetscErrorCode Views()
{
  const DenseSystem d   = SpringsCreate(24, 4, 1.0, 6);
  const Action      bad = Edit([](Saddle &s) { s.A(3, 3) = NAN; }), unused = Edit([](Saddle &s) {
                                                                 s.A.row(23).setZero();
                                                                 s.A.col(23).setZero();
                                                               });

  PetscFunctionBeginUser;
  PetscCall(Row("NaN", d, "", {bad, ViewedAfter("")}));
  PetscCall(Row("NaN later", d, "", {Positive(), bad, ViewedAfter("")}));
  PetscCall(Row("an unknown in no equation", d, "", {unused, ViewedAfter("")}));
  for (const std::string options :
       {"-ainsworth_pc_type nonsense", "-ainsworth_ksp_type nonsense", "-ainsworth_gram_pc_type nonsense",
        "-ainsworth_gram_ksp_type nonsense",
        "-ainsworth_gram_pc_type lu -ainsworth_gram_pc_factor_mat_solver_type nonsense", "-pc_ainsworth_weight user",
        "-ainsworth_pc_type shell", "-ainsworth_pc_type lu -ainsworth_pc_factor_mat_solver_type nonsense",
        "-ainsworth_pc_type bjacobi -ainsworth_sub_pc_type nonsense",
        "-ainsworth_pc_type asm -ainsworth_sub_pc_type nonsense",
        "-ainsworth_pc_type gamg -ainsworth_mg_coarse_pc_type nonsense",
        "-ainsworth_pc_type jacobi -ainsworth_ksp_max_it 1",
        "-ainsworth_pc_type jacobi -pc_ainsworth_stop energy_error -ainsworth_ksp_cg_single_reduction"}) {
    PetscCall(Row(options, d, "", {ViewedAfter(options)}));
    /* after a set-up that has gone well a kept S does not read its options again, nor does PETSc's CG allocate more */
    if (options.find("gram") == std::string::npos && options.find("single") == std::string::npos)
      PetscCall(Row(options + ", later", d, "", {Positive(), ViewedAfter(options)}));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
