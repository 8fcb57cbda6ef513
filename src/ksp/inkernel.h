/* What a method of the reduced solve iterates with: an operator and a preconditioner in Ker C, or a preconditioner that has the springs of D */
#ifndef AINSWORTH_INKERNEL_H
#define AINSWORTH_INKERNEL_H

#include "deflation.h"

/* Each of these holds a reference to what it is made of. Collective */
PETSC_INTERN PetscErrorCode AinsworthInKernelCreateOperator(Mat reduced, Mat *operation);
PETSC_INTERN PetscErrorCode AinsworthInKernelCreatePC(Mat reduced, Mat operation, PC inner, const AinsworthLeftOut &left, PC *pc);
PETSC_INTERN PetscErrorCode AinsworthSpringsCreatePC(Mat reduced, PC inner, PC *pc);

/* Tells whether an operator is one in Ker C; gets M^{-1} from a preconditioner made above, any other itself. Not collective */
PETSC_INTERN PetscErrorCode AinsworthInKernelIs(Mat operation, PetscBool *inKernel);
PETSC_INTERN PetscErrorCode AinsworthGetInnermostPC(PC pc, PC *inner);
/* Tells whether a preconditioner made above is around this one, of the same type as then */
PETSC_INTERN PetscErrorCode AinsworthSurrounds(PC pc, PC inner, PetscBool *surrounds);

#endif
