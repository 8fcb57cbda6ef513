static char help[] = "Coulomb's friction between two cubes: the upper one is pushed down and to the side. Newton's "
                     "method for the semismooth equations of stick,\n"
                     "slip and gap; each step is a saddle point [A B'; C* -D] that is not symmetric where nodes slip, "
                     "solved as the options say:\n"
                     "  -dll_append libainsworth.so -ksp_type preonly -pc_type ainsworth\n\n";

#include "../../tests/bench/cubes.h"
#include "../../tests/bench/report.h"
#include <petscsnes.h>
#include <cmath>

enum State {
  OPEN,
  STICK,
  SLIP
};

/* Forces l and distances d of a node, and the state that they mean */
struct Node {
  /* t: direction of l_t + stiffness d_t; share: of the largest friction in the size of that */
  PetscReal l[3], d[3], t[2], pressure, share;
  State     state;
};

/*
   Of a node of the upper body: o = C_z u - down, the opening, and s = C_t u + aside, how far it slid. The multipliers l
   are the forces on the lower body: o >= 0, l_z <= 0, o l_z = 0; |l_t| <= -mu l_z, and s points along l_t where there
   is equality, or is zero
*/
struct Friction {
  CubesSystem       system;
  Mat               J;             /* [A B'; C* -D] */
  Vec               shift;         /* in rows of C: what the motion of the top of the upper cube adds to C u */
  PetscReal         mu, stiffness; /* a force per length, which decides on the state and not on the solution */
  PetscInt          count[3];      /* nodes of each state */
  std::vector<Node> node;          /* of this rank, when the Jacobian was made */
};

static Node NodeOf(const Friction &f, const PetscScalar *l, const PetscScalar *d)
{
  PetscReal trial[2], size;
  Node      node;

  for (int c = 0; c < 3; c++) {
    node.l[c] = PetscRealPart(l[c]);
    node.d[c] = PetscRealPart(d[c]);
  }
  for (int c = 0; c < 2; c++) trial[c] = node.l[c] + f.stiffness * node.d[c];
  size          = std::hypot(trial[0], trial[1]);
  node.pressure = PetscMax(0, -node.l[2]);
  node.share    = size > 0 ? f.mu * node.pressure / size : 1;
  node.t[0]     = size > 0 ? trial[0] / size : 1;
  node.t[1]     = size > 0 ? trial[1] / size : 0;
  node.state    = -node.l[2] - f.stiffness * node.d[2] <= 0 ? OPEN : node.share >= 1 ? STICK : SLIP;
  return node;
}

/* The three equations of a node, lengths, with the sign of [C -D]. Where it slips, along t, across t, and vertically */
static void Equations(const Friction &f, const Node &n, PetscScalar r[3])
{
  for (int c = 0; c < 3; c++) r[c] = n.state == OPEN ? -n.l[c] / f.stiffness : n.d[c];
  if (n.state != SLIP) return;
  r[0] = (f.mu * n.pressure - n.t[0] * n.l[0] - n.t[1] * n.l[1]) / f.stiffness;
  r[1] = (n.t[1] * n.l[0] - n.t[0] * n.l[1]) / (f.stiffness * PetscMax(n.share, PETSC_SMALL));
}

/*
   C* = P C, B = Q C and the diagonal of D, from blocks of three. The unknowns of the step of a node that slips are w,
   dl = Q'w:

   along t, w_0 = dl_t + mu dl_z, which its own row determines; across t, dl_z: friction follows the pressure, so that B
   is not C
*/
static void Blocks(const Friction &f, const Node &n, PetscReal P[3][3], PetscReal Q[3][3], PetscReal D[3])
{
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      Q[i][j] = i == j;
      P[i][j] = i == j && n.state != OPEN;
    }
    D[i] = n.state == OPEN ? 1 / f.stiffness : 0;
  }
  if (n.state != SLIP) return;
  for (int j = 0; j < 2; j++) {
    P[0][j] = 0;
    Q[0][j] = n.t[j];
    P[1][j] = Q[1][j] = j ? n.t[0] : -n.t[1];
    Q[2][j]           = -f.mu * n.t[j];
  }
  D[0] = 1 / f.stiffness;
  D[1] = (1 - n.share) / (f.stiffness * PetscMax(n.share, PETSC_SMALL));
}

static PetscErrorCode Distances(const Friction &f, Vec u, Vec *d)
{
  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(f.shift, d));
  PetscCall(MatMultAdd(f.system.C, u, f.shift, *d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Function(SNES, Vec X, Vec F, void *ctx)
{
  const Friction    *f = (const Friction *)ctx;
  const PetscScalar *l, *d;
  PetscScalar       *r;
  Vec                x[2], y[2], distance;
  PetscInt           rows;
  IS                 is[2];

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(f->J, is, NULL));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecGetSubVector(X, is[k], &x[k]));
    PetscCall(VecGetSubVector(F, is[k], &y[k]));
  }
  PetscCall(MatMultHermitianTranspose(f->system.C, x[1], y[0]));
  PetscCall(MatMultAdd(f->system.A, x[0], y[0], y[0]));
  PetscCall(Distances(*f, x[0], &distance));
  PetscCall(VecGetLocalSize(x[1], &rows));
  PetscCall(VecGetArrayRead(x[1], &l));
  PetscCall(VecGetArrayRead(distance, &d));
  PetscCall(VecGetArrayWrite(y[1], &r));
  for (PetscInt i = 0; i < rows; i += 3) Equations(*f, NodeOf(*f, l + i, d + i), r + i);
  PetscCall(VecRestoreArrayWrite(y[1], &r));
  PetscCall(VecRestoreArrayRead(distance, &d));
  PetscCall(VecRestoreArrayRead(x[1], &l));
  PetscCall(VecDestroy(&distance));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecRestoreSubVector(X, is[k], &x[k]));
    PetscCall(VecRestoreSubVector(F, is[k], &y[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows of a node in C*, B and -D; all three rows of C are on its rank, in the order x, y, z */
static PetscErrorCode SetRows(const Friction &f, const Node &node, PetscInt first, Mat Cs, Mat B, Mat minusD)
{
  PetscReal P[3][3], Q[3][3], D[3];

  PetscFunctionBeginUser;
  Blocks(f, node, P, Q, D);
  for (PetscInt i = 0; i < 3; i++) PetscCall(MatSetValue(minusD, first + i, first + i, -D[i], INSERT_VALUES));
  for (PetscInt j = 0; j < 3; j++) {
    std::vector<PetscScalar> values;
    const PetscScalar       *v;
    const PetscInt          *c;
    PetscInt                 n;

    PetscCall(MatGetRow(f.system.C, first + j, &n, &c, &v));
    for (PetscInt i = 0; i < 3; i++) {
      for (const auto &to : {std::make_pair(Cs, P[i][j]), std::make_pair(B, Q[i][j])}) {
        const PetscInt row = first + i;

        if (to.second == 0) continue;
        values.assign(v, v + n);
        for (PetscScalar &a : values) a *= to.second;
        PetscCall(MatSetValues(to.first, 1, &row, n, c, values.data(), INSERT_VALUES));
      }
    }
    PetscCall(MatRestoreRow(f.system.C, first + j, &n, &c, &v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From w to dl, before the step is made */
static PetscErrorCode PreCheck(SNESLineSearch, Vec, Vec Y, PetscBool *changed, void *ctx)
{
  const Friction *f = (const Friction *)ctx;
  PetscScalar    *w;
  Vec             part;
  IS              is[2];

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(f->J, is, NULL));
  PetscCall(VecGetSubVector(Y, is[1], &part));
  PetscCall(VecGetArray(part, &w));
  for (size_t i = 0; i < f->node.size(); i++) {
    PetscScalar l[3] = {0, 0, 0};
    PetscReal   P[3][3], Q[3][3], D[3];

    Blocks(*f, f->node[i], P, Q, D);
    for (int r = 0; r < 3; r++) {
      for (int c = 0; c < 3; c++) l[c] += Q[r][c] * w[3 * i + r];
    }
    for (int c = 0; c < 3; c++) w[3 * i + c] = l[c];
  }
  PetscCall(VecRestoreArray(part, &w));
  PetscCall(VecRestoreSubVector(Y, is[1], &part));
  *changed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Jacobian(SNES, Vec X, Mat J, Mat, void *ctx)
{
  Friction          *f = (Friction *)ctx;
  const PetscScalar *l, *d;
  PetscInt           start, end;
  Vec                x[2], distance;
  Mat                Cs, B, minusD;
  IS                 is[2];

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(J, is, NULL));
  PetscCall(MatNestGetSubMat(J, 1, 0, &Cs));
  PetscCall(MatNestGetSubMat(J, 0, 1, &B));
  PetscCall(PetscDefined(USE_COMPLEX) ? MatHermitianTransposeGetMat(B, &B) : MatTransposeGetMat(B, &B));
  PetscCall(MatNestGetSubMat(J, 1, 1, &minusD));
  for (int k = 0; k < 2; k++) PetscCall(VecGetSubVector(X, is[k], &x[k]));
  PetscCall(Distances(*f, x[0], &distance));
  PetscCall(MatZeroEntries(Cs));
  PetscCall(MatZeroEntries(B));
  PetscCall(VecGetOwnershipRange(x[1], &start, &end));
  PetscCall(VecGetArrayRead(x[1], &l));
  PetscCall(VecGetArrayRead(distance, &d));
  for (int k = 0; k < 3; k++) f->count[k] = 0;
  f->node.clear();
  for (PetscInt row = start; row < end; row += 3) {
    f->node.push_back(NodeOf(*f, l + row - start, d + row - start));
    PetscCall(SetRows(*f, f->node.back(), row, Cs, B, minusD));
    f->count[f->node.back().state]++;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, f->count, 3, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)J)));
  PetscCall(VecRestoreArrayRead(distance, &d));
  PetscCall(VecRestoreArrayRead(x[1], &l));
  PetscCall(VecDestroy(&distance));
  for (int k = 0; k < 2; k++) PetscCall(VecRestoreSubVector(X, is[k], &x[k]));
  for (Mat M : {Cs, B, minusD, J}) {
    PetscCall(MatAssemblyBegin(M, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(M, MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With room for three rows of C in each row */
static PetscErrorCode CreateRows(Mat C, Mat *M)
{
  const PetscInt widest = 45;
  PetscInt       m, n;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(C, &m, &n));
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)C), m, n, PETSC_DETERMINE, PETSC_DETERMINE, PetscMin(widest, n),
                         NULL, widest, NULL, M));
  PetscCall(MatSetOption(*M, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateJacobian(Friction *f)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)f->system.C);
  PetscInt m;
  Mat      blocks[4], B;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(f->system.C, &m, NULL));
  blocks[0] = f->system.A;
  PetscCall(CreateRows(f->system.C, &B));
  PetscCall(PetscDefined(USE_COMPLEX) ? MatCreateHermitianTranspose(B, &blocks[1]) : MatCreateTranspose(B, &blocks[1]));
  PetscCall(CreateRows(f->system.C, &blocks[2]));
  PetscCall(MatCreateAIJ(comm, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &blocks[3]));
  PetscCall(MatCreateNest(comm, 2, NULL, 2, NULL, blocks, &f->J));
  for (int k = 1; k < 4; k++) PetscCall(MatDestroy(&blocks[k]));
  PetscCall(MatDestroy(&B));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Monitor(SNES snes, PetscInt step, PetscReal norm, void *ctx)
{
  const Friction *f          = (const Friction *)ctx;
  PetscInt        iterations = 0;
  KSP             ksp;

  PetscFunctionBeginUser;
  if (!step) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(ReportIterations(ksp, &iterations));
  PetscCall(PetscPrintf(PetscObjectComm((PetscObject)snes),
                        "  step %2" PetscInt_FMT ": %" PetscInt_FMT " nodes stuck, %" PetscInt_FMT
                        " slipped, %" PetscInt_FMT " were open, %3" PetscInt_FMT " iterations, residual %.2e\n",
                        step, f->count[STICK], f->count[SLIP], f->count[OPEN], iterations, (double)norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Forces that the lower body feels, and by how much Coulomb's law is not met: of forces the largest violation over mu
   times the mean pressure
*/
static PetscErrorCode Judge(const Friction &f, Vec X, PetscReal force[3], PetscReal *law)
{
  const PetscScalar *l, *d;
  PetscReal          worst = 0, sum[4] = {0, 0, 0, 0};
  PetscInt           rows;
  Vec                x[2], distance;
  IS                 is[2];

  PetscFunctionBeginUser;
  PetscCall(MatNestGetISs(f.J, is, NULL));
  for (int k = 0; k < 2; k++) PetscCall(VecGetSubVector(X, is[k], &x[k]));
  PetscCall(Distances(f, x[0], &distance));
  PetscCall(VecGetLocalSize(x[1], &rows));
  PetscCall(VecGetArrayRead(x[1], &l));
  PetscCall(VecGetArrayRead(distance, &d));
  for (PetscInt i = 0; i < rows; i += 3) {
    const Node      n       = NodeOf(f, l + i, d + i);
    const PetscReal tangent = std::hypot(n.l[0], n.l[1]), slid = std::hypot(n.d[0], n.d[1]), most = f.mu * n.pressure;

    worst = PetscMax(worst, PetscMax(n.l[2], PetscMax(-f.stiffness * n.d[2], tangent - most)));
    worst = PetscMax(worst, PetscMin(n.pressure, f.stiffness * PetscAbsReal(n.d[2])));
    worst = PetscMax(worst, PetscMin(most - tangent, f.stiffness * slid)); /* it slid: all of the friction */
    if (slid > 0 && tangent > 0)
      worst = PetscMax(
        worst, PetscMin(f.stiffness * slid, tangent * (1 - (n.l[0] * n.d[0] + n.l[1] * n.d[1]) / (slid * tangent))));
    for (int c = 0; c < 3; c++) sum[c] += n.l[c];
    sum[3]++;
  }
  PetscCall(VecRestoreArrayRead(distance, &d));
  PetscCall(VecRestoreArrayRead(x[1], &l));
  PetscCall(VecDestroy(&distance));
  for (int k = 0; k < 2; k++) PetscCall(VecRestoreSubVector(X, is[k], &x[k]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 4, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)X)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)X)));
  for (int c = 0; c < 3; c++) force[c] = sum[c];
  *law = worst / PetscMax(PetscAbsReal(sum[2]) / sum[3], PETSC_SMALL);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   How far X is from the solution of the linear problem with all components tied, or the vertical ones alone, in the
   largest displacement
*/
static PetscErrorCode Compare(const Friction &f, SNES snes, Vec X, bool tied, PetscReal *distance)
{
  PetscInt    start, end, n = 0;
  PetscInt   *index;
  Mat         C, blocks[4] = {f.system.A, NULL, NULL, NULL}, K;
  Vec         g, b, y, part, u;
  IS          rows, columns, is[2], own[2];
  KSP         ksp;
  PetscReal   norm;
  const char *prefix;

  PetscFunctionBeginUser;
  PetscCall(MatGetOwnershipRange(f.system.C, &start, &end));
  PetscCall(PetscMalloc1(end - start, &index));
  for (PetscInt i = start; i < end; i++)
    if (tied || i % 3 == 2) index[n++] = i;
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)X), n, index, PETSC_OWN_POINTER, &rows));
  PetscCall(MatGetOwnershipRangeColumn(f.system.C, &start, &end));
  PetscCall(ISCreateStride(PetscObjectComm((PetscObject)X), end - start, start, 1, &columns));
  PetscCall(MatCreateSubMatrix(f.system.C, rows, columns, MAT_INITIAL_MATRIX, &C));
  PetscCall(PetscDefined(USE_COMPLEX) ? MatCreateHermitianTranspose(C, &blocks[1]) : MatCreateTranspose(C, &blocks[1]));
  blocks[2] = C;
  PetscCall(MatCreateNest(PetscObjectComm((PetscObject)X), 2, NULL, 2, NULL, blocks, &K));
  PetscCall(MatNestGetISs(K, is, NULL));
  PetscCall(MatCreateVecs(K, &y, &b));
  PetscCall(VecSet(b, 0.0));
  PetscCall(VecGetSubVector(f.shift, rows, &g));
  PetscCall(VecGetSubVector(b, is[1], &part));
  PetscCall(VecAXPY(part, -1.0, g));
  PetscCall(VecRestoreSubVector(b, is[1], &part));
  PetscCall(VecRestoreSubVector(f.shift, rows, &g));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)X), &ksp));
  PetscCall(SNESGetOptionsPrefix(snes, &prefix));
  PetscCall(KSPSetOptionsPrefix(ksp, prefix));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(MatNestGetISs(f.J, own, NULL));
  PetscCall(VecGetSubVector(X, own[0], &u));
  PetscCall(VecGetSubVector(y, is[0], &part));
  PetscCall(VecNorm(u, NORM_INFINITY, &norm));
  PetscCall(VecAXPY(part, -1.0, u));
  PetscCall(VecNorm(part, NORM_INFINITY, distance));
  *distance /= norm;
  PetscCall(VecRestoreSubVector(y, is[0], &part));
  PetscCall(VecRestoreSubVector(X, own[0], &u));
  PetscCall(KSPDestroy(&ksp));
  for (Vec *v : {&b, &y}) PetscCall(VecDestroy(v));
  for (Mat *M : {&C, &K, &blocks[1]}) PetscCall(MatDestroy(M));
  PetscCall(ISDestroy(&rows));
  PetscCall(ISDestroy(&columns));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscReal           aside = 0.002, down = 0.01, force[3] = {0, 0, 0}, law = 0, distance;
  PetscBool           tied = PETSC_FALSE, slips = PETSC_FALSE, fresh = PETSC_FALSE;
  double              cpu;
  SNESConvergedReason reason;
  SNESLineSearch      search;
  CubesOptions        options;
  PetscInt            steps, rows, linear;
  Friction            f;
  SNES                snes;
  Vec                 X, F, part;
  IS                  is[2];
  PetscScalar        *s;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(CubesOptionsGet(PETSC_COMM_WORLD, &options));
  f.mu = 0.2;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "Friction", NULL);
  PetscCall(PetscOptionsReal("-mu", "Coefficient of friction", NULL, f.mu, &f.mu, NULL));
  PetscCall(
    PetscOptionsReal("-aside", "How far the top of the upper cube moves along x [length]", NULL, aside, &aside, NULL));
  PetscCall(PetscOptionsReal("-down", "How far it moves down [length]", NULL, down, &down, NULL));
  PetscCall(PetscOptionsBool("-fresh", "Let each step begin with a solver that knows nothing of the last one", NULL,
                             fresh, &fresh, NULL));
  PetscCall(PetscOptionsBool("-compare_tied", "Compare with cubes that are glued together", NULL, tied, &tied, NULL));
  PetscCall(PetscOptionsBool("-compare_slips", "Compare with cubes that slip without friction and do not part", NULL,
                             slips, &slips, NULL));
  PetscOptionsEnd();
  PetscCheck(f.mu >= 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "Option -mu is %g, it must not be negative",
             (double)f.mu);
  options.stick = 1; /* three rows a node */
  options.gamma = 0; /* the motion of the top is a rigid one of the upper cube, which the rows see */
  f.stiffness   = PetscMin(options.E[0], options.E[1]) / options.n[1];
  PetscCall(CubesSystemCreate(PETSC_COMM_WORLD, options, &f.system));
  PetscCall(CreateJacobian(&f));
  PetscCall(VecDuplicate(f.system.g, &f.shift));
  PetscCall(VecGetLocalSize(f.shift, &rows));
  PetscCall(VecGetArrayWrite(f.shift, &s));
  for (PetscInt i = 0; i < rows; i++) s[i] = i % 3 == 0 ? aside : i % 3 == 2 ? -down : 0;
  PetscCall(VecRestoreArrayWrite(f.shift, &s));
  PetscCall(MatCreateVecs(f.J, &X, &F));
  PetscCall(VecSet(X, 0.0));
  PetscCall(MatNestGetISs(f.J, is, NULL));
  PetscCall(VecGetSubVector(X, is[1], &part)); /* a guess: all are pressed, so much that they stick */
  PetscCall(VecGetArrayWrite(part, &s));
  for (PetscInt i = 2; i < rows; i += 3)
    s[i] = -f.stiffness * PetscMax(down, 2 * PetscAbsReal(aside) / PetscMax(f.mu, 1e-6));
  PetscCall(VecRestoreArrayWrite(part, &s));
  PetscCall(VecRestoreSubVector(X, is[1], &part));
  PetscCall(SNESCreate(PETSC_COMM_WORLD, &snes));
  PetscCall(SNESSetFunction(snes, F, Function, &f));
  PetscCall(SNESSetJacobian(snes, f.J, f.J, Jacobian, &f));
  PetscCall(SNESMonitorSet(snes, Monitor, &f, NULL));
  PetscCall(SNESGetLineSearch(snes, &search)); /* full steps go in circles for some mu */
  PetscCall(SNESLineSearchSetType(search, SNESLINESEARCHSECANT));
  PetscCall(SNESLineSearchSetPreCheck(search, PreCheck, &f));
  PetscCall(SNESSetTolerances(snes, 0.0, 0.0, 1e-9, 50, PETSC_MAX_INT));
  PetscCall(SNESSetFromOptions(snes));
  if (fresh) PetscCall(SNESSetUpdate(snes, ReportForget));
  cpu = ReportProcessor();
  PetscCall(SNESSolve(snes, NULL, X));
  cpu = ReportProcessor() - cpu;
  PetscCall(SNESGetConvergedReason(snes, &reason));
  PetscCheck(reason > 0, PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED, "Newton's method failed: %s",
             SNESConvergedReasons[reason]);
  PetscCall(SNESGetIterationNumber(snes, &steps));
  PetscCall(SNESGetLinearSolveIterations(snes, &linear));
  PetscCall(Judge(f, X, force, &law));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "friction: mu=%g cpu_s=%.3f steps=%" PetscInt_FMT " stick=%" PetscInt_FMT " slip=%" PetscInt_FMT
                        " open=%" PetscInt_FMT " normal=%.8e tangential=%.8e law=%.1e\n",
                        (double)f.mu, cpu, steps, f.count[STICK], f.count[SLIP], f.count[OPEN], (double)-force[2],
                        (double)force[0], (double)law));
  for (int k = 0; k < 2; k++) {
    if (!(k ? slips : tied)) continue;
    PetscCall(Compare(f, snes, X, k == 0, &distance));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: distance=%.1e\n", k ? "slips" : "tied", (double)distance));
  }
  PetscCall(SNESDestroy(&snes));
  for (Vec *v : {&X, &F, &f.shift}) PetscCall(VecDestroy(v));
  PetscCall(MatDestroy(&f.J));
  PetscCall(CubesSystemDestroy(&f.system));
  PetscCall(PetscFinalize());
  return 0;
}
