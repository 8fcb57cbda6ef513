#include "levelmat.h"
#include "../base/layouts.h"

namespace
{
/* An interpolation with its work space */
struct Part {
  std::shared_ptr<const AinsworthInterpolation> P;
  std::vector<PetscScalar>                      ghost;

  void set(const std::shared_ptr<const AinsworthInterpolation> &I, PetscInt width)
  {
    P = I;
    ghost.assign(I ? I->cols.ghosts.size() * I->rows.bc * width : 0, 0.0);
  }
};

/*
   Interpolation P + added of multivectors, where `added` has few rows or is absent; unit: the values of a coarse node
*/
struct InterpolationMat {
  const PetscInt                                width;
  Part                                          main, added;
  std::shared_ptr<const AinsworthLevelSubspace> subspace; /* of the finer level; NULL: the whole space */
  AinsworthUnit                                 unit;

  InterpolationMat(const std::shared_ptr<const AinsworthInterpolation> &I, PetscInt vectors)
    : width(vectors), unit(I->rows.bc * vectors, MPIU_SCALAR)
  {
    main.set(I, width);
  }
};

template <bool adjoint, int R, int C, int W, class T>
AINSWORTH_CLONES void MultTranspose(const AinsworthInterpolation &P, const T *a, const PetscScalar *x,
                                    PetscScalar *ghost, PetscScalar *y)
{
  const PetscInt br = R ? R : P.rows.br, bc = C ? C : P.rows.bc;

  for (PetscInt i = 0; i < P.rows.n; i++, x += br * W)
    for (PetscInt k = P.rows.i[i]; k < P.rows.i[i + 1]; k++, a += br * bc) {
      const PetscInt j = P.rows.j[k];
      AinsworthPrefetch<R * C>(a);
      PetscScalar *z = j < P.cols.local ? y + (size_t)j * bc * W : ghost + (size_t)(j - P.cols.local) * bc * W;
      if constexpr (W > 1) AinsworthMultWideAdd<true, adjoint, R, C, W>(br, bc, a, x, z);
      else if constexpr (adjoint) {
        for (PetscInt r = 0; r < br; r++)
          for (PetscInt c = 0; c < bc; c++) z[c] += (PetscScalar)AinsworthConj(a[r * bc + c]) * x[r];
      } else AinsworthMultAdd<1, R, C>(1, br, bc, x, a, z);
    }
}
} // namespace

/* Computes y += P x. Collective */
template <int W>
static PetscErrorCode AddPart(Part *part, MPI_Datatype unit, const PetscScalar *x, PetscScalar *y)
{
  PetscFunctionBegin;
  if (!part->P) PetscFunctionReturn(PETSC_SUCCESS);
  const AinsworthInterpolation &P = *part->P;
  PetscCall(P.cols.toGhosts(unit, x, part->ghost.data()));
  AinsworthDispatch(P.rows.br, P.rows.bc, [&](auto R, auto C) {
    auto add = [&](const auto *a) {
      AinsworthRowsMultAdd<R(), C(), W>(P.rows, a, P.cols.local, x, part->ghost.data(), P.rows.bc * W, P.rows.br * W,
                                        y);
    };

    if (P.single.size()) add(P.single.data());
    else add(P.rows.a.data());
  });
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y += P^T x or, if adjoint, y += P' x. Collective */
template <bool adjoint, int W>
static PetscErrorCode AddPartTranspose(Part *part, MPI_Datatype unit, const PetscScalar *x, PetscScalar *y)
{
  PetscFunctionBegin;
  if (!part->P) PetscFunctionReturn(PETSC_SUCCESS);
  const AinsworthInterpolation &P = *part->P;
  std::fill(part->ghost.begin(), part->ghost.end(), 0.0);
  AinsworthDispatch(P.rows.br, P.rows.bc, [&](auto R, auto C) {
    if (P.single.size()) MultTranspose<adjoint, R(), C(), W>(P, P.single.data(), x, part->ghost.data(), y);
    else MultTranspose<adjoint, R(), C(), W>(P, P.rows.a.data(), x, part->ghost.data(), y);
  });
  if (P.cols.sf) {
    PetscCall(PetscSFReduceBegin(P.cols.sf, unit, part->ghost.data(), y, MPIU_SUM));
    PetscCall(PetscSFReduceEnd(P.cols.sf, unit, part->ghost.data(), y, MPIU_SUM));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = w + P x or, with a subspace that w is in, Q (w + P x); w may be y */
static PetscErrorCode MatMultAdd_Interpolation(Mat mat, Vec x, Vec w, Vec y)
{
  InterpolationMat  *I;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &I));
  if (w != y) PetscCall(VecCopy(w, y));
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArray(y, &to));
  for (Part *part : {&I->main, &I->added})
    PetscCall(AinsworthDispatchWidth(I->width, [&](auto W) { return AddPart<W()>(part, I->unit.type, from, to); }));
  PetscCall(VecRestoreArray(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  if (I->subspace) PetscCall(I->subspace->project(false, I->width, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMult_Interpolation(Mat mat, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(y));
  PetscCall(MatMultAdd_Interpolation(mat, x, y, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes y = P^T x or, if adjoint, y = P' x */
template <bool adjoint>
static PetscErrorCode MatMultTranspose_Interpolation(Mat mat, Vec x, Vec y)
{
  InterpolationMat  *I;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &I));
  PetscCall(VecZeroEntries(y));
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArray(y, &to));
  for (Part *part : {&I->main, &I->added})
    PetscCall(AinsworthDispatchWidth(
      I->width, [&](auto W) { return AddPartTranspose<adjoint, W()>(part, I->unit.type, from, to); }));
  PetscCall(VecRestoreArray(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Converts to AIJ, for users of PCGetInterpolations() */
static PetscErrorCode MatConvert_Interpolation_AIJ(Mat mat, MatType, MatReuse reuse, Mat *newmat)
{
  InterpolationMat *I;

  PetscFunctionBegin;
  PetscCheck(reuse == MAT_INITIAL_MATRIX, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP,
             "MatConvert() of interpolation makes a new matrix only");
  PetscCall(MatShellGetContext(mat, &I));
  const AinsworthInterpolation &P = *I->main.P;
  AinsworthBlockRows            rows(P.rows);
  if (P.single.size()) rows.a.assign(P.single.begin(), P.single.end());
  PetscCall(AinsworthBlocksToAIJ(rows, P.cols, mat, newmat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatDestroy_Interpolation(Mat mat)
{
  InterpolationMat *I;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &I));
  delete I;
  PetscCall(PetscObjectComposeFunction((PetscObject)mat, "MatConvert_" AINSWORTH_INTERPOLATION_MAT "_aij_C", NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthInterpolationMatSet - replaces the interpolation by one between the same nodes */
PetscErrorCode AinsworthInterpolationMatSet(Mat mat, const std::shared_ptr<const AinsworthInterpolation> &P)
{
  InterpolationMat *I;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &I));
  I->main.set(P, I->width);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthInterpolationMatSetSubspace - adds to the interpolation and keeps what is interpolated in a subspace, or
   (NULL) no longer
*/
PetscErrorCode AinsworthInterpolationMatSetSubspace(Mat                                                  mat,
                                                    const std::shared_ptr<const AinsworthLevelSubspace> &subspace,
                                                    const std::shared_ptr<const AinsworthInterpolation> &added)
{
  InterpolationMat *I;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &I));
  I->subspace = subspace;
  I->added.set(added, I->width);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthInterpolationMatCreate - creates a matrix that interpolates multivectors to the nodes of layout `fine`
*/
PetscErrorCode AinsworthInterpolationMatCreate(const std::shared_ptr<const AinsworthInterpolation> &P,
                                               const AinsworthLayout &fine, PetscInt width, Mat *mat)
{
  const PetscInt br = P->rows.br * width, bc = P->rows.bc * width;
  PetscLayout    rows, columns;

  PetscFunctionBegin;
  PetscCall(AinsworthLayoutOfBlocks(fine->comm, fine.get(), br, br, &rows));
  PetscCall(AinsworthLayoutOfBlocks(fine->comm, P->cols.layout.get(), bc, bc, &columns));
  PetscCall(AinsworthCreateShellOn(fine->comm, rows, columns, new InterpolationMat(P, width), mat));
  for (PetscLayout *layout : {&rows, &columns}) PetscCall(PetscLayoutDestroy(layout));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT, (void (*)(void))MatMult_Interpolation));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_ADD, (void (*)(void))MatMultAdd_Interpolation));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMultTranspose_Interpolation<false>));
#if defined(PETSC_USE_COMPLEX)
  PetscCall(
    MatShellSetOperation(*mat, MATOP_MULT_HERMITIAN_TRANSPOSE, (void (*)(void))MatMultTranspose_Interpolation<true>));
#endif
  PetscCall(MatShellSetOperation(*mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Interpolation));
  PetscCall(PetscObjectChangeTypeName((PetscObject)*mat, AINSWORTH_INTERPOLATION_MAT));
  PetscCall(PetscObjectComposeFunction((PetscObject)*mat, "MatConvert_" AINSWORTH_INTERPOLATION_MAT "_aij_C",
                                       MatConvert_Interpolation_AIJ));
  PetscFunctionReturn(PETSC_SUCCESS);
}
