static char help[] = "What PCAINSWORTH rebuilds when A, C, the right-hand side or nothing changes, and its life cycle.\n\n";

#include "dense.h"

struct Solver {
  System sys;
  Mat    nest = NULL;
  KSP    ksp  = NULL;
  Vec    b = NULL, y = NULL;
  IS     is[2];
};

static PetscErrorCode Create(bool explicitTranspose, Solver *s, PetscInt m = 5)
{
  Spec spec;
  Mat  Ct;

  PetscFunctionBeginUser;
  spec.m      = m;
  spec.n      = PetscMax(24, 2 * m + 8);
  spec.uneven = !explicitTranspose;
  PetscCall(SystemCreate(PETSC_COMM_WORLD, spec, &s->sys));
  if (explicitTranspose) PetscCall(MatHermitianTranspose(s->sys.C, MAT_INITIAL_MATRIX, &Ct));
  else PetscCall(MatCreateHermitianTranspose(s->sys.C, &Ct));
  PetscCall(NestCreate(s->sys.A, Ct, s->sys.C, NULL, false, &s->nest));
  PetscCall(MatDestroy(&Ct));
  PetscCall(SolverCreate(s->nest, &s->ksp));
  PetscCall(MatNestGetISs(s->nest, s->is, NULL));
  PetscCall(MatCreateVecs(s->nest, &s->y, &s->b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Destroy(Solver *s)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&s->ksp));
  PetscCall(MatDestroy(&s->nest));
  PetscCall(VecDestroy(&s->b));
  PetscCall(VecDestroy(&s->y));
  PetscCall(SystemDestroy(&s->sys));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves, compares with the dense solution of the system as it is now, and counts what was built for it */
static PetscErrorCode Solve(Solver *s, const char *what, PetscInt grams, PetscInt pmats)
{
  const char *const events[] = {"AinsGramMat", "AinsGramFact", "AinsPMat", "AinsInvGram"};
  PetscInt          before[4], after;
  DenseSystem       d;
  Column            x, lambda, whole, expectedX, expectedLambda;
  Vec               sub;

  PetscFunctionBeginUser;
  Case("%s", what);
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(s->b, s->is[k], &sub));
    PetscCall(VecCopy(k ? s->sys.g : s->sys.f, sub));
    PetscCall(VecRestoreSubVector(s->b, s->is[k], &sub));
  }
  for (int k = 0; k < 4; k++) PetscCall(EventCount(events[k], &before[k]));
  PetscCall(KSPSolve(s->ksp, s->b, s->y));
  for (int k = 0; k < 4; k++) {
    PetscCall(EventCount(events[k], &after));
    PetscCall(CheckInt(events[k], after - before[k], k < 2 ? grams : pmats));
  }
  PetscCall(Gather(s->sys, d));
  SolveSaddle(d, expectedX, expectedLambda);
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(s->y, s->is[k], &sub));
    PetscCall(Gather(sub, k ? lambda : x));
    PetscCall(VecRestoreSubVector(s->y, s->is[k], &sub));
  }
  PetscCall(CheckEqual("x", x, expectedX, 1e-10));
  PetscCall(CheckEqual("lambda", lambda, expectedLambda, 1e-10));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode AssembleNest(Mat nest)
{
  PetscFunctionBeginUser;
  PetscCall(MatAssemblyBegin(nest, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(nest, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One more option, which is not left to other solvers */
static PetscErrorCode Choose(PC pc, const char option[])
{
  Options options(option);

  PetscFunctionBeginUser;
  PetscCall(PCSetFromOptions(pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Changes(bool explicitTranspose)
{
  Solver s;
  PC     pc;
  Mat    block, nest;

  PetscFunctionBeginUser;
  PetscCall(Create(explicitTranspose, &s));
  PetscCall(KSPGetPC(s.ksp, &pc));
  PetscCall(Solve(&s, "first solve", 1, 1));
  PetscCall(Solve(&s, "the same again", 0, 0));
  PetscCall(SetRandom(s.sys.f, 60));
  PetscCall(SetRandom(s.sys.g, 61));
  PetscCall(Solve(&s, "another right-hand side", 0, 0));
  PetscCall(KSPSetOperators(s.ksp, s.nest, s.nest));
  PetscCall(Solve(&s, "operators set again, the same", 0, 0));
  PetscCall(AssembleNest(s.nest));
  PetscCall(Solve(&s, "nest assembled again", 1, 1)); /* which raises the state of every block: PETSc itself takes them as changed */

  PetscCall(MatScale(s.sys.A, 3.0));
  PetscCall(Solve(&s, "A changed in place, nest not told", 1, 1));
  PetscCall(MatDiagonalScale(s.sys.A, s.sys.w, s.sys.w));
  PetscCall(AssembleNest(s.nest));
  PetscCall(Solve(&s, "A changed in place, nest assembled", 1, 1));
  PetscCall(MatDiagonalScale(s.sys.C, NULL, s.sys.w));
  if (explicitTranspose) {
    PetscCall(MatNestGetSubMat(s.nest, 0, 1, &block));
    PetscCall(MatDiagonalScale(block, s.sys.w, NULL));
  }
  PetscCall(Solve(&s, "C changed in place, nest not told", 1, 1));
  PetscCall(MatScale(s.sys.C, 0.5));
  if (explicitTranspose) PetscCall(MatScale(block, 0.5));
  PetscCall(AssembleNest(s.nest));
  PetscCall(Solve(&s, "C changed in place, nest assembled", 1, 1));

  /* the same system in another MatNest: A and C are what they were */
  if (explicitTranspose) PetscCall(PetscObjectReference((PetscObject)block));
  else PetscCall(MatCreateHermitianTranspose(s.sys.C, &block));
  PetscCall(NestCreate(s.sys.A, block, s.sys.C, NULL, false, &nest));
  PetscCall(MatDestroy(&block));
  PetscCall(KSPSetOperators(s.ksp, nest, nest));
  PetscCall(MatDestroy(&s.nest));
  s.nest = nest;
  PetscCall(MatNestGetISs(s.nest, s.is, NULL));
  PetscCall(Solve(&s, "another nest of the same blocks", 0, 0));

  PetscCall(KSPSetReusePreconditioner(s.ksp, PETSC_TRUE));
  PetscCall(Solve(&s, "reuse asked for, nothing changed", 0, 0));
  PetscCall(KSPSetReusePreconditioner(s.ksp, PETSC_FALSE));

  /* choices */
  PetscCall(Choose(pc, "-pc_ainsworth_penalty_factor 0.7"));
  PetscCall(Solve(&s, "another penalty", 1, 1));
  PetscCall(PCAinsworthSetWeight(pc, s.sys.w));
  PetscCall(Solve(&s, "a weight of the user", 1, 1));
  PetscCall(Choose(pc, "-pc_ainsworth_variant paper"));
  PetscCall(Solve(&s, "another variant", 1, 1));
  PetscCall(Solve(&s, "and again", 0, 0));
  PetscCall(Destroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Symbolic phases so far, of all ranks together */
static PetscErrorCode CountSymbolic(PetscInt count[2])
{
  const char *const products[] = {"MatMatMultSym", "MatTrnMatMultSym"}, *const factors[] = {"MatLUFactorSym", "MatCholFctrSym"};

  PetscFunctionBeginUser;
  count[0] = count[1] = 0;
  for (int k = 0; k < 2; k++) {
    PetscInt number;

    PetscCall(EventCount(products[k], &number));
    count[0] += number;
    PetscCall(EventCount(factors[k], &number));
    count[1] += number;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves, and tells how many symbolic products and factorisations that took */
static PetscErrorCode SolveCounting(Solver *s, const char *what, PetscInt count[2])
{
  PetscInt before[2];

  PetscFunctionBeginUser;
  PetscCall(CountSymbolic(before));
  PetscCall(Solve(s, what, 1, 1));
  PetscCall(CountSymbolic(count));
  for (int k = 0; k < 2; k++) count[k] -= before[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What depends on the nonzero pattern of C alone is done again only where that changed */
static PetscErrorCode Patterns(const char *choices, PetscInt m)
{
  Options  options(choices);
  Solver   s;
  PetscInt first[2], count[2], columns;

  PetscFunctionBeginUser;
  PetscCall(Create(false, &s, m));
  PetscCall(SolveCounting(&s, choices, first));
  PetscCall(CheckTrue("a product and a factorisation at least", first[0] > 0 && first[1] > 0));

  PetscCall(MatScale(s.sys.A, 3.0));
  PetscCall(SolveCounting(&s, "other values of A", count));
  PetscCall(CheckTrue("fewer symbolic products", count[0] < first[0]));
  PetscCall(CheckInt("symbolic factorisations", count[1], 0));
  PetscCall(MatDiagonalScale(s.sys.C, NULL, s.sys.w));
  PetscCall(SolveCounting(&s, "other values of C", count));
  PetscCall(CheckTrue("fewer symbolic products", count[0] < first[0]));
  PetscCall(CheckInt("symbolic factorisations", count[1], 0));

  PetscCall(MatGetSize(s.sys.C, NULL, &columns));
  PetscCall(MatSetOption(s.sys.C, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatSetValue(s.sys.C, 0, columns - 1, 0.5, ADD_VALUES)); /* every rank adds its half to the last column, which row 0 does not touch */
  PetscCall(MatAssemblyBegin(s.sys.C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(s.sys.C, MAT_FINAL_ASSEMBLY));
  PetscCall(SolveCounting(&s, "another pattern of C", count));
  PetscCall(CheckInt("symbolic products", count[0], first[0]));
  PetscCall(CheckTrue("symbolic factorisations", count[1] > 0));
  PetscCall(Destroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C is zero, and later is not: A alone is solved meanwhile, by plain conjugate gradients */
static PetscErrorCode ComeAndGo()
{
  Solver      s;
  PC          pc;
  KSP         inner;
  KSPType     type;
  Mat         kept;
  DenseSystem d;
  Column      x;
  Vec         sub;

  PetscFunctionBeginUser;
  PetscCall(Create(false, &s));
  PetscCall(KSPGetPC(s.ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(Solve(&s, "with constraints", 1, 1));
  PetscCall(MatDuplicate(s.sys.C, MAT_COPY_VALUES, &kept));
  PetscCall(MatScale(s.sys.C, 0.0));
  Case("C is zero");
  PetscCall(VecZeroEntries(s.b));
  PetscCall(VecGetSubVector(s.b, s.is[0], &sub));
  PetscCall(VecCopy(s.sys.f, sub));
  PetscCall(VecRestoreSubVector(s.b, s.is[0], &sub));
  PetscCall(KSPSolve(s.ksp, s.b, s.y));
  PetscCall(VecGetSubVector(s.y, s.is[0], &sub));
  PetscCall(Gather(sub, x));
  PetscCall(VecRestoreSubVector(s.y, s.is[0], &sub));
  PetscCall(Gather(s.sys, d));
  PetscCall(CheckEqual("x", x, d.A.fullPivLu().solve(d.f), 1e-10));
  PetscCall(KSPGetType(inner, &type));
  PetscCall(CheckTrue(type, type == std::string(KSPCG)));
  PetscCall(MatCopy(kept, s.sys.C, SAME_NONZERO_PATTERN));
  PetscCall(MatDestroy(&kept));
  PetscCall(Solve(&s, "with constraints again", 1, 1));
  PetscCall(KSPGetType(inner, &type));
  PetscCall(CheckTrue(type, type == std::string(KSPPROJECTEDCG)));
  PetscCall(Destroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode LifeCycle()
{
  Solver s;
  PC     pc;
  KSP    inner;
  PCType type;
  bool   same;

  PetscFunctionBeginUser;
  PetscCall(Create(true, &s));
  PetscCall(Solve(&s, "before KSPReset()", 1, 1));
  PetscCall(KSPReset(s.ksp));
  PetscCall(KSPSetOperators(s.ksp, s.nest, s.nest));
  PetscCall(Solve(&s, "after KSPReset()", 1, 1));
  PetscCall(KSPGetPC(s.ksp, &pc));
  PetscCall(PCReset(pc));
  PetscCall(KSPSetOperators(s.ksp, s.nest, s.nest));
  PetscCall(Solve(&s, "after PCReset()", 1, 1));
  PetscCall(PCReset(pc));
  PetscCall(PCReset(pc));
  PetscCall(KSPSetOperators(s.ksp, s.nest, s.nest));
  PetscCall(PCSetUp(pc));
  PetscCall(Solve(&s, "after PCReset() twice and PCSetUp()", 0, 0));

  Case("another type and back");
  PetscCall(PCSetType(pc, PCNONE));
  PetscCall(KSPSetUp(s.ksp));
  PetscCall(CheckError("getter on a PC of another type", [&]() { return PCAinsworthGetKSP(pc, &inner); }, PETSC_ERR_ARG_WRONG, {"none", PCAINSWORTH}));
  PetscCall(PCAinsworthSetReference(pc, s.b)); /* setters do nothing, as everywhere in PETSc */
  PetscCall(PCSetType(pc, PCAINSWORTH));
  PetscCall(PCSetFromOptions(pc));
  PetscCall(PCGetType(pc, &type));
  same = std::string(type) == PCAINSWORTH;
  PetscCall(CheckTrue("type", same));
  PetscCall(Solve(&s, "after another type", 1, 1));
  PetscCall(Destroy(&s));

  Case("never set up");
  PetscCall(Create(true, &s));
  PetscCall(Destroy(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(AinsworthInitializePackage());
  {
    Options options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_pmat jcb");
    for (bool explicitTranspose : {false, true}) PetscCall(Changes(explicitTranspose));
    PetscCall(ComeAndGo());
    PetscCall(LifeCycle());
  }
  {
    Options options("-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 -pc_ainsworth_pmat jcb");
    PetscCall(Patterns("-ainsworth_gram_pc_type lu", 5));
    PetscCall(Patterns("-pc_ainsworth_rows_per_rank 1 -ainsworth_gram_pc_type redundant", 20)); /* pieces are split */
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
