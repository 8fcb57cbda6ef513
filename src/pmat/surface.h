/* The contact surface: the constrained degrees of freedom with their neighbours in A, numbered on their own */
#ifndef AINSWORTH_SURFACE_H
#define AINSWORTH_SURFACE_H

#include "../petsccompat.h"
#include <vector>

PetscErrorCode AinsworthSurfaceCreate(Mat, Mat, PetscBool, IS *);
PetscErrorCode AinsworthSurfaceCountConstrained(Mat, PetscInt *);
PetscErrorCode AinsworthSurfaceGetGhosts(Mat, IS, std::vector<PetscInt> &);

#endif
