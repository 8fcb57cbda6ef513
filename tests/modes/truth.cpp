static char help[] = "Modes of engineering models by EPSAINSWORTH against dense linear algebra: a basis of Ker C, and LAPACK's way there.\n\n";

#include "../bench/modes/pencil.h"
#include <Eigen/Dense>
#include <slepceps.h>

using Dense = Eigen::Matrix<PetscScalar, Eigen::Dynamic, Eigen::Dynamic>;
using Reals = Eigen::Matrix<PetscReal, Eigen::Dynamic, 1>;

/* The whole matrix on every rank */
static PetscErrorCode Gather(Mat M, Dense *D)
{
  Mat         aij, dense;
  PetscInt    m, n, start, end, lda;
  const PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(M, &m, &n));
  PetscCall(MatGetOwnershipRange(M, &start, &end));
  PetscCall(MatConvert(M, MATAIJ, MAT_INITIAL_MATRIX, &aij));
  PetscCall(MatConvert(aij, MATDENSE, MAT_INITIAL_MATRIX, &dense));
  *D = Dense::Zero(m, n);
  PetscCall(MatDenseGetLDA(dense, &lda));
  PetscCall(MatDenseGetArrayRead(dense, &a));
  for (PetscInt j = 0; j < n; j++)
    for (PetscInt i = start; i < end; i++) (*D)(i, j) = a[(size_t)j * lda + i - start];
  PetscCall(MatDenseRestoreArrayRead(dense, &a));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, D->data(), (PetscMPIInt)D->size(), MPIU_SCALAR, MPIU_SUM, PetscObjectComm((PetscObject)M)));
  PetscCall(MatDestroy(&aij));
  PetscCall(MatDestroy(&dense));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   All finite eigenvalues, ascending: of Z'M Z y = 1/(lambda + shift) Z'(A + shift M) Z y, Z a basis of Ker C from a QR
   factorization of C' with pivots, in which dependent rows show
*/
static PetscErrorCode Truth(const ModesPencil &pencil, PetscReal shift, Reals *lambda)
{
  Dense A, M, C;

  PetscFunctionBeginUser;
  PetscCall(Gather(pencil.model.A, &A));
  PetscCall(Gather(pencil.mass, &M));
  PetscCall(Gather(pencil.model.C, &C));
  for (PetscInt i = 0; i < C.rows(); i++) C.row(i) /= C.row(i).norm();
  Eigen::ColPivHouseholderQR<Dense> qr(C.adjoint());
  qr.setThreshold(1e-10);
  const Dense Q = qr.householderQ(), Z = Q.rightCols(A.rows() - qr.rank());
  const Dense Ks = Z.adjoint() * (A + shift * M) * Z, Ms = Z.adjoint() * M * Z;
  /* massless motions have 1/(lambda + shift) = 0 */
  Eigen::GeneralizedSelfAdjointEigenSolver<Dense> solver(Ms, Ks, Eigen::EigenvaluesOnly);
  const Reals                                     nu = solver.eigenvalues();
  std::vector<PetscReal>                          finite;

  for (PetscInt i = nu.size() - 1; i >= 0 && nu(i) > 1e-12 * nu(nu.size() - 1); i--) finite.push_back(1.0 / nu(i) - shift);
  *lambda = Eigen::Map<Reals>(finite.data(), (PetscInt)finite.size());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |K v - lambda M v| over the size of its largest term, and |C x| over |x|, for all modes; also the Gram matrix X'M X - 1 */
static PetscErrorCode Residuals(const ModesPencil &pencil, EPS eps, PetscInt n, PetscReal *left, PetscReal *violation, PetscReal *gram)
{
  Vec              v, Kv, Mv, part;
  std::vector<Vec> modes, masses;

  PetscFunctionBeginUser;
  *left = *violation = *gram = 0.0;
  PetscCall(MatCreateVecs(pencil.K, &v, &Kv));
  PetscCall(VecDuplicate(Kv, &Mv));
  for (PetscInt i = 0; i < n; i++) {
    PetscScalar lambda;
    PetscReal   norm[3];

    PetscCall(EPSGetEigenpair(eps, i, &lambda, NULL, v, NULL));
    PetscCall(MatMult(pencil.K, v, Kv));
    PetscCall(MatMult(pencil.M, v, Mv));
    PetscCall(VecGetSubVector(Kv, pencil.dual, &part));
    PetscCall(VecNorm(part, NORM_2, &norm[0]));
    PetscCall(VecRestoreSubVector(Kv, pencil.dual, &part));
    PetscCall(VecNorm(v, NORM_2, &norm[1]));
    *violation = PetscMax(*violation, norm[0] / norm[1]);
    PetscCall(VecNorm(Mv, NORM_2, &norm[1]));
    PetscCall(VecAXPY(Kv, -lambda, Mv));
    PetscCall(VecNorm(Kv, NORM_2, &norm[0]));
    *left = PetscMax(*left, norm[0] / norm[1]);
    modes.push_back(NULL);
    masses.push_back(NULL);
    PetscCall(VecDuplicate(v, &modes.back()));
    PetscCall(VecCopy(v, modes.back()));
    PetscCall(VecDuplicate(v, &masses.back()));
    PetscCall(VecCopy(Mv, masses.back()));
    for (PetscInt j = 0; j <= i; j++) {
      PetscScalar dot;

      PetscCall(VecDot(masses[i], modes[j], &dot));
      *gram = PetscMax(*gram, PetscAbsScalar(dot - (i == j ? 1.0 : 0.0)));
    }
  }
  for (Vec &m : modes) PetscCall(VecDestroy(&m));
  for (Vec &m : masses) PetscCall(VecDestroy(&m));
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&Kv));
  PetscCall(VecDestroy(&Mv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  ModesPencil pencil;
  EPS         eps;
  PetscInt    wanted, converged, its;
  PetscReal   sigma = 1e-2, worst = 0.0, left, violation, gram;
  Reals       lambda;
  PetscBool   quiet = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(SlepcInitialize(&argc, &argv, NULL, help));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "Truth", NULL);
  PetscCall(PetscOptionsReal("-truth_shift", "Positive; larger than an eigenvalue below 0", NULL, sigma, &sigma, NULL));
  PetscCall(PetscOptionsBool("-quiet", "Without the eigenvalues", NULL, quiet, &quiet, NULL));
  PetscOptionsEnd();
  PetscCall(ModesPencilCreate(PETSC_COMM_WORLD, &pencil));
  PetscCall(EPSCreate(PETSC_COMM_WORLD, &eps));
  PetscCall(EPSSetOperators(eps, pencil.K, pencil.M));
  PetscCall(EPSSetProblemType(eps, EPS_GHEP));
  PetscCall(EPSSetFromOptions(eps));
  PetscCall(EPSSolve(eps));
  PetscCall(EPSGetConverged(eps, &converged));
  PetscCall(EPSGetDimensions(eps, &wanted, NULL, NULL));
  PetscCall(EPSGetIterationNumber(eps, &its));
  PetscCall(Truth(pencil, sigma, &lambda));
  wanted = PetscMin(wanted, (PetscInt)lambda.size());
  for (PetscInt i = 0; i < PetscMin(converged, (PetscInt)lambda.size()); i++) {
    PetscScalar found;

    PetscCall(EPSGetEigenvalue(eps, i, &found, NULL));
    if (!quiet) PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %.12g %.12g\n", (double)PetscRealPart(found), (double)lambda(i)));
    /* of a cluster behind the last wanted mode any may come */
    if (i < wanted) worst = PetscMax(worst, PetscAbsScalar(found - lambda(i)) / (PetscAbsReal(lambda(i)) + sigma));
  }
  PetscCall(Residuals(pencil, eps, PetscMin(converged, wanted), &left, &violation, &gram));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "modes: exist=%d wanted=%" PetscInt_FMT " converged=%" PetscInt_FMT " iterations=%" PetscInt_FMT " difference=%.1e residual=%.1e violation=%.1e orthogonality=%.1e\n",
                        (int)lambda.size(), wanted, converged, its, (double)worst, (double)left, (double)violation, (double)gram));
  PetscCall(EPSDestroy(&eps));
  PetscCall(ModesPencilDestroy(&pencil));
  PetscCall(SlepcFinalize());
  return converged >= wanted ? 0 : 1;
}
