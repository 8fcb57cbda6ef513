/* The set-up of a projector: how S is solved with, where its rows are, and what that needs */
#include "projector.h"
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

/* Moves the rows of C and B to the ranks that solve for them. own: W_p, or NULL. Collective */
static PetscErrorCode MoveRows(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Vec weight, Vec own)
{
  auto surface = std::make_shared<AinsworthSurface>();

  PetscFunctionBegin;
  for (Mat *M : {&proj->C, &proj->B}) PetscCall(MatDestroy(M));
  PetscCall(AinsworthProjectorMoveRows(proj, blocks->C, &proj->C));
  PetscCall(surface->create(proj->C, weight, own));
  proj->surface = proj->surfaceB = surface;
  if (blocks->B == blocks->C) PetscCall(AinsworthShare(proj->C, &proj->B));
  else {
    auto other = std::make_shared<AinsworthSurface>();

    PetscCall(AinsworthProjectorMoveRows(proj, blocks->B, &proj->B));
    PetscCall(other->create(proj->B, weight, NULL));
    proj->surfaceB = other;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Forms proj->gram from S = C W C' + N and, if B is not C, proj->gramB; both share one placement, that of both patterns
   together. Collective
*/
static PetscErrorCode FormGrams(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Vec weight,
                                PetscBool same, const AinsworthProjectorPatterns &patterns)
{
  AinsworthPlacement *placement = &proj->gram.placement;
  AinsworthGramInputs in;
  Mat                 N;

  PetscFunctionBegin;
  if (!same) {
    std::vector<AinsworthLinks> links = {
      {blocks->C, weight}
    };

    if (blocks->B != blocks->C) links.push_back({blocks->B, weight});
    if (proj->compliance.N) links.push_back({proj->compliance.N, NULL, true});
    for (AinsworthGram *gram : {&proj->gram, &proj->gramB}) PetscCall(AinsworthGramReset(gram));
    PetscCall(AinsworthPlacementCreate(links, patterns.rowsPerRank, AinsworthSmallComponent, placement));
    if (blocks->B != blocks->C) {
      proj->gramB.placement = *placement;
      PetscCall(PetscObjectReference((PetscObject)placement->rows));
    }
  }
  PetscCall(MoveRows(proj, blocks, weight, NULL));
  PetscCall(AinsworthProjectorPlaceMat(proj, proj->compliance.N, &N));
  in.C         = proj->C;
  in.weight    = weight;
  in.N         = N;
  in.hermitian = patterns.hermitian;
  PetscCall(AinsworthGramForm(&proj->gram, *proj->surface, in));
  in.C = proj->B;
  if (blocks->B != blocks->C) PetscCall(AinsworthGramForm(&proj->gramB, *proj->surfaceB, in));
  PetscCall(MatDestroy(&N));
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
   one; there is none where a factorization is quicker. Collective
*/
static PetscErrorCode SetUpPolynomial(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Vec weight,
                                      Vec inverseDiagonal, bool same, const AinsworthGramChoices &choices)
{
  auto                made = std::make_unique<AinsworthPolynomial>();
  AinsworthGramInputs in;
  int                 steps;
  bool                used;
  PetscReal           entries;

  PetscFunctionBegin;
  proj->polynomial.reset();
  PetscCall(AinsworthPrivateWeight(blocks->C, weight, inverseDiagonal, made->weight.out()));
  if (!same) {
    PetscCall(AinsworthGramReset(&proj->gram));
    PetscCall(AinsworthPlacementCreate(
      {
        {blocks->C, made->weight}
    },
      choices.rowsPerRank, AinsworthLargestBlock, &proj->gram.placement));
  }
  if (!AinsworthGramIsSmall(&proj->gram)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MoveRows(proj, blocks, weight, made->weight));
  in.C         = proj->C;
  in.hermitian = PETSC_TRUE;
  in.own       = true;
  PetscCall(AinsworthGramForm(&proj->gram, *proj->surface, in));
  PetscCall(AinsworthGramMultiply(proj->C, weight, made->WCt.out(), made->S.out()));
  PetscCall(AinsworthPolynomialBound(made->S, &proj->gram, &made->bound, &entries));
  PetscCall(ChooseSteps(proj, *made, entries, choices, &steps, &used));
  if (!used) PetscFunctionReturn(PETSC_SUCCESS);
  made->steps  = AinsworthPolynomialCreateSteps(made->bound, steps);
  made->excess = AinsworthPolynomialExcess(made->bound, steps);
  for (AinsworthRef<Vec> *v : {&made->rest, &made->direction, &made->solution, &made->last})
    PetscCall(AinsworthCreateVecs(made->S, NULL, v->out()));
  proj->polynomial = std::move(made);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Forms what R is made of: S, or that of private unknowns and a polynomial, where S has large components and that is
   quicker; rows are placed before. Collective

   same: patterns are those of the last set-up; on return also the way is, and rows are where they were
*/
static PetscErrorCode FormInverse(AinsworthProjector *proj, const AinsworthProjectorBlocks *blocks, Vec weight,
                                  Vec inverseDiagonal, const AinsworthProjectorPatterns &patterns,
                                  const AinsworthGramChoices &choices, PetscBool *same)
{
  const bool had    = proj->polynomial != nullptr;
  bool       wanted = !patterns.factored && (!*same || had), formed = false;
  PetscBool  large;

  PetscFunctionBegin;
  if (wanted && !had && choices.type == AINSWORTH_GRAM_AUTO) {
    PetscCall(AinsworthPlacementFindLarge({blocks->C, weight}, AinsworthSmallComponent, &large));
    if (!large) {
      PetscCall(FormGrams(proj, blocks, weight, PETSC_FALSE, patterns));
      formed = AinsworthGramIsSmall(&proj->gram);
      wanted = !formed;
    }
  }
  if (wanted) {
    PetscCall(SetUpPolynomial(proj, blocks, weight, inverseDiagonal, had && *same, choices));
    formed = proj->polynomial != nullptr;
  }
  *same = (PetscBool)(*same && had == (proj->polynomial != nullptr));
  if (!formed) PetscCall(FormGrams(proj, blocks, weight, *same, patterns));
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
  PetscCall(AinsworthComplianceSetUp(&proj->compliance, C, blocks->B, blocks->D, weight, inverseDiagonal));
  PetscCall(PetscLogEventBegin(AINSWORTH_GramMat, C, 0, 0, 0));
  PetscCall(FormInverse(proj, blocks, weight, inverseDiagonal, now, choices, &same));
  PetscCall(PetscLogEventEnd(AINSWORTH_GramMat, C, 0, 0, 0));
  PetscCall(AinsworthGramFactor(&proj->gram, parent));
  if (blocks->B != C) PetscCall(AinsworthGramFactor(&proj->gramB, parent));
  if (!same) PetscCall(CreateVectors(proj, C));
  PetscCall(PlaceCompliance(proj));
  proj->patterns = now;
  PetscFunctionReturn(PETSC_SUCCESS);
}
