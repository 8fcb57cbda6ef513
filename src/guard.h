/* PETSc is C: no exception may reach the frames of its functions */
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
    } catch (const std::exception &exception) { /* std::bad_alloc, or a length that no vector has */
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_MEM, "ainsworth ran out of memory: %s", exception.what());
    }
  }
};

/* The function in whose place PETSc, or a program, calls this one: what C++ throws becomes an error code */
template <auto function>
constexpr auto AinsworthGuarded = &AinsworthGuard<function>::call;

#endif
