/* Two blocks of elastic material, one on the other, that touch in the origin: a quarter of them, in the plane a half */
#ifndef TUTORIALS_BODIES_H
#define TUTORIALS_BODIES_H

#include "../../tests/bench/scenes/scene.h"
#include <petscsnes.h>

struct BodiesOptions {
  PetscInt  dim, n[2]; /* cells along each edge, lower and upper body */
  PetscReal E[2], nu;  /* Young's moduli, and Poisson's ratio of both */
  PetscReal near, far; /* half of the cells lie within near of the origin, all within far */
  PetscReal radius;    /* of the upper body, whose surface is at r^2 / (2 radius) */
};

/* A node of the upper body that may come into contact: the multiplier of its row is its force */
struct ContactNode {
  PetscInt  row; /* local number of its multiplier in the vectors of the system */
  PetscReal x[3], area, gap;
};

struct Bodies {
  BodiesOptions options;
  Scene         scene;
  Mat           A, C, N; /* N = -C */
  Mat           J;       /* [A C'; -C 0] */
  /* for all unknowns: the distance before anything moves in rows of contact, zero elsewhere */
  Vec                      gaps;
  Vec                      contact;  /* for all unknowns: 1 in rows of contact, zero elsewhere */
  std::vector<ContactNode> node;     /* of this rank */
  PetscReal                approach; /* how far the upper body is moved down */
};

PetscErrorCode BodiesCreate(MPI_Comm, const BodiesOptions &, Bodies *);
PetscErrorCode BodiesDestroy(Bodies *);
/* (A u + C' l, gap - approach - C u), and its Jacobian, which does not change; ctx: Bodies */
PetscErrorCode BodiesFunction(SNES, Vec, Vec, void *ctx);
PetscErrorCode BodiesJacobian(SNES, Vec, Mat, Mat, void *ctx);
/* The deformed bodies, their displacement and the forces of contact, for ParaView */
PetscErrorCode BodiesViewVTU(const Bodies &, Vec solution, const char file[]);

#endif
