static char help[] = "Q_* for coarse functions, where many slaves are tied to few masters: what is left of rows, "
                     "against dense algebra.\n\n";

#include "internal.h"
#include "inner/coarse.h"

static const PetscInt masters = 5, slaves = 23, all = masters + 2 * slaves + 2;

/*
   slaves of a fine line on masters of a coarse one, by linear interpolation: row i has slave i and two masters; a row
   without a slave, and a lonely tie at the end
*/
static Dense Rows()
{
  Dense C = Dense::Zero(slaves + 2, all);

  for (PetscInt i = 0; i < slaves; i++) {
    const PetscReal x = (PetscReal)(i * (masters - 1)) / (PetscReal)(slaves - 1);
    const PetscInt  k = PetscMin((PetscInt)x, masters - 2);

    C(i, masters + i) = -1.0 - 0.1 * Uniform(5, i, 0);
    C(i, k)           = 1.0 - (x - (PetscReal)k);
    C(i, k + 1)       = x - (PetscReal)k;
  }
  C(slaves, 0)           = 1.0;
  C(slaves, 1)           = -1.0;
  C(slaves + 1, all - 2) = 1.0;
  C(slaves + 1, all - 1) = -1.0;
  return C;
}

/*
   springs of the masters, of the slaves, of as many nodes above these, and through the thickness, from slaves to these
*/
static Dense Springs(PetscReal body, PetscReal plate, PetscReal thickness)
{
  Dense      A   = Dense::Zero(all, all);
  const auto add = [&](PetscInt i, PetscInt j, PetscReal k) {
    A(i, i) += k;
    A(j, j) += k;
    A(i, j) -= k;
    A(j, i) -= k;
  };

  for (PetscInt i = 0; i + 1 < masters; i++) add(i, i + 1, body);
  for (PetscInt i = 0; i < slaves; i++) {
    add(masters + i, masters + slaves + i, thickness);
    if (i + 1 == slaves) break;
    add(masters + i, masters + i + 1, plate);
    add(masters + slaves + i, masters + slaves + i + 1, plate);
  }
  A(all - 2, all - 2) = A(all - 1, all - 1) = 1.0;
  return A;
}

static PetscErrorCode CreateAIJ(const Dense &D, Mat *M)
{
  PetscInt start, end;

  PetscFunctionBeginUser;
  PetscCall(
    MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, D.rows(), D.cols(), D.cols(), NULL, D.cols(), NULL, M));
  PetscCall(MatGetOwnershipRange(*M, &start, &end));
  for (PetscInt i = start; i < end; i++)
    for (PetscInt j = 0; j < D.cols(); j++)
      if (D(i, j) != 0.0) PetscCall(MatSetValue(*M, i, j, D(i, j), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* overdetermined: S is far from its diagonal; firm: slaves take what is left of rows */
static PetscErrorCode Spread(const char what[], const Dense &A, bool overdetermined, bool firm)
{
  const Dense          C = Rows();
  AinsworthPmatInputs  in;
  AinsworthPmatOptions options = {};
  AinsworthKernelRoles roles;
  Mat                  T;
  PetscInt             start, end, weak = 0;
  const Column         W = A.diagonal().cwiseInverse();
  Dense                got;

  PetscFunctionBeginUser;
  Case("%s", what);
  PetscCall(CreateAIJ(C, &in.C));
  PetscCall(CreateAIJ(A, &in.aij));
  PetscCall(MatCreateVecs(in.C, &in.weight, NULL));
  PetscCall(Scatter(W, in.weight));
  in.S         = NULL;
  in.springs   = NULL;
  options.type = PC_AINSWORTH_PMAT_JCB;
  roles.weight = in.weight;
  PetscCall(MatGetOwnershipRange(in.C, &start, &end));
  roles.shortRows.assign(end - start, 1);
  PetscCall(AinsworthKernelCreateSpread(&in, in.C, &options, roles, &T));
  PetscCall(Gather(T, got));
  const Dense  S     = C * W.asDiagonal() * C.adjoint();
  const Column sums  = S.cwiseAbs().rowwise().sum();
  const Dense  usual = W.asDiagonal() * C.adjoint() * sums.cwiseInverse().asDiagonal() * C, left = C - C * usual;
  Dense        expected = usual;
  for (PetscInt i = 0; i < slaves; i++) {
    if (PetscAbsScalar(S(i, i)) >= 0.5 * PetscAbsScalar(sums[i])) continue;
    if (firm) expected.row(masters + i) += left.row(i) / C(i, masters + i); /* the masters are in several rows */
    weak++;
  }
  PetscCall(CheckTrue("rows that are not diagonally dominant", overdetermined ? weak > slaves / 2 : !weak));
  PetscCall(CheckEqual("T", got, expected, 1e-13));
  const Dense rest = C - C * got;
  for (PetscInt i = 0; i < slaves; i++)
    if (firm && PetscAbsScalar(S(i, i)) < 0.5 * PetscAbsScalar(sums[i]))
      PetscCall(Check("nothing is left of a row", rest.row(i).norm(), 1e-13));
  PetscCall(Check("nothing is left of a lonely tie", rest.row(slaves + 1).norm(), 1e-13));
  PetscCall(MatDestroy(&T));
  PetscCall(MatDestroy(&in.C));
  PetscCall(MatDestroy(&in.aij));
  PetscCall(VecDestroy(&in.weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(Spread("slaves of a thin plate, stiff through its thickness", Springs(1.0, 0.1, 1e4), true, true));
  PetscCall(Spread("slaves of a body", Springs(1.0, 10.0, 1.0), true, false));
  PetscCall(Spread("slaves of a soft body", Springs(1e3, 1.0, 1.0), false, false));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
