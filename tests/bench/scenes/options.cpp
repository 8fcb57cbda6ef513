/* A scene from the options: what they are, what they may be, and the size that -unknowns asks for */
#include "list.h"

static PetscErrorCode OptionsDefaults(MPI_Comm comm, SceneOptions *o)
{
  std::vector<const char *> names;
  PetscBool                 given;

  PetscFunctionBeginUser;
  for (int i = 0; i < sceneKindCount; i++) names.push_back(sceneKinds[i].name);
  *o = SceneOptions();
  PetscOptionsBegin(comm, NULL, "Which scene", NULL);
  PetscCall(
    PetscOptionsEList("-scene", "What is built", NULL, names.data(), sceneKindCount, names[0], &o->scene, &given));
  PetscOptionsEnd();
  const SceneKind &kind = sceneKinds[o->scene];
  o->element            = kind.element;
  o->inclusion          = kind.inclusion;
  o->count              = kind.count;
  o->contrast           = kind.contrast;
  o->n                  = kind.n;
  o->aspect             = kind.aspect;
  o->bend               = kind.bend;
  o->stick              = kind.stick;
  o->ny = o->nz    = -1;
  o->nu            = 0.3;
  o->angle         = 30;
  o->constraints   = PETSC_TRUE;
  o->fixed         = PETSC_TRUE;
  o->nearNullSpace = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckInt(MPI_Comm comm, const char option[], PetscInt value, PetscInt lowest)
{
  PetscFunctionBeginUser;
  PetscCheck(value >= lowest, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option %s is %" PetscInt_FMT ", it must be at least %" PetscInt_FMT, option, value, lowest);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode CheckReal(MPI_Comm comm, const char option[], PetscReal value, bool legal, const char range[])
{
  PetscFunctionBeginUser;
  PetscCheck(legal && !PetscIsInfOrNanReal(value), comm, PETSC_ERR_ARG_OUTOFRANGE, "Option %s is %g, it must be %s",
             option, (double)value, range);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode OptionsCheck(MPI_Comm comm, const SceneOptions &o)
{
  PetscFunctionBeginUser;
  PetscCall(CheckInt(comm, "-n", o.n, 1));
  PetscCall(CheckInt(comm, "-n2", o.n2, 0));
  PetscCall(CheckInt(comm, "-unknowns", o.unknowns, 0));
  PetscCheck(o.unknowns <= PETSC_MAX_INT / 16, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option -unknowns is %" PetscInt_FMT ", it must be at most %" PetscInt_FMT, o.unknowns,
             (PetscInt)(PETSC_MAX_INT / 16));
  PetscCall(CheckInt(comm, "-count", o.count, 1));
  PetscCall(CheckReal(comm, "-contrast", o.contrast, o.contrast > 0, "positive and finite"));
  PetscCall(CheckReal(comm, "-nu", o.nu, o.nu > -1 && o.nu < 0.5, "strictly between -1 and 0.5"));
  PetscCall(CheckReal(comm, "-aspect", o.aspect, o.aspect >= 1, "at least 1"));
  PetscCall(CheckReal(comm, "-bend", o.bend, PetscAbsReal(o.bend) <= 180, "in [-180,180]"));
  PetscCall(CheckReal(comm, "-angle", o.angle, o.angle > 0 && o.angle <= 180, "in (0,180]"));
  PetscCall(CheckReal(comm, "-stick", o.stick, o.stick >= 0 && o.stick <= 1, "in [0,1]"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mesh whose number of unknowns is next to that of -unknowns */
static void ChooseSize(Scene &s)
{
  PetscInt less = 0;

  for (s.options.n = 1;; s.options.n++) {
    PetscInt unknowns;

    SceneAddBodies(s);
    unknowns = s.bs * s.nodes;
    if (unknowns >= s.options.unknowns) {
      if (less && s.options.unknowns - less < unknowns - s.options.unknowns) s.options.n--;
      break;
    }
    less = unknowns;
  }
  SceneAddBodies(s);
}

static PetscErrorCode CheckScene(const Scene &s)
{
  const SceneOptions &o        = s.options;
  double              unknowns = 0;

  PetscFunctionBeginUser;
  for (const SceneBody &b : s.body) {
    double nodes = s.bs;

    for (int d = 0; d < 3; d++) {
      nodes *= (double)b.order * b.n[d] + 1;
      PetscCheck(d >= s.dim || s.physics == SCENE_BEAMS || b.n[d] > 0, s.comm, PETSC_ERR_ARG_OUTOFRANGE,
                 "Options -ny and -nz must be positive: elements along y and z");
    }
    unknowns += nodes;
    PetscCheck(b.map == SCENE_BOX || o.element != SCENE_P2, s.comm, PETSC_ERR_SUP,
               "Scene %s is curved, option -element must be q1 or p1: P2 has its nodes on straight edges", s.name);
  }
  PetscCheck(unknowns <= (double)PETSC_MAX_INT, s.comm, PETSC_ERR_ARG_OUTOFRANGE,
             "The options ask for %.0f unknowns, more than %" PetscInt_FMT
             ", the largest integer of this PETSc; take fewer elements or 64-bit indices",
             unknowns, (PetscInt)PETSC_MAX_INT);
  PetscCheck(s.physics != SCENE_BEAMS || (o.element == SCENE_Q1 && !o.patch), s.comm, PETSC_ERR_SUP,
             "Scene frame has neither -element nor -patch");
  PetscCheck(!o.patch || !s.Constrained(), s.comm, PETSC_ERR_SUP,
             "Option -patch is for scenes of one body, or without constraints");
  PetscCheck(s.Constrained() || o.fixed == PETSC_FALSE || !s.Singular(), s.comm, PETSC_ERR_ARG_INCOMP,
             "Scene %s is held by its constraints alone: it cannot do without them", s.name);
  for (const SceneTie &t : s.tie) { /* three walls hold a body that slips, one does not */
    PetscCheck(!s.body[t.secondary].loose || t.stick > 0 || s.tie.size() > 1 || !s.Constrained(), s.comm,
               PETSC_ERR_ARG_INCOMP,
               "Nothing holds a body of scene %s that slips: take a larger -stick, or no -floating", s.name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneCreate(MPI_Comm comm, Scene *s)
{
  const char *const elements[] = {"q1", "p1", "p2"}, *const inclusions[] = {"none",   "balls",  "fibers",
                                                                            "random", "binary", "rods"},
                    *const partitions[] = {"slab", "metis"};
  SceneOptions            &o            = s->options;

  PetscFunctionBeginUser;
  s->comm = comm;
  PetscCall(OptionsDefaults(comm, &o));
  PetscOptionsBegin(comm, NULL, "The scene (defaults depend on -scene)", NULL);
  PetscCall(PetscOptionsInt("-n", "Elements per edge", NULL, o.n, &o.n, NULL));
  PetscCall(PetscOptionsInt(
    "-n2", "Elements per edge of the other bodies (default 0: seven eighths of -n, of plate_block a half)", NULL, o.n2,
    &o.n2, NULL));
  PetscCall(PetscOptionsInt("-ny", "Elements along y, of scenes of one body (default -1: as the scene has it)", NULL,
                            o.ny, &o.ny, NULL));
  PetscCall(PetscOptionsInt(
    "-nz", "Elements along z, of scenes of one body, and of the plate on its block (default -1: as the scene has it)",
    NULL, o.nz, &o.nz, NULL));
  PetscCall(PetscOptionsInt("-unknowns", "Choose -n so that there are about as many unknowns (default 0: -n)", NULL,
                            o.unknowns, &o.unknowns, NULL));
  PetscCall(PetscOptionsEList("-element", "Bilinear or trilinear, linear simplices, quadratic simplices", NULL,
                              elements, 3, elements[o.element], &o.element, NULL));
  PetscCall(PetscOptionsEList("-inclusion", "What is stiff: balls, thin fibers, each cell at random, or rods", NULL,
                              inclusions, 6, inclusions[o.inclusion], &o.inclusion, NULL));
  PetscCall(
    PetscOptionsInt("-count", "Balls or fibers along the shortest edge of a body", NULL, o.count, &o.count, NULL));
  PetscCall(PetscOptionsReal("-contrast", "How much stiffer the inclusions are, or the range of random moduli", NULL,
                             o.contrast, &o.contrast, NULL));
  PetscCall(PetscOptionsReal("-nu", "Poisson's ratio, in (-1,0.5)", NULL, o.nu, &o.nu, NULL));
  PetscCall(PetscOptionsReal(
    "-aspect",
    "Length to thickness of the plate, shell, beam, element or wall, or of each of two cubes; of slabs: how many", NULL,
    o.aspect, &o.aspect, NULL));
  PetscCall(PetscOptionsReal("-bend", "Angle about which the plate or shell is rolled up [degrees]", NULL, o.bend,
                             &o.bend, NULL));
  PetscCall(PetscOptionsReal("-angle", "Angle of the cyclic sector [degrees]", NULL, o.angle, &o.angle, NULL));
  PetscCall(PetscOptionsReal("-stick", "Share of a tied surface that sticks, x < stick; the rest slips, in [0,1]", NULL,
                             o.stick, &o.stick, NULL));
  PetscCall(PetscOptionsBool("-floating", "Of two cubes, the ties alone hold the upper one", NULL, o.floating,
                             &o.floating, NULL));
  PetscCall(PetscOptionsBool("-constraints", "Constrain the bodies at all", NULL, o.constraints, &o.constraints, NULL));
  PetscCall(PetscOptionsBool("-fixed", "Impose Dirichlet conditions at all; without them A is singular", NULL, o.fixed,
                             &o.fixed, NULL));
  PetscCall(PetscOptionsBool("-patch", "Impose a linear solution on the whole boundary, without load: the patch test",
                             NULL, o.patch, &o.patch, NULL));
  PetscCall(PetscOptionsInt("-seed", "Seed of the random moduli and of the load", NULL, o.seed, &o.seed, NULL));
  PetscCall(PetscOptionsEList("-partition", "Nodes to ranks: slabs across the longest edge, or by METIS", NULL,
                              partitions, 2, partitions[o.partition], &o.partition, NULL));
  PetscCall(PetscOptionsBool("-near_nullspace", "Attach the rigid-body modes to A", NULL, o.nearNullSpace,
                             &o.nearNullSpace, NULL));
  PetscOptionsEnd();
  PetscCall(OptionsCheck(comm, o));
  if (o.unknowns) ChooseSize(*s);
  else SceneAddBodies(*s);
  PetscCall(CheckScene(*s));
  PetscCall(ScenePartitionNodes(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
