#include "pmat.h"
#include "sum.h"
#include "surface.h"
#include "../events.h"
#include "../projector/projector.h"

const char *const AinsworthPenaltyTypes[] = {"row", "norm", "AinsworthPenaltyType", "AINSWORTH_PENALTY_", NULL};
const char *const PCAinsworthPmatTypes[]  = {"jcb", "id", "cc", "cg", "bj_cc", "bj_cg", "auto", "PCAinsworthPmatType", "PC_AINSWORTH_PMAT_", NULL};

namespace
{
/* A and C on the surface, and the terms that M_* adds to A there */
struct Surface {
  IS  dofs; /* constrained degrees of freedom and, if A is wanted, their neighbours in A, p of them */
  Mat A, C; /* p x p, m x p */
  Mat Ct;
  Vec w; /* diagonal of W, NULL for W = I */

  PetscErrorCode create(const AinsworthPmatInputs *in, PetscBool withA, PetscBool symmetric);
  PetscErrorCode destroy();
};

PetscErrorCode Surface::create(const AinsworthPmatInputs *in, PetscBool withA, PetscBool symmetric)
{
  PetscInt rstart, rend;
  IS       rows;

  PetscFunctionBegin;
  PetscCall(AinsworthSurfaceCreate(withA ? in->A : NULL, in->C, symmetric, &dofs));
  PetscCall(MatGetOwnershipRange(in->C, &rstart, &rend));
  PetscCall(ISCreateStride(PetscObjectComm((PetscObject)in->C), rend - rstart, rstart, 1, &rows));
  PetscCall(MatCreateSubMatrix(in->C, rows, dofs, MAT_INITIAL_MATRIX, &C));
  PetscCall(ISDestroy(&rows));
  PetscCall(MatHermitianTranspose(C, MAT_INITIAL_MATRIX, &Ct));
  A = NULL;
  w = NULL;
  if (withA) PetscCall(MatCreateSubMatrix(in->A, dofs, dofs, MAT_INITIAL_MATRIX, &A));
  if (withA && in->weight) {
    Vec part;

    PetscCall(VecGetSubVector(in->weight, dofs, &part));
    PetscCall(VecDuplicate(part, &w));
    PetscCall(VecCopy(part, w));
    PetscCall(VecRestoreSubVector(in->weight, dofs, &part));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Surface::destroy()
{
  PetscFunctionBegin;
  PetscCall(ISDestroy(&dofs));
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&C));
  PetscCall(MatDestroy(&Ct));
  PetscCall(VecDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The terms of Q_*' A Q_* - A = -C' Y A - A Y' C + C' (Y A Y') C, with Q_* = I - Y' C and Y = Inv(S) C W (docs/method.md, surface-only assembly)

   Where A is symmetric the second is the adjoint of the first.
*/
PetscErrorCode AddProjectionTerms(const Surface &surface, Mat inverse, PetscBool symmetric, std::vector<AinsworthTerm> &terms)
{
  Mat CW = surface.C, Y, Yt, K, T, TC, G, G2, P;

  PetscFunctionBegin;
  if (surface.w) {
    PetscCall(MatDuplicate(surface.C, MAT_COPY_VALUES, &CW));
    PetscCall(MatDiagonalScale(CW, NULL, surface.w));
  }
  PetscCall(MatMatMult(inverse, CW, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &Y));
  if (surface.w) PetscCall(MatDestroy(&CW));
  PetscCall(MatHermitianTranspose(Y, MAT_INITIAL_MATRIX, &Yt));
  PetscCall(MatMatMult(Y, surface.A, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &K));
  PetscCall(MatDestroy(&Y));
  PetscCall(MatMatMult(surface.Ct, K, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &G));
  if (symmetric) PetscCall(MatHermitianTranspose(G, MAT_INITIAL_MATRIX, &G2));
  else {
    Mat AYt;
    PetscCall(MatMatMult(surface.A, Yt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &AYt));
    PetscCall(MatMatMult(AYt, surface.C, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &G2));
    PetscCall(MatDestroy(&AYt));
  }
  PetscCall(MatMatMult(K, Yt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &T));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&Yt));
  PetscCall(MatMatMult(T, surface.C, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &TC));
  PetscCall(MatDestroy(&T));
  PetscCall(MatMatMult(surface.Ct, TC, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &P));
  PetscCall(MatDestroy(&TC));
  terms.push_back({G, -1.0});
  terms.push_back({G2, -1.0});
  terms.push_back({P, 1.0});
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The term C' B C and the penalty B itself, length m: one per row, gamma / (C diag(A)^{-1} C')_ii, or beta I (paper, section 3.3) */
PetscErrorCode AddPenaltyTerm(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, const Surface &surface, Vec *penalty,
                              std::vector<AinsworthTerm> &terms)
{
  PetscReal    factor = 1.0, normA, normC;
  Mat          BC     = surface.C, CtBC;
  AinsworthSum sum;

  PetscFunctionBegin;
  if (opt->penalty == AINSWORTH_PENALTY_ROW) {
    PetscCall(AinsworthRowPenaltyCreate(in->C, in->inverseDiagonal, opt->factor, penalty));
    PetscCall(MatDuplicate(surface.C, MAT_COPY_VALUES, &BC));
    PetscCall(MatDiagonalScale(BC, *penalty, NULL));
  }
  PetscCall(MatMatMult(surface.Ct, BC, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &CtBC));
  if (opt->penalty == AINSWORTH_PENALTY_ROW) PetscCall(MatDestroy(&BC));
  else { /* beta = gamma ||Q_*' A Q_*|| / ||C' C|| */ PetscCall(MatNorm(CtBC, NORM_INFINITY, &normC));
    PetscCall(sum.open(in->A, surface.dofs, terms));
    PetscCall(sum.norm(&normA));
    PetscCall(sum.close());
    if (normA == 0.0) PetscCall(MatNorm(in->A, NORM_INFINITY, &normA)); /* Ker C = 0: any penalty will do */
    factor = opt->factor * normA / normC;
    PetscCall(MatCreateVecs(in->C, NULL, penalty));
    PetscCall(VecSet(*penalty, factor));
  }
  terms.push_back({CtBC, factor});
  PetscFunctionReturn(PETSC_SUCCESS);
}
} // namespace

/* A matrix of zeros with the layout of A */
static PetscErrorCode CreateZero(Mat A, Mat *zero)
{
  PetscInt m, n, M, N, bs;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(A, &m, &n));
  PetscCall(MatGetSize(A, &M, &N));
  PetscCall(MatGetBlockSize(A, &bs));
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)A), m, n, M, N, 0, NULL, 0, NULL, zero));
  PetscCall(MatSetBlockSize(*zero, bs));
  PetscCall(MatAssemblyBegin(*zero, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*zero, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A + (M_* - A), so that neither is copied; the surface part comes from terms that are added to nothing */
static PetscErrorCode AssembleSum(const AinsworthPmatInputs *in, IS dofs, const std::vector<AinsworthTerm> &terms, Mat *pmat)
{
  AinsworthSum sum;
  Mat          zero, part[2] = {in->given, NULL};
  PetscInt     bs;

  PetscFunctionBegin;
  PetscCall(CreateZero(in->A, &zero));
  PetscCall(sum.open(zero, dofs, terms));
  PetscCall(AinsworthAssembleAIJ(&sum, &part[1]));
  PetscCall(sum.close());
  PetscCall(MatDestroy(&zero));
  PetscCall(MatCreateComposite(PetscObjectComm((PetscObject)in->A), 2, part, pmat));
  PetscCall(MatDestroy(&part[1]));
  PetscCall(MatGetBlockSize(in->A, &bs));
  PetscCall(MatSetBlockSize(*pmat, bs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthPmatCreate - the preconditioning matrix M_* = C' B C + Q_*' A Q_*, n x n, and the penalty B it was made with, length m */
PetscErrorCode AinsworthPmatCreate(const AinsworthPmatInputs *in, const AinsworthPmatOptions *opt, Vec *penalty, Mat *pmat)
{
  Mat                        inverse;
  Surface                    surface;
  std::vector<AinsworthTerm> terms;
  AinsworthSum               sum;

  PetscFunctionBegin;
  PetscCall(AinsworthInvGramCreate(in->S, opt, &inverse));
  PetscCall(PetscLogEventBegin(AINSWORTH_PMat, in->A, in->C, in->S, 0));
  PetscCall(surface.create(in, (PetscBool)(inverse != NULL), opt->symmetric));
  if (inverse) PetscCall(AddProjectionTerms(surface, inverse, opt->symmetric, terms));
  PetscCall(MatDestroy(&inverse));
  PetscCall(AddPenaltyTerm(in, opt, surface, penalty, terms));
  PetscCall(PetscLogEventEnd(AINSWORTH_PMat, in->A, in->C, in->S, 0));
  PetscCall(PetscLogEventBegin(AINSWORTH_PMatCopy, in->A, 0, 0, 0));
  if (in->format == AINSWORTH_PMAT_SUM) PetscCall(AssembleSum(in, surface.dofs, terms, pmat));
  else PetscCall(sum.open(in->A, surface.dofs, terms));
  for (AinsworthTerm &term : terms) PetscCall(MatDestroy(&term.E));
  PetscCall(surface.destroy());
  if (in->format == AINSWORTH_PMAT_HYPRE) PetscCall(AinsworthAssembleHypre(&sum, pmat));
  if (in->format == AINSWORTH_PMAT_AIJ) PetscCall(AinsworthAssembleAIJ(&sum, pmat));
  PetscCall(sum.close());
  PetscCall(PetscLogEventEnd(AINSWORTH_PMatCopy, in->A, 0, 0, 0));
  if (opt->symmetric) PetscCall(MatSetOption(*pmat, PetscDefined(USE_COMPLEX) ? MAT_HERMITIAN : MAT_SYMMETRIC, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
