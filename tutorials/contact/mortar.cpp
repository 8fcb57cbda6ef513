static char help[] = "The contact patch test: two cubes with meshes that do not match, pressed together, have one "
                     "pressure everywhere. Mortar rows, integrals\n"
                     "over the interface, pass it; node-to-surface rows do not. Poisson's ratio is 0.\n"
                     "  -dll_append libainsworth.so -ksp_type preonly -pc_type ainsworth\n\n";

#include "../../tests/bench/cubes.h"
#include "../../tests/bench/report.h"
#include <algorithm>
#include <cmath>

/*
   Integrals over [0,1] of products of hat functions, of nodes i/n and j/m: where both are linear two Gauss points are
   exact
*/
static std::vector<std::vector<PetscReal>> Products(PetscInt n, PetscInt m)
{
  std::vector<std::vector<PetscReal>> M(n + 1, std::vector<PetscReal>(m + 1, 0));
  std::vector<PetscReal>              cut;

  for (PetscInt i = 0; i <= n; i++) cut.push_back((PetscReal)i / n);
  for (PetscInt j = 0; j <= m; j++) cut.push_back((PetscReal)j / m);
  std::sort(cut.begin(), cut.end());
  for (size_t k = 0; k + 1 < cut.size(); k++) {
    const PetscReal length = cut[k + 1] - cut[k], middle = (cut[k] + cut[k + 1]) / 2;
    const PetscInt  i = PetscMin((PetscInt)(middle * n), n - 1), j = PetscMin((PetscInt)(middle * m), m - 1);

    for (int q = -1; q <= 1 && length > 1e-14; q += 2) {
      const PetscReal x = middle + q * length / std::sqrt((PetscReal)12), s = x * n - i, t = x * m - j;

      for (int a = 0; a < 2; a++) {
        for (int b = 0; b < 2; b++) M[i + a][j + b] += length / 2 * (a ? s : 1 - s) * (b ? t : 1 - t);
      }
    }
  }
  return M;
}

/*
   int N_i (u_upper - u_lower) = 0 for the function N_i of each node of the upper surface, vertically or of all
   components: products of what there is along x and y
*/
static PetscErrorCode CreateMortar(const CubesMesh &mesh, bool tied, Mat *C)
{
  const PetscInt                            n = mesh.body[1].n[0], natives = 3 * (PetscInt)mesh.owned.size();
  const std::vector<std::vector<PetscReal>> side[2] = {Products(n, mesh.body[0].n[0]), Products(n, n)};
  std::vector<PetscInt>                     here, there, columns;
  std::vector<PetscScalar>                  values;
  PetscInt                                  row;

  PetscFunctionBeginUser;
  for (int fill = 0; fill < 2; fill++) {
    if (fill) {
      PetscCall(MatCreate(mesh.comm, C));
      PetscCall(MatSetSizes(*C, (PetscInt)here.size(), natives, PETSC_DETERMINE, 3 * mesh.nodes));
      PetscCall(MatSetType(*C, MATAIJ));
      PetscCall(MatSeqAIJSetPreallocation(*C, 0, here.data()));
      PetscCall(MatMPIAIJSetPreallocation(*C, 0, here.data(), 0, there.data()));
      PetscCall(MatGetOwnershipRange(*C, &row, NULL));
    }
    for (PetscInt s = 0; s < (n + 1) * (n + 1); s++) {
      if (!mesh.Owns(mesh.body[1].node + s)) continue;
      for (int c = tied ? 0 : 2; c < 3; c++) {
        PetscInt mine = 0;

        columns.clear();
        values.clear();
        for (int i = 0; i < 2; i++) {
          const CubesBody &b = mesh.body[i];

          for (PetscInt y = 0; y <= b.n[1]; y++) {
            for (PetscInt x = 0; x <= b.n[0]; x++) {
              const PetscReal product = side[i][s % (n + 1)][x] * side[i][s / (n + 1)][y];
              const PetscInt  node    = b.Node(x, y, i ? 0 : b.n[2]);

              if (product == 0) continue;
              columns.push_back(3 * mesh.number[node] + c);
              values.push_back(i ? product : -product);
              mine += mesh.Owns(node);
            }
          }
        }
        if (fill) {
          PetscCall(MatSetValues(*C, 1, &row, (PetscInt)columns.size(), columns.data(), values.data(), INSERT_VALUES));
          row++;
        } else {
          here.push_back(mine);
          there.push_back((PetscInt)columns.size() - mine);
        }
      }
    }
  }
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The largest distance from the exact displacement, and of the vertical forces on the lower surface from those of one
   pressure, relative
*/
static PetscErrorCode Judge(const CubesSystem &s, Mat C, const SaddleSolution &solution, PetscReal errors[2])
{
  const CubesOptions &o        = s.mesh.options;
  const PetscReal     pressure = o.gamma / (o.height / o.E[0] + o.height / o.E[1]);
  const PetscScalar  *u, *r;
  PetscReal           largest = 0;
  Vec                 force;

  PetscFunctionBeginUser;
  errors[0] = errors[1] = 0;
  PetscCall(VecDuplicate(solution.x, &force));
  PetscCall(MatMultHermitianTranspose(C, solution.lambda, force));
  PetscCall(VecGetArrayRead(solution.x, &u));
  PetscCall(VecGetArrayRead(force, &r));
  for (size_t i = 0; i < s.mesh.owned.size(); i++) {
    const PetscInt   node = s.mesh.owned[i], body = s.mesh.Body(node);
    const CubesBody &b = s.mesh.body[body];
    PetscReal        x[3], exact;
    PetscInt         ijk[3];

    s.mesh.Position(node, x);
    b.NodeIndices(node, ijk);
    exact = body ? -o.gamma + pressure / o.E[1] * (o.height - x[2]) : -pressure / o.E[0] * (o.height + x[2]);
    for (int c = 0; c < 3; c++) errors[0] = PetscMax(errors[0], PetscAbsScalar(u[3 * i + c] - (c == 2 ? exact : 0)));
    if (body || ijk[2] < b.n[2]) continue;
    PetscReal share = pressure;

    for (int d = 0; d < 2; d++) share *= (ijk[d] && ijk[d] < b.n[d] ? 1.0 : 0.5) / b.n[d];
    errors[1] = PetscMax(errors[1], PetscAbsScalar(PetscAbsScalar(r[3 * i + 2]) - share));
    largest   = PetscMax(largest, share);
  }
  PetscCall(VecRestoreArrayRead(force, &r));
  PetscCall(VecRestoreArrayRead(solution.x, &u));
  PetscCall(VecDestroy(&force));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, errors, 2, MPIU_REAL, MPIU_MAX, s.mesh.comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPIU_MAX, s.mesh.comm));
  errors[0] /= o.gamma;
  errors[1] /= largest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const char *const rows[]    = {"mortar", "node"};
  PetscInt          kind      = 0, longest, start, end;
  PetscBool         tied      = PETSC_FALSE;
  PetscReal         errors[2] = {0, 0};
  CubesOptions      options;
  CubesSystem       s;
  SaddleSolution    solution;
  Mat               C;
  Vec               g;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(CubesOptionsGet(PETSC_COMM_WORLD, &options));
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "The contact patch test", NULL);
  PetscCall(PetscOptionsEList("-rows", "Integrals over the interface, or one row for each node of the upper surface",
                              NULL, rows, 2, rows[kind], &kind, NULL));
  PetscCall(PetscOptionsBool("-tied", "All components; otherwise the vertical one", NULL, tied, &tied, NULL));
  PetscOptionsEnd();
  PetscCheck(options.gamma != 0 && options.curved == 0 && !options.floating, PETSC_COMM_WORLD, PETSC_ERR_ARG_INCOMP,
             "The patch test is of flat cubes, with a -gamma and without -floating");
  options.nu[0] = options.nu[1] = 0;
  options.stick                 = tied ? 1 : 0;
  for (PetscReal &angle : options.rotate) angle = 0;
  PetscCall(CubesSystemCreate(PETSC_COMM_WORLD, options, &s));
  if (kind == 0) PetscCall(CreateMortar(s.mesh, tied, &C));
  else {
    C = s.C;
    PetscCall(PetscObjectReference((PetscObject)C));
  }
  PetscCall(MatCreateVecs(C, NULL, &g));
  PetscCall(VecSet(g, 0.0));
  PetscCall(MatGetOwnershipRange(C, &start, &end));
  longest = 0;
  for (PetscInt row = start; row < end; row++) {
    PetscInt n;

    PetscCall(MatGetRow(C, row, &n, NULL, NULL));
    longest = PetscMax(longest, n);
    PetscCall(MatRestoreRow(C, row, &n, NULL, NULL));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &longest, 1, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(SaddleSolve({s.A, C}, s.f, g, &solution));
  PetscCall(Judge(s, C, solution, errors));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "patch: rows=%s longest=%" PetscInt_FMT " displacement=%.1e pressure=%.1e\n",
                        rows[kind], longest, (double)errors[0], (double)errors[1]));
  PetscCall(ReportSolution({s.A, C}, s.f, g, solution));
  PetscCall(SaddleSolutionDestroy(&solution));
  PetscCall(MatDestroy(&C));
  PetscCall(VecDestroy(&g));
  PetscCall(CubesSystemDestroy(&s));
  PetscCall(PetscFinalize());
  return 0;
}
