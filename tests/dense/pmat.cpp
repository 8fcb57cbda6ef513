static char help[] = "The six M_* = C' B C + Q_*' A Q_* against dense formulas with an independent Inv(S).\n\n";

#include "dense.h"
#include <metis.h>

/* What is tried with each system */
struct Choice {
  PCAinsworthPmatType    type;
  MatAinsworthWeightType weight;
  PCAinsworthPenaltyType penalty;
  PetscReal              factor; /* PETSC_DEFAULT: 0.5 for row, 5 for norm */
  PetscInt               blocks;
  bool                   rowScaling;
};

/* The partition that the plugin documents: METIS on the graph of S with seed 0 */
static std::vector<PetscInt> Partition(const Dense &S, PetscInt blocks)
{
  const PetscInt        m = S.rows();
  std::vector<idx_t>    xadj(1, 0), adjncy, part(m, 0);
  std::vector<PetscInt> result(m, 0);
  idx_t                 options[METIS_NOPTIONS], nvtxs = (idx_t)m, one = 1, nparts = (idx_t)blocks, cut;

  for (PetscInt i = 0; i < m; i++) result[i] = blocks >= m ? i : 0;
  if (blocks <= 1 || blocks >= m) return result;
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt j = 0; j < m; j++)
      if (j != i && S(i, j) != 0.0) adjncy.push_back((idx_t)j);
    xadj.push_back((idx_t)adjncy.size());
  }
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 0;
  METIS_PartGraphKway(&nvtxs, &one, xadj.data(), adjncy.data(), NULL, NULL, NULL, &nparts, NULL, NULL, options, &cut, part.data());
  for (PetscInt i = 0; i < m; i++) result[i] = (PetscInt)part[i];
  return result;
}

/* Columns by PETSc's own CG with Jacobi to rtol 0.1, of one block */
static PetscErrorCode InverseByCG(const Dense &block, Dense &X)
{
  const PetscInt k = block.rows();
  Mat            S;
  KSP            ksp;
  PC             pc;
  Vec            b, x;
  Column         column;

  PetscFunctionBeginUser;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, k, k, NULL, &S));
  for (PetscInt i = 0; i < k; i++)
    for (PetscInt j = 0; j < k; j++) PetscCall(MatSetValue(S, i, j, block(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(S, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(S, MAT_FINAL_ASSEMBLY));
  PetscCall(KSPCreate(PETSC_COMM_SELF, &ksp));
  PetscCall(KSPSetOperators(ksp, S, S));
  PetscCall(KSPSetType(ksp, KSPCG));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCJACOBI));
  PetscCall(KSPSetTolerances(ksp, 0.1, PETSC_DEFAULT, PETSC_MAX_REAL, PETSC_DEFAULT)); /* badly scaled rows first make the residual grow */
  PetscCall(MatCreateVecs(S, &x, &b));
  X.resize(k, k);
  for (PetscInt j = 0; j < k; j++) {
    PetscCall(Scatter(Column::Unit(k, j), b));
    PetscCall(KSPSolve(ksp, b, x));
    PetscCall(Gather(x, column));
    X.col(j) = column;
  }
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&b));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&S));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inv(S) of Table 1 of the paper; column j is the answer to e_j */
static PetscErrorCode Inverse(const Dense &S, const Choice &choice, Dense &X)
{
  const Eigen::Index m     = S.rows();
  const bool         exact = choice.type == PC_AINSWORTH_PMAT_CC || choice.type == PC_AINSWORTH_PMAT_BJ_CC;
  const bool         whole = choice.type == PC_AINSWORTH_PMAT_CC || choice.type == PC_AINSWORTH_PMAT_CG;

  PetscFunctionBeginUser;
  X = Dense::Zero(m, m);
  if (choice.type == PC_AINSWORTH_PMAT_ID) PetscFunctionReturn(PETSC_SUCCESS);
  if (choice.type == PC_AINSWORTH_PMAT_JCB) {
    const Column D = choice.rowScaling ? Column(S.diagonal().cwiseSqrt().cwiseInverse()) : Column(Column::Ones(m));
    for (Eigen::Index i = 0; i < m; i++) X(i, i) = D[i] * D[i] / Dense(D.asDiagonal() * S * D.asDiagonal()).row(i).cwiseAbs().sum();
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const std::vector<PetscInt> part = Partition(S, whole ? 1 : choice.blocks);
  for (PetscInt k = 0; k < m; k++) {
    std::vector<PetscInt> members;
    for (PetscInt i = 0; i < m; i++)
      if (part[i] == k) members.push_back(i);
    if (members.empty()) continue;
    const Dense block = S(members, members);
    Dense       inverse;
    if (exact) inverse = block.inverse();
    else PetscCall(InverseByCG(block, inverse));
    X(members, members) = inverse;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal Norm1(const Dense &M)
{
  return M.cwiseAbs().colwise().sum().maxCoeff();
}

static PetscErrorCode Reference(const DenseSystem &d, bool symmetric, const Choice &choice, Dense &M, Column &B)
{
  const Eigen::Index n = d.A.rows(), m = d.C.rows();
  Column             W = Column::Ones(n);
  Dense              X, Q, QAQ;

  PetscFunctionBeginUser;
  if (choice.weight == MAT_AINSWORTH_WEIGHT_DIAGONAL) W = DiagonalWeight(d.A);
  if (choice.weight == MAT_AINSWORTH_WEIGHT_USER) W = d.w;
  PetscCall(Inverse(d.C * W.asDiagonal() * d.C.adjoint(), choice, X));
  Q   = Dense::Identity(n, n) - W.asDiagonal() * d.C.adjoint() * X * d.C;
  QAQ = Q.adjoint() * d.A * Q;
  if (choice.penalty == PC_AINSWORTH_PENALTY_ROW) B = RowPenalty(d.A, d.C, choice.factor == (PetscReal)PETSC_DEFAULT ? 0.5 : choice.factor);
  else {
    const PetscReal factor = choice.factor == (PetscReal)PETSC_DEFAULT ? 5.0 : choice.factor;
    B                      = Column::Constant(m, factor * (symmetric ? Norm1(QAQ) : Norm1(QAQ.adjoint())) / Norm1(d.C.adjoint() * d.C));
  }
  M = ReducedOperator(d.A, d.C, Q, B);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Setup(Mat A, Mat C, Vec w, const Choice &choice, KSP *outer, Mat *S, Mat *M)
{
  Mat nest;
  KSP inner;
  PC  pc, none;

  PetscFunctionBeginUser;
  PetscCall(NestCreate(A, NULL, C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, outer));
  PetscCall(MatDestroy(&nest));
  PetscCall(KSPGetPC(*outer, &pc));
  PetscCall(PCAinsworthSetPmatType(pc, choice.type));
  if (choice.weight == MAT_AINSWORTH_WEIGHT_USER) PetscCall(PCAinsworthSetWeight(pc, w));
  else PetscCall(PCAinsworthSetWeightType(pc, choice.weight));
  PetscCall(PCAinsworthSetPenaltyType(pc, choice.penalty));
  PetscCall(PCAinsworthSetPenaltyFactor(pc, choice.factor));
  PetscCall(PCAinsworthSetBlocks(pc, choice.blocks));
  PetscCall(PCAinsworthSetRowScaling(pc, (PetscBool)choice.rowScaling));
  PetscCall(PCAinsworthSetFrameType(pc, PC_AINSWORTH_FRAME_NONE));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetPC(inner, &none));
  PetscCall(PCSetType(none, PCNONE));
  PetscCall(KSPSetUp(*outer));
  PetscCall(KSPGetOperators(inner, S, M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckPmat(Mat A, Mat C, const System &sys, const DenseSystem &d, bool symmetric, const Choice &choice)
{
  KSP       outer;
  Mat       S, M;
  Vec       penalty;
  Dense     got, expected;
  Column    B, gotB;
  PetscBool aij;
  PetscInt  bsA, bsM;

  PetscFunctionBeginUser;
  PetscCall(Setup(A, C, sys.w, choice, &outer, &S, &M));
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)M, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(CheckTrue("M is AIJ", aij));
  PetscCall(MatGetBlockSize(A, &bsA));
  PetscCall(MatGetBlockSize(M, &bsM));
  PetscCall(CheckInt("block size of M", bsM, bsA));
  PetscCall(Reference(d, symmetric, choice, expected, B));
  PetscCall(MatAinsworthGetPenalty(S, &penalty));
  PetscCall(Gather(penalty, gotB));
  PetscCall(CheckEqual("B", gotB, B, 1e-13));
  PetscCall(Gather(M, got));
  PetscCall(CheckEqual("M", got, expected, 1e-13));
  if (choice.type == PC_AINSWORTH_PMAT_CC) { /* exact: M is the reduced operator itself */
    PetscCall(Gather(S, expected));
    PetscCall(CheckEqual("A~ of cc", got, expected, 1e-11));
  }
  PetscCall(KSPDestroy(&outer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Formulas(const Spec &spec, bool all)
{
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (int type = 0; type < 6; type++) {
    for (int k = 0; k < 6; k++) {
      Choice choice{(PCAinsworthPmatType)type, (MatAinsworthWeightType)(k % 3), (PCAinsworthPenaltyType)(k % 2), k < 4 ? (PetscReal)PETSC_DEFAULT : 2.5, 3, k % 4 < 2};

      if (!all && k != type % 4) continue;
      Case("%s, pmat %s, weight %s, penalty %s, factor %g", spec.name, PCAinsworthPmatTypes[choice.type], MatAinsworthWeightTypes[choice.weight], PCAinsworthPenaltyTypes[choice.penalty], (double)choice.factor);
      PetscCall(CheckPmat(sys.A, sys.C, sys, d, spec.symmetric, choice));
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One block is cc and cg, as many blocks as rows are 1/diag(S): without METIS in the test */
static PetscErrorCode Blocks(const Spec &spec)
{
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  for (PetscInt blocks : {(PetscInt)1, (PetscInt)2, spec.m - 1, spec.m, spec.m + 5}) {
    for (PCAinsworthPmatType type : {PC_AINSWORTH_PMAT_BJ_CC, PC_AINSWORTH_PMAT_BJ_CG}) {
      Choice choice{type, MAT_AINSWORTH_WEIGHT_DIAGONAL, PC_AINSWORTH_PENALTY_ROW, PETSC_DEFAULT, blocks, true}, same = choice;
      Dense  M, expected;
      Column B;
      KSP    outer;
      Mat    S, gotM;

      Case("%s, pmat %s with %d blocks", spec.name, PCAinsworthPmatTypes[type], (int)blocks);
      PetscCall(CheckPmat(sys.A, sys.C, sys, d, spec.symmetric, choice));
      PetscCall(Setup(sys.A, sys.C, sys.w, choice, &outer, &S, &gotM));
      PetscCall(Gather(gotM, M));
      PetscCall(CheckEqual("M is symmetric", M, M.adjoint(), type == PC_AINSWORTH_PMAT_BJ_CC ? 1e-14 : 1e-13));
      PetscCall(KSPDestroy(&outer));
      if (blocks == 1) {
        same.type = type == PC_AINSWORTH_PMAT_BJ_CC ? PC_AINSWORTH_PMAT_CC : PC_AINSWORTH_PMAT_CG;
        PetscCall(Reference(d, spec.symmetric, same, expected, B));
        PetscCall(CheckEqual("M with one block", M, expected, 1e-13));
      } else if (blocks >= spec.m) {
        const DenseProjector p(d.C, DiagonalWeight(d.A));
        const Dense          Q = Dense::Identity(spec.n, spec.n) - DiagonalWeight(d.A).asDiagonal() * d.C.adjoint() * p.S.diagonal().cwiseInverse().asDiagonal() * d.C;
        PetscCall(CheckEqual("M with one block per row", M, ReducedOperator(d.A, d.C, Q, RowPenalty(d.A, d.C, 0.5)), 1e-13));
      }
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same M on one rank and on all */
static PetscErrorCode RankCount(const Spec &spec)
{
  System one, all;

  PetscFunctionBeginUser;
  PetscCall(SystemCreate(PETSC_COMM_SELF, spec, &one));
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &all));
  for (int type = 0; type < 6; type++) {
    Choice choice{(PCAinsworthPmatType)type, MAT_AINSWORTH_WEIGHT_DIAGONAL, PC_AINSWORTH_PENALTY_ROW, PETSC_DEFAULT, 3, true};
    KSP    outer[2];
    Mat    S, M;
    Dense  dense[2];

    Case("%s, pmat %s, one rank and all", spec.name, PCAinsworthPmatTypes[type]);
    PetscCall(Setup(one.A, one.C, one.w, choice, &outer[0], &S, &M));
    PetscCall(Gather(M, dense[0]));
    PetscCall(Setup(all.A, all.C, all.w, choice, &outer[1], &S, &M));
    PetscCall(Gather(M, dense[1]));
    PetscCall(CheckEqual("M", dense[1], dense[0], 1e-13));
    PetscCall(KSPDestroy(&outer[0]));
    PetscCall(KSPDestroy(&outer[1]));
  }
  PetscCall(SystemDestroy(&one));
  PetscCall(SystemDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scale of the rows of C does not matter to the default M_* */
static PetscErrorCode RowScales()
{
  Dense M[2];

  PetscFunctionBeginUser;
  Case("rows of C scaled by 1e-3 to 1e3");
  for (int k = 0; k < 2; k++) {
    Spec   spec;
    System sys;
    KSP    outer;
    Mat    S, mat;
    Choice choice{PC_AINSWORTH_PMAT_JCB, MAT_AINSWORTH_WEIGHT_DIAGONAL, PC_AINSWORTH_PENALTY_ROW, PETSC_DEFAULT, 3, true};

    spec.rowscale = 3.0 * k;
    PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
    PetscCall(Setup(sys.A, sys.C, sys.w, choice, &outer, &S, &mat));
    PetscCall(Gather(mat, M[k]));
    PetscCall(KSPDestroy(&outer));
    PetscCall(SystemDestroy(&sys));
  }
  PetscCall(CheckEqual("M", M[1], M[0], 1e-13));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A and C in other formats: the type is the program's own affair */
static PetscErrorCode Formats()
{
  Spec        spec;
  System      sys;
  DenseSystem d;

  PetscFunctionBeginUser;
  spec.bs = 2;
  spec.m  = 6;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(MatSetOption(sys.A, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  for (const char *typeA : {MATBAIJ, MATSBAIJ, MATDENSE}) {
    for (const char *typeC : {MATAIJ, MATBAIJ, MATDENSE}) {
      Choice choice{PC_AINSWORTH_PMAT_JCB, MAT_AINSWORTH_WEIGHT_DIAGONAL, PC_AINSWORTH_PENALTY_ROW, PETSC_DEFAULT, 3, true};
      Mat    A, C;

      Case("A of type %s, C of type %s", typeA, typeC);
      PetscCall(MatConvert(sys.A, typeA, MAT_INITIAL_MATRIX, &A));
      PetscCall(MatConvert(sys.C, typeC, MAT_INITIAL_MATRIX, &C));
      PetscCall(CheckPmat(A, C, sys, d, true, choice));
      choice.penalty = PC_AINSWORTH_PENALTY_NORM;
      choice.type    = PC_AINSWORTH_PMAT_ID;
      PetscCall(CheckPmat(A, C, sys, d, true, choice));
      PetscCall(MatDestroy(&A));
      PetscCall(MatDestroy(&C));
    }
  }
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const Spec &spec : UsualSpecs()) PetscCall(Formulas(spec, spec.seed % 2)); /* the plain and the non-symmetric one in all combinations */
  for (int k : {0, 3, 5}) PetscCall(Blocks(UsualSpecs()[k]));
  for (int k : {2, 3, 5}) PetscCall(RankCount(UsualSpecs()[k]));
  PetscCall(RowScales());
  PetscCall(Formats());
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
