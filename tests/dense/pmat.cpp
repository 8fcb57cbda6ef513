static char help[] = "The six M_* = C' B C + Q_*' A Q_* against dense formulas with an independent Inv(S).\n\n";

#include "pmatreference.h"

static PetscErrorCode CheckPmat(Mat A, Mat C, const System &sys, const DenseSystem &d, bool symmetric,
                                const PmatChoice &choice)
{
  KSP       outer;
  Mat       S, M;
  Dense     got, expected;
  Column    B;
  PetscBool type;
  PetscInt  bsA, bsM;

  PetscFunctionBeginUser;
  PetscCall(PmatSetUp(A, C, sys.w, choice, &outer, &S, &M));
  if (choice.inner == std::string(PCHYPRE)) PetscCall(PetscObjectTypeCompare((PetscObject)M, MATHYPRE, &type));
  else PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)M, &type, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(CheckTrue("type of M", type));
  PetscCall(MatGetBlockSize(A, &bsA));
  PetscCall(MatGetBlockSize(M, &bsM));
  PetscCall(CheckInt("block size of M", bsM, bsA));
  PetscCall(PmatReference(d, symmetric, choice, expected, B));
  /* never singular: hypre would not end its set-up */
  if (choice.inner == std::string(PCHYPRE)) expected.diagonal() *= 1.0 + 1e-12;
  PetscCall(Gather(M, got));
  PetscCall(CheckEqual("M", got, expected, 1e-13));
  /* otherwise GMRES has no C' B C in it; exact: M is the reduced operator itself */
  if (choice.type == PC_AINSWORTH_PMAT_CC && symmetric) {
    PetscCall(Gather(S, expected));
    PetscCall(CheckEqual("A~ of cc", got, expected, 1e-11));
  }
  PetscCall(KSPDestroy(&outer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Formulas(const Spec &spec, bool all)
{
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (int type = 0; type < 6; type++) {
    for (int k = 0; k < 6; k++) {
      PmatChoice choice{(PCAinsworthPmatType)type,
                        (MatAinsworthWeightType)(k % 3),
                        (AinsworthPenaltyType)(k % 2),
                        k < 4 ? (PetscReal)PETSC_DEFAULT : 2.5,
                        3,
                        k % 4 < 2};

      if (!all && k != type % 4) continue;
      Case("%s, pmat %s, weight %s, penalty %s, factor %g", spec.name, PmatName(choice.type),
           MatAinsworthWeightTypes[choice.weight], PenaltyName(choice.penalty), (double)choice.factor);
      PetscCall(CheckPmat(sys.A, sys.C, sys, d, spec.symmetric, choice));
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One block is cc and cg, as many blocks as rows are 1/diag(S): without METIS in the test */
static PetscErrorCode Blocks(const Spec &spec)
{
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (PetscInt blocks : {(PetscInt)1, (PetscInt)2, spec.m - 1, spec.m, spec.m + 5}) {
    for (PCAinsworthPmatType type : {PC_AINSWORTH_PMAT_BJ_CC, PC_AINSWORTH_PMAT_BJ_CG}) {
      PmatChoice choice{type, MAT_AINSWORTH_WEIGHT_DIAGONAL, AINSWORTH_PENALTY_ROW, PETSC_DEFAULT, blocks, true},
        same = choice;
      Dense  M, expected;
      Column B;
      KSP    outer;
      Mat    S, gotM;

      Case("%s, pmat %s with %d blocks", spec.name, PmatName(type), (int)blocks);
      PetscCall(CheckPmat(sys.A, sys.C, sys, d, spec.symmetric, choice));
      PetscCall(PmatSetUp(sys.A, sys.C, sys.w, choice, &outer, &S, &gotM));
      PetscCall(Gather(gotM, M));
      PetscCall(CheckEqual("M is symmetric", M, M.adjoint(), type == PC_AINSWORTH_PMAT_BJ_CC ? 1e-14 : 1e-13));
      PetscCall(KSPDestroy(&outer));
      if (blocks == 1) {
        same.type = type == PC_AINSWORTH_PMAT_BJ_CC ? PC_AINSWORTH_PMAT_CC : PC_AINSWORTH_PMAT_CG;
        PetscCall(PmatReference(d, spec.symmetric, same, expected, B));
        PetscCall(CheckEqual("M with one block", M, expected, 1e-13));
      } else if (blocks >= spec.m) {
        const DenseProjector p(d.C, DiagonalWeight(d.A));
        const Dense          Q = Dense::Identity(spec.n, spec.n) - DiagonalWeight(d.A).asDiagonal() * d.C.adjoint() *
                                                            p.S.diagonal().cwiseInverse().asDiagonal() * d.C;
        PetscCall(
          CheckEqual("M with one block per row", M, ReducedOperator(d.A, d.C, Q, RowPenalty(d.A, d.C, 0.5)), 1e-13));
      }
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* hypre gets a matrix of its own kind, with the same entries */
static PetscErrorCode Hypre(const Spec &spec)
{
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (PCAinsworthPmatType type : {PC_AINSWORTH_PMAT_JCB, PC_AINSWORTH_PMAT_ID}) {
    Case("%s, pmat %s for hypre", spec.name, PmatName(type));
    PetscCall(CheckPmat(sys.A, sys.C, sys, d, spec.symmetric,
                        {type, MAT_AINSWORTH_WEIGHT_DIAGONAL, AINSWORTH_PENALTY_ROW, PETSC_DEFAULT, 3, true, PCHYPRE}));
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same M on one rank and on all */
static PetscErrorCode RankCount(const Spec &spec)
{
  System one, all;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_SELF, spec, &one));
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &all));
  for (int type = 0; type < 6; type++) {
    PmatChoice choice{
      (PCAinsworthPmatType)type, MAT_AINSWORTH_WEIGHT_DIAGONAL, AINSWORTH_PENALTY_ROW, PETSC_DEFAULT, 3, true};
    KSP   outer[2];
    Mat   S, M;
    Dense dense[2];

    Case("%s, pmat %s, one rank and all", spec.name, PmatName(type));
    PetscCall(PmatSetUp(one.A, one.C, one.w, choice, &outer[0], &S, &M));
    PetscCall(Gather(M, dense[0]));
    PetscCall(PmatSetUp(all.A, all.C, all.w, choice, &outer[1], &S, &M));
    PetscCall(Gather(M, dense[1]));
    PetscCall(CheckEqual("M", dense[1], dense[0], 1e-13));
    PetscCall(KSPDestroy(&outer[0]));
    PetscCall(KSPDestroy(&outer[1]));
  }
  PetscCall(SystemDestroy(&one));
  PetscCall(SystemDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scale of the rows of C does not matter to the default M_* */
static PetscErrorCode RowScales()
{
  Dense M[2];

  PetscFunctionBeginUser;
  Case("rows of C scaled by 1e-3 to 1e3");
  for (int k = 0; k < 2; k++) {
    Spec       spec;
    System     sys;
    KSP        outer;
    Mat        S, mat;
    PmatChoice choice{
      PC_AINSWORTH_PMAT_JCB, MAT_AINSWORTH_WEIGHT_DIAGONAL, AINSWORTH_PENALTY_ROW, PETSC_DEFAULT, 3, true};

    spec.rowscale = 3.0 * k;
    PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
    PetscCall(PmatSetUp(sys.A, sys.C, sys.w, choice, &outer, &S, &mat));
    PetscCall(Gather(mat, M[k]));
    PetscCall(KSPDestroy(&outer));
    PetscCall(SystemDestroy(&sys));
  }
  PetscCall(CheckEqual("M", M[1], M[0], 1e-13));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A and C in other formats: the type is the program's own affair */
static PetscErrorCode Formats()
{
  Spec        spec;
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  spec.bs = 2;
  spec.m  = 6;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(MatSetOption(sys.A, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  for (const char *typeA : {MATBAIJ, MATSBAIJ, MATDENSE}) {
    /* PETSc has no Hermitian one with blocks */
    if (PetscDefined(USE_COMPLEX) && typeA == std::string(MATSBAIJ)) continue;
    for (const char *typeC : {MATAIJ, MATBAIJ, MATDENSE}) {
      PmatChoice choice{
        PC_AINSWORTH_PMAT_JCB, MAT_AINSWORTH_WEIGHT_DIAGONAL, AINSWORTH_PENALTY_ROW, PETSC_DEFAULT, 3, true};
      Mat A, C;

      Case("A of type %s, C of type %s", typeA, typeC);
      PetscCall(MatConvert(sys.A, typeA, MAT_INITIAL_MATRIX, &A));
      PetscCall(MatConvert(sys.C, typeC, MAT_INITIAL_MATRIX, &C));
      PetscCall(CheckPmat(A, C, sys, d, true, choice));
      choice.penalty = AINSWORTH_PENALTY_NORM;
      choice.type    = PC_AINSWORTH_PMAT_ID;
      PetscCall(CheckPmat(A, C, sys, d, true, choice));
      PetscCall(MatDestroy(&A));
      PetscCall(MatDestroy(&C));
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const Spec &spec : UsualSpecs()) PetscCall(Formulas(spec, !spec.symmetric)); /* in all combinations only once */
  for (int k : {3, 5}) PetscCall(Blocks(UsualSpecs()[k]));
  if (PetscDefined(HAVE_HYPRE))
    for (const Spec &spec : UsualSpecs()) PetscCall(Hypre(spec));
  for (int k : {2, 5}) PetscCall(RankCount(UsualSpecs()[k]));
  PetscCall(RowScales());
  PetscCall(Formats());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
