/*
   The last rung of the ladder: the whole system K = [A B'; C -D] on the kept rows, equilibrated, assembled and factored
*/
#ifndef AINSWORTH_WHOLE_H
#define AINSWORTH_WHOLE_H

#include "../projection/symbolic.h"
#include "../saddle/saddle.h"

struct AinsworthWhole;

/*
   symmetric: A = A', B = C, D = D'; scale: S, positive powers of 2, with the layout of the columns and of the rows of C
*/
PetscErrorCode AinsworthWholePredict(const AinsworthSaddle *, PetscBool symmetric, AinsworthCost *);
PetscErrorCode AinsworthWholeCreate(const AinsworthSaddle *, PetscBool symmetric, AinsworthSaddleVec scale,
                                    const char prefix[], AinsworthWhole **, char why[], size_t len);
PetscErrorCode AinsworthWholeSolve(const AinsworthWhole *, PetscBool transpose, AinsworthSaddleVec b,
                                   AinsworthSaddleVec y);
PetscErrorCode AinsworthWholeView(const AinsworthWhole *, PetscViewer);
PetscErrorCode AinsworthWholeDestroy(AinsworthWhole **);

/* wholemat.cpp */
PetscErrorCode AinsworthWholeAssemble(const AinsworthSaddle *, Mat *);

#endif
