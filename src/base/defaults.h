/* Our defaults in the options database, for what reads its parameters from there only */
#ifndef AINSWORTH_DEFAULTS_H
#define AINSWORTH_DEFAULTS_H

#include "petsccompat.h"
#include <string>
#include <vector>

/*
   Sets options of an object that are not given; clear() removes them, because they would look like the program's
   options otherwise
*/
struct AinsworthDefaults {
  PetscObject              object;
  std::vector<std::string> names;

  PetscErrorCode set(const char name[], const char value[])
  {
    PetscOptions options;
    const char  *prefix;
    PetscBool    given;

    PetscFunctionBegin;
    PetscCall(PetscObjectGetOptions(object, &options));
    PetscCall(PetscObjectGetOptionsPrefix(object, &prefix));
    PetscCall(PetscOptionsHasName(options, prefix, (std::string("-") + name).c_str(), &given));
    if (given) PetscFunctionReturn(PETSC_SUCCESS);
    names.push_back(std::string("-") + (prefix ? prefix : "") + name);
    PetscCall(PetscOptionsSetValue(options, names.back().c_str(), value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscErrorCode clear()
  {
    PetscOptions options;

    PetscFunctionBegin;
    PetscCall(PetscObjectGetOptions(object, &options));
    for (const std::string &name : names) PetscCall(PetscOptionsClearValue(options, name.c_str()));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

#endif
