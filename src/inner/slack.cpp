/*
   Springs as unknowns, for multigrid that stays in Ker C (docs/method.md, compliance)

   The multiplier of a row with D is an unknown t of its own in the levels: A becomes [A 0; 0 d], C x - N mu = 0 becomes
   [C -(N d)^{1/2}] (x, t) = 0 with mu = (d / N)^{1/2} t, and W has 1/d for t, so that S is that of the projector. d is
   the mean of diag(A): the levels of A depend on D by the number of rows alone. A vector of the reduced system is y = x
   + W C' mu. Where D is zero, or so small that its energy was scaled up, t has that energy and no row.
*/
#include "pmat.h"
#include "../base/arrays.h"
#include "../base/columns.h"
#include "../base/layouts.h"
#include "../base/lists.h"
#include "../base/loops.h"
#include "../base/objects.h"
#include "../projection/projector.h"
#include "../saddle/saddle.h"
#include <algorithm>

/* One more slack unknown for so many rows */
static const PetscInt spare = 8;

AinsworthPmatSlack::~AinsworthPmatSlack()
{
  for (Mat *M : {&A, &C, &map}) (void)MatDestroy(M);
  (void)VecDestroy(&weight);
}

/*
   Springs that all give at least this part of the flexibility of their rows are no constraints: their stiffness is
   added to A, which costs no projections. On plates that glue holds (41 000 rows with .18 to .94) that takes .56 s for
   .91 s, and half of the set-up. With .01 ties take 22 to 29 iterations for 16 to 21
*/
static const PetscReal flexible = 0.05;

/*
   AinsworthPmatHasSlack - checks whether springs become unknowns of multigrid in Ker C. Collective

   D has to be diagonal and not negative, so that each row has a spring of its own, and has to hold something: a row is
   stiff, or unknowns without stiffness are in rows
*/
PetscErrorCode AinsworthPmatHasSlack(const AinsworthPmatInputs *in, const AinsworthCompliance *c, PetscBool *has)
{
  PetscBool own[2] = {PETSC_TRUE, PETSC_TRUE}; /* springs of their own, all of them soft */
  Vec       N, squares, counts, d;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(c->N, [&](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++)
      if (row.a[k] != 0.0 && (row.j[k] != row.number || PetscRealPart(row.a[k]) < 0.0)) own[0] = PETSC_FALSE;
  }));
  PetscCall(VecDuplicate(c->rest, &N));
  PetscCall(VecDuplicate(c->rest, &squares));
  PetscCall(MatGetDiagonal(c->N, N));
  PetscCall(AinsworthRowSquares(in->C, in->weight, squares));
  PetscCall(AinsworthForEntries({N, squares}, [&](PetscInt, PetscScalar n, PetscScalar s) {
    if (PetscRealPart(n) < flexible * PetscRealPart(n + s)) own[1] = PETSC_FALSE;
  }));
  PetscCall(AinsworthCountRows(in->C, 0, &counts));
  PetscCall(VecDuplicate(counts, &d));
  PetscCall(AinsworthGetDiagonal(in->aij, d));
  PetscCall(AinsworthForEntries({counts, d}, [&](PetscInt, PetscScalar count, PetscScalar a) {
    if (count != 0.0 && a == 0.0) own[1] = PETSC_FALSE;
  }));
  for (Vec *v : {&N, &squares, &counts, &d}) PetscCall(VecDestroy(v));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, own, 2, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)c->N)));
  *has = (PetscBool)(own[0] && !own[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* Global numbers of the columns of A where each rank has `more` unknowns after its own */
struct Numbers {
  PetscLayout           columns = NULL;
  const PetscInt       *first   = NULL; /* of each rank: its first unknown before, then their number */
  std::vector<PetscInt> shift;          /* of each rank: by how much these numbers grow */
  PetscMPIInt           rank = 0;

  PetscErrorCode create(Mat A, const std::vector<PetscInt> &more)
  {
    PetscFunctionBegin;
    PetscCall(MatGetLayouts(A, NULL, &columns));
    PetscCall(PetscLayoutGetRanges(columns, &first));
    PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)A), &rank));
    shift.assign(1, 0);
    for (PetscInt n : more) shift.push_back(shift.back() + n);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscInt operator()(PetscInt i) const
  {
    PetscMPIInt owner;

    (void)PetscLayoutFindOwner(columns, i, &owner);
    return i + shift[owner];
  }
  PetscInt own() const { return first[rank + 1] + shift[rank]; } /* the first of this rank's additional ones */
};
} // namespace

/* Returns the mean of the nonzero entries of diag(A), or 1. Collective */
static PetscErrorCode MeanDiagonal(Mat A, PetscReal *mean)
{
  Vec       d;
  PetscReal sums[2] = {0.0, 0.0};

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(A, &d, NULL));
  PetscCall(AinsworthGetDiagonal(A, d));
  PetscCall(AinsworthForEntries({d}, [&](PetscInt, PetscScalar v) {
    sums[0] += PetscAbsScalar(v);
    sums[1] += v != 0.0;
  }));
  PetscCall(VecDestroy(&d));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)A)));
  *mean = sums[0] > 0.0 ? sums[0] / sums[1] : 1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies a part of the local rows of an AIJ matrix, column j as toColumn(j), with room for more entries */
template <class ToColumn>
static PetscErrorCode CopyPart(Mat part, PetscInt more, const ToColumn &toColumn, AinsworthRows *rows)
{
  AinsworthCSR csr;

  PetscFunctionBegin;
  PetscCall(csr.open(part));
  const PetscInt nz = csr.ia[csr.n];
  rows->i.assign(csr.ia, csr.ia + csr.n + 1);
  rows->reserve(nz + more);
  std::transform(csr.ja, csr.ja + nz, rows->j.get(), toColumn);
  std::copy_n(csr.a, nz, rows->a.get());
  PetscCall(csr.close());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatSlackExtend - copies the rows of A, AIJ, and after them those of slack unknowns, which have a diagonal
   entry alone. Collective
*/
PetscErrorCode AinsworthPmatSlackExtend(const AinsworthPmatSlack *slack, Mat A, Mat *extended)
{
  Numbers         to;
  auto            own = std::make_unique<AinsworthRows>(), others = std::make_unique<AinsworthRows>();
  Mat             part[2];
  const PetscInt *ghosts;
  PetscInt        n, count;

  PetscFunctionBegin;
  PetscCall(to.create(A, slack->numbers));
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(AinsworthAIJGetParts(A, part, &ghosts, &count));
  const PetscInt more = slack->numbers[to.rank];
  PetscCall(CopyPart(
    part[0], more, [](PetscInt j) { return j; }, own.get()));
  if (part[1])
    PetscCall(CopyPart(
      part[1], 0, [&](PetscInt j) { return to(ghosts[j]); }, others.get()));
  for (PetscInt k = 0, at = own->i.back(); k < more; k++, own->i.push_back(++at)) {
    own->j[at] = n + k;
    own->a[at] = slack->d;
    if (part[1]) others->i.push_back(others->i.back());
  }
  PetscCall(
    AinsworthMatCreateFromRows(PetscObjectComm((PetscObject)A), n + more, std::move(own), std::move(others), extended));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the global number of the slack unknown of each row, laid out as the rows: rows that begin in the same node are
   next to each other; order: the local unknowns node by node, empty if nodes are contiguous. Collective
*/
static PetscErrorCode NumberSlack(Mat C, PetscInt bs, const std::vector<PetscInt> &order, const Numbers &to,
                                  Vec *numbers)
{
  const PetscInt                             own = to.first[to.rank], end = own + (PetscInt)order.size();
  const std::vector<PetscInt>                place = AinsworthInverse(order);
  std::vector<std::pair<PetscInt, PetscInt>> rows; /* node, local row */
  PetscInt                                   first = to.own();
  PetscScalar                               *number;

  PetscFunctionBegin;
  PetscCall(AinsworthCreateVecs(C, NULL, numbers));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    const PetscInt begin = row.n ? row.j[0] : 0;

    rows.push_back({(own <= begin && begin < end ? own + place[begin - own] : begin) / bs, row.local});
  }));
  std::sort(rows.begin(), rows.end());
  PetscCall(VecGetArrayWrite(*numbers, &number));
  for (const auto &row : rows) number[row.second] = (PetscReal)first++;
  PetscCall(VecRestoreArrayWrite(*numbers, &number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates [1, W C' v] with the columns of slack unknowns after those of each rank's x. Collective */
static PetscErrorCode CreateMap(Mat C, Vec weight, Vec v, const Numbers &to, Vec numbers, PetscInt more, Mat *map)
{
  AinsworthEntries   rows;
  PetscInt           n;
  Mat                CW, spread;
  AinsworthAtColumns number;

  PetscFunctionBegin;
  PetscCall(AinsworthScaleColumns(C, weight, &CW));
  PetscCall(MatDiagonalScale(CW, v, NULL));
  PetscCall(MatHermitianTranspose(CW, MAT_INITIAL_MATRIX, &spread));
  PetscCall(MatDestroy(&CW));
  PetscCall(MatGetLocalSize(C, NULL, &n));
  PetscCall(number.create(spread, numbers));
  PetscCall(AinsworthForRows(spread, [&](const AinsworthMatRow &row) {
    rows.add(to(row.number), 1.0);
    for (PetscInt k = 0; k < row.n; k++) rows.add((PetscInt)PetscRealPart(number(row.j[k])), row.a[k]);
    rows.endRow();
  }));
  PetscCall(MatDestroy(&spread));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)C), n + more, rows, map));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthPmatCreateSlack - creates A, C and W with slack unknowns after those of x on each rank, and the map to
   vectors of the reduced system. Collective

   bs: unknowns per node, of which those of the slack unknowns are a multiple on each rank; those too many are alone;
   order: the local unknowns node by node, empty if nodes are contiguous. existing: so many are there already on this
   rank; they stay if they are whole nodes, enough, and not far too many, as the levels of A depend on their number:
   contact changes the number of rows in each step
*/
PetscErrorCode AinsworthPmatCreateSlack(const AinsworthPmatInputs *in, const AinsworthCompliance *c, PetscInt bs,
                                        const std::vector<PetscInt> &order, PetscInt existing, AinsworthPmatSlack *made)
{
  PetscInt         m, n;
  PetscMPIInt      size;
  Vec              N, E, spring, scale, numbers;
  Numbers          to;
  AinsworthEntries rows;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(in->C, &m, &n));
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)in->C), &size));
  const PetscInt ample = m + m / spare, nodes = (ample + bs - 1) / bs * bs,
                 more = existing % bs == 0 && m <= existing && existing <= 2 * ample ? existing : nodes;
  made->numbers.resize(size);
  PetscCallMPI(
    MPI_Allgather(&more, 1, MPIU_INT, made->numbers.data(), 1, MPIU_INT, PetscObjectComm((PetscObject)in->C)));
  PetscCall(to.create(in->C, made->numbers));
  PetscCall(MeanDiagonal(in->aij, &made->d));
  PetscCall(AinsworthPmatSlackExtend(made, in->aij, &made->A));
  const PetscReal d = made->d;

  for (Vec *v : {&N, &E, &scale}) PetscCall(VecDuplicate(c->rest, v));
  PetscCall(MatGetDiagonal(c->N, N));
  PetscCall(MatGetDiagonal(c->E, E));
  PetscCall(VecAXPY(E, 1.0, c->rest));
  PetscCall(AinsworthUpdate(scale, {N, E, c->inverse},
                            [=](PetscInt, PetscScalar &v, PetscScalar a, PetscScalar e, PetscScalar inverse) {
                              const PetscReal energy = a != 0.0 && inverse == 1.0 ? PetscRealPart(a) : PetscRealPart(e);

                              v = energy > 0.0 ? PetscSqrtReal(d / energy) : 0.0;
                            }));
  PetscCall(AinsworthVecClone(N, &spring));
  PetscCall(AinsworthUpdate(spring, {c->inverse}, [=](PetscInt, PetscScalar &s, PetscScalar inverse) {
    s = inverse == 1.0 ? -PetscSqrtReal(PetscRealPart(s)) * PetscSqrtReal(d) : 0.0;
  }));
  PetscCall(NumberSlack(in->C, bs, order, to, &numbers));
  PetscCall(CreateMap(in->C, in->weight, scale, to, numbers, more, &made->map));

  const PetscScalar *s, *number;
  PetscCall(VecGetArrayRead(numbers, &number));
  PetscCall(VecGetArrayRead(spring, &s));
  PetscCall(AinsworthForRows(in->C, [&](const AinsworthMatRow &row) {
    for (PetscInt k = 0; k < row.n; k++) rows.add(to(row.j[k]), row.a[k]);
    if (s[row.local] != 0.0) rows.add((PetscInt)PetscRealPart(number[row.local]), s[row.local]);
    rows.endRow();
  }));
  PetscCall(VecRestoreArrayRead(spring, &s));
  PetscCall(VecRestoreArrayRead(numbers, &number));
  PetscCall(AinsworthCreateAIJ(PetscObjectComm((PetscObject)in->C), n + more, rows, &made->C));

  PetscCall(AinsworthCreateVecs(made->A, &made->weight, NULL));
  const PetscScalar *w;
  PetscScalar       *all;
  PetscCall(VecGetArrayRead(in->weight, &w));
  PetscCall(VecGetArrayWrite(made->weight, &all));
  std::copy(w, w + n, all);
  std::fill(all + n, all + n + more, 1.0 / d);
  PetscCall(VecRestoreArrayWrite(made->weight, &all));
  PetscCall(VecRestoreArrayRead(in->weight, &w));
  for (Vec *v : {&N, &E, &spring, &scale, &numbers}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}
