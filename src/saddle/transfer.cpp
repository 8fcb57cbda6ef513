/* Transfers between the program's vectors, which may be nested, and their parts; all that it takes is made once for vectors of the same shape */
#include "transfer.h"
#include "../base/lists.h"
#include "../base/objects.h"
#include <numeric>

/* Finds the plain vectors that v consists of, the nests, and the shape */
static PetscErrorCode Look(AinsworthTransfer *t, Vec v)
{
  PetscBool nest;
  PetscInt  n;
  Vec      *part;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, &nest));
  if (nest) {
    PetscCall(VecNestGetSubVecs(v, &n, &part));
    t->seen.push_back(-n);
    for (PetscInt i = 0; i < n; i++) PetscCall(Look(t, part[i]));
    t->nests.push_back(v);
  } else {
    PetscCall(VecGetSize(v, &n));
    t->seen.push_back(n);
    t->leaves.push_back(v);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* Where entries are: the leaf, and the global number in it */
struct Sources {
  std::vector<PetscInt> leaf, number;
};
} // namespace

/*
   Finds where the entries of the vectors of mat (left ones if rows) are in v, whose entries have the numbers `place` there; leaf: the first one of v

   The index sets of a MatNest determine the places; they need not be in the order of its blocks. A v without this structure is taken in order.
*/
static PetscErrorCode FindSources(Mat mat, PetscBool rows, Vec v, const PetscInt place[], PetscInt *leaf, Sources *sources)
{
  PetscBool nest, nested = PETSC_FALSE;
  PetscInt  n, nr = 0, nc = 0, first, end, at = 0;
  Vec      *part;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)v, VECNEST, &nest));
  if (!nest) {
    PetscCall(VecGetOwnershipRange(v, &first, &end));
    for (PetscInt k = first; k < end; k++) {
      sources->leaf[place[k - first]]   = *leaf;
      sources->number[place[k - first]] = k;
    }
    ++*leaf;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecNestGetSubVecs(v, &n, &part));
  if (mat) PetscCall(PetscObjectTypeCompare((PetscObject)mat, MATNEST, &nested));
  if (nested) PetscCall(MatNestGetSize(mat, &nr, &nc));
  std::vector<IS> sets((size_t)(rows ? nr : nc));
  if (nested) PetscCall(MatNestGetISs(mat, rows ? sets.data() : NULL, rows ? NULL : sets.data()));
  if (nested) PetscCall(rows ? MatGetOwnershipRange(mat, &first, NULL) : MatGetOwnershipRangeColumn(mat, &first, NULL));
  for (PetscInt i = 0; i < n; i++) {
    PetscInt              local;
    Mat                   block = NULL;
    std::vector<PetscInt> inner;

    PetscCall(VecGetLocalSize(part[i], &local));
    if ((PetscInt)sets.size() == n) {
      const PetscInt *index;

      PetscCall(ISGetIndices(sets[i], &index));
      for (PetscInt k = 0; k < local; k++) inner.push_back(place[index[k] - first]);
      PetscCall(ISRestoreIndices(sets[i], &index));
      for (PetscInt j = 0; j < (rows ? nc : nr) && !block; j++) PetscCall(MatNestGetSubMat(mat, rows ? i : j, rows ? j : i, &block));
    } else inner.assign(place + at, place + at + local);
    at += local;
    PetscCall(FindSources(block, rows, part[i], inner.data(), leaf, sources));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the leaf in which the entries are next to each other, on all ranks, and the place there; leaf is -1 if there is none. Collective */
static PetscErrorCode FindView(const AinsworthTransfer *t, const Sources &from, PetscInt *leaf, PetscInt *offset)
{
  const size_t n        = from.leaf.size();
  PetscInt     known[3] = {n ? from.leaf[0] : 0, n ? -from.leaf[0] : PETSC_MIN_INT, 0}, first, end; /* the last leaf, the first one, whether it is no view */
  PetscBool    host;

  PetscFunctionBegin;
  *leaf   = -1;
  *offset = 0;
  if (n) {
    PetscCall(VecGetOwnershipRange(t->leaves[from.leaf[0]], &first, &end));
    PetscCall(PetscObjectTypeCompareAny((PetscObject)t->leaves[from.leaf[0]], &host, VECSEQ, VECMPI, ""));
    *offset  = from.number[0] - first;
    known[2] = !host || from.number[0] < first || from.number[n - 1] >= end;
    for (size_t k = 1; k < n; k++)
      if (from.leaf[k] != from.leaf[0] || from.number[k] != from.number[k - 1] + 1) known[2] = 1;
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, known, 3, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)t->given)));
  if (!known[2] && (known[1] == PETSC_MIN_INT || known[0] == -known[1])) *leaf = known[0];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the scatters of a copy */
static PetscErrorCode CreateScatters(const AinsworthTransfer *t, const Sources &from, AinsworthTransfer::Part *part)
{
  PetscInt first;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(part->vec, &first, NULL));
  for (size_t leaf = 0; leaf < t->leaves.size(); leaf++) {
    std::vector<PetscInt> there, here;
    IS                    source, target;
    VecScatter            scatter = NULL;
    PetscInt              some;

    for (size_t k = 0; k < from.leaf.size(); k++) {
      if (from.leaf[k] != (PetscInt)leaf) continue;
      there.push_back(from.number[k]);
      here.push_back(first + (PetscInt)k);
    }
    some = !here.empty();
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &some, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)t->given)));
    if (some) {
      PetscCall(ISCreateGeneral(PETSC_COMM_SELF, (PetscInt)there.size(), there.data(), PETSC_USE_POINTER, &source));
      PetscCall(ISCreateGeneral(PETSC_COMM_SELF, (PetscInt)here.size(), here.data(), PETSC_USE_POINTER, &target));
      PetscCall(VecScatterCreate(t->leaves[leaf], source, part->vec, target, &scatter));
      PetscCall(ISDestroy(&source));
      PetscCall(ISDestroy(&target));
    }
    part->scatters.push_back(scatter);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the vector of a part, which is a view where possible; field NULL: the part is all of the given vector. Collective */
static PetscErrorCode CreatePart(const AinsworthTransfer *t, const Sources &sources, IS field, AinsworthTransfer::Part *part)
{
  MPI_Comm              comm = PetscObjectComm((PetscObject)t->given);
  PetscMPIInt           size;
  std::vector<PetscInt> places;
  PetscLayout           layout;
  PetscInt              n;
  Sources               from = sources;
  VecType               type;

  PetscFunctionBegin;
  if (field) {
    PetscCall(AinsworthISToList(field, &places));
    n = (PetscInt)places.size();
    PetscCall(VecGetLayout(t->given, &layout));
    PetscCall(AinsworthFetch(comm, layout, sources.leaf, n, places.data(), &from.leaf));
    PetscCall(AinsworthFetch(comm, layout, sources.number, n, places.data(), &from.number));
  }
  n = (PetscInt)from.leaf.size();
  PetscCall(FindView(t, from, &part->leaf, &part->offset));
  if (part->leaf >= 0) {
    PetscCallMPI(MPI_Comm_size(comm, &size));
    if (size == 1) PetscCall(VecCreateSeqWithArray(comm, 1, n, NULL, &part->vec));
    else PetscCall(VecCreateMPIWithArray(comm, 1, n, PETSC_DETERMINE, NULL, &part->vec));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecGetType(t->leaves[0], &type));
  PetscCall(VecCreate(comm, &part->vec));
  PetscCall(VecSetSizes(part->vec, n, PETSC_DETERMINE));
  PetscCall(VecSetType(part->vec, type));
  PetscCall(CreateScatters(t, from, part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Create(AinsworthTransfer *t, Mat mat, const IS fields[])
{
  std::vector<PetscInt> places;
  PetscInt              n, leaf = 0;
  Sources               sources;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(t->given, &n));
  places.resize(n);
  std::iota(places.begin(), places.end(), 0);
  sources = {places, places};
  PetscCall(FindSources(mat, t->rows, t->given, places.data(), &leaf, &sources));
  if (!fields) PetscCall(CreatePart(t, sources, NULL, &t->part[0]));
  for (int k = 0; k < 2 && fields; k++) {
    PetscCall(AinsworthShare(fields[k], &t->fields[k]));
    PetscCall(CreatePart(t, sources, fields[k], &t->part[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthTransferIn - gets the parts of a vector; call AinsworthTransferOut() afterwards. Collective

   mat, rows: its left vectors, or right ones, may be nests like v, and have the numbering of the fields; NULL: v is in order. fields: of both parts; NULL: there
   is one part, all of v as a plain vector. write: the parts may be changed.
*/
PetscErrorCode AinsworthTransferIn(AinsworthTransfer *t, Mat mat, PetscBool rows, const IS fields[], PetscBool write, Vec v, AinsworthSaddleVec *parts)
{
  PetscObjectId id   = 0;
  bool          same = !t->given && t->part[0].vec && t->rows == rows; /* an error may have left a vector given */

  PetscFunctionBegin;
  t->leaves.clear();
  t->nests.clear();
  t->seen.clear();
  PetscCall(Look(t, v));
  if (mat) PetscCall(PetscObjectGetId((PetscObject)mat, &id));
  for (int k = 0; k < 2; k++) same = same && t->fields[k] == (fields ? fields[k] : NULL);
  if (!same || t->mat != id || t->shape != t->seen) {
    PetscCall(AinsworthTransferDestroy(t));
    PetscCall(Look(t, v));
    t->mat   = id;
    t->rows  = rows;
    t->shape = t->seen;
    t->given = v;
    PetscCall(Create(t, mat, fields));
  }
  t->given = v;
  t->write = write;
  for (int k = 0; k < 2; k++) {
    AinsworthTransfer::Part &part = t->part[k];

    if (!part.vec) continue;
    if (part.leaf >= 0) {
      PetscScalar *array;

      if (write) {
        PetscCall(VecGetArray(t->leaves[part.leaf], &array));
        t->array[k] = array;
      } else PetscCall(VecGetArrayRead(t->leaves[part.leaf], &t->array[k]));
      PetscCall(VecPlaceArray(part.vec, t->array[k] + part.offset));
    }
    for (size_t leaf = 0; leaf < part.scatters.size(); leaf++) {
      if (!part.scatters[leaf]) continue;
      PetscCall(VecScatterBegin(part.scatters[leaf], t->leaves[leaf], part.vec, INSERT_VALUES, SCATTER_FORWARD));
      PetscCall(VecScatterEnd(part.scatters[leaf], t->leaves[leaf], part.vec, INSERT_VALUES, SCATTER_FORWARD));
    }
    if (!write) PetscCall(VecLockReadPush(part.vec));
  }
  *parts = {t->part[0].vec, t->part[1].vec};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthTransferOut - gives the parts back, and their entries to the vector if they may have been changed. Collective */
PetscErrorCode AinsworthTransferOut(AinsworthTransfer *t, AinsworthSaddleVec *parts)
{
  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    AinsworthTransfer::Part &part = t->part[k];

    if (!part.vec) continue;
    if (!t->write) PetscCall(VecLockReadPop(part.vec));
    if (part.leaf >= 0) {
      PetscScalar *array = (PetscScalar *)t->array[k];

      PetscCall(VecResetArray(part.vec));
      if (t->write) PetscCall(VecRestoreArray(t->leaves[part.leaf], &array));
      else PetscCall(VecRestoreArrayRead(t->leaves[part.leaf], &t->array[k]));
    }
    for (size_t leaf = 0; leaf < part.scatters.size() && t->write; leaf++) {
      if (!part.scatters[leaf]) continue;
      PetscCall(VecScatterBegin(part.scatters[leaf], part.vec, t->leaves[leaf], INSERT_VALUES, SCATTER_REVERSE));
      PetscCall(VecScatterEnd(part.scatters[leaf], part.vec, t->leaves[leaf], INSERT_VALUES, SCATTER_REVERSE));
    }
  }
  for (Vec nest : t->nests)
    if (t->write) PetscCall(AinsworthStateIncrease((PetscObject)nest)); /* PETSc does not see changes of its parts */
  t->given = NULL;
  *parts   = {NULL, NULL};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthTransferDestroy(AinsworthTransfer *t)
{
  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    PetscCall(ISDestroy(&t->fields[k]));
    PetscCall(VecDestroy(&t->part[k].vec));
    for (VecScatter &scatter : t->part[k].scatters) PetscCall(VecScatterDestroy(&scatter));
  }
  *t = AinsworthTransfer();
  PetscFunctionReturn(PETSC_SUCCESS);
}
