#include "levelmat.h"

namespace
{
/* Interpolation with its work space */
struct InterpolationMat {
  std::shared_ptr<const AinsworthInterpolation> P;
  std::shared_ptr<const AinsworthLevelSubspace> subspace; /* of the finer level; NULL: the whole space */
  std::vector<PetscScalar>                      ghost;
  AinsworthUnit                                 unit;

  explicit InterpolationMat(const std::shared_ptr<const AinsworthInterpolation> &I)
    : P(I), ghost(I->cols.ghosts.size() * I->rows.bc), unit(I->rows.bc, MPIU_SCALAR)
  {
  }
};

template <bool adjoint, int R, int C, class T>
void MultTranspose(const AinsworthInterpolation &P, const T *a, const PetscScalar *x, PetscScalar *ghost, PetscScalar *y)
{
  const PetscInt br = R ? R : P.rows.br, bc = C ? C : P.rows.bc;

  for (PetscInt i = 0; i < P.rows.n; i++, x += br)
    for (PetscInt k = P.rows.i[i]; k < P.rows.i[i + 1]; k++, a += br * bc) {
      const PetscInt j = P.rows.j[k];
      PetscScalar   *z = j < P.cols.local ? y + (size_t)j * bc : ghost + (size_t)(j - P.cols.local) * bc;
      for (PetscInt r = 0; r < br; r++)
        for (PetscInt c = 0; c < bc; c++) z[c] += (PetscScalar)(adjoint ? AinsworthConj(a[r * bc + c]) : a[r * bc + c]) * x[r];
    }
}
} // namespace

/* Computes y = w + P x or, with a subspace that w is in, Q (w + P x); w may be y */
static PetscErrorCode MatMultAdd_Interpolation(Mat mat, Vec x, Vec w, Vec y)
{
  InterpolationMat  *I;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &I));
  const AinsworthInterpolation &P = *I->P;
  if (w != y) PetscCall(VecCopy(w, y));
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArray(y, &to));
  PetscCall(P.cols.toGhosts(I->unit.type, from, I->ghost.data()));
  AinsworthDispatch(P.rows.br, P.rows.bc, [&](auto R, auto C) {
    if (P.single.size()) AinsworthRowsMultAdd<R(), C()>(P.rows, P.single.data(), P.cols.local, from, I->ghost.data(), P.rows.bc, P.rows.br, to);
    else AinsworthRowsMultAdd<R(), C()>(P.rows, P.rows.a.data(), P.cols.local, from, I->ghost.data(), P.rows.bc, P.rows.br, to);
  });
  PetscCall(VecRestoreArray(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  if (I->subspace) PetscCall(I->subspace->project(false, y));
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
  const AinsworthInterpolation &P = *I->P;
  PetscCall(VecZeroEntries(y));
  std::fill(I->ghost.begin(), I->ghost.end(), 0.0);
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArray(y, &to));
  AinsworthDispatch(P.rows.br, P.rows.bc, [&](auto R, auto C) {
    if (P.single.size()) MultTranspose<adjoint, R(), C()>(P, P.single.data(), from, I->ghost.data(), to);
    else MultTranspose<adjoint, R(), C()>(P, P.rows.a.data(), from, I->ghost.data(), to);
  });
  if (P.cols.sf) {
    PetscCall(PetscSFReduceBegin(P.cols.sf.get(), I->unit.type, I->ghost.data(), to, MPIU_SUM));
    PetscCall(PetscSFReduceEnd(P.cols.sf.get(), I->unit.type, I->ghost.data(), to, MPIU_SUM));
  }
  PetscCall(VecRestoreArray(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Converts to AIJ, for users of PCGetInterpolations() */
static PetscErrorCode MatConvert_Interpolation_AIJ(Mat mat, MatType, MatReuse reuse, Mat *newmat)
{
  InterpolationMat *I;

  PetscFunctionBegin;
  PetscCheck(reuse == MAT_INITIAL_MATRIX, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP, "MatConvert() of interpolation makes a new matrix only");
  PetscCall(MatShellGetContext(mat, &I));
  AinsworthBlockRows rows(I->P->rows);
  if (I->P->single.size()) rows.a.assign(I->P->single.begin(), I->P->single.end());
  PetscCall(AinsworthBlocksToAIJ(rows, I->P->cols, mat, newmat));
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
  I->P = P;
  I->ghost.assign(P->cols.ghosts.size() * P->rows.bc, 0.0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthInterpolationMatSetSubspace - keeps what is interpolated in a subspace, or (NULL) no longer */
PetscErrorCode AinsworthInterpolationMatSetSubspace(Mat mat, const std::shared_ptr<const AinsworthLevelSubspace> &subspace)
{
  InterpolationMat *I;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &I));
  I->subspace = subspace;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthInterpolationMatCreate - creates a matrix that interpolates to the nodes of layout `fine` */
PetscErrorCode AinsworthInterpolationMatCreate(const std::shared_ptr<const AinsworthInterpolation> &P, const AinsworthLayout &fine, Mat *mat)
{
  const PetscInt         br = P->rows.br, bc = P->rows.bc;
  const AinsworthLayout &coarse = P->cols.layout;

  PetscFunctionBegin;
  PetscCall(MatCreateShell(fine->comm, fine->n * br, coarse->n * bc, fine->N * br, coarse->N * bc, new InterpolationMat(P), mat));
  PetscCall(MatSetBlockSizes(*mat, br, bc));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT, (void (*)(void))MatMult_Interpolation));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_ADD, (void (*)(void))MatMultAdd_Interpolation));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMultTranspose_Interpolation<false>));
#if defined(PETSC_USE_COMPLEX)
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_HERMITIAN_TRANSPOSE, (void (*)(void))MatMultTranspose_Interpolation<true>));
#endif
  PetscCall(MatShellSetOperation(*mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Interpolation));
  PetscCall(PetscObjectChangeTypeName((PetscObject)*mat, AINSWORTH_INTERPOLATION_MAT));
  PetscCall(PetscObjectComposeFunction((PetscObject)*mat, "MatConvert_" AINSWORTH_INTERPOLATION_MAT "_aij_C", MatConvert_Interpolation_AIJ));
  PetscFunctionReturn(PETSC_SUCCESS);
}
