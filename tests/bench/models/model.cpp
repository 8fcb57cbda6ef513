/* The system of a model: options, A with the nodes beyond the cubes, C */
#include "model.h"

static const char *const names[] = {"ties", "cyclic", "chain", "redundant", "mortar", "mean",
                                    "rbe2", "rigid",  "rbe3",  "periodic",  "strain", "fibers"};

static PetscErrorCode OptionsGet(MPI_Comm comm, Model *model, CubesOptions *cubes)
{
  ModelOptions &o = model->options;

  PetscFunctionBeginUser;
  o          = ModelOptions();
  o.links    = 3;
  o.angle    = 30;
  o.contrast = 100;
  PetscCall(CubesOptionsGet(comm, cubes));
  PetscOptionsBegin(comm, NULL, "Constraints of engineering models, on two cubes", NULL);
  PetscCall(PetscOptionsEList("-model", "Which one", NULL, names, sizeof(names) / sizeof(names[0]), names[o.type],
                              &o.type, NULL));
  PetscCall(PetscOptionsInt(
    "-slaves", "Unknowns that constraints express by others, up to a whole row or spider (0: all there can be)", NULL,
    o.slaves, &o.slaves, NULL));
  PetscCall(PetscOptionsInt("-patch",
                            "rbe2, rigid, rbe3: nodes along the edge of the patch of a spider (0: one spider)", NULL,
                            o.patch, &o.patch, NULL));
  PetscCall(PetscOptionsInt("-links", "chain: nodes between the two that are tied", NULL, o.links, &o.links, NULL));
  PetscCall(
    PetscOptionsReal("-angle", "cyclic: rotation between the two sides [degrees]", NULL, o.angle, &o.angle, NULL));
  PetscCall(PetscOptionsReal("-spring", "Stiffness of nodes beyond the cubes against the ground", NULL, o.spring,
                             &o.spring, NULL));
  PetscCall(PetscOptionsReal("-contrast", "fibers: their modulus over that of the upper body", NULL, o.contrast,
                             &o.contrast, NULL));
  PetscOptionsEnd();
  model->name = names[o.type];
  PetscCheck(o.slaves >= 0 && o.links >= 0, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Options -slaves and -links must not be negative");
  PetscCheck(o.patch == 0 || (o.patch >= 2 && o.patch <= cubes->n[1] + 1), comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option -patch is %" PetscInt_FMT ", it must be 0 or from 2 to the %" PetscInt_FMT " nodes of an edge",
             o.patch, cubes->n[1] + 1);
  PetscCheck(cubes->n[0] == cubes->n[1], comm, PETSC_ERR_ARG_INCOMP,
             "The meshes must match, but -n1 is %" PetscInt_FMT " and -n2 is %" PetscInt_FMT, cubes->n[1], cubes->n[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of this rank beyond the cubes: all of them are on the last one */
static PetscErrorCode LocalExtra(const Model &model, PetscInt *local)
{
  PetscMPIInt rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(model.mesh.comm, &rank));
  PetscCallMPI(MPI_Comm_size(model.mesh.comm, &size));
  *local = rank == size - 1 ? (PetscInt)model.extra.size() : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ModelAssembleRows(const Model &model, bool independent, Mat *C, Vec *g)
{
  std::vector<PetscInt>    start(1, 0), columns;
  std::vector<PetscScalar> values, rhs;
  PetscInt                 n, extra;
  PetscScalar             *array;

  PetscFunctionBeginUser;
  for (const ModelRow &row : model.rows) {
    if (independent && row.dependent) continue;
    for (const auto &e : row.entries) {
      columns.push_back(e.first);
      values.push_back(e.second);
    }
    start.push_back((PetscInt)columns.size());
    rhs.push_back(row.g);
  }
  PetscCall(LocalExtra(model, &extra));
  n = 3 * (PetscInt)model.mesh.owned.size() + extra;
  PetscCall(MatCreate(model.mesh.comm, C));
  PetscCall(MatSetSizes(*C, (PetscInt)rhs.size(), n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSizes(*C, 1, 3));
  PetscCall(MatSetType(*C, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(*C, start.data(), columns.data(), values.data()));
  PetscCall(MatMPIAIJSetPreallocationCSR(*C, start.data(), columns.data(), values.data()));
  PetscCall(MatCreateVecs(*C, NULL, g));
  PetscCall(VecGetArrayWrite(*g, &array));
  PetscCall(PetscArraycpy(array, rhs.data(), rhs.size()));
  PetscCall(VecRestoreArrayWrite(*g, &array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Springs and bars beyond the cubes, all on the last rank */
static PetscErrorCode AddExtra(const Model &model, Mat A)
{
  const PetscInt first = 3 * model.mesh.nodes, n = (PetscInt)model.extra.size();

  PetscFunctionBeginUser;
  for (PetscInt k = first; k < first + n; k++) PetscCall(MatSetValue(A, k, k, model.options.spring, ADD_VALUES));
  for (const ModelBar &bar : model.bars) {
    const PetscInt    at[2] = {first + 3 * bar.node[0] + 1, first + 3 * bar.node[1] + 1};
    const PetscScalar k[4]  = {bar.stiffness, -bar.stiffness, -bar.stiffness, bar.stiffness};

    PetscCall(MatSetValues(A, 2, at, 2, at, k, ADD_VALUES));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A and f with the nodes beyond the cubes */
static PetscErrorCode Extend(const Model &model, Mat cubes, Vec load, Mat *A, Vec *f)
{
  const PetscScalar    *from;
  PetscScalar          *to;
  std::vector<PetscInt> here, there;
  PetscInt              n, extra, start, end;

  PetscFunctionBeginUser;
  PetscCall(LocalExtra(model, &extra));
  PetscCall(MatGetLocalSize(cubes, &n, NULL));
  PetscCall(MatGetOwnershipRange(cubes, &start, &end));
  for (PetscInt i = start; i < end; i++) {
    const PetscInt *columns;
    PetscInt        count, mine = 0;

    PetscCall(MatGetRow(cubes, i, &count, &columns, NULL));
    for (PetscInt k = 0; k < count; k++) mine += columns[k] >= start && columns[k] < end;
    here.push_back(mine);
    there.push_back(count - mine);
    PetscCall(MatRestoreRow(cubes, i, &count, &columns, NULL));
  }
  here.resize(n + extra, 3);
  there.resize(n + extra, 0);
  PetscCall(MatCreate(model.mesh.comm, A));
  PetscCall(MatSetSizes(*A, n + extra, n + extra, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(*A, 3));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*A, 0, here.data()));
  PetscCall(MatMPIAIJSetPreallocation(*A, 0, here.data(), 0, there.data()));
  for (PetscInt i = start; i < end; i++) {
    const PetscInt    *columns;
    const PetscScalar *values;
    PetscInt           count;

    PetscCall(MatGetRow(cubes, i, &count, &columns, &values));
    PetscCall(MatSetValues(*A, 1, &i, count, columns, values, ADD_VALUES));
    PetscCall(MatRestoreRow(cubes, i, &count, &columns, &values));
  }
  if (extra) PetscCall(AddExtra(model, *A));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  PetscCall(MatCreateVecs(*A, NULL, f));
  PetscCall(VecSet(*f, 0.0));
  PetscCall(VecGetArrayRead(load, &from));
  PetscCall(VecGetArray(*f, &to));
  PetscCall(PetscArraycpy(to, from, n));
  PetscCall(VecRestoreArray(*f, &to));
  PetscCall(VecRestoreArrayRead(load, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rigid-body modes; unknowns of rotations and strains count as displacements of their node, as many programs have it */
static PetscErrorCode AttachModes(const Model &model)
{
  const PetscScalar *from;
  PetscScalar       *to;
  PetscInt           n, extra;
  Vec                cubes, coordinates;
  MatNullSpace       modes;

  PetscFunctionBeginUser;
  PetscCall(LocalExtra(model, &extra));
  PetscCall(CubesMeshGetCoordinates(model.mesh, &cubes));
  PetscCall(VecGetLocalSize(cubes, &n));
  PetscCall(VecDuplicate(model.f, &coordinates));
  PetscCall(VecGetArrayRead(cubes, &from));
  PetscCall(VecGetArrayWrite(coordinates, &to));
  for (PetscInt i = 0; i < n + extra; i++) to[i] = i < n ? from[i] : model.extra[i - n];
  PetscCall(VecRestoreArrayWrite(coordinates, &to));
  PetscCall(VecRestoreArrayRead(cubes, &from));
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, &modes));
  PetscCall(MatSetNearNullSpace(model.A, modes));
  PetscCall(MatNullSpaceDestroy(&modes));
  PetscCall(VecDestroy(&coordinates));
  PetscCall(VecDestroy(&cubes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ModelCreate(MPI_Comm comm, Model *model)
{
  CubesOptions cubes;
  Mat          A;
  Vec          f;

  PetscFunctionBeginUser;
  PetscCall(OptionsGet(comm, model, &cubes));
  PetscCall(CubesMeshCreate(comm, cubes, &model->mesh));
  PetscCall(ModelCreateRows(model));
  PetscCall(ModelAssembleRows(*model, false, &model->C, &model->g));
  PetscCall(CubesAssembleElasticity(model->mesh, &A, &f));
  if (model->extra.size()) {
    PetscCall(Extend(*model, A, f, &model->A, &model->f));
    PetscCall(MatDestroy(&A));
    PetscCall(VecDestroy(&f));
  } else {
    model->A = A;
    model->f = f;
  }
  if (cubes.nearNullSpace) PetscCall(AttachModes(*model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ModelDestroy(Model *model)
{
  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&model->A));
  PetscCall(MatDestroy(&model->C));
  PetscCall(VecDestroy(&model->f));
  PetscCall(VecDestroy(&model->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}
