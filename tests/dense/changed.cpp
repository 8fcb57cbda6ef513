static char help[] = "What changes between two solves: places of the fields, parts of blocks, sizes, types; each "
                     "solution against a dense one.\n\n";

#include "layout.h"
#include <algorithm>

/* A chain of springs with ln local unknowns, and lm local rows of C with four entries each */
static PetscErrorCode ChainCreate(PetscInt ln, PetscInt lm, PetscInt seed, System *sys)
{
  PetscInt start, end, n;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, ln, ln, PETSC_DETERMINE, PETSC_DETERMINE, 3, NULL, 3, NULL, &sys->A));
  PetscCall(MatGetOwnershipRange(sys->A, &start, &end));
  PetscCall(MatGetSize(sys->A, &n, NULL));
  for (PetscInt i = start; i < end; i++) {
    for (PetscInt j : {i - 1, i, i + 1})
      if (j >= 0 && j < n)
        PetscCall(MatSetValue(sys->A, i, j, i == j ? 3.5 + Uniform(seed, i, i) : -1.0, INSERT_VALUES));
  }
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, lm, ln, PETSC_DETERMINE, PETSC_DETERMINE, 4, NULL, 4, NULL, &sys->C));
  PetscCall(MatGetOwnershipRange(sys->C, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt k = 0; k < 4; k++)
      PetscCall(MatSetValue(sys->C, i, (3 * i + 5 * k) % n, 1.5 + Uniform(seed + 1, i, k), INSERT_VALUES));
  for (Mat M : {sys->A, sys->C}) {
    PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(MatCreateVecs(sys->C, &sys->f, &sys->g));
  PetscCall(SetRandom(sys->f, seed + 2));
  PetscCall(SetRandom(sys->g, seed + 3));
  PetscCall(VecDuplicate(sys->f, &sys->w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 24 unknowns and 5 rows laid out as PETSc does */
static PetscErrorCode UsualSizes(PetscInt *ln, PetscInt *lm)
{
  PetscInt n = 24, m = 5;

  PetscFunctionBeginUser;
  *ln = *lm = PETSC_DECIDE;
  PetscCall(PetscSplitOwnership(PETSC_COMM_WORLD, ln, &n));
  PetscCall(PetscSplitOwnership(PETSC_COMM_WORLD, lm, &m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves, and compares with the dense solution of the whole matrix as it is now */
static PetscErrorCode SolveWhole(KSP ksp, const char *what)
{
  KSPConvergedReason reason;
  Mat                mat;
  Vec                b, y;
  Dense              K;
  Column             db, dy;

  PetscFunctionBeginUser;
  Case("%s", what);
  PetscCall(KSPGetOperators(ksp, &mat, NULL));
  PetscCall(MatCreateVecs(mat, &y, &b));
  PetscCall(SetRandom(b, 70));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(Gather(mat, K));
  PetscCall(Gather(b, db));
  PetscCall(Gather(y, dy));
  PetscCall(CheckEqual("solution", dy, K.fullPivLu().solve(db), 1e-9));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the fields are: 0 multipliers last, 1 first, 2 last, from the end to the beginning, 3 among the unknowns */
static PetscErrorCode PlacedNest(const System &sys, int place, Mat *nest)
{
  PetscInt              ln, lm, start;
  std::vector<PetscInt> index[2];
  IS                    is[2];
  Mat                   Ct;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(sys.C, &lm, &ln));
  start = ln + lm;
  PetscCallMPI(MPI_Scan(MPI_IN_PLACE, &start, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  start -= ln + lm;
  for (PetscInt i = 0; i < ln + lm; i++) {
    const bool multiplier = place == 1 ? i < lm : (place == 3 ? i % 2 && i / 2 < lm : i >= ln);

    index[multiplier].push_back(start + i);
  }
  if (place == 2) std::reverse(index[0].begin(), index[0].end());
  for (int k = 0; k < 2; k++)
    PetscCall(ISCreateGeneral(PETSC_COMM_WORLD, (PetscInt)index[k].size(), index[k].data(), PETSC_COPY_VALUES, &is[k]));
  PetscCall(MatCreateHermitianTranspose(sys.C, &Ct));
  Mat blocks[] = {sys.A, Ct, sys.C, NULL};
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, is, 2, is, blocks, nest));
  PetscCall(MatDestroy(&Ct));
  for (IS &set : is) PetscCall(ISDestroy(&set));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same blocks, their fields elsewhere in the vectors */
static PetscErrorCode Places()
{
  System   sys;
  Mat      nest, Ct;
  KSP      ksp;
  PetscInt ln, lm;

  PetscFunctionBeginUser;
  PetscCall(UsualSizes(&ln, &lm));
  PetscCall(ChainCreate(ln, lm, 3, &sys));
  PetscCall(PlacedNest(sys, 0, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(SolveWhole(ksp, "fields at their first places"));
  for (int place : {1, 3, 2, 0}) {
    PetscCall(MatDestroy(&nest));
    PetscCall(PlacedNest(sys, place, &nest));
    PetscCall(KSPSetOperators(ksp, nest, nest));
    PetscCall(SolveWhole(ksp, ("fields at places " + std::to_string(place)).c_str()));
  }
  PetscCall(MatDestroy(&nest));
  PetscCall(MatCreateHermitianTranspose(sys.C, &Ct));
  PetscCall(NestCreate(sys.A, Ct, sys.C, NULL, true, &nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(KSPSetOperators(ksp, nest, nest));
  PetscCall(SolveWhole(ksp, "multipliers first in the nest as well"));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C in two blocks of rows, one of which changes in place; C' a view of it, or absent */
static PetscErrorCode PartsOfC(bool view)
{
  System      sys, other, whole;
  DenseSystem d;
  Mat         Ct = NULL, nest;
  KSP         ksp;
  PetscInt    ln, lm;

  PetscFunctionBeginUser;
  PetscCall(UsualSizes(&ln, &lm));
  PetscCall(ChainCreate(ln, lm, 3, &sys));
  PetscCall(ChainCreate(ln, 1, 11, &other));
  Mat blocks[] = {sys.C, other.C};
  whole        = sys;
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 1, NULL, blocks, &whole.C));
  PetscCall(MatCreateVecs(whole.C, NULL, &whole.g));
  PetscCall(SetRandom(whole.g, 12));
  if (view) PetscCall(MatCreateHermitianTranspose(whole.C, &Ct));
  PetscCall(NestCreate(whole.A, Ct, whole.C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  for (int step = 0; step < 3; step++) {
    Case("C in parts, step %d, view %d", step, view);
    if (step) PetscCall(MatDiagonalScale(step == 1 ? other.C : sys.C, NULL, sys.f));
    PetscCall(Gather(whole, d));
    PetscCall(CheckSolution(ksp, whole, d, false, false, 1e-8));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatDestroy(&whole.C));
  PetscCall(VecDestroy(&whole.g));
  PetscCall(SystemDestroy(&sys));
  PetscCall(SystemDestroy(&other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A of two bodies, or of three in a nest within a nest, or a sum; a part of it changes in place */
static PetscErrorCode PartsOfA(int kind, const char *inner)
{
  Options     options(inner);
  System      part[3], whole;
  DenseSystem d;
  Mat         two, nest, unused;
  KSP         ksp;
  PetscInt    ln, lm, bodies = kind == 2 ? 1 : kind + 2;

  PetscFunctionBeginUser;
  PetscCall(UsualSizes(&ln, &lm));
  for (int k = 0; k < 3; k++) PetscCall(ChainCreate(ln, lm, 20 + 5 * k, &part[k]));
  PetscCall(ChainCreate(bodies * ln, lm, 40, &whole));
  unused = whole.A;
  if (kind == 2) {
    Mat terms[] = {part[0].A, part[1].A};

    PetscCall(MatCreateComposite(PETSC_COMM_WORLD, 2, terms, &whole.A));
  } else {
    Mat blocks[] = {part[0].A, NULL, NULL, part[1].A};

    PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &two));
    whole.A = two;
    if (kind == 1) {
      blocks[0] = two;
      blocks[3] = part[2].A;
      PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, &whole.A));
      PetscCall(MatDestroy(&two));
    }
  }
  PetscCall(NestCreate(whole.A, NULL, whole.C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  for (int step = 0; step < 3; step++) {
    Case("A in parts, kind %d, step %d, %s", kind, step, inner);
    if (step) PetscCall(MatScale(part[step - 1].A, 50.0));
    PetscCall(Gather(whole, d));
    PetscCall(CheckSolution(ksp, whole, d, false, false, 1e-8));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(&unused));
  PetscCall(SystemDestroy(&whole));
  for (System &sys : part) PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Other numbers of unknowns and of rows, of the same sum on each rank, or the same numbers laid out in another way */
static PetscErrorCode Sizes(const char *inner)
{
  Options     options(inner);
  KSP         ksp = NULL;
  PetscInt    ln, lm;
  PetscMPIInt rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (int step = 0; step < 4; step++) {
    System sys;
    Mat    nest, Ct;

    PetscCall(UsualSizes(&ln, &lm));
    if (step == 1 && !rank) { /* n = 23, m = 6 */
      ln--;
      lm++;
    }
    if (step == 2) { /* n = 24, m = 5, on two ranks or more not as before */
      ln += !rank - (rank == size - 1);
      lm -= !rank - (rank == size - 1);
    }
    PetscCall(ChainCreate(ln, lm, 3 + step, &sys));
    PetscCall(MatCreateHermitianTranspose(sys.C, &Ct));
    PetscCall(NestCreate(sys.A, Ct, sys.C, NULL, false, &nest));
    PetscCall(MatDestroy(&Ct));
    if (ksp) PetscCall(KSPSetOperators(ksp, nest, nest));
    else PetscCall(SolverCreate(nest, &ksp));
    PetscCall(SolveWhole(ksp, (std::string(inner) + ", sizes of step " + std::to_string(step)).c_str()));
    PetscCall(MatDestroy(&nest));
    PetscCall(SystemDestroy(&sys));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   B is not C, and D is no longer symmetric, though its pattern is the same; there are too many rows in a component of S
   for dense inverses
*/
static PetscErrorCode SymmetryOfD()
{
  System   sys;
  Mat      B, Bt, D, nest = NULL;
  KSP      ksp;
  PetscInt ln = PETSC_DECIDE, lm = PETSC_DECIDE, n = 96, m = 40, start, end;

  PetscFunctionBeginUser;
  PetscCall(PetscSplitOwnership(PETSC_COMM_WORLD, &ln, &n));
  PetscCall(PetscSplitOwnership(PETSC_COMM_WORLD, &lm, &m));
  PetscCall(ChainCreate(ln, lm, 3, &sys));
  PetscCall(MatDuplicate(sys.C, MAT_COPY_VALUES, &B));
  PetscCall(VecShift(sys.g, 3.0));
  PetscCall(MatDiagonalScale(B, sys.g, NULL));
  PetscCall(MatCreateHermitianTranspose(B, &Bt)); /* a copy would be a new B in each set-up */
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, lm, lm, m, m, 3, NULL, 2, NULL, &D));
  for (PetscReal above : {0.5, -2.0, 0.5}) {
    PetscCall(MatGetOwnershipRange(D, &start, &end));
    for (PetscInt i = start; i < end; i++)
      for (PetscInt j : {i - 1, i, i + 1})
        if (j >= 0 && j < m) PetscCall(MatSetValue(D, i, j, j < i ? -0.5 : (j == i ? -3.0 : -above), INSERT_VALUES));
    PetscCall(MatAssemblyBegin(D, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(D, MAT_FINAL_ASSEMBLY));
    if (!nest) {
      PetscCall(NestCreate(sys.A, Bt, sys.C, D, false, &nest));
      PetscCall(SolverCreate(nest, &ksp));
    }
    PetscCall(SolveWhole(ksp, ("B is not C, D above its diagonal " + std::to_string(above)).c_str()));
  }
  PetscCall(KSPDestroy(&ksp));
  for (Mat *M : {&nest, &D, &Bt, &B}) PetscCall(MatDestroy(M));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Blocks of other types */
static PetscErrorCode Types()
{
  System   sys;
  Mat      A, C, nest;
  KSP      ksp;
  PetscInt ln, lm;

  PetscFunctionBeginUser;
  PetscCall(UsualSizes(&ln, &lm));
  PetscCall(ChainCreate(ln, lm, 3, &sys));
  PetscCall(NestCreate(sys.A, NULL, sys.C, NULL, false, &nest));
  PetscCall(SolverCreate(nest, &ksp));
  PetscCall(MatSetOption(sys.A, MAT_SYMMETRIC, PETSC_TRUE));
  for (const char *type : {MATAIJ, MATBAIJ, MATDENSE, MATSBAIJ, MATAIJ}) {
    Mat Ct;

    PetscCall(MatDestroy(&nest));
    PetscCall(MatConvert(sys.A, type, MAT_INITIAL_MATRIX, &A));
    PetscCall(MatConvert(sys.C, type == std::string(MATDENSE) ? MATDENSE : MATAIJ, MAT_INITIAL_MATRIX, &C));
    PetscCall(MatCreateHermitianTranspose(C, &Ct));
    PetscCall(NestCreate(A, Ct, C, NULL, false, &nest));
    for (Mat *mat : {&A, &C, &Ct}) PetscCall(MatDestroy(mat));
    PetscCall(KSPSetOperators(ksp, nest, nest));
    PetscCall(SolveWhole(ksp, type));
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&nest));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (const char *inner : {"-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12",
                            "-ainsworth_pc_type blocksa -ainsworth_ksp_rtol 1e-12"}) {
    for (int kind = 0; kind < 3; kind++) PetscCall(PartsOfA(kind, inner));
    PetscCall(Sizes(inner));
  }
  {
    Options options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12");

    PetscCall(Places());
    for (bool view : {false, true}) PetscCall(PartsOfC(view));
    PetscCall(SymmetryOfD());
    PetscCall(Types());
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
