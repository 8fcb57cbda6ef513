static char
  help[] = "Q_* for coarse functions, where slaves are tied to softer masters and S is far from its diagonal: what is left of rows, against dense algebra.\n\n";

#include "internal.h"
#include "pmat/inkernel.h"

/* many slaves on a line of few masters, by linear interpolation: row i has slave i and two masters; a row without a slave of its own and a lonely tie at the end */
static Dense Rows(PetscInt masters, PetscInt slaves)
{
  Dense C = Dense::Zero(slaves + 2, masters + slaves + 2);

  for (PetscInt i = 0; i < slaves; i++) {
    const PetscReal x = (PetscReal)(i * (masters - 1)) / (PetscReal)(slaves - 1);
    const PetscInt  k = PetscMin((PetscInt)x, masters - 2);

    C(i, masters + i) = -1.0 - 0.1 * Uniform(5, i, 0);
    C(i, k)           = 1.0 - (x - (PetscReal)k);
    C(i, k + 1)       = x - (PetscReal)k;
  }
  C(slaves, 0)                        = 1.0;
  C(slaves, 1)                        = -1.0;
  C(slaves + 1, masters + slaves)     = 1.0;
  C(slaves + 1, masters + slaves + 1) = -1.0;
  return C;
}

static PetscErrorCode CreateAIJ(const Dense &D, Mat *M)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, D.rows(), D.cols(), D.cols(), NULL, D.cols(), NULL, M));
  PetscCall(MatGetOwnershipRange(*M, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < D.cols(); j++)
      if (D(i, j) != 0.0) PetscCall(MatSetValue(*M, i, j, D(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* soft: of the slaves relative to the masters */
static PetscErrorCode Spread(PetscReal soft)
{
  const PetscInt       masters = 5, slaves = 23;
  const Dense          C = Rows(masters, slaves);
  AinsworthPmatInputs  in;
  AinsworthPmatOptions options = {};
  AinsworthKernelRoles roles;
  Mat                  T;
  PetscInt             start, end, without = 0;
  Column               W(C.cols());
  Dense                got;

  PetscFunctionBeginUser;
  Case("slaves %g times as soft as their masters", (double)soft);
  PetscCall(CreateAIJ(C, &in.C));
  for (Eigen::Index j = 0; j < W.size(); j++) W[j] = (j < masters ? 1.0 : soft) * (1.5 + Uniform(6, 0, j));
  PetscCall(MatCreateVecs(in.C, &in.weight, NULL));
  PetscCall(Scatter(W, in.weight));
  in.S         = NULL;
  in.springs   = NULL;
  options.type = PC_AINSWORTH_PMAT_JCB;
  options.rtol = 1e-2;
  roles.weight = in.weight;
  PetscCall(MatGetOwnershipRange(in.C, &start, &end));
  roles.shortRows.assign(end - start, 1);
  PetscCall(AinsworthKernelCreateSpread(&in, in.C, &options, roles, &T));
  PetscCall(Gather(T, got));
  const Dense  S     = C * W.asDiagonal() * C.adjoint();
  const Column sums  = S.cwiseAbs().rowwise().sum();
  const Dense  usual = W.asDiagonal() * C.adjoint() * sums.cwiseInverse().asDiagonal() * C;
  Dense        rest = C - C * usual, expected = usual;
  PetscInt     weak = 0;
  for (PetscInt i = 0; i < slaves; i++) {
    if (PetscAbsScalar(S(i, i)) >= 0.5 * PetscAbsScalar(sums[i])) continue;
    expected.row(masters + i) += rest.row(i) / C(i, masters + i); /* the masters are in several rows */
    weak++;
  }
  if (PetscAbsScalar(S(slaves, slaves)) < 0.5 * PetscAbsScalar(sums[slaves])) without++; /* it has no unknown of its own */
  PetscCall(CheckEqual("T", got, expected, 1e-13));
  PetscCall(CheckTrue("S is far from its diagonal if slaves are stiff, and close to it if they are soft", soft < 0.1 ? weak > slaves / 2 && without : !weak));
  rest = C - C * got;
  for (PetscInt i = 0; i < slaves + 2; i++) {
    const bool dominant = PetscAbsScalar(S(i, i)) >= 0.5 * PetscAbsScalar(sums[i]);

    if (!dominant && i != slaves) PetscCall(Check("nothing is left of a row", rest.row(i).norm(), 1e-13));
  }
  PetscCall(Check("nothing is left of a lonely tie", rest.row(slaves + 1).norm(), 1e-13));
  PetscCall(MatDestroy(&T));
  PetscCall(MatDestroy(&in.C));
  PetscCall(VecDestroy(&in.weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (PetscReal soft : {1e-6, 1e-2, 1e2}) PetscCall(Spread(soft));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
