#include "saddle.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include <algorithm>

/* A row of A v and A' v differs at most by this part of itself, or of its diagonal entry, for the rounding of sums */
static const PetscReal asymmetry = 1e-10;

/* Returns an entry of a vector without order, between 0.5 and 1.5, the same on all ranks */
static inline PetscReal Random(PetscInt i)
{
  const uint64_t state = AinsworthMixState(AinsworthMixState(0x9e3779b97f4a7c15u, (uint64_t)i), 1);

  return 0.5 + (PetscReal)(state >> 11) / (PetscReal)((uint64_t)1 << 53);
}

/* Returns the difference of entries of A v and A' v relative to the larger one and the diagonal entry of the row */
static PetscReal Difference(PetscScalar a, PetscScalar b, PetscScalar diagonal)
{
  const PetscReal size = PetscMax(PetscMax(PetscAbsScalar(a), PetscAbsScalar(b)), PetscAbsScalar(diagonal));

  return a == b ? 0.0 : AinsworthQuotient(PetscAbsScalar(a - b), size); /* also for numbers that overflow */
}

/* What the ranks agree on: the largest of each number */
struct Agreed {
  PetscReal difference = 0.0, infinite = 0.0, alone = 0.0, other = 0.0;

  PetscErrorCode agree(MPI_Comm comm)
  {
    PetscFunctionBegin;
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &difference, 4, MPIU_REAL, MPIU_MAX, comm));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

/* Adds to y, of an AIJ matrix, what its ghost columns have collected */
static PetscErrorCode AddGhosts(Vec y, PetscInt n, const PetscInt ghosts[], const std::vector<PetscScalar> &collected)
{
  AinsworthRef<IS>         is;
  AinsworthRef<Vec>        here;
  AinsworthRef<VecScatter> scatter;

  PetscFunctionBegin;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, ghosts, PETSC_USE_POINTER, is.out()));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, n, collected.data(), here.out()));
  PetscCall(VecScatterCreate(y, is, here, NULL, scatter.out()));
  PetscCall(VecScatterBegin(scatter, here, y, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(scatter, here, y, ADD_VALUES, SCATTER_REVERSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads each entry of an AIJ matrix once; compare: A v and A' v as well */
static PetscErrorCode ReadRows(Mat aij, PetscBool compare, AinsworthMatFacts *facts, Agreed *agreed)
{
  Mat                      mat[2];
  const PetscInt          *ghosts;
  PetscInt                 nghosts, first[2], m, n;
  PetscScalar             *d;
  AinsworthRef<Vec>        transposed;
  std::vector<PetscScalar> v[2], Av, Atv[2];
  bool                     finite = true;

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(aij, mat, &ghosts, &nghosts));
  PetscCall(MatGetOwnershipRange(aij, &first[0], NULL));
  PetscCall(MatGetOwnershipRangeColumn(aij, &first[1], NULL));
  PetscCall(MatGetLocalSize(aij, &m, &n));
  PetscCall(AinsworthCreateVecs(aij, transposed.out(), facts->diagonal.out()));
  std::vector<char> others(m, 0); /* there are nonzero entries beside the diagonal */

  if (compare) {
    for (PetscInt j = 0; j < n; j++) v[0].push_back(Random(first[1] + j));
    for (PetscInt j = 0; j < nghosts; j++) v[1].push_back(Random(ghosts[j]));
    for (int p : {0, 1}) Atv[p].assign(v[p].size(), 0.0);
    Av.assign(m, 0.0);
  }
  PetscCall(VecGetArray(facts->diagonal, &d));
  for (int p = 0; p < 2 && mat[p]; p++) {
    AinsworthCSR part;

    PetscCall(part.open(mat[p]));
    for (PetscInt i = 0; i < m; i++) {
      const PetscInt  row = first[0] + i, start = part.ia[i], end = part.ia[i + 1];
      const PetscReal vi    = compare ? Random(row) : 0.0;
      PetscScalar     sum   = 0.0;
      bool            other = others[i];

      for (PetscInt k = start; k < end && !(other && d[i] != 0.0); k++) { /* the first few tell */
        if ((p ? ghosts[part.ja[k]] : first[1] + part.ja[k]) == row) d[i] = part.a[k];
        else other = other || part.a[k] != 0.0;
      }
      others[i] = other;
      if (compare) {
        for (PetscInt k = start; k < end; k++) {
          sum += part.a[k] * v[p][part.ja[k]];
          Atv[p][part.ja[k]] += PetscConj(part.a[k]) * vi;
        }
        Av[i] += sum;
      } else
        for (PetscInt k = start; k < end; k++) sum += part.a[k];
      if (PetscIsInfOrNanScalar(sum)) /* an entry, or the sum alone */
        finite = finite && !std::any_of(part.a + start, part.a + end, [](PetscScalar e) { return e - e != 0.0; });
    }
    PetscCall(part.close());
  }
  agreed->infinite = !finite;
  facts->alone.resize(m);
  for (PetscInt i = 0; i < m; i++) {
    facts->alone[i] = !others[i] && d[i] != 0.0;
    if (facts->alone[i]) agreed->alone = 1.0;
    if (!(PetscRealPart(d[i]) > 0.0)) agreed->other = 1.0;
  }
  PetscCall(VecRestoreArray(facts->diagonal, &d));
  if (!compare) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArray(transposed, &d));
  std::copy(Atv[0].begin(), Atv[0].end(), d);
  PetscCall(VecRestoreArray(transposed, &d));
  if (mat[1]) PetscCall(AddGhosts(transposed, nghosts, ghosts, Atv[1]));
  PetscCall(AinsworthForEntries({transposed, facts->diagonal}, [&](PetscInt i, PetscScalar b, PetscScalar diagonal) {
    agreed->difference = PetscMax(agreed->difference, Difference(Av[i], b, diagonal));
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Multiplies, where the type of A does not give its entries: NaN and Inf survive a product */
static PetscErrorCode Multiply(Mat A, PetscBool compare, Agreed *agreed)
{
  AinsworthRef<Vec> v, Av, Atv, diagonal;
  PetscBool         has;
  PetscInt          first;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(A, v.out(), Av.out()));
  PetscCall(VecDuplicate(Av, diagonal.out()));
  PetscCall(VecGetOwnershipRange(v, &first, NULL));
  PetscCall(AinsworthUpdate(v, [=](PetscInt i, PetscScalar &a) { a = Random(first + i); }));
  PetscCall(MatMult(A, v, Av));
  PetscCall(AinsworthForEntries({Av}, [=](PetscInt, PetscScalar a) {
    if (PetscIsInfOrNanScalar(a)) agreed->infinite = 1.0;
  }));
  PetscCall(MatHasOperation(A, MATOP_MULT_TRANSPOSE, &has));
  if (!has) agreed->difference = 1.0;
  if (!has || !compare) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatHasOperation(A, MATOP_GET_DIAGONAL, &has));
  if (has) PetscCall(MatGetDiagonal(A, diagonal));
  PetscCall(VecDuplicate(v, Atv.out()));
  PetscCall(MatMultHermitianTranspose(A, v, Atv));
  PetscCall(AinsworthForEntries({Av, Atv, diagonal}, [=](PetscInt, PetscScalar a, PetscScalar b, PetscScalar d) {
    agreed->difference = PetscMax(agreed->difference, Difference(a, b, d));
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGetFacts - gets the facts of a square matrix, with one pass over its entries. Collective

   Whether A = A' is found by comparing A v with A' v for a random v, unless the program declared it. Rows are compared
   one by one, so that rows of a soft body count as much as those of a stiff one and nothing underflows. The facts are
   kept with the matrix until its values change.
*/
PetscErrorCode AinsworthGetFacts(Mat A, const AinsworthMatFacts **facts)
{
  static const char                        name[] = "AinsworthFacts";
  std::shared_ptr<const AinsworthMatFacts> kept;
  PetscBool                                known, declared, symmetric;
  uint64_t                                 state;
  Mat                                      opaque;
  Agreed                                   agreed;

  PetscFunctionBegin;
  PetscCall(AinsworthMatGetState(A, &state)); /* raises the state of A if parts of it have changed */
  PetscCall(PetscDefined(USE_COMPLEX) ? MatIsHermitianKnown(A, &declared, &symmetric)
                                      : MatIsSymmetricKnown(A, &declared, &symmetric));
  PetscCall(AinsworthRecall((PetscObject)A, name, &kept, &known));
  if (!known || (declared && kept->symmetric != symmetric)) {
    auto found = std::make_shared<AinsworthMatFacts>();

    PetscCall(AinsworthFindOpaque(A, &opaque));
    found->rows = (PetscBool)!opaque;
    if (opaque) PetscCall(Multiply(A, (PetscBool)!declared, &agreed));
    else {
      AinsworthRef<Mat> aij;

      PetscCall(AinsworthGetAIJ(A, aij.out()));
      PetscCall(ReadRows(aij, (PetscBool)!declared, found.get(), &agreed));
    }
    PetscCall(agreed.agree(PetscObjectComm((PetscObject)A)));
    found->symmetric = declared ? symmetric : (PetscBool)(agreed.difference <= asymmetry);
    found->finite    = (PetscBool)(agreed.infinite == 0.0);
    found->some      = (PetscBool)(agreed.alone != 0.0);
    found->positive  = (PetscBool)(agreed.other == 0.0);
    if (!declared)
      PetscCall(PetscInfo(A, "A is %s: a row of A v and A' v differs by %g of itself for a random v\n",
                          found->symmetric ? "symmetric" : "not symmetric", (double)agreed.difference));
    kept = found;
    PetscCall(AinsworthRemember((PetscObject)A, name, kept));
    if (found->rows) PetscCall(AinsworthRememberDiagonal(A, found->diagonal));
  }
  *facts = kept.get(); /* A keeps them */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthProbeSymmetry - finds whether A = A'. Collective */
PetscErrorCode AinsworthProbeSymmetry(Mat A, PetscBool *symmetric)
{
  const AinsworthMatFacts *facts;

  PetscFunctionBegin;
  PetscCall(AinsworthGetFacts(A, &facts));
  *symmetric = facts->symmetric;
  PetscFunctionReturn(PETSC_SUCCESS);
}
