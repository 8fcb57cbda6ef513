/* MPI types of what a star forest moves as one: blocks, rows of multivectors */
#ifndef AINSWORTH_UNIT_H
#define AINSWORTH_UNIT_H

#include "petsccompat.h"

/*
   An MPI type of n numbers in a row, freed at the end of its scope; for n = 1 the base type itself, as PetscSF cannot
   reduce a contiguous type of one
*/
class AinsworthUnit {
public:
  AinsworthUnit(PetscInt n, MPI_Datatype base) : type(base), own(n != 1)
  {
    if (!own) return;
    (void)MPI_Type_contiguous((PetscMPIInt)n, base, &type);
    (void)MPI_Type_commit(&type);
  }
  ~AinsworthUnit()
  {
    if (own) (void)MPI_Type_free(&type);
  }
  AinsworthUnit(const AinsworthUnit &)            = delete;
  AinsworthUnit &operator=(const AinsworthUnit &) = delete;
  MPI_Datatype   type;

private:
  const bool own;
};

#endif
