/*
   What multigrid in Ker C has to know of C (docs/multigrid.md, the cycle in Ker C)

   The smoother of the finest level projects exactly. Coarse functions Q_* P, with an approximate inverse of S, are in Ker C of the short rows up to the last
   projection. Unknowns without stiffness that several rows share have no weight there and are carried to all levels; rows that are long, or have only such unknowns,
   are kept as few constraints of the coarser levels
*/
#include "pmat.h"
#include "../lists.h"
#include "../loops.h"
#include "../objects.h"
#include "../projector/projector.h"
#include "../saddle/saddle.h"

/* Unknowns without stiffness in more rows are carried: with a weight they would couple these rows, for which a diagonal Inv(S) is too crude */
static const PetscReal fewRows = 8.0;
/* A row has no weight left if its entry of S is at most this part of what the weight of all unknowns gives it */
static const PetscReal weightless = 1e-10;
/* The same where loose unknowns do all that a row asks for */
static const PetscReal nothing = 1e-16;
/* At most so many rows are kept as constraints of coarser levels; the projector alone knows of others */
static const size_t mostKept = 64;

namespace
{
/* What becomes of the rows and unknowns of C */
struct Roles {
  std::vector<char>     shortRows; /* local rows: in Q_* */
  std::vector<PetscInt> kept;      /* rows kept as constraints, global numbers of all ranks */
  std::vector<PetscInt> carried;   /* unknowns, global numbers of all ranks */
  Vec                   weight;    /* of Q_*, length n */
};
} // namespace

/* Finds carried unknowns, and the weight of Q_*: none for these and for masters in unusually many rows. Collective */
static PetscErrorCode FindCarried(const AinsworthPmatInputs *in, Vec counts, Vec zeros, Roles *roles)
{
  PetscInt              rstart;
  std::vector<PetscInt> mine;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(counts, &rstart, NULL));
  PetscCall(AinsworthVecClone(in->weight, &roles->weight));
  PetscCall(AinsworthUpdate(roles->weight, {counts, zeros}, [&](PetscInt i, PetscScalar &w, PetscScalar count, PetscScalar zero) {
    const bool carry = zero != 0.0 && PetscRealPart(count) > fewRows;

    if (carry) mine.push_back(rstart + i);
    if (carry || PetscRealPart(count) > in->fill.usual) w = 0.0;
  }));
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)in->C), mine, &roles->carried));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks unknowns whose rows of A are zero by 1, all others by 0. Collective */
static PetscErrorCode MarkZeroRows(const AinsworthPmatInputs *in, Vec zeros)
{
  PetscFunctionBegin;
  PetscCall(AinsworthRowSums(in->aij, 1, zeros));
  PetscCall(AinsworthUpdate(zeros, [](PetscInt, PetscScalar &z) { z = z == 0.0 ? 1.0 : 0.0; }));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Decides which rows, scaled to C W C' = 1 before loose unknowns were released from them, are in Q_*, and which are kept. Collective */
static PetscErrorCode ChooseRows(const AinsworthPmatInputs *in, Mat C, Roles *roles)
{
  Vec                    left, all;
  std::vector<char>      asks;
  std::vector<PetscInt>  mine;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(C, NULL, &left));
  PetscCall(VecDuplicate(left, &all));
  PetscCall(AinsworthRowSquares(C, roles->weight, left));
  PetscCall(AinsworthRowSquares(C, in->weight, all));
  PetscCall(AinsworthForEntries({left, all}, [&](PetscInt, PetscScalar l, PetscScalar a) {
    asks.push_back(PetscRealPart(a) > nothing);
    roles->shortRows.push_back(asks.back() && PetscRealPart(l) > weightless * PetscRealPart(a));
  }));
  PetscCall(AinsworthForRows(C, [&](const AinsworthMatRow &row) {
    if (row.n > PetscMax(in->fill.most, in->fill.usual)) roles->shortRows[row.local] = 0;
    if (asks[row.local] && !roles->shortRows[row.local]) mine.push_back(row.number);
  }));
  PetscCall(VecDestroy(&left));
  PetscCall(VecDestroy(&all));
  PetscCall(AinsworthGatherLists(PetscObjectComm((PetscObject)C), mine, &roles->kept));
  if (roles->kept.size() > mostKept) {
    PetscCall(PetscInfo(C, "%d rows of C would have to be kept on all levels: the projector alone has them\n", (int)roles->kept.size()));
    roles->kept.clear();
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthPmatCreateInKernel - creates I - Q_* for the coarser levels, and what these keep; NULL if no row is in Q_*. Collective */
PetscErrorCode AinsworthPmatCreateInKernel(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, AinsworthPmatInKernel *made)
{
  Roles             roles;
  Vec               counts, zeros;
  Mat               all, C, CW, CWt, S, XC, inverse;
  PetscInt          taken = 0;

  PetscFunctionBegin;
  made->correction = NULL;
  PetscCall(AinsworthCountRows(in->C, 0, &counts));
  PetscCall(VecDuplicate(counts, &zeros));
  PetscCall(MarkZeroRows(in, zeros));
  PetscCall(FindCarried(in, counts, zeros, &roles));
  PetscCall(AinsworthPmatReleaseLoose(in, roles.weight, in->C, &all));
  PetscCall(ChooseRows(in, all, &roles));
  PetscCall(VecDestroy(&counts));
  PetscCall(VecDestroy(&zeros));
  made->carried = roles.carried;
  for (char s : roles.shortRows) taken += s;
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &taken, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)in->C)));
  PetscCall(AinsworthGetRows(all, roles.kept, &made->rows));
  if (taken && opt->type != PC_AINSWORTH_PMAT_ID) {
    PetscCall(AinsworthCopyMarkedRows(all, &roles.shortRows, &C));
    PetscCall(AinsworthScaleColumns(C, roles.weight, &S));
    PetscCall(AinsworthCopyMarkedRows(S, NULL, &CW));
    PetscCall(MatDestroy(&S));
    PetscCall(MatHermitianTranspose(CW, MAT_INITIAL_MATRIX, &CWt));
    PetscCall(MatMatMult(C, CWt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &S));
    PetscCall(MatProductClear(S));
    PetscCall(AinsworthInvGramCreate(S, opt, &inverse));
    PetscCall(MatDestroy(&S));
    PetscCall(MatMatMult(inverse, C, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &XC));
    PetscCall(MatProductClear(XC));
    PetscCall(MatMatMult(CWt, XC, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &made->correction));
    PetscCall(MatProductClear(made->correction));
    PetscCall(MatDestroy(&XC));
    for (Vec row : made->rows) { /* Q_*' c */
      Vec product, solution;

      PetscCall(MatCreateVecs(C, NULL, &product));
      PetscCall(VecDuplicate(product, &solution));
      PetscCall(MatMult(CW, row, product));
      PetscCall(MatMult(inverse, product, solution));
      PetscCall(VecScale(solution, -1.0));
      PetscCall(MatMultHermitianTransposeAdd(C, solution, row, row));
      PetscCall(VecDestroy(&product));
      PetscCall(VecDestroy(&solution));
    }
    for (Mat *M : {&C, &CW, &CWt, &inverse}) PetscCall(MatDestroy(M));
  }
  PetscCall(MatDestroy(&all));
  PetscCall(VecDestroy(&roles.weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}
