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

/* Copies the names that the program gave to the fields of its MatNest */
static PetscErrorCode NameFields(const AinsworthSaddleInputs *in, AinsworthFields *fields)
{
  PetscFunctionBegin;
  if (in->fields.size() != fields->size()) PetscFunctionReturn(PETSC_SUCCESS);
  for (AinsworthField &field : *fields) {
    for (const AinsworthField &named : in->fields)
      if (named.rows == field.rows) field.name = named.name;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindFields - finds the fields: those of a MatNest, those that the program or its DM defined, those of a
   MatNest in Pmat, or detected ones
*/
PetscErrorCode AinsworthFindFields(const AinsworthSaddleInputs *in, Mat mat, const AinsworthSaddleBlocks *last,
                                   AinsworthSaddleBlocks *found)
{
  PetscBool nest, hides = PETSC_FALSE, pnest;
  PetscInt  size[2] = {0, 0};

  PetscFunctionBegin;
  PetscCall(AinsworthIsNest(mat, &nest));
  PetscCall(MatGetType(mat, &found->layout));
  if (nest) found->layout = MATNEST;
  found->extracted = PETSC_TRUE;
  found->definedBy = in->definedBy;
  if (nest) {
    PetscCall(AinsworthNestHides(mat, &hides));
    found->extracted = hides;
    found->definedBy = "of the MatNest";
    /* a change of structure would change the state */
    if (hides && last && last->extracted) found->fields = last->fields;
    else if (hides) PetscCall(AinsworthNestFlatten(mat, &found->fields));
    else {
      PetscCall(AinsworthNestGetFields(mat, &found->fields));
      PetscCall(NameFields(in, &found->fields));
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthIsNest(in->pmat, &pnest));
  if (pnest) {
    PetscCall(MatGetSize(mat, &size[0], NULL));
    PetscCall(MatGetSize(in->pmat, &size[1], NULL));
  }
  if (in->fields.size() > 1 && in->detect != 1) found->fields = in->fields;
  else if (pnest && size[0] == size[1] && in->detect != 1) {
    found->definedBy = "of the MatNest in Pmat";
    PetscCall(AinsworthNestGetFields(in->pmat, &found->fields));
  } else {
    if (last && last->extracted && last->layout == found->layout) { /* a change of values would change the state */
      found->fields    = last->fields;
      found->definedBy = last->definedBy;
    } else {
      PetscCheck(in->detect != 0, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG,
                 "PCAINSWORTH knows no fields of the matrix of type %s: pass a MatNest, [A C'; C 0], call "
                 "PCFieldSplitSetIS() for each field, or PCSetDM(); "
                 "-pc_ainsworth_detect_saddle_point finds multipliers by the diagonal, or by signs",
                 found->layout);
      PetscCall(AinsworthDetectFields(mat, found));
    }
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
