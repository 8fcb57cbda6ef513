/* The scale of a system: powers of 2 that bring the entries of [A B'; C -D] to about 1 */
#include "saddle.h"
#include "../base/arrays.h"
#include "../base/layouts.h"
#include "../base/loops.h"
#include <algorithm>
#include <cmath>

/*
   Returns the power of 2 next to the inverse of the root, by which products cause no rounding; 1 for a size that says
   nothing
*/
static PetscReal InverseRoot(PetscReal size)
{
  int exponent;

  if (!(size > 0.0) || PetscIsInfOrNanReal(size)) return 1.0;
  (void)std::frexp((double)size, &exponent);
  return (PetscReal)std::ldexp(1.0, -(int)std::floor(0.5 * exponent));
}

/*
   Computes the stiffness of each unknown: the diagonal of A or, where that is not positive, the largest entry of the
   row; 0 in rows of zeros. positive: there are no other rows where it is not
*/
static PetscErrorCode Stiffness(Mat A, Vec *stiffness, PetscBool *positive)
{
  const AinsworthMatFacts *facts;
  AinsworthRef<Mat>        aij;
  AinsworthRef<Vec>        largest;

  PetscFunctionBegin;
  PetscCall(AinsworthGetFacts(A, &facts));
  PetscCall(AinsworthCreateDiagonal(A, stiffness));
  *positive = PETSC_TRUE;
  if (facts->rows && !facts->positive) {
    PetscCall(AinsworthGetAIJ(A, aij.out()));
    PetscCall(VecDuplicate(*stiffness, largest.out()));
    PetscCall(MatGetRowMaxAbs(aij, largest, NULL));
    PetscCall(AinsworthUpdate(*stiffness, {largest}, [=](PetscInt, PetscScalar &d, PetscScalar entry) {
      if (PetscRealPart(d) > 0.0) return;
      d = entry;
      if (entry != 0.0) *positive = PETSC_FALSE;
    }));
    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, positive, 1, AINSWORTH_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)A)));
  }
  PetscCall(AinsworthUpdate(*stiffness, [](PetscInt, PetscScalar &d) { d = PetscMax(PetscRealPart(d), 0.0); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{
/* A block of the system as it is scaled, without a copy */
class Block {
public:
  PetscErrorCode create(Mat M);
  /*
     Raises the entries of two vectors to the largest |row_i M_ij column_j| of each row and, unless it is NULL, of each
     column. Collective
  */
  PetscErrorCode raise(Vec row, Vec column, Vec mostOfRow, Vec mostOfColumn);

private:
  Mat                   part[2] = {NULL, NULL}; /* borrowed */
  AinsworthRef<PetscSF> sf;                     /* from columns to where they are on other ranks; NULL on one rank */

  std::vector<PetscScalar> scale; /* of the columns of other ranks */
  std::vector<PetscReal>   most[2];
};

PetscErrorCode Block::create(Mat M)
{
  const PetscInt *ghosts;
  PetscInt        n, others;

  PetscFunctionBegin;
  PetscCall(AinsworthAIJGetParts(M, part, &ghosts, &others));
  PetscCall(MatGetLocalSize(M, NULL, &n));
  most[0].resize(n);
  most[1].resize(others);
  scale.resize(others);
  PetscCall(AinsworthColumnsCreateSF(M, sf.out()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Block::raise(Vec row, Vec column, Vec mostOfRow, Vec mostOfColumn)
{
  const PetscScalar *r, *c[2] = {NULL, scale.data()};
  PetscScalar       *raised;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(row, &r));
  PetscCall(VecGetArrayRead(column, &c[0]));
  PetscCall(VecGetArray(mostOfRow, &raised));
  if (sf) {
    PetscCall(PetscSFBcastBegin(sf, MPIU_SCALAR, c[0], scale.data(), MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(sf, MPIU_SCALAR, c[0], scale.data(), MPI_REPLACE));
  }
  for (int p = 0; p < 2 && part[p]; p++) {
    AinsworthCSR rows;

    std::fill(most[p].begin(), most[p].end(), 0.0);
    PetscCall(rows.open(part[p]));
    for (PetscInt i = 0; i < rows.n; i++) {
      PetscReal largest = PetscRealPart(raised[i]);

      for (PetscInt k = rows.ia[i]; k < rows.ia[i + 1]; k++) {
        const PetscInt  j = rows.ja[k];
        const PetscReal a = PetscAbsScalar(rows.a[k]) * PetscRealPart(r[i]) * PetscRealPart(c[p][j]);

        largest    = PetscMax(largest, a);
        most[p][j] = PetscMax(most[p][j], a);
      }
      raised[i] = largest;
    }
    PetscCall(rows.close());
  }
  PetscCall(VecRestoreArray(mostOfRow, &raised));
  PetscCall(VecRestoreArrayRead(column, &c[0]));
  PetscCall(VecRestoreArrayRead(row, &r));
  if (!mostOfColumn) PetscFunctionReturn(PETSC_SUCCESS);
  if (sf) {
    PetscCall(PetscSFReduceBegin(sf, MPIU_REAL, most[1].data(), most[0].data(), MPIU_MAX));
    PetscCall(PetscSFReduceEnd(sf, MPIU_REAL, most[1].data(), most[0].data(), MPIU_MAX));
  }
  PetscCall(
    AinsworthUpdate(mostOfColumn, [&](PetscInt j, PetscScalar &m) { m = PetscMax(PetscRealPart(m), most[0][j]); }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The blocks that multipliers have rows in: C and C', B' and B, -D */
struct Blocks {
  std::vector<Block> rows;    /* C, and B if it is not C: rows of multipliers, columns of unknowns */
  std::vector<Block> springs; /* D */
};
} // namespace

/* Computes the geometric mean of the entries that are not 0; 1 if there are none. Collective */
static PetscErrorCode GeometricMean(Vec v, PetscReal *mean)
{
  PetscReal sums[2] = {0.0, 0.0};

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({v}, [&](PetscInt, PetscScalar a) {
    if (!(PetscRealPart(a) > 0.0) || PetscIsInfOrNanScalar(a)) return;
    sums[0] += PetscLogReal(PetscRealPart(a));
    sums[1] += 1.0;
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)v)));
  *mean = sums[1] > 0.0 ? PetscExpReal(sums[0] / sums[1]) : 1.0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Begins with one number for all unknowns, and for each multiplier one that makes the largest entry of its row about 1,
   so that the units of A and of each row of C do not matter; rows of zeros get the mean of the others
*/
static PetscErrorCode Start(Blocks &blocks, Vec stiffness, AinsworthSaddleVec scale, AinsworthSaddleVec most)
{
  PetscReal s, mean;

  PetscFunctionBegin;
  PetscCall(GeometricMean(stiffness, &s));
  PetscCall(VecSet(scale.primal, InverseRoot(s)));
  PetscCall(VecSet(scale.dual, 1.0));
  PetscCall(VecZeroEntries(most.dual));
  for (Block &b : blocks.rows) PetscCall(b.raise(scale.dual, scale.primal, most.dual, NULL));
  PetscCall(GeometricMean(most.dual, &mean));
  PetscCall(AinsworthUpdate(scale.dual, {most.dual}, [=](PetscInt, PetscScalar &t, PetscScalar m) {
    const PetscReal root = InverseRoot(m != 0.0 ? PetscRealPart(m) : mean);

    t = root * root;
  }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Equilibrates by the largest entries of rows and columns (Ruiz 2001), with the diagonal in place of A

   An entry of a positive definite A is at most the root of the product of two diagonal entries. Each sweep halves the
   decades that are left between rows, and one that changes nothing is the last
*/
static PetscErrorCode Equilibrate(Blocks &blocks, Vec stiffness, AinsworthSaddleVec scale)
{
  static const int   sweeps = 8; /* 2^8 decades */
  AinsworthSaddleVec most;

  PetscFunctionBegin;
  PetscCall(AinsworthSaddleVecDuplicate(scale, &most));
  PetscCall(Start(blocks, stiffness, scale, most));
  for (int sweep = 0; sweep < sweeps; sweep++) {
    PetscBool changed = PETSC_FALSE;

    PetscCall(VecPointwiseMult(most.primal, scale.primal, scale.primal));
    PetscCall(VecPointwiseMult(most.primal, most.primal, stiffness));
    PetscCall(VecZeroEntries(most.dual));
    for (Block &b : blocks.rows) PetscCall(b.raise(scale.dual, scale.primal, most.dual, most.primal));
    for (Block &b : blocks.springs) PetscCall(b.raise(scale.dual, scale.dual, most.dual, NULL));
    for (Vec v : {most.primal, most.dual}) {
      PetscCall(AinsworthUpdate(v, [&](PetscInt, PetscScalar &m) {
        m = InverseRoot(PetscRealPart(m));
        if (m != 1.0) changed = PETSC_TRUE;
      }));
    }
    PetscCall(
      MPIU_Allreduce(MPI_IN_PLACE, &changed, 1, AINSWORTH_MPI_BOOL, MPI_LOR, PetscObjectComm((PetscObject)stiffness)));
    if (!changed) break;
    PetscCall(VecPointwiseMult(scale.primal, scale.primal, most.primal));
    PetscCall(VecPointwiseMult(scale.dual, scale.dual, most.dual));
  }
  PetscCall(AinsworthSaddleVecDestroy(&most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthSaddleScale - finds the scale of the program's system, its unknowns without stiffness, and its rows with
   springs. Collective

   The scale is made of positive powers of 2, so that the largest entry of each row and column of the scaled [A B'; C
   -D] is about 1. An unknown that no stiffer row holds gets A_ii^{-1/2}, no other one more: an error t in the energy
   norm leaves at most 2 t in each scaled row (Cauchy-Schwarz)
*/
PetscErrorCode AinsworthSaddleScale(AinsworthSaddle *sp)
{
  Blocks blocks;

  PetscFunctionBegin;
  PetscCall(Stiffness(sp->block[AINSWORTH_BLOCK_A], sp->stiffness.out(), &sp->positive));
  PetscCall(AinsworthForEntries({sp->stiffness}, [sp](PetscInt, PetscScalar d) { sp->loose.push_back(d == 0.0); }));
  PetscCall(VecDuplicate(sp->stiffness, sp->scale.primal.out()));
  PetscCall(AinsworthCreateVecs(sp->all.C, NULL, sp->scale.dual.out()));
  blocks.rows.resize(sp->oneSided() ? 1 : 2);
  PetscCall(blocks.rows[0].create(sp->all.C));
  if (!sp->oneSided()) PetscCall(blocks.rows[1].create(sp->all.B));
  sp->sprung.assign(sp->local(), false);
  if (sp->all.D) {
    blocks.springs.resize(1);
    PetscCall(blocks.springs[0].create(sp->all.D));
    PetscCall(AinsworthForRows(sp->all.D, [sp](const AinsworthMatRow &row) {
      sp->sprung[row.local] = std::any_of(row.a, row.a + row.n, [](PetscScalar v) { return v != 0.0; });
    }));
  }
  PetscCall(Equilibrate(blocks, sp->stiffness, sp->scale));
  PetscFunctionReturn(PETSC_SUCCESS);
}
