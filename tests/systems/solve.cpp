/* A system as PETSc matrices, solved by the plugin or by MUMPS, and the verdict on what came out */
#include "systems.h"
#include <dlfcn.h>

/*
   Of each equation relative to its terms, and of x, in units of its own, relative to x or to what rounding the system
   may change
*/
static const double residualBound = 1e-5, errorBound = 1e-5;

/* hypre keeps the flag of an error for all solvers that come after, and PETSc 3.18 does not take it back */
static void ForgetErrors()
{
  if (auto clear = (int (*)())dlsym(RTLD_DEFAULT, "HYPRE_ClearAllErrors")) clear();
}

static PetscErrorCode KeepMessage(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type,
                                  const char *message, void *ctx)
{
  if (type == PETSC_ERROR_INITIAL && message) *(std::string *)ctx = message;
  return code;
}

/* Blocks as they are stored, with local[0] and local[1] rows of x and of lambda on this rank */
static PetscErrorCode CreateNest(const Saddle &s, const PetscInt local[2], Mat *nest)
{
  Mat blocks[2][2] = {
    {NULL, NULL},
    {NULL, NULL}
  };

  PetscFunctionBeginUser;
  for (int i = 0; i < 2; i++)
    for (int j = 0; j < 2; j++)
      if (s.block[i][j].size() || i != j)
        PetscCall(RandomFill(PETSC_COMM_WORLD, s.block[i][j].cast<PetscScalar>(), local[i], local[j], i + j ? 1 : s.bs,
                             false, &blocks[i][j]));
  PetscCall(NestCreate(blocks[0][0], blocks[0][1], blocks[1][0], blocks[1][1], s.first, nest));
  for (auto &row : blocks)
    for (Mat &M : row) PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The part of x, or of lambda, of a vector of the nest */
static PetscErrorCode Field(bool first, Mat nest, Vec all, int k, const std::function<PetscErrorCode(Vec)> &action)
{
  IS  is[2];
  Vec sub;

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(nest, is, NULL));
  PetscCall(VecGetSubVector(all, is[first ? 1 - k : k], &sub));
  PetscCall(action(sub));
  PetscCall(VecRestoreSubVector(all, is[first ? 1 - k : k], &sub));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateSolver(const Saddle &s, Mat nest, bool mumps, KSP *ksp)
{
  PC  pc;
  Mat aij;

  PetscFunctionBeginUser;
  if (!mumps) {
    PetscCall(SolverCreate(nest, ksp));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const bool symmetric = s.block[0][0] == s.block[0][0].transpose() && s.block[1][0] == s.block[0][1].transpose();

  PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, &aij));
  PetscCall(MatSetOption(aij, MAT_SYMMETRIC, symmetric ? PETSC_TRUE : PETSC_FALSE));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, ksp));
  PetscCall(KSPSetOperators(*ksp, aij, aij));
  PetscCall(MatDestroy(&aij));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, symmetric ? PCCHOLESKY : PCLU));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The iterations of the reduced solve, and what it says of a failure */
static PetscErrorCode AskSolver(KSP ksp, Answer &a)
{
  PC          pc;
  KSP         inner;
  PetscBool   ours;
  const char *why;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCAINSWORTH, &ours));
  if (!ours) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetIterationNumber(inner, &a.iterations));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  a.said = why;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SaddleSolveNest(Mat nest, KSP *ksp, const Vector rhs[2], const PetscInt local[2], bool first, Answer &a)
{
  Vec                b, y;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  PetscMPIInt        agreed[4];
  Column             part[2];
  std::string        message;

  PetscFunctionBeginUser;
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, local[0] + local[1], PETSC_DETERMINE, &b));
  for (int k = 0; k < 2; k++)
    PetscCall(Field(first, nest, b, k, [&](Vec v) { return Scatter(rhs[k].cast<PetscScalar>(), v); }));
  PetscCall(VecDuplicate(b, &y));
  PetscCall(PetscPushErrorHandler(KeepMessage, &message));
  a.code = KSPSolve(*ksp, b, y);
  PetscCall(PetscPopErrorHandler());
  if (a.code) {
    a.said = message;
    ForgetErrors();
  } else {
    PetscCall(KSPGetConvergedReason(*ksp, &reason));
    PetscCall(AskSolver(*ksp, a));
    for (int k = 0; k < 2; k++) PetscCall(Field(first, nest, y, k, [&](Vec v) { return Gather(v, part[k]); }));
    a.x      = part[0].real();
    a.lambda = part[1].real();
  }
  a.solved  = !a.code && reason > 0;
  agreed[0] = (PetscMPIInt)a.code;
  agreed[1] = -agreed[0];
  agreed[2] = a.code ? 0 : (PetscMPIInt)reason;
  agreed[3] = -agreed[2];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, agreed, 4, MPI_INT, MPI_MAX, PETSC_COMM_WORLD));
  a.agreed = agreed[0] == -agreed[1] && agreed[2] == -agreed[3];
  if (!a.code) PetscCall(KSPDestroy(ksp)); /* what an error leaves behind may not be fit for it */
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SaddleSolve(const Saddle &s, const PetscInt local[2], bool mumps, Answer &a)
{
  Mat nest;
  KSP ksp;

  PetscFunctionBeginUser;
  PetscCall(CreateNest(s, local, &nest));
  PetscCall(CreateSolver(s, nest, mumps, &ksp));
  PetscCall(SaddleSolveNest(nest, &ksp, s.rhs, local, s.first, a));
  PetscCall(MatDestroy(&nest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

SaddleVerdict SaddleJudge(const Saddle &s, const Facts &facts, bool listen, Answer &a, double beyond)
{
  if (!a.agreed) {
    a.said += "; ranks disagree";
    return SADDLE_WRONG;
  }
  if (!a.solved) {
    if (listen && facts.decided && !SaddleSaysTrue(s, facts, a.said)) return SADDLE_UNTRUE;
    return facts.decided && facts.solvable && facts.unique && !(SaddleSymmetric(s) && SaddleIndefinite(s))
             ? SADDLE_OWED
             : SADDLE_REFUSED;
  }
  a.residual = SaddleResidual(s, a.x, a.lambda);
  a.error    = SaddleError(facts, a.x);
  if (!(a.residual <= residualBound)) return SADDLE_WRONG;
  if (!facts.decided) return SADDLE_RIGHT;
  const bool agrees = facts.solvable ? !facts.unique || a.error <= std::max(errorBound, beyond * facts.reach)
                                     : facts.left <= residualBound;
  return agrees || SaddleConfirms(s, a.x, errorBound, beyond) ? SADDLE_RIGHT : SADDLE_WRONG;
}
