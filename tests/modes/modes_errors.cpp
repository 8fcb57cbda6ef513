/*
   What EPSAINSWORTH refuses, in words that say what to do, on all ranks; its functions, and an EPS that is used again
*/
#include "dense.h"
#include <slepcainsworth.h>

/* K and M of a small system, as MATNEST or AIJ */
struct Pencil {
  System system;
  Mat    mass, Ct, K, M;
};

static PetscErrorCode PencilCreate(MPI_Comm comm, bool aij, Pencil *p)
{
  Spec spec;
  Vec  diagonal;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(comm, spec, &p->system));
  PetscCall(MatDuplicate(p->system.A, MAT_DO_NOT_COPY_VALUES, &p->mass));
  PetscCall(MatCreateVecs(p->mass, &diagonal, NULL));
  PetscCall(VecSet(diagonal, 2.0));
  PetscCall(MatDiagonalSet(p->mass, diagonal, INSERT_VALUES));
  PetscCall(VecDestroy(&diagonal));
  PetscCall(MatHermitianTranspose(p->system.C, MAT_INITIAL_MATRIX, &p->Ct));
  PetscCall(NestCreate(p->system.A, p->Ct, p->system.C, NULL, false, &p->K));
  Mat      blocks[] = {p->mass, NULL, NULL, NULL};
  Mat      zero;
  PetscInt m;
  PetscCall(MatGetLocalSize(p->system.C, &m, NULL));
  PetscCall(MatCreateAIJ(comm, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 0, NULL, 0, NULL, &zero));
  PetscCall(MatAssemblyBegin(zero, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(zero, MAT_FINAL_ASSEMBLY));
  blocks[3] = zero;
  PetscCall(MatCreateNest(comm, 2, NULL, 2, NULL, blocks, &p->M));
  PetscCall(MatDestroy(&zero));
  for (Mat *nest : {&p->K, &p->M}) {
    if (!aij) break;
    Mat flat;
    PetscCall(MatConvert(*nest, MATAIJ, MAT_INITIAL_MATRIX, &flat));
    PetscCall(MatDestroy(nest));
    *nest = flat;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PencilDestroy(Pencil *p)
{
  PetscFunctionBeginUser;
  PetscCall(SystemDestroy(&p->system));
  for (Mat *A : {&p->mass, &p->Ct, &p->K, &p->M}) PetscCall(MatDestroy(A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SolverCreate(Mat K, Mat M, EPSProblemType type, EPS *eps)
{
  PetscFunctionBeginUser;
  PetscCall(EPSCreate(PetscObjectComm((PetscObject)K), eps));
  PetscCall(EPSSetType(*eps, EPSAINSWORTH));
  PetscCall(EPSSetOperators(*eps, K, M));
  PetscCall(EPSSetProblemType(*eps, type));
  PetscCall(EPSSetFromOptions(*eps));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A solve of K and M, set by options, fails with these words */
static PetscErrorCode Fails(const char *what, Mat K, Mat M, EPSProblemType type, const std::string &line,
                            PetscErrorCode code, const std::vector<std::string> &parts)
{
  PetscFunctionBeginUser;
  Options options(line);
  EPS     eps = NULL;

  Case("%s", what);
  PetscCall(CheckError(
    what,
    [&]() {
      PetscFunctionBeginUser;
      PetscCall(SolverCreate(K, M, type, &eps));
      PetscCall(EPSSolve(eps));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    code, parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Subtracts from A so much of the mass that four eigenvalues become negative; lambda: the lowest and the fifth before
*/
static PetscErrorCode Lower(Pencil *p, PetscReal lambda[2])
{
  EPS         eps;
  PetscScalar first, fifth;

  PetscFunctionBeginUser;
  PetscCall(SolverCreate(p->K, p->M, EPS_GHEP, &eps));
  PetscCall(EPSSetDimensions(eps, 5, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(EPSSolve(eps));
  PetscCall(EPSGetEigenvalue(eps, 0, &first, NULL));
  PetscCall(EPSGetEigenvalue(eps, 4, &fifth, NULL));
  PetscCall(EPSDestroy(&eps));
  PetscCall(MatAXPY(p->system.A, -fifth, p->mass, SUBSET_NONZERO_PATTERN));
  if (lambda) lambda[0] = PetscRealPart(first);
  if (lambda) lambda[1] = PetscRealPart(fifth);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Makes the mass negative in every third row, whose couplings to others vanish */
static PetscErrorCode Indefinite(Pencil *p)
{
  PetscInt start, end;
  Vec      sign;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(p->mass, &sign, NULL));
  PetscCall(VecGetOwnershipRange(sign, &start, &end));
  PetscCall(MatGetDiagonal(p->mass, sign));
  for (PetscInt i = start; i < end; i++)
    if (i % 3 == 2) PetscCall(VecSetValue(sign, i, -1.0, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(sign));
  PetscCall(VecAssemblyEnd(sign));
  PetscCall(MatDiagonalSet(p->mass, sign, INSERT_VALUES));
  PetscCall(VecDestroy(&sign));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Refusals(MPI_Comm comm)
{
  Pencil   nest, aij;
  Mat      bad;
  PetscInt first, n;

  PetscFunctionBeginUser;
  PetscCall(PencilCreate(comm, false, &nest));
  PetscCall(PencilCreate(comm, true, &aij));
  PetscCall(Fails("one matrix", nest.K, NULL, EPS_HEP, "", PETSC_ERR_ARG_WRONGSTATE, {"EPSSetOperators(eps, K, M)"}));
  PetscCall(Fails("no problem type", nest.K, nest.M, EPS_GNHEP, "", PETSC_ERR_ARG_WRONGSTATE,
                  {"EPS_GHEP", "-eps_gen_hermitian"}));
  PetscCall(Fails("interior", nest.K, nest.M, EPS_GHEP, "-eps_target 2", PETSC_ERR_SUP,
                  {"near 2", "-eps_target 0", "sinvert"}));
  PetscCall(
    Fails("largest", nest.K, nest.M, EPS_GHEP, "-eps_largest_magnitude", PETSC_ERR_SUP, {"-eps_smallest_real"}));
  PetscCall(Fails("largest of (K, M)", nest.K, nest.M, EPS_GHEP, "-eps_largest_real", PETSC_ERR_ARG_WRONG,
                  {"second with -eps_largest_real"}));
  PetscCall(Fails("a shift of (M, K)", nest.M, nest.K, EPS_GHEP, "-eps_largest_real -eps_ainsworth_shift 1",
                  PETSC_ERR_SUP, {"pass K first"}));
  PetscCall(Fails("few vectors", nest.K, nest.M, EPS_GHEP, "-eps_nev 5 -eps_ncv 3", PETSC_ERR_USER_INPUT,
                  {"-eps_ncv 3", "-eps_nev 5"}));
  PetscCall(Fails("another preconditioner", nest.K, nest.M, EPS_GHEP, "-st_pc_type none", PETSC_ERR_SUP,
                  {"-st_pc_type ainsworth"}));
  PetscCall(Fails("negative shift", nest.K, nest.M, EPS_GHEP, "-eps_ainsworth_shift -2", PETSC_ERR_ARG_OUTOFRANGE,
                  {"-2", "negative"}));
  PetscCall(Fails("layouts", nest.K, aij.M, EPS_GHEP, "", PETSC_ERR_ARG_INCOMP, {"MATNEST", "blocks of K"}));
  PetscCall(Fails("swapped", aij.M, aij.K, EPS_GHEP, "", PETSC_ERR_ARG_WRONG, {"EPSSetOperators(eps, K, M)"}));
  PetscCall(MatDuplicate(aij.K, MAT_COPY_VALUES, &bad));
  PetscCall(MatScale(bad, -1.0));
  PetscCall(Fails("negative mass", aij.K, bad, EPS_GHEP, "", PETSC_ERR_ARG_WRONG, {"positive diagonal"}));
  PetscCall(MatDestroy(&bad));
  /* a mass in each row of the last rank, which has multipliers */
  PetscCall(MatDuplicate(aij.K, MAT_COPY_VALUES, &bad));
  PetscCall(MatGetOwnershipRange(bad, &first, &n));
  PetscCall(Fails("a mass of multipliers", aij.K, bad, EPS_GHEP, "", PETSC_ERR_ARG_WRONG, {"multiplier", "row"}));
  PetscCall(MatDestroy(&bad));
  PetscCall(Lower(&nest, NULL));
  PetscCall(Fails("indefinite", nest.K, nest.M, EPS_GHEP, "-eps_ainsworth_shift 1e-3", PETSC_ERR_ARG_OUTOFRANGE,
                  {"-eps_ainsworth_shift", "positive definite"}));
  PetscCall(Fails("indefinite, (M, K)", nest.M, nest.K, EPS_GHEP, "-eps_largest_real", PETSC_ERR_NOT_CONVERGED,
                  {"A body floats"}));
  PetscCall(PencilDestroy(&nest));
  PetscCall(PencilCreate(comm, false, &nest));
  PetscCall(Indefinite(&nest));
  PetscCall(Fails("an indefinite mass", nest.K, nest.M, EPS_GHEP, "", PETSC_ERR_ARG_OUTOFRANGE,
                  {"negative eigenvalue", "-eps_largest_real"}));
  PetscCall(PencilDestroy(&nest));
  PetscCall(PencilDestroy(&aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fields that the program names at the preconditioner, for matrices that do not tell: the same eigenvalues */
static PetscErrorCode Named(MPI_Comm comm)
{
  Pencil      p[2];
  EPS         eps[2];
  PetscScalar lambda[2];
  ST          st;
  KSP         ksp;
  PC          pc;
  IS          fields[2];

  PetscFunctionBeginUser;
  Case("named");
  for (int k = 0; k < 2; k++) PetscCall(PencilCreate(comm, k, &p[k]));
  PetscCall(MatNestGetISs(p[0].K, fields, NULL));
  for (int k = 0; k < 2; k++) {
    PetscCall(EPSCreate(comm, &eps[k]));
    PetscCall(EPSSetType(eps[k], EPSAINSWORTH));
    PetscCall(EPSSetOperators(eps[k], p[k].K, p[k].M));
    PetscCall(EPSSetProblemType(eps[k], EPS_GHEP));
    if (k) {
      PetscCall(EPSGetST(eps[k], &st));
      PetscCall(STSetType(st, STPRECOND));
      PetscCall(STGetKSP(st, &ksp));
      PetscCall(KSPGetPC(ksp, &pc));
      PetscCall(PCSetType(pc, PCAINSWORTH));
      PetscCall(PCFieldSplitSetIS(pc, "x", fields[0]));
      PetscCall(PCFieldSplitSetIS(pc, "l", fields[1]));
    }
    PetscCall(EPSSolve(eps[k]));
    PetscCall(EPSGetEigenvalue(eps[k], 0, &lambda[k], NULL));
  }
  PetscCall(Check("the same", PetscAbsScalar(lambda[1] - lambda[0]) / PetscAbsScalar(lambda[0]), 1e-8));
  for (int k = 0; k < 2; k++) PetscCall(EPSDestroy(&eps[k]));
  for (int k = 0; k < 2; k++) PetscCall(PencilDestroy(&p[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Functions, views, another tolerance and number of modes on the same EPS */
static PetscErrorCode Again(MPI_Comm comm)
{
  Pencil      p;
  EPS         eps;
  PetscReal   shift;
  PetscInt    converged[2];
  PetscScalar lambda[2];

  PetscFunctionBeginUser;
  Case("again");
  PetscCall(PencilCreate(comm, false, &p));
  PetscCall(SolverCreate(p.K, p.M, EPS_GHEP, &eps));
  PetscCall(EPSAinsworthGetShift(eps, &shift));
  PetscCall(CheckTrue("no shift before the solve", shift < 0.0));
  PetscCall(EPSSetDimensions(eps, 3, PETSC_DEFAULT, PETSC_DEFAULT));
  for (int k = 0; k < 2; k++) {
    if (k) PetscCall(EPSAinsworthSetShift(eps, 2 * shift));
    PetscCall(EPSSolve(eps));
    PetscCall(EPSGetConverged(eps, &converged[k]));
    PetscCall(EPSGetEigenvalue(eps, 2, &lambda[k], NULL));
    if (!k) PetscCall(EPSAinsworthGetShift(eps, &shift));
  }
  PetscCall(CheckTrue("three modes", converged[0] >= 3 && converged[1] >= 3));
  PetscCall(CheckTrue("a shift was chosen", shift > 0.0));
  PetscCall(
    Check("the same with another shift", PetscAbsScalar(lambda[1] - lambda[0]) / PetscAbsScalar(lambda[0]), 1e-8));
  PetscCall(EPSReset(eps));
  PetscCall(EPSSetOperators(eps, p.K, p.M));
  PetscCall(EPSSolve(eps));
  PetscCall(EPSGetEigenvalue(eps, 2, &lambda[1], NULL));
  PetscCall(
    Check("the same after EPSReset()", PetscAbsScalar(lambda[1] - lambda[0]) / PetscAbsScalar(lambda[0]), 1e-8));
  PetscReal before[2];
  PetscCall(Lower(&p, before));
  PetscCall(EPSSetOperators(eps, p.K, p.M));
  PetscCall(EPSAinsworthSetShift(eps, 2 * before[1]));
  PetscCall(EPSSolve(eps));
  PetscCall(EPSGetEigenvalue(eps, 0, &lambda[1], NULL));
  PetscCall(
    Check("a negative eigenvalue", PetscAbsReal(PetscRealPart(lambda[1]) - before[0] + before[1]) / before[1], 1e-8));
  PetscCall(EPSSetType(eps, EPSKRYLOVSCHUR));
  PetscCall(EPSAinsworthSetShift(eps, 1.0)); /* nothing happens for another type */
  PetscCall(EPSDestroy(&eps));
  PetscCall(PencilDestroy(&p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int       exitcode;
  PetscBool refusals = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(SlepcInitialize(&argc, &argv, NULL, "What EPSAINSWORTH refuses\n"));
  PetscCall(AinsworthSlepcInitializePackage());
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-refusals", &refusals, NULL));
  if (refusals) PetscCall(Refusals(PETSC_COMM_WORLD));
  else PetscCall(Again(PETSC_COMM_WORLD));
  if (!refusals) PetscCall(Named(PETSC_COMM_WORLD));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(SlepcFinalize());
  return exitcode;
}
