/*
   Frames: a lattice of Euler-Bernoulli beams along the edges of the cells, six unknowns a node: displacements, then
   rotations
*/
#include "scene.h"

struct BeamRows : SceneRows {
  const Scene &s;

  explicit BeamRows(const Scene &scene) : s(scene) { }
  PetscErrorCode Neighbors(PetscInt node, std::vector<PetscInt> &) override;
  PetscErrorCode Compute(PetscInt node, SceneRow &) override;
};

/* The node, and those at the other end of its beams, lower one first, axis by axis; -1 where the lattice ends */
static void Ends(const SceneBody &b, PetscInt node, PetscInt ijk[3], PetscInt end[6])
{
  b.NodeIndices(node, ijk);
  for (int e = 0; e < 6; e++) {
    PetscInt at[3] = {ijk[0], ijk[1], ijk[2]};

    at[e / 2] += e % 2 ? 1 : -1;
    end[e] = at[e / 2] < 0 || at[e / 2] > b.n[e / 2] ? -1 : b.Node(at[0], at[1], at[2]);
  }
}

PetscErrorCode BeamRows::Neighbors(PetscInt node, std::vector<PetscInt> &found)
{
  PetscInt ijk[3], end[6];

  PetscFunctionBeginUser;
  Ends(s.body[s.Body(node)], node, ijk, end);
  found.assign(1, node);
  for (PetscInt e : end) {
    if (e >= 0) found.push_back(e);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A beam of length L along an axis: K holds the blocks (this end, this end) and (this end, the other); `side` is +1 if
   the other end is at the higher coordinate. A square bar whose thickness is L / aspect.
*/
static void Beam(PetscReal E, PetscReal nu, PetscReal L, PetscReal aspect, int axis, int side, PetscReal same[36],
                 PetscReal other[36])
{
  /* 0.141: torsion of a square */
  const PetscReal t = L / aspect, area = t * t, I = area * area / 12, J = 0.141 * area * area, G = E / (2 * (1 + nu));
  const PetscReal k12 = 12 * E * I / (L * L * L), k6 = 6 * E * I / (L * L) * side, k4 = 4 * E * I / L,
                  k2 = 2 * E * I / L;

  for (int e = 0; e < 36; e++) same[e] = other[e] = 0;
  same[7 * axis]        = E * area / L;
  other[7 * axis]       = -same[7 * axis];
  same[7 * (axis + 3)]  = G * J / L;
  other[7 * (axis + 3)] = -same[7 * (axis + 3)];
  for (int i = 1; i <= 2; i++) { /* a deflection v along w; the rotation about r is sign dv/dx */
    const int       v = (axis + i) % 3, r = 3 + (axis + 3 - i) % 3;
    const PetscReal sign = i == 1 ? 1 : -1;

    same[7 * v]     = k12;
    same[6 * v + r] = same[6 * r + v] = sign * k6;
    same[7 * r]                       = k4;
    other[7 * v]                      = -k12;
    other[6 * v + r]                  = sign * k6;
    other[6 * r + v]                  = -sign * k6;
    other[7 * r]                      = k2;
  }
}

PetscErrorCode BeamRows::Compute(PetscInt node, SceneRow &row)
{
  const int        body = s.Body(node);
  const SceneBody &b    = s.body[body];
  PetscInt         ijk[3], end[6];
  size_t           at = 36;

  PetscFunctionBeginUser;
  Ends(b, node, ijk, end);
  PetscCall(Neighbors(node, row.node));
  row.block.assign(36 * row.node.size(), 0);
  row.volume = 0;
  for (int e = 0; e < 6; e++) {
    const PetscInt  low[3] = {ijk[0] - (e == 0), ijk[1] - (e == 2), ijk[2] - (e == 4)};
    const PetscReal L      = b.n[e / 2] ? b.size[e / 2] / b.n[e / 2] : 0;
    PetscReal       same[36], other[36];
    PetscInt        cell[3];

    if (end[e] < 0) continue;
    /* the modulus of a cell is that of its lowest edges */
    for (int d = 0; d < 3; d++) cell[d] = PetscMin(low[d], b.CellsAlong(d) - 1);
    Beam(s.Modulus(body, cell), s.options.nu, L, s.options.aspect, e / 2, e % 2 ? 1 : -1, same, other);
    for (int k = 0; k < 36; k++) {
      row.block[k] += same[k];
      row.block[at + k] = other[k];
    }
    at += 36;
    row.volume += L / 2;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneRowsOfBeams(const Scene &s, SceneRows **rows)
{
  PetscFunctionBeginUser;
  *rows = new BeamRows(s);
  PetscFunctionReturn(PETSC_SUCCESS);
}
