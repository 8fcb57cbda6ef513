! A chain of springs with three ties, as one matrix, solved as the options say; the program is linked to the plugin.
program main
#include <petsc/finclude/petscksp.h>
  use petscksp
  implicit none
  external         :: AinsworthInitializePackage
  Mat              :: K
  Vec              :: x, b, r
  KSP              :: solver
  PC               :: pc
  PetscErrorCode   :: ierr
  PetscInt         :: first, last, i, j
  PetscInt, parameter :: n = 120, ties = 3
  PetscReal        :: residual, norm
  PetscScalar      :: one = 1.0, minus = -1.0, spring = 2.1

  PetscCallA(PetscInitialize(ierr))
  PetscCallA(AinsworthInitializePackage(ierr))
  PetscCallA(MatCreate(PETSC_COMM_WORLD, K, ierr))
  PetscCallA(MatSetSizes(K, PETSC_DECIDE, PETSC_DECIDE, n + ties, n + ties, ierr))
  PetscCallA(MatSetType(K, MATAIJ, ierr))
  PetscCallA(MatSetUp(K, ierr))
  PetscCallA(MatGetOwnershipRange(K, first, last, ierr))
  do i = first, min(last, n) - 1
    PetscCallA(MatSetValue(K, i, i, spring, INSERT_VALUES, ierr))
    if (i > 0) then
      PetscCallA(MatSetValue(K, i, i - 1, minus, INSERT_VALUES, ierr))
    end if
    if (i < n - 1) then
      PetscCallA(MatSetValue(K, i, i + 1, minus, INSERT_VALUES, ierr))
    end if
  end do
  if (first == 0) then
    do i = n, n + ties - 1
      j = 20 * (i - n)
      PetscCallA(MatSetValue(K, i, j, one, INSERT_VALUES, ierr))
      PetscCallA(MatSetValue(K, j, i, one, INSERT_VALUES, ierr))
      PetscCallA(MatSetValue(K, i, j + 70, minus, INSERT_VALUES, ierr))
      PetscCallA(MatSetValue(K, j + 70, i, minus, INSERT_VALUES, ierr))
    end do
  end if
  PetscCallA(MatAssemblyBegin(K, MAT_FINAL_ASSEMBLY, ierr))
  PetscCallA(MatAssemblyEnd(K, MAT_FINAL_ASSEMBLY, ierr))

  PetscCallA(MatCreateVecs(K, x, b, ierr))
  PetscCallA(VecSet(b, one, ierr))
  PetscCallA(KSPCreate(PETSC_COMM_WORLD, solver, ierr))
  PetscCallA(KSPSetType(solver, KSPPREONLY, ierr))
  PetscCallA(KSPSetOperators(solver, K, K, ierr))
  PetscCallA(KSPGetPC(solver, pc, ierr))
  PetscCallA(PCSetType(pc, 'ainsworth', ierr))
  PetscCallA(KSPSetFromOptions(solver, ierr))
  PetscCallA(KSPSolve(solver, b, x, ierr))

  PetscCallA(VecDuplicate(b, r, ierr))
  PetscCallA(MatMult(K, x, r, ierr))
  PetscCallA(VecAXPY(r, minus, b, ierr))
  PetscCallA(VecNorm(r, NORM_2, residual, ierr))
  PetscCallA(VecNorm(b, NORM_2, norm, ierr))
  if (residual <= 1.e-8 * norm) then
    PetscCallA(PetscPrintf(PETSC_COMM_WORLD, 'solved: yes\n', ierr))
  else
    PetscCallA(PetscPrintf(PETSC_COMM_WORLD, 'solved: no\n', ierr))
  end if
  PetscCallA(KSPDestroy(solver, ierr))
  PetscCallA(VecDestroy(r, ierr))
  PetscCallA(VecDestroy(x, ierr))
  PetscCallA(VecDestroy(b, ierr))
  PetscCallA(MatDestroy(K, ierr))
  PetscCallA(PetscFinalize(ierr))
end program
