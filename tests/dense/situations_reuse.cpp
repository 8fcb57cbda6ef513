/* What is rebuilt when A, C, the right-hand side or nothing changes; life cycle; loose tolerances; several columns */
#include "situations.h"

static const std::string jacobi = "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-12 ",
                         jcb    = jacobi + "-pc_ainsworth_pmat jcb ";

/* Solves; how often the Gram matrix and the preconditioning matrix were built for it */
static Action Built(PetscInt grams, PetscInt pmats)
{
  return [=](Live &s) -> PetscErrorCode {
    const Parts gram = {"AinsGramMat"}, pmat = {"AinsPMat", "AinsInvGram"};

    PetscFunctionBeginUser;
    PetscCall(Counted(gram)(s));
    PetscCall(Counted(pmat)(s));
    PetscCall(Right(1e-10)(s));
    PetscCall(Counted(gram, grams)(s));
    PetscCall(Counted(pmat, pmats)(s));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

static PetscErrorCode Assembled(Live &s)
{
  PetscFunctionBeginUser;
  PetscCall(s.Write());
  PetscCall(MatAssemblyBegin(s.nest, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(s.nest, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Operators(Live &s)
{
  return KSPSetOperators(s.ksp, s.nest, s.nest);
}
static PetscErrorCode PCIsReset(Live &s)
{
  return PCReset(s.pc);
}

/* Symbolic products and factorizations of the solve, of all ranks together, beside those of the first one */
static Action Symbolic(const std::function<PetscErrorCode(const PetscInt count[2], const PetscInt first[2])> &judge)
{
  return [=](Live &s) -> PetscErrorCode {
    static PetscInt   first[2];
    const char *const events[] = {"MatMatMultSym", "MatTrnMatMultSym", "MatLUFactorSym", "MatCholFctrSym"};
    PetscInt          before[4], after[4], count[2];

    PetscFunctionBeginUser;
    for (int k = 0; k < 4; k++) PetscCall(EventCount(events[k], &before[k]));
    PetscCall(Built(1, 1)(s));
    for (int k = 0; k < 4; k++) PetscCall(EventCount(events[k], &after[k]));
    for (int k = 0; k < 2; k++) count[k] = after[2 * k] + after[2 * k + 1] - before[2 * k] - before[2 * k + 1];
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
    if (!judge) {
      for (int k = 0; k < 2; k++) first[k] = count[k];
      PetscCall(CheckTrue("a product and a factorization at least", first[0] > 0 && first[1] > 0));
    } else PetscCall(judge(count, first));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
}

/* Another type and back */
static PetscErrorCode OtherType(Live &s)
{
  KSP    inner;
  PCType type;

  PetscFunctionBeginUser;
  PetscCall(PCSetType(s.pc, PCNONE));
  PetscCall(KSPSetUp(s.ksp));
  PetscCall(CheckError("getter on a PC of another type", [&]() { return PCAinsworthGetKSP(s.pc, &inner); },
                       PETSC_ERR_ARG_WRONG, {"none", PCAINSWORTH}));
  PetscCall(PCAinsworthSetReference(s.pc, s.sys.f)); /* setters do nothing, as everywhere in PETSc */
  PetscCall(PCSetType(s.pc, PCAINSWORTH));
  PetscCall(PCSetFromOptions(s.pc));
  PetscCall(PCGetType(s.pc, &type));
  PetscCall(CheckTrue("type", type == std::string(PCAINSWORTH)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Rebuilt()
{
  const auto kept = [](const PetscInt count[2], const PetscInt *) -> PetscErrorCode {
    PetscFunctionBeginUser;
    PetscCall(CheckInt("symbolic factorizations", count[1], 0));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  const auto as = [](const PetscInt count[2], const PetscInt first[2]) -> PetscErrorCode {
    PetscFunctionBeginUser;
    PetscCall(CheckInt("symbolic products", count[0], first[0]));
    PetscCall(CheckTrue("symbolic factorizations", count[1] > 0));
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  const Action once = Built(1, 1), none = Built(0, 0), stiffer = Edit([](Saddle &s) { s.A *= 3.0; }),
               weighted = Edit([](Saddle &s) { s.C = s.C * s.w.asDiagonal(); }),
               half     = Edit([](Saddle &s) { s.C *= 0.5; });

  PetscFunctionBeginUser;
  for (int storage : {(int)EXPLICIT, (int)VIEW}) {
    const std::string choices = jcb + "-pc_ainsworth_penalty_factor 0.7 ";
    Spec              spec;

    spec.uneven = storage == VIEW;
    /* the assembly of the nest raises the state of every block: PETSc itself takes them as changed */
    PetscCall(Row(
      Text("right-hand sides, storage %d", storage), spec, jcb,
      {once, none, Edit([](Saddle &s) { s.f *= 2.0, s.g.reverseInPlace(); }), none, Operators, none, Assembled, once},
      storage));
    PetscCall(Row(Text("values, storage %d", storage), spec, jcb,
                  {once, stiffer, once, Edit([](Saddle &s) { s.A = s.w.asDiagonal() * s.A * s.w.asDiagonal(); }),
                   Assembled, once, weighted, once, half, Assembled, once, [](Live &s) { return s.Renew(""); }, none},
                  storage));
    PetscCall(Row(Text("choices, storage %d", storage), spec, jcb,
                  {once, [](Live &s) { return KSPSetReusePreconditioner(s.ksp, PETSC_TRUE); }, none,
                   [](Live &s) { return KSPSetReusePreconditioner(s.ksp, PETSC_FALSE); }, Reread(choices), once,
                   [](Live &s) { return PCAinsworthSetWeight(s.pc, s.sys.w); }, once,
                   Reread(choices + "-pc_ainsworth_variant paper"), once, none},
                  storage));
  }
  /* what depends on the pattern of C alone is done again only where that changed; in the second row pieces are split */
  for (const std::string options :
       {"-ainsworth_gram_pc_type lu", "-pc_ainsworth_rows_per_rank 1 -ainsworth_gram_pc_type redundant"}) {
    Spec spec;

    spec.m      = options[1] == 'a' ? 5 : 20;
    spec.n      = PetscMax(24, 2 * spec.m + 8);
    spec.uneven = true;
    PetscCall(Row("patterns, " + options, spec, jcb + options,
                  {Symbolic(nullptr), stiffer, Symbolic(kept), weighted, Symbolic(kept),
                   Edit([](Saddle &s) { s.C(0, s.C.cols() - 1) = 0.5; }), Symbolic(as)},
                  VIEW));
  }
  Spec uneven;
  uneven.uneven = true;
  /* C is zero, and later is not: A alone is solved meanwhile, by plain conjugate gradients */
  PetscCall(Row("C comes and goes", uneven, jcb,
                {once, Edit([](Saddle &s) { s.C.setZero(), s.g.setZero(); }), Right(1e-10), InnerType(KSPCG),
                 Original(), once, InnerType(KSPPROJECTEDCG)},
                VIEW));
  PetscCall(Row("life cycle", Spec(), jcb,
                {once, [](Live &s) { return KSPReset(s.ksp); }, Operators, once, PCIsReset, Operators, once, PCIsReset,
                 PCIsReset, Operators, [](Live &s) { return PCSetUp(s.pc); }, none, OtherType, once},
                EXPLICIT));
  PetscCall(Row("never set up", Spec(), "", {}, EXPLICIT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three right-hand sides at once */
static PetscErrorCode Columns(Live &s)
{
  Mat      X, Y;
  PetscInt n;
  Dense    K, columns, got;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(s.nest, &n, NULL));
  PetscCall(MatCreateDense(PETSC_COMM_WORLD, n, PETSC_DECIDE, PETSC_DETERMINE, 3, NULL, &X));
  for (PetscInt j = 0; j < 3; j++) {
    Vec v;

    PetscCall(MatDenseGetColumnVecWrite(X, j, &v));
    PetscCall(SetRandom(v, 30 + j));
    PetscCall(MatDenseRestoreColumnVecWrite(X, j, &v));
  }
  PetscCall(MatDuplicate(X, MAT_DO_NOT_COPY_VALUES, &Y));
  PetscCall(PCMatApply(s.pc, X, Y));
  PetscCall(Gather(s.nest, K));
  PetscCall(Gather(X, columns));
  PetscCall(Gather(Y, got));
  PetscCall(CheckEqual("three solutions", got, K.fullPivLu().solve(columns), 1e-10));
  PetscCall(MatDestroy(&X));
  PetscCall(MatDestroy(&Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Loose()
{
  PetscFunctionBeginUser;
  for (int k : {0, 4}) /* C x = g to rounding whatever the inner tolerance, and FGMRES makes a solution of it */
    PetscCall(Row(
      std::string(UsualSpecs()[k].name) + ", loose tolerance", UsualSpecs()[k],
      "-ainsworth_pc_type jacobi -ainsworth_ksp_rtol 1e-2",
      {Positive(), [](Live &s) { return Check("C x - g", (s.d.C * s.x - s.d.g).norm() / s.d.g.norm(), 1e-13); },
       [](Live &s) { return KSPSetType(s.ksp, KSPFGMRES); },
       [](Live &s) { return KSPSetTolerances(s.ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT); },
       Exact(1e-9, true, 1e-13), Exact(1e-9, false, 1e-13), /* sums of several vectors, each to rounding */
       Inner([](KSP inner, PC) { return KSPSetTolerances(inner, 1e-13, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT); }),
       Columns},
      VIEW));
  for (bool uneven : {false, true}) { /* rows of C that are zero: lambda = 0 there, and no solution where g is not */
    Spec spec;

    spec.zeroRows = true;
    spec.uneven   = uneven;
    PetscCall(Row(Text("zero rows of C, uneven %d", uneven), spec, jacobi,
                  {Failed({}, PC_INCONSISTENT_RHS), Edit([](Saddle &s) {
                     for (PetscInt i = 0; i < s.g.size(); i++)
                       if (s.C.row(i).norm() == 0.0) s.g[i] = 0.0;
                   }),
                   Right(1e-10),
                   [](Live &s) {
                     return CheckInt("zeros in lambda", (s.lambda.array() == 0.0).count(),
                                     (s.d.C.rowwise().norm().array() == 0.0).count());
                   }},
                  VIEW | NESTED));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
