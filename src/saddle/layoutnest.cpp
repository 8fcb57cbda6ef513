/* MatNest: one field for each row of blocks; parts that span several fields */
#include "saddle.h"

PetscErrorCode AinsworthNestGetFields(Mat nest, AinsworthFields *fields)
{
  PetscInt nr, nc;

  PetscFunctionBegin;
  PetscCall(MatNestGetSize(nest, &nr, &nc));
  PetscCheck(nr == nc, PetscObjectComm((PetscObject)nest), PETSC_ERR_ARG_SIZ,
             "The MatNest has %" PetscInt_FMT " x %" PetscInt_FMT
             " blocks: PCAINSWORTH needs as many rows of blocks as columns, [A C'; C 0]",
             nr, nc);
  std::vector<IS> rows(nr), cols(nc);

  PetscCall(MatNestGetISs(nest, rows.data(), cols.data()));
  fields->clear();
  for (PetscInt i = 0; i < nr; i++)
    fields->push_back({std::to_string(i), AinsworthRetain(rows[i]), AinsworthRetain(cols[i])});
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tells whether a block is absent or a nest of absent blocks; the entries of other blocks are not read */
static PetscErrorCode IsAbsent(Mat M, PetscBool *absent)
{
  PetscInt nr, nc;
  Mat      block;

  PetscFunctionBegin;
  *absent = (PetscBool)!M;
  if (M) PetscCall(PetscObjectTypeCompare((PetscObject)M, MATNEST, absent));
  if (!M || !*absent) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNestGetSize(M, &nr, &nc));
  for (PetscInt k = 0; k < nr * nc && *absent; k++) {
    PetscCall(MatNestGetSubMat(M, k / nc, k % nc, &block));
    PetscCall(IsAbsent(block, absent));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthNestHides - tells whether a diagonal block is itself a nest with absent and present diagonal blocks, which
   means that it has multipliers
*/
PetscErrorCode AinsworthNestHides(Mat nest, PetscBool *hides)
{
  PetscInt nr, nc;

  PetscFunctionBegin;
  *hides = PETSC_FALSE;
  PetscCall(MatNestGetSize(nest, &nr, &nc));
  for (PetscInt i = 0; i < PetscMin(nr, nc) && !*hides; i++) {
    Mat       block, inner;
    PetscInt  mr = 0, mc = 0, absent = 0;
    PetscBool is = PETSC_FALSE;

    PetscCall(MatNestGetSubMat(nest, i, i, &block));
    if (block) PetscCall(PetscObjectTypeCompare((PetscObject)block, MATNEST, &is));
    if (!is) continue;
    PetscCall(MatNestGetSize(block, &mr, &mc));
    if (mr != mc || mr < 2) continue;
    for (PetscInt j = 0; j < mr; j++) {
      PetscCall(MatNestGetSubMat(block, j, j, &inner));
      PetscCall(IsAbsent(inner, &is));
      absent += is;
    }
    *hides = (PetscBool)(absent > 0 && absent < mr);
    if (!*hides && !absent) PetscCall(AinsworthNestHides(block, hides));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthNestFlatten - gets the fields of all nested diagonal blocks, in the numbering of the whole matrix */
PetscErrorCode AinsworthNestFlatten(Mat nest, AinsworthFields *fields)
{
  AinsworthFields outer, inner;

  PetscFunctionBegin;
  PetscCall(AinsworthNestGetFields(nest, &outer));
  fields->clear();
  for (size_t i = 0; i < outer.size(); i++) {
    Mat       block;
    PetscInt  nr = 0, nc = 0;
    PetscBool is = PETSC_FALSE;

    PetscCall(MatNestGetSubMat(nest, (PetscInt)i, (PetscInt)i, &block));
    if (block) PetscCall(PetscObjectTypeCompare((PetscObject)block, MATNEST, &is));
    if (is) PetscCall(MatNestGetSize(block, &nr, &nc));
    if (nr < 2 || nr != nc) {
      fields->push_back(outer[i]);
      continue;
    }
    PetscCall(AinsworthNestFlatten(block, &inner));
    for (const AinsworthField &part : inner) {
      IS rows, cols;

      PetscCall(ISCreateSubIS(outer[i].rows, part.rows, &rows));
      PetscCall(ISCreateSubIS(outer[i].cols, part.cols, &cols));
      fields->push_back({outer[i].name + "." + part.name, AinsworthOwn(rows), AinsworthOwn(cols)});
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthNestGetPartState - computes one state for some rows and columns of blocks and all they are made of; 0 if all
   are absent
*/
PetscErrorCode AinsworthNestGetPartState(Mat nest, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &cols,
                                         uint64_t *state)
{
  uint64_t all = 0, any = 0;

  PetscFunctionBegin;
  for (PetscInt i : rows) {
    for (PetscInt j : cols) {
      Mat      block;
      uint64_t one;

      PetscCall(MatNestGetSubMat(nest, i, j, &block));
      PetscCall(AinsworthMatGetState(block, &one));
      all = AinsworthMixState(all, one);
      any |= one;
    }
  }
  *state = any ? all : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a matrix without entries, which gives a nest the sizes of an otherwise absent row or column */
static PetscErrorCode CreateEmpty(IS rows, IS cols, Mat *empty)
{
  PetscInt m, n;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(rows, &m));
  PetscCall(ISGetLocalSize(cols, &n));
  PetscCall(
    MatCreateAIJ(PetscObjectComm((PetscObject)rows), m, n, PETSC_DETERMINE, PETSC_DETERMINE, 0, NULL, 0, NULL, empty));
  PetscCall(MatAssemblyBegin(*empty, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*empty, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthNestGetPart - gets some rows and columns of blocks: a single block itself, several as a nest, NULL if all
   are absent; to be destroyed. Collective
*/
PetscErrorCode AinsworthNestGetPart(Mat nest, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &cols,
                                    Mat *part)
{
  const size_t     nr = rows.size(), nc = cols.size();
  AinsworthFields  fields;
  std::vector<Mat> blocks(nr * nc, NULL);
  PetscBool        none = PETSC_TRUE;

  PetscFunctionBegin;
  *part = NULL;
  for (size_t k = 0; k < nr * nc; k++) {
    PetscCall(MatNestGetSubMat(nest, rows[k / nc], cols[k % nc], &blocks[k]));
    PetscCall(PetscObjectReference((PetscObject)blocks[k]));
    if (blocks[k]) none = PETSC_FALSE;
  }
  if (none) PetscFunctionReturn(PETSC_SUCCESS);
  if (nr * nc == 1) {
    *part = blocks[0];
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthNestGetFields(nest, &fields));
  auto fill = [&](size_t i, size_t j) {
    if (blocks[i * nc + j]) return PETSC_SUCCESS;
    return CreateEmpty(fields[rows[i]].rows, fields[cols[j]].cols, &blocks[i * nc + j]);
  };
  for (bool row : {true, false}) {
    for (size_t i = 0; i < (row ? nr : nc); i++) {
      bool empty = true;

      for (size_t j = 0; j < (row ? nc : nr); j++) empty = empty && !blocks[row ? i * nc + j : j * nc + i];
      if (empty) PetscCall(row ? fill(i, 0) : fill(0, i));
    }
  }
  PetscCall(
    MatCreateNest(PetscObjectComm((PetscObject)nest), (PetscInt)nr, NULL, (PetscInt)nc, NULL, blocks.data(), part));
  for (Mat &block : blocks) PetscCall(MatDestroy(&block));
  PetscFunctionReturn(PETSC_SUCCESS);
}
