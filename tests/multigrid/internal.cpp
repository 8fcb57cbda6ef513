#include "internal.h"

PetscErrorCode Gather(const AinsworthBlockRows &rows, const AinsworthColumns &cols, PetscInt first, PetscInt N,
                      Dense &dense)
{
  PetscFunctionBeginUser;
  dense = Dense::Zero(N * rows.br, cols.layout->N * rows.bc);
  for (PetscInt i = 0; i < rows.n; i++)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++)
      for (PetscInt q = 0; q < rows.size(); q++)
        dense((first + i) * rows.br + q / rows.bc, cols.node(rows.j[k]) * rows.bc + q % rows.bc) += rows.block(k)[q];
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, dense.data(), (PetscMPIInt)dense.size(), MPIU_SCALAR, MPIU_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

AinsworthHierarchyOptions UsualOptions()
{
  AinsworthHierarchyOptions o;

  o.threshold  = 0.03;
  o.coarseSize = 40;
  o.rankSize   = 180;
  o.single     = PETSC_FALSE;
  o.product    = PETSC_FALSE;
  return o;
}

PetscErrorCode GatherModes(const AinsworthModes &modes, PetscInt bs, const PetscLayout nodes, Dense *dense)
{
  PetscFunctionBeginUser;
  *dense = Dense::Zero(nodes->N * bs, modes.k);
  for (PetscInt i = 0; i < (nodes->rend - nodes->rstart) * bs; i++)
    for (PetscInt c = 0; c < modes.k; c++) (*dense)(nodes->rstart * bs + i, c) = modes.values[i * modes.k + c];
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, dense->data(), (PetscMPIInt)dense->size(), MPIU_SCALAR, MPIU_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Modes(const Lattice &l, Mat A, AinsworthModes *modes, Dense *dense)
{
  std::vector<PetscReal> x;
  PetscInt               n;
  PetscLayout            rows;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatGetLayouts(A, &rows, NULL));
  PetscCall(LatticeCoordinates(l, A, x));
  PetscCall(AinsworthModesCreate(A, l.bs, {}, NULL, l.dim(), x.data(), modes));
  modes->carried.assign(n / l.bs, 0);
  if (dense) PetscCall(GatherModes(*modes, 1, rows, dense));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CoarseLayout(PetscInt made, bool together, AinsworthLayout *layout)
{
  PetscMPIInt rank;
  PetscInt    total;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Allreduce(&made, &total, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(AinsworthLayoutCreate(PETSC_COMM_WORLD, together ? (rank ? 0 : total) : made, layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TentativeCreate(AinsworthAggregates *agg, PetscInt bs, bool together, AinsworthModes *modes,
                               AinsworthTies *ties, AinsworthTentative *T)
{
  AinsworthLayout          layout;
  std::vector<PetscScalar> coarse;

  PetscFunctionBeginUser;
  AinsworthTentativeCreate(*agg, bs, *modes, T, &coarse);
  PetscCall(AinsworthTentativeFollow(*ties, *modes, agg, T, &coarse));
  PetscCall(CoarseLayout(agg->count, together, &layout));
  PetscCall(AinsworthTentativePlace(*agg, layout, std::move(coarse), modes, T));
  PetscCall(AinsworthTiesCoarsen(*agg, *T, ties));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HierarchyCreate(const Lattice &l, Mat A, const AinsworthHierarchyOptions &options, AinsworthHierarchy *h)
{
  AinsworthModes modes;

  PetscFunctionBeginUser;
  PetscCall(Modes(l, A, &modes, NULL));
  PetscCall(h->create(A, l.bs, {}, std::move(modes), {}, {}, options));
  PetscFunctionReturn(PETSC_SUCCESS);
}

Dense Scaled(const Dense &X, const Dense &diagonalOf)
{
  const Column w = diagonalOf.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse().cast<PetscScalar>();
  return w.asDiagonal() * X * w.asDiagonal();
}
