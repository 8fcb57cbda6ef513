static char help[] = "Systems [A B'; C -D]: any D, B that is not C, rows and columns of one side only.\n\n";

#include "layout.h"

/*
   The diagonal of D: a scale for rows of C that are not zero, others for those that are (every third); 0 on even rows
   of C where sparse
*/
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

/* An AIJ with the entries of a dense matrix that are not zero, in the layout of rows and columns of two others */
static PetscErrorCode Fill(const Dense &values, PetscInt localRows, PetscInt localColumns, PetscInt bs, Mat *M)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreate(PETSC_COMM_WORLD, M));
  PetscCall(MatSetSizes(*M, localRows, localColumns, (PetscInt)values.rows(), (PetscInt)values.cols()));
  PetscCall(MatSetBlockSize(*M, bs));
  PetscCall(MatSetType(*M, MATAIJ));
  PetscCall(MatSetUp(*M));
  PetscCall(MatSetOption(*M, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatGetOwnershipRange(*M, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < (PetscInt)values.cols(); j++)
      if (values(i, j) != 0.0) PetscCall(MatSetValue(*M, i, j, values(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The solution of [A Bt; C E] [x; lambda] = [f; g], by LU with full pivoting of the system with rows and columns scaled
   to largest entries of 1
*/
static Column SolveDense(const Dense &A, const Dense &Bt, const Dense &C, const Dense &E, const Column &f,
                         const Column &g)
{
  const Eigen::Index n = A.rows(), m = C.rows();
  Dense              K(n + m, n + m);
  Column             b(n + m), rows = Column::Ones(n + m), cols = Column::Ones(n + m);

  K << A, Bt, C, E;
  b << f, g;
  for (int sweep = 0; sweep < 30; sweep++) {
    for (Eigen::Index i = 0; i < n + m; i++) {
      const PetscReal scale = 1.0 / PetscSqrtReal(K.row(i).cwiseAbs().maxCoeff());

      K.row(i) *= scale;
      rows[i] *= scale;
    }
    for (Eigen::Index j = 0; j < n + m; j++) {
      const PetscReal scale = 1.0 / PetscSqrtReal(K.col(j).cwiseAbs().maxCoeff());

      K.col(j) *= scale;
      cols[j] *= scale;
    }
  }
  return cols.cwiseProduct(Column(K.fullPivLu().solve(rows.cwiseProduct(b))));
}

/* What the program passes: blocks (0,1), (1,0) and (1,1) */
struct Blocks {
  Dense A, Bt, C, E;
};

static PetscInt iterations; /* of the last reduced solve */

static PetscErrorCode CheckForm(const char *name, const System &sys, const DenseSystem &d, const Blocks &blocks,
                                const std::string &text, bool refused = false, PetscReal tolerance = 1e-7)
{
  KSP            inner;
  const PetscInt n = (PetscInt)d.A.rows(), m = (PetscInt)blocks.C.rows();
  PetscInt       ln, lm, bs;
  Options        options((text.find("ksp_rtol") == std::string::npos ? "-ainsworth_ksp_rtol 1e-12 " : "") + text);
  Mat            A, Bt, C, E, nest;
  System         own = sys;
  KSP            ksp;
  PC             pc;
  Column         x, lambda, y;
  const char    *why;

  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("%s %s", name, text.c_str());
  PetscCall(MatGetLocalSize(sys.C, &lm, &ln));
  PetscCall(MatGetBlockSize(sys.A, &bs));
  lm = m == (PetscInt)d.C.rows() ? lm : 2 * lm;
  PetscCall(Fill(blocks.A, ln, ln, bs, &A));
  PetscCall(Fill(blocks.Bt, ln, lm, 1, &Bt));
  PetscCall(Fill(blocks.C, lm, ln, 1, &C));
  PetscCall(Fill(blocks.E, lm, lm, 1, &E));
  PetscCall(MatCreateVecs(C, NULL, &own.g));
  own.A               = A;
  own.C               = C;
  Column gd           = Column::Zero(m);
  gd.head(d.g.size()) = d.g;
  if (m > d.g.size()) gd.tail(d.g.size()) = d.g;
  PetscCall(Scatter(gd, own.g));
  PetscCall(NestCreate(A, Bt, C, E, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(SolveFields(ksp, own, false, false, x, lambda));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetIterationNumber(inner, &iterations));
  if (refused) PetscCall(CheckTrue("refused with a text", reason < 0 && why[0]));
  else {
    PetscCall(CheckTrue(why, reason > 0));
    y = SolveDense(blocks.A, blocks.Bt, blocks.C, blocks.E, d.f, gd);
    PetscCall(CheckEqual("x", x, y.head(n), tolerance));
    PetscCall(CheckEqual("C' lambda", blocks.Bt * lambda, blocks.Bt * y.tail(m), 10 * tolerance));
    PetscCall(CheckEqual("C x + E lambda", blocks.C * x + blocks.E * lambda, gd, 10 * tolerance));
  }
  PetscCall(KSPDestroy(&ksp));
  for (Mat *M : {&nest, &A, &Bt, &C, &E}) PetscCall(MatDestroy(M));
  PetscCall(VecDestroy(&own.g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D diagonal over 600 decades, mixed, coupled, of rank one; of another sign */
static PetscErrorCode CheckCompliance(const Spec &spec)
{
  System      sys;
  DenseSystem d;
  Dense       mass, laplacian, mixed;
  Column      own;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  const Eigen::Index m    = d.C.rows();
  const Dense        I    = Dense::Identity(m, m);
  const PetscReal    size = PetscRealPart((d.C * d.A.diagonal().cwiseInverse().asDiagonal() * d.C.adjoint()).trace()) /
                         (PetscReal)m;

  mass = laplacian = Dense::Zero(m, m);
  mixed            = Dense::Zero(m, m);
  for (Eigen::Index i = 0; i < m; i++) {
    mass(i, i) = 4.0;
    if (i) {
      mass(i, i - 1) = mass(i - 1, i) = 1.0;
      laplacian(i, i) += 1.0;
      laplacian(i - 1, i - 1) += 1.0;
      laplacian(i, i - 1) = laplacian(i - 1, i) = -1.0;
    }
    mixed(i, i) = i % 3 ? PetscPowReal(10.0, 16.0 * Uniform(7, (PetscInt)i, 0)) : 0.0;
  }
  for (PetscReal scale : {1e-300, 1e-16, 1e-8, 1e-3, 1.0, 1e3, 1e12, 1e300}) {
    if (spec.semidefinite && scale > 1e3) continue; /* a body on springs as soft as that floats */
    const std::string factor = " D " + std::to_string((int)PetscLog10Real(scale));

    PetscCall(CheckForm(("diagonal" + factor).c_str(), sys, d, {d.A, d.C.adjoint(), d.C, -scale * size * I}, ""));
    if (scale < 1e-8 || scale > 1e3) continue; /* dense LU has no digits for what D leaves free */
    PetscCall(CheckForm(("mass" + factor).c_str(), sys, d, {d.A, d.C.adjoint(), d.C, -scale * size * mass}, ""));
    PetscCall(
      CheckForm(("laplacian" + factor).c_str(), sys, d, {d.A, d.C.adjoint(), d.C, -scale * size * laplacian}, ""));
    PetscCall(CheckForm(("-C'" + factor).c_str(), sys, d, {d.A, -d.C.adjoint(), d.C, scale * size * mass}, ""));
  }
  for (const char *option :
       {"", "-ainsworth_ksp_type gmres", "-ainsworth_ksp_type minres", "-ainsworth_ksp_type pipecg",
        "-pc_ainsworth_pmat jcb", "-pc_ainsworth_pmat cc", "-pc_ainsworth_weight identity",
        "-pc_ainsworth_variant paper", "-pc_ainsworth_rows_per_rank 2"}) {
    /* one penalty for all */
    if (spec.semidefinite && (std::string(option).find("paper") != std::string::npos)) continue;
    PetscCall(CheckForm("mixed", sys, d, {d.A, d.C.adjoint(), d.C, -size * mixed}, option));
    PetscCall(CheckForm("mass", sys, d, {d.A, d.C.adjoint(), d.C, -size * mass}, option));
  }
  /* of code_aster: two multipliers to a row */
  Dense CC(2 * m, d.C.cols()), twice(2 * m, 2 * m);
  CC << d.C, d.C;
  for (PetscReal scale : {1e-4, 1.0, 1e4}) {
    twice << -scale * size * I, scale * size * I, scale * size * I, -scale * size * I;
    /* what a singular D leaves free has no energy but that of rounding, which ends conjugate gradients near 1e-12 */
    PetscCall(CheckForm("double multipliers", sys, d, {d.A, CC.adjoint(), CC, twice}, "-ainsworth_ksp_rtol 1e-10"));
  }
  if (!spec.semidefinite) {
    PetscCall(CheckForm("negative D", sys, d, {d.A, d.C.adjoint(), d.C, 1e3 * size * I}, ""));
    PetscCall(CheckForm("indefinite", sys, d, {d.A, d.C.adjoint(), d.C, 1e-3 * size * I}, "")); /* GMRES takes over */
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   However large D is, as many iterations as without it or without constraints; rows of C are close to each other, as on
   curved contact of a soft body
*/
static PetscErrorCode CheckIterations(const Spec &spec)
{
  System      sys;
  DenseSystem d;
  PetscInt    least = 0;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  const Eigen::Index m = d.C.rows();

  for (Eigen::Index i = 1; i < m; i++) d.C.row(i) = 0.2 * d.C.row(i) + d.C.row(0) * PetscReal(1.0 + i);
  const Column flexibility = (d.C * d.A.diagonal().cwiseInverse().asDiagonal() * d.C.adjoint()).diagonal();

  for (PetscReal scale : {0.0, 1e-16, 1e-8, 1e-4, 1e-2, 1.0, 1e2, 1e8}) {
    const Dense D = Dense((scale * flexibility).asDiagonal());

    PetscCall(CheckForm(("iterations, D " + std::to_string(scale)).c_str(), sys, d, {d.A, d.C.adjoint(), d.C, -D}, "",
                        false, 1e-6));
    if (scale == 0.0) least = iterations;
    PetscCall(Check("iterations", (PetscReal)iterations, (PetscReal)least + 2.0));
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A fixed number of iterations inside a flexible method: nothing was asked of them, and rows of a large D are no reason
   to refuse what they have
*/
static PetscErrorCode CheckFixed(const Spec &spec)
{
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (PetscReal scale : {1e-3, 1e3, 1e6})
    PetscCall(CheckForm("three iterations", sys, d,
                        {d.A, d.C.adjoint(), d.C, -scale * Dense::Identity(d.C.rows(), d.C.rows())},
                        "-ksp_type fgmres -ksp_rtol 1e-12 -ainsworth_ksp_max_it 3 -ainsworth_ksp_norm_type none "
                        "-ainsworth_ksp_convergence_test skip",
                        false, 1e-6));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* B is not C, as with friction; rows and columns of one side only */
static PetscErrorCode CheckSides(const Spec &spec)
{
  System      sys;
  DenseSystem d;
  Dense       B, friction, E, A;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  const Eigen::Index m = d.C.rows(), n = d.A.rows();
  const Dense        none = Dense::Zero(m, m);

  for (PetscReal change : {1e-8, 0.1, 0.3, 1.0}) {
    B = d.C;
    for (Eigen::Index i = 0; i < m; i++)
      for (Eigen::Index j = 0; j < n; j++) B(i, j) *= 1.0 + change * Uniform(11, (PetscInt)i, (PetscInt)j);
    for (const char *option : {"", "-ainsworth_ksp_type fgmres", "-ainsworth_ksp_type bcgs", "-pc_ainsworth_pmat jcb"})
      PetscCall(CheckForm("other values", sys, d, {d.A, B.adjoint(), d.C, none}, option, false, 1e-6));
    PetscCall(CheckForm("other values, springs", sys, d, {d.A, B.adjoint(), d.C, -0.1 * Dense::Identity(m, m)}, "",
                        false, 1e-6));
  }
  friction = Dense::Identity(m, m);
  for (Eigen::Index i = 0; i + 1 < m; i += 2) friction(i, i + 1) = 0.5;
  PetscCall(CheckForm("friction", sys, d, {d.A, d.C.adjoint() * friction, d.C, none}, "", false, 1e-6));
  PetscCall(CheckForm(
    "signs", sys, d,
    {d.A, d.C.adjoint() * Dense(Column::NullaryExpr(m, [](Eigen::Index i) { return i % 2 ? 1.0 : -1.0; }).asDiagonal()),
     d.C, none},
    "", false, 1e-6));

  /*
     inactive rows as primal-dual active sets write them: nothing in C, the column of B is left; and the other way round
  */
  Dense C = d.C;
  E       = none;
  for (Eigen::Index i = 0; i < m; i += 2) {
    C.row(i).setZero();
    E(i, i) = i % 4 ? 2.0 : -0.5;
  }
  PetscCall(CheckForm("inactive rows", sys, d, {d.A, d.C.adjoint(), C, E}, ""));
  PetscCall(CheckForm("passive rows", sys, d, {d.A, C.adjoint(), d.C, E}, ""));
  E(0, m - 1) = 0.25;
  E(m - 1, 0) = -0.5;
  PetscCall(CheckForm("inactive rows that D couples", sys, d, {d.A, d.C.adjoint(), C, E}, "", false, 1e-6));

  /* Dirichlet rows, in A alone and in both blocks, with their columns left in place */
  A        = d.A;
  Dense Bt = d.C.adjoint();
  for (Eigen::Index i = 0; i < n; i += 5) {
    A.row(i).setZero();
    A(i, i) = 3.0;
    Bt.row(i).setZero();
  }
  PetscCall(CheckForm("Dirichlet rows", sys, d, {A, Bt, d.C, none}, "-ainsworth_ksp_type projectedcg"));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckRefused()
{
  Spec     spec;
  System   sys;
  Mat      nest, D, reduced;
  KSP      ksp, inner;
  PC       pc;
  Vec      x, lambda;
  PetscInt m;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  Case("refused");
  PetscCall(MatGetLocalSize(sys.C, &m, NULL));
  PetscCall(MatCreateShell(PETSC_COMM_WORLD, m, m, spec.m, spec.m, NULL, &D)); /* nothing is known of its entries */
  PetscCall(NestCreate(sys.A, NULL, sys.C, D, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(
    CheckError("a shell", [&]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_WRONG, {"no multipliers", "type shell"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&D));
  PetscCall(MatCreateConstantDiagonal(PETSC_COMM_WORLD, m, m, spec.m, spec.m, -1.0, &D));
  PetscCall(NestCreate(sys.A, NULL, sys.C, D, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetOperators(inner, &reduced, NULL));
  PetscCall(VecDuplicate(sys.f, &x));
  PetscCall(VecDuplicate(sys.g, &lambda));
  PetscCall(CheckError("multipliers before a solution",
                       [&]() { return MatAinsworthComputeMultiplier(reduced, sys.f, x, lambda); }, PETSC_ERR_ORDER,
                       {"multipliers", "come with its solution"}));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&lambda));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&D));
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
  PetscCall(CheckFixed(Spec()));
  for (bool uneven : {false, true}) {
    Options options("-ainsworth_pc_type redundant -ainsworth_ksp_max_it 400");
    Spec    spec;

    spec.uneven = uneven;
    PetscCall(CheckCompliance(spec));
    PetscCall(CheckSides(spec));
    spec.jump = 1e-3;
    PetscCall(CheckIterations(spec));
    spec.jump         = 1.0;
    spec.semidefinite = true;
    PetscCall(CheckCompliance(spec));
    PetscCall(CheckSides(spec));
  }
  PetscCall(CheckRefused());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
