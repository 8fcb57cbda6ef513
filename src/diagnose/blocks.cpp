/* Diagnosis of the blocks: sizes, signs, scales, long rows, and shared unknowns (docs/troubleshooting.md) */
#include "diagnose.h"
#include "survey.h"

/* Ratio of the norms of rows of C above which there is advice */
static const PetscReal unlikeRows = 1e8;
/* Jump of the stiffness between neighbors in A from which there is advice */
static const PetscReal largeJump = 1e6;
/*
   Part of the unknowns in a row of C, and of the rows that share an unknown, above which there is advice if these are
   also more than longRow
*/
static const PetscReal muchOf  = 0.25;
static const PetscInt  longRow = 100;

/* AinsworthDiagnosePassed - reports the matrix that the program passed */
PetscErrorCode AinsworthDiagnosePassed(const AinsworthSaddleInputs &inputs, AinsworthDiagnosis *d)
{
  PetscInt    rows, cols, nr, nc;
  PetscMPIInt size;
  PetscBool   nest;
  const Mat   amat = inputs.amat;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)amat), &size));
  PetscCall(MatGetSize(amat, &rows, &cols));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "matrix",
                        AinsworthJSON("type", AinsworthJSON(AinsworthTypeName((PetscObject)amat)), "rows",
                                      AinsworthJSON(rows), "ranks", AinsworthJSON((PetscInt)size)),
                        "matrix: %s, %" PetscInt_FMT " x %" PetscInt_FMT ", on %d rank%s%s",
                        AinsworthTypeName((PetscObject)amat), rows, cols, size, size > 1 ? "s" : "",
                        inputs.pmat == amat ? "" : "; Pmat is another");
  PetscCall(PetscObjectTypeCompare((PetscObject)amat, MATNEST, &nest));
  if (!nest) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNestGetSize(amat, &nr, &nc));
  for (PetscInt i = 0; i < nr; i++) {
    for (PetscInt j = 0; j < nc; j++) {
      const std::string key = "block_" + std::to_string(i) + "_" + std::to_string(j);
      Mat               block;

      PetscCall(MatNestGetSubMat(amat, i, j, &block));
      if (!block) continue;
      PetscCall(MatGetSize(block, &rows, &cols));
      AinsworthDiagnosisAdd(d, AINSWORTH_FACT, key.c_str(),
                            AinsworthJSON("type", AinsworthJSON(AinsworthTypeName((PetscObject)block)), "rows",
                                          AinsworthJSON(rows), "columns", AinsworthJSON(cols)),
                            "block (%" PetscInt_FMT ",%" PetscInt_FMT "): %s, %" PetscInt_FMT " x %" PetscInt_FMT, i, j,
                            AinsworthTypeName((PetscObject)block), rows, cols);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds a range of moduli with the rows at both ends */
static void AddRange(AinsworthDiagnosis *d, const char key[], const char what[], const AinsworthSurvey &s)
{
  const std::string value = AinsworthJSON("least", AinsworthJSON(s.least), "least_row", AinsworthJSON(s.leastRow),
                                          "most", AinsworthJSON(s.most), "most_row", AinsworthJSON(s.mostRow), "zero",
                                          AinsworthJSON(s.zero), "negative", AinsworthJSON(s.negative));

  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, key, value,
                        "%s: %.3g (row %" PetscInt_FMT ") to %.3g (row %" PetscInt_FMT "), %" PetscInt_FMT
                        " zero, %" PetscInt_FMT " negative",
                        what, (double)s.least, s.leastRow, (double)s.most, s.mostRow, s.zero, s.negative);
}

/* Reports A and its diagonal */
static PetscErrorCode DiagnoseA(const AinsworthSaddle *sp, Mat A, PetscBool symmetric, AinsworthDiagnosis *d)
{
  AinsworthSurvey diagonal;
  MatInfo         info;
  PetscInt        loose, first;

  PetscFunctionBegin;
  PetscCall(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "A_entries", AinsworthJSON((PetscReal)info.nz_used), "A: %.0f entries, %s%s",
                        (double)info.nz_used, symmetric ? "symmetric" : "not symmetric",
                        sp->sign ? ", with the other sign as the program's" : "");
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "block_size", AinsworthJSON(sp->bs),
                        "block size of A: %" PetscInt_FMT " (%s)", sp->bs, sp->bsSource);
  PetscCall(AinsworthSurveyDiagonal(A, &diagonal));
  AddRange(d, "A_diagonal", "diagonal of A", diagonal);
  if (diagonal.negative)
    AinsworthDiagnosisAdd(
      d, AINSWORTH_DOUBTFUL, "negative_diagonal", AinsworthJSON(diagonal.firstNegative),
      "%" PetscInt_FMT " of %" PetscInt_FMT
      " entries of the diagonal of A are negative, the first in row %" PetscInt_FMT
      ": A is not positive definite; is its sign that of the other blocks, are its values those that were meant?",
      diagonal.negative, diagonal.negative + diagonal.positive + diagonal.zero, diagonal.firstNegative);
  PetscCall(AinsworthSurveyLoose(A, sp->all.B, &loose, &first));
  if (loose)
    AinsworthDiagnosisAdd(
      d, AINSWORTH_FATAL, "loose_unknowns", AinsworthJSON(loose),
      "%" PetscInt_FMT " unknowns are in no equation, the first is row %" PetscInt_FMT
      " of the primal field: their rows of A are zero and no constraint holds them; remove them or give them a row",
      loose, first);
  if (!strcmp(sp->bsSource, "the pattern of A"))
    AinsworthDiagnosisAdd(d, AINSWORTH_COSTLY, "block_size_forgotten", AinsworthJSON(sp->bs),
                          "Nodes have %" PetscInt_FMT
                          " unknowns, by the pattern of A, but no one said so: call MatSetBlockSize(A,%" PetscInt_FMT
                          ") or use -pc_ainsworth_block_size %" PetscInt_FMT,
                          sp->bs, sp->bs, sp->bs);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports jumps of the stiffness and penalty terms in A */
static PetscErrorCode DiagnoseStiffness(const AinsworthSolver *solver, Mat A, AinsworthDiagnosis *d)
{
  AinsworthJump jump;
  PetscBool     penalty = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(AinsworthSurveyJump(A, solver->saddle->bs, &jump));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "A_jump", AinsworthJSON(jump.quotient),
                        "diagonal of A: neighbors differ by up to a factor of %.3g", (double)jump.quotient);
  PetscCall(AinsworthSurveyPenalty(A, solver->saddle->kept.C, &penalty));
  if (penalty)
    AinsworthDiagnosisAdd(d, AINSWORTH_DOUBTFUL, "penalty_in_A", "true",
                          "A seems to have penalty terms beta C'C of the same constraints, far larger than the rest of "
                          "it: leave them out, the constraints "
                          "hold without, and multigrid suffers");
  else if (jump.quotient >= largeJump)
    AinsworthDiagnosisAdd(
      d, AINSWORTH_COSTLY, "jump_in_A", AinsworthJSON(jump.quotient),
      "The stiffness jumps by a factor of %.3g inside a body, between rows %" PetscInt_FMT " and %" PetscInt_FMT
      " of A: are units and materials what was meant? Multigrid may be slow; -%spc_type cholesky does not feel it",
      (double)jump.quotient, jump.row, jump.col, AinsworthSolverPrefix(solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports whether block (0,1) is the transpose of C, C itself by mistake, or another block */
static PetscErrorCode DiagnoseOtherSide(const AinsworthSaddle *sp, PetscBool symmetric, AinsworthDiagnosis *d)
{
  PetscBool same = PETSC_FALSE, square;
  PetscInt  local[2];

  PetscFunctionBegin;
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "other_block",
                        AinsworthJSON(sp->oneSided() ? sp->negated ? "-C'" : "C'" : "B'"),
                        !sp->oneSided() ? "block (0,1): not the transpose of C"
                        : sp->negated   ? "block (0,1): -C'"
                                        : "block (0,1): C'");
  if (sp->oneSided()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(sp->all.C, &local[0], &local[1]));
  square = (PetscBool)(local[0] == local[1]);
  PetscCall(
    MPIU_Allreduce(MPI_IN_PLACE, &square, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)sp->all.C)));
  if (square) { /* otherwise it cannot be C */
    Mat Ct;

    PetscCall(MatHermitianTranspose(sp->all.B, MAT_INITIAL_MATRIX, &Ct));
    PetscCall(AinsworthMatEqual(Ct, sp->all.C, &same));
    PetscCall(MatDestroy(&Ct));
  }
  if (same)
    AinsworthDiagnosisAdd(d, AINSWORTH_DOUBTFUL, "C_for_transpose", "true",
                          "Block (0,1) is C itself, where its transpose belongs: pass MatCreateTranspose(C,&Ct), or "
                          "leave the block absent");
  else if (symmetric)
    AinsworthDiagnosisAdd(d, AINSWORTH_DOUBTFUL, "not_transpose", "true",
                          "Block (0,1) is not the transpose of C though A is symmetric: GMRES takes the place of "
                          "conjugate gradients; unless that is friction or "
                          "the like, leave the block absent");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports D, the block of the multipliers, if it is nonzero */
static PetscErrorCode DiagnoseD(const AinsworthSaddle *sp, AinsworthDiagnosis *d)
{
  AinsworthSurvey diagonal;
  MatInfo         info;

  PetscFunctionBegin;
  if (!sp->all.D) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetInfo(sp->all.D, MAT_GLOBAL_SUM, &info));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "D_entries", AinsworthJSON((PetscReal)info.nz_used),
                        "D, of the multipliers: %.0f entries", (double)info.nz_used);
  PetscCall(AinsworthSurveyDiagonal(sp->all.D, &diagonal));
  AddRange(d, "D_diagonal", "diagonal of D", diagonal);
  if (diagonal.negative)
    AinsworthDiagnosisAdd(d, AINSWORTH_DOUBTFUL, "D_sign", AinsworthJSON(diagonal.negative),
                          "The block of the multipliers has the wrong sign in %" PetscInt_FMT
                          " rows, the first is %" PetscInt_FMT
                          " of the multiplier field: in [A C'; C -D] D is positive semidefinite, a flexibility; change "
                          "the sign of the block",
                          diagonal.negative, diagonal.firstNegative);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reports C: lengths and scales of its rows, unknowns that rows share */
static PetscErrorCode DiagnoseC(const AinsworthSaddle *sp, AinsworthDiagnosis *d)
{
  AinsworthSurvey norms;
  MatInfo         info;
  PetscInt        n, m, longest, row, most, column;
  char            kinds[256];

  PetscFunctionBegin;
  PetscCall(MatGetSize(sp->all.C, &m, &n));
  PetscCall(MatGetInfo(sp->all.C, MAT_GLOBAL_SUM, &info));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "C_entries", AinsworthJSON((PetscReal)info.nz_used), "C: %.0f entries",
                        (double)info.nz_used);
  PetscCall(AinsworthSaddleDescribeRows(sp, kinds, sizeof(kinds)));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "constraints", AinsworthJSON(sp->count[AINSWORTH_ROW_CONSTRAINT]),
                        "rows of C: %" PetscInt_FMT " constraints%s", sp->count[AINSWORTH_ROW_CONSTRAINT], kinds);
  if (!m) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthSurveyRows(sp->all.C, &norms, &longest, &row));
  PetscCall(AinsworthSurveyColumns(sp->all.C, &most, &column));
  AddRange(d, "C_row", "norms of rows of C", norms);
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "longest_row",
                        AinsworthJSON("entries", AinsworthJSON(longest), "row", AinsworthJSON(row)),
                        "longest row of C: %" PetscInt_FMT " entries, row %" PetscInt_FMT, longest, row);
  AinsworthDiagnosisAdd(
    d, AINSWORTH_FACT, "most_shared", AinsworthJSON("rows", AinsworthJSON(most), "unknown", AinsworthJSON(column)),
    "most shared unknown: in %" PetscInt_FMT " rows of C, row %" PetscInt_FMT " of A", most, column);
  if (norms.most > unlikeRows * norms.least)
    AinsworthDiagnosisAdd(d, AINSWORTH_DOUBTFUL, "scales_of_rows", AinsworthJSON(norms.most / norms.least),
                          "Rows of C differ by a factor of %.3g, from row %" PetscInt_FMT " to row %" PetscInt_FMT
                          " of the multiplier field: are they in the same units? The projection does not depend on it, "
                          "g and the multipliers do",
                          (double)(norms.most / norms.least), norms.leastRow, norms.mostRow);
  if (longest > longRow && (PetscReal)longest > muchOf * (PetscReal)n)
    AinsworthDiagnosisAdd(d, AINSWORTH_COSTLY, "long_row", AinsworthJSON(longest),
                          "Row %" PetscInt_FMT " of the multiplier field has %" PetscInt_FMT
                          " entries, for %" PetscInt_FMT
                          " unknowns: it is exact in the projection; where it would fill the preconditioning matrix it "
                          "is left out of that, and iterations may rise",
                          row, longest, n);
  if (most > longRow && (PetscReal)most > muchOf * (PetscReal)m)
    AinsworthDiagnosisAdd(d, AINSWORTH_COSTLY, "shared_unknown", AinsworthJSON(most),
                          "Row %" PetscInt_FMT " of the primal field is in %" PetscInt_FMT " of %" PetscInt_FMT
                          " rows of C: the Gram matrix would be dense, the projection does not move such unknowns; "
                          "ties to a few nodes each are cheaper",
                          column, most, m);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthDiagnoseBlocks - reports the blocks */
PetscErrorCode AinsworthDiagnoseBlocks(const AinsworthSolver *solver, AinsworthDiagnosis *d)
{
  const AinsworthSaddle *sp = solver->saddle.get();
  char                   layout[256];
  PetscInt               n, m;
  Mat                    opaque, A;

  PetscFunctionBegin;
  PetscCall(MatGetSize(sp->all.C, &m, &n));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "sizes",
                        AinsworthJSON("unknowns", AinsworthJSON(n), "multipliers", AinsworthJSON(m)),
                        "sizes: %" PetscInt_FMT " unknowns, %" PetscInt_FMT " multipliers", n, m);
  PetscCall(AinsworthSaddleDescribeLayout(sp, layout, sizeof(layout)));
  AinsworthDiagnosisAdd(d, AINSWORTH_FACT, "layout", AinsworthJSON(layout), "layout: %s", layout);
  PetscCall(AinsworthFindOpaque(sp->A, &opaque));
  if (!opaque) {
    PetscCall(AinsworthGetAIJ(sp->A, &A));
    PetscCall(DiagnoseA(sp, A, solver->saddle->symmetric, d));
    PetscCall(DiagnoseStiffness(solver, A, d));
    PetscCall(MatDestroy(&A));
  }
  PetscCall(DiagnoseC(sp, d));
  PetscCall(DiagnoseOtherSide(sp, solver->saddle->symmetric, d));
  PetscCall(DiagnoseD(sp, d));
  PetscFunctionReturn(PETSC_SUCCESS);
}
