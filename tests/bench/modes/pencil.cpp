#include "pencil.h"

namespace
{
/* What the second matrix is made of */
struct Bodies {
  PetscReal density[2]   = {1, 1};
  PetscReal prestress[6] = {}; /* xx, yy, zz, xy, yz, zx in the frame of the cubes */
  PetscBool prestressed  = PETSC_FALSE;
};
} // namespace

/* The mass of a pair of neighbors along one direction, of elements of length h; places from 0 to n */
static PetscReal LineMass(PetscInt i, PetscInt j, PetscInt n, PetscReal h)
{
  if (i != j) return h / 6;
  return (i == 0 || i == n ? 1 : 2) * h / 3;
}

/* The integrals of N_i' N_j' and of N_i' N_j */
static PetscReal LineStiffness(PetscInt i, PetscInt j, PetscInt n, PetscReal h)
{
  if (i != j) return -1 / h;
  return (i == 0 || i == n ? 1 : 2) / h;
}

static PetscReal LineGradient(PetscInt i, PetscInt j, PetscInt n)
{
  if (i != j) return (i - j) * 0.5;
  return i == 0 ? -0.5 : i == n ? 0.5 : 0.0;
}

/*
   The matrices of Q1 elements of a grid are products of those of its lines, the masses whatever its rotation; -curved
   is not heeded
*/
static PetscReal Entry(const Bodies &bodies, int which, const CubesBody &b, const PetscReal h[3], const PetscInt at[3],
                       const PetscInt to[3])
{
  PetscReal mass[3], stiffness[3], gradient[3], adjoint[3], sum = 0.0;

  for (int d = 0; d < 3; d++) {
    mass[d]      = LineMass(at[d], to[d], b.n[d], h[d]);
    stiffness[d] = LineStiffness(at[d], to[d], b.n[d], h[d]);
    gradient[d]  = LineGradient(at[d], to[d], b.n[d]);
    adjoint[d]   = LineGradient(to[d], at[d], b.n[d]);
  }
  if (!bodies.prestressed) return bodies.density[which] * mass[0] * mass[1] * mass[2];
  for (int d = 0; d < 3; d++) {
    const int e = (d + 1) % 3, f = (d + 2) % 3;

    sum -= bodies.prestress[d] * stiffness[d] * mass[e] * mass[f];
    sum -= bodies.prestress[3 + d] * (gradient[d] * adjoint[e] + adjoint[d] * gradient[e]) * mass[f];
  }
  return sum;
}

static PetscErrorCode AssembleMass(const Model &model, const Bodies &bodies, Mat *M)
{
  const CubesMesh &mesh = model.mesh;

  PetscFunctionBeginUser;
  PetscCall(MatDuplicate(model.A, MAT_SHARE_NONZERO_PATTERN, M));
  PetscCall(MatZeroEntries(*M));
  for (PetscInt node : mesh.owned) {
    const int        which = mesh.Body(node);
    const CubesBody &b     = mesh.body[which];
    const PetscReal  h[3]  = {1.0 / b.n[0], 1.0 / b.n[1], mesh.options.height / b.n[2]};
    PetscInt         at[3];

    if (mesh.Fixed(node)) continue;
    b.NodeIndices(node, at);
    for (int t = 0; t < 27; t++) {
      const PetscInt to[3] = {at[0] + t % 3 - 1, at[1] + t / 3 % 3 - 1, at[2] + t / 9 - 1};

      if (to[0] < 0 || to[1] < 0 || to[2] < 0 || to[0] > b.n[0] || to[1] > b.n[1] || to[2] > b.n[2]) continue;
      if (mesh.Fixed(b.Node(to[0], to[1], to[2]))) continue;
      const PetscReal entry = Entry(bodies, which, b, h, at, to);
      for (int c = 0; c < 3; c++)
        PetscCall(MatSetValue(*M, 3 * mesh.number[node] + c, 3 * mesh.number[b.Node(to[0], to[1], to[2])] + c, entry,
                              INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(*M, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*M, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CreateNests(Mat A, Mat C, Mat mass, Mat *K, Mat *M)
{
  MPI_Comm comm = PetscObjectComm((PetscObject)A);
  Mat      Ct, zero;
  PetscInt m;

  PetscFunctionBeginUser;
  PetscCall(MatHermitianTranspose(C, MAT_INITIAL_MATRIX, &Ct));
  PetscCall(MatGetLocalSize(C, &m, NULL));
  PetscCall(MatCreateAIJ(comm, m, m, PETSC_DETERMINE, PETSC_DETERMINE, 0, NULL, 0, NULL, &zero));
  PetscCall(MatAssemblyBegin(zero, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(zero, MAT_FINAL_ASSEMBLY));
  Mat blocks[] = {A, Ct, C, NULL}, masses[] = {mass, NULL, NULL, zero};
  PetscCall(MatCreateNest(comm, 2, NULL, 2, NULL, blocks, K));
  PetscCall(MatCreateNest(comm, 2, NULL, 2, NULL, masses, M));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatDestroy(&zero));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ToAIJ(Mat *nest)
{
  Mat aij;

  PetscFunctionBeginUser;
  PetscCall(MatConvert(*nest, MATAIJ, MAT_INITIAL_MATRIX, &aij));
  PetscCall(MatDestroy(nest));
  *nest = aij;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ModesPencilCreate(MPI_Comm comm, ModesPencil *p)
{
  const char *const layouts[] = {"nest", "aij", "nested_vectors"};
  PetscInt          layout = 0, components = 6;
  Bodies            bodies;
  IS                fields[2];

  PetscFunctionBeginUser;
  PetscOptionsBegin(comm, NULL, "Vibrations of a model", NULL);
  PetscCall(PetscOptionsReal("-density1", "Of the upper body", NULL, bodies.density[1], &bodies.density[1], NULL));
  PetscCall(PetscOptionsReal("-density2", "Of the lower body", NULL, bodies.density[0], &bodies.density[0], NULL));
  PetscCall(PetscOptionsEList("-layout", "Of K and M", NULL, layouts, 3, layouts[layout], &layout, NULL));
  p->swapped = PETSC_FALSE;
  PetscCall(PetscOptionsRealArray("-prestress", "Components xx, yy, zz, xy, yz, zx", NULL, bodies.prestress,
                                  &components, &bodies.prestressed));
  PetscCall(PetscOptionsBool("-swapped", "Pass M first", NULL, p->swapped, &p->swapped, NULL));
  PetscOptionsEnd();
  PetscCall(ModelCreate(comm, &p->model));
  PetscCall(AssembleMass(p->model, bodies, &p->mass));
  PetscCall(CreateNests(p->model.A, p->model.C, p->mass, &p->K, &p->M));
  PetscCall(MatNestGetISs(p->K, fields, NULL));
  PetscCall(ISDuplicate(fields[0], &p->primal));
  PetscCall(ISDuplicate(fields[1], &p->dual));
  for (Mat *mat : {&p->K, &p->M})
    if (layout == 1) PetscCall(ToAIJ(mat));
    else if (layout == 2) PetscCall(MatNestSetVecType(*mat, VECNEST));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ModesPencilSetOperators(const ModesPencil &p, EPS eps)
{
  PetscFunctionBeginUser;
  PetscCall(EPSSetOperators(eps, p.swapped ? p.M : p.K, p.swapped ? p.K : p.M));
  PetscCall(EPSSetProblemType(eps, EPS_GHEP));
  if (p.swapped) PetscCall(EPSSetWhichEigenpairs(eps, EPS_LARGEST_REAL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ModesPencilAssemble(const ModesPencil &p, Mat *K, Mat *M, PetscInt *rows)
{
  Mat C;
  Vec g;

  PetscFunctionBeginUser;
  PetscCall(ModelAssembleRows(p.model, true, &C, &g));
  PetscCall(MatGetSize(C, rows, NULL));
  PetscCall(CreateNests(p.model.A, C, p.mass, K, M));
  PetscCall(ToAIJ(K));
  PetscCall(ToAIJ(M));
  PetscCall(MatDestroy(&C));
  PetscCall(VecDestroy(&g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ModesPencilDestroy(ModesPencil *p)
{
  PetscFunctionBeginUser;
  for (Mat *A : {&p->mass, &p->K, &p->M}) PetscCall(MatDestroy(A));
  PetscCall(ISDestroy(&p->primal));
  PetscCall(ISDestroy(&p->dual));
  PetscCall(ModelDestroy(&p->model));
  PetscFunctionReturn(PETSC_SUCCESS);
}
