/*
   Vibrations of the models of models/model.h:

       [ A  C' ] [ u      ]          [ M  0 ] [ u      ]
       [ C  0  ] [ lambda ] = omega2 [ 0  0 ] [ lambda ]

   M is the consistent mass matrix of the cubes, -density1 and -density2; nodes beyond the cubes have no mass. Nodes
   with a Dirichlet condition have a zero row in M.

   With -prestress it is minus the geometric stiffness under that stress, the same at all points, which is indefinite:
   the stress times the smallest positive omega2 makes the model buckle. With -swapped the program's pencil is (M, K).
*/
#ifndef BENCH_MODES_PENCIL_H
#define BENCH_MODES_PENCIL_H

#include "../models/model.h"
#include <slepceps.h>

struct ModesPencil {
  Model model;
  Mat   mass;         /* of the primal field */
  Mat   K, M;         /* of the whole system: MATNEST, or AIJ with -layout aij */
  IS    primal, dual; /* of K */

  PetscBool swapped;
};

PetscErrorCode ModesPencilCreate(MPI_Comm, ModesPencil *);
PetscErrorCode ModesPencilDestroy(ModesPencil *);
/* The matrices in the order of the program */
PetscErrorCode ModesPencilSetOperators(const ModesPencil &, EPS);
/* AIJ, with the rows of C that do not depend on others; for factorizations */
PetscErrorCode ModesPencilAssemble(const ModesPencil &, Mat *K, Mat *M, PetscInt *rows);

#endif
