/* Where the nodes are, which are held, what the cells are made of, and the modes that cost no energy */
#include "scene.h"
#include <array>
#include <cmath>

void SceneBody::NodeIndices(PetscInt id, PetscInt ijk[3]) const
{
  id -= node;
  ijk[0] = id % Points(0);
  ijk[1] = id / Points(0) % Points(1);
  ijk[2] = id / Points(0) / Points(1);
}

void SceneBody::BoxPosition(const PetscInt ijk[3], PetscReal x[3]) const
{
  for (int d = 0; d < 3; d++) x[d] = n[d] ? lo[d] + size[d] * ((PetscReal)ijk[d] / (order * n[d])) : lo[d];
}

/*
   Cells of one size within the inner half, then larger and larger ones: the distance from the origin, in the norm of
   the box
*/
static PetscReal Grade(const SceneBody &b, PetscReal distance)
{
  const PetscReal t = 2 * distance, beyond = PetscMax(0, t - 1);

  return b.near * (t + (b.far / b.near - 2) * beyond * beyond * beyond);
}

static PetscReal LargestEntry(const PetscReal x[3])
{
  return PetscMax(PetscAbsReal(x[0]), PetscMax(PetscAbsReal(x[1]), PetscAbsReal(x[2])));
}

void SceneBody::Unmap(const PetscReal x[3], PetscReal box[3]) const
{
  const PetscReal distance = LargestEntry(x);
  PetscReal       t        = distance / (2 * near);

  if (t > 0.5) { /* Newton's method from the side of the root where it is monotone */
    for (int step = 0; step < 100; step++) {
      const PetscReal beyond = 2 * t - 1, slope = 2 * near * (1 + 3 * (far / near - 2) * beyond * beyond),
                      change = (Grade(*this, t) - distance) / slope;

      t -= change;
      if (PetscAbsReal(change) < 1e-15) break;
    }
  }
  for (int d = 0; d < 3; d++) box[d] = distance == 0 ? 0 : x[d] * (t / distance);
}

void SceneBody::Map(const PetscReal box[3], PetscReal x[3]) const
{
  for (int d = 0; d < 3; d++) x[d] = box[d];
  if (map == SCENE_SECTOR) {
    x[0] = box[0] * std::cos(box[1]);
    x[1] = box[0] * std::sin(box[1]);
  } else if (map == SCENE_BENT) { /* the length along x stays where z is low */
    const PetscReal radius = size[0] / bend, angle = box[0] / radius;

    x[0] = (radius + box[2]) * std::sin(angle);
    x[2] = (radius + box[2]) * std::cos(angle) - radius;
  } else if (map == SCENE_GRADED) {
    const PetscReal distance = LargestEntry(box);

    for (int d = 0; d < 3 && distance > 0; d++) x[d] = box[d] * (Grade(*this, distance) / distance);
  }
}

int Scene::Body(PetscInt node) const
{
  int b = (int)body.size() - 1;

  while (node < body[b].node) b--;
  return b;
}

bool Scene::Fixed(PetscInt id) const
{
  const SceneBody &b = body[Body(id)];
  PetscInt         ijk[3];

  if (!options.fixed) return false;
  if (pairs == SCENE_PERIODIC && !options.patch) return id == 0;
  b.NodeIndices(id, ijk);
  for (int d = 0; d < dim; d++) {
    const bool low = ijk[d] == 0, high = ijk[d] == b.Points(d) - 1;

    if ((low && (b.fixed[d][0] || options.patch)) || (high && (b.fixed[d][1] || options.patch))) return true;
  }
  return false;
}

bool Scene::Singular() const
{
  if (!options.fixed) return true;
  if (options.patch) return false;
  if (pairs == SCENE_PERIODIC) return true;
  for (const SceneBody &b : body) {
    if (b.loose) return true;
  }
  return false;
}

void Scene::Position(PetscInt node, PetscReal x[3]) const
{
  const SceneBody &b = body[Body(node)];
  PetscReal        box[3];
  PetscInt         ijk[3];

  b.NodeIndices(node, ijk);
  b.BoxPosition(ijk, box);
  b.Map(box, x);
}

void Scene::Linear(const PetscReal x[3], PetscReal u[3]) const
{
  const PetscReal E[3][3] = {
    {1.0,  0.3, -0.2},
    {0.3,  0.5, 0.4 },
    {-0.2, 0.4, -0.7}
  };

  for (int c = 0; c < PetscMin(bs, 3); c++) u[c] = E[c][0] * x[0] + E[c][1] * x[1] + E[c][2] * x[2];
}

/* splitmix64 */
PetscReal SceneRandom(PetscInt seed, int stream, PetscInt which)
{
  std::uint64_t z = (std::uint64_t)seed * 0xd1342543de82ef95u + (std::uint64_t)stream * 0x2545f4914f6cdd1du;

  for (int round = 0; round < 2; round++) {
    z += 0x9e3779b97f4a7c15u + (round ? (std::uint64_t)which * 0xbf58476d1ce4e5b9u : 0u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
  }
  return (PetscReal)((z >> 11) * (1.0 / 9007199254740992.0));
}

/*
   Balls, fibers and rods are on a lattice that is as cubic as the body allows, with options.count of them along its
   shortest edge
*/
static bool Stiff(const Scene &s, const SceneBody &b, const PetscInt ijk[3])
{
  PetscReal shortest = PETSC_MAX_REAL, distance = 0, least = PETSC_MAX_REAL;
  bool      inside = true;

  for (int d = 0; d < s.dim; d++) shortest = PetscMin(shortest, b.size[d]);
  for (int d = 0; d < s.dim; d++) {
    const PetscReal wanted = PetscMax(1, std::round(b.size[d] / shortest * s.options.count));
    /* soft cells between any two fibers */
    const PetscReal many   = s.options.inclusion == SCENE_FIBERS ? PetscMin(wanted, PetscMax(1, b.n[d] / 2)) : wanted,
                    period = b.size[d] / many;
    const PetscReal middle = b.size[d] * ((ijk[d] + 0.5) / b.n[d]), which = std::floor(middle / period);

    least = PetscMin(least, period);
    if (s.options.inclusion == SCENE_RODS && d == 0) continue; /* endless along x */
    if (s.options.inclusion != SCENE_FIBERS) {
      distance += PetscSqr(middle - (which + 0.5) * period);
    } else if (d == 0) { /* fibers run along x, inside the body; in a periodic cell they are endless */
      inside = inside && (s.pairs == SCENE_PERIODIC || (middle > 0.1 * b.size[0] && middle < 0.9 * b.size[0]));
    } else { /* one cell thick */
      inside = inside && ijk[d] == (PetscInt)std::floor((which + 0.5) * period / b.size[d] * b.n[d] * (1 + 1e-12));
    }
  }
  return s.options.inclusion == SCENE_FIBERS ? inside : distance < PetscSqr(0.35 * least);
}

PetscReal Scene::Modulus(int which, const PetscInt ijk[3]) const
{
  const SceneBody &b      = body[which];
  const PetscReal  random = options.inclusion == SCENE_RANDOM || options.inclusion == SCENE_BINARY
                              ? SceneRandom(options.seed, 0, b.Cell(ijk[0], ijk[1], ijk[2]))
                              : 0;

  switch (options.inclusion) {
  case SCENE_BALLS:
  case SCENE_FIBERS:
  case SCENE_RODS:
    return b.E * (Stiff(*this, b, ijk) ? options.contrast : 1);
  case SCENE_RANDOM:
    return b.E * std::pow(options.contrast, random);
  case SCENE_BINARY:
    return b.E * (random < 0.5 ? 1 : options.contrast);
  default:
    return b.E;
  }
}

PetscErrorCode SceneGetCoordinates(const Scene &s, Vec *coordinates)
{
  PetscScalar *a;
  PetscInt     at = 0;

  PetscFunctionBeginUser;
  PetscCall(VecCreate(s.comm, coordinates));
  PetscCall(VecSetSizes(*coordinates, s.dim * (PetscInt)s.owned.size(), s.dim * s.nodes));
  PetscCall(VecSetBlockSize(*coordinates, s.dim));
  PetscCall(VecSetType(*coordinates, VECSTANDARD));
  PetscCall(VecGetArrayWrite(*coordinates, &a));
  for (PetscInt node : s.owned) {
    PetscReal x[3];

    s.Position(node, x);
    for (int c = 0; c < s.dim; c++) a[at++] = x[c];
  }
  PetscCall(VecRestoreArrayWrite(*coordinates, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of nodes with three displacements and three rotations: translations, and turns about the axes */
static PetscErrorCode BeamModes(const Scene &s, MatNullSpace *modes)
{
  std::array<Vec, 6> v;
  PetscScalar       *a;

  PetscFunctionBeginUser;
  for (int m = 0; m < 6; m++) {
    PetscInt at = 0;

    PetscCall(VecCreate(s.comm, &v[m]));
    PetscCall(VecSetSizes(v[m], 6 * (PetscInt)s.owned.size(), 6 * s.nodes));
    PetscCall(VecSetBlockSize(v[m], 6));
    PetscCall(VecSetType(v[m], VECSTANDARD));
    PetscCall(VecSet(v[m], 0.0));
    PetscCall(VecGetArray(v[m], &a));
    for (PetscInt node : s.owned) {
      PetscReal x[3];

      s.Position(node, x);
      a[at + m] = 1;
      if (m >= 3) {
        const int axis = m - 3, p = (axis + 1) % 3, q = (axis + 2) % 3;

        a[at + p] = -x[q];
        a[at + q] = x[p];
      }
      at += 6;
    }
    PetscCall(VecRestoreArray(v[m], &a));
    for (int pass = 0; pass < 2; pass++) { /* PETSC wants them orthonormal */
      for (int k = 0; k < m; k++) {
        PetscScalar dot;

        PetscCall(VecDot(v[m], v[k], &dot));
        PetscCall(VecAXPY(v[m], -dot, v[k]));
      }
    }
    PetscCall(VecNormalize(v[m], NULL));
  }
  PetscCall(MatNullSpaceCreate(s.comm, PETSC_FALSE, 6, v.data(), modes));
  for (Vec &x : v) PetscCall(VecDestroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneGetRigidModes(const Scene &s, MatNullSpace *modes)
{
  Vec coordinates;

  PetscFunctionBeginUser;
  *modes = NULL;
  if (s.physics == SCENE_HEAT) PetscFunctionReturn(PETSC_SUCCESS);
  if (s.physics == SCENE_BEAMS) {
    PetscCall(BeamModes(s, modes));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SceneGetCoordinates(s, &coordinates));
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, modes));
  PetscCall(VecDestroy(&coordinates));
  PetscFunctionReturn(PETSC_SUCCESS);
}
