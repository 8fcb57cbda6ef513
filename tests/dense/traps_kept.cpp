static char help[] = "Traps of what is kept: the preconditioner for other constraints, the operator for another block (0,1); nothing is set up twice.\n\n";

#include "run.h"

/* -ksp_reuse_preconditioner keeps the inner preconditioner, never the constraints; A changes in place, C too, rows come and go */
static PetscErrorCode Reuse(const char *options, PetscInt pmats, PetscInt last)
{
  Options     line(options);
  DenseSystem d = SpringsCreate(24, 5, 1.0, 1);
  Run         run;
  PetscInt    before, after;

  PetscFunctionBeginUser;
  Case("reuse, %s", options);
  PetscCall(RunCreate(d, false, &run));
  PetscCall(CheckSolved(&run, d));
  PetscCall(KSPSetReusePreconditioner(run.ksp, PETSC_TRUE));
  PetscCall(EventCount("AinsPMat", &before));
  d.C *= 2.0;
  d.C(0, 24 / 2) = 0.7;
  PetscCall(WriteDense(d.C, run.sys.C));
  PetscCall(CheckSolved(&run, d));
  d.A *= 1.5;
  PetscCall(WriteDense(d.A, run.sys.A));
  PetscCall(CheckSolved(&run, d));
  for (PetscInt m : {7, 0, 3}) { /* another nest with other rows, of the same total length on each rank */
    Mat nest;

    const DenseSystem other = SpringsCreate(24, m, 1.5, 1);

    d.C = other.C;
    d.g = other.g;
    PetscCall(MatDestroy(&run.sys.C));
    PetscCall(VecDestroy(&run.sys.g));
    Run rows;
    PetscCall(SystemFromDense(d, false, &rows.sys));
    PetscCall(PetscObjectReference((PetscObject)rows.sys.C));
    PetscCall(PetscObjectReference((PetscObject)rows.sys.g));
    run.sys.C = rows.sys.C;
    run.sys.g = rows.sys.g;
    PetscCall(SystemDestroy(&rows.sys));
    PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, NULL, false, &nest));
    PetscCall(KSPReset(run.ksp));
    PetscCall(KSPSetOperators(run.ksp, nest, nest));
    PetscCall(MatDestroy(&run.nest));
    run.nest = nest;
    PetscCall(CheckSolved(&run, d));
    if (m) d.C.row(0) *= 3.0;
    if (m) PetscCall(WriteDense(d.C, run.sys.C));
    PetscCall(CheckSolved(&run, d));
  }
  PetscCall(EventCount("AinsPMat", &after));
  PetscCall(CheckInt("preconditioning matrices for three nests", after - before, pmats));
  PetscCall(KSPSetReusePreconditioner(run.ksp, PETSC_FALSE));
  PetscCall(CheckSolved(&run, d));
  PetscCall(EventCount("AinsPMat", &before));
  PetscCall(CheckInt("and for the matrix at hand when nothing is kept any more", before - after, last));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -ksp_reuse_preconditioner and another nest of the same sizes, or C changed in place: PETSc asks for no set-up, and the answer was that of the old C */
static PetscErrorCode Kept(const char *options, bool inPlace)
{
  Options     line(options);
  DenseSystem d = SpringsCreate(24, 5, 1.0, 21);
  Run         run;

  PetscFunctionBeginUser;
  Case("kept for %s, %s", inPlace ? "a C that changes in place" : "another nest of the same sizes", options);
  PetscCall(RunCreate(d, false, &run));
  PetscCall(CheckSolved(&run, d));
  for (PetscInt k = 0; k < 3; k++) {
    Run other;

    d.C.row(k) *= 3.0;
    d.C(k, k) -= 0.5;
    if (k == 2) d.C.row(k).head(12).swap(d.C.row(k).tail(12)); /* other columns, too */
    if (inPlace) {
      PetscCall(MatSetOption(run.sys.C, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
      PetscCall(MatZeroEntries(run.sys.C));
      PetscCall(WriteDense(d.C, run.sys.C));
      PetscCall(CheckSolved(&run, d));
      continue;
    }
    PetscCall(SystemFromDense(d, false, &other.sys));
    PetscCall(NestCreate(other.sys.A, NULL, other.sys.C, NULL, false, &other.nest));
    PetscCall(KSPSetOperators(run.ksp, other.nest, other.nest));
    PetscCall(MatDestroy(&run.nest));
    PetscCall(SystemDestroy(&run.sys));
    run.nest = other.nest;
    run.sys  = other.sys;
    PetscCall(CheckSolved(&run, d));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x and lambda of [A B'; C 0] */
static PetscErrorCode CheckBoth(Run *run, const DenseSystem &d, const Dense &B)
{
  const Eigen::Index n = d.A.rows(), m = d.C.rows();
  Dense              K = Dense::Zero(n + m, n + m);
  Column             b(n + m), got(n + m);

  PetscFunctionBeginUser;
  K.topLeftCorner(n, n)    = d.A;
  K.topRightCorner(n, m)   = B.adjoint();
  K.bottomLeftCorner(m, n) = d.C;
  b << d.f, d.g;
  PetscCall(RunSolve(run));
  PetscCall(CheckTrue(KSPConvergedReasons[run->reason], run->reason > 0));
  got << run->x, run->lambda;
  PetscCall(CheckEqual("x and lambda", got, K.fullPivLu().solve(b), 1e-8));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The transpose of a system that has one since its last change in place */
static PetscErrorCode CheckTransposed(const Run &run, const DenseSystem &d)
{
  const Eigen::Index n = d.A.rows(), m = d.C.rows();
  Dense              K = Dense::Zero(n + m, n + m);
  Vec                b, y, part;
  IS                 is[2];
  Column             rhs(n + m), x, lambda, got(n + m);

  PetscFunctionBeginUser;
  K << d.A, d.C.adjoint(), d.C, Dense::Zero(m, m);
  rhs << d.f, d.g;
  PetscCall(MatCreateVecs(run.nest, &y, &b));
  PetscCall(MatNestGetISs(run.nest, is, NULL));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(b, is[k], &part));
    PetscCall(Scatter(k ? d.g : d.f, part));
    PetscCall(VecRestoreSubVector(b, is[k], &part));
  }
  PetscCall(KSPSolveTranspose(run.ksp, b, y));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(y, is[k], &part));
    PetscCall(Gather(part, k ? lambda : x));
    PetscCall(VecRestoreSubVector(y, is[k], &part));
  }
  got << x, lambda;
  PetscCall(CheckEqual("x and lambda, transposed", got, K.fullPivLu().solve(rhs), 1e-8));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The block (0,1) changes while A and C stay: in place, to that of C and back, and in another nest */
static PetscErrorCode OtherB(const char *reuse)
{
  Options           line(std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 ") + reuse);
  const DenseSystem d = SpringsCreate(24, 5, 1.0, 22);
  Run               run;
  Mat               Bt[2] = {NULL, NULL};
  Dense             B     = d.C;

  PetscFunctionBeginUser;
  Case("another B, %s", reuse);
  PetscCall(SystemFromDense(d, false, &run.sys));
  for (PetscInt i = 0; i < d.C.rows(); i++) B(i, i) += 0.5 * Uniform(23, i, 0), B(i, 12) -= 0.3;
  for (Mat &M : Bt) {
    PetscCall(MatHermitianTranspose(run.sys.C, MAT_INITIAL_MATRIX, &M));
    PetscCall(WriteDense(&M == Bt ? B.adjoint() : Dense(2.0 * B - d.C).adjoint(), M));
  }
  PetscCall(NestCreate(run.sys.A, Bt[0], run.sys.C, NULL, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(CheckBoth(&run, d, B));
  PetscCall(WriteDense(d.C.adjoint(), Bt[0]));
  PetscCall(CheckTransposed(run, d));
  PetscCall(CheckBoth(&run, d, d.C));
  PetscCall(WriteDense(B.adjoint(), Bt[0]));
  PetscCall(CheckBoth(&run, d, B));
  PetscCall(WriteDense(Dense(2.0 * B).adjoint(), Bt[0]));
  PetscCall(CheckBoth(&run, d, 2.0 * B));
  PetscCall(MatDestroy(&run.nest));
  PetscCall(NestCreate(run.sys.A, Bt[1], run.sys.C, NULL, false, &run.nest));
  PetscCall(KSPSetOperators(run.ksp, run.nest, run.nest));
  PetscCall(CheckBoth(&run, d, 2.0 * B - d.C));
  for (Mat &M : Bt) PetscCall(MatDestroy(&M));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing is set up twice, however the program stores its blocks: some conversions of PETSc's raise the state of what they convert */
static PetscErrorCode Stored(const char *typeA, const char *typeC, bool compliance, const char *options)
{
  Options           line(options);
  const DenseSystem d        = SpringsCreate(24, 4, 1.0, 24);
  const char *const events[] = {"AinsGramMat", "AinsGramFact", "AinsPMat"};
  Run               run;
  Mat               A, C, Ct, D = NULL;
  PetscInt          before[3], first[3], second[3];
  PetscBool         nest;

  PetscFunctionBeginUser;
  Case("stored as %s and %s%s, %s", typeA, typeC, compliance ? ", D" : "", options);
  PetscCall(SystemFromDense(d, false, &run.sys));
  PetscCall(MatSetOption(run.sys.A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(PetscStrcmp(typeA, MATNEST, &nest));
  if (nest) PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 1, NULL, &run.sys.A, &A));
  else PetscCall(MatConvert(run.sys.A, typeA, MAT_INITIAL_MATRIX, &A));
  PetscCall(MatConvert(run.sys.C, typeC, MAT_INITIAL_MATRIX, &C));
  PetscCall(MatHermitianTranspose(run.sys.C, MAT_INITIAL_MATRIX, &Ct));
  if (compliance) {
    PetscInt m;

    PetscCall(VecGetLocalSize(run.sys.g, &m));
    PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &D));
    PetscCall(WriteDense(Dense(-0.1 * Dense::Identity(4, 4)), D));
  }
  PetscCall(NestCreate(A, Ct, C, D, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  for (int k = 0; k < 3; k++) PetscCall(EventCount(events[k], &before[k]));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
  for (int k = 0; k < 3; k++) PetscCall(EventCount(events[k], &first[k]));
  PetscCall(RunSolve(&run));
  PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
  for (int k = 0; k < 3; k++) {
    PetscCall(EventCount(events[k], &second[k]));
    PetscCall(CheckInt(events[k], first[k] - before[k], 1));
    PetscCall(CheckInt((std::string(events[k]) + ", again").c_str(), second[k] - first[k], 0));
  }
  for (Mat *M : {&A, &C, &Ct, &D}) PetscCall(MatDestroy(M));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A that is symmetric, then not, then again, in place: the method that nobody chose follows */
static PetscErrorCode Symmetry()
{
  Options           line("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10");
  const DenseSystem d     = SpringsCreate(24, 4, 1.0, 25);
  DenseSystem       other = d;
  Run               run;

  PetscFunctionBeginUser;
  Case("A symmetric, not, and again");
  other.A = d.A + 0.7 * Dense(d.A.triangularView<Eigen::StrictlyUpper>());
  PetscCall(RunCreate(d, false, &run));
  for (bool symmetric : {true, false, true}) {
    PC      pc;
    KSP     inner;
    KSPType type;

    PetscCall(WriteDense(symmetric ? d.A : other.A, run.sys.A));
    PetscCall(CheckSolved(&run, symmetric ? d : other));
    PetscCall(KSPGetPC(run.ksp, &pc));
    PetscCall(PCAinsworthGetKSP(pc, &inner));
    PetscCall(KSPGetType(inner, &type));
    PetscCall(CheckTrue(type, type == std::string(symmetric ? KSPPROJECTEDCG : KSPGMRES)));
  }
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  PetscCall(Reuse("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-10", 2, 1)); /* of three, one has no constraints */
  PetscCall(Reuse("-ainsworth_pc_type jacobi -ainsworth_ksp_type gmres -ainsworth_ksp_rtol 1e-10 -pc_ainsworth_pmat jcb", 2, 1));
  PetscCall(Reuse("-ainsworth_pc_type blocksa -ainsworth_ksp_rtol 1e-10", 6, 0)); /* its levels get each surface, and are those of this A */
  for (const char *more : {"", "-ainsworth_ksp_type gmres", "-ainsworth_pc_type blocksa"})
    for (bool inPlace : {false, true})
      PetscCall(Kept((std::string("-ksp_reuse_preconditioner -ainsworth_ksp_rtol 1e-10 ") + (more[0] ? more : "-ainsworth_pc_type jacobi")).c_str(), inPlace));
  for (const char *reuse : {"", "-ksp_reuse_preconditioner"}) PetscCall(OtherB(reuse));
  PetscCall(Symmetry());
  for (const char *options : {"-ainsworth_pc_type jacobi", "-ainsworth_pc_type blocksa -ksp_type fgmres"})
    for (const char *typeA : {MATAIJ, MATBAIJ, MATSBAIJ, MATDENSE, MATNEST}) {
      if (PetscDefined(USE_COMPLEX) && typeA == std::string(MATSBAIJ)) continue; /* of which PETSc does not know that it is Hermitian */
      for (const char *typeC : {MATAIJ, MATBAIJ, MATDENSE}) PetscCall(Stored(typeA, typeC, typeC == std::string(MATAIJ), options));
    }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
