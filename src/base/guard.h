/* Turns C++ exceptions into PETSc error codes: they must not propagate through PETSc's C frames */
#ifndef AINSWORTH_GUARD_H
#define AINSWORTH_GUARD_H

#include "petsccompat.h"
#include <exception>

template <auto function>
struct AinsworthGuard;

template <typename... Arguments, PetscErrorCode (*function)(Arguments...)>
struct AinsworthGuard<function> {
  static PetscErrorCode call(Arguments... arguments)
  {
    try {
      return function(arguments...);
    } catch (const std::exception &exception) { /* std::bad_alloc, or std::length_error from a vector */
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_MEM, "ainsworth ran out of memory: %s", exception.what());
    }
  }
};

/* A wrapper of `function` that catches exceptions, to be used as a callback or as an operation of a PETSc object */
template <auto function>
constexpr auto AinsworthGuarded = &AinsworthGuard<function>::call;

#endif
