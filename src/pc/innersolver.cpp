/* Which inner solver there is where the program does not say, and its options */
#include "pcainsworth.h"
#include "../multigrid/blocksa.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

/*
   BoomerAMG for 3-D elasticity, measured: docs/method.md, inner solver. NULL leaves PETSc's own default

   Chebyshev's polynomial needs a real spectrum, which other methods than conjugate gradients do not promise, and one that is not too wide. One penalty for
   all rows, the paper's, makes entries far larger than their neighbours, which PMIS loses where they cross ranks
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
/* Conjugate gradients of hypre's, that tell Chebyshev the largest eigenvalue, divide by zero where they find all of a few; what follows never ends */
static const PetscInt small = 100;

static const size_t nboomeramg = sizeof(boomeramg) / sizeof(boomeramg[0]);

static const char *DefaultValue(const PC_Ainsworth *data, PetscBool definite, size_t i)
{
  PetscInt n, N;

  (void)MatGetSize(data->saddle.A, &n, &N);
  if (data->choices.pmat.penalty == AINSWORTH_PENALTY_NORM) return boomeramg[i].onePenalty;
  return definite && n > small ? boomeramg[i].usual : boomeramg[i].otherMethods;
}

/* The type that an object has, or gets from the options database */
static PetscErrorCode TypeInUse(PetscObject object, const char option[], char type[], size_t length)
{
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(object->options, object->prefix, option, type, length, &given));
  if (!given) PetscCall(PetscStrncpy(type, object->type_name, length));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Does the options database choose something else than BoomerAMG? */
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

/* Without block smoothed aggregation, or where it does not fit */
static PCType OtherMultigrid()
{
#if defined(PETSC_HAVE_HYPRE)
  return PCHYPRE;
#else
  return PCGAMG;
#endif
}

/*
   Block smoothed aggregation where nodes have displacements; scalar problems and frames are BoomerAMG's (docs/multigrid.md)

   With complex numbers there is no hypre, and PCGAMG restricts by P^T, not by the adjoint, so that its cycle is not Hermitian
*/
static PetscErrorCode DefaultType(PC_Ainsworth *data, PetscBool definite, PCType *type)
{
  const PetscInt bs = PetscMax(data->saddle.bs, data->saddle.scattered);
  MatSolverType  package;
  PetscBool      factor = data->escape.taken;

  PetscFunctionBegin;
  if (!factor) PetscCall(PCAinsworthEscapeAtOnce_Private(data, &factor));
  if (factor) {
    *type = PCAinsworthFactorType_Private(data, &package);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const bool fits = PetscDefined(USE_COMPLEX) || (bs > 1 && bs < 6);
  *type           = definite && data->symmetric && data->choices.pmat.penalty == AINSWORTH_PENALTY_ROW && fits ? PCBLOCKSA : OtherMultigrid();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The type of the preconditioner that nobody chose; `method`: of the reduced solve. At once, so that a PCHYPRE, which starts hypre, is made only where it is
   used */
static PetscErrorCode SetOwnType(PC_Ainsworth *data, KSPType method)
{
  PetscBool definite;
  PCType    type = NULL;
  PC        inner;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCAinsworthIsConjugateGradients_Private(method, &definite));
  PetscCall(DefaultType(data, (PetscBool)(definite || data->ownMethod), &type));
  PetscCall(PCSetType(inner, type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthChooseType_Private - makes that choice again */
PetscErrorCode PCAinsworthChooseType_Private(PC pc, PC_Ainsworth *data)
{
  PetscFunctionBegin;
  PetscCall(SetOwnType(data, ((PetscObject)data->ksp)->type_name));
  data->configured = PETSC_FALSE;
  PetscCall(PCAinsworthConfigureKSP_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthConfigureKSP_Private - reads the options of the inner solver, once, with our defaults where the user said nothing

   PCHYPRE takes its parameters from the options database only: the defaults stand there while it reads them, and no longer.
*/
PetscErrorCode PCAinsworthConfigureKSP_Private(PC pc, PC_Ainsworth *data)
{
  KSP          ksp = data->ksp;
  PC           inner;
  PC_BlockSA  *sa = NULL;
  PetscBool    boomer, definite, given;
  char         name[nboomeramg][256] = {}, method[256] = "", chosen[256];
  const char  *prefix;
  PetscOptions options;

  PetscFunctionBegin;
  if (data->configured) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetPC(ksp, &inner));
  PetscCall(PetscObjectGetOptions((PetscObject)inner, &options));
  PetscCall(PCGetOptionsPrefix(inner, &prefix));
  PetscCall(PCAinsworthChooseMethod_Private(pc, data));
  PetscCall(TypeInUse((PetscObject)ksp, "-ksp_type", method, sizeof(method)));
  PetscCall(PCAinsworthIsConjugateGradients_Private(method, &definite));
  definite = (PetscBool)(definite || data->ownMethod);
  PetscCall(PetscOptionsGetString(options, prefix, "-pc_type", chosen, sizeof(chosen), &given));
  given = (PetscBool)(given && pc->setfromoptionscalled);
  if (given) data->ownChoice = PETSC_FALSE;
  if (!((PetscObject)inner)->type_name) {
    data->ownChoice = (PetscBool)!given;
    if (given) PetscCall(PCSetType(inner, chosen));
    else PetscCall(SetOwnType(data, method));
  }
  PetscCall(PCAinsworthChoosePackage_Private(data, inner));
  PetscCall(ChoosesBoomerAMG(inner, &boomer));
  for (size_t i = 0; i < nboomeramg && boomer; i++) {
    const char *value = DefaultValue(data, definite, i);
    char        bare[128];

    PetscCall(PetscSNPrintf(bare, sizeof(bare), "-pc_hypre_boomeramg_%s", boomeramg[i].option));
    PetscCall(PetscOptionsHasName(options, prefix, bare, &given));
    if (given || !value) continue;
    PetscCall(PetscSNPrintf(name[i], sizeof(name[i]), "-%s%s", prefix ? prefix : "", bare + 1));
    PetscCall(PetscOptionsSetValue(options, name[i], value));
  }
  PetscCall(PCAinsworthForgetNorm_Private(data));
  if (pc->setfromoptionscalled) PetscCall(KSPSetFromOptions(ksp));
  else if (boomer) PetscCall(PCSetFromOptions(inner));
  for (const char *set : name)
    if (set[0]) PetscCall(PetscOptionsClearValue(options, set));
  PetscCall(PCAinsworthChooseNorm_Private(data));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  if (sa) sa->options.product = PETSC_TRUE; /* from the next set-up on A can be had for products */
  data->configured = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCHYPRE takes a MATHYPRE as it is, and makes a copy of any other matrix; PCBLOCKSA wants A and the rest apart */
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

/* Is the preconditioner of the reduced solve the multigrid that nobody chose? */
PetscErrorCode PCAinsworthIsOwnMultigrid_Private(const PC_Ainsworth *data, PetscBool *own)
{
  PC inner;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)inner, own, PCBLOCKSA, OtherMultigrid(), ""));
  *own = (PetscBool)(*own && data->ownChoice);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where block smoothed aggregation was our choice and does not fit this matrix, another multigrid takes its place, and the set-up goes on from there */
PetscErrorCode PCAinsworthFallBack_Private(PC pc, PC_Ainsworth *data, PetscBool *again)
{
  PC          inner;
  PC_BlockSA *sa = NULL;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(data->ksp, &inner));
  PetscCall(PCBlockSAGet_Private(inner, &sa));
  *again = (PetscBool)(sa && sa->levels.hierarchy && sa->levels.hierarchy->doubts[0] && data->ownChoice);
  if (!*again) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(pc, "%s: PC type %s takes the place of %s\n", sa->levels.hierarchy->doubts, OtherMultigrid(), PCBLOCKSA));
  PetscCall(PCSetType(inner, OtherMultigrid()));
  data->configured = PETSC_FALSE;
  PetscCall(PCAinsworthConfigureKSP_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}
