/* Finds the blocks of the saddle-point system in any supported layout; code after this does not depend on the layout */
#include "saddle.h"
#include "../base/events.h"
#include "../base/objects.h"

/* Sets the names of the blocks, such as "Block (p,u+v) of the MatNest" */
static PetscErrorCode NameBlocks(AinsworthSaddleBlocks *found)
{
  std::string part[2];

  PetscFunctionBegin;
  for (size_t i = 0; i < found->fields.size(); i++) {
    std::string &names = part[found->multiplier[i]];

    names += (names.empty() ? "" : "+") + found->fields[i].name;
  }
  for (std::string &names : part)
    if (names.size() > 16) names = names.substr(0, 13) + "...";
  for (int k = 0; k < AINSWORTH_BLOCKS; k++) {
    PetscCall(PetscSNPrintf(found->name[k], sizeof(found->name[k]), "Block (%s,%s) of %s",
                            part[AinsworthBlockRow[k]].c_str(), part[AinsworthBlockColumn[k]].c_str(),
                            k == AINSWORTH_BLOCK_P ? "Pmat"
                            : found->extracted     ? "the matrix"
                                                   : "the MatNest"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes over a block of the last set-up if nothing that it was made of has changed */
static PetscErrorCode TakeOver(const AinsworthSaddleBlocks *last, int k, AinsworthSaddleBlocks *found, PetscBool *taken)
{
  PetscFunctionBegin;
  *taken = (PetscBool)(last && last->layout && last->block[k] && last->state[k] == found->state[k]);
  if (!*taken) PetscFunctionReturn(PETSC_SUCCESS);
  found->block[k] = last->block[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Assembles a nest of primal blocks into one matrix, as preconditioners need it, unless the entries of a part are
   inaccessible
*/
static PetscErrorCode Assemble(const AinsworthSaddleBlocks *last, int k, AinsworthSaddleBlocks *found)
{
  const AinsworthRef<Mat> given = found->block[k];
  Mat                     opaque;
  PetscBool               nest, taken;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)given, MATNEST, &nest));
  if (!nest) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthFindOpaque(given, &opaque));
  if (opaque) PetscFunctionReturn(PETSC_SUCCESS);
  found->made[k] = PETSC_TRUE;
  PetscCall(TakeOver(last && !last->sign ? last : NULL, k, found, &taken));
  if (!taken) {
    PetscCall(AinsworthGetAIJ(given, found->block[k].out()));
    PetscCall(AinsworthCopyNullSpaces(given, found->block[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces a block of minus a saddle point in a MatNest by a copy with changed signs */
static PetscErrorCode ChangeSign(const AinsworthSaddleBlocks *last, int k, AinsworthSaddleBlocks *found)
{
  const AinsworthRef<Mat> given = found->block[k];
  Mat                     aij;
  PetscInt                bs;
  PetscBool               taken = PETSC_FALSE, opaque;

  PetscFunctionBegin;
  if (!given || !found->sign) PetscFunctionReturn(PETSC_SUCCESS);
  if (last && last->sign) PetscCall(TakeOver(last, k, found, &taken));
  if (!taken) {
    PetscCall(AinsworthCheckEntries(given, found->name[k], "of minus a saddle point", &opaque));
    PetscCall(AinsworthGetAIJ(given, &aij));
    PetscCall(MatDuplicate(aij, MAT_COPY_VALUES, found->block[k].out()));
    PetscCall(MatDestroy(&aij));
    PetscCall(AinsworthChangeSign(found->sign, k, found->block[k]));
    PetscCall(MatGetBlockSize(given, &bs));
    if (k == AINSWORTH_BLOCK_A || k == AINSWORTH_BLOCK_P) PetscCall(MatSetBlockSize(found->block[k], bs));
    PetscCall(AinsworthCopyNullSpaces(given, found->block[k]));
  }
  found->made[k] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the primal block of Pmat: from a MatNest with the same fields, or a submatrix of any other matrix of the same
   size. compare: only its state
*/
static PetscErrorCode FindPrimal(const AinsworthSaddleInputs *in, Mat mat, PetscBool compare,
                                 const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  const int             P = AINSWORTH_BLOCK_P;
  std::vector<PetscInt> part;
  PetscBool             nest;
  PetscInt              nr = 0, nc = 0, size[2];

  PetscFunctionBegin;
  found->state[P] = found->state[AINSWORTH_BLOCK_A];
  PetscCall(MatGetSize(mat, &size[0], NULL));
  PetscCall(MatGetSize(in->pmat, &size[1], NULL));
  if (in->pmat == mat || size[0] != size[1]) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t i = 0; i < found->fields.size(); i++)
    if (!found->multiplier[i]) part.push_back((PetscInt)i);
  PetscCall(AinsworthIsNest(in->pmat, &nest));
  if (nest) PetscCall(MatNestGetSize(in->pmat, &nr, &nc));
  if (!found->extracted && nr == (PetscInt)found->fields.size() && nc == nr) {
    PetscCall(AinsworthNestGetPartState(in->pmat, part, part, &found->state[P]));
    if (compare) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(AinsworthNestGetPart(in->pmat, part, part, found->block[P].out()));
    PetscCall(AinsworthCheckAssembled(found->block[P], found->name[P]));
    if (found->block[P]) PetscCall(Assemble(last, P, found));
    PetscCall(ChangeSign(last, P, found));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthMatGetState(in->pmat, &found->state[P]));
  if (compare) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCheckAssembled(in->pmat, "Pmat"));
  PetscCall(AinsworthExtractPrimal(in->pmat, last, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the blocks of a MatNest; blocks of several fields become nests */
static PetscErrorCode NestBlocks(const AinsworthSaddleInputs *in, Mat mat, PetscBool compare,
                                 const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  std::vector<PetscInt> part[2];

  PetscFunctionBegin;
  for (size_t i = 0; i < found->fields.size(); i++) part[found->multiplier[i]].push_back((PetscInt)i);
  for (int k = 0; k < AINSWORTH_BLOCK_P; k++) {
    const auto &rows = part[AinsworthBlockRow[k]], &cols = part[AinsworthBlockColumn[k]];

    PetscCall(AinsworthNestGetPartState(mat, rows, cols, &found->state[k]));
    if (compare) continue;
    PetscCall(AinsworthNestGetPart(mat, rows, cols, found->block[k].out()));
    PetscCall(AinsworthCheckAssembled(found->block[k], found->name[k]));
  }
  if (!compare) {
    PetscCheck(found->block[AINSWORTH_BLOCK_A], PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG,
               "%s, A, is absent%s", found->name[AINSWORTH_BLOCK_A], found->blame);
    PetscCall(Assemble(last, AINSWORTH_BLOCK_A, found));
    PetscCall(AinsworthFindSign(found->block[AINSWORTH_BLOCK_A], NULL, found->sign.out()));
    for (int k = 0; k < AINSWORTH_BLOCK_P; k++) PetscCall(ChangeSign(last, k, found));
  }
  PetscCall(FindPrimal(in, mat, compare, last, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the blocks as submatrices; any change of values counts as one of all blocks until AinsworthSplitRefill()
   compares them
*/
static PetscErrorCode SubmatrixBlocks(const AinsworthSaddleInputs *in, Mat mat, PetscBool compare,
                                      const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  uint64_t state;

  PetscFunctionBegin;
  PetscCall(AinsworthMatGetState(mat, &state));
  for (int k = 0; k < AINSWORTH_BLOCK_P; k++) found->state[k] = state;
  if (!compare) {
    PetscCall(AinsworthCheckAssembled(mat, "The matrix"));
    PetscCall(AinsworthFindSign(mat, found->rows[0], found->sign.out()));
    PetscCall(AinsworthExtractBlocks(mat, last, found));
  }
  PetscCall(FindPrimal(in, mat, compare, last, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode FindBlocks(const AinsworthSaddleInputs *in, PetscBool compare, const AinsworthSaddleBlocks *last,
                                 AinsworthSaddleBlocks *found)
{
  Mat  mat;
  bool detected;

  PetscFunctionBegin;
  *found = AinsworthSaddleBlocks();
  PetscCall(AinsworthChooseMatrix(in, &mat));
  PetscCall(AinsworthFindFields(in, mat, compare ? last : NULL, found));
  detected = !found->multiplier.empty();
  if (compare) {
    if (last->fields.size() != found->fields.size()) {
      found->layout = NULL;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    found->multiplier = last->multiplier;
  }
  if (!compare && (!detected || !in->multipliers.empty())) PetscCall(AinsworthChooseMultipliers(in, mat, found));
  if (!compare) PetscCall(NameBlocks(found));
  PetscCall(AinsworthJoinFields(PetscObjectComm((PetscObject)in->pmat), last, found));
  if (found->extracted) PetscCall(SubmatrixBlocks(in, mat, compare, last, found));
  else PetscCall(NestBlocks(in, mat, compare, last, found));
  if (compare) PetscFunctionReturn(PETSC_SUCCESS);
  if (detected) PetscCall(AinsworthCheckDetected(found));
  if (!found->block[AINSWORTH_BLOCK_P]) found->block[AINSWORTH_BLOCK_P] = found->block[AINSWORTH_BLOCK_A];
  if (found->made[AINSWORTH_BLOCK_A]) PetscCall(AinsworthSaddleAttachNearNullSpace(found, mat));
  PetscCall(AinsworthFindBlockSize(in, mat, last, found));
  PetscCall(AinsworthFindRigidModes(in, mat, last, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleFindBlocks - finds the blocks of what the program passed, their states, and the index sets of the
   fields. Collective

   last: result of the last set-up, may be empty; what has not changed is taken from it. compare: the multiplier fields
   are those of last, no value is read and no block is created; layout becomes NULL if the number of fields has changed.
*/
PetscErrorCode AinsworthSaddleFindBlocks(const AinsworthSaddleInputs *in, PetscBool compare,
                                         const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(AINSWORTH_Layout, in->pmat, NULL, NULL, NULL));
  PetscCall(FindBlocks(in, compare, last, found));
  PetscCall(PetscLogEventEnd(AINSWORTH_Layout, in->pmat, NULL, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Describes the layout in words, for views and PetscInfo() */
PetscErrorCode AinsworthSaddleDescribeLayout(const AinsworthSaddleBlocks *b, char text[], size_t len)
{
  std::string names;

  PetscFunctionBegin;
  for (size_t i = 0; i < b->fields.size(); i++)
    if (b->multiplier[i]) names += (names.empty() ? "" : ", ") + b->fields[i].name;
  PetscCall(PetscSNPrintf(text, len, "%s, %" PetscInt_FMT " fields %s; multipliers: %s (%s)%s", b->type,
                          (PetscInt)b->fields.size(), b->definedBy, names.c_str(), b->chosen,
                          b->sign ? "; signs changed" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}
