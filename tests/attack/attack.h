/* One KSP taken through a sequence of actions: the program's objects, their dense twins, and what each solve came to */
#ifndef TESTS_ATTACK_H
#define TESTS_ATTACK_H

#include "randomsystem.h"
#include <map>
#include <memory>

enum Verdict {
  RIGHT,    /* a positive reason, and both equations hold */
  REFUSED,  /* a negative reason, or an error with a text, where no solution was promised */
  UNSOLVED, /* the same where one was */
  /* a positive reason without a solution, an internal error, an error without a text, or ranks that do not agree */
  WRONG,
  VERDICTS
};

/* Where the multipliers stand in the program's numbering, on each rank */
enum Order {
  AFTER,
  BEFORE,
  INTERLEAVED,
  ORDERS
};

/* How the program stores A; NEST: of one block */
enum Storage {
  STORE_AIJ,
  STORE_BAIJ,
  STORE_SBAIJ,
  STORE_DENSE,
  STORE_SHELL,
  STORE_NEST,
  STORAGES
};

/* What the program passes: the nest, or one AIJ whose fields it names, or nobody */
enum Shape {
  SHAPE_NEST,
  SHAPE_NAMED,
  SHAPE_DIAGONAL,
  SHAPES
};

struct Attack {
  Random       r;      /* of the actions: the same on any number of ranks */
  Random       layout; /* of the distribution over the ranks */
  RandomSystem s;      /* the values as they are */

  /* how the program holds them */
  std::vector<PetscInt> rows[2]; /* of A and of C, on each rank */
  Order                 order;
  Storage               storage;
  bool                  split; /* C is a nest of two blocks of rows */
  Mat                   A = NULL,
      C[2] =
        {
          NULL, NULL
  },
      block[2][2] = {{NULL, NULL}, {NULL, NULL}}; /* A, C: what values are written to */
  Mat   nest      = NULL;
  Shape shape     = SHAPE_NEST;
  Mat   whole     = NULL; /* the AIJ, of the numbering of the nest */
  KSP   ksp       = NULL;

  /* options that were ever set since the KSP was made, the last value of each, and those in the database now */
  std::map<std::string, std::string> choices;
  std::unique_ptr<Options>           options;

  /* what holds for one step only, and is undone before the next action */
  bool        transpose = false, explode = false, nested = false, nullspace = false, broken = false, strict = false;
  bool        other    = false; /* the KSP holds another operator than the nest */
  bool        bogus    = false; /* an option that cannot be read */
  int         badEntry = -1;    /* of (f, g), which is badValue */
  PetscReal   badValue = 0.0;
  int         badRow   = -1;  /* of A, or behind its rows of C, one entry of which is badValue */
  Dense       goodA, goodC;   /* without it */
  bool        must   = false; /* this step has to be refused */
  bool        named  = false; /* fields of an AIJ, which are not forgotten */
  bool        otherB = false; /* the block (0,1) is not C' */
  bool        user   = false; /* a weight of the program, or other calls that promise nothing */
  int         errors = 0;     /* that left KSPSolve() */
  std::string story;

  Attack(PetscInt64 seed, const RandomSystem &);
};

/* build.cpp: the program's objects */
PetscErrorCode AttackBuild(Attack &, bool sameTotal);            /* matrices and nest for the present system */
PetscErrorCode AttackNest(Attack &);                             /* another nest of the same blocks, or the AIJ of it */
PetscErrorCode AttackOperators(Attack &);                        /* the KSP has it, and the names of its fields */
PetscErrorCode AttackWrite(Attack &, bool stiffness, bool rows); /* present values into the same matrices */
PetscErrorCode AttackClear(Attack &);                            /* matrices and nest */
PetscErrorCode AttackSolver(Attack &);                           /* a KSP for the nest */
PetscErrorCode AttackWatch(Attack &);                            /* the monitor of the inner KSP */

/* options.cpp */
void AttackChooseOptions(Attack &, bool all);
bool AttackTame(const Attack &); /* do the options leave a well-posed system solvable? */

/* actions.cpp, settings.cpp, errors.cpp: change something, tell the story */
PetscErrorCode AttackUndo(Attack &); /* what was for one step only */
PetscErrorCode AttackAct(Attack &);
PetscErrorCode AttackMatrix(Attack &); /* one of the actions that change the matrix */
PetscErrorCode AttackChangeOptions(Attack &);
PetscErrorCode AttackSetters(Attack &);
PetscErrorCode AttackNullSpace(Attack &);
PetscErrorCode AttackTranspose(Attack &);
PetscErrorCode AttackReuse(Attack &);
PetscErrorCode AttackNested(Attack &);
PetscErrorCode AttackSame(Attack &);
PetscErrorCode AttackPoison(Attack &);
PetscErrorCode AttackWrongMatrix(Attack &);
PetscErrorCode AttackWrongOption(Attack &);
PetscErrorCode AttackBrokenAdjoint(Attack &, bool stays);
PetscErrorCode AttackErrorInside(Attack &);
PetscErrorCode AttackErrorIfNotConverged(Attack &);

/* judge.cpp */
/*
   tested: the positive reason comes from a test of PCAINSWORTH's own; otherwise an outer method's, or none at all,
   answers for it
*/
Verdict AttackJudge(const RandomSystem &, bool tame, bool must, bool tested, KSPConvergedReason, const Column &x,
                    const Column &lambda, std::string &why);
bool    AttackInternal(PetscErrorCode, const std::string &message); /* an error that no input should lead to */
Dense   AttackNullSpace(const RandomSystem &);

bool AttackAdjoint(const RandomSystem &); /* is B = C and D symmetric? */

/* solve.cpp */
PetscErrorCode AttackSolve(Attack &, Verdict *, std::string &why);
PetscErrorCode AttackElsewhere(Attack &, Verdict *, std::string &why); /* another KSP, on half of the ranks */
PetscErrorCode AttackCall(const std::function<PetscErrorCode()> &, PetscErrorCode *, std::string &message);

#endif
