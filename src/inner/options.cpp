/* The default inner solver and its options */
#include "solver.h"
#include "../base/defaults.h"
#include "../base/layouts.h"
#include "../multigrid/blocksa.h"

/*
   Options of BoomerAMG for 3-D elasticity, measured (docs/method.md, inner solver); NULL leaves PETSc's own default

   Chebyshev smoothing needs a real spectrum, which only conjugate gradients promise, that is not too wide. One penalty
   for all rows, as in the paper, makes entries far larger than their neighbors, which PMIS loses where they cross ranks
*/
static const struct {
  const char *option, *usual, *otherMethods, *onePenalty;
} boomeramg[] = {
  {"coarsen_type",     "PMIS",      "PMIS",  "Falgout"},
  {"interp_type",      "ext+i",     "ext+i", "ext+i"  },
  {"P_max",            "4",         "4",     "4"      },
  {"strong_threshold", "0.5",       "0.5",   "0.5"    },
  {"relax_type_all",   "Chebyshev", NULL,    NULL     },
  {"agg_nl",           "1",         NULL,    NULL     }
};
/*
   With so few unknowns, the conjugate gradients in hypre that give Chebyshev its largest eigenvalue may find all,
   divide by zero, and never return
*/
static const PetscInt small = 100;

static const size_t nboomeramg = sizeof(boomeramg) / sizeof(boomeramg[0]);

static const char *DefaultValue(const AinsworthSolver *solver, PetscBool definite, size_t i)
{
  PetscInt n;

  (void)MatGetSize(solver->saddle->A, &n, NULL);
  if (solver->choices.pmat.penalty == AINSWORTH_PENALTY_NORM) return boomeramg[i].onePenalty;
  return definite && n > small ? boomeramg[i].usual : boomeramg[i].otherMethods;
}

/* Gets the type that an object has, or will get from the options database */
static PetscErrorCode TypeInUse(PetscObject object, const char option[], char type[], size_t length)
{
  const char  *prefix;
  PetscOptions options;
  PetscBool    given;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetOptions(object, &options));
  PetscCall(PetscObjectGetOptionsPrefix(object, &prefix));
  PetscCall(PetscOptionsGetString(options, prefix, option, type, length, &given));
  if (!given) PetscCall(PetscStrncpy(type, AinsworthTypeName(object), length));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the PC is BoomerAMG, or will be by the options database */
static PetscErrorCode ChoosesBoomerAMG(PC pc, PetscBool *boomer)
{
  char         type[256] = "";
  const char  *prefix;
  PetscOptions options;
  PetscBool    given;

  PetscFunctionBegin;
  PetscCall(TypeInUse((PetscObject)pc, "-pc_type", type, sizeof(type)));
  PetscCall(PetscStrcmp(type, PCHYPRE, boomer));
  if (!*boomer) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectGetOptions((PetscObject)pc, &options));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscOptionsGetString(options, prefix, "-pc_hypre_type", type, sizeof(type), &given));
  if (given) PetscCall(PetscStrcmp(type, "boomeramg", boomer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Configures the parts that we choose, before the options are read: they would find no type to begin with, and hypre is
   started only if it is used
*/
static PetscErrorCode TakeParts(AinsworthInner *in, PC inner, PCType ours)
{
  PetscBool     same   = PETSC_TRUE;
  const KSPType method = AinsworthSolverMethodType(in->plan.method);

  PetscFunctionBegin;
  if (method) PetscCall(AinsworthSolverSetMethod(in, method));
  if (ours) PetscCall(PetscObjectTypeCompare((PetscObject)inner, ours, &same));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCSetType(inner, ours));
  in->configured = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the options, for BoomerAMG with our defaults, which it takes from the options database only */
static PetscErrorCode ReadOptions(PC pc, AinsworthSolver *solver, PC inner)
{
  AinsworthInner *in = &solver->inner;
  PetscBool       boomer, definite, strict;
  char            method[256] = "";
  PetscErrorCode  error       = PETSC_SUCCESS;

  PetscFunctionBegin;
  PetscCall(TypeInUse((PetscObject)in->ksp, "-ksp_type", method, sizeof(method)));
  PetscCall(AinsworthSolverIsConjugateGradients(method, &definite));
  definite = (PetscBool)(definite || (in->plan.method == AINSWORTH_METHOD_GMRES && solver->saddle->symmetric));
  PetscCall(AinsworthSolverChoosePackage(solver, inner));
  PetscCall(ChoosesBoomerAMG(inner, &boomer));
  AinsworthDefaults defaults{(PetscObject)inner, {}};
  for (size_t i = 0; i < nboomeramg && boomer; i++) {
    const char *value = DefaultValue(solver, definite, i);

    if (value) PetscCall(defaults.set((std::string("pc_hypre_boomeramg_") + boomeramg[i].option).c_str(), value));
  }
  if (AinsworthSolverReadsOptions(pc)) error = KSPSetFromOptions(in->ksp);
  else if (boomer) error = PCSetFromOptions(inner);
  PetscCall(defaults.clear());
  PetscCall(error);
  /* a solve that fails may be followed by another one: the error is raised when none is left */
  PetscCall(KSPGetErrorIfNotConverged(in->ksp, &strict));
  if (strict) PetscCall(PCSetErrorIfFailure(pc, PETSC_TRUE));
  if (strict) PetscCall(KSPSetErrorIfNotConverged(in->ksp, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSolverConfigureKSP - makes the inner solver what the plan says, and reads its options, with our defaults, if
   any of its parts is new
*/
PetscErrorCode AinsworthSolverConfigureKSP(PC pc, AinsworthSolver *solver)
{
  AinsworthInner *in   = &solver->inner;
  AinsworthNorm   norm = in->plan.norm;
  PC_BlockSA     *sa   = NULL;
  PCType          ours;
  PC              inner;
  char            why[sizeof(solver->escape.why)], type[256];
  PetscBool       given;
  PetscOptions    options;
  PetscInt        n;

  PetscFunctionBegin;
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(AinsworthSolverPlan(pc, solver, &in->plan));
  in->plan.norm = norm;
  if (in->plan.preconditioner == AINSWORTH_INNER_FACTOR && solver->history.factor == AINSWORTH_UNTRIED) {
    PetscCall(MatGetSize(solver->saddle->A, &n, NULL));
    PetscCall(PetscSNPrintf(why, sizeof(why), "at once, as %s for %" PetscInt_FMT " unknowns", in->plan.why[1], n));
    PetscCall(AinsworthSolverRememberFactor(solver, AINSWORTH_TAKEN, why));
  }
  ours = AinsworthSolverInnerType(solver, in->plan.preconditioner);
  /* its package is chosen before its other options are read */
  if (!ours && !in->configured && AinsworthSolverReadsOptions(pc)) {
    PetscCall(PetscObjectGetOptions((PetscObject)inner, &options));
    PetscCall(PetscOptionsGetString(options, AinsworthSolverPrefix(solver), "-pc_type", type, sizeof(type), &given));
    if (given) ours = type;
  }
  PetscCall(TakeParts(in, inner, ours));
  if (in->configured) PetscFunctionReturn(PETSC_SUCCESS);
  if (in->plan.method == AINSWORTH_METHOD_GMRES)
    PetscCall(PetscInfo(pc, "The reduced system is solved by GMRES: %s\n", in->plan.why[0]));
  PetscCall(AinsworthSolverForgetNorm(in));
  PetscCall(ReadOptions(pc, solver, inner));
  PetscCall(TakeParts(in, inner, NULL)); /* without constraints an option for KSPPROJECTEDCG means KSPCG */
  PetscCall(AinsworthSolverChooseNorm(in));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  /* from the next set-up on it keeps what PCBlockSAGetProduct_Private() needs */
  if (sa) PetscCall(AinsworthVecsOnHost(solver->saddle->A, &sa->options.product));
  in->configured = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Gets the format of M_*: PCHYPRE uses a MATHYPRE as it is but copies any other matrix, and PCBLOCKSA wants A and the
   rest separately
*/
PetscErrorCode AinsworthSolverGetPmatFormat(AinsworthSolver *solver, AinsworthPmatFormat *format)
{
  PC        inner;
  PetscBool hypre, blocksa, factors;

  PetscFunctionBegin;
  PetscCall(AinsworthSolverGetInnerPC(solver, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &factors, PCCHOLESKY, PCLU, ""));
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCHYPRE, &hypre));
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCBLOCKSA, &blocksa));
  *format = hypre     ? AINSWORTH_PMAT_HYPRE
            : blocksa ? AINSWORTH_PMAT_SUM
            : factors ? AINSWORTH_PMAT_FACTOR
                      : AINSWORTH_PMAT_AIJ;
  PetscFunctionReturn(PETSC_SUCCESS);
}
