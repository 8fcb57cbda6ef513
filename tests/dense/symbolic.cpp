static char help[] = "The cost of a Cholesky factorization as it is predicted, against an elimination of the pattern, "
                     "entry by entry.\n\n";

#include "projection/factor.h"
#include <petscainsworth.h>
#include <vector>

/* A symmetric pattern with that share of its entries, and values that are only there */
static PetscErrorCode Create(PetscInt n, PetscReal share, PetscRandom random, Mat *M)
{
  PetscFunctionBeginUser;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, n, n, n, NULL, M));
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(MatSetValue(*M, i, i, 1.0, INSERT_VALUES));
    for (PetscInt j = 0; j < i; j++) {
      PetscReal value;

      PetscCall(PetscRandomGetValueReal(random, &value));
      if (value >= share) continue;
      PetscCall(MatSetValue(*M, i, j, 1.0, INSERT_VALUES));
      PetscCall(MatSetValue(*M, j, i, 1.0, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Eliminate(Mat M, MatOrderingType type, AinsworthCost *cost)
{
  IS                             rows, columns;
  const PetscInt                *old;
  PetscInt                       n;
  std::vector<std::vector<bool>> full;

  PetscFunctionBeginUser;
  PetscCall(MatGetSize(M, &n, NULL));
  PetscCall(MatGetOrdering(M, type, &rows, &columns));
  PetscCall(ISGetIndices(rows, &old));
  full.assign(n, std::vector<bool>(n));
  for (PetscInt i = 0; i < n; i++) {
    for (PetscInt j = 0; j < n; j++) {
      PetscScalar value;

      PetscCall(MatGetValue(M, old[i], old[j], &value));
      full[i][j] = value != 0.0;
    }
  }
  PetscCall(ISRestoreIndices(rows, &old));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  cost->entries = cost->operations = 0.0;
  for (PetscInt k = 0; k < n; k++) {
    PetscReal count = 1.0;

    for (PetscInt i = k + 1; i < n; i++) {
      if (!full[i][k]) continue;
      count++;
      for (PetscInt j = k + 1; j < n; j++)
        if (full[k][j]) full[i][j] = true;
    }
    cost->entries += count;
    cost->operations += count * count;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A cube of n^3 nodes, each with its neighbors: of two orderings the one with fewer operations, where those are worth
   it
*/
static PetscErrorCode Best(PetscInt n, PetscInt bs, bool worth)
{
  Mat             M, upper;
  AinsworthCost   cost, first, second;
  MatOrderingType ordering;
  IS              order[3], same;
  PetscBool       equal;

  PetscFunctionBeginUser;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, n * n * n, n * n * n, 27, NULL, &M));
  for (PetscInt i = 0; i < n * n * n; i++)
    for (PetscInt k = 0; k < 27; k++) {
      const PetscInt x = i % n + k % 3 - 1, y = i / n % n + k / 3 % 3 - 1, z = i / n / n + k / 9 - 1;

      if (PetscMin(x, PetscMin(y, z)) >= 0 && PetscMax(x, PetscMax(y, z)) < n)
        PetscCall(MatSetValue(M, i, x + n * (y + n * z), 1.0, INSERT_VALUES));
    }
  PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  PetscCall(AinsworthFactorPredict(M, AinsworthOrdering, bs, &first, &order[0]));
  PetscCall(AinsworthFactorPredict(M, AinsworthDissection, bs, &second, &order[1]));
  PetscCall(AinsworthFactorPredictBest(M, bs, &cost, &ordering, &order[2]));
  const bool dissected = worth && second.operations < first.operations;

  PetscCheck(cost.operations == (dissected ? second : first).operations &&
               !strcmp(ordering, dissected ? AinsworthDissection : AinsworthOrdering),
             PETSC_COMM_SELF, PETSC_ERR_PLIB, "%s, %g operations, of %g and %g", ordering, (double)cost.operations,
             (double)first.operations, (double)second.operations);
  PetscCall(ISEqual(order[2], order[dissected], &equal));
  PetscCheck(equal, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Another order than that of %s", ordering);
  PetscCall(AinsworthOrderingAttach(order[2], M));
  for (IS &is : order) PetscCall(ISDestroy(&is));
  PetscCall(MatGetOrdering(M, AinsworthPredicted, &order[0], &same));
  PetscCall(MatGetOrdering(M, ordering, &order[1], &order[2]));
  PetscCall(ISEqual(order[0], order[1], &equal));
  PetscCheck(equal, PETSC_COMM_SELF, PETSC_ERR_PLIB, "The ordering that is attached is not found");
  for (IS is : {order[1], order[2]}) PetscCall(ISDestroy(&is));
  PetscCall(MatGetOrdering(M, AinsworthDissection, &order[1], &order[2]));
  for (IS is : {order[0], same}) PetscCall(ISDestroy(&is));
  PetscCall(MatSetOption(M, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatConvert(M, MATSEQSBAIJ, MAT_INITIAL_MATRIX, &upper));
  PetscCall(MatGetOrdering(upper, AinsworthDissection, &order[0], &same));
  PetscCall(MatDestroy(&upper));
  PetscCall(ISEqual(order[0], order[1], &equal));
  PetscCheck(equal, PETSC_COMM_SELF, PETSC_ERR_PLIB, "The upper triangle alone has another dissection");
  PetscCall(ISDestroy(&same));
  for (IS &is : order) PetscCall(ISDestroy(&is));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscRandom random;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  for (PetscInt n : {1, 2, 7, 30, 90}) {
    for (PetscReal share : {0.0, 0.02, 0.05, 0.2, 1.0}) {
      Mat M;

      PetscCall(Create(n, share, random, &M));
      for (MatOrderingType type :
           {MATORDERINGNATURAL, MATORDERINGRCM, AinsworthOrdering, (const char *)AinsworthDissection}) {
        AinsworthCost cost, truth;
        IS            order;

        PetscCall(AinsworthFactorPredict(M, type, 1, &cost, &order));
        PetscCall(ISDestroy(&order));
        PetscCall(Eliminate(M, type, &truth));
        PetscCheck(cost.entries == truth.entries && cost.operations == truth.operations, PETSC_COMM_SELF,
                   PETSC_ERR_PLIB, "%s, %" PetscInt_FMT " rows: %g entries and %g operations, not %g and %g", type, n,
                   (double)cost.entries, (double)cost.operations, (double)truth.entries, (double)truth.operations);
      }
      PetscCall(MatDestroy(&M));
    }
  }
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(Best(8, 1, false));
  for (PetscInt n : {4, 12}) PetscCall(Best(n, 60, true));
  PetscCall(PetscFinalize());
  return 0;
}
