static char help[] = "Transposed solves with PCAINSWORTH, symmetric and not, against dense linear algebra; Krylov "
                     "methods for a non-symmetric A.\n\n";

#include "dense.h"

/* minus: the whole matrix is multiplied by -1 */
static PetscErrorCode Transposed(const Spec &spec, const char *inner, bool minus)
{
  Options options(std::string("-ainsworth_pc_type redundant -ainsworth_ksp_rtol 1e-12 -ainsworth_ksp_type ") + inner);
  System  sys;
  Mat     Ct, nest;
  Vec     b, y;
  KSP     ksp;
  PC      pc;
  Dense   K;
  Column  db, dy;
  KSPConvergedReason reason;
  const PetscReal    tolerance = spec.jump == 1.0 && spec.rowscale == 0.0 ? 1e-9 : 1e-5;

  PetscFunctionBeginUser;
  Case("%s, inner method %s%s", spec.name, inner, minus ? ", minus the matrix" : "");
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  if (minus) PetscCall(MatScale(sys.A, -1.0));
  if (minus) PetscCall(MatScale(sys.C, -1.0));
  PetscCall(MatCreateHermitianTranspose(sys.C, &Ct));
  PetscCall(NestCreate(sys.A, Ct, sys.C, NULL, false, &nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(MatCreateVecs(nest, &y, &b));
  PetscCall(SetRandom(b, 95));
  PetscCall(Gather(b, db));
  PetscCall(Gather(nest, K));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(Gather(y, dy));
  PetscCall(CheckEqual("solution", dy, K.fullPivLu().solve(db), tolerance));
  PetscCall(KSPSolveTranspose(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(Gather(y, dy));
  const Dense Kt = K.transpose();
  PetscCall(CheckEqual("solution of the transposed system", dy, Kt.fullPivLu().solve(db), tolerance));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCApplyTranspose(pc, b, y));
  PetscCall(Gather(y, dy));
  PetscCall(CheckEqual("PCApplyTranspose()", dy, Kt.fullPivLu().solve(db), tolerance));
  PetscCall(KSPSolve(ksp, b, y)); /* and back */
  PetscCall(Gather(y, dy));
  PetscCall(CheckEqual("solution after the transposed one", dy, K.fullPivLu().solve(db), tolerance));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A system whose A is not symmetric, its solver and its vectors */
static PetscErrorCode CreateUnsymmetric(System *sys, DenseSystem *d, Mat *nest, KSP *ksp, Vec *y, Vec *b, IS is[])
{
  Spec spec;
  Mat  Ct;

  PetscFunctionBeginUser;
  spec.symmetric = false;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, sys));
  PetscCall(Gather(*sys, *d));
  PetscCall(MatCreateHermitianTranspose(sys->C, &Ct));
  PetscCall(NestCreate(sys->A, Ct, sys->C, NULL, false, nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(SolverCreate(*nest, ksp));
  PetscCall(MatCreateVecs(*nest, y, b));
  PetscCall(MatNestGetISs(*nest, is, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Methods that precondition from the left or the right, in both variants: C x = g to rounding all the same */
static PetscErrorCode Methods(const char *variant, const char *method, PetscReal rtol)
{
  Options options(std::string("-ainsworth_pc_type jacobi -pc_ainsworth_variant ") + variant + " -ainsworth_ksp_rtol " +
                  std::to_string(rtol) + " -ainsworth_ksp_type " + method);
  System  sys;
  DenseSystem        d;
  Mat                nest;
  IS                 is[2];
  Vec                b, y, sub;
  KSP                ksp;
  Dense              K;
  Column             x, whole;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("%s, %s, rtol %g", variant, method, (double)rtol);
  PetscCall(CreateUnsymmetric(&sys, &d, &nest, &ksp, &y, &b, is));
  PetscCall(SetRandom(b, 96));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(VecGetSubVector(b, is[1], &sub));
  PetscCall(Gather(sub, d.g));
  PetscCall(VecRestoreSubVector(b, is[1], &sub));
  PetscCall(VecGetSubVector(y, is[0], &sub));
  PetscCall(Gather(sub, x));
  PetscCall(VecRestoreSubVector(y, is[0], &sub));
  PetscCall(Check("C x - g", (d.C * x - d.g).norm(), 1e-13 * d.g.norm()));
  PetscCall(Gather(nest, K));
  PetscCall(Gather(b, whole));
  PetscCall(Gather(y, x));
  PetscCall(CheckEqual("solution", x, K.fullPivLu().solve(whole), 100 * rtol));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f = C' l, g = 0, as a fluid at rest has it: x is zero to rounding, whose part outside Ker C no method may look for */
static PetscErrorCode Balanced(const char *method)
{
  Options            options(std::string("-ainsworth_pc_type jacobi") + method);
  System             sys;
  DenseSystem        d;
  Mat                nest;
  IS                 is[2];
  Vec                b, y, l, sub[2];
  KSP                ksp;
  Column             x, lambda, given;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("balanced by the constraints%s", method);
  PetscCall(CreateUnsymmetric(&sys, &d, &nest, &ksp, &y, &b, is));
  PetscCall(VecDuplicate(sys.g, &l));
  PetscCall(SetRandom(l, 97));
  PetscCall(Gather(l, given));
  PetscCall(VecGetSubVector(b, is[0], &sub[0]));
  PetscCall(MatMultHermitianTranspose(sys.C, l, sub[0]));
  PetscCall(VecRestoreSubVector(b, is[0], &sub[0]));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(y, is[k], &sub[k]));
    PetscCall(Gather(sub[k], k ? lambda : x));
    PetscCall(VecRestoreSubVector(y, is[k], &sub[k]));
  }
  PetscCall(Check("x", x.norm(), 1e-12 * given.norm()));
  PetscCall(CheckEqual("lambda", lambda, given, 1e-12));
  PetscCall(VecDestroy(&l));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const Spec &spec : UsualSpecs()) {
    if (PetscDefined(USE_COMPLEX) && !spec.symmetric) continue; /* PCAINSWORTH says that it cannot */
    if (spec.symmetric) PetscCall(Transposed(spec, "projectedcg", false));
    if (spec.jump == 1.0) PetscCall(Transposed(spec, "gmres", false));
    if (!spec.symmetric) PetscCall(Transposed(spec, "gmres", true));
  }
  for (const char *variant : {"weighted", "paper"})
    for (const char *method :
         {"gmres", "gmres -ainsworth_ksp_pc_side left", "fgmres", "bcgs", "bcgs -ainsworth_ksp_pc_side right"})
      for (PetscReal rtol : {1e-2, 1e-6}) PetscCall(Methods(variant, method, rtol));
  for (const char *method : {"", " -ainsworth_ksp_type fgmres",
                             " -ainsworth_ksp_type gmres -ainsworth_ksp_pc_side left", " -ainsworth_ksp_type bcgs"})
    PetscCall(Balanced(method));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
