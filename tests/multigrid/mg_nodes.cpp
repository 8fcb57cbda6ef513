static char help[] = "PCBLOCKSA on matrices whose unknowns are not sorted by nodes: the cycle of the sorted "
                     "matrix.\n\n";

#include "lattice.h"
#include <random>

enum Order {
  COMPONENTS, /* on each rank one component after the other */
  ELEMENTS,   /* so for some nodes after some others, as a program meets them element by element */
  SHUFFLED    /* in any order; nodes by their first unknowns */
};
static const char *const names[] = {"components", "elements", "shuffled"};

/* Which unknown of A, on this rank, becomes which */
static std::vector<PetscInt> MakeOrder(Order kind, PetscInt bs, PetscInt nodes)
{
  const PetscInt        group = kind == COMPONENTS ? PetscMax(nodes, 1) : 3;
  std::vector<PetscInt> order;

  for (PetscInt first = 0; first < nodes; first += group)
    for (PetscInt c = 0; c < bs; c++)
      for (PetscInt node = first; node < PetscMin(first + group, nodes); node++) order.push_back(node * bs + c);
  if (kind == SHUFFLED) std::shuffle(order.begin(), order.end(), std::mt19937(17));
  return order;
}

/* The matrix in another order, without zeros if wanted; the block size is lost */
static PetscErrorCode Reorder(Mat mat, IS order, bool zeros, Mat *to)
{
  Mat      all;
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatPermute(mat, order, order, &all));
  PetscCall(MatCreate(PETSC_COMM_WORLD, to));
  PetscCall(MatGetOwnershipRange(all, &start, &end));
  PetscCall(MatSetSizes(*to, end - start, end - start, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetType(*to, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*to, 200, NULL));
  PetscCall(MatMPIAIJSetPreallocation(*to, 200, NULL, 200, NULL));
  for (PetscInt i = start; i < end; i++) {
    PetscInt           n;
    const PetscInt    *cols;
    const PetscScalar *v;

    PetscCall(MatGetRow(all, i, &n, &cols, &v));
    for (PetscInt k = 0; k < n; k++)
      if (zeros || v[k] != 0.0) PetscCall(MatSetValue(*to, i, cols[k], v[k], INSERT_VALUES));
    PetscCall(MatRestoreRow(all, i, &n, &cols, &v));
  }
  PetscCall(MatAssemblyBegin(*to, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*to, MAT_FINAL_ASSEMBLY));
  PetscCall(MatDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Permute(Vec from, const std::vector<PetscInt> &order, Vec to)
{
  const PetscScalar *a;
  PetscScalar       *b;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(from, &a));
  PetscCall(VecGetArrayWrite(to, &b));
  for (size_t l = 0; l < order.size(); l++) b[l] = a[order[l]];
  PetscCall(VecRestoreArrayWrite(to, &b));
  PetscCall(VecRestoreArrayRead(from, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReorderNearNullSpace(Mat A, const std::vector<PetscInt> &order, Mat to)
{
  MatNullSpace     near;
  PetscBool        constant;
  PetscInt         n;
  const Vec       *given;
  std::vector<Vec> v;

  PetscFunctionBeginUser;
  PetscCall(MatGetNearNullSpace(A, &near));
  PetscCall(MatNullSpaceGetVecs(near, &constant, &n, &given));
  for (PetscInt k = 0; k < n; k++) {
    v.push_back(NULL);
    PetscCall(MatCreateVecs(to, &v[k], NULL));
    PetscCall(Permute(given[k], order, v[k]));
  }
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, n, v.data(), &near));
  PetscCall(MatSetNearNullSpace(to, near));
  PetscCall(MatNullSpaceDestroy(&near));
  for (Vec &mode : v) PetscCall(VecDestroy(&mode));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* modes: a near null space is given; otherwise coordinates are, of all unknowns of the unsorted matrix */
static PetscErrorCode Compare(const Lattice &l, Order kind, bool sum, bool zeros, bool modes)
{
  /* aggregates depend on the order of nodes, where those alone are last */
  const bool same = kind != SHUFFLED && (zeros || kind == COMPONENTS);
  Options    options("-pc_blocksa_coarse_eq_limit 40 -pc_blocksa_process_eq_limit 100 -pc_blocksa_precision double");
  Mat        A[2], D[2], M[2];
  KSP        ksp[2];
  PC         pc[2];
  Vec        b[2], x[2];
  IS         is;
  PetscInt   n, start, its[2];
  PetscReal  error, norm;
  std::vector<PetscInt> order, global;
  std::string           view;

  PetscFunctionBeginUser;
  Case("blocks of %d, %s, %s%s%s", (int)l.bs, names[kind], sum ? "sum" : "A", zeros ? "" : ", no zeros",
       modes ? ", modes" : "");
  PetscCall(LatticeCreate(l, &A[0]));
  PetscCall(MatConvert(A[0], MATBAIJ, MAT_INPLACE_MATRIX, &A[0])); /* blocks with all of their entries */
  PetscCall(MatConvert(A[0], MATAIJ, MAT_INPLACE_MATRIX, &A[0]));
  PetscCall(SurfaceCreate(l, A[0], 0.5, 6, &D[0]));
  PetscCall(LatticeSetNearNullSpace(l, A[0]));
  PetscCall(MatGetLocalSize(A[0], &n, NULL));
  PetscCall(MatGetOwnershipRange(A[0], &start, NULL));
  order = MakeOrder(kind, l.bs, n / l.bs);
  for (PetscInt i : order) global.push_back(start + i);
  PetscCall(ISCreateGeneral(PETSC_COMM_WORLD, n, global.data(), PETSC_COPY_VALUES, &is));
  PetscCall(ISSetPermutation(is));
  PetscCall(Reorder(A[0], is, zeros, &A[1]));
  PetscCall(Reorder(D[0], is, true, &D[1]));
  PetscCall(ISDestroy(&is));
  if (modes) PetscCall(ReorderNearNullSpace(A[0], order, A[1]));
  else PetscCall(MatSetNearNullSpace(A[0], NULL));
  for (int k = 0; k < 2; k++) {
    PetscCall(SumCreate(A[k], D[k], &M[k]));
    PetscCall(MultigridCreate(sum ? M[k] : A[k], &ksp[k]));
    PetscCall(KSPGetPC(ksp[k], &pc[k]));
    if (!modes) {
      std::vector<PetscReal> of, x;

      PetscCall(LatticeCoordinates(l, A[0], of));
      for (PetscInt i = 0; i < n && k; i++)
        for (PetscInt d = 0; d < l.dim(); d++) x.push_back(of[order[i] / l.bs * l.dim() + d]);
      PetscCall(PCSetCoordinates(pc[k], l.dim(), k ? n : n / l.bs, k ? x.data() : of.data()));
    }
    PetscCall(KSPSetUp(ksp[k]));
    PetscCall(MatCreateVecs(A[k], &x[k], &b[k]));
  }
  PetscCall(SetRandom(b[0], 5));
  PetscCall(Permute(b[0], order, b[1]));
  for (int k = 0; k < 2; k++) PetscCall(PCApply(pc[k], b[k], x[k]));
  if (same) {
    PetscCall(Permute(x[0], order, b[1]));
    PetscCall(VecAXPY(b[1], -1.0, x[1]));
    PetscCall(VecNorm(b[1], NORM_INFINITY, &error));
    PetscCall(VecNorm(x[1], NORM_INFINITY, &norm));
    PetscCall(Check("the same cycle", error, 1e-10 * norm));
    PetscCall(Permute(b[0], order, b[1]));
  }
  for (int k = 0; k < 2; k++) {
    PetscCall(KSPSolve(ksp[k], b[k], x[k]));
    PetscCall(KSPGetIterationNumber(ksp[k], &its[k]));
  }
  PetscCall(Check("iterations, of the sorted matrix", its[1], same ? its[0] : 1.5 * its[0] + 1.0));
  PetscCall(MatMult(sum ? M[1] : A[1], x[1], x[0]));
  if (sum) PetscCall(CheckTrue("a matrix of two", M[1] != A[1]));
  PetscCall(VecAXPY(x[0], -1.0, b[1]));
  PetscCall(VecNorm(x[0], NORM_2, &error));
  PetscCall(VecNorm(b[1], NORM_2, &norm));
  PetscCall(Check("residual", error, 1e-5 * norm));
  PetscCall(ViewText(ksp[1], view));
  PetscCall(CheckText("view", view, {"unknowns sorted by nodes"}));

  /* other values in place, then the old ones: the levels follow */
  PetscCall(MatScale(A[1], 2.0));
  PetscCall(MatScale(D[1], 2.0));
  PetscCall(MatAssemblyBegin(M[1], MAT_FINAL_ASSEMBLY)); /* a composite does not tell of its parts */
  PetscCall(MatAssemblyEnd(M[1], MAT_FINAL_ASSEMBLY));
  PetscCall(KSPSolve(ksp[1], b[1], x[1]));
  PetscCall(KSPGetIterationNumber(ksp[1], &its[0]));
  PetscCall(CheckInt("iterations with other values", its[0], its[1]));
  for (int k = 0; k < 2; k++) {
    PetscCall(KSPDestroy(&ksp[k]));
    for (Vec *v : {&b[k], &x[k]}) PetscCall(VecDestroy(v));
    for (Mat *m : {&M[k], &D[k], &A[k]}) PetscCall(MatDestroy(m));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A scalar problem on a regular grid, whose halves look alike, has no nodes */
static PetscErrorCode Scalar()
{
  Lattice     l;
  Mat         A;
  KSP         ksp;
  std::string view;

  PetscFunctionBeginUser;
  Case("scalar");
  l.bs     = 1;
  l.layers = 12;
  PetscCall(LatticeCreate(l, &A));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(ViewText(ksp, view));
  PetscCall(CheckText("view", view, {"blocks of 1"}));
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
  PetscCall(Scalar());
  for (PetscInt bs : {2, 3, 4})
    for (Order kind : {COMPONENTS, ELEMENTS, SHUFFLED}) {
      Lattice l;

      l.bs     = bs;
      l.n      = bs == 2 ? 10 : 4;
      l.layers = bs == 2 ? 20 : 12;
      PetscCall(Compare(l, kind, bs != 3, true, bs != 2 || kind != COMPONENTS));
      l.alone = true;
      if (bs == 4) PetscCall(Compare(l, kind, true, false, true));
      if (bs != 3) continue;
      PetscCall(Compare(l, kind, true, true, true));
      for (auto layout : {Lattice::HOLE, Lattice::SMALL, Lattice::LAST}) {
        l.layout = layout;
        PetscCall(Compare(l, kind, true, true, true));
      }
    }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
