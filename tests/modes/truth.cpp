static char help[] = "Modes of engineering models by EPSAINSWORTH against dense linear algebra: a basis of Ker C, and "
                     "LAPACK's way there.\n\n";

#include "../bench/modes/pencil.h"
#include <Eigen/Dense>
#include <slepceps.h>

using Dense = Eigen::Matrix<PetscScalar, Eigen::Dynamic, Eigen::Dynamic>;
using Reals = Eigen::Matrix<PetscReal, Eigen::Dynamic, 1>;

/* The whole matrix on every rank */
static PetscErrorCode Gather(Mat M, Dense *D)
{
  Mat                aij, dense;
  PetscInt           m, n, start, end, lda;
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
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, D->data(), (PetscMPIInt)D->size(), MPIU_SCALAR, MPIU_SUM,
                             PetscObjectComm((PetscObject)M)));
  PetscCall(MatDestroy(&aij));
  PetscCall(MatDestroy(&dense));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   All finite eigenvalues, ascending: of Z'M Z y = 1/(lambda + shift) Z'(A + shift M) Z y, Z a basis of Ker C from a QR
   factorization of C' with pivots, in which dependent rows show. For (M, K), all eigenvalues but 0, descending, without
   a shift
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
  if (pencil.swapped) shift = 0.0;
  const Dense Ks = Z.adjoint() * (A + shift * M) * Z, Ms = Z.adjoint() * M * Z;
  /* massless motions have 1/(lambda + shift) = 0 */
  Eigen::GeneralizedSelfAdjointEigenSolver<Dense> solver(Ms, Ks, Eigen::EigenvaluesOnly);
  const Reals                                     nu = solver.eigenvalues();
  std::vector<PetscReal>                          finite;

  const PetscReal most = nu.cwiseAbs().maxCoeff();
  for (PetscInt i = nu.size() - 1; i >= 0; i--)
    if ((pencil.swapped ? PetscAbsReal(nu(i)) : nu(i)) > 1e-12 * most)
      finite.push_back(pencil.swapped ? nu(i) : 1.0 / nu(i) - shift);
  *lambda = Eigen::Map<Reals>(finite.data(), (PetscInt)finite.size());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a mode is judged by, the worst of all modes */
struct Quality {
  PetscReal residual      = 0.0; /* |K v - lambda M v| over |A| |v|, with the multipliers in v */
  PetscReal violation     = 0.0; /* |C x| over |x| */
  PetscReal orthogonality = 0.0; /* of X' M X from 1, or X' K X for (M, K) */
};

static PetscErrorCode Judge(const ModesPencil &pencil, EPS eps, PetscInt n, Quality *q)
{
  Vec              v, Kv, part;
  std::vector<Vec> modes(n), masses(n);
  PetscReal        size, norm;

  PetscFunctionBeginUser;
  PetscCall(MatNorm(pencil.model.A, NORM_INFINITY, &size));
  PetscCall(MatCreateVecs(pencil.K, &v, &Kv));
  for (PetscInt i = 0; i < n; i++) {
    PetscScalar lambda;

    PetscCall(EPSGetEigenpair(eps, i, &lambda, NULL, v, NULL));
    if (pencil.swapped) lambda = 1.0 / lambda;
    for (Vec *copy : {&modes[i], &masses[i]}) PetscCall(VecDuplicate(v, copy));
    PetscCall(VecCopy(v, modes[i]));
    PetscCall(MatMult(pencil.K, v, Kv));
    PetscCall(MatMult(pencil.M, v, masses[i]));
    PetscCall(VecNorm(v, NORM_2, &norm));
    PetscCall(VecAXPY(Kv, -lambda, masses[i]));
    if (pencil.swapped) PetscCall(VecAYPX(masses[i], lambda, Kv)); /* K v */
    PetscReal left[2];
    PetscCall(VecNorm(Kv, NORM_2, &left[0]));
    PetscCall(VecGetSubVector(Kv, pencil.dual, &part));
    PetscCall(VecNorm(part, NORM_2, &left[1]));
    PetscCall(VecRestoreSubVector(Kv, pencil.dual, &part));
    q->residual = PetscMax(q->residual, left[0] / (size * norm));
    PetscCall(VecGetSubVector(v, pencil.dual, &part));
    PetscCall(VecSet(part, 0.0));
    PetscCall(VecRestoreSubVector(v, pencil.dual, &part));
    PetscCall(VecNorm(v, NORM_2, &norm));
    q->violation = PetscMax(q->violation, left[1] / norm);
    for (PetscInt j = 0; j <= i; j++) {
      PetscScalar dot;

      PetscCall(VecDot(masses[i], modes[j], &dot));
      q->orthogonality = PetscMax(q->orthogonality, PetscAbsScalar(dot - (i == j ? 1.0 : 0.0)));
    }
  }
  for (std::vector<Vec> *all : {&modes, &masses})
    for (Vec &m : *all) PetscCall(VecDestroy(&m));
  PetscCall(VecDestroy(&v));
  PetscCall(VecDestroy(&Kv));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves with another mass, from the modes of the first one and from nothing */
static PetscErrorCode SolveAgain(const ModesPencil &pencil, EPS eps, PetscInt n, PetscInt its[2])
{
  Vec              scale;
  std::vector<Vec> modes(n);

  PetscFunctionBeginUser;
  for (Vec &m : modes) PetscCall(MatCreateVecs(pencil.K, &m, NULL));
  for (PetscInt i = 0; i < n; i++) PetscCall(EPSGetEigenvector(eps, i, modes[i], NULL));
  PetscCall(MatCreateVecs(pencil.mass, &scale, NULL));
  PetscCall(VecSetRandom(scale, NULL));
  PetscCall(VecAbs(scale));
  PetscCall(VecScale(scale, 0.02)); /* 4 percent of the mass */
  PetscCall(VecShift(scale, 1.0));
  PetscCall(MatDiagonalScale(pencil.mass, scale, scale));
  for (int k = 0; k < 2; k++) {
    PetscCall(ModesPencilSetOperators(pencil, eps));
    if (!k) PetscCall(EPSSetInitialSpace(eps, n, modes.data()));
    PetscCall(EPSSolve(eps));
    PetscCall(EPSGetIterationNumber(eps, &its[k]));
  }
  for (Vec &m : modes) PetscCall(VecDestroy(&m));
  PetscCall(VecDestroy(&scale));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest difference of eigenvalues, relative to the distance from minus sigma */
static PetscErrorCode Compare(EPS eps, PetscInt n, const Reals &lambda, PetscReal sigma, PetscBool show,
                              PetscReal *worst)
{
  PetscFunctionBeginUser;
  *worst = 0.0;
  for (PetscInt i = 0; i < n; i++) {
    PetscScalar found;

    PetscCall(EPSGetEigenvalue(eps, i, &found, NULL));
    if (show)
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %.12g %.12g\n", (double)PetscRealPart(found), (double)lambda(i)));
    *worst = PetscMax(*worst, PetscAbsScalar(found - lambda(i)) / (PetscAbsReal(lambda(i)) + sigma));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  ModesPencil pencil;
  EPS         eps;
  PetscInt    wanted, converged, its, rigid = -1, zero = 0, again[2] = {0, 1};
  PetscReal   sigma = 1e-2, tol, worst;
  Reals       lambda;
  Quality     q;
  PetscBool   show = PETSC_FALSE, warm = PETSC_FALSE;
  bool        good;

  PetscFunctionBeginUser;
  PetscCall(SlepcInitialize(&argc, &argv, NULL, help));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "What is expected of the modes", NULL);
  PetscCall(PetscOptionsReal("-truth_shift", "Eigenvalues are compared relative to their distance from minus this",
                             NULL, sigma, &sigma, NULL));
  PetscCall(PetscOptionsInt("-rigid", "So many eigenvalues are zero", NULL, rigid, &rigid, NULL));
  PetscCall(PetscOptionsBool("-warm", "Solve for another mass, too", NULL, warm, &warm, NULL));
  PetscCall(PetscOptionsBool("-show", "Print the eigenvalues", NULL, show, &show, NULL));
  PetscOptionsEnd();
  PetscCall(ModesPencilCreate(PETSC_COMM_WORLD, &pencil));
  PetscCall(EPSCreate(PETSC_COMM_WORLD, &eps));
  PetscCall(ModesPencilSetOperators(pencil, eps));
  PetscCall(EPSSetFromOptions(eps));
  PetscCall(EPSSolve(eps));
  PetscCall(EPSGetConverged(eps, &converged));
  PetscCall(EPSGetDimensions(eps, &wanted, NULL, NULL));
  PetscCall(EPSGetTolerances(eps, &tol, NULL));
  PetscCall(EPSGetIterationNumber(eps, &its));
  PetscCall(Truth(pencil, sigma, &lambda));
  wanted = PetscMin(wanted, (PetscInt)lambda.size());
  PetscCall(Compare(eps, PetscMin(wanted, converged), lambda, pencil.swapped ? 0.0 : sigma, show, &worst));
  PetscCall(Judge(pencil, eps, PetscMin(wanted, converged), &q));
  while (!pencil.swapped && zero < lambda.size() && lambda(zero) < tol * sigma) zero++;
  if (warm) PetscCall(SolveAgain(pencil, eps, wanted, again));
  /* a residual of tol bounds the error of an eigenvalue by tol, also of one in a cluster */
  good = converged >= wanted && worst <= tol && q.residual <= tol && q.violation <= 1e-12 && q.orthogonality <= 1e-10 &&
         (rigid < 0 || zero == rigid) && again[0] < again[1];
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "modes: %s exist=%d zero=%" PetscInt_FMT " wanted=%" PetscInt_FMT " converged=%" PetscInt_FMT
                        " iterations=%" PetscInt_FMT
                        " difference=%.1e residual=%.1e violation=%.1e orthogonality=%.1e\n",
                        good ? "good" : "BAD", (int)lambda.size(), zero, wanted, converged, its, (double)worst,
                        (double)q.residual, (double)q.violation, (double)q.orthogonality));
  if (warm)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                          "another mass: iterations=%" PetscInt_FMT ", from nothing %" PetscInt_FMT "\n", again[0],
                          again[1]));
  PetscCall(EPSDestroy(&eps));
  PetscCall(ModesPencilDestroy(&pencil));
  PetscCall(SlepcFinalize());
  return good ? 0 : 1;
}
