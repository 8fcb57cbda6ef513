/* A saddle-point system in the form that a solver wants */
#ifndef TUTORIALS_FORMS_H
#define TUTORIALS_FORMS_H

#include "saddle.h"

enum FormType {
  FORM_NEST, /* [A B'; C -D] as a MatNest */
  FORM_AIJ,  /* the same as one sparse matrix */
  /*
     [A + C' B C, C'; C 0], preconditioning matrix with -B^{-1} in the corner; B = gamma / diag(C diag(A)^{-1} C')
  */
  FORM_AUGMENTED,
  FORM_ELIMINATED /* T' A T, x = T y + x0: one unknown of each constraint is expressed by the others */
};
extern const char *const FormTypes[];

struct Form {
  FormType type;
  Mat      A, B, C, D;   /* of the system, not owned; B is C where the program has none */
  Mat      K, M;         /* what the solver gets: operator and preconditioning matrix */
  Vec      rhs, y;       /* its right-hand side and its solution */
  IS       fields[2];    /* of x and lambda in y; none with FORM_ELIMINATED */
  Mat      T;            /* FORM_ELIMINATED */
  Vec      x0, f;        /* FORM_ELIMINATED; f not owned */
  IS       slaves;       /* FORM_ELIMINATED: the unknown of each constraint */
  Vec      coefficients; /* FORM_ELIMINATED: its entry in C */
};

PetscErrorCode FormCreate(const SaddleBlocks &, Vec f, Vec g, FormType, PetscReal gamma, Form *);
PetscErrorCode FormGetSolution(const Form &, Vec x, Vec lambda);
PetscErrorCode FormDestroy(Form *);

PetscErrorCode FormCopyNearNullSpace(Mat from, Mat to);
PetscErrorCode FormCreateEliminated(Vec g, Form *);
PetscErrorCode FormGetEliminated(const Form &, Vec x, Vec lambda);

#endif
