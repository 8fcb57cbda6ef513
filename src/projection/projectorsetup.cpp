/* The set-up of a projector: how S is solved with, where its rows are, and what that needs */
#include "projector.h"
#include "shared.h"
#include "../base/events.h"
#include "../base/layouts.h"
#include "../base/objects.h"

const char *const AinsworthGramTypes[] = {"auto", "factor", "polynomial", "AinsworthGramType", "AINSWORTH_GRAM_", NULL};

/* Creates the work vectors of the rows, and the scatter to them from vectors laid out as the program's rows of C */
static PetscErrorCode CreateVectors(AinsworthProjector *proj, Mat C)
{
  Vec program;

  PetscFunctionBegin;
  PetscCall(VecScatterDestroy(&proj->scatter));
  for (Vec *v : {&proj->rowValues, &proj->rowSolution}) PetscCall(VecDestroy(v));
  PetscCall(AinsworthCreateVecs(proj->C, NULL, &proj->rowValues));
  PetscCall(VecDuplicate(proj->rowValues, &proj->rowSolution));
  if (!proj->gram.placement.rows) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCreateVecs(C, NULL, &program));
  PetscCall(VecScatterCreate(program, proj->gram.placement.rows, proj->rowValues, NULL, &proj->scatter));
  PetscCall(VecDestroy(&program));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Places E and creates the work vectors of D */
static PetscErrorCode PlaceCompliance(AinsworthProjector *proj)
{
  const AinsworthCompliance *c = &proj->compliance;

  PetscFunctionBegin;
  PetscCall(MatDestroy(&proj->E));
  if (!c->N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthProjectorPlaceMat(proj, c->E, &proj->E));
  for (Vec *v : {&proj->rest, &proj->shared, &proj->inverse, &proj->held})
    if (!*v) PetscCall(VecDuplicate(proj->rowValues, v));
  if (!proj->load) PetscCall(AinsworthCreateVecs(proj->C, &proj->load, NULL));
  PetscCall(AinsworthProjectorPlace(proj, c->rest, proj->rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gets the object ids and nonzero states of the blocks, from which the nonzero pattern of S follows */
static PetscErrorCode GetPatterns(const AinsworthProjectorBlocks *blocks, AinsworthProjectorPatterns *patterns)
{
  const Mat mats[] = {blocks->C, blocks->B, blocks->D};

  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) {
    patterns->id[k]      = 0;
    patterns->pattern[k] = 0;
    if (!mats[k]) continue;
    PetscCall(PetscObjectGetId((PetscObject)mats[k], &patterns->id[k]));
    PetscCall(MatGetNonzeroState(mats[k], &patterns->pattern[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Forms proj->gram from S = C W C' (NULL: not made yet) and, if B is not C, proj->gramB. Both share one placement,
   so the components are those of both patterns together
*/
static PetscErrorCode FormGrams(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Mat S, PetscBool same,
                                const AinsworthProjectorPatterns *patterns)
{
  const Mat           C = blocks->C, B = blocks->B;
  AinsworthGramInputs in;

  PetscFunctionBegin;
  in.N           = proj->compliance.N;
  in.hermitian   = patterns->hermitian;
  in.samePattern = same;
  in.rowsPerRank = patterns->rowsPerRank;
  in.S           = S;
  if (B != C) {
    PetscCall(AinsworthGramMultiply(B, proj->BW, MAT_INITIAL_MATRIX, &in.other));
    PetscCall(MatProductClear(in.other));
    PetscCall(MatZeroEntries(in.other));
  }
  PetscCall(AinsworthGramForm(&proj->gram, C, proj->CW, &in));
  PetscCall(MatDestroy(&in.other));
  if (B == C) PetscFunctionReturn(PETSC_SUCCESS);
  in.S         = NULL;
  in.placement = &proj->gram.placement;
  /* gram.S has all diagonal entries, whereas B W B' lacks those of zero rows of B */
  PetscCall(MatDuplicate(proj->gram.S, MAT_DO_NOT_COPY_VALUES, &in.other));
  PetscCall(AinsworthGramForm(&proj->gramB, B, proj->BW, &in));
  PetscCall(MatDestroy(&in.other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Chooses the number of steps, and whether they are used: there are not too many, and they are quicker than a
   factorization or asked for. Collective

   blocks: entries of the blocks of S_p on the busiest rank
*/
static PetscErrorCode ChooseSteps(const AinsworthProjector *proj, const AinsworthPolynomial &p, PetscReal blocks,
                                  const AinsworthGramChoices &choices, int *steps, bool *used)
{
  AinsworthGramFacts facts;
  MatInfo            info;
  PetscInt           m;

  PetscFunctionBegin;
  *steps = AinsworthPolynomialDegree(p.bound, AinsworthPolynomialMostExcess);
  PetscCall(MatGetInfo(p.S, MAT_GLOBAL_SUM, &info));
  PetscCall(MatGetSize(p.S, &m, NULL));
  facts.rows           = (double)m;
  facts.entries        = info.nz_used;
  facts.blocks         = (double)blocks;
  facts.ranks          = (double)proj->gram.placement.ranks;
  facts.solvers        = (double)((m - 1) / choices.rowsPerRank + 1);
  facts.machine        = choices.machine;
  const double seconds = AinsworthPolynomialSeconds(facts, *steps), factored = AinsworthFactoredSeconds(facts);

  PetscCall(PetscInfo(p.S, "Without a factorization of S: eigenvalues up to %g, %d steps, predicted %g s for %g s\n",
                      (double)p.bound, *steps, seconds, factored));
  *used = *steps <= AinsworthPolynomialMostSteps && (choices.type != AINSWORTH_GRAM_AUTO || seconds <= factored);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Tries a right inverse without a factorization: a Gram matrix of private unknowns only, and a polynomial in the whole
   one. Collective

   S: C W C'. The result is empty where there is none, or where a factorization is quicker
*/
static PetscErrorCode SetUpPolynomial(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Mat S,
                                      Vec weight, Vec inverseDiagonal, bool same, const AinsworthGramChoices &choices)
{
  const Mat           C    = blocks->C;
  auto                made = std::make_unique<AinsworthPolynomial>();
  AinsworthGramInputs in;
  int                 steps;
  bool                used;
  PetscReal           entries;

  PetscFunctionBegin;
  proj->polynomial.reset();
  PetscCall(AinsworthPrivateWeight(C, weight, inverseDiagonal, made->weight.out()));
  PetscCall(AinsworthWeigh(C, made->weight, made->CW.out()));
  in.hermitian   = PETSC_TRUE;
  in.samePattern = (PetscBool)same;
  in.rowsPerRank = choices.rowsPerRank;
  in.small       = AinsworthLargestBlock;
  PetscCall(AinsworthGramForm(&proj->gram, C, made->CW, &in));
  if (!AinsworthGramIsSmall(&proj->gram)) PetscFunctionReturn(PETSC_SUCCESS);
  made->S = AinsworthRetain(S);
  PetscCall(AinsworthProjectorPlaceMat(proj, made->S, made->placed.out()));
  PetscCall(AinsworthPolynomialBound(made->placed, &proj->gram, &made->bound, &entries));
  PetscCall(ChooseSteps(proj, *made, entries, choices, &steps, &used));
  if (!used) PetscFunctionReturn(PETSC_SUCCESS);
  made->steps  = AinsworthPolynomialCreateSteps(made->bound, steps);
  made->excess = AinsworthPolynomialExcess(made->bound, steps);
  for (AinsworthRef<Vec> *v : {&made->rest, &made->direction, &made->solution, &made->last})
    PetscCall(AinsworthCreateVecs(made->placed, NULL, v->out()));
  proj->polynomial = std::move(made);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Forms what R is made of: S, or that of private unknowns and a polynomial, where S has large components and that is
   quicker. Collective

   same: patterns are those of the last set-up; on return also the way is, and rows are where they were
*/
static PetscErrorCode FormInverse(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Vec weight,
                                  Vec inverseDiagonal, const AinsworthProjectorPatterns &patterns,
                                  const AinsworthGramChoices &choices, PetscBool *same)
{
  const bool had    = proj->polynomial != nullptr;
  bool       wanted = !patterns.factored && (!*same || had), formed = false;
  PetscBool  large;
  Mat        S = NULL;

  PetscFunctionBegin;
  if (wanted) PetscCall(AinsworthGramMultiply(blocks->C, proj->CW, MAT_INITIAL_MATRIX, &S));
  if (wanted && !had && choices.type == AINSWORTH_GRAM_AUTO) {
    PetscCall(AinsworthPlacementFindLarge(S, AinsworthSmallComponent, &large));
    if (!large) {
      PetscCall(FormGrams(proj, blocks, S, PETSC_FALSE, &patterns));
      formed = AinsworthGramIsSmall(&proj->gram);
      wanted = !formed;
    }
  }
  if (wanted) {
    if (!had) PetscCall(AinsworthGramReset(&proj->gram));
    PetscCall(SetUpPolynomial(proj, blocks, S, weight, inverseDiagonal, had, choices));
    formed = proj->polynomial != nullptr;
    if (!formed) PetscCall(AinsworthGramReset(&proj->gram));
  }
  *same = (PetscBool)(*same && had == (proj->polynomial != nullptr));
  if (!formed) PetscCall(FormGrams(proj, blocks, S, *same, &patterns));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moves the rows of M, and weighs them again where they are, which costs less than to move both. Collective */
static PetscErrorCode Move(const AinsworthProjector *proj, Vec weight, Mat *M, Mat *weighted)
{
  PetscFunctionBegin;
  PetscCall(AinsworthProjectorMoveRows(proj, M));
  PetscCall(MatDestroy(weighted));
  PetscCall(AinsworthWeigh(*M, weight, weighted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether options name the preconditioner of the Gram matrix, which is then meant for the whole of it */
static PetscErrorCode ChosenByHand(PetscObject parent, PetscBool *given)
{
  PetscOptions options;
  const char  *prefix;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetOptions(parent, &options));
  PetscCall(PetscObjectGetOptionsPrefix(parent, &prefix));
  PetscCall(PetscOptionsHasName(options, prefix, "-ainsworth_gram_pc_type", given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthProjectorSetUp - creates the projector from the blocks, keeping symbolic results if their patterns have not
   changed

   weight: diagonal of W, length n, positive; NULL for W = I. inverseDiagonal: diag(A)^{-1}. Collective
*/
PetscErrorCode AinsworthProjectorSetUp(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Vec weight,
                                       Vec inverseDiagonal, const AinsworthGramChoices &choices, PetscObject parent)
{
  const AinsworthProjectorPatterns last = proj->patterns;
  const Mat                        C    = blocks->C;
  AinsworthProjectorPatterns       now;
  PetscBool                        byHand;
  PetscBool                        same; /* nothing has changed that the symbolic results depend on */

  PetscFunctionBegin;
  PetscCall(GetPatterns(blocks, &now));
  now.rowsPerRank = choices.rowsPerRank;
  now.weighted    = weight != NULL;
  now.hermitian   = PETSC_TRUE;
  if (blocks->D) PetscCall(AinsworthProbeSymmetry(blocks->D, &now.hermitian));
  PetscCall(ChosenByHand(parent, &byHand));
  now.factored = choices.type == AINSWORTH_GRAM_FACTOR || (choices.type == AINSWORTH_GRAM_AUTO && byHand) || !weight ||
                 blocks->B != C || blocks->D;
  PetscCall(PetscArraycmp(now.id, last.id, 3, &same));
  if (same) PetscCall(PetscArraycmp(now.pattern, last.pattern, 3, &same));
  same = (PetscBool)(same && proj->C && last.weighted == now.weighted && last.hermitian == now.hermitian &&
                     last.rowsPerRank == now.rowsPerRank && last.factored == now.factored);
  if (same)
    PetscCall(PetscInfo(C, "The nonzero pattern of C is that of the last set-up: the places and the symbolic "
                           "factorization of the Gram matrix are kept\n"));
  else PetscCall(AinsworthProjectorReset(proj));
  for (Mat *M : {&proj->C, &proj->B, &proj->CW, &proj->BW}) PetscCall(MatDestroy(M));
  PetscCall(AinsworthShare(C, &proj->C));
  PetscCall(AinsworthWeigh(C, weight, &proj->CW));
  if (blocks->B != C) {
    PetscCall(AinsworthShare(blocks->B, &proj->B));
    PetscCall(AinsworthWeigh(proj->B, weight, &proj->BW));
  }
  PetscCall(AinsworthComplianceSetUp(&proj->compliance, C, blocks->B, blocks->D, weight, inverseDiagonal));
  PetscCall(PetscLogEventBegin(AINSWORTH_GramMat, C, 0, 0, 0));
  PetscCall(FormInverse(proj, blocks, weight, inverseDiagonal, now, choices, &same));
  PetscCall(PetscLogEventEnd(AINSWORTH_GramMat, C, 0, 0, 0));
  PetscCall(AinsworthGramFactor(&proj->gram, parent));
  if (blocks->B != C) PetscCall(AinsworthGramFactor(&proj->gramB, parent));
  if (proj->gram.placement.rows) {
    PetscCall(Move(proj, weight, &proj->C, &proj->CW));
    if (proj->B) PetscCall(Move(proj, weight, &proj->B, &proj->BW));
    if (proj->polynomial) PetscCall(AinsworthWeigh(proj->C, proj->polynomial->weight, proj->polynomial->CW.out()));
  }
  if (!proj->B) {
    PetscCall(AinsworthShare(proj->C, &proj->B));
    PetscCall(AinsworthShare(proj->CW, &proj->BW));
  }
  if (!same) PetscCall(CreateVectors(proj, C));
  PetscCall(PlaceCompliance(proj));
  proj->patterns = now;
  PetscFunctionReturn(PETSC_SUCCESS);
}
