static char help[] = "x and lambda of PCAINSWORTH against a dense LU of the full system.\n\n";

#include "layout.h"
#include "pmatreference.h"

static const char *const variants[] = {"weighted", "paper"};

static PetscErrorCode Layouts()
{
  Options     options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");
  Spec        spec;
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (int ct = 0; ct < 4; ct++) {
    for (int bits = 0; bits < 32; bits++) {
      Layout layout;
      Mat    nest;
      KSP    ksp;

      layout.ct            = (decltype(layout.ct))ct;
      layout.c             = bits & 1;
      layout.empty         = bits & 2;
      layout.first         = bits & 4;
      layout.nestedVectors = bits & 8;
      layout.view          = bits & 16;
      if (layout.view && (!layout.c || layout.empty || layout.nestedVectors)) continue;
      if (!layout.c && ct == Layout::ABSENT) continue;
      if (PetscDefined(USE_COMPLEX) && ct == Layout::TRANSPOSE) continue; /* not the adjoint: refused */
      Case("C' %d, C %d%s, (1,1) %d, first %d, VecNest %d", ct, layout.c, layout.view ? " a view" : "", layout.empty,
           layout.first, layout.nestedVectors);
      PetscCall(LayoutCreate(sys, layout, &nest));
      PetscCall(SolverCreate(nest, &ksp));
      PetscCall(CheckSolution(ksp, sys, d, layout.first, layout.nestedVectors, 1e-10));
      PetscCall(KSPDestroy(&ksp));
      PetscCall(MatDestroy(&nest));
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every variant and preconditioning matrix, with g and without */
static PetscErrorCode Pmats(const Spec &spec)
{
  System          sys;
  DenseSystem     d;
  const PetscReal tolerance = spec.jump == 1.0 && spec.rowscale == 0.0 ? 1e-10 : 1e-6;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (int variant = 0; variant < 2; variant++) {
    for (int type = 0; type < 6; type++) {
      Options options(std::string("-ainsworth_pc_type redundant -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_variant ") +
                      variants[variant] + " -pc_ainsworth_pmat " + PmatName(type) +
                      (spec.symmetric ? "" : " -ainsworth_ksp_type gmres"));
      Mat     nest;
      KSP     ksp;

      Case("%s, %s, %s", spec.name, variants[variant], PmatName(type));
      PetscCall(LayoutCreate(sys, Layout(), &nest));
      PetscCall(SolverCreate(nest, &ksp));
      PetscCall(CheckSolution(ksp, sys, d, false, type % 2, tolerance));
      if (type < 2) {
        System      zero  = sys;
        DenseSystem dzero = d;

        PetscCall(VecDuplicate(sys.g, &zero.g));
        PetscCall(VecSet(zero.g, 0.0));
        dzero.g.setZero();
        Case("%s, %s, %s, g = 0", spec.name, variants[variant], PmatName(type));
        PetscCall(CheckSolution(ksp, zero, dzero, false, false, tolerance));
        PetscCall(VecDestroy(&zero.g));
      }
      PetscCall(KSPDestroy(&ksp));
      PetscCall(MatDestroy(&nest));
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No constraints at all, with both variants */
static PetscErrorCode Unconstrained()
{
  PetscFunctionBeginUser;
  for (int variant = 0; variant < 2; variant++) {
    for (bool uneven : {false, true}) {
      Options     options(std::string("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_variant ") +
                          variants[variant]);
      Spec        spec;
      System      sys;
      DenseSystem d;
      Mat         nest;
      KSP         ksp;

      spec.m      = 0;
      spec.uneven = uneven;
      Case("m = 0, %s, uneven %d", variants[variant], uneven);
      PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
      PetscCall(Gather(sys, d));
      PetscCall(LayoutCreate(sys, Layout(), &nest));
      PetscCall(SolverCreate(nest, &ksp));
      PetscCall(CheckSolution(ksp, sys, d, false, false, 1e-10));
      PetscCall(CheckSolution(ksp, sys, d, false, true, 1e-10));
      PetscCall(KSPDestroy(&ksp));
      PetscCall(MatDestroy(&nest));
      PetscCall(SystemDestroy(&sys));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(Layouts());
  for (const Spec &spec : UsualSpecs()) PetscCall(Pmats(spec));
  PetscCall(Unconstrained());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
