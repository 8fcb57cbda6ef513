static char help[] = "Effective stiffness of a periodic composite of fibers: what is on opposite faces differs by the "
                     "macroscopic strain, which is unknown; a\n"
                     "macroscopic stress loads it. Compared with elimination of the rows, and with the bounds of "
                     "Voigt, Reuss and Hashin.\n"
                     "  -dll_append libainsworth.so -ksp_type preonly -pc_type ainsworth\n\n";

#include "../../tests/bench/report.h"
#include "../../tests/bench/scenes/scene.h"
#include <cmath>
#include <utility>

/* A symmetric 6 x 6 matrix for strains (xx, yy, zz, 2 yz, 2 xz, 2 xy) */
struct Stiffness {
  PetscReal a[6][6];
};

struct Cell {
  Scene     scene;
  PetscReal share;   /* of the fibers in the volume */
  Mat       A, K, C; /* of the displacements; [A 0; 0 0], with the strain; rows of periodicity */
};

/* What strain k, of size 1, does to component c at x */
static PetscReal Strained(int k, int c, const PetscReal x[3])
{
  const int other[3][2] = {
    {1, 2},
    {0, 2},
    {0, 1}
  };

  if (k < 3) return c == k ? x[k] : 0;
  for (int i = 0; i < 2; i++) {
    if (other[k - 3][i] == c) return x[other[k - 3][1 - i]] / 2;
  }
  return 0;
}

static PetscErrorCode CreateScene(MPI_Comm comm, Cell *cell)
{
  Scene    &s     = cell->scene;
  SceneBody b     = SceneBody();
  PetscReal stiff = 0;

  PetscFunctionBeginUser;
  s.comm                  = comm;
  s.options               = SceneOptions();
  s.options.n             = 12;
  s.options.count         = 1;
  s.options.contrast      = 20;
  s.options.nu            = 0.3;
  s.options.inclusion     = SCENE_RODS;
  s.options.element       = SCENE_Q1;
  s.options.partition     = SCENE_METIS;
  s.options.constraints   = PETSC_TRUE;
  s.options.fixed         = PETSC_TRUE;
  s.options.nearNullSpace = PETSC_TRUE;
  PetscOptionsBegin(comm, NULL, "A periodic cell with fibers along x", NULL);
  PetscCall(PetscOptionsInt("-n", "Elements per edge", NULL, s.options.n, &s.options.n, NULL));
  PetscCall(PetscOptionsInt("-count", "Fibers along y and along z", NULL, s.options.count, &s.options.count, NULL));
  PetscCall(PetscOptionsReal("-contrast", "How much stiffer the fibers are", NULL, s.options.contrast,
                             &s.options.contrast, NULL));
  PetscCall(PetscOptionsReal("-nu", "Poisson's ratio of both", NULL, s.options.nu, &s.options.nu, NULL));
  PetscOptionsEnd();
  PetscCheck(s.options.n >= 2 && s.options.count >= 1, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Options -n and -count must be at least 2 and 1");
  PetscCheck(s.options.contrast > 0 && s.options.nu > -1 && s.options.nu < 0.5, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option -contrast must be positive, and -nu in (-1,0.5)");
  s.name    = "periodic";
  s.dim     = 3;
  s.bs      = 3;
  s.physics = SCENE_ELASTIC;
  s.pairs   = SCENE_PERIODIC;
  b.dim     = 3;
  b.order   = 1;
  b.E       = 1;
  for (int d = 0; d < 3; d++) {
    b.n[d]    = s.options.n;
    b.size[d] = 1;
  }
  s.nodes = b.Nodes();
  s.cells = b.Cells();
  s.body.push_back(b);
  PetscCall(ScenePartitionNodes(&s));
  for (PetscInt e = 0; e < b.Cells(); e++) {
    const PetscInt ijk[3] = {e % b.n[0], e / b.n[0] % b.n[1], e / b.n[0] / b.n[1]};

    stiff += s.Modulus(0, ijk) != 1;
  }
  cell->share = stiff / (PetscReal)b.Cells();
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The node that this one follows */
static PetscInt Master(const Scene &s, PetscInt node)
{
  const SceneBody &b = s.body[0];
  PetscInt         ijk[3];

  b.NodeIndices(node, ijk);
  return b.Node(ijk[0] % b.n[0], ijk[1] % b.n[1], ijk[2] % b.n[2]);
}

/*
   u+ - u- - E (x+ - x-) = 0; the six strains follow the displacements of the last rank, as two nodes of three unknowns
*/
static PetscErrorCode CreateSystem(Cell *cell)
{
  const Scene                 &s = cell->scene;
  std::vector<SceneConstraint> rows;
  std::vector<PetscInt>        here, there;
  PetscInt                     n = 3 * (PetscInt)s.owned.size(), start, extra;
  PetscMPIInt                  rank, size;
  MatNullSpace                 modes, padded;
  Vec                          f;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(s.comm, &rank));
  PetscCallMPI(MPI_Comm_size(s.comm, &size));
  extra = rank == size - 1 ? 6 : 0;
  PetscCall(SceneAssemble(s, &cell->A, &f));
  PetscCall(VecDestroy(&f));
  PetscCall(MatGetOwnershipRange(cell->A, &start, NULL));
  for (int fill = 0; fill < 2; fill++) {
    if (fill) {
      here.resize(n + extra, 0);
      there.resize(n + extra, 0);
      PetscCall(MatCreate(s.comm, &cell->K));
      PetscCall(MatSetSizes(cell->K, n + extra, n + extra, 3 * s.nodes + 6, 3 * s.nodes + 6));
      PetscCall(MatSetBlockSize(cell->K, 3));
      PetscCall(MatSetType(cell->K, MATAIJ));
      PetscCall(MatSeqAIJSetPreallocation(cell->K, 0, here.data()));
      PetscCall(MatMPIAIJSetPreallocation(cell->K, 0, here.data(), 0, there.data()));
    }
    for (PetscInt i = start; i < start + n; i++) {
      const PetscScalar *v;
      const PetscInt    *c;
      PetscInt           count, mine = 0;

      PetscCall(MatGetRow(cell->A, i, &count, &c, &v));
      for (PetscInt k = 0; k < count; k++) mine += c[k] >= start && c[k] < start + n;
      if (fill) PetscCall(MatSetValues(cell->K, 1, &i, count, c, v, INSERT_VALUES));
      else {
        here.push_back(mine);
        there.push_back(count - mine);
      }
      PetscCall(MatRestoreRow(cell->A, i, &count, &c, &v));
    }
  }
  PetscCall(MatAssemblyBegin(cell->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(cell->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(cell->K, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(cell->K, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  PetscCall(SceneGetRigidModes(s, &modes));
  {
    const Vec       *v;
    std::vector<Vec> longer;
    PetscInt         count;

    PetscCall(MatNullSpaceGetVecs(modes, NULL, &count, &v));
    for (PetscInt k = 0; k < count; k++) {
      const PetscScalar *from;
      PetscScalar       *to;
      Vec                w;

      PetscCall(MatCreateVecs(cell->K, &w, NULL));
      PetscCall(VecSet(w, 0.0));
      PetscCall(VecGetArrayRead(v[k], &from));
      PetscCall(VecGetArray(w, &to));
      PetscCall(PetscArraycpy(to, from, n));
      PetscCall(VecRestoreArray(w, &to));
      PetscCall(VecRestoreArrayRead(v[k], &from));
      longer.push_back(w);
    }
    PetscCall(MatNullSpaceCreate(s.comm, PETSC_FALSE, count, longer.data(), &padded));
    for (Vec &w : longer) PetscCall(VecDestroy(&w));
  }
  PetscCall(MatSetNearNullSpace(cell->K, padded));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(MatNullSpaceDestroy(&padded));

  here.clear();
  there.clear();
  for (PetscInt node : s.owned) {
    const PetscInt master = Master(s, node);
    PetscReal      x[3], y[3];

    if (master == node) continue;
    s.Position(node, x);
    s.Position(master, y);
    for (int d = 0; d < 3; d++) x[d] -= y[d];
    for (int c = 0; c < 3; c++) {
      SceneConstraint row;

      SceneAppend(s, row, node, c, 1);
      SceneAppend(s, row, master, c, -1);
      for (int k = 0; k < 6; k++) {
        if (Strained(k, c, x) == 0) continue;
        row.columns.push_back(3 * s.nodes + k);
        row.values.push_back(-Strained(k, c, x));
      }
      rows.push_back(row);
    }
  }
  PetscCall(MatCreateAIJ(s.comm, (PetscInt)rows.size(), n + extra, PETSC_DETERMINE, 3 * s.nodes + 6, 11, NULL, 11, NULL,
                         &cell->C));
  PetscCall(MatGetOwnershipRange(cell->C, &start, NULL));
  for (const SceneConstraint &row : rows) {
    const std::vector<PetscScalar> values(row.values.begin(), row.values.end());

    PetscCall(
      MatSetValues(cell->C, 1, &start, (PetscInt)values.size(), row.columns.data(), values.data(), INSERT_VALUES));
    start++;
  }
  PetscCall(MatAssemblyBegin(cell->C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(cell->C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* By Gauss and Jordan */
static Stiffness Inverse(Stiffness m)
{
  for (int p = 0; p < 6; p++) {
    const PetscReal pivot = m.a[p][p];

    m.a[p][p] = 1;
    for (int j = 0; j < 6; j++) m.a[p][j] /= pivot;
    for (int i = 0; i < 6; i++) {
      const PetscReal factor = m.a[i][p];

      if (i == p) continue;
      m.a[i][p] = 0;
      for (int j = 0; j < 6; j++) m.a[i][j] -= factor * m.a[p][j];
    }
  }
  return m;
}

/* One stress after the other; the strains that answer are the columns of the compliance */
static PetscErrorCode ByMultipliers(const Cell &cell, Stiffness *found, PetscInt iterations[6])
{
  PetscInt  last      = 3 * cell.scene.nodes;
  Mat       blocks[4] = {cell.K, NULL, cell.C, NULL}, K;
  Stiffness compliance;
  Vec       b, y, part;
  IS        is[2];
  KSP       ksp;

  PetscFunctionBeginUser;
  PetscCall(PetscDefined(USE_COMPLEX) ? MatCreateHermitianTranspose(cell.C, &blocks[1])
                                      : MatCreateTranspose(cell.C, &blocks[1]));
  PetscCall(MatCreateNest(cell.scene.comm, 2, NULL, 2, NULL, blocks, &K));
  PetscCall(MatNestGetISs(K, is, NULL));
  PetscCall(MatCreateVecs(K, &y, &b));
  PetscCall(KSPCreate(cell.scene.comm, &ksp));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(KSPSetFromOptions(ksp));
  for (int k = 0; k < 6; k++) {
    const PetscScalar *u;
    PetscReal          strain[6] = {0, 0, 0, 0, 0, 0};
    PetscInt           start, end;

    PetscCall(VecSet(b, 0.0));
    PetscCall(VecGetSubVector(b, is[0], &part));
    PetscCall(VecGetOwnershipRange(part, &start, &end));
    if (end == last + 6) PetscCall(VecSetValue(part, last + k, 1.0, INSERT_VALUES));
    PetscCall(VecAssemblyBegin(part));
    PetscCall(VecAssemblyEnd(part));
    PetscCall(VecRestoreSubVector(b, is[0], &part));
    PetscCall(KSPSolve(ksp, b, y));
    PetscCall(ReportIterations(ksp, &iterations[k]));
    PetscCall(VecGetSubVector(y, is[0], &part));
    PetscCall(VecGetArrayRead(part, &u));
    for (int i = 0; i < 6 && end == last + 6; i++) strain[i] = PetscRealPart(u[last + i - start]);
    PetscCall(VecRestoreArrayRead(part, &u));
    PetscCall(VecRestoreSubVector(y, is[0], &part));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, strain, 6, MPIU_REAL, MPIU_SUM, cell.scene.comm));
    for (int i = 0; i < 6; i++) compliance.a[i][k] = strain[i];
  }
  *found = Inverse(compliance);
  PetscCall(KSPDestroy(&ksp));
  for (Vec *v : {&b, &y}) PetscCall(VecDestroy(v));
  for (Mat *M : {&K, &blocks[1]}) PetscCall(MatDestroy(M));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   u = T v + the linear field of a strain, v of the nodes that follow none; energies of pairs of these are the
   stiffness. Node 0 stays where it is
*/
static PetscErrorCode ByElimination(const Cell &cell, Stiffness *found)
{
  const Scene          &s = cell.scene;
  PetscInt              n = 3 * (PetscInt)s.owned.size();
  std::vector<PetscInt> idle;
  Vec                   u[6], v, r, w;
  PetscMPIInt           size;
  Mat                   T, K;
  KSP                   ksp;
  PC                    pc;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(s.comm, &size));
  PetscCall(MatCreateAIJ(s.comm, n, n, 3 * s.nodes, 3 * s.nodes, 1, NULL, 1, NULL, &T));
  for (PetscInt node : s.owned) {
    for (PetscInt c = 0; c < 3; c++) {
      PetscCall(MatSetValue(T, 3 * s.number[node] + c, 3 * s.number[Master(s, node)] + c, 1.0, INSERT_VALUES));
      if (Master(s, node) != node || node == 0) idle.push_back(3 * s.number[node] + c); /* unknowns that are none */
    }
  }
  PetscCall(MatAssemblyBegin(T, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(T, MAT_FINAL_ASSEMBLY));
  PetscCall(MatPtAP(cell.A, T, MAT_INITIAL_MATRIX, 2.0, &K));
  PetscCall(MatSetOption(K, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatShift(K, 0.0));
  PetscCall(MatZeroRowsColumns(K, (PetscInt)idle.size(), idle.data(), 1.0, NULL, NULL));
  PetscCall(KSPCreate(s.comm, &ksp));
  PetscCall(KSPSetOptionsPrefix(ksp, "elimination_"));
  PetscCall(KSPSetOperators(ksp, K, K));
  PetscCall(KSPSetErrorIfNotConverged(ksp, PETSC_TRUE));
  PetscCall(KSPSetType(ksp, size > 1 ? KSPCG : KSPPREONLY));
  PetscCall(KSPSetTolerances(ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, size > 1 ? PCJACOBI : PCCHOLESKY));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(MatCreateVecs(cell.A, &v, &r));
  PetscCall(VecDuplicate(v, &w));
  for (int k = 0; k < 6; k++) {
    PetscScalar *a;
    PetscInt     at = 0;

    PetscCall(VecDuplicate(v, &u[k]));
    PetscCall(VecGetArrayWrite(u[k], &a));
    for (PetscInt node : s.owned) {
      PetscReal x[3];

      s.Position(node, x);
      for (int c = 0; c < 3; c++) a[at++] = Strained(k, c, x);
    }
    PetscCall(VecRestoreArrayWrite(u[k], &a));
    PetscCall(MatMult(cell.A, u[k], r));
    PetscCall(MatMultTranspose(T, r, w));
    PetscCall(VecScale(w, -1.0));
    PetscCall(VecGetArray(w, &a));
    for (PetscInt i : idle) a[i - 3 * s.start] = 0.0;
    PetscCall(VecRestoreArray(w, &a));
    PetscCall(KSPSolve(ksp, w, v));
    PetscCall(MatMultAdd(T, v, u[k], u[k]));
  }
  for (int k = 0; k < 6; k++) {
    PetscScalar energy[6];

    PetscCall(MatMult(cell.A, u[k], r));
    PetscCall(VecMDot(r, 6, u, energy));
    for (int i = 0; i < 6; i++) found->a[i][k] = PetscRealPart(energy[i]);
  }
  for (Vec &field : u) PetscCall(VecDestroy(&field));
  for (Vec *x : {&v, &r, &w}) PetscCall(VecDestroy(x));
  for (Mat *M : {&T, &K}) PetscCall(MatDestroy(M));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static Stiffness Isotropic(PetscReal E, PetscReal nu)
{
  const PetscReal mu = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
  Stiffness       s;

  for (int i = 0; i < 6; i++) {
    for (int j = 0; j < 6; j++) s.a[i][j] = (i < 3 && j < 3 ? lambda : 0) + (i == j ? (i < 3 ? 2 * mu : mu) : 0);
  }
  return s;
}

static Stiffness Mix(PetscReal share, const Stiffness &fiber, const Stiffness &matrix)
{
  Stiffness s;

  for (int i = 0; i < 6; i++) {
    for (int j = 0; j < 6; j++) s.a[i][j] = share * fiber.a[i][j] + (1 - share) * matrix.a[i][j];
  }
  return s;
}

/* The smallest pivot of more - less, relative to the largest entry: negative where less is more for some strain */
static PetscReal Margin(const Stiffness &more, const Stiffness &less)
{
  PetscReal a[6][6], smallest = PETSC_MAX_REAL;

  for (int i = 0; i < 6; i++) {
    for (int j = 0; j < 6; j++) a[i][j] = (more.a[i][j] - less.a[i][j]) / more.a[0][0];
  }
  for (int p = 0; p < 6; p++) {
    smallest = PetscMin(smallest, a[p][p]);
    for (int i = p + 1; i < 6 && a[p][p] != 0; i++) {
      for (int j = p + 1; j < 6; j++) a[i][j] -= a[i][p] * a[p][j] / a[p][p];
    }
  }
  return smallest;
}

/*
   Hashin's bounds of a modulus of fibers (1979): what the softer of the phases around all gives at least, the stiffer
   at most
*/
static PetscReal Hashin(PetscReal share, PetscReal inside, PetscReal around, PetscReal resistance)
{
  return around + share / (1 / (inside - around) + (1 - share) / resistance);
}

int main(int argc, char **argv)
{
  PetscReal difference = 0, largest = 0, bound[2][2], value[2];
  PetscInt  iterations[6];
  Stiffness found, eliminated, fiber, matrix, voigt, reuss;
  Cell      cell;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(CreateScene(PETSC_COMM_WORLD, &cell));
  PetscCall(CreateSystem(&cell));
  PetscCall(ByMultipliers(cell, &found, iterations));
  PetscCall(ByElimination(cell, &eliminated));
  fiber  = Isotropic(cell.scene.options.contrast, cell.scene.options.nu);
  matrix = Isotropic(1, cell.scene.options.nu);
  voigt  = Mix(cell.share, fiber, matrix);
  reuss  = Inverse(Mix(cell.share, Inverse(fiber), Inverse(matrix)));
  for (int i = 0; i < 6; i++) {
    for (int j = 0; j < 6; j++) {
      difference = PetscMax(difference, PetscAbsReal(found.a[i][j] - eliminated.a[i][j]));
      largest    = PetscMax(largest, PetscAbsReal(eliminated.a[i][j]));
    }
  }
  for (int upper = 0; upper < 2; upper++) { /* plane bulk modulus, and shear modulus along the fibers */
    const Stiffness &in = upper ? matrix : fiber, &out = upper ? fiber : matrix;
    const PetscReal  share = upper ? 1 - cell.share : cell.share;

    bound[0][upper] = Hashin(share, in.a[1][2] + in.a[3][3], out.a[1][2] + out.a[3][3], out.a[1][2] + 2 * out.a[3][3]);
    bound[1][upper] = Hashin(share, in.a[4][4], out.a[4][4], 2 * out.a[4][4]);
  }
  for (PetscReal *b : bound) {
    if (b[0] > b[1]) std::swap(b[0], b[1]); /* the fibers are the softer phase */
  }
  value[0] = (found.a[1][1] + found.a[1][2] + found.a[2][1] + found.a[2][2]) / 4;
  value[1] = found.a[5][5];
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "stiffness:\n"));
  for (int i = 0; i < 6; i++)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %10.6f %10.6f %10.6f %10.6f %10.6f %10.6f\n", (double)found.a[i][0],
                          (double)found.a[i][1], (double)found.a[i][2], (double)found.a[i][3], (double)found.a[i][4],
                          (double)found.a[i][5]));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "cell: fibers=%.4f iterations=%" PetscInt_FMT ",%" PetscInt_FMT ",%" PetscInt_FMT
                        ",%" PetscInt_FMT ",%" PetscInt_FMT ",%" PetscInt_FMT " elimination=%.1e\n",
                        (double)cell.share, iterations[0], iterations[1], iterations[2], iterations[3], iterations[4],
                        iterations[5], (double)(difference / largest)));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD, "bounds: %s; plane bulk modulus %.6f <= %.6f <= %.6f %s; shear modulus %.6f <= %.6f <= %.6f %s\n",
    Margin(voigt, found) >= -1e-9 && Margin(found, reuss) >= -1e-9 ? "voigt and reuss met" : "NOT MET",
    (double)bound[0][0], (double)value[0], (double)bound[0][1],
    bound[0][0] <= value[0] && value[0] <= bound[0][1] ? "met" : "NOT MET", (double)bound[1][0], (double)value[1],
    (double)bound[1][1], bound[1][0] <= value[1] && value[1] <= bound[1][1] ? "met" : "NOT MET"));
  for (Mat *M : {&cell.A, &cell.K, &cell.C}) PetscCall(MatDestroy(M));
  PetscCall(PetscFinalize());
  return 0;
}
