/* Hides differences between SLEPc 3.18 and 3.25, beside those of PETSc */
#ifndef AINSWORTH_SLEPCCOMPAT_H
#define AINSWORTH_SLEPCCOMPAT_H

#include "../base/petsccompat.h"
#include <slepceps.h>

/* a stopping test that has no number of wanted modes; since 3.23 */
#if SLEPC_VERSION_LT(3, 23, 0)
  #define AinsworthStopsByThreshold(eps) PETSC_FALSE
#else
  #define AinsworthStopsByThreshold(eps) ((eps)->stop == EPS_STOP_THRESHOLD)
#endif

/*
   Vectors of the program's type in a BV, VECNEST among them: 3.18 can, 3.22 cannot, those between were not tried
*/
#define AinsworthBVTakesNests SLEPC_VERSION_LT(3, 20, 0)

#endif
