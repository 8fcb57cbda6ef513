static char help[] = "The bound of docs/method.md for the spectrum in Ker C with M_*, against dense eigenvalues.\n\n";

#include "pmatreference.h"
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

/*
   Why the bound holds: for v in Ker C, v' (Q M^{-1} Q')^+ v is the least w' M w of all w with Q w = v. From below: w =
   v has C v = 0, and gives at most v' A v / c1. From above, with y = C w and the norm |.|_A: |Q w|_A <= |w|_A + |R
   y|_A, and |R y|_A^2 <= rho |R y|_D^2 = rho y' S^{-1} y <= theta y' B y, as R' D R = S^{-1}. From (a + b)^2 <= (1 +
   theta) a^2 + (1 + 1/theta) b^2, |Q w|_A^2 <= (1 + theta) w' M_* w <= (1 + theta) c2 w' M w. With the exact inverse Q
   w itself has the energy of Q' A Q.
*/
/* Eigenvalues of Q M^{-1} Q' A on Ker C, real and ascending */
static std::vector<PetscReal> Spectrum(const DenseSystem &d, const Dense &Q, const Dense &M)
{
  const Dense V = Dense(Eigen::HouseholderQR<Dense>(d.C.adjoint()).householderQ()).rightCols(d.A.rows() - d.C.rows());
  const Dense projected = Q * M.fullPivLu().solve(Dense(Q.adjoint() * (d.A * V)));
  std::vector<PetscReal> spectrum;

  for (const auto &value : Dense(V.adjoint() * projected).eigenvalues()) spectrum.push_back(std::real(value));
  std::sort(spectrum.begin(), spectrum.end());
  return spectrum;
}

/* M_* as set-up makes it: id within 1 and 1 + theta, with the exact inverse of S all eigenvalues are 1 */
static PetscErrorCode CheckBound(const Spec &spec, PCAinsworthPmatType type, PetscReal factor)
{
  const PmatChoice choice{type, MAT_AINSWORTH_WEIGHT_DIAGONAL, AINSWORTH_PENALTY_ROW, factor, PETSC_DECIDE, false};
  System           sys;
  DenseSystem      d;
  KSP              outer;
  Mat              S, M;
  Dense            made, reference;
  Column           B;
  PetscReal        theta = 0.0;

  PetscFunctionBeginUser;
  Case("%s, %s, factor %g", spec.name, PmatName(type), (double)factor);
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(PmatSetUp(sys.A, sys.C, sys.w, choice, &outer, &S, &M));
  PetscCall(Gather(M, made));
  PetscCall(PmatReference(d, true, choice, reference, B));

  const Column         W = DiagonalWeight(d.A);
  const DenseProjector proj(d.C, W);
  if (type == PC_AINSWORTH_PMAT_ID) {
    const Column root = W.cwiseSqrt(), rootB = B.cwiseSqrt();
    const auto   scaled  = Dense(root.asDiagonal() * d.A * root.asDiagonal()).eigenvalues().real().eval();
    const auto   penalty = Dense(rootB.asDiagonal() * proj.S * rootB.asDiagonal()).eigenvalues().real().eval();
    theta                = scaled.maxCoeff() / penalty.minCoeff();
  }
  const std::vector<PetscReal> spectrum = Spectrum(d, proj.Q, made);
  const PetscReal              rounding = 1e-8 * std::max(PetscReal(1.0), spec.jump > 1.0 ? spec.jump : 1 / spec.jump);
  PetscCall(Check("1 less the smallest eigenvalue", 1.0 - spectrum.front(), rounding));
  PetscCall(Check("largest eigenvalue", spectrum.back(), 1.0 + theta + rounding));
  PetscCall(KSPDestroy(&outer));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const Spec &spec : UsualSpecs()) {
    if (!spec.symmetric || spec.zeroRows) continue;
    for (PetscReal factor : {0.1, 1.0, 10.0}) PetscCall(CheckBound(spec, PC_AINSWORTH_PMAT_ID, factor));
    PetscCall(CheckBound(spec, PC_AINSWORTH_PMAT_CC, 1.0));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
