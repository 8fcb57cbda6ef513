static char help[] = "Sequences of systems of which one part changes at a time: whatever is kept, each solution is "
                     "that of a dense factorization.\n\n";

#include "lattice.h"
#include <cmath>

/* What the program passes */
enum Layout {
  NEST,   /* of the same blocks, with a view of C' */
  COPIES, /* of copies, made for each step */
  FIELDS, /* of three fields, made for each step */
  WHOLE   /* one AIJ, made for each step */
};
static const char *const layouts[] = {"nest", "copies", "fields", "whole"};

struct Sequence {
  Lattice lattice;
  Layout  layout;
  Mat     A = NULL, C = NULL, D = NULL, K = NULL;
  KSP     ksp  = NULL;
  bool    same = false; /* K need not be made anew */
};

static PetscErrorCode Assemble(Mat mat)
{
  PetscFunctionBeginUser;
  PetscCall(MatAssemblyBegin(mat, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(mat, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* m rows that tie unknowns below to unknowns above the middle, beginning with some of them */
static PetscErrorCode Tie(Sequence *s, PetscInt m, PetscInt first)
{
  const Lattice &l = s->lattice;
  PetscInt       n, start, end;
  const PetscInt layer = l.nodes() / l.layers * l.bs, middle = l.layers / 2 * layer;

  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&s->C));
  PetscCall(MatGetLocalSize(s->A, &n, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, n, m, l.nodes() * l.bs, 3, NULL, 3, NULL, &s->C));
  PetscCall(MatGetOwnershipRange(s->C, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscCall(MatSetValue(s->C, i, middle - layer + first + i, 1.0, INSERT_VALUES));
    PetscCall(MatSetValue(s->C, i, middle + first + i, -1.0, INSERT_VALUES));
    PetscCall(MatSetValue(s->C, i, middle + first + i + 1, 0.3, INSERT_VALUES));
  }
  PetscCall(Assemble(s->C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D: -size times a diagonal, not for 0 */
static PetscErrorCode Spring(Sequence *s, PetscReal size)
{
  PetscInt m, start, end;

  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&s->D));
  if (size == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetLocalSize(s->C, &m, NULL));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &s->D));
  PetscCall(MatGetOwnershipRange(s->D, &start, &end));
  for (PetscInt i = start; i < end; i++)
    PetscCall(MatSetValue(s->D, i, i, -size * (1.5 + Uniform(31, i, i)), INSERT_VALUES));
  PetscCall(Assemble(s->D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Columns of M, and its rows where it is A, times numbers between 10^-decades and 10^decades */
static PetscErrorCode Scale(Mat M, bool rows, PetscReal decades, PetscInt seed)
{
  PetscInt start, end;
  Vec      v;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(M, &v, NULL));
  PetscCall(VecGetOwnershipRange(v, &start, &end));
  for (PetscInt i = start; i < end; i++)
    PetscCall(VecSetValue(v, i, std::pow(10.0, decades * Uniform(seed, i, 0)), INSERT_VALUES));
  PetscCall(VecAssemblyBegin(v));
  PetscCall(VecAssemblyEnd(v));
  PetscCall(MatDiagonalScale(M, rows ? v : NULL, v));
  PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A nest of parts of K: half of the unknowns of each rank, the others, and the multipliers */
static PetscErrorCode ThreeFields(Mat K, const IS two[], Mat *nest)
{
  const PetscInt *index;
  PetscInt        n;
  IS              is[3];
  Mat             blocks[9];

  PetscFunctionBeginUser;
  PetscCall(ISGetLocalSize(two[0], &n));
  PetscCall(ISGetIndices(two[0], &index));
  PetscCall(ISCreateGeneral(PETSC_COMM_WORLD, n / 2, index, PETSC_COPY_VALUES, &is[0]));
  PetscCall(ISCreateGeneral(PETSC_COMM_WORLD, n - n / 2, index + n / 2, PETSC_COPY_VALUES, &is[1]));
  PetscCall(ISRestoreIndices(two[0], &index));
  is[2] = two[1];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) PetscCall(MatCreateSubMatrix(K, is[i], is[j], MAT_INITIAL_MATRIX, &blocks[3 * i + j]));
  PetscCall(MatCreateNest(PETSC_COMM_WORLD, 3, NULL, 3, NULL, blocks, nest));
  for (Mat &block : blocks) PetscCall(MatDestroy(&block));
  for (int i = 0; i < 2; i++) PetscCall(ISDestroy(&is[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateMatrix(Sequence *s)
{
  Mat Ct, A = s->A, C = s->C, nest;
  IS  is[2];

  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&s->K));
  if (s->layout == NEST) {
    PetscCall(MatCreateHermitianTranspose(C, &Ct));
    PetscCall(NestCreate(A, Ct, C, s->D, false, &s->K));
    PetscCall(MatDestroy(&Ct));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatDuplicate(s->A, MAT_COPY_VALUES, &A));
  PetscCall(MatDuplicate(s->C, MAT_COPY_VALUES, &C));
  PetscCall(MatHermitianTranspose(C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(NestCreate(A, Ct, C, s->D, false, &s->K));
  for (Mat *M : {&A, &C, &Ct}) PetscCall(MatDestroy(M));
  if (s->layout == COPIES) PetscFunctionReturn(PETSC_SUCCESS);
  nest = s->K;
  PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, &s->K));
  if (s->layout == FIELDS) {
    A = s->K;
    PetscCall(MatNestGetISs(nest, is, NULL));
    PetscCall(ThreeFields(A, is, &s->K));
    PetscCall(MatDestroy(&A));
  }
  PetscCall(MatDestroy(&nest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the system of now, and compares with a dense solution */
static PetscErrorCode Solve(Sequence *s, const char *options, const char *what, PetscInt seed)
{
  Mat                last = NULL;
  Vec                b, y;
  Dense              K;
  Column             expected, got;
  PetscInt           now, before = -1;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  Case("%s, %s: %s", options, layouts[s->layout], what);
  if (s->ksp) PetscCall(KSPGetOperators(s->ksp, &last, NULL));
  if (last) PetscCall(MatGetLocalSize(last, &before, NULL));
  if (!s->same) PetscCall(CreateMatrix(s));
  s->same = false;
  PetscCall(MatGetLocalSize(s->K, &now, NULL));
  int other = before >= 0 && now != before;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &other, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD));
  if (other) PetscCall(KSPReset(s->ksp));
  if (s->ksp) PetscCall(KSPSetOperators(s->ksp, s->K, s->K));
  else PetscCall(SolverCreate(s->K, &s->ksp));
  PetscCall(MatCreateVecs(s->K, &y, &b));
  PetscCall(SetRandom(b, seed));
  PetscCall(KSPSolve(s->ksp, b, y));
  PetscCall(KSPGetConvergedReason(s->ksp, &reason));
  PetscCall(CheckTrue(KSPConvergedReasons[reason], reason > 0));
  PetscCall(Gather(s->K, K));
  PetscCall(Gather(b, expected));
  PetscCall(Gather(y, got));
  expected = Column(K.partialPivLu().solve(expected));
  PetscCall(CheckEqual("solution", got, expected, 1e-7));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The reduced operator */
static PetscErrorCode GetOperator(const Sequence &s, PetscObjectId *id)
{
  PC  pc;
  KSP inner;
  Mat reduced;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(s.ksp, &pc));
  PetscCall(PCAinsworthGetKSP(pc, &inner));
  PetscCall(KSPGetOperators(inner, &reduced, NULL));
  PetscCall(PetscObjectGetId((PetscObject)reduced, id));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Set-ups so far, of the projector, of the preconditioning matrix and of multigrid */
static PetscErrorCode CountSetUps(PetscInt *count)
{
  PetscFunctionBeginUser;
  *count = 0;
  for (const char *event :
       {"AinsGramMat", "AinsGramFact", "AinsPMat", "BlockSALevels", "MatLUFactorNum", "MatCholFctrNum"}) {
    PetscInt n;

    PetscCall(EventCount(event, &n));
    *count += n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckView(const Sequence &s, bool old)
{
  std::string text;

  PetscFunctionBeginUser;
  PetscCall(ViewText(s.ksp, text));
  PetscCall(CheckTrue(old ? "the view says what is kept" : "nothing is said to be kept",
                      old == (text.find("of an earlier") != std::string::npos)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* kept: a multigrid that auto keeps over small changes of A */
static PetscErrorCode Changes(Layout layout, const char *line, bool kept)
{
  Options       options(line);
  Sequence      s;
  PetscInt      before, after;
  PetscObjectId of[2];
  const char   *o = line;

  PetscFunctionBeginUser;
  s.layout        = layout;
  s.lattice.n     = 3;
  s.lattice.apart = true;
  PetscCall(LatticeCreate(s.lattice, &s.A));
  PetscCall(LatticeSetNearNullSpace(s.lattice, s.A));
  PetscCall(Tie(&s, 12, 0));
  PetscCall(Solve(&s, o, "first", 1));
  PetscCall(CountSetUps(&before));
  s.same = true;
  PetscCall(Solve(&s, o, "another right-hand side", 2));
  PetscCall(CountSetUps(&after));
  PetscCall(CheckInt("set-ups", after - before, 0));
  PetscCall(Scale(s.A, true, 0.02, 3));
  PetscCall(Solve(&s, o, "A, a little", 3));
  if (kept) PetscCall(CheckView(s, true));
  PetscCall(Scale(s.C, false, 0.3, 4));
  PetscCall(Solve(&s, o, "values of C", 4));
  PetscCall(Tie(&s, 12, 1));
  PetscCall(Solve(&s, o, "rows move", 5));
  PetscCall(Tie(&s, 20, 0));
  PetscCall(Solve(&s, o, "rows come", 6));
  PetscCall(Spring(&s, 0.5));
  PetscCall(Solve(&s, o, "springs come", 7));
  PetscCall(GetOperator(s, &of[0]));
  PetscCall(MatScale(s.D, 3.0));
  PetscCall(Solve(&s, o, "springs change", 14));
  PetscCall(GetOperator(s, &of[1]));
  if (layout == NEST) PetscCall(CheckTrue("the operator is kept", of[0] == of[1]));
  PetscCall(Scale(s.C, false, 0.1, 9));
  PetscCall(Solve(&s, o, "values of C with springs", 15));
  PetscCall(Spring(&s, 30.0));
  PetscCall(Solve(&s, o, "softer springs", 8));
  PetscCall(Scale(s.A, true, 0.1, 5));
  PetscCall(Scale(s.C, false, 0.1, 6));
  PetscCall(Solve(&s, o, "A and C", 9));
  PetscCall(Spring(&s, 0.0));
  PetscCall(Solve(&s, o, "springs go", 10));
  PetscCall(Scale(s.A, true, 2.0, 7));
  PetscCall(Solve(&s, o, "A, by four decades", 11));
  if (kept) PetscCall(CheckView(s, false));
  PetscCall(Tie(&s, 5, 2));
  PetscCall(Scale(s.A, true, 0.05, 8));
  PetscCall(Solve(&s, o, "rows go, and A", 12));
  PetscCall(MatDestroy(&s.A));
  s.lattice.layers = 8;
  PetscCall(LatticeCreate(s.lattice, &s.A));
  PetscCall(Tie(&s, 9, 0));
  PetscCall(Solve(&s, o, "another size", 13));
  PetscCall(KSPDestroy(&s.ksp));
  for (Mat *M : {&s.A, &s.C, &s.D, &s.K}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  std::vector<std::string> inner = {"blocksa -ainsworth_pc_blocksa_coarse_eq_limit 60", "redundant"};
  int                      exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  PetscCall(PetscLogDefaultBegin());
#if defined(PETSC_HAVE_HYPRE)
  inner.push_back("hypre");
#endif
  for (const std::string &type : inner) {
    for (const std::string rebuild : {"", " -pc_ainsworth_rebuild always", " -pc_ainsworth_rebuild never",
                                      " -ksp_reuse_preconditioner -pc_ainsworth_rebuild always"})
      for (Layout layout : {NEST, COPIES, FIELDS, WHOLE}) {
        const bool first = type == inner[0], usual = rebuild.empty(); /* all layouts for our own multigrid alone */

        if (layout != NEST && (!first || (!usual && layout != WHOLE))) continue;
        PetscCall(
          Changes(layout, ("-ainsworth_ksp_rtol 1e-12 -ainsworth_pc_type " + type + rebuild).c_str(), first && usual));
      }
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
