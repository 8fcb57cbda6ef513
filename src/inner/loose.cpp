/*
   Unknowns with zero rows in A (reference nodes, links): they are eliminated from the penalty in M_* (docs/method.md)
*/
#include "pmat.h"
#include "../base/layouts.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../projection/graph.h"
#include "../projection/projector.h"
#include "../saddle/saddle.h"
#include <algorithm>
#include <vector>

/*
   Loose unknowns that rows of C couple, directly or indirectly, form a group. A group is eliminated if it has at most
   mostLoose unknowns, none of them in more rows than usual, and if its rows touch at most mostEntries unknowns.
*/
static const PetscInt  mostLoose   = 64;
static const PetscReal mostEntries = 1024.0;
/* Rows count as rigid if D leaves at least this fraction of their penalty */
static const PetscReal rigidEnough = 0.998;
/* The squares of these numbers of entries add up to at most this fraction of the entries of A */
static const PetscReal budget = 1.0;
/* Relative shift of the diagonal before inversion, because nothing may hold a group */
static const PetscReal shift = 1e-12;

namespace
{
/* The groups, on every rank, with the whole of K = Cl' B Cl, where Cl has the columns of C of the loose unknowns */
struct Groups : AinsworthCSR {
  Mat                               *whole = NULL;
  std::vector<PetscInt>              of;      /* group of each loose unknown */
  std::vector<std::vector<PetscInt>> members; /* unknowns of each group, ascending */
  std::vector<char>                  taken;   /* whether each group is eliminated */

  PetscErrorCode create(Mat K);
  PetscErrorCode choose(Mat C, Mat Cl, Vec rigid, const AinsworthPmatFill *fill);
  PetscErrorCode markRows(Mat Cl, std::vector<char> *rows) const;
  PetscErrorCode createInverse(Mat K, Mat *inverse) const;
  PetscErrorCode destroy();
};

PetscErrorCode Groups::create(Mat K)
{
  PetscFunctionBegin;
  PetscCall(AinsworthGraphGather(K, true, &whole));
  PetscCall(open(whole[0]));
  AinsworthGraphComponents(*this, &of);
  for (PetscInt i = 0; i < n; i++) {
    if (of[i] == i) members.emplace_back();
    of[i] = of[i] == i ? (PetscInt)members.size() - 1 : of[of[i]];
    members[of[i]].push_back(i);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Groups::destroy()
{
  PetscFunctionBegin;
  PetscCall(close());
  PetscCall(MatDestroySubMatrices(1, &whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Chooses the groups to eliminate: small ones with rigid rows that add few entries to M_*. Collective */
PetscErrorCode Groups::choose(Mat C, Mat Cl, Vec rigid, const AinsworthPmatFill *fill)
{
  std::vector<PetscReal>             touched(members.size(), 0.0), count(n, 0.0);
  std::vector<PetscInt>              group; /* group of each local row, or -1 */
  std::vector<std::vector<PetscInt>> columns(members.size());
  std::vector<char>                  small;
  const PetscScalar                 *part;
  PetscReal                          most = mostEntries, sum = PETSC_INFINITY;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(Cl, [&](const AinsworthMatRow &row) {
    group.push_back(row.n ? of[row.j[0]] : -1);
    for (PetscInt k = 0; k < row.n; k++) count[row.j[k]] += 1.0;
  }));
  PetscCall(VecGetArrayRead(rigid, &part));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    const PetscInt g = group[row.local];

    if (g < 0) return;
    if (PetscRealPart(part[row.local]) < rigidEnough) touched[g] = 2.0 * mostEntries;
    columns[g].insert(columns[g].end(), row.j, row.j + row.n);
  }));
  PetscCall(VecRestoreArrayRead(rigid, &part));
  for (size_t g = 0; g < members.size(); g++) {
    AinsworthSortUnique(&columns[g]);
    touched[g] += (PetscReal)columns[g].size();
  }
  for (std::vector<PetscReal> *sums : {&touched, &count})
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums->data(), (PetscMPIInt)sums->size(), MPIU_REAL, MPIU_SUM,
                             PetscObjectComm((PetscObject)C)));
  for (const auto &group : members)
    small.push_back((PetscInt)group.size() <= mostLoose &&
                    std::all_of(group.begin(), group.end(), [&](PetscInt l) { return count[l] <= fill->usual; }));
  for (; sum > budget * fill->entries && most >= 1.0; most *= 0.5) {
    sum = 0.0;
    taken.clear();
    for (size_t g = 0; g < members.size(); g++) {
      taken.push_back(small[g] && touched[g] <= most);
      if (taken[g]) sum += PetscSqr(touched[g]);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks the local rows with an unknown that is eliminated */
PetscErrorCode Groups::markRows(Mat Cl, std::vector<char> *rows) const
{
  PetscFunctionBegin;
  rows->clear();
  PetscCall(AinsworthForRows(Cl, [=](const AinsworthMatRow &row) { rows->push_back(row.n && taken[of[row.j[0]]]); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates K^{-1} for the groups that are eliminated, zero elsewhere, laid out as K. Collective */
PetscErrorCode Groups::createInverse(Mat K, Mat *inverse) const
{
  PetscInt                 rstart, rend, last = -1;
  AinsworthEntries         rows;
  std::vector<PetscScalar> dense;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(K, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    const PetscInt               group = of[i];
    const std::vector<PetscInt> &in    = members[group];
    const size_t                 row   = std::lower_bound(in.begin(), in.end(), i) - in.begin();

    if (taken[group] && group != last) {
      PetscBool definite;

      PetscCall(AinsworthInvertBlock(*this, in, shift, &dense, &definite));
      if (!definite || std::any_of(dense.begin(), dense.end(), [](PetscScalar v) { return PetscIsInfOrNanScalar(v); }))
        dense.assign(dense.size(), 0.0);
    }
    if (taken[group]) last = group;
    for (size_t c = 0; c < in.size() && taken[group]; c++) rows.add(in[c], dense[row + c * in.size()]);
    rows.endRow();
  }
  PetscCall(AinsworthCreateAIJLike(K, rows, inverse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/*
   Finds the unknowns with a zero row in A that are in rows of C and have a weight, ascending on each rank; NULL if
   there are none. Collective
*/
static PetscErrorCode FindLoose(Mat A, Mat C, Vec weight, IS *loose)
{
  PetscInt              rstart, found;
  std::vector<PetscInt> list;
  Vec                   diagonal, counts;

  PetscFunctionBegin;
  *loose = NULL;
  PetscCall(AinsworthCreateDiagonal(A, &diagonal));
  PetscCall(AinsworthCountRows(C, 0, &counts));
  PetscCall(VecGetOwnershipRange(diagonal, &rstart, NULL));
  PetscCall(
    AinsworthForEntries({diagonal, weight, counts}, [&](PetscInt i, PetscScalar a, PetscScalar w, PetscScalar count) {
      if (a == 0.0 && w != 0.0 && count != 0.0) list.push_back(rstart + i);
    }));
  PetscCall(VecDestroy(&counts));
  PetscCall(VecDestroy(&diagonal));
  found = (PetscInt)list.size();
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &found, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  if (found)
    PetscCall(
      ISCreateGeneral(PetscObjectComm((PetscObject)A), (PetscInt)list.size(), list.data(), PETSC_COPY_VALUES, loose));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Splits B^{1/2} C into Cl, the columns of loose unknowns, and Cx, the others; rigid: fraction of the penalty of each
   row that D leaves
*/
static PetscErrorCode Split(const AinsworthPmatInputs *in, PetscReal gamma, Mat C, IS loose, Mat *Cx, Mat *Cl,
                            Vec *rigid)
{
  /* weights loose unknowns as if they were stiffer: then springs in series are about as stiff as others */
  static const PetscReal stiffer = 0.1;
  PetscInt               rstart, rend;
  Vec                    scale, weight, penalty, series;
  IS                     rows;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(in->inverseDiagonal, &scale));
  PetscCall(VecDuplicate(scale, &weight));
  PetscCall(VecSet(scale, 1.0));
  PetscCall(VecISSet(scale, loose, 0.0));
  PetscCall(AinsworthScaleColumns(C, scale, Cx));
  PetscCall(MatGetOwnershipRange(C, &rstart, &rend));
  PetscCall(ISCreateStride(PetscObjectComm((PetscObject)C), rend - rstart, rstart, 1, &rows));
  PetscCall(MatCreateSubMatrix(C, rows, loose, MAT_INITIAL_MATRIX, Cl));
  PetscCall(ISDestroy(&rows));
  PetscCall(VecISSet(scale, loose, stiffer / AinsworthLooseFactor(in->compliance != NULL)));
  PetscCall(VecPointwiseMult(weight, scale, in->weight));
  PetscCall(AinsworthRowPenaltyCreate(C, weight, gamma, &penalty));
  PetscCall(VecDestroy(&scale));
  PetscCall(VecDestroy(&weight));
  PetscCall(AinsworthPmatCreateSeries(penalty, in->compliance, &series));
  PetscCall(VecDuplicate(series, rigid));
  PetscCall(VecPointwiseDivide(*rigid, series, penalty));
  PetscCall(VecSqrtAbs(series));
  PetscCall(MatDiagonalScale(*Cx, series, NULL));
  PetscCall(MatDiagonalScale(*Cl, series, NULL));
  PetscCall(VecDestroy(&penalty));
  PetscCall(VecDestroy(&series));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the diagonal of K on the eliminated unknowns, where M_* has nothing else; like: M_* */
static PetscErrorCode CreateDiagonalPart(Mat K, const Groups &groups, IS loose, Mat like, Mat *part)
{
  PetscInt first;
  Vec      diagonal, all;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(K, &first, NULL));
  PetscCall(AinsworthCreateVecs(K, &diagonal, NULL));
  PetscCall(AinsworthCreateVecs(like, &all, NULL));
  PetscCall(VecZeroEntries(all));
  PetscCall(MatGetDiagonal(K, diagonal));
  PetscCall(AinsworthUpdate(diagonal, [&](PetscInt k, PetscScalar &d) {
    if (!groups.taken[groups.of[first + k]]) d = 0.0;
  }));
  PetscCall(VecISCopy(all, loose, SCATTER_FORWARD, diagonal));
  PetscCall(AinsworthCreateFromDiagonal(all, part));
  PetscCall(VecDestroy(&all));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatEliminateLoose - splits off the rows of C with loose unknowns l, and computes what they add to M_*.
   Collective

   rest: the other rows of C. part: the contribution to M_*, or NULL. With P the penalty, it is Cx' (P - P Cl K^{-1} Cl'
   P) Cx with K = Cl' P Cl: l follows the other unknowns at no energy, like springs in series. Interpolation made from A
   alone does not reach l, and the penalty of its rows would lock. l is left to the projector, whose weight moves it
   first. Groups that would add many entries stay in rest.
*/
PetscErrorCode AinsworthPmatEliminateLoose(const AinsworthPmatInputs *in, PetscReal gamma, Mat C, Mat *rest, Mat *part)
{
  IS                loose;
  Vec               rigid;
  Mat               Cx, Cl, K, inverse, mixed, product, released, diagonal;
  std::vector<char> rows;
  PetscInt          any;
  Groups            groups;

  PetscFunctionBegin;
  *part = NULL;
  PetscCall(AinsworthShare(C, rest));
  PetscCall(FindLoose(in->aij, C, in->weight, &loose));
  if (!loose) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(Split(in, gamma, C, loose, &Cx, &Cl, &rigid));
  PetscCall(AinsworthMultiplyAdjoint(Cl, Cl, &K));
  PetscCall(groups.create(K));
  PetscCall(groups.choose(C, Cl, rigid, &in->fill));
  PetscCall(
    PetscInfo(C,
              "%" PetscInt_FMT
              " unknowns without stiffness in %d groups, of which %d are eliminated from the preconditioning matrix\n",
              groups.n, (int)groups.members.size(), (int)std::count(groups.taken.begin(), groups.taken.end(), 1)));
  any = std::count(groups.taken.begin(), groups.taken.end(), 1) > 0;
  if (any) {
    PetscCall(groups.markRows(Cl, &rows));
    for (Mat *mat : {&Cx, &Cl}) {
      Mat all = *mat;

      PetscCall(AinsworthCopyMarkedRows(all, &rows, mat));
      PetscCall(MatDestroy(&all));
    }
    for (char &row : rows) row = !row;
    PetscCall(MatDestroy(rest));
    PetscCall(AinsworthCopyMarkedRows(C, &rows, rest));
    PetscCall(groups.createInverse(K, &inverse));
    PetscCall(AinsworthMultiplyAdjoint(Cl, Cx, &mixed));
    PetscCall(MatMatMult(inverse, mixed, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
    PetscCall(AinsworthMultiplyAdjoint(mixed, product, &released));
    PetscCall(AinsworthMultiplyAdjoint(Cx, Cx, part));
    PetscCall(CreateDiagonalPart(K, groups, loose, *part, &diagonal));
    PetscCall(MatScale(released, -1.0));
    PetscCall(AinsworthAddAIJ(1.0, {released, diagonal}, part));
    for (Mat *mat : {&inverse, &mixed, &product, &released, &diagonal}) PetscCall(MatDestroy(mat));
  }
  PetscCall(groups.destroy());
  for (Mat *mat : {&Cx, &Cl, &K}) PetscCall(MatDestroy(mat));
  PetscCall(VecDestroy(&rigid));
  PetscCall(ISDestroy(&loose));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatReleaseLoose - eliminates loose unknowns, those with a weight whose rows of A are zero, from the rows of
   C. Collective

   released: C itself if there are none; else the rows scaled to C W C' = 1, with W of `in`, and in each group that is
   eliminated Cx - Cl K^{-1} Cl' Cx with K = Cl' Cl: what they ask of the other unknowns, wherever l is. Rows that ask
   for nothing become zero up to rounding, others appear several times
*/
PetscErrorCode AinsworthPmatReleaseLoose(const AinsworthPmatInputs *in, Vec weight, Mat C, Mat *released)
{
  IS                loose, rows;
  Vec               scale, kept;
  Mat               Cx, Cl, K, inverse, mixed, product, correction;
  PetscInt          rstart, rend;
  std::vector<char> marked;
  Groups            groups;

  PetscFunctionBegin;
  PetscCall(FindLoose(in->aij, C, weight, &loose));
  if (!loose) {
    PetscCall(AinsworthShare(C, released));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatDuplicate(C, MAT_COPY_VALUES, released));
  PetscCall(AinsworthRowPenaltyCreate(C, in->weight, 1.0, &scale));
  PetscCall(VecSqrtAbs(scale));
  PetscCall(MatDiagonalScale(*released, scale, NULL));
  PetscCall(VecDestroy(&scale));
  PetscCall(MatGetOwnershipRange(C, &rstart, &rend));
  PetscCall(ISCreateStride(PetscObjectComm((PetscObject)C), rend - rstart, rstart, 1, &rows));
  PetscCall(MatCreateSubMatrix(*released, rows, loose, MAT_INITIAL_MATRIX, &Cl));
  PetscCall(AinsworthMultiplyAdjoint(Cl, Cl, &K));
  PetscCall(groups.create(K));
  for (const auto &members : groups.members) groups.taken.push_back((PetscInt)members.size() <= mostLoose);
  PetscCall(PetscInfo(C, "%" PetscInt_FMT " unknowns without stiffness in %d groups are released from the rows of C\n",
                      groups.n, (int)groups.members.size()));
  PetscCall(groups.markRows(Cl, &marked));
  PetscCall(groups.createInverse(K, &inverse));
  PetscCall(VecDuplicate(weight, &kept));
  PetscCall(VecSet(kept, 1.0));
  PetscCall(VecISSet(kept, loose, 0.0));
  PetscCall(AinsworthScaleColumns(*released, kept, &product));
  PetscCall(AinsworthCopyMarkedRows(product, &marked, &Cx));
  PetscCall(MatDestroy(&product));
  for (char &row : marked) row = !row;
  PetscCall(AinsworthCopyMarkedRows(*released, &marked, &product));
  PetscCall(MatDestroy(released));
  *released = product;
  PetscCall(AinsworthMultiplyAdjoint(Cl, Cx, &mixed));
  PetscCall(MatMatMult(inverse, mixed, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
  PetscCall(MatMatMult(Cl, product, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &correction));
  PetscCall(MatScale(correction, -1.0));
  PetscCall(AinsworthAddAIJ(1.0, {Cx, correction}, released));
  PetscCall(groups.destroy());
  for (Mat *mat : {&Cx, &Cl, &K, &inverse, &mixed, &product, &correction}) PetscCall(MatDestroy(mat));
  PetscCall(VecDestroy(&kept));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&loose));
  PetscFunctionReturn(PETSC_SUCCESS);
}
