/* One solve: what it came to, on all ranks */
#include "attack.h"
#include <dlfcn.h>

static PetscErrorCode KeepMessage(MPI_Comm, int line, const char *function, const char *, PetscErrorCode code,
                                  PetscErrorType type, const char *message, void *ctx)
{
  if (type == PETSC_ERROR_INITIAL && message)
    *(std::string *)ctx = std::string(message) + " [" + function + ":" + std::to_string(line) + "]";
  return code;
}

PetscErrorCode AttackCall(const std::function<PetscErrorCode()> &action, PetscErrorCode *code, std::string &message)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPushErrorHandler(KeepMessage, &message));
  *code = action();
  PetscCall(PetscPopErrorHandler());
  /* hypre, where PETSc has it, remembers errors, and PCHYPRE takes them for its own */
  if (void *clear = dlsym(RTLD_DEFAULT, "HYPRE_ClearAllErrors")) (void)((int (*)(void))clear)();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inside the inner KSP: another KSP for the same blocks, or an error */
static PetscErrorCode Watch(KSP, PetscInt step, PetscReal, void *ctx)
{
  Attack        &a = *(Attack *)ctx;
  KSP            other;
  Vec            b, y;
  std::string    message;
  PetscErrorCode code;

  PetscFunctionBeginUser;
  PetscCheck(!a.explode, PETSC_COMM_WORLD, PETSC_ERR_USER, "An error on purpose");
  if (!a.nested || step != 1) PetscFunctionReturn(PETSC_SUCCESS);
  /* one is enough: without a test, 200 iterations of an outer method each have 500, and so has the other */
  a.nested = false;
  /* a vector of no use, so that memory moves */
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, a.rows[0][0], PETSC_DECIDE, &b));
  PetscCall(VecDestroy(&b));
  PetscCall(AttackCall(
    [&]() -> PetscErrorCode {
      PetscInt n;

      PetscFunctionBeginUser;
      PetscCall(SolverCreate(a.nest, &other));
      PetscCall(MatGetLocalSize(a.nest, &n, NULL));
      PetscCall(VecCreateMPI(PETSC_COMM_WORLD, n, PETSC_DECIDE, &b));
      PetscCall(VecDuplicate(b, &y));
      PetscCall(SetRandom(b, step));
      PetscCall(KSPSolve(other, b, y));
      PetscCall(VecDestroy(&b));
      PetscCall(VecDestroy(&y));
      PetscCall(KSPDestroy(&other));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    &code, message)); /* its own success is no matter here */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackWatch(Attack &a)
{
  PC  pc;
  KSP inner;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(a.ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPMonitorSet(inner, Watch, &a, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackSolver(Attack &a)
{
  PetscFunctionBeginUser;
  PetscCall(SolverCreate(a.nest, &a.ksp));
  PetscCall(AttackWatch(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode WholeCreate(const Attack &a, Vec *b)
{
  PetscMPIInt rank;
  IS          is[2];
  Vec         fields[2];

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  const PetscInt n[2] = {a.rows[a.s.first ? 1 : 0][rank], a.rows[a.s.first ? 0 : 1][rank]};

  if (!a.s.nested || a.other || a.whole) {
    PetscCall(VecCreateMPI(PETSC_COMM_WORLD, n[0] + n[1], PETSC_DECIDE, b));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatNestGetISs(a.nest, is, NULL));
  for (int k = 0; k < 2; k++) PetscCall(VecCreateMPI(PETSC_COMM_WORLD, n[k], PETSC_DECIDE, &fields[k]));
  PetscCall(VecCreateNest(PETSC_COMM_WORLD, 2, is, fields, b));
  for (Vec &field : fields) PetscCall(VecDestroy(&field));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fields of a vector of the whole from dense columns, or into them */
static PetscErrorCode Fields(const Attack &a, Vec whole, bool into, Column &x, Column &lambda)
{
  IS is[2];

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(a.nest, is, NULL));
  for (int k = 0; k < 2; k++) {
    Column &column = (k == 0) == a.s.first ? lambda : x;
    Vec     sub;

    PetscCall(VecGetSubVector(whole, is[k], &sub));
    if (into) PetscCall(Scatter(column, sub));
    else PetscCall(Gather(sub, column));
    PetscCall(VecRestoreSubVector(whole, is[k], &sub));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ranks have to agree on the code and on the reason */
static PetscErrorCode Agree(MPI_Comm comm, PetscErrorCode code, KSPConvergedReason reason, Verdict *verdict,
                            std::string &why)
{
  PetscMPIInt agreed[4] = {(PetscMPIInt)code, -(PetscMPIInt)code, code ? 0 : (PetscMPIInt)reason,
                           code ? 0 : -(PetscMPIInt)reason};

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, agreed, 4, MPI_INT, MPI_MAX, comm));
  if (agreed[0] != -agreed[1] || agreed[2] != -agreed[3]) {
    *verdict = WRONG;
    why += "; ranks disagree";
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackSolve(Attack &a, Verdict *verdict, std::string &why)
{
  PC        pc;
  PetscBool reuse;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(a.ksp, &pc));
  PetscCall(PCGetReusePreconditioner(pc, &reuse));
  RandomSystem s        = a.s;
  const auto   outer    = a.choices.find("-ksp_type");
  const bool   simple   = outer == a.choices.end() || outer->second == KSPPREONLY;
  const auto   norm     = a.choices.find("-ainsworth_ksp_norm_type");
  const auto   stop     = a.choices.find("-pc_ainsworth_stop");
  const bool   untested = (stop != a.choices.end() && stop->second == "energy_error") ||
                        (norm != a.choices.end() && norm->second.compare(0, 4, "none") == 0);
  /*
     an outer method around an inner one without a test, or that takes the system for symmetric, which it is not: it is
     not known what it looks at
  */
  const bool blind = !simple && (untested || ((outer->second == KSPCG || outer->second == KSPMINRES) &&
                                              !(a.s.symmetric && AttackAdjoint(a.s))));
  const bool tame  = AttackTame(a) && !a.user && !reuse && !a.explode && !a.bogus && !a.nullspace &&
                    (!a.transpose || simple);
  Vec                b, y, copy;
  Column             x, lambda;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  PetscErrorCode     code;
  PetscBool          same;
  std::string        message;

  if (a.transpose) {
    s.A  = Dense(a.s.A.adjoint());
    s.D  = Dense(a.s.D.adjoint());
    s.C  = Dense(a.s.Ct.adjoint());
    s.Ct = Dense(a.s.C.adjoint());
  }
  if (a.badEntry >= 0) (a.badEntry < s.f.size() ? s.f[a.badEntry] : s.g[a.badEntry - s.f.size()]) = a.badValue;
  PetscCall(WholeCreate(a, &b));
  PetscCall(VecDuplicate(b, &y));
  PetscCall(VecDuplicate(b, &copy));
  if (a.other) PetscCall(SetRandom(b, 3));
  else PetscCall(Fields(a, b, true, s.f, s.g));
  PetscCall(VecCopy(b, copy));
  PetscCall(VecSet(y, 12345.0)); /* not to be seen by anybody */
  PetscCall(
    AttackCall([&]() { return a.transpose ? KSPSolveTranspose(a.ksp, b, y) : KSPSolve(a.ksp, b, y); }, &code, message));
  if (code) {
    a.errors++;
    *verdict = AttackInternal(code, message) && !a.explode
                 ? WRONG
                 : AttackJudge(s, tame && !a.other, a.must, true, KSP_DIVERGED_PC_FAILED, x, lambda, why);
    why      = "error " + std::to_string((int)code) + ": " + message + "; " + why;
  } else {
    PCFailedReason failure;

    PetscCall(KSPGetConvergedReason(a.ksp, &reason));
    PetscCall(PCGetFailedReason(pc, &failure));
    PetscCall(Fields(a, y, false, x, lambda));
    *verdict = AttackJudge(s, tame, a.must, simple && !untested, reason, x, lambda, why);
    if (blind && *verdict == WRONG) *verdict = REFUSED;
    if (failure) why += std::string(", ") + PCFailedReasons[failure];
    if (a.badEntry < 0) {
      PetscCall(VecEqual(b, copy, &same));
      if (!same) {
        *verdict = WRONG;
        why += "; the right-hand side was changed";
      }
    }
  }
  PetscCall(Agree(PETSC_COMM_WORLD, code, reason, verdict, why));
  for (Vec *v : {&b, &y, &copy}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackElsewhere(Attack &a, Verdict *verdict, std::string &why)
{
  const uint64_t     seed = a.r.Bits();
  PetscMPIInt        rank, worst;
  MPI_Comm           comm;
  Mat                nest;
  Vec                b, y;
  KSP                ksp    = NULL;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  PetscErrorCode     code;
  Column             x, lambda;
  std::string        message;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_split(PETSC_COMM_WORLD, rank % 2, rank, &comm));
  Random       r((PetscInt64)(seed + (uint64_t)(rank % 2)));
  RandomSystem s(r, false);

  PetscCall(RandomNestCreate(comm, s, r, &nest, &b));
  PetscCall(VecDuplicate(b, &y));
  PetscCall(AttackCall(
    [&]() -> PetscErrorCode {
      PetscFunctionBeginUser;
      PetscCall(SolverCreate(nest, &ksp));
      PetscCall(KSPSetType(ksp, KSPPREONLY));
      PetscCall(KSPSolve(ksp, b, y));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    &code, message));
  if (code) {
    *verdict = AttackInternal(code, message) ? WRONG : REFUSED;
    why      = "error " + std::to_string((int)code) + ": " + message;
  } else {
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    PetscCall(RandomNestSplit(s, nest, y, x, lambda));
    *verdict = AttackJudge(s, false, false, false, reason, x, lambda, why);
  }
  PetscCall(Agree(comm, code, reason, verdict, why));
  why += "; on half of the ranks: " + s.text;
  worst = (PetscMPIInt)*verdict;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD));
  *verdict = (Verdict)worst;
  /* after an error in hypre PETSc has one more here */
  PetscCall(AttackCall([&]() { return KSPDestroy(&ksp); }, &code, message));
  PetscCall(MatDestroy(&nest));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCallMPI(MPI_Comm_free(&comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
