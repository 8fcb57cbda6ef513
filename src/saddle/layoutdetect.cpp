/* Detection of the multipliers in a plain matrix, from its diagonal */
#include "saddle.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"

/*
   AinsworthDetectFields - splits a plain matrix into a primal field and multipliers; raises an error if it is no
   saddle-point matrix. Collective

   Multipliers have no positive diagonal entry. If no row has one, except for Dirichlet conditions, the matrix is minus
   a saddle point, and multipliers have zeros. If all rows have one, the signs of the coupling entries decide.
*/
PetscErrorCode AinsworthDetectFields(Mat mat, AinsworthSaddleBlocks *found)
{
  MPI_Comm              comm = PetscObjectComm((PetscObject)mat);
  Vec                   diagonal, entries, side = NULL;
  PetscInt              first, size[2];
  PetscBool             opposite;
  PetscReal             least, most;
  std::vector<PetscInt> index[2];
  AinsworthRef<IS>      set[2];

  PetscFunctionBegin;
  PetscCall(AinsworthCheckAssembled(mat, "The matrix"));
  PetscCall(MatGetSize(mat, &size[0], &size[1]));
  PetscCheck(size[0] == size[1], comm, PETSC_ERR_ARG_SIZ,
             "The matrix is not square: %" PetscInt_FMT " x %" PetscInt_FMT, size[0], size[1]);
  PetscCall(AinsworthCreateDiagonal(mat, &diagonal));
  PetscCall(AinsworthVecClone(diagonal, &entries));
  PetscCall(AinsworthClassifyDiagonal(mat, entries));
  PetscCall(VecMax(entries, NULL, &most));
  opposite         = (PetscBool)(most <= AINSWORTH_ENTRY_PLAIN);
  found->definedBy = "by the diagonal";
  found->chosen    = "their diagonal entries are not positive";
  PetscCall(VecMin(diagonal, NULL, &least));
  if (least > 0.0 && !opposite) PetscCall(AinsworthFindSides(mat, &side));
  if (side) {
    PetscCall(VecDestroy(&diagonal));
    diagonal         = side;
    found->definedBy = "by signs";
    found->chosen    = "what couples them with the others has opposite signs on both sides";
  }
  if (!side && !opposite) PetscCall(AinsworthAlignFields(mat, entries));
  PetscCall(VecGetOwnershipRange(diagonal, &first, NULL));
  PetscCall(AinsworthForEntries({diagonal, entries}, [&](PetscInt i, PetscScalar d, PetscScalar entry) {
    index[opposite ? d == 0.0 : PetscRealPart(d) <= 0.0 || PetscRealPart(entry) < 0.0].push_back(first + i);
  }));
  PetscCall(VecDestroy(&entries));
  for (int k = 0; k < 2; k++) {
    IS is;

    PetscCall(ISCreateGeneral(comm, (PetscInt)index[k].size(), index[k].data(), PETSC_COPY_VALUES, &is));
    PetscCall(ISGetSize(is, &size[k]));
    set[k] = AinsworthOwn(is);
  }
  found->fields = {
    {"primal",      set[0], set[0]},
    {"multipliers", set[1], set[1]}
  };
  found->multiplier = {false, true};
  PetscCheck(size[0] && size[1], comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH found no saddle point in the matrix of type %s: %s; name the fields by PCFieldSplitSetIS(), "
             "the rows of the multipliers by -pc_ainsworth_multiplier_rows, or pass a MatNest, [A C'; C 0]",
             found->type,
             !size[0]   ? "its diagonal is zero"
             : opposite ? "every diagonal entry is negative"
                        : "every diagonal entry is positive");
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthCheckDetected - raises an error if a multiplier row with a zero diagonal entry is coupled to another one: it
   may be a primal row. Collective
*/
PetscErrorCode AinsworthCheckDetected(const AinsworthSaddleBlocks *found)
{
  Mat                   D    = found->block[AINSWORTH_BLOCK_D];
  MPI_Comm              comm = PetscObjectComm((PetscObject)D);
  std::vector<PetscInt> numbers;
  PetscInt              bad = -1;

  PetscFunctionBegin;
  PetscCall(AinsworthISToList(found->rows[1], &numbers));
  PetscCall(AinsworthForRows(D, [&](const AinsworthMatRow &row) {
    bool coupled = false, diagonal = false;

    for (PetscInt k = 0; k < row.n; k++) (row.j[k] == row.number ? diagonal : coupled) |= row.a[k] != 0.0;
    if (coupled && !diagonal && bad < 0) bad = numbers[row.local];
  }));
  PetscCall(AinsworthAgreeOnFirst(comm, &bad));
  PetscCheck(bad < 0, comm, PETSC_ERR_ARG_WRONG,
             "PCAINSWORTH cannot tell the multipliers by the diagonal of the matrix of type %s: row %" PetscInt_FMT
             " has a zero on it and is coupled with another row that has no positive entry there; name the fields by "
             "PCFieldSplitSetIS(), or the rows of the multipliers by -pc_ainsworth_multiplier_rows",
             found->type, bad);
  PetscFunctionReturn(PETSC_SUCCESS);
}
