/* Two lattices of springs tied by multipliers, in one matrix; the layouts of programs are made of its submatrices */
#ifndef SPRINGS_H
#define SPRINGS_H

#include <petscksp.h>

/* The DM of a KSP tells of fields; the matrix is the program's own */
#if PETSC_VERSION_LT(3, 25, 0)
  #define KSPKeepOperators(ksp) KSPSetDMActive(ksp, PETSC_FALSE)
#else
  #define KSPKeepOperators(ksp) KSPSetDMActive(ksp, KSP_DMACTIVE_ALL, PETSC_FALSE)
#endif

enum {
  LEFT,
  RIGHT,
  TIES,
  FIELDS
};
struct Contact {
  Mat      whole      = NULL;                  /* AIJ; each rank has its part of LEFT, then of RIGHT, then of TIES */
  IS       is[FIELDS] = {NULL}, primal = NULL; /* primal: LEFT and RIGHT */
  Mat      block[FIELDS][FIELDS] = {{NULL}};   /* its submatrices, NULL where there are no entries */
  Mat      A = NULL, C = NULL;                 /* of the primal unknowns together */
  PetscInt dim, n;                             /* unknowns of a node, nodes along each side of both bodies */
  PetscInt size[FIELDS], local[FIELDS];        /* of the fields */
};

PetscErrorCode ContactCreate(PetscInt dim, PetscInt n, Contact *);
PetscErrorCode ContactDestroy(Contact *);

#endif
