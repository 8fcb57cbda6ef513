/* The blocks of the saddle point, from whatever the program passed: nothing after it sees the layout */
#include "saddle.h"
#include <petsc/private/petscimpl.h>
#include <limits>

/* Collective: refuses a block that waits for its assembly on any rank; each rank knows only of the values that it set itself */
PetscErrorCode AinsworthCheckAssembled(Mat M, const char name[])
{
  PetscBool assembled;

  PetscFunctionBegin;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatAssembled(M, &assembled));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &assembled, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)M)));
  PetscCheck(assembled, PetscObjectComm((PetscObject)M), PETSC_ERR_ARG_WRONGSTATE, "%s is not assembled: call MatAssemblyBegin() and MatAssemblyEnd() on it",
             name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthBlockNorm - the Frobenius norm of a block, 0 where it is absent or zero and only there, Inf where its type has none

   Collective. A is looked at once while it does not change, however often C does.
*/
PetscErrorCode AinsworthBlockNorm(Mat M, PetscReal *norm)
{
  static PetscInt normId = -1;
  PetscBool       has, known;
  PetscInt        row, col;
  uint64_t        state;

  PetscFunctionBegin;
  *norm = 0.0;
  if (!M) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthMatGetState(M, &state)); /* changes of its parts come to its own state */
  PetscCall(MatHasOperation(M, MATOP_NORM, &has));
  if (!has) {
    *norm = PETSC_INFINITY;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (normId < 0) PetscCall(PetscObjectComposedDataRegister(&normId));
  PetscCall(PetscObjectComposedDataGetReal((PetscObject)M, normId, *norm, known));
  if (known) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNorm(M, NORM_FROBENIUS, norm));
  if (*norm == 0.0) { /* or the squares of its entries underflow */
    PetscCall(AinsworthMatFindNonzero(M, &row, &col));
    if (row >= 0) *norm = std::numeric_limits<PetscReal>::min();
  }
  PetscCall(PetscObjectComposedDataSetReal((PetscObject)M, normId, *norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Is it a MatNest of more than one block? */
static PetscErrorCode IsNest(Mat mat, PetscBool *nest)
{
  PetscInt nr = 0, nc = 0;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)mat, MATNEST, nest));
  if (*nest) PetscCall(MatNestGetSize(mat, &nr, &nc));
  *nest = (PetscBool)(nr > 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix that has the blocks: Amat, unless it is one that gives no entries */
static PetscErrorCode ChooseMatrix(const AinsworthSaddleInputs *in, Mat *mat)
{
  Mat       opaque = NULL;
  PetscBool nest[2];

  PetscFunctionBegin;
  *mat = in->amat;
  if (in->amat == in->pmat) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(IsNest(in->amat, &nest[0]));
  PetscCall(IsNest(in->pmat, &nest[1]));
  PetscCall(AinsworthFindOpaque(in->amat, &opaque));
  if (opaque && (!nest[0] || nest[1])) *mat = in->pmat;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names that the program gave to the very fields of its MatNest */
static PetscErrorCode NameFields(const AinsworthSaddleInputs *in, AinsworthFields *fields)
{
  PetscFunctionBegin;
  if (in->fields.size() != fields->size()) PetscFunctionReturn(PETSC_SUCCESS);
  for (AinsworthField &field : *fields) {
    for (const AinsworthField &told : in->fields)
      if (told.rows.get() == field.rows.get()) field.name = told.name;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whose fields are they? Those of the MatNest, those that the program or its DM named, those of a MatNest in Pmat, or, with detect, found by the diagonal */
static PetscErrorCode FindFields(const AinsworthSaddleInputs *in, Mat mat, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  PetscBool nest, hides = PETSC_FALSE, pnest;
  PetscInt  size[2] = {0, 0};

  PetscFunctionBegin;
  PetscCall(IsNest(mat, &nest));
  found->layout    = nest ? MATNEST : ((PetscObject)mat)->type_name;
  found->extracted = PETSC_TRUE;
  found->told      = in->told;
  if (nest) {
    PetscCall(AinsworthNestHides(mat, &hides));
    found->extracted = hides;
    found->told      = "of the MatNest";
    if (hides && last && last->extracted) found->fields = last->fields; /* another structure shows in the state */
    else if (hides) PetscCall(AinsworthNestFlatten(mat, &found->fields));
    else {
      PetscCall(AinsworthNestGetFields(mat, &found->fields));
      PetscCall(NameFields(in, &found->fields));
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(IsNest(in->pmat, &pnest));
  if (pnest) {
    PetscCall(MatGetSize(mat, &size[0], NULL));
    PetscCall(MatGetSize(in->pmat, &size[1], NULL));
  }
  if (in->fields.size() > 1 && in->detect != 1) found->fields = in->fields;
  else if (pnest && size[0] == size[1] && in->detect != 1) {
    found->told = "of the MatNest in Pmat";
    PetscCall(AinsworthNestGetFields(in->pmat, &found->fields));
  } else {
    found->told = "by the diagonal";
    if (last && last->extracted && last->layout == found->layout) found->fields = last->fields; /* a change of values shows in the state */
    else {
      PetscCheck(in->detect != 0, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG,
                 "PCAINSWORTH knows no fields of the matrix of type %s: pass a MatNest, [A C'; C 0], call PCFieldSplitSetIS() for each field, or PCSetDM(); "
                 "-pc_ainsworth_detect_saddle_point finds multipliers by the diagonal",
                 found->layout);
      PetscCall(AinsworthDetectFields(mat, &found->fields));
      found->multiplier = {false, true};
      found->chosen     = "their diagonal entries are not positive";
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Index sets that are equal to those of the last set-up become the same objects, which tells that nothing changed */
static PetscErrorCode KeepSets(const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  if (!last || !last->layout || last->fields.size() != found->fields.size()) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t i = 0; i < found->fields.size(); i++) {
    for (AinsworthIS AinsworthField::*set : {&AinsworthField::rows, &AinsworthField::cols}) {
      AinsworthIS      &now    = found->fields[i].*set;
      const AinsworthIS before = last->fields[i].*set;
      PetscBool         same   = PETSC_FALSE;

      if (now.get() == before.get()) continue;
      PetscCall(ISEqualUnsorted(now.get(), before.get(), &same));
      if (same) now = before;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The index set of some fields: of one its own; several one after the other on each rank, as the parts of a MatNest, or sorted for submatrices */
static PetscErrorCode JoinSets(MPI_Comm comm, const std::vector<IS> &sets, PetscBool sorted, IS *join)
{
  PetscInt  n = 0, total = 0;
  PetscInt *index;
  PetscBool contiguous = PETSC_TRUE;

  PetscFunctionBegin;
  if (sets.size() == 1) {
    *join = sets[0];
    PetscCall(PetscObjectReference((PetscObject)*join));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (IS set : sets) {
    PetscCall(ISGetLocalSize(set, &n));
    total += n;
  }
  PetscCall(PetscMalloc1(total, &index));
  total = 0;
  for (IS set : sets) {
    const PetscInt *part;

    PetscCall(ISGetLocalSize(set, &n));
    PetscCall(ISGetIndices(set, &part));
    PetscCall(PetscArraycpy(index + total, part, n));
    PetscCall(ISRestoreIndices(set, &part));
    total += n;
  }
  if (sorted) PetscCall(PetscSortInt(total, index));
  for (PetscInt i = 1; i < total; i++)
    if (index[i] != index[i - 1] + 1) contiguous = PETSC_FALSE;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &contiguous, 1, AINSWORTH_MPI_BOOL, MPI_LAND, comm));
  if (contiguous) { /* submatrices of such are made several times faster */
    PetscCall(ISCreateStride(comm, total, total ? index[0] : 0, 1, join));
    PetscCall(PetscFree(index));
  } else PetscCall(ISCreateGeneral(comm, total, index, PETSC_OWN_POINTER, join));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rows and cols of the primal and of the multiplier fields: the same objects as in last where the fields are the same */
static PetscErrorCode JoinFields(MPI_Comm comm, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  bool same = last && last->layout && last->extracted == found->extracted && last->multiplier == found->multiplier &&
              last->fields.size() == found->fields.size();

  PetscFunctionBegin;
  for (size_t i = 0; i < found->fields.size() && same; i++)
    same = last->fields[i].rows.get() == found->fields[i].rows.get() && last->fields[i].cols.get() == found->fields[i].cols.get();
  for (int k = 0; k < 2; k++) {
    std::vector<IS> rows, cols;

    for (size_t i = 0; i < found->fields.size(); i++) {
      if (found->multiplier[i] != (k == 1)) continue;
      rows.push_back(found->fields[i].rows.get());
      cols.push_back(found->fields[i].cols.get());
    }
    if (same) {
      found->rows[k] = last->rows[k];
      found->cols[k] = last->cols[k];
      PetscCall(PetscObjectReference((PetscObject)found->rows[k]));
      PetscCall(PetscObjectReference((PetscObject)found->cols[k]));
    } else {
      PetscCall(JoinSets(comm, rows, found->extracted, &found->rows[k]));
      if (rows == cols) {
        found->cols[k] = found->rows[k];
        PetscCall(PetscObjectReference((PetscObject)found->cols[k]));
      } else PetscCall(JoinSets(comm, cols, found->extracted, &found->cols[k]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* "Block (p,u+v) of the MatNest" */
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
    const int row = k == AINSWORTH_BLOCK_C || k == AINSWORTH_BLOCK_D, col = k == AINSWORTH_BLOCK_B || k == AINSWORTH_BLOCK_D;

    PetscCall(PetscSNPrintf(found->name[k], sizeof(found->name[k]), "Block (%s,%s) of %s", part[row].c_str(), part[col].c_str(),
                            k == AINSWORTH_BLOCK_P ? "Pmat"
                            : found->extracted     ? "the matrix"
                                                   : "the MatNest"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a block of last was made of did not change: it is taken over */
static PetscErrorCode TakeOver(const AinsworthSaddleBlocks *last, int k, AinsworthSaddleBlocks *found, PetscBool *taken)
{
  *taken = (PetscBool)(last && last->layout && last->block[k] && last->state[k] == found->state[k]);
  PetscFunctionBegin;
  if (!*taken) PetscFunctionReturn(PETSC_SUCCESS);
  found->block[k] = last->block[k];
  PetscCall(PetscObjectReference((PetscObject)found->block[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the program attached to the one matrix, for the other that takes its place */
static PetscErrorCode CopyNullSpaces(Mat from, Mat to)
{
  MatNullSpace nullsp, near;

  PetscFunctionBegin;
  PetscCall(MatGetNullSpace(from, &nullsp));
  PetscCall(MatGetNearNullSpace(from, &near));
  PetscCall(MatSetNullSpace(to, nullsp));
  PetscCall(MatSetNearNullSpace(to, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A nest of primal blocks, the program's or one of several fields, becomes one matrix, as preconditioners need it; parts without entries stay as they are */
static PetscErrorCode Assemble(const AinsworthSaddleBlocks *last, int k, AinsworthSaddleBlocks *found)
{
  Mat       given = found->block[k], opaque;
  PetscBool nest, taken;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)given, MATNEST, &nest));
  if (!nest) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthFindOpaque(given, &opaque));
  if (opaque) PetscFunctionReturn(PETSC_SUCCESS);
  found->made[k] = PETSC_TRUE;
  PetscCall(TakeOver(last && !last->sign ? last : NULL, k, found, &taken));
  if (!taken) {
    PetscCall(AinsworthGetAIJ(given, &found->block[k]));
    PetscCall(CopyNullSpaces(given, found->block[k]));
  }
  PetscCall(MatDestroy(&given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The blocks of minus a MatNest, copies */
static PetscErrorCode ChangeSigns(const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  PetscCall(AinsworthFindSign(found->block[AINSWORTH_BLOCK_A], NULL, &found->sign));
  for (int k = 0; k < AINSWORTH_BLOCKS && found->sign; k++) {
    Mat       given = found->block[k], aij;
    PetscInt  bs;
    PetscBool taken = PETSC_FALSE, opaque;

    if (!given) continue;
    if (last && last->sign) PetscCall(TakeOver(last, k, found, &taken));
    if (!taken) {
      PetscCall(AinsworthCheckEntries(given, found->name[k], "of minus a saddle point", &opaque));
      PetscCall(AinsworthGetAIJ(given, &aij));
      PetscCall(MatDuplicate(aij, MAT_COPY_VALUES, &found->block[k]));
      PetscCall(MatDestroy(&aij));
      PetscCall(AinsworthChangeSign(found, k, found->block[k]));
      PetscCall(MatGetBlockSize(given, &bs));
      if (k == AINSWORTH_BLOCK_A || k == AINSWORTH_BLOCK_P) PetscCall(MatSetBlockSize(found->block[k], bs));
      PetscCall(CopyNullSpaces(given, found->block[k]));
    }
    found->made[k] = PETSC_TRUE;
    PetscCall(MatDestroy(&given));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The blocks of a MatNest, those of several fields as nests of their own */
static PetscErrorCode NestBlocks(const AinsworthSaddleInputs *in, Mat mat, PetscBool compare, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  std::vector<PetscInt> part[2];
  PetscBool             nest;
  PetscInt              nr = 0;

  PetscFunctionBegin;
  for (size_t i = 0; i < found->fields.size(); i++) part[found->multiplier[i]].push_back((PetscInt)i);
  for (int k = 0; k < AINSWORTH_BLOCK_P; k++) {
    const auto &rows = part[k == AINSWORTH_BLOCK_C || k == AINSWORTH_BLOCK_D], &cols = part[k == AINSWORTH_BLOCK_B || k == AINSWORTH_BLOCK_D];

    PetscCall(AinsworthNestGetPartState(mat, rows, cols, &found->state[k]));
    if (!compare) PetscCall(AinsworthNestGetPart(mat, rows, cols, &found->block[k]));
  }
  found->state[AINSWORTH_BLOCK_P] = found->state[AINSWORTH_BLOCK_A];
  PetscCall(IsNest(in->pmat, &nest));
  if (nest) PetscCall(MatNestGetSize(in->pmat, &nr, NULL));
  if (in->pmat != mat && nr == (PetscInt)found->fields.size()) {
    PetscCall(AinsworthNestGetPartState(in->pmat, part[0], part[0], &found->state[AINSWORTH_BLOCK_P]));
    if (!compare) PetscCall(AinsworthNestGetPart(in->pmat, part[0], part[0], &found->block[AINSWORTH_BLOCK_P]));
  }
  if (compare) PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < AINSWORTH_BLOCKS; k++) PetscCall(AinsworthCheckAssembled(found->block[k], found->name[k]));
  PetscCheck(found->block[AINSWORTH_BLOCK_A], PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG, "%s, A, is absent", found->name[AINSWORTH_BLOCK_A]);
  PetscCall(Assemble(last, AINSWORTH_BLOCK_A, found));
  if (found->block[AINSWORTH_BLOCK_P]) PetscCall(Assemble(last, AINSWORTH_BLOCK_P, found));
  PetscCall(ChangeSigns(last, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Submatrices: a change of any value is one of all of them, until their values are looked at */
static PetscErrorCode SubmatrixBlocks(const AinsworthSaddleInputs *in, Mat mat, PetscBool compare, const AinsworthSaddleBlocks *last,
                                      AinsworthSaddleBlocks *found)
{
  uint64_t  state, statep;
  PetscBool same = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(AinsworthMatGetState(mat, &state));
  PetscCall(AinsworthMatGetState(in->pmat, &statep));
  for (int k = 0; k < AINSWORTH_BLOCKS; k++) found->state[k] = k == AINSWORTH_BLOCK_P ? statep : state;
  if (compare) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthCheckAssembled(mat, "The matrix"));
  if (in->pmat != mat) PetscCall(AinsworthCheckAssembled(in->pmat, "Pmat"));
  PetscCall(AinsworthFindSign(mat, found->rows[0], &found->sign));
  if (last && last->layout && last->extracted && last->rows[0] == found->rows[0] && last->rows[1] == found->rows[1] && !last->sign == !found->sign)
    same = PETSC_TRUE;
  PetscCall(AinsworthExtractBlocks(in, mat, same ? last : NULL, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleFindBlocks - the blocks of what the program passed with their states, and the index sets of its fields; to be reset

   Collective. last is what was found at the last set-up, and may be empty: what did not change is taken from it. compare: the multipliers are what they
   were, as far as the layout is the same, no value is looked at and no block is made; layout is NULL where there are other fields.
*/
PetscErrorCode AinsworthSaddleFindBlocks(const AinsworthSaddleInputs *in, PetscBool compare, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)in->pmat);
  Mat      mat;

  PetscFunctionBegin;
  *found = AinsworthSaddleBlocks();
  PetscCall(ChooseMatrix(in, &mat));
  PetscCall(FindFields(in, mat, compare ? last : NULL, found));
  if (compare) {
    if (last->fields.size() != found->fields.size()) {
      found->layout = NULL;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    found->multiplier = last->multiplier;
  } else if (found->multiplier.empty() || !in->multipliers.empty()) PetscCall(AinsworthChooseMultipliers(in, mat, found));
  if (!compare) PetscCall(NameBlocks(found));
  PetscCall(KeepSets(last, found));
  PetscCall(JoinFields(comm, last, found));
  if (found->extracted) PetscCall(SubmatrixBlocks(in, mat, compare, last, found));
  else PetscCall(NestBlocks(in, mat, compare, last, found));
  if (compare) PetscFunctionReturn(PETSC_SUCCESS);
  if (!found->block[AINSWORTH_BLOCK_P]) {
    found->block[AINSWORTH_BLOCK_P] = found->block[AINSWORTH_BLOCK_A];
    PetscCall(PetscObjectReference((PetscObject)found->block[AINSWORTH_BLOCK_P]));
  }
  if (found->made[AINSWORTH_BLOCK_A]) PetscCall(AinsworthSaddleAttachNearNullSpace(found, mat));
  PetscCall(AinsworthFindBlockSize(in, mat, last, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In words: for views and PetscInfo() */
PetscErrorCode AinsworthSaddleDescribeLayout(const AinsworthSaddleBlocks *b, char text[], size_t len)
{
  std::string names;

  PetscFunctionBegin;
  for (size_t i = 0; i < b->fields.size(); i++)
    if (b->multiplier[i]) names += (names.empty() ? "" : ", ") + b->fields[i].name;
  PetscCall(PetscSNPrintf(text, len, "%s, %" PetscInt_FMT " fields %s; multipliers: %s (%s)%s", b->layout, (PetscInt)b->fields.size(), b->told, names.c_str(),
                          b->chosen, b->sign ? "; signs changed" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthSaddleResetBlocks(AinsworthSaddleBlocks *b)
{
  PetscFunctionBegin;
  for (Mat &M : b->block) PetscCall(MatDestroy(&M));
  PetscCall(VecDestroy(&b->sign));
  for (int k = 0; k < 2; k++) {
    PetscCall(ISDestroy(&b->rows[k]));
    PetscCall(ISDestroy(&b->cols[k]));
  }
  *b = AinsworthSaddleBlocks();
  PetscFunctionReturn(PETSC_SUCCESS);
}
