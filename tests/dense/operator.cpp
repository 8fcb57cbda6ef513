static char help[] = "MATAINSWORTH against the dense A~ = C' B C + Q' A Q, its inverse, its spectrum; f~ and "
                     "lambda.\n\n";

#include "dense.h"
#include <algorithm>

static Column UserPenalty(PetscInt m)
{
  Column B(m);
  for (PetscInt i = 0; i < m; i++) B[i] = 1.5 + Uniform(77, i, 0);
  return B;
}

/* The products of S, in every form that a Mat offers, against the dense matrix */
static PetscErrorCode CheckProducts(Mat S, const Dense &expected, PetscReal tolerance)
{
  Dense  got;
  Column dx, dz, dy;
  Vec    x, y, z, u, v;

  PetscFunctionBeginUser;
  PetscCall(Gather(S, got));
  PetscCall(CheckEqual("A~", got, expected, tolerance));
  PetscCall(MatCreateVecs(S, &x, &y));
  PetscCall(GatherOperator(
    y, x, [S](Vec a, Vec b) { return MatMultTranspose(S, a, b); }, got));
  PetscCall(CheckEqual("transpose of A~", got, expected.transpose(), tolerance));
  PetscCall(GatherOperator(
    y, x, [S](Vec a, Vec b) { return MatMultHermitianTranspose(S, a, b); }, got));
  PetscCall(CheckEqual("adjoint of A~", got, expected.adjoint(), tolerance));
  PetscCall(VecDuplicate(x, &z));
  PetscCall(SetRandom(x, 5));
  PetscCall(SetRandom(z, 6));
  PetscCall(Gather(x, dx));
  PetscCall(Gather(z, dz));
  PetscCall(MatMultAdd(S, x, z, y));
  PetscCall(Gather(y, dy));
  PetscCall(CheckEqual("MatMultAdd()", dy, dz + expected * dx, tolerance));
  PetscCall(MatMultTransposeAdd(S, x, z, y));
  PetscCall(Gather(y, dy));
  PetscCall(CheckEqual("MatMultTransposeAdd()", dy, dz + expected.transpose() * dx, tolerance));
  PetscCall(MatMultAdd(S, x, z, z));
  PetscCall(Gather(z, dy));
  PetscCall(CheckEqual("MatMultAdd() in place", dy, dz + expected * dx, tolerance));
  PetscCall(MatCreateVecs(S, &u, &v));
  PetscCall(CheckTrue("MatCreateVecs() gives vectors that fit", u && v));
  for (Vec w : {x, y, z, u, v}) PetscCall(VecDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* f~ = C' B g + Q' (f - A R g) and lambda = R' (f - A x) */
static PetscErrorCode CheckVectors(Mat S, const System &sys, const DenseSystem &d, const DenseProjector &p,
                                   const Column &B, PetscReal tolerance)
{
  Vec    rhs, x, lambda;
  Column got, dx;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(sys.f, &rhs));
  PetscCall(VecDuplicate(sys.f, &x));
  PetscCall(VecDuplicate(sys.g, &lambda));
  PetscCall(MatAinsworthComputeRHS(S, sys.f, sys.g, rhs));
  PetscCall(Gather(rhs, got));
  PetscCall(CheckEqual("f~", got, d.C.adjoint() * (B.asDiagonal() * d.g) + p.Q.adjoint() * (d.f - d.A * (p.R * d.g)),
                       tolerance));
  PetscCall(MatAinsworthComputeRHS(S, sys.f, NULL, rhs));
  PetscCall(Gather(rhs, got));
  PetscCall(CheckEqual("f~ without g", got, p.Q.adjoint() * d.f, tolerance));
  PetscCall(VecSet(lambda, 0.0));
  PetscCall(MatAinsworthComputeRHS(S, sys.f, lambda, rhs));
  PetscCall(Gather(rhs, got));
  PetscCall(CheckEqual("f~ with g = 0", got, p.Q.adjoint() * d.f, tolerance));
  PetscCall(SetRandom(x, 8));
  PetscCall(Gather(x, dx));
  PetscCall(MatAinsworthComputeMultiplier(S, sys.f, x, lambda));
  PetscCall(Gather(lambda, got));
  PetscCall(CheckEqual("lambda", got, p.R.adjoint() * (d.f - d.A * dx), tolerance));
  PetscCall(VecDestroy(&rhs));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&lambda));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A~^{-1} = Q (Q' A Q)^+ Q' + R B^{-1} R'; Q (Q' A Q)^+ Q' = Z (Z' A Z)^{-1} Z' for any basis Z of Ker C */
static PetscErrorCode CheckInverse(const Dense &reduced, const DenseSystem &d, const DenseProjector &p, const Column &B,
                                   bool illConditioned)
{
  const Eigen::Index n = d.A.rows(), m = d.C.rows();
  const Dense        V = Eigen::HouseholderQR<Dense>(d.C.adjoint()).householderQ();
  const Dense        Z = V.rightCols(n - m), kernel = Z * (Z.adjoint() * d.A * Z).inverse() * Z.adjoint();
  const Dense        inverse = kernel + p.R * B.cwiseInverse().asDiagonal() * p.R.adjoint();
  const Dense        QAQ     = p.Q.adjoint() * d.A * p.Q;

  PetscFunctionBeginUser;
  PetscCall(
    CheckEqual("A~ times its inverse", reduced * inverse, Dense::Identity(n, n), illConditioned ? 1e-5 : 1e-11));
  if (!illConditioned)
    PetscCall(CheckEqual("Q (Q' A Q)^+ Q'", p.Q * QAQ.completeOrthogonalDecomposition().pseudoInverse() * p.Q.adjoint(),
                         kernel, 1e-9));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Formulas(const Spec &spec)
{
  System      sys;
  DenseSystem d;
  Mat         S;
  Vec         penalty;
  const bool  ill = spec.jump != 1.0 || spec.rowscale != 0.0;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(MatCreateAinsworth(sys.A, sys.C, &S));
  for (int type = 0; type < 3; type++) {
    for (bool user : {false, true}) {
      const Column B = user ? UserPenalty(spec.m) : RowPenalty(d.A, d.C);
      const Column W = type == MAT_AINSWORTH_WEIGHT_USER
                         ? d.w
                         : (type == MAT_AINSWORTH_WEIGHT_IDENTITY ? Column(Column::Ones(spec.n)) : DiagonalWeight(d.A));
      Dense        dense;

      Case("%s, weight %s, penalty %s", spec.name, MatAinsworthWeightTypes[type], user ? "user" : "row");
      if (type == MAT_AINSWORTH_WEIGHT_USER) PetscCall(MatAinsworthSetWeight(S, sys.w));
      else PetscCall(MatAinsworthSetWeightType(S, (MatAinsworthWeightType)type));
      if (user) {
        PetscCall(VecDuplicate(sys.g, &penalty));
        PetscCall(Scatter(B, penalty));
        PetscCall(MatAinsworthSetPenalty(S, penalty));
        PetscCall(VecDestroy(&penalty));
      } else PetscCall(MatAinsworthSetPenalty(S, NULL));
      const DenseProjector p(d.C, W);
      PetscCall(CheckProducts(S, ReducedOperator(d.A, d.C, p.Q, B), 1e-11));
      PetscCall(CheckVectors(S, sys, d, p, B, 1e-11));
      PetscCall(Gather(S, dense));
      PetscCall(CheckInverse(dense, d, p, B, ill));
    }
  }
  PetscCall(MatDestroy(&S));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   W = I, B = I: the bound of section 3.2 with lambda(C C') on Im C', and more: the spectrum of A~ is that of C C'
   together with that of A on Ker C
*/
static PetscErrorCode Spectrum(const Spec &spec)
{
  System      sys;
  DenseSystem d;
  Mat         S;
  Vec         ones;
  Dense       dense;

  PetscFunctionBeginUser;
  if (!spec.symmetric) PetscFunctionReturn(PETSC_SUCCESS);
  Case("%s, spectrum", spec.name);
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(MatCreateAinsworth(sys.A, sys.C, &S));
  PetscCall(MatAinsworthSetWeightType(S, MAT_AINSWORTH_WEIGHT_IDENTITY));
  PetscCall(VecDuplicate(sys.g, &ones));
  PetscCall(VecSet(ones, 1.0));
  PetscCall(MatAinsworthSetPenalty(S, ones));
  PetscCall(Gather(S, dense));

  const Dense           V = Eigen::HouseholderQR<Dense>(d.C.adjoint()).householderQ(), Z = V.rightCols(spec.n - spec.m);
  const Eigen::VectorXd reduced = dense.selfadjointView<Eigen::Lower>().eigenvalues(),
                        A       = d.A.selfadjointView<Eigen::Lower>().eigenvalues();
  const Eigen::VectorXd CC      = Dense(d.C * d.C.adjoint()).selfadjointView<Eigen::Lower>().eigenvalues(),
                        ZAZ     = Dense(Z.adjoint() * d.A * Z).selfadjointView<Eigen::Lower>().eigenvalues();
  const PetscReal low = PetscMin(A.minCoeff(), CC.minCoeff()), high = PetscMax(A.maxCoeff(), CC.maxCoeff());
  Eigen::VectorXd both(spec.n);

  PetscCall(CheckEqual("A~ is symmetric", dense, dense.adjoint(), 1e-12));
  PetscCall(Check("lower bound minus smallest eigenvalue", low - reduced.minCoeff(), 1e-13 * high));
  PetscCall(Check("largest eigenvalue minus upper bound", reduced.maxCoeff() - high, 1e-13 * high));
  both << CC, ZAZ;
  std::sort(both.data(), both.data() + spec.n);
  PetscCall(
    Check("spectrum of A~ against that of CC' and of A on Ker C", (reduced - both).norm(), 1e-13 * high * spec.n));
  PetscCall(CheckTrue("A~ is positive definite", both.minCoeff() > 0.0));
  PetscCall(VecDestroy(&ones));
  PetscCall(MatDestroy(&S));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Other ways to make one, copies, and values of A and C that change in place */
static PetscErrorCode Life()
{
  Spec        spec;
  System      sys;
  DenseSystem d;
  Mat         S, copy, A, C;
  PetscInt    bs;
  VecType     type;
  PetscBool   same;
  PetscViewer viewer;
  std::string text;

  PetscFunctionBeginUser;
  spec.bs     = 2;
  spec.uneven = true;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  const Dense expected = ReducedOperator(d.A, d.C, DenseProjector(d.C, DiagonalWeight(d.A)).Q, RowPenalty(d.A, d.C));

  Case("MatSetType()");
  PetscCall(MatCreate(PETSC_COMM_WORLD, &S));
  PetscCall(MatSetType(S, MATAINSWORTH));
  PetscCall(MatAinsworthGetMats(S, &A, &C));
  PetscCall(CheckTrue("no blocks yet", !A && !C));
  PetscCall(MatAinsworthSetMats(S, sys.A, sys.C));
  PetscCall(MatAinsworthGetMats(S, &A, &C));
  PetscCall(CheckTrue("the blocks that were given", A == sys.A && C == sys.C));
  PetscCall(CheckProducts(S, expected, 1e-12));
  PetscCall(MatGetBlockSize(S, &bs));
  PetscCall(CheckInt("block size", bs, spec.bs));
  PetscCall(MatGetVecType(S, &type));
  PetscCall(PetscStrcmp(type, VECSTANDARD, &same));
  PetscCall(CheckTrue("vector type", same));

  Case("MatSetUp() without blocks");
  PetscCall(MatCreate(PETSC_COMM_WORLD, &copy));
  PetscCall(MatSetSizes(copy, PETSC_DECIDE, PETSC_DECIDE, spec.n, spec.n));
  PetscCall(MatSetType(copy, MATAINSWORTH));
  PetscCall(MatSetUp(copy));
  PetscCall(PetscViewerASCIIOpen(PETSC_COMM_WORLD, "view.txt", &viewer));
  PetscCall(MatView(copy, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(FileText("view.txt", text));
  PetscCall(CheckText("view", text, {"type: ainsworth", "not set up"}));
  PetscCall(MatDestroy(&copy));

  Case("MatDuplicate()");
  PetscCall(MatAinsworthSetWeight(S, sys.w));
  PetscCall(MatDuplicate(S, MAT_COPY_VALUES, &copy));
  PetscCall(MatDestroy(&S));
  PetscCall(CheckProducts(copy, ReducedOperator(d.A, d.C, DenseProjector(d.C, d.w).Q, RowPenalty(d.A, d.C)), 1e-12));
  PetscCall(MatAinsworthSetWeightType(copy, MAT_AINSWORTH_WEIGHT_DIAGONAL));
  PetscCall(CheckProducts(copy, expected, 1e-12));
  PetscCall(MatDuplicate(copy, MAT_COPY_VALUES, &S));
  PetscCall(CheckProducts(S, expected, 1e-12));
  PetscCall(MatDestroy(&S));

  Case("A changed in place");
  PetscCall(MatDiagonalScale(sys.A, sys.w, sys.w));
  PetscCall(Gather(sys, d));
  PetscCall(CheckProducts(
    copy, ReducedOperator(d.A, d.C, DenseProjector(d.C, DiagonalWeight(d.A)).Q, RowPenalty(d.A, d.C)), 1e-12));
  Case("C changed in place");
  PetscCall(MatDiagonalScale(sys.C, NULL, sys.w));
  PetscCall(Gather(sys, d));
  PetscCall(CheckProducts(
    copy, ReducedOperator(d.A, d.C, DenseProjector(d.C, DiagonalWeight(d.A)).Q, RowPenalty(d.A, d.C)), 1e-12));
  Case("C changed in place with W = I");
  PetscCall(MatAinsworthSetWeightType(copy, MAT_AINSWORTH_WEIGHT_IDENTITY));
  PetscCall(MatScale(sys.C, -3.0));
  PetscCall(MatScale(sys.A, 2.0));
  PetscCall(Gather(sys, d));
  PetscCall(CheckProducts(
    copy, ReducedOperator(d.A, d.C, DenseProjector(d.C, Column::Ones(spec.n)).Q, RowPenalty(d.A, d.C)), 1e-12));

  Case("operations that a duplicate would lose");
  PetscCall(CheckError("MatScale()", [copy]() { return MatScale(copy, 2.0); }, PETSC_ERR_SUP, {MATAINSWORTH}));
  PetscCall(CheckProducts(
    copy, ReducedOperator(d.A, d.C, DenseProjector(d.C, Column::Ones(spec.n)).Q, RowPenalty(d.A, d.C)), 1e-12));
  PetscCall(MatDestroy(&copy));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const Spec &spec : UsualSpecs()) PetscCall(Formulas(spec));
  for (const Spec &spec : UsualSpecs()) PetscCall(Spectrum(spec));
  PetscCall(Life());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
