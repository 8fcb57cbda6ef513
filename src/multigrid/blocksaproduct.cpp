/* A for products, with half of its blocks stored, whatever the order in which the levels have its unknowns */
#include "blocksaimpl.h"
#include "../base/layouts.h"
#include "../base/objects.h"
#include <numeric>

#define AINSWORTH_PRODUCT_MAT "blocksaproduct"

namespace
{
/* A, from the operator of the unknowns of the levels, of multivectors */
struct Ordered {
  AinsworthRef<Mat>     levels;
  std::vector<PetscInt> order; /* the local unknown of A that each one of the levels is; from n on it is none */
  PetscInt              n = 0, width = 1;
  AinsworthRef<Vec>     in, out;
};
} // namespace

template <bool transpose>
static PetscErrorCode MatMult_Ordered(Mat mat, Vec x, Vec y)
{
  Ordered           *P;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &P));
  const PetscInt width = P->width;
  if (!P->in) PetscCall(AinsworthCreateVecs(P->levels, P->in.out(), P->out.out()));
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArrayWrite(P->in, &to));
  for (PetscInt u : P->order)
    for (PetscInt k = 0; k < width; k++) *to++ = u < P->n ? from[u * width + k] : 0.0;
  to -= P->order.size() * width;
  PetscCall(VecRestoreArrayWrite(P->in, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscCall((transpose ? MatMultTranspose : MatMult)(P->levels, P->in, P->out));
  PetscCall(VecGetArrayRead(P->out, &from));
  PetscCall(VecGetArrayWrite(y, &to));
  for (size_t l = 0; l < P->order.size(); l++)
    for (PetscInt k = 0; k < width && P->order[l] < P->n; k++) to[P->order[l] * width + k] = from[l * width + k];
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscCall(VecRestoreArrayRead(P->out, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatDestroy_Ordered(Mat mat)
{
  Ordered *P;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &P));
  delete P;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the product with A, whose unknowns are those of `unknowns`, for multivectors; takes P over. Collective */
static PetscErrorCode CreateOrdered(PetscLayout unknowns, std::unique_ptr<Ordered> &&P, Mat *mat)
{
  MPI_Comm       comm  = PetscObjectComm((PetscObject)(Mat)P->levels);
  const PetscInt width = P->width;
  PetscLayout    layout;

  PetscFunctionBegin;
  PetscCall(AinsworthLayoutOfBlocks(comm, unknowns, width, width, &layout));
  PetscCall(AinsworthCreateShellOn(comm, layout, layout, P.release(), mat));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT, (void (*)(void))MatMult_Ordered<false>));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMult_Ordered<true>));
  PetscCall(MatShellSetOperation(*mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Ordered));
  PetscCall(PetscObjectChangeTypeName((PetscObject)*mat, AINSWORTH_PRODUCT_MAT));
  PetscCall(AinsworthLevelMatSetDefinite(*mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCBlockSAGetProduct_Private - gets A with half of its entries stored, for products, or NULL if there is no such
   matrix; borrowed, valid until A changes. Collective
*/
PetscErrorCode PCBlockSAGetProduct_Private(PC pc, Mat *product)
{
  PC_BlockSA *sa = NULL;
  PetscLayout unknowns;

  PetscFunctionBegin;
  *product = NULL;
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  if (!sa) PetscFunctionReturn(PETSC_SUCCESS);
  const AinsworthHierarchy *h = sa->levels.hierarchy.get();
  if (!sa->product && h && h->finest.exact()) {
    PetscCall(AinsworthGridCreateProduct(h->finest, &sa->product));
    if (h->sorted || (sa->subspace && sa->subspace->map)) {
      auto P = std::make_unique<Ordered>();

      *P->levels.out() = sa->product;
      sa->product      = NULL;
      P->order         = h->order;
      if (P->order.empty()) {
        P->order.resize(h->finest.nodes->n * h->finest.bs);
        std::iota(P->order.begin(), P->order.end(), 0);
      }
      PetscCall(MatGetLocalSize(pc->pmat, &P->n, NULL));
      PetscCall(MatGetLayouts(pc->pmat, &unknowns, NULL));
      PetscCall(CreateOrdered(unknowns, std::move(P), &sa->product));
    }
  }
  *product = sa->product;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthWidenMat - creates a matrix that multiplies multivectors by a level operator, by what
   PCBlockSAGetProduct_Private() gets, or by an AIJ matrix, whose entries it shares; NULL for other types. Collective
*/
PetscErrorCode AinsworthWidenMat(Mat mat, PetscInt width, Mat *wide)
{
  AinsworthLevel *level;
  PetscBool       aij, ordered;
  PetscInt        bs;

  PetscFunctionBegin;
  *wide = NULL;
  PetscCall(AinsworthLevelMatGet(mat, &level));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)mat, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(PetscObjectTypeCompare((PetscObject)mat, AINSWORTH_PRODUCT_MAT, &ordered));
  if (level) {
    PetscCall(MatGetBlockSize(mat, &bs));
    PetscCall(AinsworthLevelMatSet(level->nodes(), bs, level->widen(width), wide));
  } else if (ordered) {
    auto        P = std::make_unique<Ordered>();
    Ordered    *from;
    PetscLayout unknowns;

    PetscCall(MatShellGetContext(mat, &from));
    PetscCall(AinsworthWidenMat(from->levels, width, P->levels.out()));
    P->order = from->order;
    P->n     = from->n;
    P->width = width;
    PetscCall(MatGetLayouts(mat, &unknowns, NULL));
    PetscCall(CreateOrdered(unknowns, std::move(P), wide));
  } else if (aij) PetscCall(MatCreateMAIJ(mat, width, wide));
  PetscFunctionReturn(PETSC_SUCCESS);
}
