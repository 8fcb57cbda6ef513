static char help[] = "A sequence of systems of two elastic cubes: rows of C, right-hand sides or A change from step to "
                     "step, and one KSP solves them all.\n\n";

#include "activeset.h"
#include "reference.h"
#include "report.h"
#include <algorithm>
#include <cmath>
#include <random>

enum Change {
  CHANGE_ROWS,    /* rows of C leave and come, at random */
  CHANGE_CONTACT, /* the active set of bodies that touch without friction, until it stays */
  CHANGE_VALUES,  /* entries of C */
  CHANGE_RHS,     /* f and g alone */
  CHANGE_A        /* stiffness of the upper body */
};

struct Choices {
  PetscInt  steps, change;
  PetscReal changed, bulge;
  PetscBool compare, verify, snes;
};

/*
   All rows of C that there may be, and which of them are active, on every rank; the system of those, and the solution
   of the last step
*/
struct Sequence {
  Choices           choices;
  CubesSystem       whole;
  std::vector<char> active;
  std::mt19937      random;
  IS                rows; /* the active ones of this rank */
  Mat               C, K;
  Vec               g, b, y, x, lambda;
};

/* One solve: processor seconds of all ranks, iterations, and the error in the energy norm */
struct Result {
  double             setup, solve;
  PetscInt           iterations;
  KSPConvergedReason reason;
  PetscReal          error;
};

static PetscErrorCode ChoicesGet(MPI_Comm comm, Choices *c)
{
  const char *const changes[] = {"rows", "contact", "values", "rhs", "A"};

  PetscFunctionBeginUser;
  *c         = Choices();
  c->steps   = 5;
  c->changed = 0.01;
  PetscOptionsBegin(comm, NULL, "A sequence of systems", NULL);
  PetscCall(PetscOptionsInt("-steps", "How many systems", NULL, c->steps, &c->steps, NULL));
  PetscCall(PetscOptionsEList("-change", "What is another from step to step", NULL, changes, 5, changes[c->change],
                              &c->change, NULL));
  PetscCall(PetscOptionsReal("-changed",
                             "Share of the rows that change, or relative change of the stiffness [-], in [0,1]", NULL,
                             c->changed, &c->changed, NULL));
  PetscCheck(c->changed >= 0 && c->changed <= 1, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option -changed is %g, it must be in [0,1]", (double)c->changed);
  PetscCall(PetscOptionsReal(
    "-bulge", "How far the upper body is above the lower one at the edges of the contact surface [length]", NULL,
    c->bulge, &c->bulge, NULL));
  PetscCall(PetscOptionsBool("-compare", "Solve each system with a new KSP, too", NULL, c->compare, &c->compare, NULL));
  PetscCall(PetscOptionsBool("-verify", "Compare with a direct solver, which takes its time", NULL, c->verify,
                             &c->verify, NULL));
  PetscCall(PetscOptionsBool("-active_set", "Find the contact once more, by the SNES of the options", NULL, c->snes,
                             &c->snes, NULL));
  PetscOptionsEnd();
  PetscCheck(!c->snes || c->change == CHANGE_CONTACT, comm, PETSC_ERR_ARG_INCOMP,
             "Option -active_set needs -change contact");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* g = -C w, where w lifts the upper body by its distance from the middle, squared: 1 at the middle of an edge */
static PetscErrorCode Bulge(Sequence *s)
{
  const CubesMesh &mesh = s->whole.mesh;
  PetscScalar     *a;
  Vec              w;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(s->whole.f, &w));
  PetscCall(VecGetArrayWrite(w, &a));
  for (size_t k = 0; k < mesh.owned.size(); k++) {
    PetscReal x[3], lift[3] = {0, 0, 0}, turned[3];

    mesh.Position(mesh.owned[k], x);
    if (mesh.Body(mesh.owned[k])) lift[2] = 4 * s->choices.bulge * (PetscSqr(x[0] - 0.5) + PetscSqr(x[1] - 0.5));
    mesh.Rotate(lift, turned);
    for (int c = 0; c < 3; c++) a[3 * k + c] = turned[c];
  }
  PetscCall(VecRestoreArrayWrite(w, &a));
  PetscCall(VecScale(w, -1.0));
  PetscCall(MatMult(s->whole.C, w, s->whole.g));
  PetscCall(VecDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* v of all rows, on every rank */
static PetscErrorCode Everywhere(Vec v, std::vector<PetscReal> *values)
{
  VecScatter         toAll;
  Vec                all;
  const PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecScatterCreateToAll(v, &toAll, &all));
  PetscCall(VecScatterBegin(toAll, v, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(toAll, v, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(all, &a));
  for (size_t i = 0; i < values->size(); i++) (*values)[i] = PetscRealPart(a[i]);
  PetscCall(VecRestoreArrayRead(all, &a));
  PetscCall(VecScatterDestroy(&toAll));
  PetscCall(VecDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows that pull leave, rows that the solution breaks come: C x >= g, and -lambda is the pressure */
static PetscErrorCode UpdateContact(Sequence *s, PetscInt *changes)
{
  const size_t           m = s->active.size();
  std::vector<PetscReal> gap(m), pull(m);
  Vec                    v;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(s->whole.g, &v));
  PetscCall(VecSet(v, 0.0));
  PetscCall(VecISCopy(v, s->rows, SCATTER_FORWARD, s->lambda));
  PetscCall(Everywhere(v, &pull));
  PetscCall(MatMult(s->whole.C, s->x, v));
  PetscCall(VecAXPY(v, -1.0, s->whole.g));
  PetscCall(Everywhere(v, &gap));
  PetscCall(VecDestroy(&v));
  for (size_t i = 0; i < m; i++) {
    const bool stays = s->active[i] ? pull[i] <= 0 : gap[i] >= 0;

    if (stays) continue;
    s->active[i] = !s->active[i];
    ++*changes;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* As many rows leave as come, the same on all ranks */
static PetscErrorCode UpdateRows(Sequence *s, PetscInt *changes)
{
  std::vector<size_t> of[2];

  PetscFunctionBeginUser;
  for (size_t i = 0; i < s->active.size(); i++) of[(int)s->active[i]].push_back(i);
  const size_t half = PetscMin((size_t)std::ceil(s->choices.changed * (double)of[1].size() / 2), of[0].size());
  for (auto &list : of) {
    std::shuffle(list.begin(), list.end(), s->random);
    for (size_t k = 0; k < half; k++) s->active[list[k]] = !s->active[list[k]];
  }
  *changes = 2 * (PetscInt)half;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Entries of some rows, by a tenth of themselves at most */
static PetscErrorCode UpdateValues(Sequence *s, PetscInt *changes)
{
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<char>                      hit(s->active.size());
  PetscInt                               start, end;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < hit.size(); i++) {
    hit[i] = uniform(s->random) < s->choices.changed;
    *changes += hit[i] && s->active[i];
  }
  PetscCall(MatGetOwnershipRange(s->whole.C, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    PetscInt                 n;
    const PetscInt          *columns;
    const PetscScalar       *values;
    std::vector<PetscInt>    j;
    std::vector<PetscScalar> v;

    if (!hit[i]) continue;
    PetscCall(MatGetRow(s->whole.C, i, &n, &columns, &values));
    for (PetscInt k = 0; k < n; k++) {
      j.push_back(columns[k]);
      v.push_back(values[k] * (1 + 0.1 * std::sin((PetscReal)(7 * i + 3 * k))));
    }
    PetscCall(MatRestoreRow(s->whole.C, i, &n, &columns, &values));
    PetscCall(MatSetValues(s->whole.C, 1, &i, n, j.data(), v.data(), INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(s->whole.C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(s->whole.C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Young's modulus and Poisson's ratio of the upper body, in place */
static PetscErrorCode UpdateA(Sequence *s)
{
  CubesMesh &mesh = s->whole.mesh;
  Mat        A;
  Vec        f;

  PetscFunctionBeginUser;
  mesh.options.E[1] *= 1 + s->choices.changed;
  mesh.options.nu[1] += s->choices.changed * (0.45 - mesh.options.nu[1]);
  PetscCall(CubesAssembleElasticity(mesh, &A, &f));
  PetscCall(MatCopy(A, s->whole.A, SAME_NONZERO_PATTERN));
  PetscCall(VecCopy(f, s->whole.f));
  PetscCall(MatDestroy(&A));
  PetscCall(VecDestroy(&f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The active rows of this rank, and their system */
static PetscErrorCode CreateSystem(Sequence *s)
{
  Mat                   blocks[4] = {s->whole.A, NULL, NULL, NULL};
  PetscInt              start, end;
  std::vector<PetscInt> index;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(s->whole.C, &start, &end));
  for (PetscInt i = start; i < end; i++)
    if (s->active[i]) index.push_back(i);
  PetscCall(ISCreateGeneral(s->whole.mesh.comm, (PetscInt)index.size(), index.data(), PETSC_COPY_VALUES, &s->rows));
  PetscCall(MatCreateSubMatrix(s->whole.C, s->rows, NULL, MAT_INITIAL_MATRIX, &s->C));
  PetscCall(PetscDefined(USE_COMPLEX) ? MatCreateHermitianTranspose(s->C, &blocks[1])
                                      : MatCreateTranspose(s->C, &blocks[1]));
  blocks[2] = s->C;
  PetscCall(MatCreateNest(s->whole.mesh.comm, 2, NULL, 2, NULL, blocks, &s->K));
  PetscCall(MatDestroy(&blocks[1]));
  PetscCall(MatCreateVecs(s->C, NULL, &s->g));
  PetscCall(VecDuplicate(s->g, &s->lambda));
  PetscCall(MatCreateVecs(s->K, &s->y, &s->b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode DestroySystem(Sequence *s)
{
  PetscFunctionBeginUser;
  PetscCall(ISDestroy(&s->rows));
  for (Mat *M : {&s->C, &s->K}) PetscCall(MatDestroy(M));
  for (Vec *v : {&s->g, &s->lambda, &s->y, &s->b}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next system: another one only where other rows are active */
static PetscErrorCode Update(Sequence *s, PetscInt *changes)
{
  PetscFunctionBeginUser;
  *changes = 0;
  switch (s->choices.change) {
  case CHANGE_CONTACT:
    PetscCall(UpdateContact(s, changes));
    break;
  case CHANGE_ROWS:
    PetscCall(UpdateRows(s, changes));
    break;
  case CHANGE_VALUES:
    PetscCall(UpdateValues(s, changes));
    PetscCall(MatCreateSubMatrix(s->whole.C, s->rows, NULL, MAT_REUSE_MATRIX, &s->C));
    break;
  case CHANGE_A:
    PetscCall(UpdateA(s));
    break;
  default:
    for (Vec v : {s->whole.f, s->whole.g}) PetscCall(VecScale(v, 1.5));
  }
  if (s->choices.change > CHANGE_CONTACT || !*changes) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DestroySystem(s));
  PetscCall(CreateSystem(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ||x - exact||_A / ||exact||_A */
static PetscErrorCode EnergyError(Mat A, Vec x, Vec exact, PetscReal *error)
{
  PetscScalar square[2];
  Vec         e, w;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(x, &e));
  PetscCall(VecDuplicate(x, &w));
  PetscCall(VecCopy(x, e));
  PetscCall(VecAXPY(e, -1.0, exact));
  for (int k = 0; k < 2; k++) {
    PetscCall(MatMult(A, k ? exact : e, w));
    PetscCall(VecDot(w, k ? exact : e, &square[k]));
  }
  *error = PetscSqrtReal(PetscRealPart(square[0]) / PetscRealPart(square[1]));
  PetscCall(VecDestroy(&e));
  PetscCall(VecDestroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PETSc wants a KSP reset where its next matrix has another size */
static PetscErrorCode SetOperators(KSP ksp, Mat K)
{
  PetscBool set;
  Mat       last;
  PetscInt  now, before;
  int       other = 0;

  PetscFunctionBeginUser;
  PetscCall(KSPGetOperatorsSet(ksp, &set, NULL));
  if (set) {
    PetscCall(KSPGetOperators(ksp, &last, NULL));
    PetscCall(MatGetLocalSize(K, &now, NULL));
    PetscCall(MatGetLocalSize(last, &before, NULL));
    other = now != before;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &other, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)K)));
  }
  if (other) PetscCall(KSPReset(ksp));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the system at hand, but does not keep the solution */
static PetscErrorCode Solve(const Sequence &s, KSP ksp, Result *result)
{
  MPI_Comm comm = s.whole.mesh.comm;
  double   at[3];
  IS       is[2];

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(s.K, is, NULL));
  PetscCall(VecISCopy(s.b, is[0], SCATTER_FORWARD, s.whole.f));
  PetscCall(VecISCopy(s.b, is[1], SCATTER_FORWARD, s.g));
  PetscCall(SetOperators(ksp, s.K));
  at[0] = ReportProcessor();
  PetscCall(KSPSetUp(ksp));
  at[1] = ReportProcessor();
  PetscCall(KSPSolve(ksp, s.b, s.y));
  at[2] = ReportProcessor();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, at, 3, MPI_DOUBLE, MPI_SUM, comm));
  result->setup = at[1] - at[0];
  result->solve = at[2] - at[1];
  PetscCall(KSPGetConvergedReason(ksp, &result->reason));
  PetscCall(ReportIterations(ksp, &result->iterations));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateSolver(MPI_Comm comm, KSP *ksp)
{
  PetscFunctionBeginUser;
  PetscCall(KSPCreate(comm, ksp));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One step, with the KSP of all steps and, if asked for, with a new one */
static PetscErrorCode Step(Sequence *s, KSP ksp, Result *kept, Result *fresh)
{
  MPI_Comm comm = s->whole.mesh.comm;
  IS       is[2];
  KSP      other;
  Vec      exact[2];

  PetscFunctionBeginUser;
  PetscCall(VecISCopy(s->whole.g, s->rows, SCATTER_REVERSE, s->g));
  if (s->choices.compare) {
    PetscCall(CreateSolver(comm, &other));
    PetscCall(Solve(*s, other, fresh));
    PetscCall(KSPDestroy(&other));
  }
  PetscCall(Solve(*s, ksp, kept));
  PetscCall(MatNestGetISs(s->K, is, NULL));
  PetscCall(VecISCopy(s->y, is[0], SCATTER_REVERSE, s->x));
  PetscCall(VecISCopy(s->y, is[1], SCATTER_REVERSE, s->lambda));
  kept->error = -1;
  if (!s->choices.verify) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(s->x, &exact[0]));
  PetscCall(VecDuplicate(s->g, &exact[1]));
  PetscCall(ReferenceCompute({s->whole.A, s->C}, s->whole.f, s->g, exact[0], exact[1]));
  PetscCall(EnergyError(s->whole.A, s->x, exact[0], &kept->error));
  for (Vec &v : exact) PetscCall(VecDestroy(&v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SequenceCreate(Sequence *s)
{
  CubesOptions options;
  PetscInt     m;

  PetscFunctionBeginUser;
  PetscCall(CubesOptionsGet(PETSC_COMM_WORLD, &options));
  PetscCall(ChoicesGet(PETSC_COMM_WORLD, &s->choices));
  PetscCheck(s->choices.change != CHANGE_CONTACT || options.stick == 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_INCOMP,
             "Option -change contact is without friction: it needs -stick 0");
  PetscCall(CubesSystemCreate(PETSC_COMM_WORLD, options, &s->whole));
  if (s->choices.bulge != 0) PetscCall(Bulge(s));
  PetscCall(VecDuplicate(s->whole.f, &s->x));
  PetscCall(VecSet(s->x, 0.0));
  PetscCall(MatGetSize(s->whole.C, &m, NULL));
  s->active.assign(m, 1);
  if (s->choices.change == CHANGE_ROWS) { /* some that may come */
    for (PetscInt i = 0; i < m; i++) s->active[i] = s->random() % 10 != 0;
  }
  PetscCall(CreateSystem(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The whole of it by a SNES, with one solver and with new ones, and how far its solution is from that of the steps */
static PetscErrorCode ByActiveSet(Sequence *s, double others)
{
  MPI_Comm        comm = s->whole.mesh.comm;
  ActiveSetResult result;
  PetscReal       error;
  Vec             x;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(s->x, &x));
  for (PetscBool fresh : {PETSC_FALSE, PETSC_TRUE}) {
    PetscCall(ActiveSetSolve(s->whole, fresh, x, &result));
    PetscCall(EnergyError(s->whole.A, x, s->x, &error));
    PetscCall(PetscPrintf(comm,
                          "active set, %s: converged=%d steps=%" PetscInt_FMT " iterations=%" PetscInt_FMT
                          " cpu_s=%.4f distance=%.1e",
                          fresh ? "new solvers" : "one solver", result.converged, result.steps, result.iterations,
                          result.seconds, (double)error));
    if (others > 0)
      PetscCall(PetscPrintf(comm, " cost=%.3f of that with a new KSP each step", result.seconds / others));
    PetscCall(PetscPrintf(comm, "\n"));
  }
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Sequence s;
  KSP      ksp;
  Result   kept, fresh = Result();
  double   total[2] = {0, 0};
  PetscInt changes  = 0, m;
  bool     good     = true;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(SequenceCreate(&s));
  PetscCall(CreateSolver(PETSC_COMM_WORLD, &ksp));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "step,rows,changes,setup_cpu_s,solve_cpu_s,iterations,reason,energy_error%s\n",
                        s.choices.compare ? ",new_setup_cpu_s,new_solve_cpu_s,new_iterations" : ""));
  for (PetscInt step = 0; step < s.choices.steps; step++) {
    if (step) PetscCall(Update(&s, &changes));
    if (step && s.choices.change <= CHANGE_CONTACT && !changes) break; /* the active set is that of the solution */
    PetscCall(Step(&s, ksp, &kept, &fresh));
    PetscCall(MatGetSize(s.C, &m, NULL));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                          "%" PetscInt_FMT ",%" PetscInt_FMT ",%" PetscInt_FMT ",%.4f,%.4f,%" PetscInt_FMT ",%s,", step,
                          m, changes, kept.setup, kept.solve, kept.iterations, KSPConvergedReasons[kept.reason]));
    if (s.choices.verify) PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%.2e", (double)kept.error));
    if (s.choices.compare)
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, ",%.4f,%.4f,%" PetscInt_FMT, fresh.setup, fresh.solve, fresh.iterations));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
    total[0] += kept.setup + kept.solve;
    total[1] += fresh.setup + fresh.solve;
    good = good && kept.reason > 0;
  }
  if (s.choices.compare)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "cost: %.3f of that with a new KSP each step\n", total[0] / total[1]));
  PetscCall(KSPDestroy(&ksp));
  if (s.choices.snes) PetscCall(ByActiveSet(&s, total[1]));
  PetscCall(DestroySystem(&s));
  PetscCall(VecDestroy(&s.x));
  PetscCall(CubesSystemDestroy(&s.whole));
  PetscCall(PetscFinalize());
  return good ? 0 : 1;
}
