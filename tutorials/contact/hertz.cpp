static char help[] = "Hertz' contact: a sphere, or in the plane a cylinder, is pressed on a block; both are elastic. "
                     "Each step of the active set is a\n"
                     "saddle point [A C'; -C 0], solved as the options say:\n"
                     "  -dll_append libainsworth.so -snes_type ainsworthactiveset -ksp_type preonly -pc_type "
                     "ainsworth\n\n";

#include "bodies.h"
#include "../../tests/bench/report.h"
#include <petsctime.h>
#include <algorithm>
#include <cmath>

struct HertzOptions {
  BodiesOptions bodies;
  PetscReal     force, reach;
  PetscBool     monolithic, fresh;
  char          vtu[PETSC_MAX_PATH_LEN], pressure[PETSC_MAX_PATH_LEN];
};

/*
   What Hertz found for a force: radius of the contact, its largest pressure, and how much further the middle sinks in
   than the rim of the fine cells
*/
struct Theory {
  PetscReal modulus, radius, pressure, sink;
};

struct Hertz {
  HertzOptions   options;
  Theory         theory;
  Bodies         bodies;
  PetscLogDouble last;   /* time of the last step */
  PetscInt       linear; /* iterations before it */
};

/* What the multipliers say */
struct Found {
  PetscInt active;
  /* distance of the pressure from Hertz', in the L2 norm, relative */
  PetscReal force, radius, pressure, sink, distance;
};

static PetscErrorCode OptionsGet(MPI_Comm comm, HertzOptions *o)
{
  BodiesOptions &b = o->bodies;

  PetscFunctionBeginUser;
  b.dim         = 3;
  b.n[1]        = 16;
  b.E[0]        = 70e3;
  b.E[1]        = 210e3;
  b.nu          = 0.3;
  b.radius      = 50;
  b.near        = 0;
  o->force      = 35e3;
  o->reach      = 24;
  o->monolithic = o->fresh = PETSC_FALSE;
  PetscOptionsBegin(comm, NULL, "Hertz' contact (mm, N, MPa)", NULL);
  PetscCall(PetscOptionsInt("-dim", "3: a sphere; 2: a cylinder in plane strain, forces per mm of its length", NULL,
                            b.dim, &b.dim, NULL));
  PetscCall(PetscOptionsInt("-n", "Cells along each edge of a body, half of them near the contact", NULL, b.n[1],
                            &b.n[1], NULL));
  b.n[0] = b.n[1];
  PetscCall(
    PetscOptionsInt("-n2", "The same of the lower body, if it is to be another number", NULL, b.n[0], &b.n[0], NULL));
  PetscCall(PetscOptionsReal("-E1", "Young's modulus of the sphere", NULL, b.E[1], &b.E[1], NULL));
  PetscCall(PetscOptionsReal("-E2", "Young's modulus of the block", NULL, b.E[0], &b.E[0], NULL));
  PetscCall(PetscOptionsReal("-nu", "Poisson's ratio of both", NULL, b.nu, &b.nu, NULL));
  PetscCall(PetscOptionsReal("-radius", "Radius of the sphere", NULL, b.radius, &b.radius, NULL));
  PetscCall(PetscOptionsReal("-force", "The force that presses", NULL, o->force, &o->force, NULL));
  PetscCall(PetscOptionsReal("-reach", "Size of the bodies, in radii of the contact", NULL, o->reach, &o->reach, NULL));
  PetscCall(
    PetscOptionsBool("-monolithic", "One AIJ matrix in place of a MatNest", NULL, o->monolithic, &o->monolithic, NULL));
  PetscCall(PetscOptionsBool("-fresh", "Let each step begin with a solver that knows nothing of the last one", NULL,
                             o->fresh, &o->fresh, NULL));
  PetscCall(
    PetscOptionsString("-vtu", "Write the deformed bodies to this file", NULL, "", o->vtu, sizeof(o->vtu), NULL));
  PetscCall(PetscOptionsString(
    "-pressure", "Write distance from the axis, pressure and Hertz' pressure of each node to this CSV file", NULL, "",
    o->pressure, sizeof(o->pressure), NULL));
  PetscOptionsEnd();
  PetscCheck(b.dim == 2 || b.dim == 3, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option -dim is %" PetscInt_FMT ", it must be 2 or 3", b.dim);
  for (int i = 0; i < 2; i++)
    PetscCheck(b.n[i] >= 4 && b.n[i] % 2 == 0, comm, PETSC_ERR_ARG_OUTOFRANGE,
               "Option %s is %" PetscInt_FMT ", it must be even and at least 4", i ? "-n" : "-n2", b.n[i]);
  PetscCheck(b.nu > -1 && b.nu < 0.5, comm, PETSC_ERR_ARG_OUTOFRANGE, "Option -nu is %g, it must be in (-1,0.5)",
             (double)b.nu);
  PetscCheck(b.E[0] > 0 && b.E[1] > 0 && b.radius > 0 && o->force > 0, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Options -E1, -E2, -radius and -force must be positive");
  PetscCheck(o->reach >= 4, comm, PETSC_ERR_ARG_OUTOFRANGE, "Option -reach is %g, it must be at least 4",
             (double)o->reach);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Theory TheoryOf(const BodiesOptions &b, PetscReal force)
{
  PetscReal s, open;
  Theory    t;

  t.modulus = 1 / ((1 - PetscSqr(b.nu)) * (1 / b.E[0] + 1 / b.E[1]));
  if (b.dim == 2) {
    t.radius   = std::sqrt(4 * force * b.radius / (PETSC_PI * t.modulus));
    t.pressure = 2 * force / (PETSC_PI * t.radius);
  } else {
    t.radius   = std::cbrt(3 * force * b.radius / (4 * t.modulus));
    t.pressure = 3 * force / (2 * PETSC_PI * PetscSqr(t.radius));
  }
  /* Of the distance of the two surfaces at the rim, r^2 / (2 R) less what is left of it */
  s      = PetscMax(1, b.near / t.radius);
  open   = b.dim == 2 ? (s * std::sqrt(s * s - 1) - std::acosh(s)) / 2
                      : (std::sqrt(s * s - 1) + (s * s - 2) * std::acos(1 / s)) / PETSC_PI;
  t.sink = PetscSqr(b.near) / (2 * b.radius) - open * PetscSqr(t.radius) / b.radius;
  return t;
}

static PetscReal PressureOf(const Theory &t, PetscReal r)
{
  return r < t.radius ? t.pressure * std::sqrt(1 - PetscSqr(r / t.radius)) : 0;
}

static PetscReal Distance(const ContactNode &node, PetscInt dim)
{
  return dim == 2 ? PetscAbsReal(node.x[0]) : std::hypot(node.x[0], node.x[1]);
}

/* The radius from the second moment of the pressure, which knows of all nodes, not of the last one only */
static PetscErrorCode Look(const Hertz &h, Vec X, Vec F, Found *found)
{
  const BodiesOptions &o      = h.options.bodies;
  PetscReal            sum[3] = {0, 0, 0}, squares[2] = {0, 0};
  const PetscScalar   *x, *f;
  Theory               t;

  PetscFunctionBeginUser;
  found->pressure = 0;
  found->sink     = 0;
  PetscCall(VecGetArrayRead(X, &x));
  PetscCall(VecGetArrayRead(F, &f));
  for (const ContactNode &node : h.bodies.node) {
    const PetscReal force = PetscRealPart(x[node.row]);

    sum[0] += force;
    sum[1] += force * PetscSqr(Distance(node, o.dim));
    sum[2] += force > 0;
    found->pressure = PetscMax(found->pressure, force / node.area);
    if (node.x[0] > o.near * (1 - 1e-9) && (o.dim == 2 || node.x[1] == 0))
      found->sink = node.gap - PetscRealPart(f[node.row]);
  }
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPIU_REAL, MPIU_SUM, h.bodies.scene.comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &found->pressure, 1, MPIU_REAL, MPIU_MAX, h.bodies.scene.comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &found->sink, 1, MPIU_REAL, MPIU_MAX, h.bodies.scene.comm));
  found->active = (PetscInt)(sum[2] + 0.5);
  found->force  = sum[0] * (o.dim == 2 ? 2 : 4);
  found->radius = sum[0] > 0 && sum[1] > 0 ? std::sqrt(sum[1] / sum[0] * (o.dim == 2 ? 4 : 2.5)) : 0;
  t             = TheoryOf(o, PetscMax(found->force, 0));
  for (const ContactNode &node : h.bodies.node) {
    const PetscReal exact = PressureOf(t, Distance(node, o.dim));

    squares[0] += node.area * PetscSqr(PetscRealPart(x[node.row]) / node.area - exact);
    squares[1] += node.area * PetscSqr(exact);
  }
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, squares, 2, MPIU_REAL, MPIU_SUM, h.bodies.scene.comm));
  found->distance = squares[1] > 0 ? std::sqrt(squares[0] / squares[1]) : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Monitor(SNES snes, PetscInt step, PetscReal norm, void *ctx)
{
  Hertz         *h = (Hertz *)ctx;
  PetscLogDouble now;
  PetscInt       iterations = 0;
  Found          found;
  Vec            X, F;
  KSP            ksp;

  PetscFunctionBeginUser;
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(SNESGetFunction(snes, &F, NULL, NULL));
  PetscCall(Look(*h, X, F, &found));
  PetscCall(PetscTime(&now));
  if (step) {
    PetscCall(SNESGetKSP(snes, &ksp));
    PetscCall(ReportIterations(ksp, &iterations));
    PetscCall(PetscPrintf(h->bodies.scene.comm,
                          "  step %2" PetscInt_FMT ": %5" PetscInt_FMT " rows in contact, %3" PetscInt_FMT
                          " iterations, %.2f s, force %.4e, error of radius %+.2e and pressure %+.2e, residual %.1e\n",
                          step, found.active, iterations, now - h->last, (double)found.force,
                          (double)(found.radius / TheoryOf(h->options.bodies, found.force).radius - 1),
                          (double)(found.pressure / TheoryOf(h->options.bodies, found.force).pressure - 1),
                          (double)norm));
  }
  h->last = now;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A first guess of the approach; in the plane, where it grows for ever with the size of the bodies, that of a
   half-space at this depth
*/
static PetscReal FirstApproach(const Hertz &h)
{
  const Theory &t = h.theory;

  if (h.options.bodies.dim == 3) return PetscSqr(t.radius) / h.options.bodies.radius;
  return PetscSqr(t.radius) / (4 * h.options.bodies.radius) *
         (2 * std::log(2 * h.options.reach) - h.options.bodies.nu / (1 - h.options.bodies.nu));
}

/*
   The approach at which the bodies press with the force that is wanted: the secant of log(force) over log(approach).
   Each solve starts from the last one
*/
static PetscErrorCode Press(Hertz *h, SNES snes, Vec X, PetscInt *first, PetscInt *later)
{
  PetscReal           power = h->options.bodies.dim == 3 ? 1.5 : 1.1, before[2] = {0, 0};
  SNESConvergedReason reason;
  Found               found;
  Vec                 F;

  PetscFunctionBeginUser;
  *first = *later    = 0;
  h->bodies.approach = FirstApproach(*h);
  for (int load = 0; load < 10; load++) {
    PetscInt steps;

    PetscCall(PetscPrintf(h->bodies.scene.comm, "approach %.6e\n", (double)h->bodies.approach));
    PetscCall(SNESSolve(snes, NULL, X));
    PetscCall(SNESGetConvergedReason(snes, &reason));
    PetscCall(SNESGetIterationNumber(snes, &steps));
    (load ? *later : *first) += steps;
    PetscCheck(reason > 0, h->bodies.scene.comm, PETSC_ERR_NOT_CONVERGED, "The active set was not found: %s",
               SNESConvergedReasons[reason]);
    PetscCall(SNESGetFunction(snes, &F, NULL, NULL));
    PetscCall(Look(*h, X, F, &found));
    if (PetscAbsReal(found.force / h->options.force - 1) < 1e-5) break;
    if (load) power = std::log(found.force / before[1]) / std::log(h->bodies.approach / before[0]);
    before[0] = h->bodies.approach;
    before[1] = found.force;
    h->bodies.approach *= std::pow(h->options.force / found.force, 1 / power);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of this rank after those of the others, in no order */
static PetscErrorCode WritePressure(const Hertz &h, Vec X)
{
  const PetscScalar *x;
  FILE              *out;

  PetscFunctionBeginUser;
  PetscCall(PetscFOpen(h.bodies.scene.comm, h.options.pressure, "w", &out));
  PetscCall(PetscFPrintf(h.bodies.scene.comm, out, "distance,pressure,hertz\n"));
  PetscCall(VecGetArrayRead(X, &x));
  for (const ContactNode &node : h.bodies.node) {
    const PetscReal r = Distance(node, h.options.bodies.dim);

    PetscCall(PetscSynchronizedFPrintf(h.bodies.scene.comm, out, "%.6e,%.6e,%.6e\n", (double)r,
                                       (double)(PetscRealPart(x[node.row]) / node.area),
                                       (double)PressureOf(h.theory, r)));
  }
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscCall(PetscSynchronizedFlush(h.bodies.scene.comm, out));
  PetscCall(PetscFClose(h.bodies.scene.comm, out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No bounds but 0 <= l in rows of contact */
static PetscErrorCode SetBounds(SNES snes, const Bodies &b)
{
  Vec          lower, upper;
  PetscScalar *l;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(b.gaps, &lower));
  PetscCall(VecDuplicate(b.gaps, &upper));
  PetscCall(VecSet(lower, PETSC_NINFINITY));
  PetscCall(VecSet(upper, PETSC_INFINITY));
  PetscCall(VecGetArray(lower, &l));
  for (const ContactNode &node : b.node) l[node.row] = 0;
  PetscCall(VecRestoreArray(lower, &l));
  PetscCall(SNESVISetVariableBounds(snes, lower, upper));
  PetscCall(VecDestroy(&lower));
  PetscCall(VecDestroy(&upper));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscLogDouble start, ready, end, cpu[2] = {0, 0};
  PetscInt       first, later, size, linear;
  Hertz          h = Hertz();
  Found          found;
  SNES           snes;
  Vec            X, F;
  Mat            J;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscTime(&start));
  PetscCall(OptionsGet(PETSC_COMM_WORLD, &h.options));
  h.options.bodies.near = 1.5 * TheoryOf(h.options.bodies, h.options.force).radius;
  h.options.bodies.far  = h.options.reach / 1.5 * h.options.bodies.near;
  h.theory              = TheoryOf(h.options.bodies, h.options.force);
  PetscCall(BodiesCreate(PETSC_COMM_WORLD, h.options.bodies, &h.bodies));
  J = h.bodies.J;
  PetscCall(PetscObjectReference((PetscObject)J));
  if (h.options.monolithic) {
    PetscCall(MatDestroy(&J));
    PetscCall(MatConvert(h.bodies.J, MATAIJ, MAT_INITIAL_MATRIX, &J));
  }
  PetscCall(VecDuplicate(h.bodies.gaps, &X));
  PetscCall(VecDuplicate(h.bodies.gaps, &F));
  PetscCall(VecSet(X, 0.0));
  PetscCall(SNESCreate(PETSC_COMM_WORLD, &snes));
  PetscCall(SNESSetFunction(snes, F, BodiesFunction, &h.bodies));
  PetscCall(SNESSetJacobian(snes, J, J, BodiesJacobian, &h.bodies));
  PetscCall(SetBounds(snes, h.bodies));
  PetscCall(SNESMonitorSet(snes, Monitor, &h, NULL));
  if (h.options.fresh) PetscCall(SNESSetUpdate(snes, ReportForget));
  PetscCall(SNESSetFromOptions(snes));
  cpu[0] = ReportProcessor();
  PetscCall(PetscTime(&ready));
  h.last = ready;
  PetscCall(Press(&h, snes, X, &first, &later));
  PetscCall(PetscTime(&end));
  cpu[1] = ReportProcessor();
  PetscCall(Look(h, X, F, &found));
  PetscCall(VecGetSize(X, &size));
  PetscCall(SNESGetLinearSolveIterations(snes, &linear));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "hertz: dim=%" PetscInt_FMT " n=%" PetscInt_FMT " size=%" PetscInt_FMT " active=%" PetscInt_FMT
    " steps=%" PetscInt_FMT "+%" PetscInt_FMT " force=%.6e radius=%.6e pressure=%.6e sink=%.6e approach=%.6e\n",
    h.options.bodies.dim, h.options.bodies.n[1], size, found.active, first, later, (double)found.force,
    (double)found.radius, (double)found.pressure, (double)found.sink, (double)h.bodies.approach));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "errors: radius=%+.3e pressure=%+.3e sink=%+.3e distance=%.3e assembly_s=%.2f solve_s=%.2f cpu_s=%.2f\n",
    (double)(found.radius / h.theory.radius - 1), (double)(found.pressure / h.theory.pressure - 1),
    (double)(found.sink / h.theory.sink - 1), (double)found.distance, ready - start, end - ready, cpu[1] - cpu[0]));
  if (h.options.vtu[0]) PetscCall(BodiesViewVTU(h.bodies, X, h.options.vtu));
  if (h.options.pressure[0]) PetscCall(WritePressure(h, X));
  PetscCall(SNESDestroy(&snes));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&F));
  PetscCall(MatDestroy(&J));
  PetscCall(BodiesDestroy(&h.bodies));
  PetscCall(PetscFinalize());
  return 0;
}
