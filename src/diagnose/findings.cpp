/* Diagnosis of set-up, stage by stage, before anything is solved (docs/troubleshooting.md) */
#include "diagnose.h"
#include "../projection/matainsworth.h"

/* Operations of the factor of S above which there is advice */
static const PetscReal heavy = 1e11;
/* Iterations of a trial solve above which there is advice */
static const PetscInt slow = 100;
/*
   Multigrid for which the trial finds a smaller eigenvalue misses modes: on ties and eight parts of a mesher it is .17
   to .58 with rigid-body modes, .001 to .14 without
*/
static const PetscReal missing = 0.16, usual = 0.25;
/* Where there are no eigenvalues: iterations that are more than usual with modes */
static const PetscInt many = 30;

/* Reports rows that are dependent, or nearly so */
static PetscErrorCode DiagnoseDependence(AinsworthSolver *solver, AinsworthDiagnosis *d)
{
  const AinsworthSaddle *sp   = solver->saddle.get();
  const PetscInt         near = sp->count[AINSWORTH_ROW_NEAR], count = sp->count[AINSWORTH_ROW_DEPENDENT] + near;
  char                   names[128];
  PetscBool              doubtful = PETSC_FALSE;
  PetscInt               n, *rows;

  PetscFunctionBegin;
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "dependent_rows", AinsworthJSON(count),
                        "dependent rows of C: %" PetscInt_FMT, count);
  if (count) {
    PetscCall(AinsworthSaddleNameKind(sp, near ? AINSWORTH_ROW_NEAR : AINSWORTH_ROW_DEPENDENT, names, sizeof(names)));
    AinsworthDiagnosisAdd(
      d, AINSWORTH_DOUBTFUL, "dependent", AinsworthJSON(count),
      "%" PetscInt_FMT
      " rows of C are %s others, rows %s of the multiplier field: they are left out and their multipliers zero; remove "
      "them, a constraint that is said twice among them, or see that g agrees",
      count, near ? "combinations, exactly or nearly, of" : "combinations of", names);
  }
  if (AinsworthSolverReducedMat(solver)) PetscCall(MatAinsworthIsDoubtful_Private(solver->reduced->mat, &doubtful));
  if (!doubtful) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAinsworthFindNear_Private(solver->reduced->mat, &n, &rows));
  PetscCall(AinsworthSaddleNameKept(sp, n, rows, names, sizeof(names)));
  PetscCall(PetscFree(rows));
  if (!n) {
    AinsworthDiagnosisAdd(d, AINSWORTH_COSTLY, "gram_inexact", "true",
                          "Rows of C taken together are nearly dependent, though none is near the span of the others: "
                          "solves with the Gram matrix are refined");
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  AinsworthDiagnosisAdd(d, AINSWORTH_DOUBTFUL, "nearly_dependent", AinsworthJSON(n),
                        "%" PetscInt_FMT " rows of C are nearly combinations of others, rows %s of the multiplier "
                        "field: solves are refined, but multipliers and "
                        "what contradicts in g grow; remove such rows or make them exact",
                        n, names);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports S, its pieces and its factor */
static PetscErrorCode DiagnoseGram(AinsworthSolver *solver, AinsworthDiagnosis *d)
{
  const AinsworthGram *gram;
  Mat_Ainsworth       *ctx;
  std::string          text;
  PetscReal            cost[2], most; /* entries and operations */

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetGram_Private(solver->reduced->mat, &gram));
  PetscCall(MatAinsworthGetContext_Private(solver->reduced->mat, &ctx));
  PetscCall(AinsworthProjectorDescribeGram(&ctx->proj, &text));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "pieces",
                        AinsworthJSON("pieces", AinsworthJSON(gram->placement.components), "largest",
                                      AinsworthJSON(gram->placement.largest)),
                        "%s", text.c_str());
  cost[0] = gram->factor.cost.entries;
  cost[1] = gram->factor.cost.operations;
  PetscCall(
    MPIU_Allreduce(MPI_IN_PLACE, cost, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)solver->reduced->mat)));
  PetscCall(MPIU_Allreduce(&gram->factor.cost.operations, &most, 1, MPIU_REAL, MPIU_MAX,
                           PetscObjectComm((PetscObject)solver->reduced->mat)));
  cost[0] *= (PetscReal)sizeof(PetscScalar);
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "factor",
                        AinsworthJSON("bytes", AinsworthJSON(cost[0]), "operations", AinsworthJSON(cost[1])),
                        "factor of S, predicted: %.3g MB, %.3g operations", (double)(cost[0] / 1e6), (double)cost[1]);
  if (most > heavy)
    AinsworthDiagnosisAdd(d, AINSWORTH_COSTLY, "heavy_factor", AinsworthJSON(most),
                          "The factor of S takes %.3g operations on one rank: constraints share too many unknowns; "
                          "more ranks take part with a smaller "
                          "-pc_ainsworth_rows_per_rank",
                          (double)most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports the predicted memory of M_*, before it is made */
static PetscErrorCode DiagnoseFill(AinsworthSolver *solver, AinsworthDiagnosis *d)
{
  static const PetscReal entry = (PetscReal)(sizeof(PetscScalar) + sizeof(PetscInt));
  AinsworthPmatFill      fill;
  PetscReal              jcb;
  Mat                    A;

  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(solver->saddle->A, &A));
  PetscCall(AinsworthPmatGetFill(A, solver->saddle->kept.C, &fill));
  PetscCall(AinsworthPmatPredict(A, solver->saddle->kept.C, NULL, &fill, &jcb));
  PetscCall(MatDestroy(&A));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "memory",
                        AinsworthJSON("A_bytes", AinsworthJSON(entry * fill.entries), "id_bytes",
                                      AinsworthJSON(entry * (fill.entries + fill.squares)), "jcb_bytes",
                                      AinsworthJSON(entry * jcb)),
                        "A has %.3g MB; the preconditioning matrix, predicted: at most %.3g MB as id, %.3g MB as jcb",
                        (double)(entry * fill.entries / 1e6), (double)(entry * (fill.entries + fill.squares) / 1e6),
                        (double)(entry * jcb / 1e6));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "long_rows", AinsworthJSON(fill.leftOut),
                        "long rows of C, left out of the preconditioning matrix: %" PetscInt_FMT, fill.leftOut);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes findings of wrong signs fatal, because they explain a failure */
static void ConfirmSigns(AinsworthDiagnosis *d)
{
  for (const char *key : {"negative_diagonal", "D_sign"}) AinsworthDiagnosisConfirm(d, key);
}

/* Bounds the iterations of conjugate gradients by Chebyshev's, for eigenvalues from `smallest` to 1, as a cycle has */
static int AtMost(PetscReal rtol, PetscReal smallest)
{
  const PetscReal root = PetscSqrtReal(smallest);

  return (int)PetscCeilReal(PetscLogReal(2.0 / rtol) / PetscLogReal((1.0 + root) / (1.0 - root)));
}

/*
   Advises to attach rigid-body modes where multigrid has none and the trial shows that it needs them; first of its
   severity, because the price is measured
*/
static PetscErrorCode DiagnoseModes(const AinsworthSolver *solver, PetscInt iterations, PetscReal smallest,
                                    AinsworthDiagnosis *d, PetscBool *missed)
{
  static const char remedy[] = "Attach modes with MatSetNearNullSpace(), or coordinates with PCSetCoordinates() or to "
                               "the DM of A";
  const PetscInt    bs       = solver->saddle->bs;
  PetscBool         multigrid;
  PC                inner;
  PetscReal         rtol;
  char              modes[128];

  PetscFunctionBegin;
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &multigrid, PCBLOCKSA, PCGAMG, ""));
  PetscCall(AinsworthSaddleDescribeModes(solver->saddle.get(), modes, sizeof(modes)));
  *missed = (PetscBool)(multigrid && !modes[0] && (bs == 2 || bs == 3) &&
                        (smallest > 0.0 ? smallest < missing : iterations > many));
  if (!*missed) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetTolerances(solver->inner.ksp, &rtol, NULL, NULL, NULL));
  if (smallest > 0.0)
    AinsworthDiagnosisAdd(d, AINSWORTH_COSTLY, "modes_forgotten", AinsworthJSON(smallest),
                          "Multigrid does not know the rigid-body modes: the trial takes %" PetscInt_FMT
                          " iterations, as its eigenvalues go down to %.2g. With modes they usually stay above %.2g, "
                          "which takes at most %d. %s",
                          iterations, (double)smallest, (double)usual, AtMost(rtol, usual), remedy);
  else
    AinsworthDiagnosisAdd(d, AINSWORTH_COSTLY, "modes_forgotten", AinsworthJSON(iterations),
                          "Multigrid does not know the rigid-body modes: the trial takes %" PetscInt_FMT
                          " iterations, with modes 15 to 30 are usual. %s",
                          iterations, remedy);
  AinsworthDiagnosisPutFirst(d, "modes_forgotten");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports the reduced system and how a trial solve of it ends */
static PetscErrorCode DiagnoseReduced(PC pc, AinsworthSolver *solver, PetscBool unchanged, AinsworthDiagnosis *d)
{
  KSPConvergedReason reason;
  PetscInt           iterations;
  PetscReal          smallest;
  PetscBool          missed = PETSC_FALSE;
  char               modes[128], why[512];
  std::string        text;
  KSPType            method;
  PCType             type;
  PC                 inner;

  PetscFunctionBegin;
  PetscCall(AinsworthDescribePmat(solver, text));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "pmat", AinsworthJSON(text.c_str()), "preconditioning matrix: %s",
                        text.c_str());
  PetscCall(KSPGetType(solver->inner.ksp, &method));
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PCGetType(inner, &type));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "solver",
                        AinsworthJSON("method", AinsworthJSON(method), "preconditioner", AinsworthJSON(type)),
                        "reduced solve: %s, preconditioned by %s", method, type);
  PetscCall(AinsworthSaddleDescribeModes(solver->saddle.get(), modes, sizeof(modes)));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "modes", AinsworthJSON(modes), "near null space of A: %s",
                        modes[0] ? modes : "constants alone, by default");
  PetscCall(AinsworthDescribeLeftOut(solver, unchanged, text));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "left_out", AinsworthJSON(text.c_str()), "left out: %s", text.c_str());
  PetscCall(AinsworthTry(pc, solver, &reason, &iterations, &smallest, why, sizeof(why)));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "trial_iterations", AinsworthJSON(iterations),
                        "trial solve with a random f: %" PetscInt_FMT " iterations, %s", iterations,
                        KSPConvergedReasons[reason]);
  if (smallest > 0.0)
    AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "smallest_eigenvalue", AinsworthJSON(smallest),
                          "its preconditioned operator has eigenvalues down to %.2g", (double)smallest);
  if (why[0]) {
    /* springs of negative stiffness: GMRES will take over */
    const bool again = reason == KSP_DIVERGED_INDEFINITE_MAT && solver->saddle->kept.D;

    if (!again) ConfirmSigns(d);
    AinsworthDiagnosisAdd(d, again ? AINSWORTH_DOUBTFUL : AINSWORTH_FATAL, "trial",
                          AinsworthJSON(KSPConvergedReasons[reason]), "%s", why);
  }
  if (!why[0]) PetscCall(DiagnoseModes(solver, iterations, smallest, d, &missed));
  if (!why[0] && !missed && iterations > slow)
    AinsworthDiagnosisAdd(d, AINSWORTH_COSTLY, "slow", AinsworthJSON(iterations),
                          "The reduced solve takes %" PetscInt_FMT
                          " iterations: multigrid does not fit A, as with elements stretched far, nearly "
                          "incompressible material or thin structures; see that "
                          "rigid-body modes are attached with MatSetNearNullSpace(), or use -%spc_type cholesky",
                          iterations, AinsworthSolverPrefix(solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthDiagnose - prints what is known at a stage of set-up, and the advice after the last stage; collective

   unchanged: there was nothing to set up
*/
PetscErrorCode AinsworthDiagnose(PC pc, AinsworthSolver *solver, const AinsworthSaddleInputs &inputs,
                                 AinsworthStage stage, PetscBool unchanged, AinsworthDiagnosis *d)
{
  static const char *const titles[] = {"what was passed", "the blocks", "the constraints", "the reduced system"};
  MPI_Comm                 comm     = PetscObjectComm((PetscObject)pc);

  PetscFunctionBegin;
  if (!d || d->finished) PetscFunctionReturn(PETSC_SUCCESS);
  switch (stage) {
  case AINSWORTH_STAGE_PASSED:
    PetscCall(AinsworthDiagnosePassed(inputs, d));
    break;
  case AINSWORTH_STAGE_BLOCKS:
    PetscCall(AinsworthDiagnoseBlocks(solver, d));
    break;
  case AINSWORTH_STAGE_CONSTRAINTS:
    PetscCall(DiagnoseDependence(solver, d));
    if (solver->saddle->constraints()) PetscCall(DiagnoseGram(solver, d));
    if (solver->saddle->constraints()) PetscCall(DiagnoseFill(solver, d));
    break;
  case AINSWORTH_STAGE_REDUCED:
    PetscCall(DiagnoseReduced(pc, solver, unchanged, d));
    d->finished = true;
  }
  PetscCall(AinsworthDiagnosisPrintFacts(d, comm, titles[stage]));
  if (d->finished) PetscCall(AinsworthDiagnosisPrintAdvice(d, comm));
  PetscCall(AinsworthDiagnosisSave(d, comm, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the trial failed for the same cause: the texts may differ in numbers after the colon */
static bool ToldByTrial(const AinsworthDiagnosis *d, const std::string &why)
{
  for (const AinsworthFinding &finding : d->findings)
    if (finding.key == "trial" && finding.sentence.compare(0, why.find(':'), why, 0, why.find(':')) == 0) return true;
  return false;
}

/*
   AinsworthDiagnoseFailure - reports why a set-up or a solve ended; code: an error, after which nothing is collective
*/
PetscErrorCode AinsworthDiagnoseFailure(MPI_Comm comm, AinsworthDiagnosis *d, PetscErrorCode code, const char why[])
{
  AinsworthErrorText message = NULL;

  PetscFunctionBegin;
  if (!d) PetscFunctionReturn(PETSC_SUCCESS);
  if (code) PetscCall(PetscErrorMessage(code, NULL, &message));
  if (code) why = message ? message : "";
  if (why[0] && !ToldByTrial(d, why))
    AinsworthDiagnosisAdd(d, AINSWORTH_FATAL, code ? "error" : "failure", AinsworthJSON(why), "%s", why);
  ConfirmSigns(d);
  d->finished = true;
  PetscCall(AinsworthDiagnosisPrintAdvice(d, comm));
  PetscCall(AinsworthDiagnosisSave(d, comm, code ? PETSC_FALSE : PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
