/* Which scenes there are: their defaults, their bodies and what ties these together */
#include "list.h"
#include <cmath>

/*
   cube                      unit cube, held at z = 0
   plate, shell              1 x 1 x 1/aspect, rolled up by -bend, held at x = 0; a shell has one layer
   beam                      aspect x 1 x 1, n elements across, held at x = 0
   stretched                 n x n x n flat elements aspect : aspect : 1 (-nz: more layers)
   square, beam2d            two unknowns per node, plane strain
   heat                      one unknown per node
   frame                     lattice of Euler-Bernoulli beams of slenderness aspect, six unknowns per node;
                             -ny 0 -nz 0: one line
   balls_tied, fibers_tied,
   tets                      two cubes, n and n2 elements per edge; nodes with x < -stick are tied, the others slip
   periodic                  unit cube, u+ - u- = E (x+ - x-), f = 0; fibers are endless
   three_blocks              a cube between three walls of thickness 1/aspect, which alone hold it; it slips on them
   cyclic                    sector of -angle degrees, radius 1 to 2: u2 = R u1
   plate_block, beam_tied    a plate on a block, tied, three rows per node; a beam whose end is tied to a block
   slabs                     as many slabs as aspect says, E 1, 10, 100 in turn, tied and slipping in turn
   hinged                    four stories of a frame, each hinged to the columns below: displacements are tied,
                             rotations are not
   name, element, inclusion, count, contrast, n, aspect, bend, stick
*/
const SceneKind sceneKinds[] = {
  {"cube",         SCENE_Q1, SCENE_NONE,   3, 1e6, 16, 1,   0,  1},
  {"plate",        SCENE_Q1, SCENE_NONE,   3, 1e6, 32, 50,  0,  1},
  {"shell",        SCENE_Q1, SCENE_NONE,   3, 1e6, 48, 200, 60, 1},
  {"beam",         SCENE_Q1, SCENE_NONE,   3, 1e6, 4,  50,  0,  1},
  {"stretched",    SCENE_Q1, SCENE_NONE,   3, 1e6, 16, 10,  0,  1},
  {"square",       SCENE_Q1, SCENE_NONE,   3, 1e6, 64, 1,   0,  1},
  {"beam2d",       SCENE_Q1, SCENE_NONE,   3, 1e6, 8,  100, 0,  1},
  {"heat",         SCENE_Q1, SCENE_NONE,   3, 1e6, 24, 1,   0,  1},
  {"frame",        SCENE_Q1, SCENE_NONE,   3, 1e6, 8,  50,  0,  1},
  {"balls_tied",   SCENE_Q1, SCENE_BALLS,  3, 1e4, 12, 1,   0,  1},
  {"fibers_tied",  SCENE_Q1, SCENE_FIBERS, 5, 1e4, 12, 1,   0,  1},
  {"periodic",     SCENE_Q1, SCENE_BALLS,  3, 1e3, 12, 1,   0,  1},
  {"three_blocks", SCENE_Q1, SCENE_NONE,   3, 1e4, 8,  2,   0,  0},
  {"cyclic",       SCENE_Q1, SCENE_NONE,   3, 1e4, 12, 1,   0,  1},
  {"plate_block",  SCENE_Q1, SCENE_NONE,   3, 1e4, 24, 50,  0,  1},
  {"beam_tied",    SCENE_Q1, SCENE_NONE,   3, 1e4, 3,  50,  0,  1},
  {"tets",         SCENE_P1, SCENE_NONE,   3, 1e4, 10, 1,   0,  1},
  {"slabs",        SCENE_Q1, SCENE_NONE,   3, 1e4, 18, 6,   0,  0},
  {"hinged",       SCENE_Q1, SCENE_NONE,   3, 1e4, 8,  50,  0,  1},
};
const int sceneKindCount = sizeof(sceneKinds) / sizeof(sceneKinds[0]);

static bool Is(const Scene &s, const char name[])
{
  PetscBool same = PETSC_FALSE;

  (void)PetscStrcmp(s.name, name, &same);
  return same == PETSC_TRUE;
}

/* A box of cells, with neighbors to follow; n beyond dim counts as 0 */
static SceneBody &AddBox(Scene &s, PetscInt n0, PetscInt n1, PetscInt n2, PetscReal x, PetscReal y, PetscReal z,
                         PetscReal a, PetscReal b, PetscReal c)
{
  const PetscInt  n[3]  = {n0, n1, n2};
  const PetscReal lo[3] = {x, y, z}, size[3] = {a, b, c};
  SceneBody       body = SceneBody();

  body.dim   = s.dim;
  body.order = s.options.element == SCENE_P2 ? 2 : 1;
  body.E     = 1;
  for (int d = 0; d < s.dim; d++) {
    body.n[d]    = n[d];
    body.lo[d]   = lo[d];
    body.size[d] = size[d];
  }
  s.body.push_back(body);
  return s.body.back();
}

static PetscInt Cells(PetscReal count)
{
  return PetscMax(1, (PetscInt)std::round(count));
}

static void AddTie(Scene &s, int secondary, int primary, int axis, PetscReal stick)
{
  SceneTie tie = {secondary, primary, axis, 0, stick};

  s.tie.push_back(tie);
}

/* One body, A alone */
static void SingleBody(Scene &s)
{
  const SceneOptions &o = s.options;
  const PetscInt      n = o.n, ny = o.ny >= 0 ? o.ny : n;
  const PetscReal     a = o.aspect;

  if (Is(s, "plate") || Is(s, "shell")) {
    const PetscInt nz = o.nz > 0 ? o.nz : Is(s, "shell") ? 1 : PetscMax(2, Cells(n / a));
    SceneBody     &b  = AddBox(s, n, ny, nz, 0, 0, 0, 1, 1, 1 / a);

    b.fixed[0][0] = true;
    if (o.bend != 0) {
      b.map  = SCENE_BENT;
      b.bend = o.bend * PETSC_PI / 180;
    }
  } else if (Is(s, "beam") || Is(s, "beam2d")) {
    AddBox(s, Cells(a * n), ny, o.nz > 0 ? o.nz : n, 0, 0, 0, a, 1, 1).fixed[0][0] = true;
  } else if (Is(s, "stretched")) {
    const PetscInt nz = o.nz > 0 ? o.nz : n;

    AddBox(s, n, ny, nz, 0, 0, 0, 1, 1, nz / (n * a)).fixed[2][0] = true;
  } else if (Is(s, "square")) {
    AddBox(s, n, ny, 0, 0, 0, 0, 1, 1, 0).fixed[1][0] = true;
  } else { /* cube, heat, frame; a frame may be one line of beams */
    const PetscInt nz = o.nz >= 0 ? o.nz : n;
    SceneBody     &b  = AddBox(s, n, ny, nz, 0, 0, 0, 1, ny ? 1 : 0, nz ? 1 : 0);

    b.fixed[nz ? 2 : 0][0] = true;
  }
}

static void SeveralBodies(Scene &s)
{
  const SceneOptions &o = s.options;
  const PetscInt      n = o.n, n2 = o.n2 > 0 ? o.n2 : Cells(n * 0.875);

  if (Is(s, "periodic")) {
    AddBox(s, n, n, n, 0, 0, 0, 1, 1, 1);
    s.pairs = SCENE_PERIODIC;
  } else if (Is(s, "cyclic")) { /* held at the hub */
    const PetscReal angle = o.angle * PETSC_PI / 180;
    SceneBody      &b     = AddBox(s, n, Cells(n * 1.5 * angle), Cells(n / 2.0), 1, 0, 0, 1, angle, 0.5);

    b.map         = SCENE_SECTOR;
    b.fixed[0][0] = true;
    s.pairs       = SCENE_CYCLIC;
  } else if (Is(s, "three_blocks")) { /* the cube is held by three walls, on each of which it slips */
    const PetscReal t  = 1 / o.aspect;
    const PetscInt  nt = Cells(n2 * t);

    AddBox(s, n, n, n, 0, 0, 0, 1, 1, 1).loose           = true;
    AddBox(s, nt, n2, n2, -t, 0, 0, t, 1, 1).fixed[0][0] = true;
    AddBox(s, n2, nt, n2, 0, -t, 0, 1, t, 1).fixed[1][0] = true;
    AddBox(s, n2, n2, nt, 0, 0, -t, 1, 1, t).fixed[2][0] = true;
    for (int d = 0; d < 3; d++) AddTie(s, 0, 1 + d, d, o.stick);
  } else if (Is(s, "plate_block")) {
    const PetscInt m = o.n2 > 0 ? o.n2 : Cells(n * 0.5);

    AddBox(s, m, m, Cells(m / 2.0), 0, 0, -0.5, 1, 1, 0.5).fixed[2][0]                                     = true;
    AddBox(s, n, n, o.nz > 0 ? o.nz : PetscMax(2, Cells(n / o.aspect)), 0, 0, 0, 1, 1, 1 / o.aspect).loose = true;
    AddTie(s, 1, 0, 2, o.stick);
  } else if (Is(s, "beam_tied")) {
    AddBox(s, 2 * n2, 3 * n2, 3 * n2, -2, -1, -1, 2, 3, 3).fixed[0][0]  = true;
    AddBox(s, Cells(n * o.aspect), n, n, 0, 0, 0, o.aspect, 1, 1).loose = true;
    AddTie(s, 1, 0, 0, o.stick);
  } else if (Is(s, "hinged")) { /* storeys of a frame, each on the columns of the one below */
    const int storeys = 4;

    for (int i = 0; i < storeys; i++) {
      AddBox(s, n, n, Cells((PetscReal)n / storeys), 0, 0, (PetscReal)i / storeys, 1, 1, 1.0 / storeys)
        .fixed[2][0]      = i == 0;
      s.body.back().loose = i > 0;
      if (i) AddTie(s, i, i - 1, 2, 1);
    }
  } else if (Is(s, "slabs")) { /* a wall at x = 0 holds what slips */
    const int count = (int)PetscMax(2, o.aspect);

    for (int i = 0; i < count; i++) {
      const PetscInt m = i % 2 ? n2 : n;
      SceneBody     &b = AddBox(s, m, m, Cells((PetscReal)m / count), 0, 0, (PetscReal)i / count, 1, 1, 1.0 / count);

      b.E           = std::pow(10.0, i % 3);
      b.fixed[0][0] = true;
      if (i) AddTie(s, i, i - 1, 2, i % 2 ? 1 : o.stick);
    }
  } else { /* two cubes, one on the other */
    const PetscReal height = 1 / o.aspect;

    AddBox(s, n2, n2, n2, 0, 0, -height, 1, 1, height).fixed[2][0] = true;
    SceneBody &b                                                   = AddBox(s, n, n, n, 0, 0, 0, 1, 1, height);
    b.loose                                                        = o.floating == PETSC_TRUE;
    b.fixed[2][1]                                                  = !o.floating;
    AddTie(s, 1, 0, 2, o.stick);
  }
}

void SceneAddBodies(Scene &s)
{
  s.name    = sceneKinds[s.options.scene].name;
  s.dim     = Is(s, "square") || Is(s, "beam2d") ? 2 : 3;
  s.physics = Is(s, "heat") ? SCENE_HEAT : Is(s, "frame") || Is(s, "hinged") ? SCENE_BEAMS : SCENE_ELASTIC;
  s.bs      = s.physics == SCENE_HEAT ? 1 : s.physics == SCENE_BEAMS ? 6 : s.dim;
  s.pairs   = SCENE_NO_PAIRS;
  s.body.clear();
  s.tie.clear();
  if (s.options.scene < SCENE_FIRST_TIED) SingleBody(s);
  else SeveralBodies(s);
  s.nodes = s.cells = 0;
  for (SceneBody &b : s.body) {
    b.node = s.nodes;
    b.cell = s.cells;
    s.nodes += b.Nodes();
    s.cells += b.Cells();
  }
}
