#include "subspace.h"
#include "../base/lists.h"
#include <algorithm>

static const char innerName[] = "AinsworthProjected"; /* the preconditioner that is projected */

/* order: the local rows of the matrix node by node, empty if they are stored so */
AinsworthLevelSubspace::AinsworthLevelSubspace(const std::shared_ptr<const AinsworthSubspace> &given,
                                               const std::vector<PetscInt>                    &order)
  : space(given), at(given->places)
{
  const std::vector<PetscInt> place = AinsworthInverse(order);

  for (PetscInt &l : at) l = order.empty() ? l : place[l];
}

/* Replaces x, a multivector, by Q x or Q' x. Collective */
PetscErrorCode AinsworthLevelSubspace::project(bool adjoint, PetscInt width, Vec x) const
{
  PetscScalar *a;

  PetscFunctionBegin;
  PetscCall(VecGetArray(x, &a));
  PetscCall(project(
    adjoint, width, [=](PetscInt l, PetscInt j) { return a[l * width + j]; },
    [=](PetscInt l, PetscInt j, PetscScalar v) { a[l * width + j] = v; }));
  PetscCall(VecRestoreArray(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* A preconditioner M of the smoother, applied as Q M^{-1} Q' */
struct Projected {
  std::shared_ptr<const AinsworthLevelSubspace> subspace;
  PetscInt                                      width = 1;
  PC                                            inner = NULL; /* referenced by the wrapper */
  Vec                                           force = NULL;

  /* Zeroes the entries that have no weight */
  PetscErrorCode leave(Vec x) const
  {
    PetscScalar *a;

    PetscFunctionBegin;
    PetscCall(VecGetArray(x, &a));
    for (size_t k = 0; k < subspace->at.size(); k++)
      if (subspace->space->weight[k] == 0.0) std::fill_n(a + subspace->at[k] * width, width, PetscScalar(0.0));
    PetscCall(VecRestoreArray(x, &a));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};
} // namespace

static PetscErrorCode Apply(PC pc, Vec r, Vec z)
{
  Projected *data;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  if (!data->force) PetscCall(VecDuplicate(r, &data->force));
  PetscCall(VecCopy(r, data->force));
  PetscCall(data->subspace->project(true, data->width, data->force));
  PetscCall(data->leave(data->force));
  PetscCall(PCApply(data->inner, data->force, z));
  PetscCall(data->leave(z));
  PetscCall(data->subspace->project(false, data->width, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(PC pc)
{
  Projected *data;

  PetscFunctionBegin;
  PetscCall(PCShellGetContext(pc, &data));
  PetscCall(VecDestroy(&data->force));
  delete data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthSubspacePCGetInner - gets the wrapped preconditioner, or one that wraps none itself */
PetscErrorCode AinsworthSubspacePCGetInner(PC pc, PC *inner)
{
  PC found;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)pc, innerName, (PetscObject *)&found));
  *inner = found ? found : pc;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode View(PC pc, PetscViewer viewer)
{
  PC inner = NULL;

  PetscFunctionBegin;
  PetscCall(AinsworthSubspacePCGetInner(pc, &inner));
  PetscCall(PCView(inner, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSubspacePCWrap - creates a PCSHELL with a name that wraps a preconditioner, which it references; the caller
   sets what it does. Collective
*/
PetscErrorCode AinsworthSubspacePCWrap(PC inner, const char name[], PC *pc)
{
  Mat A, P;

  PetscFunctionBegin;
  PetscCall(PCCreate(PetscObjectComm((PetscObject)inner), pc));
  PetscCall(PCSetType(*pc, PCSHELL));
  PetscCall(PCShellSetName(*pc, name));
  PetscCall(PCShellSetView(*pc, View));
  PetscCall(PCGetOperators(inner, &A, &P));
  PetscCall(PCSetOperators(*pc, A, P));
  PetscCall(PetscObjectCompose((PetscObject)*pc, innerName, (PetscObject)inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSubspacePCCreate - creates Q M^{-1} Q', for multivectors of a width, from the preconditioner M, which is
   referenced. Collective
*/
PetscErrorCode AinsworthSubspacePCCreate(const std::shared_ptr<const AinsworthLevelSubspace> &subspace, PetscInt width,
                                         PC inner, PC *pc)
{
  PetscFunctionBegin;
  PetscCall(AinsworthSubspacePCWrap(inner, "projected onto Ker C", pc));
  PetscCall(PCShellSetContext(*pc, new Projected{subspace, width, inner, NULL}));
  PetscCall(PCShellSetApply(*pc, Apply));
  PetscCall(PCShellSetDestroy(*pc, Destroy));
  PetscFunctionReturn(PETSC_SUCCESS);
}
