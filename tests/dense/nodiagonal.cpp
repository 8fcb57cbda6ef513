static char help[] = "Rows of A without a stored diagonal entry; unknowns in no equation; rows of C whose unknowns many rows share.\n\n";

#include "run.h"

/* Stores the nonzero entries of A alone, where SystemFromDense() also stores zeros on the diagonal */
static PetscErrorCode CreateSparse(const DenseSystem &d, bool crossed, Run *run)
{
  PetscInt start, end, n;

  PetscFunctionBeginUser;
  PetscCall(SystemFromDense(d, crossed, &run->sys));
  PetscCall(MatGetLocalSize(run->sys.A, &n, NULL));
  PetscCall(MatGetOwnershipRange(run->sys.A, &start, &end));
  PetscCall(MatDestroy(&run->sys.A));
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, n, n, PETSC_DETERMINE, PETSC_DETERMINE, 16, NULL, 16, NULL, &run->sys.A));
  PetscCall(WriteDense(d.A, run->sys.A));
  PetscCall(NestCreate(run->sys.A, NULL, run->sys.C, NULL, false, &run->nest));
  PetscCall(SolverCreate(run->nest, &run->ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The failure has a reason on all ranks, and a text with these parts, which a view shows; the same as an error if the program wants errors */
static PetscErrorCode CheckRefused(Run *run, const std::vector<std::string> &parts)
{
  PC          pc;
  const char *why;
  std::string text;

  PetscFunctionBeginUser;
  PetscCall(RunSolve(run));
  PetscCall(CheckFailed(*run));
  PetscCall(KSPGetPC(run->ksp, &pc));
  PetscCall(PCAinsworthGetFailure(pc, &why));
  PetscCall(CheckText("failure", why, parts));
  PetscCall(ViewText(run->ksp, text));
  PetscCall(CheckText("view", text, {"last failure: "}));
  PetscCall(CheckText("view", text, parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* v_x + 10.1 i = f, i_x + 10.01 v = f by linear elements: in its inner rows, v_x has no v at the same node. v and i are prescribed, or tied, at the ends */
static DenseSystem Line(PetscInt n, bool constraints)
{
  DenseSystem    d;
  const PetscInt nodes = n + 1;

  d.A = Dense::Zero(2 * nodes, 2 * nodes);
  for (PetscInt i = 0; i < nodes; i++) {
    for (int s : {-1, 0, 1}) {
      const PetscInt  j = i + s;
      const PetscReal x = s ? 0.5 * s : i == 0 ? -0.5 : i == n ? 0.5 : 0.0, mass = (s ? 1.0 : 4.0) / (6.0 * (PetscReal)n);

      if (j < 0 || j > n) continue;
      d.A(i, j)                 = x;
      d.A(nodes + i, nodes + j) = x;
      d.A(i, nodes + j)         = 10.1 * mass;
      d.A(nodes + i, j)         = 10.01 * mass;
    }
  }
  d.C = Dense::Zero(constraints ? 2 : 0, 2 * nodes);
  d.f.resize(2 * nodes);
  d.g.resize(d.C.rows());
  for (PetscInt i = 0; i < 2 * nodes; i++) d.f[i] = Uniform(5, i, 0) / (PetscReal)n;
  if (!constraints) return d;
  d.C(0, 0)     = 1.0;
  d.C(1, n)     = 1.0;
  d.C(1, 2 * n) = -1.0;
  d.g[0]        = 1.0;
  d.g[1]        = 0.0;
  return d;
}

/* M_*, or A without constraints, has all diagonal entries in its pattern: what cannot precondition it ends as a reason, and never as an error */
static PetscErrorCode FirstOrder(PetscInt n, bool constraints, const std::string &line, bool solved)
{
  Options           options("-ainsworth_ksp_rtol 1e-11 " + line);
  const DenseSystem d = Line(n, constraints);
  PetscInt          missing, before, after;
  PetscBool         any;
  MatInfo           info;
  Run               run;

  PetscFunctionBeginUser;
  Case("first order, %d cells, constraints %d, %s", (int)n, constraints, line.c_str());
  PetscCall(CreateSparse(d, false, &run));
  PetscCall(MatGetInfo(run.sys.A, MAT_GLOBAL_SUM, &info));
  before  = (PetscInt)info.nz_used;
  missing = (PetscInt)(d.A.diagonal().array() == 0.0).count();
  any     = (PetscBool)(missing > 0);
  PetscCall(CheckTrue("diagonal entries are missing", any));
  PetscCall(RunSolve(&run));
  if (run.reason < 0 && !solved) PetscCall(CheckRefused(&run, {}));
  else {
    PetscCall(CheckTrue(KSPConvergedReasons[run.reason], run.reason > 0));
    PetscCall(CheckResiduals(run, d, 1e-8, 1e-10));
  }
  PetscCall(MatGetInfo(run.sys.A, MAT_GLOBAL_SUM, &info));
  after = (PetscInt)info.nz_used;
  PetscCall(CheckInt("entries of the program's A", after, before));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Springs with further unknowns that have no stiffness: `tied` of them in a row of C each, and others in no equation */
static DenseSystem Further(PetscInt tied, PetscInt others)
{
  const DenseSystem springs = SpringsCreate(20, 3, 1.0, 4);
  const PetscInt    n       = 20 + tied + others;
  DenseSystem       d;

  d.A                       = Dense::Zero(n, n);
  d.A.topLeftCorner(20, 20) = springs.A;
  d.C                       = Dense::Zero(3 + tied, n);
  d.C.topLeftCorner(3, 20)  = springs.C;
  d.f                       = Column::Zero(n);
  d.f.head(20)              = springs.f;
  d.g                       = Column::Zero(3 + tied);
  d.g.head(3)               = springs.g;
  for (PetscInt k = 0; k < tied; k++) {
    d.C(3 + k, 20 + k) = 1.0;
    d.C(3 + k, 5 + k)  = -1.0;
  }
  return d;
}

/* Unknowns in no equation are named, whether A stores zeros on their diagonal or nothing, and on whichever rank they are */
static PetscErrorCode Loose(bool stored, bool crossed)
{
  const struct {
    PetscInt    others;
    const char *names;
  } cases[] = {
    {1, "Unknowns 22 of"             },
    {3, "Unknowns 22, 23, 24 of"     },
    {9, "26 and 4 more of the primal"}
  };

  PetscFunctionBeginUser;
  for (const auto &c : cases) {
    const DenseSystem d = Further(2, c.others);
    Run               run;

    Case("%d unknowns in no equation, stored %d, crossed %d", (int)c.others, stored, crossed);
    PetscCall(stored ? RunCreate(d, crossed, &run) : CreateSparse(d, crossed, &run));
    PetscCall(CheckRefused(&run, {c.names, "are in no equation", "give them a stiffness"}));
    PetscCall(RunDestroy(&run));
    Options options("-ksp_error_if_not_converged");
    PetscCall(stored ? RunCreate(d, crossed, &run) : CreateSparse(d, crossed, &run));
    PetscCall(CheckError("as an error", [&run]() { return RunSolve(&run); }, PETSC_ERR_MAT_LU_ZRPVT, {c.names, "are in no equation"}));
    PetscCall(RunDestroy(&run));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With a row of C for each, or a spring, the same unknowns are solved for */
static PetscErrorCode Held(bool crossed)
{
  DenseSystem d = Further(5, 0);
  Run         run;

  PetscFunctionBeginUser;
  Case("unknowns in rows of C alone, crossed %d", crossed);
  PetscCall(CreateSparse(d, crossed, &run));
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  Case("refused, and then given a stiffness, crossed %d", crossed);
  d = Further(2, 2);
  PetscCall(RunCreate(d, crossed, &run));
  PetscCall(CheckRefused(&run, {"Unknowns 22, 23 of"}));
  d.A(22, 22) = d.A(23, 23) = 2.0;
  PetscCall(WriteDense(d.A, run.sys.A));
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A that is not symmetric may have a column of zeros, or a row */
static PetscErrorCode OneSided(bool column)
{
  DenseSystem d = Further(0, 1);
  Run         run;

  PetscFunctionBeginUser;
  Case("a zero %s of A", column ? "column" : "row");
  (column ? d.A(20, 7) : d.A(7, 20)) = 1.0;
  PetscCall(CreateSparse(d, false, &run));
  PetscCall(CheckRefused(&run, {column ? "Unknowns 20 of the primal field are in no equation" : "Equations 20 of the primal field have no unknown"}));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A null space attached to A declares that nothing moves such an unknown: the system is solved, and the unknown is zero */
static PetscErrorCode Declared(PetscInt declared)
{
  const DenseSystem d = Further(2, 2);
  MatNullSpace      null;
  Vec               v[2];
  Run               run;

  PetscFunctionBeginUser;
  Case("%d of two unknowns in no equation in a null space", (int)declared);
  PetscCall(RunCreate(d, false, &run));
  for (int k = 0; k < 2; k++) {
    PetscCall(MatCreateVecs(run.sys.A, &v[k], NULL));
    PetscCall(VecSetValue(v[k], 22, k ? 0.8 : 0.6, INSERT_VALUES));
    PetscCall(VecSetValue(v[k], 23, k ? -0.6 : 0.8, INSERT_VALUES));
    PetscCall(VecAssemblyBegin(v[k]));
    PetscCall(VecAssemblyEnd(v[k]));
  }
  PetscCall(MatNullSpaceCreate(PETSC_COMM_WORLD, PETSC_FALSE, declared, v, &null));
  PetscCall(MatSetNullSpace(run.sys.A, null));
  PetscCall(MatNullSpaceDestroy(&null));
  for (Vec &w : v) PetscCall(VecDestroy(&w));
  if (declared == 2) {
    PetscCall(CheckSolved(&run, d));
    PetscCall(Check("the declared unknowns", run.x.tail(2).norm(), 1e-8));
  } else PetscCall(CheckRefused(&run, {"Unknowns 22, 23 of"}));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An unknown that `many` rows share, and that one row alone prescribes, beside a chain of ties: a row of S must not be empty */
static PetscErrorCode Prescribed(PetscInt many, PetscInt chain, bool stiff, const std::string &line)
{
  Options        options("-ainsworth_ksp_rtol 1e-11 " + line);
  const PetscInt n = many + chain + 5;
  DenseSystem    d;
  Run            run;

  PetscFunctionBeginUser;
  Case("an unknown of %d rows is prescribed, chain of %d, stiffness %d, %s", (int)many, (int)chain, stiff, line.c_str());
  d.A = Dense::Zero(n, n);
  d.C = Dense::Zero(many + 1 + chain, n);
  d.f = Column::Constant(n, 1e-3);
  d.g = Column::Zero(many + 1 + chain);
  for (PetscInt i = 0; i < n - 1; i++) {
    d.A(i, i) = 3.0;
    if (i) d.A(i, i - 1) = d.A(i - 1, i) = -1.0;
  }
  if (stiff) d.A(n - 1, n - 1) = 2.0;
  if (stiff) d.A(n - 1, 0) = d.A(0, n - 1) = -0.5;
  for (PetscInt i = 0; i <= many; i++) {
    if (i < many) d.C(i, i) = 1.0;
    d.C(i, n - 1) = i < many ? -1.0 : 1.0;
  }
  d.g[many] = 0.1;
  for (PetscInt k = 0; k < chain; k++) {
    d.C(many + 1 + k, many + k)     = 1.0;
    d.C(many + 1 + k, many + 1 + k) = -1.0;
  }
  PetscCall(CreateSparse(d, false, &run));
  PetscCall(CheckSolved(&run, d));
  PetscCall(RunDestroy(&run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int exitcode;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(AinsworthInitializePackage());
  for (bool constraints : {true, false}) {
    PetscCall(FirstOrder(20, constraints, "", true));
    PetscCall(FirstOrder(310, constraints, "", false)); /* too large to be factored at once */
    PetscCall(FirstOrder(20, constraints, "-ainsworth_pc_type bjacobi -ainsworth_sub_pc_type lu", false));
    for (const char *type : {"jacobi", "gamg", "blocksa", "bjacobi"}) PetscCall(FirstOrder(20, constraints, std::string("-ainsworth_pc_type ") + type, false));
#if defined(PETSC_HAVE_HYPRE)
    PetscCall(FirstOrder(20, constraints, "-ainsworth_pc_type hypre", false));
#endif
  }
  for (bool stored : {false, true})
    for (bool crossed : {false, true}) PetscCall(Loose(stored, crossed));
  for (bool crossed : {false, true}) PetscCall(Held(crossed));
  for (bool column : {false, true}) PetscCall(OneSided(column));
  for (PetscInt declared : {1, 2}) PetscCall(Declared(declared));
  for (bool stiff : {false, true}) {
    PetscCall(Prescribed(120, 60, stiff, ""));
    for (const char *pmat : {"jcb", "cg", "bj_cc"}) PetscCall(Prescribed(120, 60, stiff, std::string("-ainsworth_pc_type jacobi -pc_ainsworth_pmat ") + pmat));
  }
  PetscCall(ChecksFinish(&exitcode));
  PetscCall(PetscFinalize());
  return exitcode;
}
