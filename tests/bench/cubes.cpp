/* The two-cube problem: options, geometry, and the system as a whole */
#include "cubes.h"
#include <cmath>

/* Smooth, of absolute value at most 1, with slopes in all directions */
static PetscReal InterfaceShape(PetscReal x, PetscReal y)
{
  return std::cos(PETSC_PI * x) * std::cos(PETSC_PI * y);
}

bool CubesMesh::Fixed(PetscInt id) const
{
  const CubesBody &b = body[Body(id)];
  PetscInt         ijk[3];

  if (options.free) return false;
  b.NodeIndices(id, ijk);
  return Body(id) ? !options.floating && ijk[2] == b.n[2] : ijk[2] == 0;
}

void CubesMesh::Position(PetscInt id, PetscReal x[3]) const
{
  const int        i = Body(id);
  const CubesBody &b = body[i];
  PetscInt         ijk[3];

  b.NodeIndices(id, ijk);
  x[0] = (PetscReal)ijk[0] / b.n[0];
  x[1] = (PetscReal)ijk[1] / b.n[1];
  x[2] = options.height * ((PetscReal)ijk[2] / b.n[2] - (i ? 0 : 1));
  if (options.curved != 0)
    x[2] += options.curved * InterfaceShape(x[0], x[1]) * (1 - PetscAbsReal(x[2]) / options.height);
}

void CubesMesh::Rotate(const PetscReal x[3], PetscReal y[3]) const
{
  for (int i = 0; i < 3; i++) y[i] = rotation[i][0] * x[0] + rotation[i][1] * x[1] + rotation[i][2] * x[2];
}

/* About x, then y, then z, all fixed axes */
static void RotationFromAngles(const PetscReal degrees[3], PetscReal R[3][3])
{
  PetscReal c[3], s[3];

  for (int i = 0; i < 3; i++) {
    const PetscReal quarters = degrees[i] / 90;

    c[i] = std::cos(quarters * PETSC_PI / 2);
    s[i] = std::sin(quarters * PETSC_PI / 2);
    if (quarters == std::round(quarters)) { /* exact for right angles */
      c[i] = std::round(c[i]);
      s[i] = std::round(s[i]);
    }
  }
  R[0][0] = c[1] * c[2];
  R[0][1] = s[0] * s[1] * c[2] - c[0] * s[2];
  R[0][2] = c[0] * s[1] * c[2] + s[0] * s[2];
  R[1][0] = c[1] * s[2];
  R[1][1] = s[0] * s[1] * s[2] + c[0] * c[2];
  R[1][2] = c[0] * s[1] * s[2] - s[0] * c[2];
  R[2][0] = -s[1];
  R[2][1] = s[0] * c[1];
  R[2][2] = c[0] * c[1];
}

static PetscErrorCode CheckReal(MPI_Comm comm, const char option[], PetscReal value, bool legal, const char range[])
{
  PetscFunctionBeginUser;
  PetscCheck(legal && !PetscIsInfOrNanReal(value), comm, PETSC_ERR_ARG_OUTOFRANGE, "Option %s is %g, it must be %s",
             option, (double)value, range);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckInt(MPI_Comm comm, const char option[], PetscInt value, PetscInt lowest)
{
  PetscFunctionBeginUser;
  PetscCheck(value >= lowest, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option %s is %" PetscInt_FMT ", it must be at least %" PetscInt_FMT, option, value, lowest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckOptions(MPI_Comm comm, const CubesOptions &o)
{
  const char *const n[2] = {"-n2", "-n1"}, *const nz[2] = {"-nz2", "-nz1"}, *const E[2] = {"-E2", "-E1"},
                    *const nu[2] = {"-nu2", "-nu1"};
  const char *const        bent  = "strictly between minus and plus the value of -height, or elements turn inside out";
  double                   unknowns = 0;

  PetscFunctionBeginUser;
  PetscCall(CheckReal(comm, "-height", o.height, o.height > 0, "positive and finite"));
  for (int i = 0; i < 2; i++) {
    PetscCall(CheckInt(comm, n[i], o.n[i], 1));
    PetscCall(CheckInt(comm, nz[i], o.nz[i], 1));
    PetscCall(CheckReal(comm, E[i], o.E[i], o.E[i] > 0, "positive and finite"));
    PetscCall(CheckReal(comm, nu[i], o.nu[i], o.nu[i] > -1 && o.nu[i] < 0.5, "strictly between -1 and 0.5"));
    unknowns += 3 * (o.n[i] + 1.0) * (o.n[i] + 1.0) * (o.nz[i] + 1.0);
  }
  PetscCheck(unknowns <= (double)PETSC_MAX_INT, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Options -n1, -n2, -nz1, -nz2 ask for %.0f unknowns, more than %" PetscInt_FMT
             ", the largest integer of this PETSc; take fewer elements or 64-bit indices",
             unknowns, (PetscInt)PETSC_MAX_INT);
  PetscCall(CheckReal(comm, "-gamma", o.gamma, true, "finite"));
  PetscCall(CheckReal(comm, "-gap", o.gap, true, "finite"));
  PetscCall(CheckReal(comm, "-stick", o.stick, o.stick >= 0 && o.stick <= 1, "in [0,1]"));
  PetscCall(CheckReal(comm, "-curved", o.curved, PetscAbsReal(o.curved) < o.height, bent));
  for (int i = 0; i < 3; i++)
    PetscCall(CheckReal(comm, "-rotate", o.rotate[i], true, "three finite angles in degrees"));
  PetscCall(CheckReal(comm, "-fraction", o.fraction, o.fraction >= 0 && o.fraction <= 1, "in [0,1]"));
  PetscCall(CheckReal(comm, "-rowscale", o.rowscale, o.rowscale >= 0 && o.rowscale <= 100, "in [0,100]"));
  PetscCall(CheckInt(comm, "-duplicate", o.duplicate, 0));
  PetscCall(CheckReal(comm, "-inconsistent", o.inconsistent, true, "finite"));
  PetscCheck(o.inconsistent == 0 || o.duplicate > 0, comm, PETSC_ERR_ARG_INCOMP,
             "Option -inconsistent %g needs -duplicate: without copies no row can contradict another",
             (double)o.inconsistent);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CubesOptionsGet(MPI_Comm comm, CubesOptions *o)
{
  const char *const partitions[] = {"volume", "contact"};
  PetscInt          angles       = 3;
  PetscBool         rotate;

  PetscFunctionBeginUser;
  *o       = CubesOptions();
  o->n[0]  = 14;
  o->n[1]  = 16;
  o->E[0]  = 10;
  o->E[1]  = 1;
  o->nu[0] = o->nu[1] = 0.3;
  o->height           = 1;
  o->gamma            = 0.01;
  o->stick            = 0.5;
  o->contact          = PETSC_TRUE;
  o->fraction         = 1;
  PetscOptionsBegin(comm, NULL,
                    "Two cubes in contact (lengths in edges of the contact surface, stresses in any one unit)", NULL);
  PetscCall(PetscOptionsInt("-n1", "Upper (secondary) body: elements per edge of the contact surface", NULL, o->n[1],
                            &o->n[1], NULL));
  PetscCall(PetscOptionsInt("-n2", "Lower (primary) body: elements per edge of the contact surface", NULL, o->n[0],
                            &o->n[0], NULL));
  PetscCall(PetscOptionsReal("-height", "Height of each body [length]", NULL, o->height, &o->height, NULL));
  /* cubic elements unless told otherwise; a product out of range is caught by CheckOptions() */
  for (int i = 0; i < 2; i++) o->nz[i] = (PetscInt)PetscMax(1.0, PetscMin(std::round(o->n[i] * o->height), 1.0e9));
  PetscCall(PetscOptionsInt("-nz1", "Upper body: elements along its height (default: as cubic as can be)", NULL,
                            o->nz[1], &o->nz[1], NULL));
  PetscCall(PetscOptionsInt("-nz2", "Lower body: elements along its height (default: as cubic as can be)", NULL,
                            o->nz[0], &o->nz[0], NULL));
  PetscCall(PetscOptionsReal("-E1", "Upper body: Young's modulus [stress]", NULL, o->E[1], &o->E[1], NULL));
  PetscCall(PetscOptionsReal("-E2", "Lower body: Young's modulus [stress]", NULL, o->E[0], &o->E[0], NULL));
  PetscCall(PetscOptionsReal("-nu1", "Upper body: Poisson's ratio [-], in (-1,0.5)", NULL, o->nu[1], &o->nu[1], NULL));
  PetscCall(PetscOptionsReal("-nu2", "Lower body: Poisson's ratio [-], in (-1,0.5)", NULL, o->nu[0], &o->nu[0], NULL));
  PetscCall(PetscOptionsReal("-gamma", "How far the top is pushed down [length]", NULL, o->gamma, &o->gamma, NULL));
  PetscCall(
    PetscOptionsReal("-gap", "Distance, along the normal, that contact closes [length]", NULL, o->gap, &o->gap, NULL));
  PetscCall(PetscOptionsReal("-stick",
                             "Share of the contact surface that sticks, x < stick; the rest slips [-], in [0,1]", NULL,
                             o->stick, &o->stick, NULL));
  PetscCall(PetscOptionsRealArray("-rotate", "Turn everything about x, y, z, one after the other [degrees]", NULL,
                                  o->rotate, &angles, &rotate));
  PetscCheck(!rotate || angles == 3, comm, PETSC_ERR_ARG_SIZ,
             "Option -rotate has %" PetscInt_FMT " values, it must have three: angles in degrees about x, y, z",
             angles);
  PetscCall(PetscOptionsReal("-curved", "Amplitude of the curved contact surface [length], in (-height,height)", NULL,
                             o->curved, &o->curved, NULL));
  PetscCall(PetscOptionsBool("-floating", "Load the top of the upper body instead of moving it: contact alone holds it",
                             NULL, o->floating, &o->floating, NULL));
  PetscCall(PetscOptionsBool("-free", "Nothing holds the bodies, which is for modes", NULL, o->free, &o->free, NULL));
  PetscCall(PetscOptionsBool("-contact", "Constrain the bodies at all", NULL, o->contact, &o->contact, NULL));
  PetscCall(PetscOptionsReal("-fraction", "Share of the constraint rows that is kept, at random [-], in [0,1]", NULL,
                             o->fraction, &o->fraction, NULL));
  PetscCall(PetscOptionsInt("-duplicate", "Number of constraint rows, from the first on, that appear twice", NULL,
                            o->duplicate, &o->duplicate, NULL));
  PetscCall(PetscOptionsReal(
    "-inconsistent",
    "How much more the copies of -duplicate ask for than the originals [length]: not zero, and no solution exists",
    NULL, o->inconsistent, &o->inconsistent, NULL));
  PetscCall(PetscOptionsReal("-rowscale",
                             "Scale each constraint row by 10^u, u at random in [-rowscale,rowscale] [decades]", NULL,
                             o->rowscale, &o->rowscale, NULL));
  PetscCall(PetscOptionsInt("-seed", "Seed of -fraction and -rowscale", NULL, o->seed, &o->seed, NULL));
  PetscCall(PetscOptionsEList("-partition", "What METIS heeds: the volume meshes alone, or also which elements touch",
                              NULL, partitions, 2, partitions[o->partition], &o->partition, NULL));
  PetscCall(PetscOptionsBool("-near_nullspace", "Attach the rigid-body modes to A", NULL, o->nearNullSpace,
                             &o->nearNullSpace, NULL));
  PetscOptionsEnd();
  PetscCall(CheckOptions(comm, *o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CubesMeshCreate(MPI_Comm comm, const CubesOptions &options, CubesMesh *mesh)
{
  PetscMPIInt size;

  PetscFunctionBeginUser;
  mesh->comm    = comm;
  mesh->options = options;
  mesh->nodes = mesh->elements = 0;
  for (int i = 0; i < 2; i++) {
    CubesBody &b = mesh->body[i];

    b.n[0] = b.n[1] = options.n[i];
    b.n[2]          = options.nz[i];
    b.node          = mesh->nodes;
    b.element       = mesh->elements;
    mesh->nodes += b.Nodes();
    mesh->elements += b.Elements();
  }
  RotationFromAngles(options.rotate, mesh->rotation);
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(CubesMeshPartition(mesh, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CubesMeshGetCoordinates(const CubesMesh &mesh, Vec *coordinates)
{
  PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecCreate(mesh.comm, coordinates));
  PetscCall(VecSetSizes(*coordinates, 3 * (PetscInt)mesh.owned.size(), 3 * mesh.nodes));
  PetscCall(VecSetBlockSize(*coordinates, 3));
  PetscCall(VecSetType(*coordinates, VECSTANDARD));
  PetscCall(VecGetArrayWrite(*coordinates, &a));
  for (PetscInt node : mesh.owned) {
    PetscReal x[3], y[3];

    mesh.Position(node, x);
    mesh.Rotate(x, y);
    for (int c = 0; c < 3; c++) *a++ = y[c];
  }
  a -= 3 * mesh.owned.size();
  PetscCall(VecRestoreArrayWrite(*coordinates, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CubesSystemCreate(MPI_Comm comm, const CubesOptions &options, CubesSystem *system)
{
  PetscFunctionBeginUser;
  PetscCall(CubesMeshCreate(comm, options, &system->mesh));
  PetscCall(CubesAssembleContact(system->mesh, &system->C, &system->g)); /* the quick one first: it checks most */
  PetscCall(CubesAssembleElasticity(system->mesh, &system->A, &system->f));
  if (options.nearNullSpace) {
    Vec          coordinates;
    MatNullSpace modes;

    PetscCall(CubesMeshGetCoordinates(system->mesh, &coordinates));
    PetscCall(MatNullSpaceCreateRigidBody(coordinates, &modes));
    PetscCall(MatSetNearNullSpace(system->A, modes));
    PetscCall(MatNullSpaceDestroy(&modes));
    PetscCall(VecDestroy(&coordinates));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CubesSystemDestroy(CubesSystem *system)
{
  PetscFunctionBeginUser;
  PetscCall(MatDestroy(&system->A));
  PetscCall(MatDestroy(&system->C));
  PetscCall(VecDestroy(&system->f));
  PetscCall(VecDestroy(&system->g));
  PetscFunctionReturn(PETSC_SUCCESS);
}
