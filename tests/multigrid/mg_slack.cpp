static char help[] = "Springs as unknowns of multigrid in Ker C: A, C, W and the map to the reduced system against "
                     "dense algebra.\n\n";

#include "internal.h"
#include "inner/pmat.h"

/*
   Springs of all kinds: none, far softer and far stiffer than A, about as stiff, and one so stiff that its energy is
   scaled up
*/
static PetscReal Spring(const Dense &A, const Dense &C, PetscInt i)
{
  const PetscReal factors[]   = {0.0, 1e2, 1e-3, 0.5, 1e-11};
  PetscReal       flexibility = 0.0;

  for (Eigen::Index j = 0; j < C.cols(); j++)
    if (A(j, j) != 0.0) flexibility += PetscRealPart(C(i, j) * PetscConj(C(i, j)) / A(j, j));
  return factors[i % 5] * (flexibility > 0.0 ? flexibility : 1.0);
}

/* permuted: the local unknowns have another order, node by node */
static PetscErrorCode Identities(const Spec &spec, PetscInt bs, bool permuted)
{
  System                sys;
  DenseSystem           d;
  AinsworthCompliance   c = {};
  AinsworthPmatInputs   in;
  AinsworthPmatSlack    slack, again, far, part;
  Vec                   inverse;
  Mat                   D;
  Dense                 A, C, map, N, S, energy;
  Column                W, n, e, G;
  PetscInt              first, last, local;
  PetscMPIInt           rank;
  std::vector<PetscInt> order;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  Case("%s, nodes of %d%s", spec.name, (int)bs, permuted ? ", permuted" : "");
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &sys));
  PetscCall(Gather(sys, d));
  PetscCall(MatCreateVecs(sys.A, &inverse, NULL));
  PetscCall(Scatter(DiagonalWeight(d.A), inverse));
  PetscCall(MatGetOwnershipRange(sys.C, &first, &last));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, last - first, last - first, spec.m, spec.m, 1, NULL, 0, NULL, &D));
  for (PetscInt i = first; i < last; i++) PetscCall(MatSetValue(D, i, i, Spring(d.A, d.C, i), INSERT_VALUES));
  PetscCall(MatAssemblyBegin(D, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(D, MAT_FINAL_ASSEMBLY));
  PetscCall(AinsworthComplianceSetUp(&c, sys.C, sys.C, D, sys.w, inverse));
  in.aij    = sys.A;
  in.C      = sys.C;
  in.weight = sys.w;
  PetscCall(MatGetLocalSize(sys.A, &local, NULL));
  for (PetscInt l = 0; l < local && permuted; l++) order.push_back(local - 1 - l);
  PetscCall(AinsworthPmatCreateSlack(&in, &c, bs, order, 0, &slack));
  PetscCall(Gather(slack.A, A));
  PetscCall(Gather(slack.C, C));
  PetscCall(Gather(slack.map, map));
  PetscCall(Gather(slack.weight, W));
  PetscCall(Gather(c.N, N));
  PetscCall(Gather(c.E, energy));
  PetscCall(Gather(c.rest, e));
  PetscCall(Gather(c.inverse, G));
  n = N.diagonal();
  /* of rows without a spring, or with one whose energy was scaled up, mu has that energy, and is in no row */
  for (PetscInt i = 0; i < spec.m; i++) {
    const bool spring = n[i] != 0.0 && G[i] == 1.0;

    e[i] = spring ? n[i] : e[i] + energy(i, i);
    if (!spring) n[i] = 0.0;
  }

  S                = d.C * d.w.asDiagonal() * d.C.adjoint();
  const Dense with = S + Dense(n.asDiagonal());
  PetscCall(CheckEqual("C W C' with slack unknowns", C * W.asDiagonal() * C.adjoint(), with, 1e-13));
  PetscCall(MatGetLocalSize(slack.map, NULL, &local));
  PetscCall(MatGetLocalSize(sys.A, &first, NULL));
  PetscCall(CheckTrue("whole nodes of them", (local - first) % bs == 0 && local - first == slack.numbers[rank]));

  /*
     y = O z stands for the pair z in the kernel: the energies of both are the same; those too many stand for nothing,
     and are left out
  */
  Column used(A.rows());
  for (Eigen::Index j = 0; j < A.rows(); j++) used[j] = map.col(j).norm() > 0.0 ? 1.0 : 0.0;
  const Dense Q = (Dense::Identity(A.rows(), A.rows()) - W.asDiagonal() * C.adjoint() * with.ldlt().solve(C)) *
                  used.asDiagonal();
  const Dense T = with.ldlt().solve(d.C), P = Dense::Identity(spec.n, spec.n) - d.w.asDiagonal() * d.C.adjoint() * T;
  const Dense reduced = P.adjoint() * d.A * P + T.adjoint() * e.asDiagonal() * T, O = map * Q;
  /* S is ill-conditioned */
  PetscCall(CheckEqual("energies", O.adjoint() * reduced * O, Q.adjoint() * A * Q,
                       spec.rowscale > 0.0 || spec.jump != 1.0 ? 1e-6 : 1e-10));

  /* the number of slack unknowns stays while it is enough */
  PetscCall(AinsworthPmatCreateSlack(&in, &c, bs, order, slack.numbers[rank], &again));
  PetscCall(CheckInt("those that are there", again.numbers[rank], slack.numbers[rank]));
  PetscCall(AinsworthPmatCreateSlack(&in, &c, bs, order, 4 * slack.numbers[rank] + 4 * bs, &far));
  PetscCall(CheckInt("not far more", far.numbers[rank], slack.numbers[rank]));
  if (bs > 1) {
    PetscCall(AinsworthPmatCreateSlack(&in, &c, bs, order, slack.numbers[rank] + 1, &part));
    PetscCall(CheckInt("no part of a node", part.numbers[rank], slack.numbers[rank]));
  }
  PetscCall(AinsworthComplianceReset(&c));
  PetscCall(MatDestroy(&D));
  PetscCall(VecDestroy(&inverse));
  PetscCall(SystemDestroy(&sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  for (const Spec &spec : UsualSpecs())
    if (spec.symmetric)
      for (PetscInt bs : {1, 3})
        for (bool permuted : {false, true}) PetscCall(Identities(spec, bs, permuted));
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
