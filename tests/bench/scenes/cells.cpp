/* The rows of a node from the cells around it */
#include "scene.h"
#include <array>
#include <cmath>
#include <map>
#include <utility>

/*
   Summed over the cells in their natural order, whatever the partition, so that A is the same to the last bit on any
   number of ranks. Nothing is sent: a rank computes all that its own nodes need. Cells of a body are all alike but for
   their modulus, if need be turned; of a curved body those of one radius are. Those of a graded body are not, and are
   kept as long as nodes of theirs may come.
*/
struct CellRows : SceneRows {
  const Scene                        &s;
  std::vector<std::vector<SceneCell>> like;   /* by body, and by cell along the radius of a curved one */
  std::map<PetscInt, SceneCell>       graded; /* by natural number */

  explicit CellRows(const Scene &scene) : s(scene) { }
  PetscErrorCode Prepare();
  PetscErrorCode Neighbors(PetscInt node, std::vector<PetscInt> &) override;
  PetscErrorCode Compute(PetscInt node, SceneRow &) override;

  /* Slots of the patch of (2p+1)^dim nodes around a node */
  std::array<PetscInt, 125>                 slot;
  std::array<std::array<PetscReal, 9>, 125> sum;

  template <class Visit>
  void             Around(PetscInt node, Visit visit) const;
  const SceneCell &Like(const SceneBody &b, const PetscInt c[3]) const;
  PetscErrorCode   Grade(PetscInt node);
};

static PetscInt Along(int local, int d, int points)
{
  return (d == 0 ? local : d == 1 ? local / points : local / points / points) % points;
}

/* The axis of a curved body along which its cells differ; 3: none */
static int Radius(const SceneBody &b)
{
  return b.map == SCENE_SECTOR ? 0 : b.map == SCENE_BENT ? 2 : 3;
}

/* The one at c, as it lies there */
static PetscErrorCode CreateCell(const Scene &s, const SceneBody &b, const PetscInt c[3], SceneCell *cell)
{
  PetscReal X[8][3];

  PetscFunctionBeginUser;
  for (int i = 0; i < 1 << s.dim; i++) {
    PetscReal box[3];
    PetscInt  ijk[3];

    for (int d = 0; d < 3; d++) ijk[d] = b.order * ((i >> d & 1) + c[d]);
    b.BoxPosition(ijk, box);
    b.Map(box, X[i]);
  }
  PetscCall(SceneCellCreate(s, b, X, cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CellRows::Prepare()
{
  PetscFunctionBeginUser;
  for (const SceneBody &b : s.body) {
    const int radius = Radius(b);

    like.emplace_back(radius < 3 ? b.n[radius] : 1);
    for (size_t c = 0; c < like.back().size(); c++) {
      PetscInt at[3] = {0, 0, 0};

      if (radius < 3) at[radius] = (PetscInt)c;
      PetscCall(CreateCell(s, b, at, &like.back()[c]));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SceneCell &CellRows::Like(const SceneBody &b, const PetscInt c[3]) const
{
  const int radius = Radius(b);

  if (b.map == SCENE_GRADED) return graded.at(b.Cell(c[0], c[1], c[2]));
  return like[&b - s.body.data()][radius < 3 ? c[radius] : 0];
}

/* The cells of a node, where they are not all alike */
PetscErrorCode CellRows::Grade(PetscInt node)
{
  const SceneBody &body = s.body[s.Body(node)];
  PetscErrorCode   ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  if (body.map != SCENE_GRADED) PetscFunctionReturn(PETSC_SUCCESS);
  Around(node, [&](const SceneBody &b, const PetscInt c[3], int, int) {
    const PetscInt cell = b.Cell(c[0], c[1], c[2]), passed = cell - 2 * b.CellsAlong(0) * b.CellsAlong(1) - 2;

    if (ierr || graded.count(cell)) return;
    graded.erase(graded.begin(), graded.lower_bound(passed));
    ierr = CreateCell(s, b, c, &graded[cell]);
  });
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   visit(cell's indices, local number of the node in it, patch slot of the cell's lowest node) for each cell of a node
*/
template <class Visit>
void CellRows::Around(PetscInt node, Visit visit) const
{
  const SceneBody &b = s.body[s.Body(node)];
  const int        p = b.order, width = 2 * p + 1;
  PetscInt         ijk[3], first[3] = {0, 0, 0}, last[3] = {0, 0, 0}, c[3];

  b.NodeIndices(node, ijk);
  for (int d = 0; d < s.dim; d++) {
    first[d] = PetscMax(0, (ijk[d] + p - 1) / p - 1);
    last[d]  = PetscMin(b.n[d] - 1, ijk[d] / p);
  }
  for (c[2] = first[2]; c[2] <= last[2]; c[2]++) {
    for (c[1] = first[1]; c[1] <= last[1]; c[1]++) {
      for (c[0] = first[0]; c[0] <= last[0]; c[0]++) {
        int local = 0, lowest = 0;

        for (int d = s.dim - 1; d >= 0; d--) {
          local  = local * (p + 1) + (int)(ijk[d] - c[d] * p);
          lowest = lowest * width + (int)(c[d] * p - ijk[d] + p);
        }
        visit(b, c, local, lowest);
      }
    }
  }
}

/* Slot of a cell's node, from that of its lowest one */
static int Slot(int dim, int p, int lowest, int local)
{
  int slot = lowest, stride = 1;

  for (int d = 0; d < dim; d++, stride *= 2 * p + 1) slot += stride * (int)Along(local, d, p + 1);
  return slot;
}

PetscErrorCode CellRows::Neighbors(PetscInt node, std::vector<PetscInt> &found)
{
  PetscFunctionBeginUser;
  PetscCall(Grade(node));
  found.clear();
  slot.fill(-1);
  Around(node, [&](const SceneBody &b, const PetscInt c[3], int a, int lowest) {
    const SceneCell &cell = Like(b, c);
    const int        p    = b.order;

    for (int k = 0; k < cell.nodes; k++) {
      PetscInt &at = slot[Slot(s.dim, p, lowest, k)];

      if (at >= 0 || !cell.joined[a * cell.nodes + k]) continue;
      at = (PetscInt)found.size();
      found.push_back(b.Node(c[0] * p + Along(k, 0, p + 1), c[1] * p + Along(k, 1, p + 1),
                             s.dim < 3 ? 0 : c[2] * p + Along(k, 2, p + 1)));
    }
  });
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   R K R', computed so that the block of the other way round is its transpose to the last bit: callers give the lower
   one of the two
*/
static void Turn(const PetscReal R[3][3], const PetscReal K[9], PetscReal T[9])
{
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      T[3 * i + j] = 0;
      for (int k = 0; k < 3; k++) {
        for (int l = 0; l < 3; l++) T[3 * i + j] += R[i][k] * R[j][l] * K[3 * k + l];
      }
    }
  }
}

/* How the cell at c is turned against the one that it is like */
static bool Rotation(const SceneBody &b, const PetscInt c[3], PetscReal R[3][3])
{
  const PetscReal angle = b.map == SCENE_SECTOR ? b.size[1] * c[1] / b.n[1]
                          : b.map == SCENE_BENT ? b.bend * c[0] / b.n[0]
                                                : 0;
  const int       p = b.map == SCENE_SECTOR ? 0 : 2, q = b.map == SCENE_SECTOR ? 1 : 0;

  if (angle == 0) return false;
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) R[i][j] = i == j;
  }
  R[p][p] = R[q][q] = std::cos(angle);
  R[q][p]           = std::sin(angle);
  R[p][q]           = -R[q][p];
  return true;
}

PetscErrorCode CellRows::Compute(PetscInt node, SceneRow &row)
{
  const int size = s.bs * s.bs;

  PetscFunctionBeginUser;
  PetscCall(Neighbors(node, row.node));
  for (size_t k = 0; k < row.node.size(); k++) sum[k].fill(0);
  row.volume = 0;
  Around(node, [&](const SceneBody &b, const PetscInt c[3], int a, int lowest) {
    const SceneCell &cell = Like(b, c);
    const PetscReal  E    = s.Modulus((int)(&b - s.body.data()), c);
    PetscReal        R[3][3], volume = 1;
    const bool       turned = s.physics == SCENE_ELASTIC && s.dim == 3 && Rotation(b, c, R);

    for (int d = 0; d < s.dim; d++) volume *= b.size[d] / b.n[d];
    row.volume += volume / cell.nodes;
    for (int k = 0; k < cell.nodes; k++) {
      PetscReal T[9];

      if (!cell.joined[a * cell.nodes + k]) continue;
      const PetscReal *K  = cell.Block(a, k);
      auto            &to = sum[slot[Slot(s.dim, b.order, lowest, k)]];

      if (turned) {
        Turn(R, cell.Block(PetscMin(a, k), PetscMax(a, k)), T);
        if (a > k || a == k) {
          for (int i = 0; i < 3; i++) {
            for (int j = 0; j < i; j++) {
              if (a == k) T[3 * i + j] = T[3 * j + i];
              else std::swap(T[3 * i + j], T[3 * j + i]);
            }
          }
        }
        K = T;
      }
      for (int e = 0; e < size; e++) to[e] += E * K[e];
    }
  });
  row.block.resize(row.node.size() * size);
  for (size_t k = 0; k < row.node.size(); k++) {
    for (int e = 0; e < size; e++) row.block[k * size + e] = sum[k][e];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneRowsOfCells(const Scene &s, SceneRows **rows)
{
  CellRows *cells = new CellRows(s);

  PetscFunctionBeginUser;
  PetscCall(cells->Prepare());
  *rows = cells;
  PetscFunctionReturn(PETSC_SUCCESS);
}
