/* A saddle-point system in the form that a solver wants */
#include "forms.h"

const char *const FormTypes[] = {"nest", "aij", "augmented", "eliminated", "FormType", "FORM_", NULL};

static PetscErrorCode CreateFields(Form *form)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)form->A);
  PetscInt m, n, row, column, bs;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(form->C, &m, &n));
  PetscCall(MatGetOwnershipRange(form->C, &row, NULL));
  PetscCall(MatGetOwnershipRange(form->A, &column, NULL));
  PetscCall(MatGetBlockSize(form->A, &bs));
  PetscCall(ISCreateStride(comm, n, row + column, 1, &form->fields[0]));
  PetscCall(ISSetBlockSize(form->fields[0], bs));
  PetscCall(ISCreateStride(comm, m, row + column + n, 1, &form->fields[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [A B'; C corner], B' a matrix of its own: products of the blocks are formed from it */
static PetscErrorCode CreateNest(const Form &form, Mat A, Mat corner, Mat *K)
{
  Mat blocks[4] = {A, NULL, form.C, corner};

  PetscFunctionBeginUser;
  PetscCall(MatHermitianTranspose(form.B, MAT_INITIAL_MATRIX, &blocks[1]));
  PetscCall(MatCreateNest(PetscObjectComm((PetscObject)A), 2, form.fields, 2, form.fields, blocks, K));
  PetscCall(MatDestroy(&blocks[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* d = diag(C diag(A)^{-1} C') */
static PetscErrorCode ConstraintDiagonal(Mat A, Mat C, Vec *d)
{
  Vec      inverse;
  Mat      scaled;
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, &inverse, NULL));
  PetscCall(MatGetDiagonal(A, inverse));
  PetscCall(VecSqrtAbs(inverse));
  PetscCall(VecReciprocal(inverse));
  PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &scaled));
  PetscCall(MatDiagonalScale(scaled, NULL, inverse));
  PetscCall(MatCreateVecs(C, NULL, d));
  PetscCall(MatGetOwnershipRange(scaled, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    const PetscScalar *values;
    PetscInt           count;
    PetscScalar        sum = 0;

    PetscCall(MatGetRow(scaled, i, &count, NULL, &values));
    for (PetscInt k = 0; k < count; k++) sum += PetscRealPart(values[k] * PetscConj(values[k]));
    PetscCall(MatRestoreRow(scaled, i, &count, NULL, &values));
    PetscCall(VecSetValue(*d, i, sum, INSERT_VALUES));
  }
  PetscCall(VecAssemblyBegin(*d));
  PetscCall(VecAssemblyEnd(*d));
  PetscCall(MatDestroy(&scaled));
  PetscCall(VecDestroy(&inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FormCopyNearNullSpace(Mat from, Mat to)
{
  MatNullSpace modes;

  PetscFunctionBeginUser;
  PetscCall(MatGetNearNullSpace(from, &modes));
  if (modes) PetscCall(MatSetNearNullSpace(to, modes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The augmented Lagrangian of Golub and Greif (SIAM J. Sci. Comput. 24, 2003), one gamma per row */
static PetscErrorCode CreateAugmented(Vec f, Vec g, PetscReal gamma, Form *form, Vec augmented)
{
  Mat      root, product, D;
  Vec      B, weighted;
  PetscInt m, start;

  PetscFunctionBeginUser;
  PetscCall(ConstraintDiagonal(form->A, form->C, &B));
  PetscCall(VecReciprocal(B));
  PetscCall(VecScale(B, gamma));
  PetscCall(VecDuplicate(B, &weighted));
  PetscCall(VecPointwiseMult(weighted, B, g));
  PetscCall(MatMultHermitianTranspose(form->C, weighted, augmented));
  PetscCall(VecAXPY(augmented, 1.0, f));
  PetscCall(MatDuplicate(form->C, MAT_COPY_VALUES, &root));
  PetscCall(VecCopy(B, weighted));
  PetscCall(VecSqrtAbs(weighted));
  PetscCall(MatDiagonalScale(root, weighted, NULL));
  PetscCall(MatTransposeMatMult(root, root, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
  PetscCall(MatAXPY(product, 1.0, form->A, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&root));
  /* MatAXPY() leaves the methods of the old pattern, which orderings of LU rely on */
  PetscCall(MatDuplicate(product, MAT_COPY_VALUES, &root));
  PetscCall(MatDestroy(&product));
  product = root;
  PetscCall(MatSetOption(product, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(FormCopyNearNullSpace(form->A, product));
  PetscCall(VecReciprocal(B));
  PetscCall(VecGetLocalSize(B, &m));
  PetscCall(VecGetOwnershipRange(B, &start, NULL));
  PetscCall(
    MatCreateAIJ(PetscObjectComm((PetscObject)B), m, m, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &D));
  for (PetscInt i = start; i < start + m; i++) PetscCall(MatSetValue(D, i, i, 0.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(D, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(D, MAT_FINAL_ASSEMBLY));
  PetscCall(VecScale(B, -1.0));
  PetscCall(MatDiagonalSet(D, B, INSERT_VALUES));
  PetscCall(CreateNest(*form, product, NULL, &form->K));
  PetscCall(CreateNest(*form, product, D, &form->M));
  PetscCall(MatDestroy(&D));
  PetscCall(MatDestroy(&product));
  PetscCall(VecDestroy(&B));
  PetscCall(VecDestroy(&weighted));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SetField(Vec all, IS is, Vec field)
{
  PetscFunctionBeginUser;
  PetscCall(VecISCopy(all, is, SCATTER_FORWARD, field));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FormCreate(const SaddleBlocks &s, Vec f, Vec g, FormType type, PetscReal gamma, Form *form)
{
  const bool general = s.B || s.D;
  Mat        nest, corner = NULL;
  Vec        first;

  PetscFunctionBeginUser;
  PetscCheck(!general || type == FORM_NEST || type == FORM_AIJ, PetscObjectComm((PetscObject)s.A), PETSC_ERR_SUP,
             "Option -form %s is for [A C'; C 0]: leave out -B and -D, or use -form nest or aij", FormTypes[type]);
  *form      = Form();
  form->type = type;
  form->A    = s.A;
  form->B    = s.B ? s.B : s.C;
  form->C    = s.C;
  form->D    = s.D;
  form->f    = f;
  if (type == FORM_ELIMINATED) {
    PetscCall(FormCreateEliminated(g, form));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecDuplicate(f, &first));
  PetscCall(VecCopy(f, first));
  PetscCall(CreateFields(form));
  if (type == FORM_AUGMENTED) PetscCall(CreateAugmented(f, g, gamma, form, first));
  else {
    if (s.D) {
      PetscCall(MatDuplicate(s.D, MAT_COPY_VALUES, &corner));
      PetscCall(MatScale(corner, -1.0));
    }
    PetscCall(CreateNest(*form, s.A, corner, &nest));
    PetscCall(MatDestroy(&corner));
    if (type == FORM_AIJ) {
      PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, &form->K));
      PetscCall(MatDestroy(&nest));
      PetscCall(MatSetOption(form->K, MAT_SYMMETRIC, s.B ? PETSC_FALSE : PETSC_TRUE));
    } else form->K = nest;
    form->M = form->K;
    PetscCall(PetscObjectReference((PetscObject)form->M));
  }
  PetscCall(MatCreateVecs(form->M, &form->y, &form->rhs));
  PetscCall(SetField(form->rhs, form->fields[0], first));
  PetscCall(SetField(form->rhs, form->fields[1], g));
  PetscCall(VecDestroy(&first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FormGetSolution(const Form &form, Vec x, Vec lambda)
{
  PetscFunctionBeginUser;
  if (form.type == FORM_ELIMINATED) PetscCall(FormGetEliminated(form, x, lambda));
  else {
    PetscCall(VecISCopy(form.y, form.fields[0], SCATTER_REVERSE, x));
    PetscCall(VecISCopy(form.y, form.fields[1], SCATTER_REVERSE, lambda));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FormDestroy(Form *form)
{
  PetscFunctionBeginUser;
  for (Mat *mat : {&form->K, &form->M, &form->T}) PetscCall(MatDestroy(mat));
  for (Vec *vec : {&form->rhs, &form->y, &form->x0, &form->coefficients}) PetscCall(VecDestroy(vec));
  for (IS *is : {&form->fields[0], &form->fields[1], &form->slaves}) PetscCall(ISDestroy(is));
  PetscFunctionReturn(PETSC_SUCCESS);
}
