/*
   Vibrations of the models of models/model.h:

       [ A  C' ] [ u      ]          [ M  0 ] [ u      ]
       [ C  0  ] [ lambda ] = omega2 [ 0  0 ] [ lambda ]

   M is the consistent mass matrix of the cubes, -density1 and -density2; nodes beyond the cubes have no mass. Nodes with
   a Dirichlet condition have a zero row in M.
*/
#ifndef BENCH_MODES_PENCIL_H
#define BENCH_MODES_PENCIL_H

#include "../models/model.h"

struct ModesPencil {
  Model model;
  Mat   mass; /* of the primal field */
  Mat   K, M; /* of the whole system: MATNEST, or AIJ with -layout aij */
  IS    dual; /* the multipliers of K */
};

PetscErrorCode ModesPencilCreate(MPI_Comm, ModesPencil *);
PetscErrorCode ModesPencilDestroy(ModesPencil *);
/* AIJ, with the rows of C that do not depend on others; for factorizations */
PetscErrorCode ModesPencilAssemble(const ModesPencil &, Mat *K, Mat *M, PetscInt *rows);

#endif
