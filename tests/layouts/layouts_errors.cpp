static char help[] = "Layouts that cannot be understood: messages name the field, the row or the option.\n\n";

#include "dense.h"
#include "springs.h"

static Contact c;

/*
   Unknowns 0 to rows - 1, each coupled with each, by entries of this sign below the diagonal, with this diagonal entry;
   all others with none
*/
static PetscErrorCode SetCoupled(Mat mat, PetscInt rows, PetscScalar diagonal, PetscScalar sign)
{
  PetscInt first;

  PetscFunctionBeginUser;
  PetscCall(MatZeroEntries(mat));
  PetscCall(MatShift(mat, 1.0));
  PetscCall(MatGetOwnershipRange(mat, &first, NULL));
  for (PetscInt i = 0; i < rows && !first; i++)
    for (PetscInt j = 0; j < rows; j++)
      PetscCall(MatSetValue(mat, i, j, i == j ? diagonal : i > j ? sign : 1.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(mat, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(mat, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Errors()
{
  /* clang-format off */
  const struct {
    const char              *options;
    bool                     named;
    PetscErrorCode           code;
    std::vector<std::string> parts;
  } cases[] = {
    {"-pc_ainsworth_multiplier_fields pressure", true, PETSC_ERR_ARG_OUTOFRANGE,
     {"field pressure", "there are 3", "left, right, ties"}},
    {"-pc_ainsworth_multiplier_fields 3", true, PETSC_ERR_ARG_OUTOFRANGE, {"field 3", "there are 3"}},
    {"-pc_ainsworth_multiplier_fields 0,right,ties", true, PETSC_ERR_ARG_OUTOFRANGE,
     {"no primal field", "left, right, ties"}},
    {"-pc_ainsworth_block_size 7", true, PETSC_ERR_ARG_SIZ, {"-pc_ainsworth_block_size 7", "Block (left+right,left"}},
    {"-pc_ainsworth_multiplier_rows 0-601", false, PETSC_ERR_ARG_OUTOFRANGE, {"names rows 0 to 600", "rows 0 to 599"}},
    {"-pc_ainsworth_multiplier_rows 5-5", false, PETSC_ERR_ARG_OUTOFRANGE,
     {"-pc_ainsworth_multiplier_rows names rows 5 to 4"}},
    {"-pc_ainsworth_multiplier_rows nowhere", false, PETSC_ERR_FILE_OPEN, {"nowhere"}},
    {"-pc_ainsworth_detect_saddle_point 0", false, PETSC_ERR_ARG_WRONG,
     {"knows no fields", "aij", "-pc_ainsworth_detect_saddle"}}
  };
  /* clang-format on */
  const char *const names[] = {"left", "right", "ties"};
  KSP               ksp;
  PC                pc;
  Mat               mat;

  PetscFunctionBeginUser;
  Case("errors");
  for (const auto &bad : cases) {
    Options options(bad.options);

    PetscCall(SolverCreate(c.whole, &ksp));
    PetscCall(KSPGetPC(ksp, &pc));
    for (int f = 0; f < FIELDS && bad.named; f++) PetscCall(PCFieldSplitSetIS(pc, names[f], c.is[f]));
    PetscCall(CheckError(
      bad.options, [=]() { return KSPSetUp(ksp); }, bad.code, bad.parts));
    PetscCall(KSPDestroy(&ksp));
  }
  PetscCall(SolverCreate(c.whole, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCFieldSplitSetIS(pc, "left", c.is[LEFT]));
  PetscCall(PCFieldSplitSetIS(pc, "ties", c.is[TIES]));
  PetscCall(CheckError("a field is missing", [=]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_SIZ,
                       {"2 fields", "have 312 rows, the matrix has 600"}));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDuplicate(c.whole, MAT_COPY_VALUES, &mat));
  PetscCall(SetCoupled(mat, 2, 0.0, 1.0));
  PetscCall(SolverCreate(mat, &ksp));
  PetscCall(CheckError("coupled rows", [=]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_WRONG,
                       {"cannot tell the multipliers", "row 0 has a zero"}));
  PetscCall(KSPDestroy(&ksp));
  for (PetscScalar sign : {1.0, -1.0}) { /* one field, or three, each opposite to the others */
    PetscCall(SetCoupled(mat, 3, 1.0, sign));
    PetscCall(SolverCreate(mat, &ksp));
    PetscCall(CheckError("positive rows", [=]() { return KSPSetUp(ksp); }, PETSC_ERR_ARG_WRONG,
                         {"no saddle point", "every diagonal entry is positive"}));
    PetscCall(KSPDestroy(&ksp));
  }
  PetscCall(MatDestroy(&mat));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fields that are components of nodes */
static PetscErrorCode Components()
{
  const struct {
    PetscInt                 bs, component;
    PetscErrorCode           code;
    std::vector<std::string> parts;
  } cases[] = {
    {3, 3,  PETSC_ERR_ARG_OUTOFRANGE, {"Field u has component 3 of nodes with 3"}   },
    {3, 1,  PETSC_ERR_ARG_SIZ,        {"A rank has 4 rows, which are no nodes of 3"}},
    {3, -1, PETSC_ERR_ARG_OUTOFRANGE, {"Field u has the negative component -1"}     }
  };
  PetscMPIInt rank, size;
  Mat         uneven;

  PetscFunctionBeginUser;
  Case("components of nodes");
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  const PetscInt local = rank == size - 1 ? 4 : 3; /* whole nodes but on one rank */
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, local, local, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &uneven));
  PetscCall(MatAssemblyBegin(uneven, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(uneven, MAT_FINAL_ASSEMBLY));
  for (const auto &bad : cases) {
    KSP ksp;
    PC  pc;

    PetscCall(SolverCreate(bad.code == PETSC_ERR_ARG_SIZ ? uneven : c.whole, &ksp));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCFieldSplitSetBlockSize(pc, bad.bs));
    PetscCall(CheckError(
      "set-up",
      [&]() {
        PetscErrorCode code = PCFieldSplitSetFields(pc, "u", 1, &bad.component, &bad.component);

        return code ? code : KSPSetUp(ksp);
      },
      bad.code, bad.parts));
    PetscCall(KSPDestroy(&ksp));
  }
  PetscCall(MatDestroy(&uneven));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int code;

  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(ContactCreate(2, 12, &c));
  PetscCall(Errors());
  PetscCall(Components());
  PetscCall(ContactDestroy(&c));
  PetscCall(ChecksFinish(&code));
  PetscCall(PetscFinalize());
  return code;
}
