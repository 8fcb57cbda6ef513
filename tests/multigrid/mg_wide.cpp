static char help[] = "The cycle and products for several vectors at once against those for each.\n\n";

#include "internal.h"
#include "multigrid/blocksa.h"

/* Applies f to a multivector of random vectors, and g to each of these */
template <class F, class G>
static PetscErrorCode Compare(const char what[], Mat A, PetscInt width, PetscReal bound, F f, G g)
{
  Vec       x, y, v, w;
  PetscReal worst = 0.0;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, &v, &w));
  PetscCall(AinsworthMultivectorCreate(v, width, &x));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(SetRandom(x, (int)width));
  PetscCall(f(x, y));
  for (PetscInt k = 0; k < width; k++) {
    PetscReal norm, difference;

    PetscCall(VecStrideGather(x, k, v, INSERT_VALUES));
    PetscCall(g(v, w));
    PetscCall(VecStrideGather(y, k, v, INSERT_VALUES));
    PetscCall(VecNorm(w, NORM_2, &norm));
    PetscCall(VecAXPY(v, -1.0, w));
    PetscCall(VecNorm(v, NORM_2, &difference));
    worst = PetscMax(worst, difference / norm);
  }
  PetscCall(Check(what, worst, bound));
  for (Vec *made : {&x, &y, &v, &w}) PetscCall(VecDestroy(made));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On each rank one component after the other, so that the levels sort them */
static PetscErrorCode ByComponents(PetscInt bs, Mat *A)
{
  std::vector<PetscInt> rows;
  PetscInt              start, end;
  IS                    order;
  Mat                   permuted;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(*A, &start, &end));
  for (PetscInt c = 0; c < bs; c++)
    for (PetscInt i = start + c; i < end; i += bs) rows.push_back(i);
  PetscCall(ISCreateGeneral(PETSC_COMM_WORLD, (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, &order));
  PetscCall(MatPermute(*A, order, order, &permuted));
  PetscCall(ISDestroy(&order));
  PetscCall(MatDestroy(A));
  *A = permuted;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cycle in single precision rounds at other places */
static PetscErrorCode Cycle(const Lattice &l, const std::string &levels, bool sorted, PetscInt width)
{
  const bool  single = levels != "double";
  Options     options("-pc_blocksa_coarse_eq_limit 20 -pc_blocksa_precision " + levels);
  Mat         A, half, wideA;
  KSP         ksp;
  PC          pc, wide;
  PetscBool   usual;
  PC_BlockSA *sa;
  Vec         b, x;

  PetscFunctionBeginUser;
  PetscCall(LatticeCreate(l, &A));
  if (sorted) PetscCall(ByComponents(l.bs, &A));
  else PetscCall(LatticeSetNearNullSpace(l, A));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(MatCreateVecs(A, &x, &b));
  PetscCall(SetRandom(b, 1));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCBlockSAGet_Private(pc, &sa));
  sa->options.product = PETSC_TRUE;
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(PCBlockSAIsUsual_Private(pc, &usual));
  PetscCall(CheckTrue("usual", usual));
  PetscCall(PCBlockSAWiden_Private(pc, width, &wide));
  PetscCall(Compare(
    "cycle", A, width, single ? 2e-5 : 1e-12, [=](Vec r, Vec z) { return PCApply(wide, r, z); },
    [=](Vec r, Vec z) { return PCApply(pc, r, z); }));
  PetscCall(PCDestroy(&wide));
  PetscCall(PCBlockSAGetProduct_Private(pc, &half));
  for (Mat M : {A, half}) { /* both in the order of A */
    PetscCall(AinsworthWidenMat(M, width, &wideA));
    PetscCall(CheckTrue("A", wideA != NULL));
    PetscCall(Compare(
      "product", A, width, 1e-14, [=](Vec r, Vec z) { return MatMult(wideA, r, z); },
      [=](Vec r, Vec z) { return MatMult(A, r, z); }));
    PetscCall(Compare(
      "product with the transpose", A, width, 1e-14, [=](Vec r, Vec z) { return MatMultTranspose(wideA, r, z); },
      [=](Vec r, Vec z) { return MatMultTranspose(A, r, z); }));
    PetscCall(MatDestroy(&wideA));
  }
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&x));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Other smoothers have no form for several vectors */
static PetscErrorCode Unusual(const std::string &option)
{
  Options   options("-pc_blocksa_coarse_eq_limit 20 -pc_blocksa_precision double " + option);
  Lattice   l;
  Mat       A;
  KSP       ksp;
  PC        pc;
  PetscBool usual;

  PetscFunctionBeginUser;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCBlockSAIsUsual_Private(pc, &usual));
  PetscCall(CheckTrue(option.c_str(), !usual));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (PetscInt bs : {1, 2, 3, 4, 6})
    for (const char *levels : {"double", "single", "single -pc_blocksa_smoother incomplete"})
      for (PetscInt width : {1, (int)AinsworthNarrow, (int)AinsworthWidest})
        for (auto layout : {Lattice::EVEN, Lattice::HOLE})
          for (bool sorted : {false, true}) {
            Lattice l;

            l.bs     = bs;
            l.layout = layout;
            if (sorted && (bs == 1 || layout == Lattice::HOLE)) continue;
            PetscCall(Cycle(l, levels, sorted, width));
          }
  PetscCall(Unusual("-mg_levels_ksp_type richardson"));
  PetscCall(Unusual("-mg_levels_pc_type sor"));
  PetscCall(Unusual("-mg_levels_ksp_chebyshev_eigenvalues 0.1,1.1"));
  PetscCall(Unusual("-pc_mg_type additive"));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
