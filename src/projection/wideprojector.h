/* The projector for multivectors (base/multivector.h) */
#ifndef AINSWORTH_WIDEPROJECTOR_H
#define AINSWORTH_WIDEPROJECTOR_H

#include "projector.h"
#include "../base/multivector.h"
#include "../base/objects.h"

/* Products with C and C W read its entries once; solves with S are made one after the other */
class AinsworthWideProjector {
public:
  /* proj: factors S, B is C, and D is zero; it stays the caller's. Collective */
  PetscErrorCode create(AinsworthProjector *proj, PetscInt width);
  /* Replaces x by Q x or Q' x. Collective */
  PetscErrorCode project(bool adjoint, Vec x) const;

private:
  AinsworthProjector                     *of    = NULL;
  PetscInt                                width = 1;
  std::shared_ptr<const AinsworthSurface> surface;
  AinsworthRef<Vec>                       values, solution;
};

#endif
