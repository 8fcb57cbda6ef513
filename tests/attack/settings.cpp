/* What a program may ask of the solver between two solves */
#include "attack.h"

PetscErrorCode AttackChangeOptions(Attack &a)
{
  std::string    message;
  PetscErrorCode code;

  PetscFunctionBeginUser;
  AttackChooseOptions(a, a.r.Chance(0.5));
  PetscCall(AttackCall([&a]() { return KSPSetFromOptions(a.ksp); }, &code, message));
  if (code) a.story += " (refused: " + message + ")";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One choice alone, told to the PC */
static PetscErrorCode Choose(Attack &a, PC pc, const std::string &line)
{
  PetscFunctionBeginUser;
  a.options.reset();
  a.options.reset(new Options(line));
  a.story += "; PC alone: " + line;
  PetscCall(PCSetFromOptions(pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackSetters(Attack &a)
{
  PC          pc;
  Vec         w;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(KSPGetPC(a.ksp, &pc));
  switch (a.r.Int(0, 3)) {
  case 0: {
    const char *variant = a.r.Chance(0.5) ? "paper" : "weighted";
    PetscCall(Choose(a, pc, std::string("-pc_ainsworth_variant ") + variant));
    a.choices["-pc_ainsworth_variant"] = variant;
    break;
  }
  case 1: {
    const char *const types[] = {"jcb", "id", "cc", "cg", "bj_cc", "bj_cg", "auto"};
    PetscCall(Choose(a, pc, std::string("-pc_ainsworth_pmat ") + types[a.r.Int(0, 6)]));
    break;
  }
  case 2:
    PetscCall(MatCreateVecs(a.block[0][0], &w, NULL));
    PetscCall(SetRandom(w, 5));
    PetscCall(VecAbs(w));
    PetscCall(VecShift(w, 0.1));
    PetscCall(PCAinsworthSetWeight(pc, w));
    PetscCall(VecDestroy(&w));
    a.user = true;
    a.story += "; a weight of the program";
    break;
  default:
    if (size > 1) { /* no BoomerAMG there, see options.cpp */
      a.options.reset();
      a.options.reset(new Options("-ainsworth_pc_type jacobi"));
    }
    PetscCall(PCSetType(pc, PCNONE));
    PetscCall(PCSetType(pc, PCAINSWORTH));
    PetscCall(AttackOperators(a));
    PetscCall(PCSetFromOptions(pc));
    PetscCall(AttackWatch(a));
    a.user = false;
    a.story += "; another PC type and back";
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The null space of the whole system, as a program tells it */
PetscErrorCode AttackNullSpace(Attack &a)
{
  const Dense      null = AttackNullSpace(a.s);
  std::vector<Vec> v((size_t)null.cols());
  MatNullSpace     nullspace;
  IS               is[2];

  PetscFunctionBeginUser;
  if (!null.cols() || a.s.nested) PetscFunctionReturn(PETSC_SUCCESS); /* its vectors would have to be nests, too */
  PetscCall(MatNestGetISs(a.nest, is, NULL));
  PetscInt n, k = 0;

  PetscCall(MatGetLocalSize(a.nest, &n, NULL));
  for (Vec &vec : v) {
    PetscCall(VecCreateMPI(PETSC_COMM_WORLD, n, PETSC_DECIDE, &vec));
    for (int field = 0; field < 2; field++) {
      const bool   multiplier = (field == 0) == a.s.first;
      const Column part       = multiplier ? null.col(k).tail(a.s.C.rows()) : null.col(k).head(a.s.A.rows());
      Vec          sub;

      PetscCall(VecGetSubVector(vec, is[field], &sub));
      PetscCall(Scatter(part, sub));
      PetscCall(VecRestoreSubVector(vec, is[field], &sub));
    }
    k++;
  }
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, (PetscInt)v.size(), v.data(), &nullspace));
  PetscCall(MatSetNullSpace(a.whole ? a.whole : a.nest, nullspace));
  PetscCall(MatNullSpaceDestroy(&nullspace));
  for (Vec &vec : v) PetscCall(VecDestroy(&vec));
  a.nullspace = true;
  a.story += "; null space of " + std::to_string(null.cols()) + " attached to the nest";
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackTranspose(Attack &a)
{
  PetscFunctionBeginUser;
  a.transpose = true;
  a.story += "; transposed";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   KSPSetReusePreconditioner() from here on, until it is taken back or KSPSetFromOptions() is called; and something
   changes
*/
PetscErrorCode AttackReuse(Attack &a)
{
  PC        pc;
  PetscBool reuse;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(a.ksp, &pc));
  PetscCall(PCGetReusePreconditioner(pc, &reuse));
  reuse = (PetscBool)!reuse;
  PetscCall(KSPSetReusePreconditioner(a.ksp, reuse));
  a.story += reuse ? "; reuse of the preconditioner" : "; no reuse any more";
  if (a.r.Chance(0.8)) PetscCall(AttackMatrix(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackNested(Attack &a)
{
  PetscFunctionBeginUser;
  a.nested = true;
  a.story += "; another KSP solves inside";
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackSame(Attack &a)
{
  PetscFunctionBeginUser;
  a.story += "; the same again";
  if (a.r.Chance(0.5)) PetscCall(AttackOperators(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}
