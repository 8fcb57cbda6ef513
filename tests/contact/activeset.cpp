/*
   SNESAINSWORTHACTIVESET on small problems, judged by the conditions that only their solution meets: F = 0, and l =
   mid(lower, l - F_l, upper)
*/
#include <petscainsworth.h>
#include <petscsnes.h>
#include "../../tests/bench/compat.h"
#include <vector>

enum Case {
  CASE_RANDOM,    /* inequalities both ways, boxes, equations */
  CASE_TWICE,     /* each row twice */
  CASE_CYCLE,     /* the plain active set goes round for ever */
  CASE_IMPOSSIBLE /* x_0 <= 0 and x_0 >= 1 */
};
enum Layout {
  LAYOUT_VIEW,
  LAYOUT_EXPLICIT,
  LAYOUT_AIJ
};

struct Problem {
  Mat       J;
  Vec       f; /* F(y) = J y - f - strength y^3, the last in unknowns only */
  PetscReal strength;
};

static PetscErrorCode Cube(const Problem &p, Vec y, Vec cubes, PetscInt power)
{
  IS  is[2];
  Vec part, from;

  PetscFunctionBeginUser;
  PetscCall(VecSet(cubes, 0.0));
  if (p.strength == 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNestGetISs(p.J, is, NULL));
  PetscCall(VecGetSubVector(cubes, is[0], &part));
  PetscCall(VecGetSubVector(y, is[0], &from));
  PetscCall(VecSet(part, p.strength));
  for (PetscInt k = 0; k < power; k++) PetscCall(VecPointwiseMult(part, part, from));
  PetscCall(VecRestoreSubVector(y, is[0], &from));
  PetscCall(VecRestoreSubVector(cubes, is[0], &part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Function(SNES, Vec y, Vec F, void *ctx)
{
  const Problem *p = (const Problem *)ctx;
  Vec            cubes;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(y, &cubes));
  PetscCall(Cube(*p, y, cubes, 3));
  PetscCall(MatMult(p->J, y, F));
  PetscCall(VecAXPY(F, 1.0, cubes));
  PetscCall(VecAXPY(F, -1.0, p->f));
  PetscCall(VecDestroy(&cubes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A of the nest gets its diagonal anew where the problem is not linear */
static PetscErrorCode Jacobian(SNES, Vec y, Mat J, Mat, void *ctx)
{
  const Problem *p = (const Problem *)ctx;
  Vec            squares, part;
  IS             is[2];
  Mat            A;

  PetscFunctionBeginUser;
  if (p->strength == 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(y, &squares));
  PetscCall(Cube(*p, y, squares, 2));
  PetscCall(VecScale(squares, 3.0));
  PetscCall(VecShift(squares, 2.5));
  PetscCall(MatNestGetISs(J, is, NULL));
  PetscCall(MatNestGetSubMat(J, 0, 0, &A));
  PetscCall(VecGetSubVector(squares, is[0], &part));
  PetscCall(MatDiagonalSet(A, part, INSERT_VALUES));
  PetscCall(VecRestoreSubVector(squares, is[0], &part));
  PetscCall(VecDestroy(&squares));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same on any number of ranks */
static PetscReal Random(PetscInt i, PetscInt k)
{
  const unsigned z = (unsigned)(i * 7919 + k * 104729 + 12345) * 2654435761u;

  return (PetscReal)((z >> 8) & 0xffff) / 32768.0 - 1.0;
}

static PetscErrorCode CreateBlocks(PetscInt which, PetscInt n, PetscInt m, Mat *A, Mat *C)
{
  const PetscScalar lower[3][3] = {
    {2.0,  0.0, 0.0},
    {-3.0, 1.0, 0.0},
    {-3.0, 3.0, 1.0}
  };
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n, n, 3, NULL, 3, NULL, A));
  PetscCall(MatGetOwnershipRange(*A, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscCall(MatSetValue(*A, i, i, which == CASE_CYCLE ? 1.0 : 2.5, INSERT_VALUES));
    if (i > 0) PetscCall(MatSetValue(*A, i, i - 1, which == CASE_CYCLE ? 0.0 : -1.0, INSERT_VALUES));
    if (i < n - 1) PetscCall(MatSetValue(*A, i, i + 1, which == CASE_CYCLE ? 0.0 : -1.0, INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, m, n, 3, NULL, 3, NULL, C));
  PetscCall(MatGetOwnershipRange(*C, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    const PetscInt row = which == CASE_TWICE ? i / 2 : i;

    for (PetscInt k = 0; k < 3; k++) {
      if (which == CASE_CYCLE) PetscCall(MatSetValue(*C, i, k, lower[i][k], INSERT_VALUES));
      else if (which == CASE_IMPOSSIBLE) PetscCall(MatSetValue(*C, i, k, k == 0 ? 1.0 : 0.0, INSERT_VALUES));
      else PetscCall(MatSetValue(*C, i, (3 * row + 5 * k) % n, Random(row, k) + (k == 0 ? 2.0 : 0.0), INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* [A C'; -C 0] */
static PetscErrorCode CreateJacobian(Mat A, Mat C, PetscInt layout, Mat *nest, Mat *J)
{
  Mat blocks[4] = {A, NULL, NULL, NULL};

  PetscFunctionBeginUser;
  PetscCall(MatDuplicate(C, MAT_COPY_VALUES, &blocks[2]));
  PetscCall(MatScale(blocks[2], -1.0));
  if (layout == LAYOUT_VIEW)
    PetscCall(PetscDefined(USE_COMPLEX) ? MatCreateHermitianTranspose(C, &blocks[1])
                                        : MatCreateTranspose(C, &blocks[1]));
  else PetscCall(MatTranspose(C, MAT_INITIAL_MATRIX, &blocks[1]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, nest));
  if (layout == LAYOUT_AIJ) PetscCall(MatConvert(*nest, MATAIJ, MAT_INITIAL_MATRIX, J));
  else {
    *J = *nest;
    PetscCall(PetscObjectReference((PetscObject)*J));
  }
  PetscCall(MatDestroy(&blocks[1]));
  PetscCall(MatDestroy(&blocks[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Right-hand side (f, -g) and bounds: rows in turn C x <= g, C x >= g, a box, an equation; those of CASE_TWICE in
   pairs, of CASE_CYCLE all C x <= g
*/
static PetscErrorCode CreateVectors(PetscInt which, PetscInt round, Mat nest, Vec f, Vec lower, Vec upper)
{
  const PetscReal g[3] = {4.0, -5.0, -1.0};
  PetscInt        start, end;
  Vec             part[3];
  IS              is[2];

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(nest, is, NULL));
  PetscCall(VecSet(lower, PETSC_NINFINITY));
  PetscCall(VecSet(upper, PETSC_INFINITY));
  PetscCall(VecGetSubVector(f, is[0], &part[0]));
  PetscCall(VecGetOwnershipRange(part[0], &start, &end));
  for (PetscInt i = start; i < end; i++)
    PetscCall(VecSetValue(part[0], i, which == CASE_CYCLE ? 0.0 : 3.0 * Random(i, 100 + round), INSERT_VALUES));
  PetscCall(VecAssemblyBegin(part[0]));
  PetscCall(VecAssemblyEnd(part[0]));
  PetscCall(VecRestoreSubVector(f, is[0], &part[0]));
  PetscCall(VecGetSubVector(f, is[1], &part[0]));
  PetscCall(VecGetSubVector(lower, is[1], &part[1]));
  PetscCall(VecGetSubVector(upper, is[1], &part[2]));
  PetscCall(VecGetOwnershipRange(part[0], &start, &end));
  for (PetscInt i = start; i < end; i++) {
    const PetscInt row  = which == CASE_TWICE ? i / 2 : i,
                   kind = which == CASE_CYCLE ? 0 : row % (which == CASE_IMPOSSIBLE ? 2 : 4);
    const PetscReal at  = which == CASE_CYCLE        ? g[i]
                          : which == CASE_IMPOSSIBLE ? (PetscReal)i
                                                     : Random(row, 200 + round);

    PetscCall(VecSetValue(part[0], i, -at, INSERT_VALUES));
    if (kind != 3)
      PetscCall(VecSetValue(part[1], i, kind == 0 ? 0.0 : kind == 1 ? PETSC_NINFINITY : -0.2, INSERT_VALUES));
    if (kind != 3)
      PetscCall(VecSetValue(part[2], i, kind == 0 ? PETSC_INFINITY : kind == 1 ? 0.0 : 0.3, INSERT_VALUES));
  }
  for (Vec v : part) {
    PetscCall(VecAssemblyBegin(v));
    PetscCall(VecAssemblyEnd(v));
  }
  PetscCall(VecRestoreSubVector(f, is[1], &part[0]));
  PetscCall(VecRestoreSubVector(lower, is[1], &part[1]));
  PetscCall(VecRestoreSubVector(upper, is[1], &part[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest |y - mid(lower, y - F, upper)|, which is |F| where there are no bounds; and how many rows are at one */
static PetscErrorCode Judge(SNES snes, Problem *p, Vec y, Vec lower, Vec upper, PetscReal *violation, PetscInt *held)
{
  const PetscScalar *a[4];
  PetscInt           n;
  Vec                F;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(y, &F));
  PetscCall(Function(snes, y, F, p));
  const Vec v[4] = {y, F, lower, upper};
  for (int k = 0; k < 4; k++) PetscCall(VecGetArrayRead(v[k], &a[k]));
  PetscCall(VecGetLocalSize(y, &n));
  *violation = 0;
  *held      = 0;
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal at = PetscRealPart(a[0][i]), low = PetscRealPart(a[2][i]), high = PetscRealPart(a[3][i]);
    const PetscReal back = PetscMax(low, PetscMin(high, at - PetscRealPart(a[1][i])));

    *violation = PetscMax(*violation, PetscAbsReal(at - back) + PetscAbsReal(PetscImaginaryPart(a[0][i])));
    *held += at == low || at == high;
  }
  for (int k = 0; k < 4; k++) PetscCall(VecRestoreArrayRead(v[k], &a[k]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, violation, 1, MPIU_REAL, MPIU_MAX, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, held, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const char *const cases[] = {"random", "twice", "cycle", "impossible"}, *const layouts[] = {"view", "explicit",
                                                                                              "aij"};
  PetscInt            which = CASE_RANDOM, layout = LAYOUT_VIEW, n, m;
  PetscBool           bounds = PETSC_TRUE, cubic = PETSC_FALSE;
  SNESConvergedReason reason = SNES_CONVERGED_ITERATING;
  Problem             p;
  Mat                 A, C, nest, Jnest, J, copy;
  Vec                 y, F, lower, upper;
  SNES                snes;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscOptionsGetEList(NULL, NULL, "-case", cases, 4, &which, NULL));
  PetscCall(PetscOptionsGetEList(NULL, NULL, "-layout", layouts, 3, &layout, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-bounds", &bounds, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-cubic", &cubic, NULL));
  n = which == CASE_CYCLE ? 3 : 90;
  m = which == CASE_CYCLE ? 3 : which == CASE_IMPOSSIBLE ? 2 : 24;
  PetscCall(CreateBlocks(which, n, m, &A, &C));
  PetscCall(CreateJacobian(A, C, layout, &nest, &p.J));
  PetscCall(MatDuplicate(A, MAT_COPY_VALUES, &copy));
  PetscCall(CreateJacobian(copy, C, layout, &Jnest, &J));
  p.strength = cubic ? 0.5 : 0.0;
  PetscCall(MatCreateVecs(nest, &y, &F));
  for (Vec *v : {&p.f, &lower, &upper}) PetscCall(VecDuplicate(y, v));
  PetscCall(VecSet(y, 0.0));
  PetscCall(SNESCreate(PETSC_COMM_WORLD, &snes));
  PetscCall(SNESSetType(snes, SNESAINSWORTHACTIVESET));
  PetscCall(SNESSetFunction(snes, F, Function, &p));
  PetscCall(SNESSetJacobian(snes, J, J, Jacobian, &p));
  PetscCall(SNESSetFromOptions(snes));
  /* the later ones start from the solution of the last one */
  for (PetscInt round = 0; round < (which == CASE_CYCLE ? 1 : 3); round++) {
    PetscReal violation;
    PetscInt  held, steps;

    PetscCall(CreateVectors(which, round, nest, p.f, lower, upper));
    if (bounds) PetscCall(SNESVISetVariableBounds(snes, lower, upper));
    PetscCall(SNESSolve(snes, NULL, y));
    PetscCall(SNESGetConvergedReason(snes, &reason));
    if (reason < 0) break;
    PetscCall(SNESGetIterationNumber(snes, &steps));
    PetscCall(Judge(snes, &p, y, lower, upper, &violation, &held));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                          "%" PetscInt_FMT " held of %" PetscInt_FMT ", %" PetscInt_FMT " steps, violation %.1e\n",
                          held, m, steps, (double)violation));
    PetscCheck(violation < 1e-7, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "This is not the solution");
    PetscCheck(which == CASE_CYCLE || (held > 0 && held < m), PETSC_COMM_WORLD, PETSC_ERR_PLIB,
               "All rows or none are held: this tests nothing");
  }
  PetscCheck((which == CASE_IMPOSSIBLE) == (reason < 0), PETSC_COMM_WORLD, PETSC_ERR_PLIB, "The reason is %s",
             SNESConvergedReasons[reason]);
  PetscCall(SNESDestroy(&snes));
  for (Vec *v : {&y, &F, &p.f, &lower, &upper}) PetscCall(VecDestroy(v));
  for (Mat *M : {&A, &C, &nest, &p.J, &copy, &Jnest, &J}) PetscCall(MatDestroy(M));
  PetscCall(PetscFinalize());
  return 0;
}
