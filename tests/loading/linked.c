/* unaware.c, linked to the plugin: one call more. */
#include <petscainsworth.h>

#if !AINSWORTH_VERSION_GE(0, 2, 0) || \
  AINSWORTH_VERSION_GE(AINSWORTH_VERSION_MAJOR, AINSWORTH_VERSION_MINOR, AINSWORTH_VERSION_SUBMINOR + 1)
  #error "AINSWORTH_VERSION_GE() is wrong"
#endif

#define PROGRAM_REGISTER AinsworthInitializePackage()
#include "unaware.c"
