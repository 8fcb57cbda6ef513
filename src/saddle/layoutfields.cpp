/*
   Finds the matrix that has the blocks, its fields, and the joined index sets of the primal and the multiplier fields
*/
#include "saddle.h"
#include "../base/objects.h"

/* AinsworthIsNest - tells whether a matrix is a MatNest with more than one row of blocks */
PetscErrorCode AinsworthIsNest(Mat mat, PetscBool *nest)
{
  PetscInt nr = 0, nc = 0;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)mat, MATNEST, nest));
  if (*nest) PetscCall(MatNestGetSize(mat, &nr, &nc));
  *nest = (PetscBool)(nr > 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthChooseMatrix - chooses the matrix that has the blocks: Amat, unless its entries are inaccessible */
PetscErrorCode AinsworthChooseMatrix(const AinsworthSaddleInputs *in, Mat *mat)
{
  Mat       opaque = NULL;
  PetscBool nest[2];

  PetscFunctionBegin;
  *mat = in->amat;
  if (in->amat == in->pmat) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AinsworthIsNest(in->amat, &nest[0]));
  PetscCall(AinsworthIsNest(in->pmat, &nest[1]));
  PetscCall(AinsworthFindOpaque(in->amat, &opaque));
  if (opaque && (!nest[0] || nest[1])) *mat = in->pmat;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode IsPlainNest(const AinsworthSaddleInputs *, Mat mat, PetscBool *is)
{
  PetscBool hides = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(AinsworthIsNest(mat, is));
  if (*is) PetscCall(AinsworthNestHides(mat, &hides));
  *is = (PetscBool)(*is && !hides);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The fields of the program's MatNest have the names that it gave them */
static PetscErrorCode GetNested(const AinsworthSaddleInputs *in, Mat mat, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  PetscCall(AinsworthNestGetFields(mat, &found->fields));
  found->definedBy = "of the MatNest";
  if (in->fields.size() != found->fields.size()) PetscFunctionReturn(PETSC_SUCCESS);
  for (AinsworthField &field : found->fields) {
    for (const AinsworthField &named : in->fields)
      if (named.rows == field.rows) field.name = named.name;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode IsNest(const AinsworthSaddleInputs *, Mat mat, PetscBool *is)
{
  PetscFunctionBegin;
  PetscCall(AinsworthIsNest(mat, is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetFlattened(const AinsworthSaddleInputs *, Mat mat, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  PetscCall(AinsworthNestFlatten(mat, &found->fields));
  found->definedBy = "of the MatNest";
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AreNamed(const AinsworthSaddleInputs *in, Mat, PetscBool *are)
{
  PetscFunctionBegin;
  *are = (PetscBool)(in->fields.size() > 1 && in->detect != 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetNamed(const AinsworthSaddleInputs *in, Mat, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  found->fields    = in->fields;
  found->definedBy = in->definedBy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode IsNestInPmat(const AinsworthSaddleInputs *in, Mat mat, PetscBool *is)
{
  PetscInt size[2];

  PetscFunctionBegin;
  PetscCall(AinsworthIsNest(in->pmat, is));
  if (!*is) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetSize(mat, &size[0], NULL));
  PetscCall(MatGetSize(in->pmat, &size[1], NULL));
  *is = (PetscBool)(size[0] == size[1] && in->detect != 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetNestedInPmat(const AinsworthSaddleInputs *in, Mat, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  PetscCall(AinsworthNestGetFields(in->pmat, &found->fields));
  found->definedBy = "of the MatNest in Pmat";
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode IsPlain(const AinsworthSaddleInputs *, Mat, PetscBool *is)
{
  PetscFunctionBegin;
  *is = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Detect(const AinsworthSaddleInputs *in, Mat mat, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  PetscCheck(in->detect != 0, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH knows no fields of the matrix of type %s: pass a MatNest, [A C'; C 0], call "
             "PCFieldSplitSetIS() for each field, or PCSetDM(); "
             "-pc_ainsworth_detect_saddle_point finds multipliers by the diagonal, or by signs, "
             "-pc_ainsworth_multiplier_rows names their rows",
             found->type);
  PetscCall(AinsworthDetectFields(mat, found));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The layouts: the first that fits is taken */
struct AinsworthSaddleLayout {
  PetscErrorCode (*fits)(const AinsworthSaddleInputs *, Mat, PetscBool *);
  PetscErrorCode (*get)(const AinsworthSaddleInputs *, Mat, AinsworthSaddleBlocks *); /* the fields, and definedBy */

  PetscBool extracted; /* its blocks are submatrices; otherwise they are blocks of the MatNest */
  PetscBool stays;     /* its fields are those of the last set-up: another structure, or values, would change a state */
};
static const AinsworthSaddleLayout layouts[] = {
  {IsPlainNest,  GetNested,       PETSC_FALSE, PETSC_FALSE},
  {IsNest,       GetFlattened,    PETSC_TRUE,  PETSC_TRUE },
  {AreNamed,     GetNamed,        PETSC_TRUE,  PETSC_FALSE},
  {IsNestInPmat, GetNestedInPmat, PETSC_TRUE,  PETSC_FALSE},
  {IsPlain,      Detect,          PETSC_TRUE,  PETSC_TRUE }
};

/* AinsworthFindFields - finds the layout and its fields; last: of the last set-up, or NULL. Collective */
PetscErrorCode AinsworthFindFields(const AinsworthSaddleInputs *in, Mat mat, const AinsworthSaddleBlocks *last,
                                   AinsworthSaddleBlocks *found)
{
  PetscBool fits = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(MatGetType(mat, &found->type));
  for (const AinsworthSaddleLayout &layout : layouts) {
    PetscCall(layout.fits(in, mat, &fits));
    if (!fits) continue;
    found->layout    = &layout;
    found->extracted = layout.extracted;
    if (layout.stays && last && last->layout == &layout) {
      found->fields    = last->fields;
      found->definedBy = last->definedBy;
    } else PetscCall(layout.get(in, mat, found));
    break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Replaces index sets that equal those of the last set-up by the same objects, so that comparing pointers shows that
   nothing changed
*/
static PetscErrorCode KeepSets(const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  PetscFunctionBegin;
  if (!last || !last->layout || last->fields.size() != found->fields.size()) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t i = 0; i < found->fields.size(); i++) {
    for (AinsworthRef<IS> AinsworthField::*set : {&AinsworthField::rows, &AinsworthField::cols}) {
      AinsworthRef<IS>      &now    = found->fields[i].*set;
      const AinsworthRef<IS> before = last->fields[i].*set;
      PetscBool              same   = PETSC_FALSE;

      if (now == before) continue;
      PetscCall(ISEqualUnsorted(now, before, &same));
      if (same) now = before;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Joins the index sets of some fields: a single one is shared; several are concatenated on each rank as in a MatNest,
   or sorted for submatrices
*/
static PetscErrorCode JoinSets(MPI_Comm comm, const std::vector<IS> &sets, PetscBool sorted, AinsworthRef<IS> *join)
{
  PetscFunctionBegin;
  if (sets.size() == 1) *join = AinsworthRetain(sets[0]);
  else {
    PetscCall(ISConcatenate(comm, (PetscInt)sets.size(), sets.data(), join->out()));
    if (sorted) PetscCall(ISSort(*join));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthJoinFields - creates the rows and cols of the primal and multiplier fields; shares those of last if the
   fields are the same. Collective
*/
PetscErrorCode AinsworthJoinFields(MPI_Comm comm, const AinsworthSaddleBlocks *last, AinsworthSaddleBlocks *found)
{
  bool same = last && last->layout && last->extracted == found->extracted && last->multiplier == found->multiplier &&
              last->fields.size() == found->fields.size();

  PetscFunctionBegin;
  PetscCall(KeepSets(last, found));
  for (size_t i = 0; i < found->fields.size() && same; i++)
    same = last->fields[i].rows == found->fields[i].rows && last->fields[i].cols == found->fields[i].cols;
  for (int k = 0; k < 2; k++) {
    std::vector<IS> rows, cols;

    for (size_t i = 0; i < found->fields.size(); i++) {
      if (found->multiplier[i] != (k == 1)) continue;
      rows.push_back(found->fields[i].rows);
      cols.push_back(found->fields[i].cols);
    }
    if (same) {
      found->rows[k] = last->rows[k];
      found->cols[k] = last->cols[k];
    } else {
      PetscCall(JoinSets(comm, rows, found->extracted, &found->rows[k]));
      if (rows == cols) found->cols[k] = found->rows[k];
      else PetscCall(JoinSets(comm, cols, found->extracted, &found->cols[k]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
