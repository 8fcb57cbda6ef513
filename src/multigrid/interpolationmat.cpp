#include "levelmat.h"

namespace
{
/* Interpolation and what an application of it needs */
struct InterpolationMat {
  std::shared_ptr<const AinsworthInterpolation> P;
  std::vector<PetscScalar>                      ghost;
  AinsworthUnit                                 unit;

  explicit InterpolationMat(PetscInt bc) : unit(bc, MPIU_SCALAR) { }
};

template <int R, int C, class T>
void Mult(const AinsworthInterpolation &P, const T *a, const PetscScalar *x, const PetscScalar *ghost, PetscScalar *y)
{
  const PetscInt br = R ? R : P.rows.br, bc = C ? C : P.rows.bc;

  for (PetscInt i = 0; i < P.rows.n; i++, y += br)
    for (PetscInt k = P.rows.i[i]; k < P.rows.i[i + 1]; k++, a += br * bc) {
      const PetscInt     j = P.rows.j[k];
      const PetscScalar *z = j < P.cols.local ? x + (size_t)j * bc : ghost + (size_t)(j - P.cols.local) * bc;
      for (PetscInt r = 0; r < br; r++) {
        PetscScalar sum = 0.0;
        for (PetscInt c = 0; c < bc; c++) sum += (PetscScalar)a[r * bc + c] * z[c];
        y[r] += sum;
      }
    }
}

template <int R, int C, class T>
void MultTranspose(const AinsworthInterpolation &P, const T *a, const PetscScalar *x, PetscScalar *ghost, PetscScalar *y, bool adjoint)
{
  const PetscInt br = R ? R : P.rows.br, bc = C ? C : P.rows.bc;

  for (PetscInt i = 0; i < P.rows.n; i++, x += br)
    for (PetscInt k = P.rows.i[i]; k < P.rows.i[i + 1]; k++, a += br * bc) {
      const PetscInt j = P.rows.j[k];
      PetscScalar   *z = j < P.cols.local ? y + (size_t)j * bc : ghost + (size_t)(j - P.cols.local) * bc;
      for (PetscInt r = 0; r < br; r++)
        for (PetscInt c = 0; c < bc; c++) z[c] += (adjoint ? (PetscScalar)AinsworthConj(a[r * bc + c]) : (PetscScalar)a[r * bc + c]) * x[r];
    }
}
} // namespace

/* y += P x */
static PetscErrorCode AddMult(Mat mat, Vec x, Vec y)
{
  InterpolationMat  *I;
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(mat, &I));
  const AinsworthInterpolation &P = *I->P;
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArray(y, &to));
  PetscCall(P.cols.toGhosts(I->unit.type, from, I->ghost.data()));
  AinsworthDispatch(P.rows.br, P.rows.bc, [&](auto R, auto C) {
    if (P.single.size()) Mult<R(), C()>(P, P.single.data(), from, I->ghost.data(), to);
    else Mult<R(), C()>(P, P.rows.a.data(), from, I->ghost.data(), to);
  });
  PetscCall(VecRestoreArray(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMult_Interpolation(Mat mat, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(y));
  PetscCall(AddMult(mat, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMultAdd_Interpolation(Mat mat, Vec x, Vec w, Vec y)
{
  PetscFunctionBegin;
  if (w != y) PetscCall(VecCopy(w, y));
  PetscCall(AddMult(mat, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MultTransposeOrAdjoint(Mat mat, bool adjoint, Vec x, Vec y)
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
    if (P.single.size()) MultTranspose<R(), C()>(P, P.single.data(), from, I->ghost.data(), to, adjoint);
    else MultTranspose<R(), C()>(P, P.rows.a.data(), from, I->ghost.data(), to, adjoint);
  });
  if (P.cols.sf) {
    PetscCall(PetscSFReduceBegin(P.cols.sf, I->unit.type, I->ghost.data(), to, MPIU_SUM));
    PetscCall(PetscSFReduceEnd(P.cols.sf, I->unit.type, I->ghost.data(), to, MPIU_SUM));
  }
  PetscCall(VecRestoreArray(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMultTranspose_Interpolation(Mat mat, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(MultTransposeOrAdjoint(mat, false, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#if defined(PETSC_USE_COMPLEX)
static PetscErrorCode MatMultHermitianTranspose_Interpolation(Mat mat, Vec x, Vec y)
{
  PetscFunctionBegin;
  PetscCall(MultTransposeOrAdjoint(mat, true, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#endif

/* As AIJ, for users of PCGetInterpolations() */
static PetscErrorCode MatConvert_Interpolation_AIJ(Mat mat, MatType, MatReuse reuse, Mat *newmat)
{
  InterpolationMat        *I;
  Mat                      B;
  PetscInt                 m, n, M, N, first;
  std::vector<PetscInt>    inside, outside, cols;
  std::vector<PetscScalar> values;

  PetscFunctionBegin;
  PetscCheck(reuse == MAT_INITIAL_MATRIX, PetscObjectComm((PetscObject)mat), PETSC_ERR_SUP, "MatConvert() of interpolation makes a new matrix only");
  PetscCall(MatShellGetContext(mat, &I));
  const AinsworthInterpolation &P  = *I->P;
  const PetscInt                br = P.rows.br, bc = P.rows.bc;
  PetscCall(MatGetLocalSize(mat, &m, &n));
  PetscCall(MatGetSize(mat, &M, &N));
  PetscCall(MatGetOwnershipRange(mat, &first, NULL));
  inside.assign(m, 0);
  outside.assign(m, 0);
  for (PetscInt l = 0; l < m; l++)
    for (PetscInt k = P.rows.i[l / br]; k < P.rows.i[l / br + 1]; k++) (P.rows.j[k] < P.cols.local ? inside : outside)[l] += bc;
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)mat), m, n, M, N, 0, inside.data(), 0, outside.data(), &B));
  PetscCall(MatSetBlockSizes(B, br, bc));
  for (PetscInt l = 0; l < m; l++) {
    const PetscInt row = first + l;

    cols.clear();
    values.clear();
    for (PetscInt k = P.rows.i[l / br]; k < P.rows.i[l / br + 1]; k++)
      for (PetscInt c = 0; c < bc; c++) {
        const size_t at = ((size_t)k * br + l % br) * bc + c;
        cols.push_back(P.cols.node(P.rows.j[k]) * bc + c);
        values.push_back(P.single.size() ? (PetscScalar)P.single[at] : P.rows.a[at]);
      }
    PetscCall(MatSetValues(B, 1, &row, (PetscInt)cols.size(), cols.data(), values.data(), INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(B, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(B, MAT_FINAL_ASSEMBLY));
  *newmat = B;
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

/* AinsworthInterpolationMatCreate - interpolation to nodes of the layout as a matrix */
PetscErrorCode AinsworthInterpolationMatCreate(std::shared_ptr<const AinsworthInterpolation> P, PetscLayout nodes, Mat *mat)
{
  const PetscInt    br = P->rows.br, bc = P->rows.bc;
  PetscInt          n, N, cN;
  InterpolationMat *I = new InterpolationMat(bc);

  PetscFunctionBegin;
  I->P = P;
  I->ghost.assign(P->cols.ghosts.size() * bc, 0.0);
  PetscCall(PetscLayoutGetLocalSize(nodes, &n));
  PetscCall(PetscLayoutGetSize(nodes, &N));
  PetscCall(PetscLayoutGetSize(P->cols.layout, &cN));
  PetscCall(MatCreate(nodes->comm, mat));
  PetscCall(MatSetSizes(*mat, n * br, P->cols.local * bc, N * br, cN * bc));
  PetscCall(MatSetBlockSizes(*mat, br, bc));
  PetscCall(MatSetType(*mat, MATSHELL));
  PetscCall(MatSetUp(*mat));
  PetscCall(MatShellSetContext(*mat, I));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT, (void (*)(void))MatMult_Interpolation));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_ADD, (void (*)(void))MatMultAdd_Interpolation));
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_TRANSPOSE, (void (*)(void))MatMultTranspose_Interpolation));
#if defined(PETSC_USE_COMPLEX)
  PetscCall(MatShellSetOperation(*mat, MATOP_MULT_HERMITIAN_TRANSPOSE, (void (*)(void))MatMultHermitianTranspose_Interpolation));
#endif
  PetscCall(MatShellSetOperation(*mat, MATOP_DESTROY, (void (*)(void))MatDestroy_Interpolation));
  PetscCall(PetscObjectChangeTypeName((PetscObject)*mat, AINSWORTH_INTERPOLATION_MAT));
  PetscCall(PetscObjectComposeFunction((PetscObject)*mat, "MatConvert_" AINSWORTH_INTERPOLATION_MAT "_aij_C", MatConvert_Interpolation_AIJ));
  PetscFunctionReturn(PETSC_SUCCESS);
}
