#include "bordered.h"
#include <petscblaslapack.h>

PetscErrorCode AinsworthBordered::clear()
{
  PetscFunctionBegin;
  for (Vec &v : lifted) PetscCall(VecDestroy(&v));
  lifted.clear();
  PetscFunctionReturn(PETSC_SUCCESS);
}

AinsworthBordered::~AinsworthBordered()
{
  (void)clear();
}

/*
   AinsworthBordered::setUp - computes L and factors C L for rows that are given by their adjoints, with one application
   of M^{-1} each. Collective

   *apart: the factorization leaves more than the part `dependent` of each diagonal entry; otherwise there is no L
*/
PetscErrorCode AinsworthBordered::setUp(PC inner, const std::vector<Vec> &rows, PetscReal dependent, bool *apart)
{
  const size_t           n = rows.size();
  std::vector<PetscReal> before;
  PetscBLASInt           size, info = 0;

  PetscFunctionBegin;
  PetscCall(clear());
  *apart = true;
  factor.assign(n * n, 0.0);
  for (size_t k = 0; k < n; k++) {
    Vec v;

    PetscCall(VecDuplicate(rows[k], &v));
    lifted.push_back(v);
    PetscCall(PCApply(inner, rows[k], v));
    PetscCall(VecMDot(v, (PetscInt)n, rows.data(), &factor[k * n]));
    before.push_back(PetscRealPart(factor[k * (n + 1)]));
  }
  PetscCall(PetscBLASIntCast((PetscInt)n, &size));
  if (n) PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &size, factor.data(), &size, &info));
  for (size_t k = 0; k < n; k++)
    *apart = *apart && !info && PetscSqr(PetscRealPart(factor[k * (n + 1)])) > dependent * before[k];
  if (!*apart) PetscCall(clear());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Turns z = M^{-1} r into z - L (C L)^{-1} C z; left: C z, which is L' r; overwritten */
PetscErrorCode AinsworthBordered::correct(std::vector<PetscScalar> &left, Vec z) const
{
  PetscBLASInt size, one = 1, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast((PetscInt)left.size(), &size));
  PetscCallBLAS("LAPACKpotrs", LAPACKpotrs_("L", &size, &one, const_cast<PetscScalar *>(factor.data()), &size,
                                            left.data(), &size, &info));
  for (PetscScalar &value : left) value = -value;
  PetscCall(VecMAXPY(z, size, left.data(), const_cast<Vec *>(lifted.data())));
  PetscFunctionReturn(PETSC_SUCCESS);
}
