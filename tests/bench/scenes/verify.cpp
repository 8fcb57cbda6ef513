/* What must hold of the assembled matrices, and the solution where it is known */
#include "scene.h"
#include <functional>

/* A field given at each node, in bs components */
typedef std::function<void(PetscInt node, const PetscReal x[3], PetscReal u[6])> Field;

static PetscErrorCode Fill(const Scene &s, const Field &field, Vec v)
{
  PetscScalar *a;
  PetscInt     at = 0;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayWrite(v, &a));
  for (PetscInt node : s.owned) {
    PetscReal x[3], u[6] = {};

    s.Position(node, x);
    field(node, x, u);
    for (int c = 0; c < s.bs; c++) a[at++] = u[c];
  }
  PetscCall(VecRestoreArrayWrite(v, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u' A u */
static PetscErrorCode Energy(Mat A, Vec u, PetscReal *energy)
{
  PetscScalar dot;
  Vec         t;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(u, &t));
  PetscCall(MatMult(A, u, t));
  PetscCall(VecDot(t, u, &dot));
  *energy = PetscRealPart(dot);
  PetscCall(VecDestroy(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of a matrix on some vectors, each against the largest entry that it could give */
static PetscErrorCode LargestImage(Mat M, PetscInt count, const Vec v[], PetscReal *largest)
{
  PetscReal norm, image, length;
  Vec       t;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(M, NULL, &t));
  PetscCall(MatNorm(M, NORM_INFINITY, &norm));
  for (PetscInt i = 0; i < count; i++) {
    PetscCall(MatMult(M, v[i], t));
    PetscCall(VecNorm(t, NORM_INFINITY, &image));
    PetscCall(VecNorm(v[i], NORM_INFINITY, &length));
    *largest = PetscMax(*largest, image / (norm * length));
  }
  PetscCall(VecDestroy(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode Asymmetry(Mat A, PetscReal *asymmetry)
{
  PetscReal norm;
  Mat       T;

  PetscFunctionBeginUser;
  PetscCall(MatTranspose(A, MAT_INITIAL_MATRIX, &T));
  PetscCall(MatAXPY(T, -1.0, A, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatNorm(T, NORM_FROBENIUS, asymmetry));
  PetscCall(MatNorm(A, NORM_FROBENIUS, &norm));
  *asymmetry /= norm;
  PetscCall(MatDestroy(&T));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Of the linear field: its strain is the same everywhere, so that the energy follows from the moduli alone; boxes only
*/
static PetscReal LinearEnergy(const Scene &s)
{
  const PetscReal nu = s.options.nu, mu = 1 / (2 * (1 + nu)), lambda = nu / ((1 + nu) * (1 - 2 * nu));
  PetscReal       trace = 0, square = 0, energy = 0;

  for (int d = 0; d < s.dim; d++) {
    PetscReal x[3] = {0, 0, 0}, u[3] = {0, 0, 0};

    x[d] = 1;
    s.Linear(x, u);
    for (int c = 0; c < s.bs; c++) square += PetscSqr(u[c]);
    trace += u[PetscMin(d, s.bs - 1)];
  }
  for (size_t i = 0; i < s.body.size(); i++) {
    const SceneBody &b      = s.body[i];
    PetscReal        volume = 1;

    for (int d = 0; d < s.dim; d++) volume *= b.size[d] / b.n[d];
    for (PetscInt e = 0; e < b.Cells(); e++) {
      const PetscInt ijk[3] = {e % b.CellsAlong(0), e / b.CellsAlong(0) % b.CellsAlong(1),
                               e / b.CellsAlong(0) / b.CellsAlong(1)};

      energy += volume * s.Modulus((int)i, ijk) *
                (s.physics == SCENE_HEAT ? square : lambda * PetscSqr(trace) + 2 * mu * square);
    }
  }
  return energy;
}

/* One line of beams along x, bent both ways by x^3, pulled and twisted: Hermite's functions have it exactly */
static PetscReal LineEnergy(const Scene &s)
{
  const PetscReal t = 1 / (s.body[0].n[0] * s.options.aspect), area = t * t;

  return 2 * 12 * area * area / 12 + area + 0.141 * area * area / (2 * (1 + s.options.nu));
}

static void LineField(PetscInt, const PetscReal x[3], PetscReal u[6])
{
  u[0] = u[3] = x[0];
  u[1] = u[2] = x[0] * x[0] * x[0];
  u[5]        = 3 * x[0] * x[0];
  u[4]        = -u[5];
}

/* Of (xy, yz, xz), in the plane (xy, xy), on one unit box of one material: linear simplices do not have it */
static bool HasBilinearEnergy(const Scene &s, PetscReal *energy)
{
  const SceneBody &b  = s.body[0];
  const PetscReal  nu = s.options.nu, mu = 1 / (2 * (1 + nu)), lambda = nu / ((1 + nu) * (1 - 2 * nu));

  if (s.physics == SCENE_BEAMS || s.options.element == SCENE_P1 || s.options.inclusion != SCENE_NONE ||
      s.body.size() > 1)
    return false;
  for (int d = 0; d < s.dim; d++) {
    if (b.lo[d] != 0 || b.size[d] != 1) return false;
  }
  *energy = s.physics == SCENE_HEAT ? 2.0 / 3
            : s.dim == 2            ? lambda * 7 / 6 + 2 * mu * 5 / 4
                                    : lambda * 5 / 2 + 2 * mu * 3 / 2;
  return true;
}

static PetscErrorCode EnergyError(const Scene &s, Mat A, Vec u, PetscReal *error)
{
  const SceneBody &b    = s.body[0];
  const bool       line = s.physics == SCENE_BEAMS && !b.n[1] && !b.n[2];
  PetscReal        energy, exact;

  PetscFunctionBeginUser;
  *error = 0;
  if (b.map != SCENE_BOX || (s.physics == SCENE_BEAMS && !line)) PetscFunctionReturn(PETSC_SUCCESS);
  if (line) PetscCall(Fill(s, LineField, u));
  else
    PetscCall(Fill(
      s, [&s](PetscInt, const PetscReal x[3], PetscReal v[6]) { s.Linear(x, v); }, u));
  PetscCall(Energy(A, u, &energy));
  exact  = line ? LineEnergy(s) : LinearEnergy(s);
  *error = PetscAbsReal(energy / exact - 1);
  if (HasBilinearEnergy(s, &exact)) {
    const int third = s.dim == 2 ? 0 : 2;

    PetscCall(Fill(
      s,
      [third](PetscInt, const PetscReal x[3], PetscReal v[6]) {
        v[0] = x[0] * x[1];
        v[1] = x[1] * x[third];
        v[2] = x[0] * x[2];
      },
      u));
    PetscCall(Energy(A, u, &energy));
    *error = PetscMax(*error, PetscAbsReal(energy / exact - 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   What the constraints allow: all bodies together as one rigid body; in a sector what turns with it; in a periodic
   cell, with g, the linear field
*/
static PetscErrorCode AllowedImage(const Scene &s, Mat C, Vec g, PetscInt count, const Vec modes[], Vec u,
                                   PetscReal *largest)
{
  const Field turns[3] = {[](PetscInt, const PetscReal x[3], PetscReal v[6]) {
                            v[0] = x[0];
                            v[1] = x[1];
                          },
                          [](PetscInt, const PetscReal x[3], PetscReal v[6]) {
                            v[0] = -x[1];
                            v[1] = x[0];
                          },
                          [](PetscInt, const PetscReal[3], PetscReal v[6]) { v[2] = 1; }};
  PetscReal   norm;
  Vec         t;

  PetscFunctionBeginUser;
  if (s.pairs == SCENE_NO_PAIRS) PetscCall(LargestImage(C, count, modes, largest));
  for (int i = 0; i < 3 && s.pairs == SCENE_CYCLIC; i++) {
    PetscCall(Fill(s, turns[i], u));
    PetscCall(LargestImage(C, 1, &u, largest));
  }
  if (s.pairs == SCENE_PERIODIC) {
    PetscCall(VecDuplicate(g, &t));
    PetscCall(Fill(
      s, [&s](PetscInt, const PetscReal x[3], PetscReal v[6]) { s.Linear(x, v); }, u));
    PetscCall(MatMult(C, u, t));
    PetscCall(VecAXPY(t, -1.0, g));
    PetscCall(VecNorm(t, NORM_INFINITY, largest));
    PetscCall(VecNorm(g, NORM_INFINITY, &norm));
    *largest /= norm;
    PetscCall(VecDestroy(&t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneVerify(const Scene &s, Mat A, Mat C, Vec f, Vec g)
{
  PetscReal    asymmetry, kernel = 0, allowed = 0, error = 0, energy, stretch, norm;
  PetscInt     count = 0, m;
  const Vec   *v     = NULL;
  MatNullSpace modes;
  PetscScalar  work;
  Vec          u, t;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, &u, NULL));
  PetscCall(MatCreateVecs(C, NULL, &t));
  PetscCall(MatGetSize(C, &m, NULL));
  PetscCall(Asymmetry(A, &asymmetry));
  PetscCall(SceneGetRigidModes(s, &modes));
  if (modes) PetscCall(MatNullSpaceGetVecs(modes, NULL, &count, &v));
  if (!s.options.fixed) { /* Dirichlet rows and columns are none of the free body's */
    PetscCall(LargestImage(A, count, v, &kernel));
    if (m) PetscCall(AllowedImage(s, C, g, count, v, u, &allowed));
    if (s.physics == SCENE_HEAT) {
      PetscCall(VecSet(u, 1.0));
      PetscCall(LargestImage(A, 1, &u, &kernel));
    }
    PetscCall(EnergyError(s, A, u, &error));
  }
  PetscCall(PetscPrintf(s.comm, "verify: asymmetry=%.2e rigid=%.2e allowed=%.2e energy=%.2e\n", (double)asymmetry,
                        (double)kernel, (double)allowed, (double)error));
  /* what must not depend on the number of ranks */
  PetscCall(Fill(
    s,
    [&s](PetscInt node, const PetscReal[3], PetscReal v6[6]) {
      for (int c = 0; c < s.bs; c++) v6[c] = SceneRandom(7, 2, node * s.bs + c) - 0.5;
    },
    u));
  PetscCall(Energy(A, u, &energy));
  PetscCall(VecDot(f, u, &work));
  PetscCall(MatMult(C, u, t));
  PetscCall(VecAXPY(t, -1.0, g));
  PetscCall(VecNorm(t, NORM_2, &stretch));
  PetscCall(MatNorm(A, NORM_FROBENIUS, &norm));
  PetscCall(PetscPrintf(s.comm, "fingerprint: %.9e %.9e %.9e %.9e\n", (double)energy, (double)PetscRealPart(work),
                        (double)stretch, (double)norm));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(VecDestroy(&u));
  PetscCall(VecDestroy(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneVerifySolution(const Scene &s, Vec x)
{
  PetscReal error, norm;
  Vec       u;

  PetscFunctionBeginUser;
  if (!s.options.patch && !(s.pairs == SCENE_PERIODIC && s.Constrained() && s.options.inclusion == SCENE_NONE))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(x, &u));
  PetscCall(Fill(
    s, [&s](PetscInt, const PetscReal y[3], PetscReal v[6]) { s.Linear(y, v); }, u));
  PetscCall(VecNorm(u, NORM_INFINITY, &norm));
  PetscCall(VecAXPY(u, -1.0, x));
  PetscCall(VecNorm(u, NORM_INFINITY, &error));
  PetscCall(PetscPrintf(s.comm, "exact: error=%.2e\n", (double)(error / norm)));
  PetscCall(VecDestroy(&u));
  PetscFunctionReturn(PETSC_SUCCESS);
}
