static char help[] = "C++ runs out of memory at one place after the other: an error code each time, never an exception "
                     "in PETSc's frames.\n\n";

#include "run.h"
#include <cstdlib>
#include <new>

/* Allocations of C++ until the next one fails; negative: none does */
static long left = -1;

void *operator new(std::size_t size)
{
  if (left == 0) throw std::bad_alloc();
  if (left > 0) left--;
  if (void *p = std::malloc(size ? size : 1)) return p;
  throw std::bad_alloc();
}

void operator delete(void *p) noexcept
{
  std::free(p);
}

void operator delete(void *p, std::size_t) noexcept
{
  std::free(p);
}

/* Set-up and solve with `allowed` allocations; failed: they were not enough */
static PetscErrorCode Starve(const char *text, long allowed, bool *failed)
{
  Options        options(text);
  Spec           spec;
  Run            run;
  PetscErrorCode code;

  PetscFunctionBeginUser;
  Case("%s, %ld allocations", text, allowed);
  spec.n  = 2400;
  spec.m  = 60;
  spec.bs = 3;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &run.sys));
  PetscCall(NestCreate(run.sys.A, NULL, run.sys.C, NULL, false, &run.nest));
  PetscCall(SolverCreate(run.nest, &run.ksp));
  PetscCall(VecDuplicate(run.sys.f, &run.sys.w));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  left = allowed;
  code = KSPSetUp(run.ksp);
  left = -1;
  PetscCall(PetscPopErrorHandler());
  *failed = code != PETSC_SUCCESS;
  PetscCall(CheckTrue("the error is that of memory", !code || code == PETSC_ERR_MEM));
  if (!code) {
    PetscCall(RunSolve(&run));
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const char *text : {
         "-ainsworth_pc_type blocksa", "-ainsworth_pc_type jacobi -pc_ainsworth_pmat bj_cc",
#if defined(PETSC_HAVE_HYPRE)
           "-ainsworth_pc_type hypre -pc_ainsworth_pmat jcb",
#endif
       }) {
    bool failed  = true;
    long allowed = 0;

    for (; failed && allowed < 100000; allowed += 1 + allowed / 8) {
      PetscCall(Starve(text, allowed, &failed));
      if (failed) unusedOptions.clear(); /* it may end before the inner solver reads its own */
    }
    PetscCall(CheckTrue("with enough of them it works", !failed));
    PetscCall(CheckTrue("some of them are needed", allowed > 4));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
