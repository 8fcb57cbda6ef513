static char help[] = "Every form of conjugate gradients in Ker C takes the iterations of KSPPROJECTEDCG, on two cubes "
                     "of which one is soft.\n\n";

#include "../../tests/bench/cubes.h"
#include <petscainsworth.h>
#include <string>

struct Fields {
  Mat nest;
  IS  is[2];
  Vec b, y, r;
};

static PetscErrorCode FieldsCreate(const CubesSystem &s, Fields *fields)
{
  Mat T, blocks[4];

  PetscFunctionBeginUser;
  PetscCall(MatCreateTranspose(s.C, &T));
  blocks[0] = s.A;
  blocks[1] = T;
  blocks[2] = s.C;
  blocks[3] = NULL;
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &fields->nest));
  PetscCall(MatDestroy(&T));
  PetscCall(MatNestGetISs(fields->nest, fields->is, NULL));
  PetscCall(MatCreateVecs(fields->nest, &fields->y, &fields->b));
  PetscCall(VecDuplicate(fields->b, &fields->r));
  for (int i = 0; i < 2; i++) PetscCall(VecISCopy(fields->b, fields->is[i], SCATTER_FORWARD, i ? s.g : s.f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FieldsDestroy(Fields *fields)
{
  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&fields->nest));
  PetscCall(VecDestroy(&fields->b));
  PetscCall(VecDestroy(&fields->y));
  PetscCall(VecDestroy(&fields->r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Iterations of the reduced solve; the residual of the whole system, which knows nothing of the method, has to be as
   small as was asked for
*/
static PetscErrorCode Iterations(const Fields &fields, const char method[], const char rtol[], PetscInt *iterations)
{
  KSP                ksp, inner;
  PC                 pc;
  KSPConvergedReason reason;
  PetscOptions       own;
  PetscReal          asked, residual, norm;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsCreate(&own));
  PetscCall(PetscOptionsPush(own));
  PetscCall(PetscOptionsInsertString(NULL, method));
  PetscCall(PetscOptionsSetValue(NULL, "-ainsworth_ksp_rtol", rtol));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPSetOperators(ksp, fields.nest, fields.nest));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSolve(ksp, fields.b, fields.y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCheck(reason > 0, PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED, "%s to %s: %s", method, rtol,
             KSPConvergedReasons[reason]);
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetIterationNumber(inner, iterations));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(PetscOptionsPop());
  PetscCall(PetscOptionsDestroy(&own));
  PetscCall(MatMult(fields.nest, fields.y, fields.r));
  PetscCall(VecAXPY(fields.r, -1.0, fields.b));
  PetscCall(VecNorm(fields.r, NORM_2, &residual));
  PetscCall(VecNorm(fields.b, NORM_2, &norm));
  asked = (PetscReal)std::stod(rtol);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s to %s: %" PetscInt_FMT " iterations, residual %.2g\n", method, rtol,
                        *iterations, (double)(residual / norm)));
  PetscCheck(residual <= 10 * asked * norm, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "%s to %s: residual %g", method, rtol,
             (double)(residual / norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const char *const methods[] = {"cg",
                                 "cg -ainsworth_ksp_cg_single_reduction",
                                 "projectedcg -ainsworth_ksp_cg_single_reduction",
                                 "pipecg",
                                 "groppcg",
                                 "pipeprcg",
                                 "pipefcg",
                                 "fcg"};
  CubesOptions      options;
  CubesSystem       system;
  Fields            fields;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(CubesOptionsGet(PETSC_COMM_WORLD, &options));
  PetscCall(CubesSystemCreate(PETSC_COMM_WORLD, options, &system));
  PetscCall(FieldsCreate(system, &fields));
  for (const char *rtol : {"1e-8", "1e-13"}) {
    PetscInt expected, iterations;

    PetscCall(Iterations(fields, "", rtol, &expected));
    for (const char *method : methods) {
      if (PetscDefined(USE_COMPLEX) && std::string(method) == KSPPIPEFCG) continue; /* PETSc has it for real numbers */
      PetscCall(Iterations(fields, (std::string("-ainsworth_ksp_type ") + method).c_str(), rtol, &iterations));
      PetscCheck(PetscAbsInt(iterations - expected) <= 1, PETSC_COMM_WORLD, PETSC_ERR_PLIB,
                 "%" PetscInt_FMT " iterations of the default, %" PetscInt_FMT " of %s", expected, iterations, method);
    }
    /* it takes another multigrid: its residual counts */
    PetscCall(Iterations(fields, "-ainsworth_ksp_type gmres", rtol, &iterations));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "methods: passed\n"));
  PetscCall(FieldsDestroy(&fields));
  PetscCall(CubesSystemDestroy(&system));
  PetscCall(PetscFinalize());
  return 0;
}
