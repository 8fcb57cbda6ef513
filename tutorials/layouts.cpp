static char help
  [] = "One contact problem in the layouts that programs use, each solved as the options say, and by a direct solver.\n\
  -dim <2>, -n <40>: dimensions of both bodies, nodes along each side\n\
  -layout <nest>: nest, [A C'; C 0] of two bodies together and the forces in the ties\n\
                  nests, 3 x 3, one field for each body: [A1 0 C1'; 0 A2 C2'; C1 C2 0]\n\
                  indexsets, one AIJ matrix, and PCFieldSplitSetIS() for each of the three fields\n\
                  dm, one AIJ matrix, and a DMComposite of the three fields\n\
                  matrix, one AIJ matrix and nothing else\n\n";

/*
   The left side of the left body is held, the right side of the right one pulled by a force of 1. Nothing here depends
   on the solver; the bodies are assembled in springs.cpp.

   $ mpiexec -n 2 ./layouts -layout nests -dll_append libainsworth.so -ksp_type preonly -pc_type ainsworth
   -ainsworth_ksp_converged_reason \
       -direct_pc_factor_mat_solver_type mumps
     Linear ainsworth_ solve converged due to CONVERGED_RTOL iterations 18
   nests: 6400 unknowns, 80 multipliers; difference from the direct solver below 1e-6: yes
*/
#include "springs.h"
#include <petscdmcomposite.h>
#include <petscdmda.h>
#include <string>

static PetscErrorCode CreateNest(const Contact &c, Mat *mat)
{
  Mat Ct;

  PetscFunctionBeginUser;
  PetscCall(MatCreateTranspose(c.C, &Ct)); /* a view: C' is not stored */
  Mat blocks[] = {c.A, Ct, c.C, NULL};

  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 2, NULL, 2, NULL, blocks, mat));
  PetscCall(MatDestroy(&Ct));
  PetscFunctionReturn((PetscErrorCode)0);
}

static PetscErrorCode CreateNests(const Contact &c, Mat *mat)
{
  Mat blocks[FIELDS * FIELDS];

  PetscFunctionBeginUser;
  for (int k = 0; k < FIELDS * FIELDS; k++) blocks[k] = c.block[k / FIELDS][k % FIELDS];
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, FIELDS, NULL, FIELDS, NULL, blocks, mat));
  PetscFunctionReturn((PetscErrorCode)0);
}

/* As for PCFIELDSPLIT, after KSPSetFromOptions() */
static PetscErrorCode NameFields(const Contact &c, KSP ksp)
{
  const char *const names[] = {"left", "right", "ties"};
  PC                pc;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(ksp, &pc));
  for (int f = 0; f < FIELDS; f++) PetscCall(PCFieldSplitSetIS(pc, names[f], c.is[f]));
  PetscFunctionReturn((PetscErrorCode)0);
}

/* Three lines of nodes in a DMComposite: their fields are all that it knows */
static PetscErrorCode SetFields(const Contact &c, KSP ksp)
{
  DM all, part;

  PetscFunctionBeginUser;
  PetscCall(DMCompositeCreate(PETSC_COMM_WORLD, &all));
  for (PetscInt size : c.size) {
    PetscCall(DMDACreate1d(PETSC_COMM_WORLD, DM_BOUNDARY_NONE, size / c.dim, c.dim, 1, NULL, &part));
    PetscCall(DMSetUp(part));
    PetscCall(DMCompositeAddDM(all, part));
    PetscCall(DMDestroy(&part));
  }
  PetscCall(DMSetUp(all));
  PetscCall(KSPSetDM(ksp, all));
  PetscCall(KSPKeepOperators(ksp));
  PetscCall(DMDestroy(&all));
  PetscFunctionReturn((PetscErrorCode)0);
}

/* All nodes of the right side of the right body, to the right */
static PetscErrorCode CreateLoad(const Contact &c, Vec *load)
{
  Vec      right;
  PetscInt first, last;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(c.whole, NULL, load));
  PetscCall(VecGetSubVector(*load, c.is[RIGHT], &right));
  PetscCall(VecGetOwnershipRange(right, &first, &last));
  for (PetscInt row = PetscMax(first, c.size[RIGHT] - c.size[TIES]); row < last; row++)
    if (row % c.dim == 0) PetscCall(VecSetValue(right, row, c.dim / (PetscReal)c.size[TIES], INSERT_VALUES));
  PetscCall(VecAssemblyBegin(right));
  PetscCall(VecAssemblyEnd(right));
  PetscCall(VecRestoreSubVector(*load, c.is[RIGHT], &right));
  PetscFunctionReturn((PetscErrorCode)0);
}

int main(int argc, char **argv)
{
  Contact     c;
  char        layout[32] = "nest";
  Mat         mat        = NULL;
  Vec         load, x, y;
  KSP         ksp, direct;
  PC          pc;
  PetscInt    dim = 2, n = 40;
  PetscReal   difference, norm;
  std::string which;

  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-dim", &dim, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &n, NULL));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-layout", layout, sizeof(layout), NULL));
  which = layout;
  PetscCall(ContactCreate(dim, n, &c));
  PetscCall(CreateLoad(c, &load));
  if (which == "nest") PetscCall(CreateNest(c, &mat));
  else if (which == "nests") PetscCall(CreateNests(c, &mat));
  else {
    mat = c.whole;
    PetscCall(PetscObjectReference((PetscObject)mat));
  }

  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOperators(ksp, mat, mat));
  PetscCall(KSPSetFromOptions(ksp));
  if (which == "indexsets") PetscCall(NameFields(c, ksp));
  if (which == "dm") PetscCall(SetFields(c, ksp));
  PetscCall(VecDuplicate(load, &x));
  PetscCall(KSPSolve(ksp, load, x));

  PetscCall(KSPCreate(PETSC_COMM_WORLD, &direct));
  PetscCall(KSPSetOptionsPrefix(direct, "direct_"));
  PetscCall(KSPSetOperators(direct, c.whole, c.whole));
  PetscCall(KSPSetType(direct, KSPPREONLY));
  PetscCall(KSPGetPC(direct, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(KSPSetFromOptions(direct));
  PetscCall(VecDuplicate(load, &y));
  PetscCall(KSPSolve(direct, load, y));
  PetscCall(VecNorm(y, NORM_2, &norm));
  PetscCall(VecAXPY(y, -1.0, x));
  PetscCall(VecNorm(y, NORM_2, &difference));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "%s: %" PetscInt_FMT " unknowns, %" PetscInt_FMT
                        " multipliers; difference from the direct solver below 1e-6: %s\n",
                        layout, c.size[LEFT] + c.size[RIGHT], c.size[TIES], difference <= 1e-6 * norm ? "yes" : "no"));

  PetscCall(KSPDestroy(&direct));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&mat));
  for (Vec *v : {&load, &x, &y}) PetscCall(VecDestroy(v));
  PetscCall(ContactDestroy(&c));
  PetscCall(PetscFinalize());
  return 0;
}
