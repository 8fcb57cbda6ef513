#include "watchedvec.h"
#include <petsc/private/matimpl.h>
#include <petsc/private/vecimpl.h>
#include <array>
#include <map>

static std::map<PetscInt, PetscInt> copies;
static PetscInt                     inside = 0; /* operations of the device that run now */
static struct _VecOps               native[2];  /* those of one rank, and of several */
static struct _MatOps               nativeMat;

struct Valid {
  bool host = true, device = true;
};
static std::map<PetscObjectId, Valid> valid;

static Valid &Find(Vec v)
{
  PetscObjectId id = 0;

  PetscCallAbort(PETSC_COMM_SELF, PetscObjectGetId((PetscObject)v, &id));
  return valid[id];
}

/* One side uses a vector; written: and changes it; fresh: all of it */
static void Use(Vec v, bool Valid::*here, bool written, bool fresh)
{
  Valid &now = Find(v);

  if (inside) return; /* a part of what was counted */
  if (!(now.*here) && !fresh) copies[v->map->N]++;
  if (written) now = {false, false};
  now.*here = true;
}

namespace
{
/* Which of its vectors an operation changes */
enum Output {
  NONE,
  FIRST,
  FIRST_WHOLE, /* whatever was in it */
  LAST_WHOLE
};

struct Inside {
  Inside() { inside++; }
  ~Inside() { inside--; }
};

template <Output O, class... A>
void UseAll(A... a)
{
  const std::array<Vec, sizeof...(A)> all = {a...};

  const size_t output = O == NONE ? all.size() : O == LAST_WHOLE ? all.size() - 1 : 0;

  for (size_t k = 0; k < all.size(); k++)
    if (all[k] && k != output) Use(all[k], &Valid::device, false, false);
  if (O != NONE) Use(all[output], &Valid::device, true, O != FIRST);
}
inline Vec OnlyVec(Vec v)
{
  return v;
}
template <class T>
Vec OnlyVec(T)
{
  return NULL;
}

/* An operation of PETSc's host vectors as one of the device */
template <class T, auto M, Output O>
struct OnDevice;
template <class... A, auto M, Output O>
struct OnDevice<PetscErrorCode (*_VecOps::*)(Vec, A...), M, O> {
  static PetscErrorCode call(Vec v, A... a)
  {
    UseAll<O>(v, OnlyVec(a)...);
    const Inside device;

    return (native[v->map->size > 1].*M)(v, a...);
  }
};
template <class... A, auto M, Output O>
struct OnDevice<PetscErrorCode (*_MatOps::*)(Mat, A...), M, O> {
  static PetscErrorCode call(Mat m, A... a)
  {
    UseAll<O>(OnlyVec(a)...);
    const Inside device;

    return (nativeMat.*M)(m, a...);
  }
};
} // namespace

template <Output O, auto M, class Ops>
static void Replace(Ops *ops)
{
  if (ops->*M) ops->*M = OnDevice<decltype(M), M, O>::call;
}

static PetscErrorCode GetArray(Vec v, PetscScalar **a)
{
  PetscFunctionBeginUser;
  Use(v, &Valid::host, true, false);
  *a = *(PetscScalar **)v->data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetArrayWrite(Vec v, PetscScalar **a)
{
  PetscFunctionBeginUser;
  Use(v, &Valid::host, true, true);
  *a = *(PetscScalar **)v->data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetArrayRead(Vec v, const PetscScalar **a)
{
  PetscFunctionBeginUser;
  Use(v, &Valid::host, false, false);
  *a = *(PetscScalar **)v->data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The memory of the device itself */
static PetscErrorCode GetArrayAndMemType(Vec v, PetscScalar **a, PetscMemType *type)
{
  PetscFunctionBeginUser;
  Use(v, &Valid::device, true, false);
  *a = *(PetscScalar **)v->data;
  if (type) *type = PETSC_MEMTYPE_HOST;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode GetArrayReadAndMemType(Vec v, const PetscScalar **a, PetscMemType *type)
{
  PetscFunctionBeginUser;
  Use(v, &Valid::device, false, false);
  *a = *(PetscScalar **)v->data;
  if (type) *type = PETSC_MEMTYPE_HOST;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode RestoreArray(Vec, PetscScalar **)
{
  return (PetscErrorCode)0;
}

static PetscErrorCode Duplicate(Vec v, Vec *w)
{
  PetscFunctionBeginUser;
  PetscCall(VecCreate(PetscObjectComm((PetscObject)v), w));
  PetscCall(VecSetLayout(*w, v->map));
  PetscCall(VecSetType(*w, VECWATCHED));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DuplicateVecs(Vec v, PetscInt n, Vec **all)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n, all));
  for (PetscInt k = 0; k < n; k++) PetscCall(Duplicate(v, *all + k));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Create(Vec v)
{
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCall(VecSetType(v, VECSTANDARD));
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)v), &size));
  native[size > 1] = *v->ops;
  Replace<NONE, &_VecOps::dot>(v->ops);
  Replace<NONE, &_VecOps::mdot>(v->ops);
  Replace<NONE, &_VecOps::norm>(v->ops);
  Replace<NONE, &_VecOps::tdot>(v->ops);
  Replace<FIRST, &_VecOps::scale>(v->ops);
  Replace<LAST_WHOLE, &_VecOps::copy>(v->ops);
  Replace<FIRST_WHOLE, &_VecOps::set>(v->ops);
  Replace<FIRST, &_VecOps::axpy>(v->ops);
  Replace<FIRST, &_VecOps::axpby>(v->ops);
  Replace<FIRST, &_VecOps::maxpy>(v->ops);
  Replace<FIRST, &_VecOps::aypx>(v->ops);
  Replace<FIRST_WHOLE, &_VecOps::waxpy>(v->ops);
  Replace<FIRST, &_VecOps::axpbypcz>(v->ops);
  Replace<FIRST_WHOLE, &_VecOps::pointwisemult>(v->ops);
  Replace<FIRST_WHOLE, &_VecOps::pointwisedivide>(v->ops);
  Replace<NONE, &_VecOps::max>(v->ops);
  Replace<NONE, &_VecOps::min>(v->ops);
  Replace<NONE, &_VecOps::dot_local>(v->ops);
  Replace<NONE, &_VecOps::norm_local>(v->ops);
  Replace<NONE, &_VecOps::mdot_local>(v->ops);
  Replace<FIRST, &_VecOps::reciprocal>(v->ops);
  Replace<FIRST, &_VecOps::conjugate>(v->ops);
  v->ops->duplicate               = Duplicate;
  v->ops->duplicatevecs           = DuplicateVecs;
  v->ops->getarray                = GetArray;
  v->ops->getarraywrite           = GetArrayWrite;
  v->ops->getarrayread            = GetArrayRead;
  v->ops->getarrayandmemtype      = GetArrayAndMemType;
  v->ops->getarraywriteandmemtype = GetArrayAndMemType;
  v->ops->getarrayreadandmemtype  = GetArrayReadAndMemType;
  v->ops->restorearrayandmemtype  = RestoreArray;
  PetscCall(PetscObjectChangeTypeName((PetscObject)v, VECWATCHED));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode WatchedRegister(void)
{
  PetscFunctionBeginUser;
  PetscCall(VecRegister(VECWATCHED, Create));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode WatchedSetMat(Mat mat)
{
  PetscFunctionBeginUser;
  nativeMat = *mat->ops;
  Replace<LAST_WHOLE, &_MatOps::mult>(mat->ops);
  Replace<LAST_WHOLE, &_MatOps::multadd>(mat->ops);
  Replace<LAST_WHOLE, &_MatOps::multtranspose>(mat->ops);
  Replace<LAST_WHOLE, &_MatOps::multtransposeadd>(mat->ops);
  PetscCall(MatSetVecType(mat, VECWATCHED));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt WatchedCopies(PetscInt length)
{
  const auto found = copies.find(length);

  return found == copies.end() ? 0 : found->second;
}
