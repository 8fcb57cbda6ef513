/*
   Chooses the multiplier fields by the sign and the shape of their diagonal blocks, or as
   -pc_ainsworth_multiplier_fields says
*/
#include "saddle.h"
#include "../base/loops.h"

/* Kind of a field, in ascending order for reductions with MPI_MAX */
enum Kind {
  EMPTY, /* its diagonal block is absent or zero */
  NEGATIVE /* no entry of its diagonal is positive */,
  POSITIVE
};

/* Gets the diagonal block of a field, from a MatNest or extracted; to be destroyed */
static PetscErrorCode GetDiagonalBlock(Mat mat, const AinsworthSaddleBlocks *found, PetscInt i, Mat *block)
{
  Mat whole;

  PetscFunctionBegin;
  if (!found->extracted) {
    PetscCall(MatNestGetSubMat(mat, i, i, block));
    PetscCall(PetscObjectReference((PetscObject)*block));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthGetAIJ(mat, &whole));
  PetscCall(MatCreateSubMatrix(whole, found->fields[i].rows, found->fields[i].cols, MAT_INITIAL_MATRIX, block));
  PetscCall(MatDestroy(&whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the kind of a field from the diagonal of its block, at least `otherwise`, which is NEGATIVE for a nonzero block
   of a MatNest. Collective
*/
static PetscErrorCode LookAtDiagonal(Vec d, Kind otherwise, Kind *kind)
{
  PetscInt seen = EMPTY;

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({d}, [&](PetscInt, PetscScalar a) {
    if (!(PetscRealPart(a) <= 0.0)) seen = POSITIVE; /* positive or NaN */
    else if (a != 0.0) seen = PetscMax(seen, NEGATIVE);
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &seen, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)d)));
  *kind = PetscMax((Kind)seen, otherwise);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LookAtNest(Mat nest, std::vector<Kind> *kinds)
{
  PetscInt n = (PetscInt)kinds->size(), present = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++) {
    char      name[64];
    Mat       block;
    PetscBool zero;

    PetscCall(MatNestGetSubMat(nest, i, i, &block));
    PetscCall(PetscSNPrintf(name, sizeof(name), "Block (%" PetscInt_FMT ",%" PetscInt_FMT ") of the MatNest", i, i));
    PetscCall(AinsworthCheckAssembled(block, name));
    PetscCall(AinsworthIsZero(block, &zero));
    (*kinds)[i] = zero ? EMPTY : POSITIVE;
    present += !zero;
  }
  for (PetscInt i = 0; i < n && present > 1; i++) { /* if there is only one, it is A */
    Mat       block;
    Vec       d;
    PetscBool has;
    PetscInt  rows, cols;

    if ((*kinds)[i] == EMPTY) continue;
    PetscCall(MatNestGetSubMat(nest, i, i, &block));
    PetscCall(MatHasOperation(block, MATOP_GET_DIAGONAL, &has));
    PetscCall(MatGetSize(block, &rows, &cols));
    if (!has || rows != cols) continue;
    PetscCall(AinsworthCreateDiagonal(block, &d));
    PetscCall(LookAtDiagonal(d, NEGATIVE, &(*kinds)[i]));
    PetscCall(VecDestroy(&d));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LookAtMatrix(Mat mat, const AinsworthFields &fields, std::vector<Kind> *kinds)
{
  Vec diagonal, d;

  PetscFunctionBegin;
  PetscCall(AinsworthCheckAssembled(mat, "The matrix"));
  PetscCall(AinsworthCreateDiagonal(mat, &diagonal));
  for (size_t i = 0; i < fields.size(); i++) {
    PetscCall(VecGetSubVector(diagonal, fields[i].rows, &d));
    PetscCall(LookAtDiagonal(d, EMPTY, &(*kinds)[i]));
    PetscCall(VecRestoreSubVector(diagonal, fields[i].rows, &d));
  }
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Chooses the multipliers among fields that all have positive diagonal entries, or all have none: those whose diagonal
   block is diagonal

   If both of two fields are diagonal, or neither is, chooses the smaller field; the last one if they have the same
   size.
*/
static PetscErrorCode ChooseByShape(Mat mat, AinsworthSaddleBlocks *found)
{
  MPI_Comm       comm     = PetscObjectComm((PetscObject)mat);
  const PetscInt n        = (PetscInt)found->fields.size();
  PetscInt       diagonal = 0, smaller, size[2];

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++) {
    Mat       block;
    MatType   type;
    PetscBool has;
    PetscInt  row, col;

    PetscCall(GetDiagonalBlock(mat, found, i, &block));
    PetscCall(MatHasOperation(block, MATOP_GET_ROW, &has));
    PetscCall(MatGetType(block, &type));
    PetscCheck(has, comm, PETSC_ERR_ARG_WRONG,
               "PCAINSWORTH found no multipliers: the diagonal blocks of all fields are nonzero, and the type %s of "
               "(%" PetscInt_FMT ",%" PetscInt_FMT ") has no rows to look at; leave the block of the multipliers "
               "absent, pass an AIJ matrix, or use -pc_ainsworth_multiplier_fields",
               type, i, i);
    auto isCoupling = [](PetscInt r, PetscInt c, PetscScalar v) { return r != c && v != 0.0; };
    PetscCall(AinsworthMatFindEntry(block, isCoupling, &row, &col));
    PetscCall(MatDestroy(&block));
    found->multiplier[i] = row < 0;
    diagonal += row < 0;
  }
  found->chosen = "their diagonal block is diagonal";
  if (diagonal && diagonal < n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(n == 2, comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no multipliers: the diagonal blocks of all %" PetscInt_FMT
             " fields have positive entries, and %s of them is diagonal; -pc_ainsworth_multiplier_fields tells which "
             "are the multipliers'",
             n, diagonal ? "each" : "none");
  for (int i = 0; i < 2; i++) PetscCall(ISGetSize(found->fields[i].rows, &size[i]));
  smaller           = size[0] < size[1] ? 0 : 1;
  found->multiplier = {smaller == 0, smaller == 1};
  found->chosen     = "both diagonal blocks have positive entries, theirs is not the larger one";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses the fields named by an option */
static PetscErrorCode ChooseNamed(MPI_Comm comm, const AinsworthSaddleInputs *in, AinsworthSaddleBlocks *found)
{
  const size_t n     = found->fields.size();
  size_t       count = 0;
  std::string  known;

  PetscFunctionBegin;
  for (const AinsworthField &field : found->fields) known += (known.empty() ? "" : ", ") + field.name;
  found->multiplier.assign(n, false);
  for (const std::string &name : in->multipliers) {
    size_t i = 0;

    while (i < n && found->fields[i].name != name) i++;
    if (i == n && name.find_first_not_of("0123456789") == std::string::npos && name.size() < 9) i = std::stoul(name);
    PetscCheck(i < n, comm, PETSC_ERR_ARG_OUTOFRANGE,
               "-pc_ainsworth_multiplier_fields names field %s; there are %" PetscInt_FMT ", from 0 on: %s",
               name.c_str(), (PetscInt)n, known.c_str());
    found->multiplier[i] = true;
  }
  for (size_t i = 0; i < n; i++) count += found->multiplier[i];
  PetscCheck(count < n, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_multiplier_fields leaves no primal field: it names all of %s", known.c_str());
  found->chosen = "-pc_ainsworth_multiplier_fields";
  found->blame  = "; -pc_ainsworth_multiplier_fields says which fields are the multipliers': does it name those of x?";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthChooseMultipliers - sets found->multiplier for the fields of mat. Collective */
PetscErrorCode AinsworthChooseMultipliers(const AinsworthSaddleInputs *in, Mat mat, AinsworthSaddleBlocks *found)
{
  MPI_Comm          comm     = PetscObjectComm((PetscObject)mat);
  const size_t      n        = found->fields.size();
  PetscInt          count[3] = {0, 0, 0};
  std::vector<Kind> kinds(n, EMPTY);

  PetscFunctionBegin;
  if (!in->multipliers.empty()) {
    PetscCall(ChooseNamed(comm, in, found));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  found->multiplier.assign(n, false);
  if (in->chosenBy[0]) {
    found->multiplier.back() = true;
    found->chosen            = in->chosenBy;
    found->blame = "; -pc_ainsworth_multiplier_rows says which rows are the multipliers': does it name others?";
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (found->extracted) PetscCall(LookAtMatrix(mat, found->fields, &kinds));
  else PetscCall(LookAtNest(mat, &kinds));
  for (Kind kind : kinds) count[kind]++;
  PetscCheck(count[EMPTY] < (PetscInt)n, comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no primal block: %s of the %s are %s zero, A must be one of them",
             n == 2 ? "blocks (0,0) and (1,1)" : "all diagonal blocks", found->extracted ? "matrix" : "MatNest",
             found->extracted ? "without a diagonal entry that is not" : "absent or");
  if (!count[EMPTY] && (!count[NEGATIVE] || !count[POSITIVE])) {
    PetscCall(ChooseByShape(mat, found));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  /* without a positive field, the negative one is -A */
  for (size_t i = 0; i < n; i++) found->multiplier[i] = kinds[i] == EMPTY || (kinds[i] == NEGATIVE && count[POSITIVE]);
  found->chosen = count[NEGATIVE] && count[POSITIVE] ? "no diagonal entry of theirs is positive"
                                                     : "their diagonal block is zero";
  PetscFunctionReturn(PETSC_SUCCESS);
}
