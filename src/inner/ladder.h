/*
   The ladder of solvers: which one is tried next, from how the last one ended (docs/method.md). Plain C++, without MPI
   and PETSc
*/
#ifndef AINSWORTH_LADDER_H
#define AINSWORTH_LADDER_H

/* From the cheapest to the one that needs nothing but a regular system */
typedef enum {
  AINSWORTH_RUNG_MULTIGRID, /* multigrid on M_*, in Ker C */
  AINSWORTH_RUNG_FACTOR,    /* M_* factored, in Ker C */
  AINSWORTH_RUNG_GMRES,     /* GMRES in Ker C, with the preconditioner that there is */
  AINSWORTH_RUNG_WHOLE,     /* the whole system factored */
  AINSWORTH_RUNG_NONE       /* before the first solve: nothing yet; as a result: no other */
} AinsworthRung;

/*
   Values of -pc_ainsworth_ladder, the highest rung that may be taken, with the two strings that PETSc's enumerations
   end with
*/
extern const char *const AinsworthLadderTypes[];

/* How a rung ended */
typedef enum {
  AINSWORTH_END_ANSWER, /* its answer meets the program's rows */
  AINSWORTH_END_SETUP,  /* it could not be set up: a factorization failed */
  /* solves with the Gram matrix fail, or have too few digits: all rungs in Ker C need them */
  AINSWORTH_END_GRAM,
  AINSWORTH_END_UNFIT, /* the levels of its multigrid do not fit A: another multigrid */
  /* it was made for an earlier matrix, and takes more iterations than it saves: it is rebuilt */
  AINSWORTH_END_OLD,
  AINSWORTH_END_LIMIT, /* its iterations ran out */
  /* the rest of its iterations would take longer than a factorization; if no rung follows, it goes on */
  AINSWORTH_END_DEAR,
  AINSWORTH_END_BREAKDOWN,     /* its iterations broke down, or gave no numbers */
  AINSWORTH_END_INDEFINITE,    /* conjugate gradients met a direction of negative or no energy */
  AINSWORTH_END_INACCURATE,    /* its answer does not meet the program's rows, refined or not */
  AINSWORTH_END_SINGULAR,      /* certified: the system has more than one solution */
  AINSWORTH_END_CONTRADICTORY, /* certified: the system has none */
  AINSWORTH_ENDS
} AinsworthEnd;

/* What the choice depends on; the defaults are those of a usual system */
struct AinsworthLadderFacts {
  AinsworthRung now = AINSWORTH_RUNG_NONE; /* the last rung */
  AinsworthEnd  end = AINSWORTH_END_ANSWER;
  AinsworthRung cap = AINSWORTH_RUNG_WHOLE; /* the highest rung that the program allows */
  /* method and preconditioner are our choice; else the program's, and only the whole system may follow */
  bool own   = true;
  bool small = false; /* multigrid is not worth its set-up */
  /* the method stays what it is: the program's choice, or GMRES as the system is not symmetric */
  bool gmres = false;
  /* M_* can be factored: it was not tried in vain, and a package exists */
  bool   factors = true;
  bool   regular = true; /* no null space is known, which would give a zero pivot */
  bool   entries = true; /* the entries of A, B, C, D are known */
  double bytes   = 0.0;  /* of the factor of the whole system, as predicted */
  /* of the smallest machine, in bytes, as if all ranks were on that one; 0: unknown */
  double memory = 0.0;
};

struct AinsworthLadderStep {
  AinsworthRung next = {};
  const char   *why  = nullptr; /* why the last rung is left; if `next` is AINSWORTH_RUNG_NONE, why none follows */
};

AinsworthLadderStep AinsworthLadderNext(const AinsworthLadderFacts &);
const char         *AinsworthRungName(AinsworthRung);
bool                AinsworthLadderFits(double bytes, double memory);

#endif
