static char help[] = "Constraints of engineering models (spiders, mean values, periodic cells and more), solved by "
                     "whatever solver the options choose.\n\n";

#include "models/model.h"
#include "reference.h"
#include "report.h"

/* How many rows share the unknown that most of them have */
static PetscErrorCode MostShared(Mat C, PetscInt *most)
{
  Mat                pattern;
  Vec                ones, count;
  PetscInt           n, rows, start, end;
  PetscReal          largest = 0;
  const PetscScalar *array;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(C, &count, &ones));
  PetscCall(VecSet(ones, 1.0));
  PetscCall(MatDuplicate(C, MAT_DO_NOT_COPY_VALUES, &pattern));
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    const PetscInt          *columns;
    std::vector<PetscScalar> values;

    PetscCall(MatGetRow(C, i, &n, &columns, NULL));
    values.assign(n, 1.0);
    PetscCall(MatSetValues(pattern, 1, &i, n, columns, values.data(), INSERT_VALUES));
    PetscCall(MatRestoreRow(C, i, &n, &columns, NULL));
  }
  PetscCall(MatAssemblyBegin(pattern, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(pattern, MAT_FINAL_ASSEMBLY));
  PetscCall(MatMultTranspose(pattern, ones, count));
  PetscCall(VecGetLocalSize(count, &rows));
  PetscCall(VecGetArrayRead(count, &array));
  for (PetscInt i = 0; i < rows; i++) largest = PetscMax(largest, PetscRealPart(array[i]));
  PetscCall(VecRestoreArrayRead(count, &array));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)C)));
  *most = (PetscInt)(largest + 0.5);
  PetscCall(MatDestroy(&pattern));
  PetscCall(VecDestroy(&ones));
  PetscCall(VecDestroy(&count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the common line of the tutorials does not have */
static PetscErrorCode ReportModel(const Model &model, const SaddleSolution &solution)
{
  MatInfo        A, C;
  PetscInt       longest = 0, shared = 0;
  PetscLogDouble memory;
  double         total;

  PetscFunctionBeginUser;
  PetscCall(MatGetInfo(model.A, MAT_GLOBAL_SUM, &A));
  PetscCall(MatGetInfo(model.C, MAT_GLOBAL_SUM, &C));
  for (const ModelRow &row : model.rows) longest = PetscMax(longest, (PetscInt)row.entries.size());
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &longest, 1, MPIU_INT, MPI_MAX, model.mesh.comm));
  PetscCall(MostShared(model.C, &shared));
  PetscCall(PetscMemoryGetMaximumUsage(&memory));
  total = memory;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_DOUBLE, MPI_SUM, model.mesh.comm));
  PetscCall(PetscPrintf(model.mesh.comm,
                        "model: %s slaves=%" PetscInt_FMT " nonzeros_A=%.0f nonzeros_C=%.0f longest=%" PetscInt_FMT
                        " shared=%" PetscInt_FMT
                        " memory_mib=%.0f setup_processor_s=%.3f solve_processor_s=%.3f iterations=%" PetscInt_FMT "\n",
                        model.name, model.slaves, (double)A.nz_used, (double)C.nz_used, longest, shared,
                        total / 1048576, solution.setupProcessor, solution.solveProcessor, solution.iterations));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Against a direct solver, with the rows that do not depend on others */
static PetscErrorCode Check(const Model &model, Vec x)
{
  Mat         C;
  Vec         g, exact, lambda, Ae;
  PetscReal   norm[2];
  PetscScalar energy[2];

  PetscFunctionBeginUser;
  PetscCall(ModelAssembleRows(model, true, &C, &g));
  PetscCall(MatCreateVecs(C, &exact, &lambda));
  PetscCall(ReferenceCompute({model.A, C}, model.f, g, exact, lambda));
  PetscCall(VecDuplicate(exact, &Ae));
  PetscCall(MatMult(model.A, exact, Ae));
  PetscCall(VecDot(Ae, exact, &energy[1]));
  PetscCall(VecNorm(exact, NORM_2, &norm[1]));
  PetscCall(VecAXPY(exact, -1.0, x));
  PetscCall(MatMult(model.A, exact, Ae));
  PetscCall(VecDot(Ae, exact, &energy[0]));
  PetscCall(VecNorm(exact, NORM_2, &norm[0]));
  PetscCall(PetscPrintf(model.mesh.comm, "check: error=%.3e energy_error=%.3e\n", (double)(norm[0] / norm[1]),
                        (double)PetscSqrtReal(PetscMax(PetscRealPart(energy[0]), 0) / PetscRealPart(energy[1]))));
  for (Vec *v : {&g, &exact, &lambda, &Ae}) PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscBool      check = PETSC_FALSE;
  Model          model;
  SaddleSolution solution;
  bool           converged;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscMemorySetGetMaximumUsage());
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "What is done with the model", NULL);
  PetscCall(
    PetscOptionsBool("-check", "Compare with a direct solver (options: -reference_)", NULL, check, &check, NULL));
  PetscOptionsEnd();
  PetscCall(ModelCreate(PETSC_COMM_WORLD, &model));
  PetscCall(SaddleSolve({model.A, model.C}, model.f, model.g, &solution));
  PetscCall(ReportModel(model, solution));
  PetscCall(ReportSolution({model.A, model.C}, model.f, model.g, solution));
  if (check) PetscCall(Check(model, solution.x));
  converged = solution.reason > 0;
  PetscCall(SaddleSolutionDestroy(&solution));
  PetscCall(ModelDestroy(&model));
  PetscCall(PetscFinalize());
  return converged ? 0 : 1;
}
