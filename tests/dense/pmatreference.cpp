#include "pmatreference.h"
#include <metis.h>

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
  METIS_PartGraphKway(&nvtxs, &one, xadj.data(), adjncy.data(), NULL, NULL, NULL, &nparts, NULL, NULL, options, &cut,
                      part.data());
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
  /* badly scaled rows first make the residual grow */
  PetscCall(KSPSetTolerances(ksp, 0.1, PETSC_DEFAULT, PETSC_MAX_REAL, PETSC_DEFAULT));
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
static PetscErrorCode Inverse(const Dense &S, const PmatChoice &choice, Dense &X)
{
  const Eigen::Index m     = S.rows();
  const bool         exact = choice.type == PC_AINSWORTH_PMAT_CC || choice.type == PC_AINSWORTH_PMAT_BJ_CC;
  const bool         whole = choice.type == PC_AINSWORTH_PMAT_CC || choice.type == PC_AINSWORTH_PMAT_CG;

  PetscFunctionBeginUser;
  X = Dense::Zero(m, m);
  if (choice.type == PC_AINSWORTH_PMAT_ID) PetscFunctionReturn(PETSC_SUCCESS);
  if (choice.type == PC_AINSWORTH_PMAT_JCB) {
    const Column D = choice.rowScaling ? Column(S.diagonal().cwiseSqrt().cwiseInverse()) : Column(Column::Ones(m));
    for (Eigen::Index i = 0; i < m; i++)
      X(i, i) = D[i] * D[i] / Dense(D.asDiagonal() * S * D.asDiagonal()).row(i).cwiseAbs().sum();
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

PetscErrorCode PmatReference(const DenseSystem &d, bool symmetric, const PmatChoice &choice, Dense &M, Column &B)
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
  if (choice.penalty == AINSWORTH_PENALTY_ROW) {
    const PetscReal usual = choice.type == PC_AINSWORTH_PMAT_ID ? 10.0 : 0.5;
    B                     = RowPenalty(d.A, d.C, choice.factor == (PetscReal)PETSC_DEFAULT ? usual : choice.factor);
  } else {
    const PetscReal factor = choice.factor == (PetscReal)PETSC_DEFAULT ? 5.0 : choice.factor;
    B = Column::Constant(m, factor * (symmetric ? Norm1(QAQ) : Norm1(QAQ.adjoint())) / Norm1(d.C.adjoint() * d.C));
  }
  M = ReducedOperator(d.A, d.C, Q, B);
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char *PmatName(int type)
{
  static const char *const names[] = {"jcb", "id", "cc", "cg", "bj_cc", "bj_cg", "auto"};

  return names[type];
}

const char *PenaltyName(AinsworthPenaltyType type)
{
  return type == AINSWORTH_PENALTY_ROW ? "row" : "norm";
}

/* The same as options of PCAINSWORTH: the variants differ in the scaling of rows and in what can be set alone */
static std::string OptionsOf(const PmatChoice &choice)
{
  std::string line = std::string("-pc_ainsworth_variant ") + (choice.rowScaling ? "weighted" : "paper");

  line += std::string(" -pc_ainsworth_pmat ") + PmatName(choice.type) + " -pc_ainsworth_penalty " +
          PenaltyName(choice.penalty) + " -pc_ainsworth_blocks " + std::to_string((long long)choice.blocks);
  if (choice.weight != MAT_AINSWORTH_WEIGHT_USER)
    line += std::string(" -pc_ainsworth_weight ") + MatAinsworthWeightTypes[choice.weight];
  if (choice.factor != (PetscReal)PETSC_DEFAULT)
    line += " -pc_ainsworth_penalty_factor " + std::to_string((double)choice.factor);
  return line;
}

PetscErrorCode PmatSetUp(Mat A, Mat C, Vec w, const PmatChoice &choice, KSP *outer, Mat *S, Mat *M)
{
  Options options(OptionsOf(choice));
  Mat     nest;
  KSP     inner;
  PC      pc, innerPC;

  PetscFunctionBeginUser;
  PetscCall(NestCreate(A, NULL, C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, outer));
  PetscCall(MatDestroy(&nest));
  PetscCall(KSPGetPC(*outer, &pc));
  if (choice.weight == MAT_AINSWORTH_WEIGHT_USER) PetscCall(PCAinsworthSetWeight(pc, w));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetPC(inner, &innerPC));
  PetscCall(PCSetType(innerPC, choice.inner));
  PetscCall(KSPSetUp(*outer));
  PetscCall(KSPGetOperators(inner, S, M));
  PetscFunctionReturn(PETSC_SUCCESS);
}
