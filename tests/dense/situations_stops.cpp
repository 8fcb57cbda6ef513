/* Solvers that stop too early, or are not accurate, and what is said of it */
#include "situations.h"

/* Solvers that stop, and those of the Gram matrix that do, or are bad after their set-up */
PetscErrorCode Stops()
{
  const std::string inexact = "-ainsworth_pc_type jacobi -pc_ainsworth_pmat id -ainsworth_gram_ksp_type cg "
                              "-ainsworth_gram_pc_type none -ainsworth_gram_ksp_rtol 1e-5 ";
  const std::string limit   = "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -ainsworth_ksp_max_it 1 ";
  const std::string nopivot = "-ainsworth_pc_type jacobi -pc_ainsworth_weight identity -ainsworth_gram_pc_type lu "
                              "-ainsworth_gram_pc_factor_zeropivot 1e30";
  const std::string floats = "-ainsworth_ksp_type preonly -ainsworth_pc_type redundant -ainsworth_redundant_pc_type lu "
                             "-ainsworth_redundant_pc_factor_shift_type nonzero";

  PetscFunctionBeginUser;
  for (bool uneven : {false, true}) {
    const std::string layout = uneven ? ", uneven" : "";
    Spec              spec, many, floating;

    spec.uneven = many.uneven = uneven;
    many.n                    = 160;
    many.m                    = 60;
    PetscCall(Row(
      "inner limit of one iteration" + layout, spec, limit,
      {Failed({}, PC_SUBPC_ERROR), Failed({}, PC_SUBPC_ERROR), Limit(1000), Right(1e-9), /* no success by forgetting */
       Limit(4), [](Live &s) { return KSPSetType(s.ksp, KSPFGMRES); },
       [](Live &s) { return KSPSetTolerances(s.ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, 200); }, Right(1e-8),
       Reread(limit +
              "-pc_ainsworth_pmat id -ksp_type preonly -ksp_error_if_not_converged"), /* set up again, with errors */
       Raised(PETSC_ERR_NOT_CONVERGED, {"ended without convergence (DIVERGED_ITS)"})},
      VIEW));
    /* a Gram matrix that cannot be factored, and not because rows depend on each other */
    PetscCall(Row("Gram matrix not factored" + layout, spec, nopivot,
                  {Failed({}, PC_FACTOR_NUMERIC_ZEROPIVOT), Failed({}, PC_FACTOR_NUMERIC_ZEROPIVOT)}, VIEW));
    PetscCall(Row("Gram matrix not factored, errors" + layout, spec, nopivot + " -ksp_error_if_not_converged",
                  {Raised(PETSC_ERR_MAT_CH_ZRPVT, {"Gram matrix C W C'", "FACTOR_NUMERIC_ZEROPIVOT"})}, VIEW));
    for (bool stops : {false, true})
      for (const std::string strict : {"", " -ksp_error_if_not_converged"}) {
        const std::string why = stops ? "Solves with the Gram matrix S = C W C' do not converge"
                                      : "the Gram matrix C W C' is ill-conditioned";

        PetscCall(Row(std::string("a Gram solver that ") + (stops ? "stops" : "is not accurate") + layout + strict,
                      many,
                      inexact + (stops ? "" : "-ainsworth_ksp_type preonly -ainsworth_ksp_norm_type none") + strict,
                      {[=](Live &s) -> PetscErrorCode {
                         KSP gram;

                         PetscFunctionBeginUser;
                         PetscCall(KSPSetUp(s.ksp));
                         PetscCall(PCAinsworthGetGramKSP(s.pc, &gram));
                         if (gram)
                           PetscCall(KSPSetTolerances(gram, stops ? 1e-12 : 0.5, PETSC_DEFAULT, PETSC_DEFAULT,
                                                      stops ? 1 : PETSC_DEFAULT));
                         PetscFunctionReturn(PETSC_SUCCESS);
                       },
                       strict.empty() ? Failed({}, PC_SUBPC_ERROR) : Raised(PETSC_ERR_NOT_CONVERGED, {why})}));
      }
  }
  for (const std::string strict :
       {"", " -ksp_error_if_not_converged"}) { /* rounding, or a shift, makes a huge x of a floating body */
    Spec spec;

    spec.semidefinite = true;
    PetscCall(
      Row("a floating body" + strict, spec, floats + strict,
          {Edit([](Saddle &s) { s.C.setZero(), s.g.setZero(); }),
           strict.empty() ? Failed({}, PC_SUBPC_ERROR) : Raised(PETSC_ERR_NOT_CONVERGED, {"A is singular on Ker C"})}));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
