static char help[] = "One system in every layout that programs use: the same iterations, and the solution that the "
                     "right-hand side was made of.\n\n";

#include "dense.h"
#include "base/lists.h"
#include "springs.h"
#include <petscdmcomposite.h>
#include <petscdmda.h>
#include <petscdmshell.h>

static Contact  c;
static Vec      solution, rhs; /* random */
static PetscInt usual = -1;    /* iterations of the first layout */

/* Of all solves so far, further ones included */
static PetscErrorCode Iterations(KSP ksp, PetscInt *its)
{
  PC  pc;
  KSP inner;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetTotalIterations(inner, its));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A scatter reads and writes any type of vector, PETSc's copy two of a type only */
static PetscErrorCode CopyEntries(Vec from, Vec to)
{
  VecScatter scatter;
  IS         all;
  PetscInt   first, end;

  PetscFunctionBeginUser;
  PetscCall(VecGetOwnershipRange(to, &first, &end));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, end - first, first, 1, &all));
  PetscCall(VecScatterCreate(from, all, to, all, &scatter));
  PetscCall(VecScatterBegin(scatter, from, to, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, from, to, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(ISDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* numbering: of the unknowns of the matrix in the whole, NULL: the same */
static PetscErrorCode SolveAndCheck(KSP ksp, IS numbering, const std::vector<std::string> &view)
{
  Vec                b = rhs, x, exact = solution, given, nested;
  PetscReal          error, norm;
  PetscInt           its, before;
  Mat                mat;
  KSPConvergedReason reason;
  std::string        text;

  PetscFunctionBeginUser;
  if (numbering) {
    PetscCall(VecGetSubVector(rhs, numbering, &b));
    PetscCall(VecGetSubVector(solution, numbering, &exact));
  }
  PetscCall(KSPGetOperators(ksp, &mat, NULL));
  PetscCall(MatCreateVecs(mat, &nested, &given)); /* of the type that the matrix asks for, VECNEST for instance */
  PetscCall(CopyEntries(b, given));
  PetscCall(Iterations(ksp, &before));
  PetscCall(KSPSolve(ksp, given, nested));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue("converged", reason > 0));
  PetscCall(VecDuplicate(b, &x));
  PetscCall(CopyEntries(nested, x));
  PetscCall(VecAXPY(x, -1.0, exact));
  PetscCall(VecNorm(x, NORM_INFINITY, &error));
  PetscCall(VecNorm(exact, NORM_INFINITY, &norm));
  PetscCall(Check("error", error, 1e-10 * norm));
  PetscCall(Iterations(ksp, &its));
  its -= before;
  if (usual < 0) usual = its;
  PetscCall(Check("iterations more or less", PetscAbsInt(its - usual), 1.0));
  PetscCall(ViewText(ksp, text));
  PetscCall(CheckText("view", text, view));
  for (Vec *v : {&x, &given, &nested}) PetscCall(VecDestroy(v));
  if (numbering) {
    PetscCall(VecRestoreSubVector(rhs, numbering, &b));
    PetscCall(VecRestoreSubVector(solution, numbering, &exact));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Solve(Mat mat, IS numbering, const std::vector<std::string> &view)
{
  KSP ksp;

  PetscFunctionBeginUser;
  PetscCall(SolverCreate(mat, &ksp));
  PetscCall(SolveAndCheck(ksp, numbering, view));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The numbers of some fields one after the other, as MatCreateNest() numbers them */
static PetscErrorCode Order(const std::vector<int> &fields, IS *order)
{
  std::vector<PetscInt> index;

  PetscFunctionBeginUser;
  for (int f : fields) {
    PetscInt first, n;

    PetscCall(ISStrideGetInfo(c.is[f], &first, NULL));
    PetscCall(ISGetLocalSize(c.is[f], &n));
    for (PetscInt i = 0; i < n; i++) index.push_back(first + i);
  }
  PetscCall(ISCreateGeneral(PETSC_COMM_WORLD, (PetscInt)index.size(), index.data(), PETSC_COPY_VALUES, order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Translations of the points, for multigrid */
static PetscErrorCode SetModes(Mat nest)
{
  Vec          mode[2];
  MatNullSpace near;

  PetscFunctionBeginUser;
  for (PetscInt d = 0; d < 2; d++) {
    PetscInt first, end;

    PetscCall(MatCreateVecs(nest, &mode[d], NULL));
    for (int f : {LEFT, RIGHT}) {
      Vec part;

      PetscCall(VecNestGetSubVec(mode[d], f, &part));
      PetscCall(VecGetOwnershipRange(part, &first, &end));
      for (PetscInt i = first; i < end; i++) PetscCall(VecSetValue(part, i, i % 2 == d ? 1.0 : 0.0, INSERT_VALUES));
      PetscCall(VecAssemblyBegin(part));
      PetscCall(VecAssemblyEnd(part));
    }
    PetscCall(VecNormalize(mode[d], NULL));
  }
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 2, mode, &near));
  PetscCall(MatSetNearNullSpace(nest, near));
  PetscCall(MatNullSpaceDestroy(&near));
  for (Vec &v : mode) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Nests()
{
  Mat       view, view0, view1, nest, other, inner, outer[4], part, empty, back; /* empty, back: of LEFT and RIGHT */
  IS        order, direction[2];
  KSP       ksp;
  PetscInt  bs, first, end;
  const int L = LEFT, R = RIGHT, T = TIES;

  PetscFunctionBeginUser;
  PetscCall(MatCreateHermitianTranspose(c.C, &view));
  PetscCall(MatCreateHermitianTranspose(c.block[T][L], &view0));
  PetscCall(MatCreateHermitianTranspose(c.block[T][R], &view1));
  PetscCall(
    MatCreateAIJ(PETSC_COMM_WORLD, c.local[L], c.local[R], PETSC_DETERMINE, PETSC_DETERMINE, 0, NULL, 0, NULL, &empty));
  PetscCall(MatAssemblyBegin(empty, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(empty, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateHermitianTranspose(empty, &back));

  Case("2 x 2, block size set");
  PetscCall(MatSetBlockSize(c.A, 2));
  PetscCall(NestCreate(c.A, view, c.C, NULL, false, &nest));
  PetscCall(Solve(nest, NULL, {"nest, 2 fields of the MatNest; multipliers: 1", "block size of A: 2 (A)"}));
  PetscCall(MatDestroy(&nest));

  Case("2 x 2, A as a nest");
  Mat diagonal[] = {c.block[L][L], NULL, NULL, c.block[R][R]};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, diagonal, &inner));
  PetscCall(NestCreate(inner, view, c.C, NULL, false, &nest));
  PetscCall(Solve(nest, NULL, {"block size of A: 2 (the blocks of the MatNest)"}));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&inner));

  Case("2 x 2, A as a nest of two directions, which are not one after the other");
  PetscCall(MatGetOwnershipRange(c.A, &first, &end));
  for (int d = 0; d < 2; d++)
    PetscCall(ISCreateStride(PETSC_COMM_WORLD, (end - first) / 2, first + d, 2, &direction[d]));
  for (int k = 0; k < 4; k++)
    PetscCall(MatCreateSubMatrix(c.A, direction[k / 2], direction[k % 2], MAT_INITIAL_MATRIX, &outer[k]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, direction, 2, direction, outer, &inner));
  PetscCall(NestCreate(inner, view, c.C, NULL, false, &nest));
  PetscCall(Solve(nest, NULL, {"block size of A: 2 (the pattern of A)"}));
  for (IS &is : direction) PetscCall(ISDestroy(&is));
  for (Mat &block : outer) PetscCall(MatDestroy(&block));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&inner));

  Case("2 x 2, block size forgotten");
  PetscCall(MatDuplicate(c.A, MAT_COPY_VALUES, &part));
  PetscCall(MatSetBlockSize(part, 1));
  PetscCall(NestCreate(part, view, c.C, NULL, false, &nest));
  PetscCall(Solve(nest, NULL, {"block size of A: 2 (the pattern of A)"}));
  PetscCall(MatGetBlockSize(part, &bs));
  PetscCall(CheckInt("block size of the program's A", bs, 1));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&part));

  Case("3 x 3, absent blocks, transposed views");
  Mat nine[] = {c.block[L][L], NULL, view0, NULL, c.block[R][R], c.block[R][T], c.block[T][L], c.block[T][R], NULL};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 3, NULL, 3, NULL, nine, &nest));
  PetscCall(Solve(
    nest, NULL,
    {"3 fields", "multipliers: 2 (their diagonal block is zero)", "block size of A: 2 (the blocks of the MatNest)"}));
  {
    Options options("-pc_ainsworth_multiplier_fields 2");

    PetscCall(Solve(nest, NULL, {"multipliers: 2 (-pc_ainsworth_multiplier_fields)"}));
  }

  Case("2 x 2, then 3 x 3 in the same solver");
  PetscCall(NestCreate(c.A, view, c.C, NULL, false, &other));
  PetscCall(SolverCreate(other, &ksp));
  PetscCall(SolveAndCheck(ksp, NULL, {"2 fields"}));
  PetscCall(KSPSetOperators(ksp, nest, nest));
  PetscCall(SolveAndCheck(ksp, NULL, {"3 fields"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&other));
  PetscCall(MatDestroy(&nest));

  Case("3 x 3, vectors that are nests");
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 3, NULL, 3, NULL, nine, &nest));
  PetscCall(MatNestSetVecType(nest, VECNEST));
  PetscCall(SetModes(nest));
  PetscCall(Solve(nest, NULL,
                  {"3 fields", "block size of A: 2 (the blocks of the MatNest)", "near null space of A: 2 vectors"}));
  PetscCall(MatDestroy(&nest));

  Case("3 x 3, multipliers in the middle");
  Mat middle[] = {c.block[L][L], view0, NULL, c.block[T][L], NULL, c.block[T][R], NULL, view1, c.block[R][R]};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 3, NULL, 3, NULL, middle, &nest));
  PetscCall(Order({L, T, R}, &order));
  PetscCall(Solve(nest, order, {"multipliers: 1"}));
  PetscCall(MatDestroy(&nest));

  Case("nests in a nest, the multipliers inside");
  Mat four[] = {c.block[L][L], view0, c.block[T][L], NULL}, beside[] = {empty, c.block[T][R]}, below[] = {back, view1};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, four, &outer[0]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 1, NULL, beside, &outer[1]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 2, NULL, below, &outer[2]));
  outer[3] = c.block[R][R];
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, outer, &nest));
  PetscCall(Solve(nest, order, {"3 fields", "multipliers: 0.1"}));
  PetscCall(MatDestroy(&nest));
  for (int k = 0; k < 3; k++) PetscCall(MatNestSetVecType(outer[k], VECNEST));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, outer, &nest));
  PetscCall(MatNestSetVecType(nest, VECNEST));
  PetscCall(Solve(nest, order, {"3 fields", "multipliers: 0.1"}));
  PetscCall(MatDestroy(&nest));
  for (int k = 0; k < 3; k++) PetscCall(MatDestroy(&outer[k]));
  PetscCall(ISDestroy(&order));
  for (Mat *M : {&view, &view0, &view1, &empty, &back}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The three fields, or the multipliers alone, named after the options have been read, as DOLFINx does */
static PetscErrorCode NameFields(KSP ksp, bool all)
{
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(ksp, &pc));
  if (all) PetscCall(PCFieldSplitSetIS(pc, "left", c.is[LEFT]));
  if (all) PetscCall(PCFieldSplitSetIS(pc, "right", c.is[RIGHT]));
  PetscCall(PCFieldSplitSetIS(pc, "ties", c.is[TIES]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode IndexSets()
{
  KSP      ksp;
  PC       pc;
  Mat      mat;
  IS       back;
  PetscInt first, n;

  PetscFunctionBeginUser;
  for (const char *type : {MATAIJ, MATBAIJ, MATSBAIJ, MATIS}) {
    if (PetscDefined(USE_COMPLEX) && !strcmp(type, MATSBAIJ)) continue; /* of PETSc's no Hermitian one has blocks */
    Case("%s with index sets", type);
    PetscCall(MatConvert(c.whole, MATAIJ, MAT_INITIAL_MATRIX, &mat));
    PetscCall(MatSetBlockSize(mat, 2));
    if (!strcmp(type, MATSBAIJ)) PetscCall(MatSetOption(mat, MAT_SYMMETRIC, PETSC_TRUE));
    if (strcmp(type, MATAIJ)) PetscCall(MatConvert(mat, type, MAT_INPLACE_MATRIX, &mat));
    for (bool all : {true, false}) {
      PetscCall(SolverCreate(mat, &ksp));
      PetscCall(NameFields(ksp, all));
      PetscCall(SolveAndCheck(ksp, NULL,
                              {all ? "3 fields named by the program" : "2 fields named by the program",
                               "multipliers: ties", "block size of A: 2"}));
      PetscCall(KSPDestroy(&ksp));
    }
    PetscCall(MatDestroy(&mat));
  }
  Case("index sets, one of them in another order");
  PetscCall(SolverCreate(c.whole, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(ISStrideGetInfo(c.is[TIES], &first, NULL));
  PetscCall(ISGetLocalSize(c.is[TIES], &n));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, n, first + n - 1, -1, &back));
  PetscCall(PCFieldSplitSetIS(pc, "x", c.primal));
  PetscCall(PCFieldSplitSetIS(pc, "ties", back));
  PetscCall(SolveAndCheck(ksp, NULL, {"2 fields named by the program", "multipliers: ties"}));
  PetscCall(ISDestroy(&back));
  PetscCall(KSPDestroy(&ksp));
  Case("index sets, the multipliers by name");
  Options options("-pc_ainsworth_multiplier_fields ties");

  PetscCall(SolverCreate(c.whole, &ksp));
  PetscCall(NameFields(ksp, true));
  PetscCall(SolveAndCheck(
    ksp, NULL, {"multipliers: ties (-pc_ainsworth_multiplier_fields)", "block size of A: 2 (the pattern of A)"}));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vectors that are nests, for a matrix that is none: taken in order */
static PetscErrorCode NestedVectors()
{
  Vec                whole[2] = {rhs, solution}, part[2][FIELDS], nested[2];
  KSP                ksp;
  PetscReal          error, norm;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("one matrix, vectors that are nests");
  for (int k = 0; k < 2; k++) {
    for (int f = 0; f < FIELDS; f++) PetscCall(VecGetSubVector(whole[k], c.is[f], &part[k][f]));
    PetscCall(VecCreateNest(PETSC_COMM_WORLD, FIELDS, NULL, part[k], &nested[k]));
  }
  PetscCall(VecDuplicate(solution, &whole[0]));
  PetscCall(VecCopy(solution, whole[0]));
  PetscCall(VecNorm(solution, NORM_INFINITY, &norm));
  PetscCall(VecSet(nested[1], 0.0));
  PetscCall(SolverCreate(c.whole, &ksp));
  PetscCall(NameFields(ksp, true));
  PetscCall(KSPSolve(ksp, nested[0], nested[1]));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue("converged", reason > 0));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecDestroy(&nested[k]));
    for (int f = 0; f < FIELDS; f++) PetscCall(VecRestoreSubVector(k ? solution : rhs, c.is[f], &part[k][f]));
  }
  PetscCall(VecAXPY(solution, -1.0, whole[0]));
  PetscCall(VecNorm(solution, NORM_INFINITY, &error));
  PetscCall(Check("error", error, 1e-10 * norm));
  PetscCall(VecCopy(whole[0], solution));
  PetscCall(VecDestroy(&whole[0]));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A near null space of one field, the constant; and one of the whole matrix, of whose vectors one is the multipliers'
*/
static PetscErrorCode NearNullSpaces()
{
  Mat          mat;
  KSP          ksp;
  Vec          mode[2], part;
  MatNullSpace near;

  PetscFunctionBeginUser;
  PetscCall(MatDuplicate(c.whole, MAT_COPY_VALUES, &mat));
  for (bool field : {true, false}) {
    Case("a near null space of %s", field ? "a field" : "the whole matrix");
    if (field) PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_TRUE, 0, NULL, &near));
    else {
      for (int k = 0; k < 2; k++) {
        PetscCall(MatCreateVecs(mat, &mode[k], NULL));
        PetscCall(VecGetSubVector(mode[k], k ? c.is[TIES] : c.primal, &part));
        PetscCall(VecSet(part, 1.0));
        PetscCall(VecRestoreSubVector(mode[k], k ? c.is[TIES] : c.primal, &part));
        PetscCall(VecNormalize(mode[k], NULL));
      }
      PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 2, mode, &near));
      for (Vec &v : mode) PetscCall(VecDestroy(&v));
      PetscCall(MatSetNearNullSpace(mat, near));
    }
    PetscCall(PetscObjectCompose((PetscObject)c.is[LEFT], "nearnullspace", field ? (PetscObject)near : NULL));
    PetscCall(MatNullSpaceDestroy(&near));
    PetscCall(SolverCreate(mat, &ksp));
    PetscCall(NameFields(ksp, true));
    PetscCall(SolveAndCheck(ksp, NULL, {"near null space of A: 1 vectors"}));
    PetscCall(KSPDestroy(&ksp));
  }
  PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Subtracts a spring for each tie, numbered from `first` on on this rank */
static PetscErrorCode AddSprings(Mat mat, PetscInt first, PetscInt n)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++) PetscCall(MatSetValue(mat, first + i, first + i, i % 3 ? -1e-3 : -1.0, ADD_VALUES));
  PetscCall(MatAssemblyBegin(mat, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(mat, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Springs, which are unknowns of the levels, too, in nodes as large as those of A; mat: permuted by `order`. The plan
   sees nodes of an A stored by its upper triangle as the levels do
*/
static PetscErrorCode Springs(Mat mat, IS order)
{
  Options  options("-ainsworth_pc_blocksa_coarse_eq_limit 50");
  Mat      with, permuted, nest, block[4];
  IS       part[2];
  PetscInt first, n, begin;

  PetscFunctionBeginUser;
  PetscCall(MatDuplicate(c.whole, MAT_COPY_VALUES, &with));
  PetscCall(MatDuplicate(mat, MAT_COPY_VALUES, &permuted));
  PetscCall(ISStrideGetInfo(c.is[TIES], &first, NULL));
  PetscCall(ISGetLocalSize(c.is[TIES], &n));
  for (Mat *M : {&with, &permuted}) PetscCall(AddSprings(*M, first, n));
  PetscCall(MatMult(with, solution, rhs));
  usual = -1;
  PetscCall(Solve(with, NULL, {"type: blocksa", "blocks of 2"}));
  PetscCall(Solve(permuted, order, {"type: blocksa", "unknowns sorted by nodes", "blocks of 2"}));

  PetscCall(MatGetOwnershipRange(mat, &begin, NULL));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, first - begin, begin, 1, &part[0]));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, n, first, 1, &part[1]));
  for (int k = 0; k < 4; k++)
    PetscCall(MatCreateSubMatrix(permuted, part[k / 2], part[k % 2], MAT_INITIAL_MATRIX, &block[k]));
  PetscCall(MatSetOption(block[0], PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatConvert(block[0], MATSBAIJ, MAT_INPLACE_MATRIX, &block[0]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, block, &nest));
  PetscCall(Solve(nest, order,
                  {"type: blocksa", "unknowns sorted by nodes", "blocks of 2",
                   "nodes have several unknowns, not next to each other"}));
  PetscCall(MatMult(c.whole, solution, rhs));
  for (Mat &M : block) PetscCall(MatDestroy(&M));
  for (IS &is : part) PetscCall(ISDestroy(&is));
  for (Mat *M : {&with, &permuted, &nest}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One matrix, whose primal unknowns are numbered component by component, of both bodies or of each */
static PetscErrorCode Components(bool both)
{
  std::vector<PetscInt> index;
  IS                    order;
  Mat                   mat;
  PetscInt              first[3], n[3];

  PetscFunctionBeginUser;
  Case(both ? "component by component" : "body by body, component by component");
  for (int f : {LEFT, RIGHT, TIES}) {
    PetscCall(ISStrideGetInfo(c.is[f], &first[f], NULL));
    PetscCall(ISGetLocalSize(c.is[f], &n[f]));
  }
  for (int k = 0; k < 4; k++) {
    const int f = (both ? k % 2 : k / 2) ? RIGHT : LEFT, d = both ? k / 2 : k % 2;

    for (PetscInt i = d; i < n[f]; i += 2) index.push_back(first[f] + i);
  }
  for (PetscInt i = 0; i < n[TIES]; i++) index.push_back(first[TIES] + i);
  PetscCall(ISCreateGeneral(PETSC_COMM_WORLD, (PetscInt)index.size(), index.data(), PETSC_COPY_VALUES, &order));
  PetscCall(ISSetPermutation(order));
  PetscCall(MatPermute(c.whole, order, order, &mat));
  PetscCall(MatSetBlockSize(mat, 1));
  PetscCall(Solve(mat, order, {"2 fields by the diagonal", "nodes have several unknowns, not next to each other"}));
  Options  options("-ainsworth_pc_type blocksa");
  PetscInt factored = usual;

  usual = -1; /* of multigrid */
  PetscCall(Solve(c.whole, NULL, {"2 fields by the diagonal", "type: blocksa", "blocks of 2"}));
  PetscCall(Solve(mat, order, {"type: blocksa", "unknowns sorted by nodes", "blocks of 2"}));
  PetscCall(Springs(mat, order));
  usual = factored;
  PetscCall(MatDestroy(&mat));
  PetscCall(ISDestroy(&order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the nodes are whose unknowns a vector has; the bodies meet between x = n - 1 and x = n */
static PetscErrorCode Locate(int field, Vec x)
{
  PetscInt     first, end;
  PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecSetBlockSize(x, 2));
  PetscCall(VecGetOwnershipRange(x, &first, &end));
  PetscCall(VecGetArrayWrite(x, &a));
  for (PetscInt i = first; i < end; i += 2) {
    const PetscInt node = i / 2;

    a[i - first]     = (PetscReal)(node / c.n + (field == RIGHT ? c.n : 0));
    a[i - first + 1] = (PetscReal)(node % c.n);
  }
  PetscCall(VecRestoreArrayWrite(x, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three DMDAs in a DMComposite, those of the bodies with or without coordinates */
static PetscErrorCode Fields(bool located, const std::vector<std::string> &view)
{
  DM  all, part;
  KSP ksp;

  PetscFunctionBeginUser;
  Case("fields of a DM%s", located ? " with coordinates" : "");
  PetscCall(DMCompositeCreate(PETSC_COMM_WORLD, &all));
  for (int f = 0; f < FIELDS; f++) {
    Vec x;

    PetscCall(DMDACreate1d(PETSC_COMM_WORLD, DM_BOUNDARY_NONE, c.size[f] / 2, 2, 1, NULL, &part));
    PetscCall(DMSetUp(part));
    if (located && f != TIES) {
      PetscCall(VecCreateMPI(PETSC_COMM_WORLD, c.local[f], PETSC_DETERMINE, &x));
      PetscCall(Locate(f, x));
      PetscCall(DMSetCoordinates(part, x));
      PetscCall(VecDestroy(&x));
    }
    PetscCall(DMCompositeAddDM(all, part));
    PetscCall(DMDestroy(&part));
  }
  PetscCall(DMSetUp(all));
  PetscCall(SolverCreate(c.whole, &ksp));
  PetscCall(KSPSetDM(ksp, all));
  PetscCall(KSPKeepOperators(ksp));
  PetscCall(SolveAndCheck(ksp, NULL, view));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(DMDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The bodies are blocks of a MatNest, each made by a DM with coordinates */
static PetscErrorCode BodiesOfDMs()
{
  Mat blocks[9] = {NULL}, nest;
  DM  dm;
  Vec x;

  PetscFunctionBeginUser;
  Case("blocks that a DM with coordinates has made");
  for (int f : {LEFT, RIGHT}) {
    PetscCall(MatDuplicate(c.block[f][f], MAT_COPY_VALUES, &blocks[4 * f]));
    PetscCall(MatCreateVecs(blocks[4 * f], &x, NULL));
    PetscCall(Locate(f, x));
    PetscCall(DMShellCreate(PETSC_COMM_WORLD, &dm));
    PetscCall(DMSetCoordinates(dm, x));
    PetscCall(MatSetDM(blocks[4 * f], dm));
    PetscCall(DMDestroy(&dm));
    PetscCall(VecDestroy(&x));
    PetscCall(MatCreateHermitianTranspose(c.block[TIES][f], &blocks[3 * f + TIES]));
    blocks[3 * TIES + f] = c.block[TIES][f];
  }
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, FIELDS, NULL, FIELDS, NULL, blocks, &nest));
  PetscCall(Solve(nest, NULL, {"3 fields", "near null space of A: 6 vectors (coordinates of the DM)"}));
  PetscCall(MatDestroy(&nest));
  for (int f : {LEFT, RIGHT}) {
    PetscCall(MatDestroy(&blocks[4 * f]));
    PetscCall(MatDestroy(&blocks[3 * f + TIES]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Coordinates of the nodes of A, or of all rows, make the iterations of MatSetNearNullSpace() */
static PetscErrorCode Coordinates()
{
  DM                     dm;
  KSP                    ksp;
  PC                     pc;
  Mat                    A, nest;
  Vec                    whole, part, nodes;
  MatNullSpace           modes;
  PetscInt               m, n;
  const PetscScalar     *x;
  std::vector<PetscReal> located[2];

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(c.whole, &whole, NULL));
  PetscCall(MatCreateVecs(c.A, &nodes, NULL));
  for (int f = 0; f < TIES; f++) {
    PetscCall(VecGetSubVector(whole, c.is[f], &part));
    PetscCall(Locate(f, part));
    PetscCall(VecRestoreSubVector(whole, c.is[f], &part));
  }
  PetscCall(VecGetSubVector(whole, c.primal, &part));
  PetscCall(VecCopy(part, nodes));
  PetscCall(VecRestoreSubVector(whole, c.primal, &part));
  PetscCall(VecSetBlockSize(nodes, 2));
  PetscCall(MatNullSpaceCreateRigidBody(nodes, &modes));
  PetscCall(DMShellCreate(PETSC_COMM_WORLD, &dm));
  PetscCall(DMSetCoordinates(dm, nodes));
  PetscCall(VecGetLocalSize(nodes, &n));
  PetscCall(VecGetLocalSize(whole, &m));
  PetscCall(VecGetArrayRead(nodes, &x));
  for (PetscInt i = 0; i < n; i++) located[0].push_back(PetscRealPart(x[i]));
  PetscCall(VecRestoreArrayRead(nodes, &x));
  for (PetscInt i = 0; i < m; i++) /* of both rows of a node, and anything for the ties */
    for (PetscInt d = 0; d < 2; d++) located[1].push_back(i < n ? located[0][i / 2 * 2 + d] : 0.0);

  PetscCall(MatDuplicate(c.A, MAT_COPY_VALUES, &A));
  for (const char *inner : {"blocksa", "gamg", "ml"}) {
#if !defined(PETSC_HAVE_ML)
    if (!strcmp(inner, "ml")) continue;
#endif
    Options                  options(std::string("-ainsworth_pc_type ") + inner);
    const PetscInt           before    = usual;
    static const char *const sources[] = {"MatSetNearNullSpace()", "coordinates of nodes", "coordinates of rows",
                                          "coordinates of the DM"};
    PetscInt                 its[4];

    for (int k = 0; k < 4; k++) {
      const std::string source = k == 0 || k == 3 ? sources[k] : "PCSetCoordinates()";

      Case("%s, modes from %s", inner, sources[k]);
      PetscCall(MatSetDM(A, k == 3 ? dm : NULL));
      usual = -1;
      PetscCall(MatSetNearNullSpace(A, k == 0 ? modes : NULL));
      PetscCall(MatSetBlockSize(A, 2));
      PetscCall(NestCreate(A, NULL, c.C, NULL, false, &nest));
      PetscCall(SolverCreate(k == 2 ? c.whole : nest, &ksp));
      PetscCall(KSPGetPC(ksp, &pc));
      if (k == 2) PetscCall(NameFields(ksp, true));
      if (k == 1 || k == 2) PetscCall(PCSetCoordinates(pc, 2, k == 1 ? n / 2 : m, located[k - 1].data()));
      PetscCall(SolveAndCheck(ksp, NULL, {"near null space of A: 3 vectors (" + source + ")"}));
      PetscCall(Iterations(ksp, &its[k]));
      PetscCall(CheckInt("iterations as with MatSetNearNullSpace()", its[k], its[0]));
      PetscCall(KSPDestroy(&ksp));
      PetscCall(MatDestroy(&nest));
    }
    usual = before;
  }
  PetscCall(MatSetDM(A, NULL));
  {
    Options        options("-ainsworth_pc_type blocksa");
    const PetscInt before = usual;
    std::string    text;

    PetscCall(MatSetNearNullSpace(A, NULL));
    PetscCall(NestCreate(A, NULL, c.C, NULL, false, &nest));
    PetscCall(SolverCreate(nest, &ksp));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCSetCoordinates(pc, 2, n / 2, located[0].data()));
    Case("coordinates, and A changes");
    usual = -1;
    PetscCall(SolveAndCheck(ksp, NULL, {"near null space of A: 3 vectors (PCSetCoordinates())"}));
    PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    PetscCall(SolveAndCheck(ksp, NULL, {"near null space of A: 3 vectors (PCSetCoordinates())"}));
    Case("coordinates of other nodes");
    usual = -1;
    for (size_t i = 0; i < located[0].size(); i++) located[0][i] = Uniform(9, (PetscInt)i, 0);
    PetscCall(PCSetCoordinates(pc, 2, n / 2, located[0].data()));
    PetscCall(SolveAndCheck(
      ksp, NULL, {"left out: 1 modes that the matrix does not take to zero: are these the coordinates of its nodes?"}));
    Case("coordinates of another dimension");
    usual = -1;
    PetscCall(PCSetCoordinates(pc, 3, n / 2, std::vector<PetscReal>((size_t)(n / 2 * 3)).data()));
    PetscCall(SolveAndCheck(ksp, NULL, {"block size of A: 2"}));
    PetscCall(ViewText(ksp, text));
    PetscCall(CheckTrue("no near null space of A", text.find("near null space of A: none given") != std::string::npos));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&nest));
    usual = before;
  }
  PetscCall(DMDestroy(&dm));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(MatDestroy(&A));
  PetscCall(VecDestroy(&whole));
  PetscCall(VecDestroy(&nodes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ties of another strength: other values of C, and the right-hand side for them, in the matrix itself */
static PetscErrorCode ScaleTies(PetscScalar factor)
{
  Vec scale, part;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(rhs, &scale));
  PetscCall(VecSet(scale, 1.0));
  PetscCall(VecGetSubVector(scale, c.is[TIES], &part));
  PetscCall(VecSet(part, factor));
  PetscCall(VecRestoreSubVector(scale, c.is[TIES], &part));
  PetscCall(MatDiagonalScale(c.whole, scale, scale));
  PetscCall(VecDestroy(&scale));
  PetscCall(MatMult(c.whole, solution, rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing but the matrix; and what a change of values in it makes anew */
static PetscErrorCode Diagonal()
{
  KSP         ksp;
  std::string text;

  PetscFunctionBeginUser;
  Case("zeros on the diagonal");
  PetscCall(SolverCreate(c.whole, &ksp));
  PetscCall(SolveAndCheck(ksp, NULL, {"2 fields by the diagonal", "block size of A: 2 (the pattern of A)"}));
  Case("ties of another strength, in the same matrix");
  PetscCall(ScaleTies(2.0));
  PetscCall(SolveAndCheck(ksp, NULL, {"2 fields by the diagonal", "block size of A: 2 (the pattern of A)"}));
  PetscCall(ScaleTies(0.5));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One matrix, the rows of the multipliers named by an option: a list, ranges, or a file */
static PetscErrorCode Rows()
{
  const char      file[] = "rows.dat";
  std::string     list, ranges;
  PetscInt        n, total, begin = 0;
  const PetscInt *row;
  IS              all, sorted;
  PetscViewer     viewer;
  PetscMPIInt     rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(ISAllGather(c.is[TIES], &all));
  PetscCall(ISDuplicate(all, &sorted));
  PetscCall(ISSort(sorted));
  PetscCall(ISGetSize(all, &total));
  PetscCall(ISGetIndices(all, &row)); /* in any order */
  for (PetscInt i = 0; i < total; i++) list += (i ? "," : "") + std::to_string(row[i]);
  PetscCall(ISRestoreIndices(all, &row));
  PetscCall(ISGetLocalSize(sorted, &n));
  PetscCall(ISGetIndices(sorted, &row));
  for (PetscInt i = 0; i < n; i++) {
    if (i + 1 < n && row[i + 1] == row[i] + 1) continue;
    ranges += (begin ? "," : "") + std::to_string(row[begin]) + "-" + std::to_string(row[i] + 1);
    begin = i + 1;
  }
  PetscCall(ISRestoreIndices(sorted, &row));
  PetscCall(PetscViewerBinaryOpen(PETSC_COMM_WORLD, file, FILE_MODE_WRITE, &viewer));
  PetscCall(ISView(c.is[TIES], viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  for (const std::string &value : {list, ranges, std::string(file)}) {
    Options options("-pc_ainsworth_multiplier_rows " + value);

    Case("rows named by an option: %s", value.c_str());
    PetscCall(Solve(c.whole, NULL,
                    {"2 fields named by an option; multipliers: multipliers (-pc_ainsworth_multiplier_rows)",
                     "block size of A: 2 (the pattern of A)"}));
  }
  PetscCall(ISDestroy(&all));
  PetscCall(ISDestroy(&sorted));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  if (!rank) {
    remove(file);
    remove("rows.dat.info");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   whole, with a row of one entry behind every fifth node of the bodies on each rank, the first of which may be a third
   of a tie; numbers: of this rank's rows of whole
*/
static PetscErrorCode CreateWithPlainRows(bool third, Mat *mat, std::vector<PetscInt> *numbers)
{
  const PetscInt        nodes = (c.local[LEFT] + c.local[RIGHT]) / c.dim, added = (nodes + 4) / 5;
  PetscInt              first, end, start;
  std::vector<PetscInt> all;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(c.whole, &first, &end));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, end - first + added, end - first + added, PETSC_DETERMINE, PETSC_DETERMINE,
                         30, NULL, 30, NULL, mat));
  PetscCall(MatGetOwnershipRange(*mat, &start, NULL));
  for (PetscInt i = 0; i < end - first; i++) numbers->push_back(start + i + (PetscMin(i / c.dim, nodes) + 4) / 5);
  PetscCall(AinsworthGatherLists(PETSC_COMM_WORLD, *numbers, &all));
  for (PetscInt i = first; i < end; i++) {
    PetscInt              n;
    const PetscInt       *columns;
    const PetscScalar    *values;
    std::vector<PetscInt> moved;

    PetscCall(MatGetRow(c.whole, i, &n, &columns, &values));
    for (PetscInt k = 0; k < n; k++) moved.push_back(all[columns[k]]);
    PetscCall(MatSetValues(*mat, 1, &all[i], n, moved.data(), values, INSERT_VALUES));
    PetscCall(MatRestoreRow(c.whole, i, &n, &columns, &values));
  }
  for (PetscInt k = 0; k < added; k++) {
    const PetscInt row = start + k + c.dim * (5 * k + 1);

    if (row == c.dim && third) {
      PetscInt           n;
      const PetscInt    *columns;
      const PetscScalar *values;

      PetscCall(MatGetRow(c.whole, c.local[LEFT] + c.local[RIGHT], &n, &columns, &values));
      for (PetscInt j = 0; j < n; j++) {
        PetscCall(MatSetValue(*mat, row, all[columns[j]], values[j] / 3.0, INSERT_VALUES));
        PetscCall(MatSetValue(*mat, all[columns[j]], row, values[j] / 3.0, INSERT_VALUES));
      }
      PetscCall(MatRestoreRow(c.whole, c.local[LEFT] + c.local[RIGHT], &n, &columns, &values));
    } else PetscCall(MatSetValue(*mat, row, row, 2.0, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*mat, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*mat, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Inside a flexible method, whose later residuals contradict dependent rows by their rounding; which of these the
   plugin leaves out does not matter to K x
*/
static PetscErrorCode SolveInside(Mat mat)
{
  KSP                ksp;
  Vec                x;
  PetscReal          left, norm;
  PetscInt           its;
  KSPConvergedReason reason;
  std::string        text;
  /* by default so few unknowns are factored */
  Options options("-inside_ainsworth_ksp_rtol 1e-9 -inside_ainsworth_pc_type gamg");

  PetscFunctionBeginUser;
  PetscCall(SolverCreate(mat, &ksp));
  PetscCall(KSPSetType(ksp, KSPFGMRES));
  PetscCall(KSPSetTolerances(ksp, 1e-13, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(KSPSetOptionsPrefix(ksp, "inside_"));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(VecDuplicate(rhs, &x));
  PetscCall(KSPSolve(ksp, rhs, x));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue("converged", reason > 0));
  PetscCall(KSPGetIterationNumber(ksp, &its));
  PetscCall(CheckTrue("applied more than once", its > 1));
  PetscCall(ViewText(ksp, text));
  PetscCall(
    CheckText("view", text,
              {"block size of A: 2 (the pattern of A)", "decoupled rows solved alone", "1 dependent rows left out"}));
  PetscCall(VecNorm(rhs, NORM_2, &norm));
  PetscCall(VecScale(rhs, -1.0));
  PetscCall(MatMultAdd(mat, x, rhs, rhs));
  PetscCall(VecNorm(rhs, NORM_2, &left));
  PetscCall(Check("residual", left, 1e-12 * norm));
  PetscCall(VecDestroy(&x));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of one entry: between nodes, as those of pressures at hanging nodes, and one of a node */
static PetscErrorCode PlainRows()
{
  Mat                   mat;
  Vec                   without[] = {solution, rhs};
  PetscInt              first;
  const PetscScalar    *values;
  std::vector<PetscInt> numbers;

  PetscFunctionBeginUser;
  for (bool third : {false, true}) {
    Case(third ? "rows of one entry between nodes, a third of a tie, inside FGMRES"
               : "rows of one entry between nodes");
    numbers.clear();
    PetscCall(CreateWithPlainRows(third, &mat, &numbers));
    PetscCall(MatCreateVecs(mat, &solution, &rhs));
    PetscCall(VecSet(solution, third ? 0.0 : 3.0)); /* what the plugin gives to a dependent row */
    PetscCall(VecGetArrayRead(without[0], &values));
    PetscCall(VecSetValues(solution, (PetscInt)numbers.size(), numbers.data(), values, INSERT_VALUES));
    PetscCall(VecRestoreArrayRead(without[0], &values));
    PetscCall(VecAssemblyBegin(solution));
    PetscCall(VecAssemblyEnd(solution));
    PetscCall(MatMult(mat, solution, rhs));
    if (third) PetscCall(SolveInside(mat));
    else PetscCall(Solve(mat, NULL, {"2 fields by the diagonal", "block size of A: 2 (the pattern of A)"}));
    for (Vec *v : {&solution, &rhs}) PetscCall(VecDestroy(v));
    PetscCall(MatDestroy(&mat));
  }
  solution = without[0];

  Case("a row of one entry in a node");
  PetscCall(MatDuplicate(c.whole, MAT_COPY_VALUES, &mat));
  PetscCall(MatGetOwnershipRange(mat, &first, NULL));
  PetscCall(MatZeroRowsColumns(mat, first ? 0 : 1, &first, 1.0, NULL, NULL));
  PetscCall(VecDuplicate(without[1], &rhs));
  PetscCall(MatMult(mat, solution, rhs));
  PetscCall(Solve(mat, NULL, {"2 fields by the diagonal", "block size of A: 2 (the pattern of A)"}));
  PetscCall(VecDestroy(&rhs));
  rhs = without[1];
  PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Minus the whole system */
static PetscErrorCode Opposite()
{
  Mat      minus, A, C, nest;
  Vec      backup;
  PetscInt first;

  PetscFunctionBeginUser;
  PetscCall(VecScale(rhs, -1.0));
  PetscCall(MatDuplicate(c.whole, MAT_COPY_VALUES, &minus));
  PetscCall(MatScale(minus, -1.0));
  Case("minus the matrix, zeros on the diagonal");
  PetscCall(Solve(minus, NULL, {"2 fields by the diagonal", "signs changed"}));
  Case("minus the matrix, with a Dirichlet row");
  PetscCall(MatGetOwnershipRange(minus, &first, NULL));
  PetscCall(MatZeroRowsColumns(minus, first ? 0 : 1, &first, 1.0, NULL, NULL));
  PetscCall(VecDuplicate(rhs, &backup));
  PetscCall(VecCopy(rhs, backup));
  PetscCall(MatMult(minus, solution, rhs));
  PetscCall(Solve(minus, NULL, {"signs changed"}));
  PetscCall(VecCopy(backup, rhs));
  PetscCall(VecDestroy(&backup));
  PetscCall(MatDestroy(&minus));
  Case("minus the nest");
  PetscCall(MatDuplicate(c.A, MAT_COPY_VALUES, &A));
  PetscCall(MatDuplicate(c.C, MAT_COPY_VALUES, &C));
  PetscCall(MatScale(A, -1.0));
  PetscCall(MatScale(C, -1.0));
  PetscCall(NestCreate(A, NULL, C, NULL, false, &nest));
  PetscCall(Solve(nest, NULL, {"multipliers: 1", "signs changed", "block size of A: 2"}));
  for (Mat *M : {&A, &C, &nest}) PetscCall(MatDestroy(M));
  PetscCall(VecScale(rhs, -1.0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [A C'; -C D] in one matrix, all of whose diagonal is positive */
static PetscErrorCode Signs()
{
  Mat          mat;
  Vec          backup, diagonal, factors;
  PetscScalar *d, *f;
  PetscInt     n;

  PetscFunctionBeginUser;
  Case("the signs of what couples the fields");
  PetscCall(MatDuplicate(c.whole, MAT_COPY_VALUES, &mat));
  PetscCall(MatCreateVecs(mat, &factors, &diagonal));
  PetscCall(MatGetDiagonal(mat, diagonal));
  PetscCall(VecGetLocalSize(diagonal, &n));
  PetscCall(VecGetArray(diagonal, &d));
  PetscCall(VecGetArrayWrite(factors, &f));
  for (PetscInt i = 0; i < n; i++) {
    f[i] = d[i] == 0.0 ? -1.0 : 1.0;
    if (d[i] == 0.0) d[i] = 1e-3;
  }
  PetscCall(VecRestoreArrayWrite(factors, &f));
  PetscCall(VecRestoreArray(diagonal, &d));
  PetscCall(MatDiagonalScale(mat, factors, NULL));
  PetscCall(MatDiagonalSet(mat, diagonal, INSERT_VALUES));
  PetscCall(VecDuplicate(rhs, &backup));
  PetscCall(VecCopy(rhs, backup));
  PetscCall(MatMult(mat, solution, rhs));
  PetscCall(Solve(mat, NULL, {"2 fields by signs", "block size of A: 2"}));
  PetscCall(VecCopy(backup, rhs));
  for (Vec *v : {&backup, &diagonal, &factors}) PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Contact that is open: rows of multipliers with nothing but +1 or -1 on the diagonal, whose columns stay, as
   active-set methods write them
*/
static PetscErrorCode OneSided(PetscScalar sign)
{
  const PetscInt n    = 4; /* on each rank */
  const double   open = (double)PetscRealPart(sign);
  Mat            D, B, Ct, nest, whole;
  Vec            closed[] = {solution, rhs};
  KSP            ksp;
  PC             pc;
  IS             is[3], both;
  PetscInt       first, unknown, at;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, n, n, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &D));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, c.local[LEFT] + c.local[RIGHT], n, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL,
                         0, NULL, &B));
  PetscCall(MatGetOwnershipRange(D, &first, NULL));
  PetscCall(MatGetOwnershipRange(B, &unknown, NULL));
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(MatSetValue(D, first + i, first + i, sign, INSERT_VALUES));
    PetscCall(MatSetValue(B, unknown + 3 * i, first + i, 0.7, INSERT_VALUES));
  }
  for (Mat M : {D, B}) {
    PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(MatHermitianTranspose(c.C, MAT_INITIAL_MATRIX, &Ct));
  Mat nine[] = {c.A, Ct, B, c.C, NULL, NULL, NULL, NULL, D};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 3, NULL, 3, NULL, nine, &nest));
  PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, &whole));
  PetscCall(MatNestGetISs(nest, is, NULL));

  /* x and the forces in the ties are those of the other cases */
  PetscCall(MatCreateVecs(whole, &solution, &rhs));
  PetscCall(SetRandom(solution, 5));
  for (int k = 0; k < 2; k++) {
    Vec from, to;

    PetscCall(VecGetSubVector(closed[0], k ? c.is[TIES] : c.primal, &from));
    PetscCall(VecGetSubVector(solution, is[k], &to));
    PetscCall(VecCopy(from, to));
    PetscCall(VecRestoreSubVector(solution, is[k], &to));
    PetscCall(VecRestoreSubVector(closed[0], k ? c.is[TIES] : c.primal, &from));
  }
  PetscCall(MatMult(whole, solution, rhs));

  Case("one-sided rows of %g, 3 x 3", open);
  PetscCall(Solve(nest, NULL, {"3 fields of the MatNest", "block size of A: 2"}));
  Case("one-sided rows of %g, one matrix", open);
  PetscCall(Solve(whole, NULL, {"2 fields by the diagonal", "block size of A: 2"}));
  Case("one-sided rows of %g, one matrix with index sets", open);
  PetscCall(MatGetOwnershipRange(whole, &at, NULL));
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, c.local[TIES] + n, at + c.local[LEFT] + c.local[RIGHT], 1, &both));
  PetscCall(SolverCreate(whole, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCFieldSplitSetIS(pc, "x", is[0]));
  PetscCall(PCFieldSplitSetIS(pc, "ties", both));
  PetscCall(SolveAndCheck(ksp, NULL, {"2 fields named by the program; multipliers: ties", "block size of A: 2"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(ISDestroy(&both));
  for (Vec *v : {&solution, &rhs}) PetscCall(VecDestroy(v));
  solution = closed[0];
  rhs      = closed[1];
  for (Mat *M : {&D, &B, &Ct, &nest, &whole}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pmat is what a program has for PCFIELDSPLIT: a mass matrix of the multipliers in it */
static PetscErrorCode OtherPmat()
{
  KSP ksp;
  Mat pmat;
  Vec mass, part;

  PetscFunctionBeginUser;
  for (bool named : {false, true}) {
    Case("Pmat with a mass matrix of the multipliers, fields %s", named ? "named" : "not named");
    PetscCall(MatDuplicate(c.whole, MAT_COPY_VALUES, &pmat));
    PetscCall(VecDuplicate(rhs, &mass));
    PetscCall(VecGetSubVector(mass, c.is[TIES], &part));
    PetscCall(VecSet(part, 3.0));
    PetscCall(VecRestoreSubVector(mass, c.is[TIES], &part));
    PetscCall(MatDiagonalSet(pmat, mass, ADD_VALUES));
    PetscCall(VecDestroy(&mass));
    PetscCall(SolverCreate(c.whole, &ksp));
    PetscCall(KSPSetOperators(ksp, c.whole, pmat));
    if (named) PetscCall(NameFields(ksp, true));
    PetscCall(SolveAndCheck(ksp, NULL, {"block size of A: 2"}));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&pmat));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   M_* is made of Pmat in every layout: here a poor one, the diagonal of A, which takes more iterations than A itself
   does, and as many in each layout

   The blocks, and the solution, are those of Amat.
*/
static PetscErrorCode PoorPmat()
{
  const PetscInt before = usual;
  PetscInt       good;
  Mat            P, primal, mass, nestP, nest, three, Ct, minus, minusP, dirichlet;
  Vec            diagonal, part, backup;
  KSP            ksp;
  PetscInt       row;
  Options        options("-ainsworth_pc_type redundant");

  PetscFunctionBeginUser;
  usual = -1;
  Case("Pmat is Amat");
  PetscCall(Solve(c.whole, NULL, {"block size of A: 2"}));
  good = usual;
  PetscCall(MatCreateVecs(c.whole, &diagonal, NULL));
  PetscCall(MatGetDiagonal(c.whole, diagonal));
  PetscCall(VecGetSubVector(diagonal, c.is[TIES], &part));
  PetscCall(VecSet(part, 3.0));
  PetscCall(VecRestoreSubVector(diagonal, c.is[TIES], &part));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, c.local[LEFT] + c.local[RIGHT] + c.local[TIES],
                         c.local[LEFT] + c.local[RIGHT] + c.local[TIES], PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0,
                         NULL, &P));
  PetscCall(MatDiagonalSet(P, diagonal, INSERT_VALUES));
  PetscCall(MatCreateSubMatrix(P, c.primal, c.primal, MAT_INITIAL_MATRIX, &primal));
  PetscCall(MatCreateSubMatrix(P, c.is[TIES], c.is[TIES], MAT_INITIAL_MATRIX, &mass));
  PetscCall(MatCreateHermitianTranspose(c.C, &Ct));
  Mat blocks[] = {primal, NULL, NULL, mass}, nine[FIELDS * FIELDS];
  for (int k = 0; k < FIELDS * FIELDS; k++) nine[k] = c.block[k / FIELDS][k % FIELDS];
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &nestP));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, FIELDS, NULL, FIELDS, NULL, nine, &three));
  PetscCall(NestCreate(c.A, Ct, c.C, NULL, false, &nest));
  PetscCall(MatDuplicate(c.whole, MAT_COPY_VALUES, &minus));
  PetscCall(MatScale(minus, -1.0));
  PetscCall(MatDuplicate(P, MAT_COPY_VALUES, &minusP));
  PetscCall(MatScale(minusP, -1.0));
  const struct {
    const char *name;
    Mat         amat, pmat;
    bool        named;
  } layouts[] = {
    {"a nest, Pmat another",                    nest,    nestP,  false},
    {"a nest, Pmat one matrix",                 nest,    P,      false},
    {"a nest of three fields, Pmat of two",     three,   nestP,  false},
    {"a nest of three fields, Pmat one matrix", three,   P,      false},
    {"one matrix, fields named",                c.whole, P,      true },
    {"one matrix, Pmat a nest",                 c.whole, nestP,  false},
    {"one matrix, fields by the diagonal",      c.whole, P,      false},
    {"minus one matrix",                        minus,   minusP, false}
  };

  usual = -1;
  for (const auto &layout : layouts) {
    Case("poor Pmat: %s", layout.name);
    PetscCall(VecScale(rhs, layout.amat == minus ? -1.0 : 1.0));
    PetscCall(SolverCreate(layout.amat, &ksp));
    PetscCall(KSPSetOperators(ksp, layout.amat, layout.pmat));
    if (layout.named) PetscCall(NameFields(ksp, true));
    PetscCall(SolveAndCheck(ksp, NULL, {"block size of A: 2"}));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(VecScale(rhs, layout.amat == minus ? -1.0 : 1.0));
    PetscCall(CheckTrue("more iterations than with A", usual > 2 * good));
  }

  Case("poor Pmat: a Dirichlet row whose column stays");
  PetscCall(MatDuplicate(c.whole, MAT_COPY_VALUES, &dirichlet));
  PetscCall(MatGetOwnershipRange(dirichlet, &row, NULL));
  PetscCall(MatZeroRows(dirichlet, 1, &row, 1.0, NULL, NULL));
  PetscCall(VecDuplicate(rhs, &backup));
  PetscCall(VecCopy(rhs, backup));
  PetscCall(MatMult(dirichlet, solution, rhs));
  usual = -1;
  PetscCall(SolverCreate(dirichlet, &ksp));
  PetscCall(KSPSetOperators(ksp, dirichlet, P));
  PetscCall(SolveAndCheck(ksp, NULL, {"block size of A: 2"}));
  PetscCall(CheckTrue("more iterations than with A", usual > 2 * good));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(VecCopy(backup, rhs));
  PetscCall(VecDestroy(&backup));
  PetscCall(VecDestroy(&diagonal));
  for (Mat *M : {&P, &primal, &mass, &Ct, &nestP, &three, &nest, &minus, &minusP, &dirichlet}) PetscCall(MatDestroy(M));
  usual = before;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where an unknown of two components, or a multiplier, of a node stands in a matrix of nodes with so many unknowns */
static PetscInt Place(PetscInt i, PetscInt n, PetscInt unknowns)
{
  return i < n ? unknowns * (i / 2) + i % 2 : unknowns * (i - n) + unknowns - 1;
}

/*
   Fields that are components of each node, or index sets of a larger numbering with a gap in each node, against dense
   linear algebra
*/
static PetscErrorCode Nodes(const char *told)
{
  const std::string  how(told);
  Spec               spec;
  System             sys;
  DenseSystem        d;
  Mat                mat;
  KSP                ksp;
  PC                 pc;
  Vec                b, y;
  Column             x, lambda, got;
  PetscInt           start, end;
  const PetscInt     primal[] = {0, 1}, other[] = {1, 0}, dual[] = {2};
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("fields by %s", told);
  spec.n = 24;
  spec.m = 12;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  SolveSaddle(d, x, lambda);
  PetscCall(MatGetOwnershipRange(sys.C, &start, &end));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, 3 * (end - start), 3 * (end - start), PETSC_DETERMINE, PETSC_DETERMINE, 36,
                         NULL, 36, NULL, &mat));
  PetscCall(MatCreateVecs(mat, &y, &b));
  for (PetscInt i = 0; i < spec.n + spec.m; i++) {
    const PetscInt row = Place(i, spec.n, 3);

    if (row < 3 * start || row >= 3 * end) continue;
    for (PetscInt j = 0; j < spec.n + spec.m; j++) {
      const PetscScalar value = i < spec.n ? (j < spec.n ? d.A(i, j) : PetscConj(d.C(j - spec.n, i)))
                                           : (j < spec.n ? d.C(i - spec.n, j) : 0.0);

      if (value != 0.0 || i == j) PetscCall(MatSetValue(mat, row, Place(j, spec.n, 3), value, INSERT_VALUES));
    }
    PetscCall(VecSetValue(b, row, i < spec.n ? d.f[i] : d.g[i - spec.n], INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(mat, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(mat, MAT_FINAL_ASSEMBLY));
  PetscCall(VecAssemblyBegin(b));
  PetscCall(VecAssemblyEnd(b));
  Options options(how == "the options of PCFIELDSPLIT"
                    ? "-pc_fieldsplit_block_size 3 -pc_fieldsplit_0_fields 0,1 -pc_fieldsplit_1_fields 2"
                    : "");

  PetscCall(SolverCreate(mat, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  if (how == "the block size of the matrix") PetscCall(MatSetBlockSize(mat, 3));
  if (how == "a block size of their own") PetscCall(PCFieldSplitSetBlockSize(pc, 3));
  if (how == "a part of index sets") {
    /* of the fields and the part: a node has four, of which one is not in the matrix */
    std::vector<PetscInt> numbers[3];

    for (PetscInt node = start; node < end; node++) {
      for (PetscInt c : {0, 1}) numbers[0].push_back(4 * node + c);
      numbers[1].push_back(4 * node + 3);
      for (PetscInt c : {0, 1, 3}) numbers[2].push_back(4 * node + c);
    }
    for (int k = 0; k < 3; k++) {
      IS is;

      PetscCall(
        ISCreateGeneral(PETSC_COMM_WORLD, (PetscInt)numbers[k].size(), numbers[k].data(), PETSC_COPY_VALUES, &is));
      if (k < 2) PetscCall(PCFieldSplitSetIS(pc, k ? "p" : "u", is));
      else PetscCall(PCFieldSplitRestrictIS(pc, is));
      PetscCall(ISDestroy(&is));
    }
  } else if (how != "the options of PCFIELDSPLIT") {
    PetscCall(PCFieldSplitSetFields(pc, NULL, 2, primal, other));
    PetscCall(PCFieldSplitSetFields(pc, "p", 1, dual, dual));
  }
  for (int k = 0; k < 2; k++) {
    PetscCall(KSPSolve(ksp, b, y));
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    PetscCall(CheckTrue("converged", reason > 0));
    PetscCall(Gather(y, got));
    for (PetscInt i = 0; i < spec.n; i++) x[i] -= got[Place(i, spec.n, 3)];
    for (PetscInt i = 0; i < spec.m; i++) lambda[i] -= got[Place(spec.n + i, spec.n, 3)];
    PetscCall(Check("errors of x and lambda", PetscMax(x.norm(), lambda.norm()), 1e-9));
    SolveSaddle(d, x, lambda);
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(MatDestroy(&mat));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int code;

  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(ContactCreate(2, 12, &c));
  PetscCall(MatCreateVecs(c.whole, &solution, &rhs));
  PetscCall(SetRandom(solution, 3));
  PetscCall(MatMult(c.whole, solution, rhs));
  {
    Options options("-ainsworth_ksp_rtol 1e-13");

    PetscCall(Nests());
    PetscCall(IndexSets());
    PetscCall(NestedVectors());
    PetscCall(NearNullSpaces());
    PetscCall(Fields(false, {"3 fields of the DM"}));
    PetscCall(Fields(
      true, {"block size of A: 2 (the pattern of A)", "near null space of A: 6 vectors (coordinates of the DM)"}));
    PetscCall(BodiesOfDMs());
    PetscCall(Coordinates());
    PetscCall(Diagonal());
    PetscCall(Rows());
    PetscCall(PlainRows());
    for (bool both : {true, false}) PetscCall(Components(both));
    PetscCall(Opposite());
    PetscCall(Signs());
    for (PetscScalar sign : {-1.0, 1.0}) PetscCall(OneSided(sign));
    PetscCall(OtherPmat());
    PetscCall(PoorPmat());
    for (const char *told : {"the block size of the matrix", "a block size of their own", "a part of index sets",
                             "the options of PCFIELDSPLIT"})
      PetscCall(Nodes(told));
  }
  PetscCall(VecDestroy(&solution));
  PetscCall(VecDestroy(&rhs));
  PetscCall(ContactDestroy(&c));
  PetscCall(ChecksFinish(&code));
  PetscCall(PetscFinalize());
  return code;
}
