/* The default inner solver and its options */
#include "pcainsworth.h"
#include "../defaults.h"
#include "../multigrid/blocksa.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

/*
   Options of BoomerAMG for 3-D elasticity, measured (docs/method.md, inner solver); NULL leaves PETSc's own default

   Chebyshev smoothing needs a real spectrum, which only conjugate gradients promise, that is not too wide. One penalty for all rows, as in the paper, makes
   entries far larger than their neighbors, which PMIS loses where they cross ranks
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
/* With so few unknowns, the conjugate gradients in hypre that give Chebyshev its largest eigenvalue may find all, divide by zero, and never return */
static const PetscInt small = 100;

static const size_t nboomeramg = sizeof(boomeramg) / sizeof(boomeramg[0]);

static const char *DefaultValue(const PC_Ainsworth *data, PetscBool definite, size_t i)
{
  PetscInt n;

  (void)MatGetSize(data->saddle.A, &n, NULL);
  if (data->choices.pmat.penalty == AINSWORTH_PENALTY_NORM) return boomeramg[i].onePenalty;
  return definite && n > small ? boomeramg[i].usual : boomeramg[i].otherMethods;
}

/* Gets the type that an object has, or will get from the options database */
static PetscErrorCode TypeInUse(PetscObject object, const char option[], char type[], size_t length)
{
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(object->options, object->prefix, option, type, length, &given));
  if (!given) PetscCall(PetscStrncpy(type, object->type_name, length));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the PC is BoomerAMG, or will be by the options database */
static PetscErrorCode ChoosesBoomerAMG(PC pc, PetscBool *boomer)
{
  char      type[256] = "";
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(TypeInUse((PetscObject)pc, "-pc_type", type, sizeof(type)));
  PetscCall(PetscStrcmp(type, PCHYPRE, boomer));
  if (!*boomer) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscOptionsGetString(((PetscObject)pc)->options, ((PetscObject)pc)->prefix, "-pc_hypre_type", type, sizeof(type), &given));
  if (given) PetscCall(PetscStrcmp(type, "boomeramg", boomer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the multigrid without, or instead of, block smoothed aggregation */
static PCType OtherMultigrid()
{
#if defined(PETSC_HAVE_HYPRE)
  return PCHYPRE;
#else
  return PCGAMG;
#endif
}

/*
   Chooses the default type: block smoothed aggregation for displacements, BoomerAMG for scalar problems and frames (docs/multigrid.md)

   In complex arithmetic there is no hypre, and PCGAMG restricts by P^T, not by the adjoint, so that its cycle is not Hermitian
*/
static PetscErrorCode DefaultType(PC pc, PC_Ainsworth *data, PetscBool definite, PCType *type)
{
  const PetscInt bs = PetscMax(data->saddle.bs, data->saddle.scattered);
  MatSolverType  package;
  PetscBool      factor = data->escape.taken;

  PetscFunctionBegin;
  if (!factor) PetscCall(PCAinsworthEscapeAtOnce_Private(pc, data, &factor));
  if (factor) {
    *type = PCAinsworthFactorType_Private(data, &package);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const bool fits = PetscDefined(USE_COMPLEX) || (bs > 1 && bs < 6);
  *type           = definite && data->symmetric && data->choices.pmat.penalty == AINSWORTH_PENALTY_ROW && fits ? PCBLOCKSA : OtherMultigrid();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the method accepts the default multigrid for a symmetric system: conjugate gradients, and one application, which may be that of an outer method */
static PetscErrorCode SuitsMultigrid(KSPType method, PetscBool *suits)
{
  PetscBool once;

  PetscFunctionBegin;
  PetscCall(PCAinsworthIsConjugateGradients_Private(method, suits));
  PetscCall(PetscStrcmp(method, KSPPREONLY, &once));
  if (once) *suits = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the default type of the preconditioner for a method of the reduced solve, and no other before, so that hypre is started only if it is used */
static PetscErrorCode SetOwnType(PC pc, PC_Ainsworth *data, KSPType method)
{
  PetscBool definite;
  PCType    type = NULL;
  PC        inner;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(SuitsMultigrid(method, &definite));
  PetscCall(DefaultType(pc, data, (PetscBool)(definite || data->ownMethod), &type));
  PetscCall(PCSetType(inner, type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthChooseType_Private - chooses the default type of the preconditioner again */
PetscErrorCode PCAinsworthChooseType_Private(PC pc, PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(SetOwnType(pc, data, ((PetscObject)data->ksp)->type_name));
  data->configured = PETSC_FALSE;
  PetscCall(PCAinsworthConfigureKSP_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthConfigureKSP_Private - reads the options of the inner solver, once, with our defaults for those that are not set

   PCHYPRE takes its parameters from the options database only, so the defaults are put there while it reads them.
*/
PetscErrorCode PCAinsworthConfigureKSP_Private(PC pc, PC_Ainsworth *data)
{
  KSP            ksp = data->ksp;
  PC             inner;
  PC_BlockSA    *sa = NULL;
  PetscBool      boomer, definite, given;
  char           method[256] = "", chosen[256];
  const char    *prefix;
  PetscOptions   options;
  PetscErrorCode error = PETSC_SUCCESS;

  PetscFunctionBegin;
  if (data->configured) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(ksp, &inner));
  PetscCall(PetscObjectGetOptions((PetscObject)inner, &options));
  PetscCall(PCGetOptionsPrefix(inner, &prefix));
  PetscCall(PCAinsworthChooseMethod_Private(pc, data));
  PetscCall(TypeInUse((PetscObject)ksp, "-ksp_type", method, sizeof(method)));
  PetscCall(PCAinsworthIsConjugateGradients_Private(method, &definite));
  definite = (PetscBool)(definite || (data->ownMethod && data->symmetric));
  PetscCall(PetscOptionsGetString(options, prefix, "-pc_type", chosen, sizeof(chosen), &given));
  given = (PetscBool)(given && pc->setfromoptionscalled);
  if (given) data->ownChoice = PETSC_FALSE;
  if (!((PetscObject)inner)->type_name) {
    data->ownChoice = (PetscBool)!given;
    if (given) PetscCall(PCSetType(inner, chosen));
    else PetscCall(SetOwnType(pc, data, method));
  }
  PetscCall(PCAinsworthChoosePackage_Private(data, inner));
  PetscCall(ChoosesBoomerAMG(inner, &boomer));
  AinsworthDefaults defaults{(PetscObject)inner, {}};
  for (size_t i = 0; i < nboomeramg && boomer; i++) {
    const char *value = DefaultValue(data, definite, i);

    if (value) PetscCall(defaults.set((std::string("pc_hypre_boomeramg_") + boomeramg[i].option).c_str(), value));
  }
  PetscCall(PCAinsworthForgetNorm_Private(data));
  if (pc->setfromoptionscalled) error = KSPSetFromOptions(ksp);
  else if (boomer) error = PCSetFromOptions(inner);
  PetscCall(defaults.clear());
  PetscCall(error);
  PetscCall(PCAinsworthChooseNorm_Private(data));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  if (sa) sa->options.product = PETSC_TRUE; /* from the next set-up on it keeps what PCBlockSAGetProduct_Private() needs */
  data->configured = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the format of M_*: PCHYPRE uses a MATHYPRE as it is but copies any other matrix, and PCBLOCKSA wants A and the rest separately */
PetscErrorCode PCAinsworthGetPmatFormat_Private(PC_Ainsworth *data, AinsworthPmatFormat *format)
{
  PC        inner;
  PetscBool hypre, blocksa, factors;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, &factors, PCCHOLESKY, PCLU, ""));
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCHYPRE, &hypre));
  PetscCall(PetscObjectTypeCompare((PetscObject)inner, PCBLOCKSA, &blocksa));
  *format = hypre ? AINSWORTH_PMAT_HYPRE : blocksa ? AINSWORTH_PMAT_SUM : factors ? AINSWORTH_PMAT_FACTOR : AINSWORTH_PMAT_AIJ;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the inner preconditioner is the default multigrid */
PetscErrorCode PCAinsworthIsOwnMultigrid_Private(const PC_Ainsworth *data, PetscBool *own)
{
  PC inner;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, own, PCBLOCKSA, OtherMultigrid(), ""));
  *own = (PetscBool)(*own && data->ownChoice);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Replaces block smoothed aggregation, if it was our choice and does not fit the matrix, by another multigrid; *again: set-up has to continue with that

   In Ker C larger levels are better than another multigrid, which would need M_*: a periodic cell with a complexity of 2.9 takes 21 iterations, by BoomerAMG 149
*/
PetscErrorCode PCAinsworthFallBack_Private(PC pc, PC_Ainsworth *data, PetscBool *again)
{
  static const PetscReal bearable = 4.0;
  PC                     inner;
  PC_BlockSA            *sa = NULL;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  *again = (PetscBool)(sa && sa->levels.hierarchy && sa->levels.hierarchy->doubts[0] && data->ownChoice &&
                       !(sa->subspace && sa->levels.hierarchy->levels() > 1 && sa->levels.hierarchy->complexity() <= bearable));
  if (!*again) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(pc, "%s: PC type %s takes the place of %s\n", sa->levels.hierarchy->doubts, OtherMultigrid(), PCBLOCKSA));
  PetscCall(PCSetType(inner, OtherMultigrid()));
  data->configured = PETSC_FALSE;
  PetscCall(PCAinsworthConfigureKSP_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}
