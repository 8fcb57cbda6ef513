/*
   What a method of the reduced solve iterates with: an operator and a preconditioner in Ker C, or a preconditioner that
   has the springs of D
*/
#ifndef AINSWORTH_INKERNEL_H
#define AINSWORTH_INKERNEL_H

#include "deflation.h"

/* The operator Q' A in Ker C, and the preconditioner Q M^{-1}. Collective */
PETSC_INTERN PetscErrorCode AinsworthInKernelCreateOperator(Mat reduced, Mat *operation);
PETSC_INTERN PetscErrorCode AinsworthInKernelCreatePC(Mat reduced, Mat operation, PC inner,
                                                      const AinsworthLeftOut &left, PC *pc);

/* Gets the corrections that this preconditioner makes, once it has been set up for a solve; borrowed. Not collective */
PETSC_INTERN PetscErrorCode AinsworthInKernelGetDeflation(PC pc, const AinsworthDeflation **deflation);

/* M^{-1} with the springs of D, and M^{-1} itself; symmetric: M is, so that it is its own transpose. Collective */
PETSC_INTERN PetscErrorCode AinsworthSpringsCreatePC(Mat reduced, PC inner, PetscBool symmetric, PC *pc);
PETSC_INTERN PetscErrorCode AinsworthPlainCreatePC(PC inner, PetscBool symmetric, PC *pc);

/* Checks whether an operator is one in Ker C. Not collective */
PETSC_INTERN PetscErrorCode AinsworthInKernelIs(Mat operation, PetscBool *inKernel);
/*
   Gets M^{-1} from a preconditioner made above, any other itself; checks whether one made above surrounds another, of
   the same type as then. Not collective
*/
PETSC_INTERN PetscErrorCode AinsworthGetInnermostPC(PC pc, PC *inner);
PETSC_INTERN PetscErrorCode AinsworthSurrounds(PC pc, PC inner, PetscBool *surrounds);

#endif
