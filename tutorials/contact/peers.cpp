static char help[] = "Hertz' sphere on a block at one approach, as a whole: the least energy of all displacements "
                     "with C u <= g, found by\n"
                     "  -method snes         an active set that the options choose, for instance -snes_type "
                     "ainsworthactiveset -ksp_type preonly -pc_type ainsworth\n"
                     "  -method elimination  the same active set, where each step eliminates one unknown of each row "
                     "in contact and makes a new solver\n"
                     "  -method tao          TAO, for instance -tao_type pdipm or almm\n"
                     "Processor seconds, and how far x is from that of an active set with a direct solver, in the "
                     "energy norm.\n"
                     "  -write <file>        A, C, g, that x, the nodes and multipliers, in binary format\n\n";

#include "bodies.h"
#include "../../tests/bench/forms.h"
#include "../../tests/bench/report.h"
#include <petsctao.h>
#include <cmath>

enum Method {
  METHOD_SNES,
  METHOD_ELIMINATION,
  METHOD_TAO
};

struct Problem {
  Bodies bodies;
  Mat    A, C;      /* with planes of symmetry in A, and rows of contact only */
  Vec    g, lambda; /* lambda: of the reference */
};

/* p->A, C and g of the bodies: rows of one entry say that an unknown is zero */
static PetscErrorCode Reduce(Problem *p)
{
  const Bodies          &b = p->bodies;
  PetscInt               n, start, end, place = 0;
  std::vector<PetscInt>  zero, rows;
  std::vector<PetscReal> gap;
  IS                     is;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(b.A, &n, NULL));
  PetscCall(MatGetOwnershipRange(b.C, &start, &end));
  for (const ContactNode &node : b.node) {
    rows.push_back(start + node.row - n);
    gap.push_back(node.gap - p->bodies.approach);
  }
  for (PetscInt i = start; i < end; i++) {
    const PetscInt *columns;

    if (place < (PetscInt)rows.size() && rows[place] == i) {
      place++;
      continue;
    }
    PetscCall(MatGetRow(b.C, i, &n, &columns, NULL));
    zero.push_back(columns[0]);
    PetscCall(MatRestoreRow(b.C, i, &n, &columns, NULL));
  }
  PetscCall(MatDuplicate(b.A, MAT_COPY_VALUES, &p->A));
  PetscCall(FormCopyNearNullSpace(b.A, p->A));
  PetscCall(MatZeroRowsColumns(p->A, (PetscInt)zero.size(), zero.data(), b.options.E[0], NULL, NULL));
  PetscCall(MatSetOption(p->A, MAT_SPD, PETSC_TRUE));
  PetscCall(ISCreateGeneral(b.scene.comm, (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, &is));
  PetscCall(MatCreateSubMatrix(b.C, is, NULL, MAT_INITIAL_MATRIX, &p->C));
  PetscCall(ISDestroy(&is));
  PetscCall(MatCreateVecs(p->C, NULL, &p->g));
  PetscCall(VecGetOwnershipRange(p->g, &start, NULL));
  for (size_t i = 0; i < gap.size(); i++) PetscCall(VecSetValue(p->g, start + (PetscInt)i, gap[i], INSERT_VALUES));
  PetscCall(VecAssemblyBegin(p->g));
  PetscCall(VecAssemblyEnd(p->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the solution X of the bodies has in rows of contact */
static PetscErrorCode CopyMultipliers(Problem *p, Vec X)
{
  const PetscScalar *x;
  PetscScalar       *l;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(X, &x));
  PetscCall(VecGetArrayWrite(p->lambda, &l));
  for (size_t i = 0; i < p->bodies.node.size(); i++) l[i] = x[p->bodies.node[i].row];
  PetscCall(VecRestoreArrayWrite(p->lambda, &l));
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* reference: with a direct solver, whatever the options say */
static PetscErrorCode SolveSNES(Problem *p, PetscBool reference, PetscBool fresh, PetscBool monolithic, Vec u,
                                PetscInt count[2])
{
  SNES                snes;
  KSP                 ksp;
  PC                  pc;
  Mat                 J = p->bodies.J;
  Vec                 X, F, bound[2];
  IS                  is[2];
  PetscScalar        *l;
  SNESConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectReference((PetscObject)J));
  if (reference || monolithic) {
    PetscCall(MatDestroy(&J));
    PetscCall(MatConvert(p->bodies.J, MATAIJ, MAT_INITIAL_MATRIX, &J));
  }
  for (Vec *v : {&X, &F, &bound[0], &bound[1]}) PetscCall(VecDuplicate(p->bodies.gaps, v));
  PetscCall(VecSet(X, 0.0));
  PetscCall(VecSet(bound[0], PETSC_NINFINITY));
  PetscCall(VecSet(bound[1], PETSC_INFINITY));
  PetscCall(VecGetArray(bound[0], &l));
  for (const ContactNode &node : p->bodies.node) l[node.row] = 0;
  PetscCall(VecRestoreArray(bound[0], &l));
  PetscCall(SNESCreate(p->bodies.scene.comm, &snes));
  PetscCall(SNESSetFunction(snes, F, BodiesFunction, &p->bodies));
  PetscCall(SNESSetJacobian(snes, J, J, BodiesJacobian, &p->bodies));
  PetscCall(SNESVISetVariableBounds(snes, bound[0], bound[1]));
  PetscCall(SNESMonitorSet(snes, ReportCount, &count[1], NULL));
  if (reference) {
    PetscCall(SNESSetType(snes, "ainsworthactiveset"));
    PetscCall(SNESGetKSP(snes, &ksp));
    PetscCall(KSPSetType(ksp, KSPPREONLY));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCSetType(pc, PCLU));
    PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  } else PetscCall(SNESSetFromOptions(snes));
  if (fresh) PetscCall(SNESSetUpdate(snes, ReportForget));
  PetscCall(SNESSolve(snes, NULL, X));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  PetscCheck(reason > 0, p->bodies.scene.comm, PETSC_ERR_NOT_CONVERGED, "The active set was not found: %s",
             SNESConvergedReasons[reason]);
  PetscCall(SNESGetIterationNumber(snes, &count[0]));
  PetscCall(MatNestGetISs(p->bodies.J, is, NULL));
  PetscCall(VecISCopy(X, is[0], SCATTER_REVERSE, u));
  if (reference) PetscCall(CopyMultipliers(p, X));
  PetscCall(SNESDestroy(&snes));
  for (Vec *v : {&X, &F, &bound[0], &bound[1]}) PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&J));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u and the multipliers of these rows; a new solver */
static PetscErrorCode EliminateAndSolve(Problem *p, const std::vector<PetscInt> &rows, Vec u, Vec lambda,
                                        PetscInt *iterations)
{
  SaddleBlocks       blocks = {p->A, NULL};
  Vec                f, g, l;
  IS                 is;
  Form               form;
  KSP                ksp;
  PetscInt           its, start;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(VecGetOwnershipRange(p->g, &start, NULL));
  PetscCall(ISCreateGeneral(p->bodies.scene.comm, (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, &is));
  PetscCall(MatCreateSubMatrix(p->C, is, NULL, MAT_INITIAL_MATRIX, &blocks.C));
  PetscCall(MatCreateVecs(blocks.C, NULL, &g));
  PetscCall(VecDuplicate(g, &l));
  PetscCall(VecISCopy(p->g, is, SCATTER_REVERSE, g));
  PetscCall(VecDuplicate(u, &f));
  PetscCall(VecSet(f, 0.0));
  PetscCall(FormCreate(blocks, f, g, FORM_ELIMINATED, 0.0, &form));
  PetscCall(KSPCreate(p->bodies.scene.comm, &ksp));
  PetscCall(KSPSetOperators(ksp, form.K, form.M));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSolve(ksp, form.rhs, form.y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCheck(reason > 0, p->bodies.scene.comm, PETSC_ERR_NOT_CONVERGED, "The eliminated system was not solved: %s",
             KSPConvergedReasons[reason]);
  PetscCall(KSPGetIterationNumber(ksp, &its));
  *iterations += its;
  PetscCall(FormGetSolution(form, u, l));
  PetscCall(VecSet(lambda, 0.0));
  PetscCall(VecISCopy(lambda, is, SCATTER_FORWARD, l));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(FormDestroy(&form));
  for (Vec *v : {&f, &g, &l}) PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&blocks.C));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The primal-dual active set: rows that pull leave, rows that are broken come */
static PetscErrorCode SolveElimination(Problem *p, Vec u, PetscInt count[2])
{
  Vec                lambda, gap;
  PetscInt           m, start, changes = 1;
  std::vector<char>  active;
  const PetscScalar *l, *d;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(p->g, &lambda));
  PetscCall(VecDuplicate(p->g, &gap));
  PetscCall(VecGetOwnershipRange(p->g, &start, NULL));
  PetscCall(VecGetLocalSize(p->g, &m));
  active.assign(m, 0);
  PetscCall(VecSet(lambda, 0.0));
  PetscCall(VecCopy(p->g, gap)); /* of u = 0 */
  while (changes) {
    std::vector<PetscInt> rows;

    changes = 0;
    PetscCall(VecGetArrayRead(lambda, &l));
    PetscCall(VecGetArrayRead(gap, &d));
    for (PetscInt i = 0; i < m; i++) {
      const char now = active[i] ? PetscRealPart(l[i]) > 0 : PetscRealPart(d[i]) < 0;

      changes += now != active[i];
      active[i] = now;
      if (now) rows.push_back(start + i);
    }
    PetscCall(VecRestoreArrayRead(gap, &d));
    PetscCall(VecRestoreArrayRead(lambda, &l));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &changes, 1, MPIU_INT, MPI_SUM, p->bodies.scene.comm));
    if (!changes) break;
    PetscCall(EliminateAndSolve(p, rows, u, lambda, &count[1]));
    count[0]++;
    PetscCall(MatMult(p->C, u, gap));
    PetscCall(VecAYPX(gap, -1.0, p->g));
  }
  PetscCall(VecDestroy(&lambda));
  PetscCall(VecDestroy(&gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u' A u / 2 and A u */
static PetscErrorCode Energy(Tao, Vec u, PetscReal *energy, Vec gradient, void *ctx)
{
  PetscScalar product;

  PetscFunctionBeginUser;
  *energy = 0;
  PetscCall(MatMult(((Problem *)ctx)->A, u, gradient));
  PetscCall(VecDot(gradient, u, &product));
  *energy = PetscRealPart(product) / 2;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* g - C u >= 0 */
static PetscErrorCode Gap(Tao, Vec u, Vec gap, void *ctx)
{
  const Problem *p = (const Problem *)ctx;

  PetscFunctionBeginUser;
  PetscCall(MatMult(p->C, u, gap));
  PetscCall(VecAYPX(gap, -1.0, p->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Constant(Tao, Vec, Mat, Mat, void *)
{
  PetscFunctionBeginUser;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SolveTao(Problem *p, Vec u, PetscInt count[2])
{
  TaoConvergedReason reason;
  Tao                tao;
  Mat                N;
  Vec                gap, none[2];

  PetscFunctionBeginUser;
  for (Vec &v : none) PetscCall(VecDuplicate(u, &v)); /* PDIPM wants bounds of u */
  PetscCall(VecSet(none[0], PETSC_NINFINITY));
  PetscCall(VecSet(none[1], PETSC_INFINITY));
  PetscCall(MatDuplicate(p->C, MAT_COPY_VALUES, &N));
  PetscCall(MatScale(N, -1.0));
  PetscCall(VecDuplicate(p->g, &gap));
  PetscCall(VecSet(u, 0.0));
  PetscCall(TaoCreate(p->bodies.scene.comm, &tao));
  PetscCall(TaoSetType(tao, TAOPDIPM));
  PetscCall(TaoSetSolution(tao, u));
  PetscCall(TaoSetVariableBounds(tao, none[0], none[1]));
  PetscCall(TaoSetObjectiveAndGradient(tao, NULL, Energy, p));
  PetscCall(TaoSetHessian(tao, p->A, p->A, Constant, p));
  PetscCall(TaoSetInequalityConstraintsRoutine(tao, gap, Gap, p));
  PetscCall(TaoSetJacobianInequalityRoutine(tao, N, N, Constant, p));
  PetscCall(TaoSetFromOptions(tao));
  PetscCall(TaoSolve(tao));
  PetscCall(TaoGetConvergedReason(tao, &reason));
  PetscCall(TaoGetIterationNumber(tao, &count[0]));
  if (reason <= 0) PetscCall(PetscPrintf(p->bodies.scene.comm, "TAO ended with %s\n", TaoConvergedReasons[reason]));
  PetscCall(TaoDestroy(&tao));
  for (Vec *v : {&gap, &none[0], &none[1]}) PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&N));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |u - exact|_A / |exact|_A, and how deep the bodies are in each other, of the approach */
static PetscErrorCode Judge(Problem *p, Vec u, Vec exact, PetscReal *error, PetscReal *depth)
{
  PetscReal energy[2];
  Vec       e, work, gap;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(p->g, &gap));
  PetscCall(Gap(NULL, u, gap, p));
  PetscCall(VecMin(gap, NULL, depth));
  *depth = PetscMax(0, -*depth) / p->bodies.approach;
  PetscCall(VecDuplicate(u, &e));
  PetscCall(VecDuplicate(u, &work));
  PetscCall(VecWAXPY(e, -1.0, exact, u));
  PetscCall(Energy(NULL, e, &energy[0], work, p));
  PetscCall(Energy(NULL, exact, &energy[1], work, p));
  *error = PetscSqrtReal(PetscMax(0, energy[0]) / energy[1]);
  for (Vec *v : {&e, &work, &gap}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For programs that other packages need (docs/study/permon.c, docs/study/parts.py) */
static PetscErrorCode Write(const Problem *p, Vec exact)
{
  char        file[PETSC_MAX_PATH_LEN];
  PetscBool   wanted;
  PetscViewer viewer;
  Vec         coordinates;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-write", file, sizeof(file), &wanted));
  if (!wanted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerBinaryOpen(p->bodies.scene.comm, file, FILE_MODE_WRITE, &viewer));
  for (Mat M : {p->A, p->C}) PetscCall(MatView(M, viewer));
  PetscCall(SceneGetCoordinates(p->bodies.scene, &coordinates));
  for (Vec v : {p->g, exact, coordinates, p->lambda}) PetscCall(VecView(v, viewer));
  PetscCall(VecDestroy(&coordinates));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const char *const methods[] = {"snes", "elimination", "tao"};
  PetscInt          method = METHOD_SNES, count[2] = {0, 0}, other[2] = {0, 0}, n = 12, size;
  PetscBool         fresh = PETSC_FALSE, monolithic = PETSC_FALSE;
  PetscReal         error = 0, depth = 0;
  double            cpu;
  BodiesOptions     o = BodiesOptions();
  Problem           p = Problem();
  Vec               u, exact;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  p.bodies.approach = 0.16;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "Hertz' sphere at one approach (mm, N, MPa)", NULL);
  PetscCall(
    PetscOptionsEList("-method", "What finds the displacements", NULL, methods, 3, methods[method], &method, NULL));
  PetscCall(PetscOptionsInt("-n", "Cells along each edge of a body, even", NULL, n, &n, NULL));
  PetscCall(PetscOptionsReal("-approach", "Of the bodies", NULL, p.bodies.approach, &p.bodies.approach, NULL));
  PetscCall(PetscOptionsBool("-fresh",
                             "Let each step of the active set begin with a solver that knows nothing of the last one",
                             NULL, fresh, &fresh, NULL));
  PetscCall(
    PetscOptionsBool("-monolithic", "One AIJ matrix in place of a MatNest", NULL, monolithic, &monolithic, NULL));
  PetscOptionsEnd();
  o.dim    = 3;
  o.n[0]   = n;
  o.n[1]   = n;
  o.E[0]   = 70e3;
  o.E[1]   = 210e3;
  o.nu     = 0.3;
  o.radius = 50;
  o.near   = 1.5 * std::sqrt(p.bodies.approach * o.radius);
  o.far    = 16 * o.near;
  PetscCall(BodiesCreate(PETSC_COMM_WORLD, o, &p.bodies));
  PetscCall(Reduce(&p));
  PetscCall(MatCreateVecs(p.A, &u, NULL));
  PetscCall(VecDuplicate(u, &exact));
  PetscCall(VecDuplicate(p.g, &p.lambda));
  PetscCall(MatGetSize(p.A, &size, NULL));
  PetscCall(SolveSNES(&p, PETSC_TRUE, PETSC_FALSE, PETSC_FALSE, exact, other));
  PetscCall(Write(&p, exact));
  cpu = ReportProcessor();
  if (method == METHOD_SNES) PetscCall(SolveSNES(&p, PETSC_FALSE, fresh, monolithic, u, count));
  else if (method == METHOD_ELIMINATION) PetscCall(SolveElimination(&p, u, count));
  else PetscCall(SolveTao(&p, u, count));
  cpu = ReportProcessor() - cpu;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &cpu, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(Judge(&p, u, exact, &error, &depth));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "peer: method=%s unknowns=%" PetscInt_FMT " steps=%" PetscInt_FMT " iterations=%" PetscInt_FMT
                        " error=%.2e depth=%.2e cpu_s=%.3f\n",
                        methods[method], size, count[0], count[1], (double)error, (double)depth, cpu));
  for (Vec *v : {&u, &exact, &p.g, &p.lambda}) PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&p.A));
  PetscCall(MatDestroy(&p.C));
  PetscCall(BodiesDestroy(&p.bodies));
  PetscCall(PetscFinalize());
  return 0;
}
