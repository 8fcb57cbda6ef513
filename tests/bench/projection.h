/* Orthogonal projection of a point on the contact surface of the primary body */
#ifndef TUTORIALS_PROJECTION_H
#define TUTORIALS_PROJECTION_H

#include "cubes.h"

struct Projection {
  PetscInt  node[4];   /* natural numbers of the corners of the face */
  PetscReal weight[4]; /* bilinear shape functions there, in [0,1], of sum 1 */
  PetscReal normal[3]; /* unit, towards the secondary body, before -rotate */
  PetscReal distance;
};

PetscErrorCode ProjectOnPrimary(const CubesMesh &, const PetscReal x[3], Projection *);

#endif
