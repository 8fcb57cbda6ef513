/* unaware.c, linked to the plugin: one call more. */
#include <petscainsworth.h>

#define PROGRAM_REGISTER AinsworthInitializePackage()
#include "unaware.c"
