/* What goes wrong for one step, and is mended before the next */
#include "attack.h"

/* NaN or Inf in the right-hand side, often on a row that nothing else looks at, or in a matrix */
PetscErrorCode AttackPoison(Attack &a)
{
  const int        n = (int)a.s.A.rows(), m = (int)a.s.C.rows();
  std::vector<int> quiet;

  PetscFunctionBeginUser;
  a.badValue = a.r.Chance(0.5) ? NAN : a.r.Chance(0.5) ? INFINITY : -INFINITY; /* PETSC_INFINITY is finite */
  a.must     = true;
  if (a.r.Chance(0.3)) {
    a.badRow = a.r.Int(0, n + m - 1);
    a.goodA  = a.s.A;
    a.goodC  = a.s.C;
    a.story += "; " + std::to_string(a.badValue) + " in row " + std::to_string(a.badRow < n ? a.badRow : a.badRow - n) +
               (a.badRow < n ? " of A" : " of C");
    const bool adjoint = AttackAdjoint(a.s);

    (a.badRow < n ? a.s.A(a.badRow, a.badRow) : a.s.C(a.badRow - n, a.r.Int(0, n - 1))) = a.badValue;
    const Dense keep                                                                    = a.s.Ct;

    if (adjoint) a.s.Ct = a.s.C.adjoint();
    PetscCall(AttackWrite(a, a.badRow < n, a.badRow >= n));
    a.s.Ct = keep;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (int i = 0; i < m; i++) {
    bool quietRow = a.s.C.row(i).norm() == 0.0;

    for (int k = 0; k < i; k++)
      quietRow = quietRow ||
                 PetscAbsScalar(a.s.C.row(i).dot(a.s.C.row(k))) >= 0.9999 * a.s.C.row(i).norm() * a.s.C.row(k).norm();
    if (quietRow) quiet.push_back(n + i);
  }
  a.badEntry = quiet.size() && a.r.Chance(0.6) ? quiet[(size_t)a.r.Int(0, (int)quiet.size() - 1)]
                                               : a.r.Int(0, n + m - 1);
  a.story += "; " + std::to_string(a.badValue) + " in entry " +
             std::to_string(a.badEntry < n ? a.badEntry : a.badEntry - n) + (a.badEntry < n ? " of f" : " of g");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An operator that PCAINSWORTH refuses, and then the old one again, with nothing changed */
PetscErrorCode AttackWrongMatrix(Attack &a)
{
  PetscInt n;
  Mat      M, blocks[9] = {NULL};
  Vec      one;

  PetscFunctionBeginUser;
  /* with named fields it is one that can be solved */
  if (a.named || a.shape != SHAPE_NEST) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(a.nest, &n, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, n, n, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &M));
  PetscCall(MatCreateVecs(M, &one, NULL));
  PetscCall(VecSet(one, 1.0));
  PetscCall(MatDiagonalSet(M, one, INSERT_VALUES));
  PetscCall(VecDestroy(&one));
  a.story += "; an operator that is no nest";
  if (a.r.Chance(0.3)) {
    blocks[0] = M;
    PetscCall(MatCreateNest(PETSC_COMM_WORLD, 1, NULL, 1, NULL, blocks, &blocks[1]));
    PetscCall(MatDestroy(&M));
    M = blocks[1];
    a.story += " of 2 x 2 blocks";
  }
  PetscCall(KSPSetOperators(a.ksp, M, M));
  PetscCall(MatDestroy(&M));
  a.other = a.must = true;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackWrongOption(Attack &a)
{
  const char *const lines[] = {
    "-pc_ainsworth_pmat nonsense", "-pc_ainsworth_penalty_factor -1",      "-ainsworth_ksp_type nonsense",
    "-ainsworth_pc_type nonsense", "-pc_ainsworth_monitor_error nonsense", "-pc_ainsworth_blocks 0",
    "-pc_ainsworth_error_rtol 2"};
  const char *const line = lines[a.r.Int(0, 6)];
  std::string       message;
  PetscErrorCode    code;

  PetscFunctionBeginUser;
  a.options.reset();
  a.options.reset(new Options(line));
  a.bogus = true;
  PetscCall(AttackCall([&a]() { return KSPSetFromOptions(a.ksp); }, &code, message));
  a.story += std::string("; ") + line + (code ? " (refused)" : " (not read yet)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C' is not that of C: for one step, or for good, the system is another */
PetscErrorCode AttackBrokenAdjoint(Attack &a, bool stays)
{
  PetscFunctionBeginUser;
  if ((a.s.form != 0 && !a.whole) || !a.s.C.rows() || a.s.C.norm() == 0.0) PetscFunctionReturn(PETSC_SUCCESS);
  a.s.Ct(a.r.Int(0, (int)a.s.Ct.rows() - 1), a.r.Int(0, (int)a.s.Ct.cols() - 1)) += a.s.C.cwiseAbs().maxCoeff();
  PetscCall(AttackWrite(a, false, true));
  a.broken = !stays;
  a.story += stays ? "; another B" : "; C' is not that of C";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The monitor of the inner KSP raises an error, with the error monitor on or without */
PetscErrorCode AttackErrorInside(Attack &a)
{
  PetscFunctionBeginUser;
  a.explode = true;
  a.story += "; an error in the monitor of the inner KSP";
  if (a.r.Chance(0.5)) {
    std::string    message;
    PetscErrorCode code;

    a.options.reset();
    a.options.reset(new Options("-pc_ainsworth_monitor_error ascii:error.txt"));
    PetscCall(AttackCall([&a]() { return KSPSetFromOptions(a.ksp); }, &code, message));
    a.story += ", under the error monitor";
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* -ksp_error_if_not_converged, where there is something to be said about */
PetscErrorCode AttackErrorIfNotConverged(Attack &a)
{
  PetscFunctionBeginUser;
  PetscCall(KSPSetErrorIfNotConverged(a.ksp, PETSC_TRUE));
  a.strict = true;
  a.story += "; error if not converged";
  if (a.r.Chance(0.7)) PetscCall(AttackPoison(a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AttackUndo(Attack &a)
{
  PetscFunctionBeginUser;
  if (a.other) PetscCall(AttackOperators(a));
  if (a.nullspace) PetscCall(MatSetNullSpace(a.whole ? a.whole : a.nest, NULL));
  if (a.strict) PetscCall(KSPSetErrorIfNotConverged(a.ksp, PETSC_FALSE));
  if (a.bogus) a.options.reset();
  if (a.badRow >= 0) {
    a.s.A = a.goodA;
    a.s.C = a.goodC;
    PetscCall(AttackWrite(a, true, true));
    a.badRow = -1;
  }
  if (a.broken) {
    a.s.Ct   = a.s.C.adjoint();
    a.otherB = false;
    PetscCall(AttackWrite(a, false, true));
  }
  for (bool *flag :
       {&a.transpose, &a.explode, &a.nested, &a.nullspace, &a.broken, &a.strict, &a.other, &a.bogus, &a.must})
    *flag = false;
  a.badEntry = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}
