/* The near null space of A: attached by the program, made of those of its parts, or of rigid-body modes */
#include "saddle.h"
#include "../base/layouts.h"
#include "../base/objects.h"
#include <string>
#include <vector>

/*
   Gets the near null space of A: attached to A or (as for PCFIELDSPLIT) to the index set of its field, or made of
   coordinates; borrowed, NULL if none
*/
PetscErrorCode AinsworthSaddleGetNearNullSpace(const AinsworthSaddleBlocks *sp, MatNullSpace *near)
{
  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(sp->block[AINSWORTH_BLOCK_A], near));
  if (!*near) PetscCall(PetscObjectQuery((PetscObject)sp->rows[0], "nearnullspace", (PetscObject *)near));
  if (!*near) *near = sp->modes;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Appends the near null space of a field as vectors of the whole matrix, zero elsewhere; to be destroyed. cols NULL: it
   is that of the whole matrix
*/
static PetscErrorCode AddModes(Mat mat, MatNullSpace near, IS cols, std::vector<Vec> *modes)
{
  PetscBool  constant;
  PetscInt   n, local;
  const Vec *given;

  PetscFunctionBegin;
  PetscCall(MatNullSpaceGetVecs(near, &constant, &n, &given));
  PetscCall(MatGetLocalSize(mat, NULL, &local));
  for (PetscInt i = 0; i < n + (constant ? 1 : 0); i++) {
    Vec v, part;

    PetscCall(VecCreateMPI(PetscObjectComm((PetscObject)mat), local, PETSC_DETERMINE, &v));
    part = v;
    if (cols) PetscCall(VecGetSubVector(v, cols, &part));
    if (i < n) PetscCall(AinsworthVecCopyEntries(given[i], part));
    else PetscCall(VecSet(part, 1.0));
    if (cols) PetscCall(VecRestoreSubVector(v, cols, &part));
    modes->push_back(v);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleAttachNearNullSpace - attaches a near null space to an A that was made of parts of mat. Collective

   It consists of those of these parts, or of the index sets of their fields; if there are none, of the primal part of
   that of mat.
*/
PetscErrorCode AinsworthSaddleAttachNearNullSpace(const AinsworthSaddleBlocks *found, Mat mat)
{
  Mat              A = found->block[AINSWORTH_BLOCK_A];
  MatNullSpace     near;
  std::string      name; /* source of the modes, for views */
  std::vector<Vec> modes, parts;

  PetscFunctionBegin;
  PetscCall(MatGetNearNullSpace(A, &near));
  if (near) PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t i = 0; i < found->fields.size(); i++) {
    Mat          block  = NULL;
    MatNullSpace rigid  = NULL;
    std::string *source = NULL;

    if (found->multiplier[i]) continue;
    near = NULL;
    if (!found->extracted) PetscCall(MatNestGetSubMat(mat, (PetscInt)i, (PetscInt)i, &block));
    if (block) PetscCall(MatGetNearNullSpace(block, &near));
    if (!near) PetscCall(PetscObjectQuery((PetscObject)found->fields[i].rows, "nearnullspace", (PetscObject *)&near));
    if (!near && block) PetscCall(AinsworthMatCreateRigidModes(block, &rigid));
    if (!near) near = rigid;
    if (near) PetscCall(AddModes(mat, near, found->fields[i].cols, &modes));
    if (near) PetscCall(AinsworthGetAttached((PetscObject)near, AinsworthModesSource, &source));
    if (source) name = *source;
    PetscCall(MatNullSpaceDestroy(&rigid));
  }
  PetscCall(MatGetNearNullSpace(mat, &near));
  if (modes.empty() && near) PetscCall(AddModes(mat, near, NULL, &modes));
  for (Vec &mode : modes) {
    Vec       v, part;
    PetscReal norm, rest;

    PetscCall(AinsworthCreateVecs(A, &v, NULL));
    PetscCall(VecGetSubVector(mode, found->cols[0], &part));
    PetscCall(AinsworthVecCopyEntries(part, v));
    PetscCall(VecRestoreSubVector(mode, found->cols[0], &part));
    PetscCall(VecDestroy(&mode));
    PetscCall(VecNorm(v, NORM_2, &norm));
    PetscCall(AinsworthOrthogonalize(parts, v));
    PetscCall(VecNormalize(v, &rest));
    if (rest > PETSC_SQRT_MACHINE_EPSILON * norm) parts.push_back(v);
    /* dependent on the others, as the primal part of a mode of the multipliers may be */
    else PetscCall(VecDestroy(&v));
  }
  if (parts.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(
    MatNullSpaceCreate(PetscObjectComm((PetscObject)A), PETSC_FALSE, (PetscInt)parts.size(), parts.data(), &near));
  if (!name.empty())
    PetscCall(AinsworthAttach((PetscObject)near, AinsworthModesSource, std::make_unique<std::string>(name)));
  PetscCall(MatSetNearNullSpace(A, near));
  PetscCall(MatNullSpaceDestroy(&near));
  for (Vec &v : parts) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthFindRigidModes - creates found->modes from PCSetCoordinates() or from the DM of A, or takes them from the
   last set-up if nothing they depend on has changed. Collective
*/
PetscErrorCode AinsworthFindRigidModes(const AinsworthSaddleInputs *in, Mat mat, const AinsworthSaddleBlocks *last,
                                       AinsworthSaddleBlocks *found)
{
  MatNullSpace near;

  PetscFunctionBegin;
  if (!in->dim) {
    PetscCall(AinsworthSaddleGetNearNullSpace(found, &near));
    if (!near) PetscCall(AinsworthMatCreateRigidModes(found->block[AINSWORTH_BLOCK_A], found->modes.out()));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  found->located = in->located;
  if (last && last->modes && last->located == in->located && last->rows[0] == found->rows[0] && last->bs == found->bs) {
    found->modes = last->modes;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (in->dim == 1 || found->bs != in->dim) {
    PetscCall(PetscInfo(
      mat, "Coordinates are of no use: they have %" PetscInt_FMT " components, a node has %" PetscInt_FMT " unknowns\n",
      in->dim, found->bs));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSaddleCreateRigidModes(in, mat, found, found->modes.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Describes the near null space in words, for views */
PetscErrorCode AinsworthSaddleDescribeModes(const AinsworthSaddle *sp, char text[], size_t len)
{
  MatNullSpace near;
  PetscBool    constant;
  PetscInt     n;
  std::string *source;

  PetscFunctionBegin;
  text[0] = 0;
  PetscCall(AinsworthSaddleGetNearNullSpace(sp, &near));
  if (!near) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNullSpaceGetVecs(near, &constant, &n, NULL));
  PetscCall(AinsworthGetAttached((PetscObject)near, AinsworthModesSource, &source));
  PetscCall(PetscSNPrintf(text, len, "%" PetscInt_FMT " vectors (%s)", n + (constant ? 1 : 0),
                          source ? source->c_str() : "MatSetNearNullSpace()"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
