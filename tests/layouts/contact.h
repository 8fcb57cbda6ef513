/* Two lattices of springs tied by multipliers, in one matrix; the layouts of programs are made of its submatrices */
#ifndef TESTS_CONTACT_H
#define TESTS_CONTACT_H

#include "dense.h"

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
  Mat      A = NULL, C = NULL;                 /* of the primal unknowns together, two to a node */
  Vec      solution = NULL, rhs = NULL;        /* random */
  PetscInt size[FIELDS], local[FIELDS];        /* of the fields */
};

PetscErrorCode ContactCreate(PetscInt n, Contact *);
PetscErrorCode ContactDestroy(Contact *);
/* ties of another strength: other values of C, and the right-hand side for them, in whole itself */
PetscErrorCode ContactScaleTies(Contact *, PetscScalar);

#endif
