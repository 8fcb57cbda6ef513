/* The two numbers of a machine by which times are predicted */
#ifndef AINSWORTH_MACHINE_H
#define AINSWORTH_MACHINE_H

#include "petsccompat.h"

/* The defaults are those of a core of a cluster */
struct AinsworthMachine {
  PetscReal rate    = 8e8;  /* entries of a matrix that a rank multiplies in a second */
  PetscReal message = 2e-6; /* seconds that a message takes */

  bool operator==(const AinsworthMachine &other) const { return rate == other.rate && message == other.message; }
};

/* Reads the options with these names; to be called between PetscObjectOptionsBegin() and PetscOptionsEnd() */
static inline PetscErrorCode AinsworthMachineSetFromOptions(PetscObject object, AinsworthOptionItems PetscOptionsObject,
                                                            const char rate[], const char message[],
                                                            AinsworthMachine *machine)
{
  const char *type;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetType(object, &type));
  PetscCall(PetscOptionsReal(rate, "Entries of a matrix that a process multiplies in a second", type, machine->rate,
                             &machine->rate, NULL));
  PetscCall(PetscOptionsReal(message, "Seconds that a message takes", type, machine->message, &machine->message, NULL));
  PetscCheck(machine->rate > 0.0, PetscObjectComm(object), PETSC_ERR_ARG_OUTOFRANGE, "%s must be positive, not %g",
             rate, (double)machine->rate);
  PetscCheck(machine->message >= 0.0, PetscObjectComm(object), PETSC_ERR_ARG_OUTOFRANGE,
             "%s must not be negative, not %g", message, (double)machine->message);
  PetscFunctionReturn(PETSC_SUCCESS);
}

#endif
