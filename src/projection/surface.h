/* The projectors Q and Q' on the unknowns in rows of C alone: they leave all others */
#ifndef AINSWORTH_SURFACE_H
#define AINSWORTH_SURFACE_H

#include "projector.h"
#include <vector>

struct AinsworthSurface {
  AinsworthProjector     *projector = NULL; /* borrowed */
  std::vector<PetscInt>   places;           /* the local unknowns in rows of C, ascending */
  std::vector<PetscReal>  weight;           /* W at these */
  AinsworthProjectorSides sides;            /* columns: these unknowns; owned */
  Vec                     values = NULL;    /* work space for their values */

  AinsworthSurface()                         = default;
  AinsworthSurface(const AinsworthSurface &) = delete;
  ~AinsworthSurface();
};

PetscErrorCode AinsworthSurfaceSetUp(AinsworthSurface *, AinsworthProjector *, Mat, Vec, Vec);
PetscErrorCode AinsworthSurfaceProject(const AinsworthSurface *, bool, Vec);

#endif
