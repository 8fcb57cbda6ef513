static char help[] = "What PCBLOCKSA refuses, and how it says so.\n\n";

#include "internal.h"

static Mat     A;
static Lattice lattice;

/* Reading options, or the set-up with them, is an error */
static PetscErrorCode Refused(const std::string &option, PetscErrorCode code, const std::vector<std::string> &parts)
{
  KSP ksp;

  PetscFunctionBeginUser;
  Case("%s", option.c_str());
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(PetscOptionsInsertString(NULL, option.c_str()));
  PetscCall(CheckError(
    "the set-up",
    [ksp] {
      PetscFunctionBeginUser;
      PetscCall(KSPSetFromOptions(ksp));
      PetscCall(KSPSetUp(ksp));
      PetscFunctionReturn(PETSC_SUCCESS);
    },
    code, parts));
  PetscCall(PetscOptionsClear(NULL)); /* what is half done stays as it is */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Values()
{
  PetscFunctionBeginUser;
  for (const char *value : {"-0.1", "1"})
    PetscCall(Refused(std::string("-pc_blocksa_threshold ") + value, PETSC_ERR_ARG_OUTOFRANGE,
                      {"-pc_blocksa_threshold must be at least 0 and less than 1"}));
  /* by us or, since 3.22, by PETSc itself */
  PetscCall(Refused("-pc_blocksa_threshold nan", PETSC_ERR_ARG_OUTOFRANGE, {"nan"}));
  PetscCall(Refused("-pc_blocksa_coarse_eq_limit 0", PETSC_ERR_ARG_OUTOFRANGE,
                    {"-pc_blocksa_coarse_eq_limit must be positive, not 0"}));
  PetscCall(Refused("-pc_blocksa_rate 0", PETSC_ERR_ARG_OUTOFRANGE, {"-pc_blocksa_rate must be positive, not 0"}));
  PetscCall(
    Refused("-pc_blocksa_message -1", PETSC_ERR_ARG_OUTOFRANGE, {"-pc_blocksa_message must not be negative, not -1"}));
  PetscCall(Refused("-pc_blocksa_process_eq_limit -2", PETSC_ERR_ARG_OUTOFRANGE,
                    {"-pc_blocksa_process_eq_limit must not be negative, not -2"}));
  PetscCall(Refused("-pc_blocksa_precision half", PETSC_ERR_USER, {"half", "pc_blocksa_precision"}));
  PetscCall(Refused("-mg_levels_pc_type bjacobi", PETSC_ERR_SUP,
                    {KSPCHEBYSHEVSINGLE, "jacobi", "-pc_blocksa_precision double"}));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Coordinates and modes of another number of nodes */
static PetscErrorCode Modes()
{
  KSP                    ksp;
  PC                     pc;
  std::vector<PetscReal> x;
  MatNullSpace           near;
  Vec                    other;
  PetscInt               n;
  PetscMPIInt            rank, size;

  PetscFunctionBeginUser;
  Case("coordinates");
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(LatticeCoordinates(lattice, A, x));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  if (rank == size - 1) x.resize(x.size() + 3);
  n = (PetscInt)x.size();
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, size - 1, PETSC_COMM_WORLD));
  PetscCall(PCSetCoordinates(pc, 3, (PetscInt)x.size() / 3, x.data()));
  PetscCall(
    CheckError("one node too many, on one rank", [ksp] { return KSPSetUp(ksp); }, PETSC_ERR_ARG_SIZ,
               {"PCSetCoordinates() was called with " + std::to_string(n) + " coordinates on a rank", "blocks of 3"}));

  Case("near null space");
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(VecCreateMPI(PETSC_COMM_WORLD, rank == size - 1 ? n + 1 : n, PETSC_DETERMINE, &other));
  PetscCall(VecSet(other, 1.0));
  PetscCall(VecNormalize(other, NULL));
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, 1, &other, &near));
  PetscCall(VecDestroy(&other));
  PetscCall(MatSetNearNullSpace(A, near));
  PetscCall(MultigridCreate(A, &ksp));
  PetscCall(CheckError("vectors of another size", [ksp] { return KSPSetUp(ksp); }, PETSC_ERR_ARG_SIZ,
                       {"of the near null space", "MatSetNearNullSpace()"}));
  PetscCall(MatSetNearNullSpace(A, NULL));
  PetscCall(MatNullSpaceDestroy(&near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums of three, products, and conversions into matrices that exist */
static PetscErrorCode Matrices()
{
  Mat             parts[3] = {A, A, A}, sum, level, P, given = A;
  KSP             ksp;
  AinsworthLevel *data;

  PetscFunctionBeginUser;
  Case("matrices");
  PetscCall(MatCreateComposite(PETSC_COMM_WORLD, 3, parts, &sum));
  PetscCall(MultigridCreate(sum, &ksp));
  PetscCall(CheckError("three parts", [ksp] { return KSPSetUp(ksp); }, PETSC_ERR_SUP,
                       {PCBLOCKSA, MATCOMPOSITE, "two matrices that are added"}));
  PetscCall(MatDestroy(&sum));
  PetscCall(MatCreateComposite(PETSC_COMM_WORLD, 2, parts, &sum));
  PetscCall(MatCompositeSetType(sum, MAT_COMPOSITE_MULTIPLICATIVE));
  PetscCall(MultigridCreate(sum, &ksp));
  PetscCall(CheckError("a product", [ksp] { return KSPSetUp(ksp); }, PETSC_ERR_SUP,
                       {PCBLOCKSA, MATCOMPOSITE, "two matrices that are added"}));
  PetscCall(MatDestroy(&sum));

  AinsworthHierarchy        h;
  AinsworthHierarchyOptions o = UsualOptions();
  o.product                   = PETSC_TRUE;
  PetscCall(HierarchyCreate(lattice, A, o, &h));
  PetscCall(AinsworthGridCreateProduct(h.finest, &level));
  PetscCall(AinsworthInterpolationMatCreate(h.finest.P, h.finest.nodes, 1, &P));
  PetscCall(CheckError("a level into a matrix", [&] { return MatConvert(level, MATAIJ, MAT_REUSE_MATRIX, &given); },
                       PETSC_ERR_SUP, {"makes a new matrix only"}));
  PetscCall(CheckError("interpolation into a matrix", [&] { return MatConvert(P, MATAIJ, MAT_REUSE_MATRIX, &given); },
                       PETSC_ERR_SUP, {"makes a new matrix only"}));
  PetscCall(AinsworthLevelMatGet(A, &data));
  PetscCall(CheckTrue("another matrix is no level", !data));
  PetscCall(MatConvert(level, MATAIJ, MAT_INPLACE_MATRIX, &level));
  Dense got, expected;
  PetscCall(Gather(level, got));
  PetscCall(Gather(A, expected));
  PetscCall(CheckEqual("a level converted in place", got, expected, 1e-15));
  PetscCall(MatDestroy(&level));
  PetscCall(MatDestroy(&P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  lattice.n      = 5;
  lattice.layers = 12;
  PetscCall(LatticeCreate(lattice, &A));
  PetscCall(Matrices());
  PetscCall(Modes());
  PetscCall(Values());
  PetscCall(MatDestroy(&A));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
