/* The doctor: what set-up sees, stage by stage, and what is wrong with it, before anything is solved (docs/diagnose.md) */
#include "pcainsworth.h"
#include "../operator/matainsworth.h"
#include "../saddle/survey.h"
#include <petsc/private/pcimpl.h>

/* Advice is given from these on: rows of C whose norms differ so much, ... */
static const PetscReal unlikeRows = 1e8;
/* ... neighbors in A whose stiffness differs so much, ... */
static const PetscReal largeJump = 1e6;
/* ... a row of C on this part of the unknowns, an unknown in this part of the rows, once they are more than ... */
static const PetscReal muchOf = 0.25;
static const PetscInt  many   = 100;
/* ... a factor of S of so many operations, ... */
static const PetscReal heavy = 1e11;
/* ... a trial solve of so many iterations */
static const PetscInt slow = 100;

static const AinsworthFindingType FACT = AINSWORTH_FINDING_FACT, COSTLY = AINSWORTH_FINDING_COSTLY, DOUBTFUL = AINSWORTH_FINDING_DOUBTFUL,
                                  FATAL = AINSWORTH_FINDING_FATAL;

/* What the program passed, of which nothing is known yet */
static PetscErrorCode DiagnosePassed(PC pc, AinsworthDiagnosis *d)
{
  PetscInt    rows, cols, nr, nc;
  PetscMPIInt size;
  PetscBool   nest;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)pc), &size));
  PetscCall(MatGetSize(pc->mat, &rows, &cols));
  AinsworthDiagnosisAdd(d, FACT, "matrix",
                        AinsworthJSON({
                          {"type",  AinsworthJSON(((PetscObject)pc->mat)->type_name)},
                          {"rows",  AinsworthJSON(rows)                             },
                          {"ranks", AinsworthJSON((PetscInt)size)                   }
  }),
                        "matrix: %s, %" PetscInt_FMT " x %" PetscInt_FMT ", on %d rank%s%s", ((PetscObject)pc->mat)->type_name, rows, cols, size,
                        size > 1 ? "s" : "", pc->pmat == pc->mat ? "" : "; Pmat is another");
  PetscCall(PetscObjectTypeCompare((PetscObject)pc->mat, MATNEST, &nest));
  if (!nest) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNestGetSize(pc->mat, &nr, &nc));
  for (PetscInt i = 0; i < nr; i++) {
    for (PetscInt j = 0; j < nc; j++) {
      const std::string key = "block_" + std::to_string(i) + "_" + std::to_string(j);
      Mat               block;

      PetscCall(MatNestGetSubMat(pc->mat, i, j, &block));
      if (!block) continue;
      PetscCall(MatGetSize(block, &rows, &cols));
      AinsworthDiagnosisAdd(d, FACT, key.c_str(),
                            AinsworthJSON({
                              {"type",    AinsworthJSON(((PetscObject)block)->type_name)},
                              {"rows",    AinsworthJSON(rows)                           },
                              {"columns", AinsworthJSON(cols)                           }
      }),
                            "block (%" PetscInt_FMT ",%" PetscInt_FMT "): %s, %" PetscInt_FMT " x %" PetscInt_FMT, i, j, ((PetscObject)block)->type_name, rows,
                            cols);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A range of moduli, with the rows that have the ends of it */
static void AddRange(AinsworthDiagnosis *d, const char key[], const char what[], const AinsworthSurvey &s)
{
  const std::string value = AinsworthJSON({
    {"least",     AinsworthJSON(s.least)   },
    {"least_row", AinsworthJSON(s.leastRow)},
    {"most",      AinsworthJSON(s.most)    },
    {"most_row",  AinsworthJSON(s.mostRow) },
    {"zero",      AinsworthJSON(s.zero)    },
    {"negative",  AinsworthJSON(s.negative)}
  });

  AinsworthDiagnosisAdd(d, FACT, key, value,
                        "%s: %.3g (row %" PetscInt_FMT ") to %.3g (row %" PetscInt_FMT "), %" PetscInt_FMT " zero, %" PetscInt_FMT " negative", what,
                        (double)s.least, s.leastRow, (double)s.most, s.mostRow, s.zero, s.negative);
}

/* A and its diagonal */
static PetscErrorCode DiagnoseA(const AinsworthSaddle *sp, Mat A, PetscBool symmetric, AinsworthDiagnosis *d)
{
  AinsworthSurvey diagonal;
  MatInfo         info;
  PetscInt        loose, first;

  PetscFunctionBegin;
  PetscCall(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
  AinsworthDiagnosisAdd(d, FACT, "A_entries", AinsworthJSON((PetscReal)info.nz_used), "A: %.0f entries, %s%s", (double)info.nz_used,
                        symmetric ? "symmetric" : "not symmetric", sp->sign ? ", with the other sign as the program's" : "");
  AinsworthDiagnosisAdd(d, FACT, "block_size", AinsworthJSON(sp->bs), "block size of A: %" PetscInt_FMT " (%s)", sp->bs, sp->bsSource);
  PetscCall(AinsworthSurveyDiagonal(A, &diagonal));
  AddRange(d, "A_diagonal", "diagonal of A", diagonal);
  if (diagonal.negative)
    AinsworthDiagnosisAdd(d, DOUBTFUL, "negative_diagonal", AinsworthJSON(diagonal.firstNegative),
                          "%" PetscInt_FMT " of %" PetscInt_FMT " entries of the diagonal of A are negative, the first in row %" PetscInt_FMT
                          ": A is not positive definite; is its sign that of the other blocks, are its values those that were meant?",
                          diagonal.negative, diagonal.negative + diagonal.positive + diagonal.zero, diagonal.firstNegative);
  PetscCall(AinsworthSurveyLoose(A, sp->rowsB, &loose, &first));
  if (loose)
    AinsworthDiagnosisAdd(d, FATAL, "loose_unknowns", AinsworthJSON(loose),
                          "%" PetscInt_FMT " unknowns are in no equation, the first is row %" PetscInt_FMT
                          " of the primal field: their rows of A are zero and no constraint holds them; remove them or give them a row",
                          loose, first);
  if (!strcmp(sp->bsSource, "the pattern of A"))
    AinsworthDiagnosisAdd(d, COSTLY, "block_size_forgotten", AinsworthJSON(sp->bs),
                          "Nodes have %" PetscInt_FMT " unknowns, by the pattern of A, but no one said so: call MatSetBlockSize(A,%" PetscInt_FMT
                          ") or use -pc_ainsworth_block_size %" PetscInt_FMT,
                          sp->bs, sp->bs, sp->bs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What A has beside, or in place of, the stiffness of bodies */
static PetscErrorCode DiagnoseStiffness(const PC_Ainsworth *data, Mat A, AinsworthDiagnosis *d)
{
  AinsworthJump jump;
  PetscBool     penalty = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(AinsworthSurveyJump(A, data->saddle.bs, &jump));
  AinsworthDiagnosisAdd(d, FACT, "A_jump", AinsworthJSON(jump.quotient), "diagonal of A: neighbors differ by up to a factor of %.3g", (double)jump.quotient);
  PetscCall(AinsworthSurveyPenalty(A, data->saddle.C, &penalty));
  if (penalty)
    AinsworthDiagnosisAdd(d, DOUBTFUL, "penalty_in_A", "true",
                          "A seems to have penalty terms beta C'C of the same constraints, far larger than the rest of it: leave them out, the constraints "
                          "hold without, and multigrid suffers");
  else if (jump.quotient >= largeJump)
    AinsworthDiagnosisAdd(d, COSTLY, "jump_in_A", AinsworthJSON(jump.quotient),
                          "The stiffness jumps by a factor of %.3g inside a body, between rows %" PetscInt_FMT " and %" PetscInt_FMT
                          " of A: are units and materials what was meant? Multigrid may be slow; -%spc_type cholesky does not feel it",
                          (double)jump.quotient, jump.row, jump.col, ((PetscObject)data->ksp)->prefix);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C itself in the place of its transpose, or another block that is not */
static PetscErrorCode DiagnoseOtherSide(const AinsworthSaddle *sp, PetscBool symmetric, AinsworthDiagnosis *d)
{
  PetscBool same = PETSC_FALSE, square;
  PetscInt  local[2];

  PetscFunctionBegin;
  AinsworthDiagnosisAdd(d, FACT, "other_block", AinsworthJSON(sp->rowsB == sp->rowsC ? sp->negated ? "-C'" : "C'" : "B'"),
                        sp->rowsB != sp->rowsC ? "block (0,1): not the transpose of C"
                        : sp->negated          ? "block (0,1): -C'"
                                               : "block (0,1): C'");
  if (sp->rowsB == sp->rowsC) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(sp->rowsC, &local[0], &local[1]));
  square = (PetscBool)(local[0] == local[1]);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &square, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)sp->rowsC)));
  if (square) { /* otherwise C does not fit there */
    Mat Ct;

    PetscCall(MatHermitianTranspose(sp->rowsB, MAT_INITIAL_MATRIX, &Ct));
    PetscCall(AinsworthMatEqual(Ct, sp->rowsC, &same));
    PetscCall(MatDestroy(&Ct));
  }
  if (same)
    AinsworthDiagnosisAdd(d, DOUBTFUL, "C_for_transpose", "true",
                          "Block (0,1) is C itself, where its transpose belongs: pass MatCreateTranspose(C,&Ct), or leave the block absent");
  else if (symmetric)
    AinsworthDiagnosisAdd(
      d, DOUBTFUL, "not_transpose", "true",
      "Block (0,1) is not the transpose of C though A is symmetric: GMRES takes the place of conjugate gradients; unless that is friction or "
      "the like, leave the block absent");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The block of the multipliers, where it is not zero */
static PetscErrorCode DiagnoseD(const AinsworthSaddle *sp, AinsworthDiagnosis *d)
{
  AinsworthSurvey diagonal;
  MatInfo         info;

  PetscFunctionBegin;
  if (!sp->rowsD) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetInfo(sp->rowsD, MAT_GLOBAL_SUM, &info));
  AinsworthDiagnosisAdd(d, FACT, "D_entries", AinsworthJSON((PetscReal)info.nz_used), "D, of the multipliers: %.0f entries", (double)info.nz_used);
  PetscCall(AinsworthSurveyDiagonal(sp->rowsD, &diagonal));
  AddRange(d, "D_diagonal", "diagonal of D", diagonal);
  if (diagonal.negative)
    AinsworthDiagnosisAdd(d, DOUBTFUL, "D_sign", AinsworthJSON(diagonal.negative),
                          "The block of the multipliers has the wrong sign in %" PetscInt_FMT " rows, the first is %" PetscInt_FMT
                          " of the multiplier field: in [A C'; C -D] D is positive semidefinite, a flexibility; change the sign of the block",
                          diagonal.negative, diagonal.firstNegative);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C: lengths and scales of its rows, unknowns that rows share */
static PetscErrorCode DiagnoseC(const AinsworthSaddle *sp, AinsworthDiagnosis *d)
{
  AinsworthSurvey norms;
  MatInfo         info;
  PetscInt        n, m, longest, row, most, column;
  char            kinds[256];

  PetscFunctionBegin;
  PetscCall(MatGetSize(sp->rowsC, &m, &n));
  PetscCall(MatGetInfo(sp->rowsC, MAT_GLOBAL_SUM, &info));
  AinsworthDiagnosisAdd(d, FACT, "C_entries", AinsworthJSON((PetscReal)info.nz_used), "C: %.0f entries", (double)info.nz_used);
  PetscCall(AinsworthSaddleDescribeRows(sp, kinds, sizeof(kinds)));
  AinsworthDiagnosisAdd(d, FACT, "constraints", AinsworthJSON(sp->count[AINSWORTH_ROW_CONSTRAINT]), "rows of C: %" PetscInt_FMT " constraints%s",
                        sp->count[AINSWORTH_ROW_CONSTRAINT], kinds);
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSurveyRows(sp->rowsC, &norms, &longest, &row));
  PetscCall(AinsworthSurveyColumns(sp->rowsC, &most, &column));
  AddRange(d, "C_row", "norms of rows of C", norms);
  AinsworthDiagnosisAdd(d, FACT, "longest_row",
                        AinsworthJSON({
                          {"entries", AinsworthJSON(longest)},
                          {"row",     AinsworthJSON(row)    }
  }),
                        "longest row of C: %" PetscInt_FMT " entries, row %" PetscInt_FMT, longest, row);
  AinsworthDiagnosisAdd(d, FACT, "most_shared",
                        AinsworthJSON({
                          {"rows",    AinsworthJSON(most)  },
                          {"unknown", AinsworthJSON(column)}
  }),
                        "most shared unknown: in %" PetscInt_FMT " rows of C, row %" PetscInt_FMT " of A", most, column);
  if (norms.most > unlikeRows * norms.least)
    AinsworthDiagnosisAdd(d, DOUBTFUL, "scales_of_rows", AinsworthJSON(norms.most / norms.least),
                          "Rows of C differ by a factor of %.3g, from row %" PetscInt_FMT " to row %" PetscInt_FMT
                          " of the multiplier field: are they in the same units? The projection does not depend on it, g and the multipliers do",
                          (double)(norms.most / norms.least), norms.leastRow, norms.mostRow);
  if (longest > many && (PetscReal)longest > muchOf * (PetscReal)n)
    AinsworthDiagnosisAdd(
      d, COSTLY, "long_row", AinsworthJSON(longest),
      "Row %" PetscInt_FMT " of the multiplier field has %" PetscInt_FMT " entries, for %" PetscInt_FMT
      " unknowns: it is exact in the projection; where it would fill the preconditioning matrix it is left out of that, and iterations may rise",
      row, longest, n);
  if (most > many && (PetscReal)most > muchOf * (PetscReal)m)
    AinsworthDiagnosisAdd(d, COSTLY, "shared_unknown", AinsworthJSON(most),
                          "Row %" PetscInt_FMT " of the primal field is in %" PetscInt_FMT " of %" PetscInt_FMT
                          " rows of C: the Gram matrix would be dense, the projection does not move such unknowns; ties to a few nodes each are cheaper",
                          column, most, m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The blocks, as they were found */
static PetscErrorCode DiagnoseMatrices(PC_Ainsworth *data, AinsworthDiagnosis *d)
{
  const AinsworthSaddle *sp = &data->saddle;
  char                   layout[256];
  PetscInt               n, m;
  Mat                    opaque, A;

  PetscFunctionBegin;
  PetscCall(MatGetSize(sp->rowsC, &m, &n));
  AinsworthDiagnosisAdd(d, FACT, "sizes",
                        AinsworthJSON({
                          {"unknowns",    AinsworthJSON(n)},
                          {"multipliers", AinsworthJSON(m)}
  }),
                        "sizes: %" PetscInt_FMT " unknowns, %" PetscInt_FMT " multipliers", n, m);
  PetscCall(AinsworthSaddleDescribeLayout(sp, layout, sizeof(layout)));
  AinsworthDiagnosisAdd(d, FACT, "layout", AinsworthJSON(layout), "layout: %s", layout);
  PetscCall(AinsworthFindOpaque(sp->A, &opaque));
  if (!opaque) {
    PetscCall(AinsworthGetAIJ(sp->A, &A));
    PetscCall(DiagnoseA(sp, A, data->symmetric, d));
    PetscCall(DiagnoseStiffness(data, A, d));
    PetscCall(MatDestroy(&A));
  }
  PetscCall(DiagnoseC(sp, d));
  PetscCall(DiagnoseOtherSide(sp, data->symmetric, d));
  PetscCall(DiagnoseD(sp, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows that depend on others, or nearly so */
static PetscErrorCode DiagnoseDependence(PC_Ainsworth *data, AinsworthDiagnosis *d)
{
  const AinsworthSaddle *sp    = &data->saddle;
  const PetscInt         count = sp->count[AINSWORTH_ROW_DEPENDENT];
  char                   names[128];
  PetscBool              doubtful = PETSC_FALSE;
  PetscInt               n, *rows;

  PetscFunctionBegin;
  AinsworthDiagnosisAdd(d, FACT, "dependent_rows", AinsworthJSON(count), "dependent rows of C: %" PetscInt_FMT, count);
  if (count) {
    PetscCall(AinsworthSaddleNameKind(sp, AINSWORTH_ROW_DEPENDENT, names, sizeof(names)));
    AinsworthDiagnosisAdd(d, DOUBTFUL, "dependent", AinsworthJSON(count),
                          "%" PetscInt_FMT " rows of C are %s others, rows %s of the multiplier field: they are left out and their multipliers zero; remove "
                          "them, a constraint that is said twice among them, or see that g agrees",
                          count, sp->nearly ? "combinations, exactly or nearly, of" : "combinations of", names);
  }
  if (data->reduced) PetscCall(MatAinsworthIsDoubtful_Private(data->reduced, &doubtful));
  if (!doubtful) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAinsworthFindNear_Private(data->reduced, &n, &rows));
  PetscCall(AinsworthSaddleNameKept(sp, n, rows, names, sizeof(names)));
  PetscCall(PetscFree(rows));
  AinsworthDiagnosisAdd(d, DOUBTFUL, "nearly_dependent", AinsworthJSON(n),
                        "%" PetscInt_FMT
                        " rows of C are nearly combinations of others, rows %s of the multiplier field: solves are refined, but multipliers and "
                        "what contradicts in g grow; remove such rows or make them exact",
                        n, names);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S, its pieces and its factor */
static PetscErrorCode DiagnoseGram(PC_Ainsworth *data, AinsworthDiagnosis *d)
{
  Mat_Ainsworth *ctx;
  char           text[256];
  PetscReal      cost[2], most; /* entries and operations */

  PetscFunctionBegin;
  PetscCall(MatAinsworthGetContext_Private(data->reduced, &ctx));
  const AinsworthGram *gram = &ctx->proj.gram;

  PetscCall(AinsworthGramDescribe(gram, text, sizeof(text)));
  AinsworthDiagnosisAdd(d, FACT, "pieces",
                        AinsworthJSON({
                          {"pieces",  AinsworthJSON(gram->placement.components)},
                          {"largest", AinsworthJSON(gram->placement.largest)   }
  }),
                        "%s", text);
  cost[0] = gram->factor.cost.entries;
  cost[1] = gram->factor.cost.operations;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, cost, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)data->reduced)));
  PetscCall(MPIU_Allreduce(&gram->factor.cost.operations, &most, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)data->reduced)));
  cost[0] *= (PetscReal)sizeof(PetscScalar);
  AinsworthDiagnosisAdd(d, FACT, "factor",
                        AinsworthJSON({
                          {"bytes",      AinsworthJSON(cost[0])},
                          {"operations", AinsworthJSON(cost[1])}
  }),
                        "factor of S, predicted: %.3g MB, %.3g operations", (double)(cost[0] / 1e6), (double)cost[1]);
  if (most > heavy)
    AinsworthDiagnosisAdd(d, COSTLY, "heavy_factor", AinsworthJSON(most),
                          "The factor of S takes %.3g operations on one rank: constraints share too many unknowns; more ranks take part with a smaller "
                          "-pc_ainsworth_rows_per_rank",
                          (double)most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What M_* will have, by what is known of A and C: before it is made */
static PetscErrorCode DiagnoseFill(PC_Ainsworth *data, AinsworthDiagnosis *d)
{
  static const PetscReal entry = (PetscReal)(sizeof(PetscScalar) + sizeof(PetscInt));
  AinsworthPmatFill      fill;
  PetscReal              jcb;
  Mat                    A;

  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(data->saddle.A, &A));
  PetscCall(AinsworthPmatGetFill(A, data->saddle.C, &fill));
  PetscCall(AinsworthPmatPredict(A, data->saddle.C, NULL, &fill, &jcb));
  PetscCall(MatDestroy(&A));
  AinsworthDiagnosisAdd(d, FACT, "memory",
                        AinsworthJSON({
                          {"A_bytes",   AinsworthJSON(entry * fill.entries)                 },
                          {"id_bytes",  AinsworthJSON(entry * (fill.entries + fill.squares))},
                          {"jcb_bytes", AinsworthJSON(entry * jcb)                          }
  }),
                        "A has %.3g MB; the preconditioning matrix, predicted: at most %.3g MB as id, %.3g MB as jcb", (double)(entry * fill.entries / 1e6),
                        (double)(entry * (fill.entries + fill.squares) / 1e6), (double)(entry * jcb / 1e6));
  AinsworthDiagnosisAdd(d, FACT, "long_rows", AinsworthJSON(fill.leftOut), "long rows of C, left out of the preconditioning matrix: %" PetscInt_FMT,
                        fill.leftOut);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Signs that are wrong explain a failure */
static void ConfirmSigns(AinsworthDiagnosis *d)
{
  for (const char *key : {"negative_diagonal", "D_sign"}) AinsworthDiagnosisConfirm(d, key);
}

/* The reduced system is there: how well can it be solved? */
static PetscErrorCode DiagnoseReduced(PC pc, PC_Ainsworth *data, AinsworthDiagnosis *d)
{
  KSPConvergedReason reason;
  PetscInt           iterations;
  char               why[512];
  std::string        text;
  KSPType            method;
  PCType             type;
  PC                 inner;

  PetscFunctionBegin;
  PetscCall(PCAinsworthDescribePmat_Private(data, text));
  AinsworthDiagnosisAdd(d, FACT, "pmat", AinsworthJSON(text.c_str()), "preconditioning matrix: %s", text.c_str());
  PetscCall(KSPGetType(data->ksp, &method));
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCGetType(inner, &type));
  AinsworthDiagnosisAdd(d, FACT, "solver",
                        AinsworthJSON({
                          {"method",         AinsworthJSON(method)},
                          {"preconditioner", AinsworthJSON(type)  }
  }),
                        "reduced solve: %s, preconditioned by %s", method, type);
  PetscCall(PCAinsworthDescribeLeftOut_Private(data, text));
  AinsworthDiagnosisAdd(d, FACT, "left_out", AinsworthJSON(text.c_str()), "left out: %s", text.c_str());
  PetscCall(PCAinsworthTry_Private(pc, data, &reason, &iterations, why, sizeof(why)));
  AinsworthDiagnosisAdd(d, FACT, "trial_iterations", AinsworthJSON(iterations), "trial solve with a random f: %" PetscInt_FMT " iterations, %s", iterations,
                        KSPConvergedReasons[reason]);
  if (why[0]) {
    ConfirmSigns(d);
    AinsworthDiagnosisAdd(d, FATAL, "trial", AinsworthJSON(KSPConvergedReasons[reason]), "%s", why);
  }
  if (!why[0] && iterations > slow)
    AinsworthDiagnosisAdd(
      d, COSTLY, "slow", AinsworthJSON(iterations),
      "The reduced solve takes %" PetscInt_FMT
      " iterations: multigrid does not fit A, as with elements stretched far, nearly incompressible material or thin structures; attach the "
      "rigid-body modes with MatSetNearNullSpace(), or use -%spc_type cholesky",
      iterations, ((PetscObject)data->ksp)->prefix);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthDiagnose_Private - what is known at a stage of the set-up, printed at once; after the last one the advice. Collective */
PetscErrorCode PCAinsworthDiagnose_Private(PC pc, PC_Ainsworth *data, PCAinsworthStage stage)
{
  static const char *const titles[] = {"what was passed", "the blocks", "the constraints", "the reduced system"};
  AinsworthDiagnosis      *d        = data->diagnosis.get();
  MPI_Comm                 comm     = PetscObjectComm((PetscObject)pc);

  PetscFunctionBegin;
  if (!d || d->finished) PetscFunctionReturn(PETSC_SUCCESS);
  switch (stage) {
  case PC_AINSWORTH_STAGE_PASSED:
    PetscCall(DiagnosePassed(pc, d));
    break;
  case PC_AINSWORTH_STAGE_BLOCKS:
    PetscCall(DiagnoseMatrices(data, d));
    break;
  case PC_AINSWORTH_STAGE_CONSTRAINTS:
    PetscCall(DiagnoseDependence(data, d));
    if (data->constraints) PetscCall(DiagnoseGram(data, d));
    if (data->constraints) PetscCall(DiagnoseFill(data, d));
    break;
  case PC_AINSWORTH_STAGE_REDUCED:
    PetscCall(DiagnoseReduced(pc, data, d));
    d->finished = true;
  }
  PetscCall(AinsworthDiagnosisPrintFacts(d, comm, titles[stage]));
  if (d->finished) PetscCall(AinsworthDiagnosisPrintAdvice(d, comm));
  PetscCall(AinsworthDiagnosisSave(d, comm, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthDiagnoseFailure_Private - a set-up or a solve ended, and why; code: with an error, after which nothing is collective */
PetscErrorCode PCAinsworthDiagnoseFailure_Private(PC pc, PC_Ainsworth *data, PetscErrorCode code, const char why[])
{
  AinsworthDiagnosis *d       = data->diagnosis.get();
  char               *message = NULL;

  PetscFunctionBegin;
  if (!d) PetscFunctionReturn(PETSC_SUCCESS);
  if (code) PetscCall(PetscErrorMessage(code, NULL, &message));
  if (code) why = message ? message : "";
  if (why[0]) AinsworthDiagnosisAdd(d, FATAL, code ? "error" : "failure", AinsworthJSON(why), "%s", why);
  if (!d->finished) ConfirmSigns(d);
  d->finished = true;
  PetscCall(AinsworthDiagnosisPrintAdvice(d, PetscObjectComm((PetscObject)pc)));
  PetscCall(AinsworthDiagnosisSave(d, PetscObjectComm((PetscObject)pc), code ? PETSC_FALSE : PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthDiagnoseFromOptions_Private - -pc_ainsworth_diagnose, with or without a file */
PetscErrorCode PCAinsworthDiagnoseFromOptions_Private(PC pc, PC_Ainsworth *data, AinsworthOptionItems PetscOptionsObject)
{
  char      file[PETSC_MAX_PATH_LEN] = "";
  PetscBool set, yes, no;

  PetscFunctionBegin;
  PetscCall(PetscOptionsString("-pc_ainsworth_diagnose", "Prints what set-up finds, and advice, [also as JSON to this file]", PCAINSWORTH, file, file,
                               sizeof(file), &set));
  PetscCall(PetscStrInList(file, "true,yes,on,1", ',', &yes));
  PetscCall(PetscStrInList(file, "false,no,off,0", ',', &no));
  if (!set || no) data->diagnosis.reset();
  else if (!data->diagnosis || data->diagnosis->file != (yes ? "" : file)) {
    data->diagnosis.reset(new AinsworthDiagnosis());
    if (!yes) data->diagnosis->file = file;
    PetscCall(AinsworthDiagnosisSave(data->diagnosis.get(), PetscObjectComm((PetscObject)pc), PETSC_TRUE)); /* can it be written? */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
