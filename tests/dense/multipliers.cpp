static char help[] = "A diagonal block of the multipliers that is not zero, and a block (0,1) that is not the adjoint of (1,0).\n\n";

#include "layout.h"

/* The diagonal of D: a scale for rows of C that are not zero, others for those that are (every third); 0 on even rows of C where sparse */
static Column Diagonal(const Dense &C, PetscReal scale, bool sparse)
{
  Column D = Column::Zero(C.rows());

  for (Eigen::Index i = 0; i < C.rows(); i++) {
    if (C.row(i).norm() == 0.0) D[i] = i % 2 ? 2.5 : -0.5;
    else if (!sparse || i % 2) D[i] = -scale * C.row(i).squaredNorm();
  }
  return D;
}

static PetscErrorCode DiagonalBlock(const System &sys, const Column &D, Mat *M)
{
  PetscInt m, start, end;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(sys.C, &m, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 2, NULL, 2, NULL, M));
  PetscCall(MatGetOwnershipRange(*M, &start, &end));
  for (PetscInt i = start; i < end; i++) PetscCall(MatSetValue(*M, i, i, D[i], INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckBlock(const Spec &spec, PetscReal scale, bool sparse, bool first)
{
  System             sys;
  DenseSystem        d;
  Mat                nest, D;
  KSP                ksp;
  Column             x, lambda, b, y, diagonal;
  KSPConvergedReason reason;
  const PetscInt     n = spec.n, m = spec.m;
  Dense              K = Dense::Zero(n + m, n + m);

  PetscFunctionBeginUser;
  Case("%s, D %g, sparse %d, first %d, uneven %d", spec.name, (double)scale, sparse, first, spec.uneven);
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  diagonal = Diagonal(d.C, scale, sparse);
  PetscCall(DiagonalBlock(sys, diagonal, &D));
  PetscCall(NestCreate(sys.A, NULL, sys.C, D, first, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  K.topLeftCorner(n, n)     = d.A;
  K.topRightCorner(n, m)    = d.C.adjoint();
  K.bottomLeftCorner(m, n)  = d.C;
  K.bottomRightCorner(m, m) = diagonal.asDiagonal();
  for (bool again : {false, true}) { /* a change of D alone is noticed */
    if (again) {
      PetscCall(MatScale(D, 2.0));
      K.bottomRightCorner(m, m) *= 2.0;
    }
    b.resize(n + m);
    b << d.f, d.g;
    y = K.fullPivLu().solve(b);
    PetscCall(SolveFields(ksp, sys, first, false, x, lambda));
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
    PetscCall(CheckEqual("x", x, y.head(n), 1e-8));
    PetscCall(CheckEqual("lambda", lambda, y.tail(m), 1e-7));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&D));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckRefused(bool uneven)
{
  Spec     spec;
  System   sys;
  Mat      nest, D, Ct, other;
  KSP      ksp;
  Column   diagonal = Column::Zero(5);
  PetscInt start, end;
  Dense    C;

  PetscFunctionBeginUser;
  spec.uneven = uneven;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys.C, C));
  Case("refused, uneven %d", uneven);
  diagonal[3] = 0.25;
  PetscCall(DiagonalBlock(sys, diagonal, &D));
  PetscCall(NestCreate(sys.A, NULL, sys.C, D, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(CheckError("positive", [&]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_WRONG, {"holds 0.25 in row 3", "negative"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatGetOwnershipRange(D, &start, &end));
  PetscCall(MatSetOption(D, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatSetOption(D, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_FALSE));
  if (start <= 2 && 2 < end) PetscCall(MatSetValue(D, 2, 4, -1.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(D, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(D, MAT_FINAL_ASSEMBLY));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(CheckError("not diagonal", [&]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_WRONG, {"no multipliers", "(1,1), the smaller one", "entry (2,4)"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&D));

  PetscCall(MatCreateShell(PETSC_COMM_WORLD, end - start, end - start, 5, 5, NULL, &D)); /* nothing is known of its entries */
  PetscCall(NestCreate(sys.A, NULL, sys.C, D, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(CheckError("a shell", [&]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_WRONG, {"no multipliers", "type shell", "has no rows to look at"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&D));

  /* differences, one of them small */
  PetscCall(MatDuplicate(sys.C, MAT_COPY_VALUES, &other));
  PetscCall(MatHermitianTranspose(other, MAT_INITIAL_MATRIX, &Ct));
  for (PetscReal change : {1e-3, 3e-9}) {
    int column = 0;

    while (C(4, column) == 0.0) column++;
    PetscCall(MatGetOwnershipRange(Ct, &start, &end));
    if (start <= column && column < end) PetscCall(MatSetValue(Ct, column, 4, PetscConj(C(4, column)) * (1.0 + change), INSERT_VALUES));
    PetscCall(MatAssemblyBegin(Ct, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(Ct, MAT_FINAL_ASSEMBLY));
    PetscCall(NestCreate(sys.A, Ct, sys.C, NULL, false, &nest));
    PetscCall(SolverCreate(nest, &ksp));
    PetscCall(CheckError("not an adjoint", [&]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_INCOMP,
                         {"Block (0,1) of the MatNest is not the", "entry (4," + std::to_string(column) + ") of C"}));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&nest));
  }
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatDestroy(&other));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  {
    Options options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-13");

    for (bool uneven : {false, true}) {
      Spec spec;

      spec.m        = 9;
      spec.uneven   = uneven;
      spec.zeroRows = true;
      for (PetscReal scale : {1e-2, 1.0, 1e2})
        for (bool sparse : {false, true})
          for (bool first : {false, true}) PetscCall(CheckBlock(spec, scale, sparse, first));
      spec.name         = "floating";
      spec.semidefinite = true;
      PetscCall(CheckBlock(spec, 1.0, false, false));
    }
  }
  for (bool uneven : {false, true}) PetscCall(CheckRefused(uneven));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
