static char help[] = "Scale, backward error and iterative refinement of [A B'; C -D], against dense linear "
                     "algebra.\n\n";

#include "system.h"

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(TestDecide());
  PetscCall(TestChange());
  PetscCall(TestScale());
  PetscCall(TestError());
  PetscCall(TestRefine());
  PetscCall(TestCertify());
  PetscCall(TestDepend());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
