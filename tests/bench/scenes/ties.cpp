/* The constraint rows C u = g: nodes tied to the surface of another body, or to nodes of their own */
#include "scene.h"
#include <cmath>

/* Nodes with a Dirichlet condition are held in the origin: they have nothing to say */
void SceneAppend(const Scene &s, SceneConstraint &row, PetscInt node, int component, PetscReal value)
{
  if (PetscAbsReal(value) < 1e-14 || s.Fixed(node)) return;
  row.columns.push_back(s.bs * s.number[node] + component);
  row.values.push_back(value);
}

/* u_s - sum_p w_p u_p = 0, component by component where the node sticks, along the normal, an axis, where it slips */
static PetscErrorCode TieRows(const Scene &s, const SceneTie &tie, PetscInt node, std::vector<SceneConstraint> &rows)
{
  const SceneBody   &b = s.body[tie.secondary], &primary = s.body[tie.primary];
  SceneInterpolation at;
  PetscReal          x[3];
  PetscInt           ijk[3];

  PetscFunctionBeginUser;
  b.NodeIndices(node, ijk);
  if (ijk[tie.axis] != (tie.side ? b.Points(tie.axis) - 1 : 0) || s.Fixed(node)) PetscFunctionReturn(PETSC_SUCCESS);
  b.BoxPosition(ijk, x);
  for (int d = 0; d < s.dim; d++) { /* the orthogonal projection, if the other face reaches as far */
    const PetscReal low = primary.lo[d], high = low + primary.size[d];

    if (d == tie.axis) x[d] = tie.side ? low : high;
    else if (x[d] < low - 1e-10 || x[d] > high + 1e-10) PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SceneInterpolate(s, tie.primary, x, &at));
  for (int c = 0; c < s.dim; c++) {
    SceneConstraint row;

    if (c != tie.axis && tie.stick < 1 && x[tie.axis == 0 ? 1 : 0] >= tie.stick) continue;
    SceneAppend(s, row, node, c, 1);
    for (int p = 0; p < at.size; p++) SceneAppend(s, row, at.node[p], c, -at.weight[p]);
    row.g = 0;
    rows.push_back(row);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u+ - u- = E (x+ - x-): a node on a high face follows that on the low one, on several faces that on all of them */
static void PeriodicRows(const Scene &s, PetscInt node, std::vector<SceneConstraint> &rows)
{
  const SceneBody &b = s.body[0];
  PetscReal        here[3], there[3], high[3], low[3];
  PetscInt         ijk[3], other;
  bool             follows = false;

  b.NodeIndices(node, ijk);
  for (int d = 0; d < s.dim; d++) {
    if (ijk[d] < b.Points(d) - 1) continue;
    follows = true;
    ijk[d]  = 0;
  }
  if (!follows) return;
  other = b.Node(ijk[0], ijk[1], ijk[2]);
  s.Position(node, here);
  s.Position(other, there);
  s.Linear(here, high);
  s.Linear(there, low);
  for (int c = 0; c < s.bs; c++) {
    SceneConstraint row;

    SceneAppend(s, row, node, c, 1);
    SceneAppend(s, row, other, c, -1);
    row.g = high[c] - low[c];
    rows.push_back(row);
  }
}

/* u2 = R u1: the last face of the sector turns with the first one */
static void CyclicRows(const Scene &s, PetscInt node, std::vector<SceneConstraint> &rows)
{
  const SceneBody &b = s.body[0];
  const PetscReal  c = std::cos(b.size[1]), n = std::sin(b.size[1]);
  const PetscReal  R[3][3] = {
     {c, -n, 0},
     {n, c,  0},
     {0, 0,  1}
  };
  PetscInt ijk[3];

  b.NodeIndices(node, ijk);
  if (ijk[1] < b.Points(1) - 1 || s.Fixed(node)) return;
  for (int i = 0; i < 3; i++) {
    SceneConstraint row;

    SceneAppend(s, row, node, i, 1);
    for (int j = 0; j < 3; j++) SceneAppend(s, row, b.Node(ijk[0], 0, ijk[2]), j, -R[i][j]);
    row.g = 0;
    rows.push_back(row);
  }
}

static PetscErrorCode CreateMatrix(const Scene &s, const std::vector<SceneConstraint> &rows, Mat *C)
{
  const PetscInt        n = s.bs * (PetscInt)s.owned.size();
  std::vector<PetscInt> here, there;

  PetscFunctionBeginUser;
  for (const SceneConstraint &row : rows) {
    PetscInt mine = 0;

    for (PetscInt c : row.columns) mine += c >= s.bs * s.start && c < s.bs * s.start + n;
    here.push_back(mine);
    there.push_back((PetscInt)row.columns.size() - mine);
  }
  PetscCall(MatCreate(s.comm, C));
  PetscCall(MatSetSizes(*C, (PetscInt)rows.size(), n, PETSC_DETERMINE, s.bs * s.nodes));
  PetscCall(MatSetBlockSizes(*C, 1, s.bs));
  PetscCall(MatSetType(*C, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*C, 0, here.data()));
  PetscCall(MatMPIAIJSetPreallocation(*C, 0, here.data(), 0, there.data()));
  PetscCall(MatSetOption(*C, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneCreateConstraints(const Scene &s, const std::vector<SceneConstraint> &rows, Mat *C, Vec *g)
{
  PetscScalar *rhs;
  PetscInt     start;

  PetscFunctionBeginUser;
  PetscCall(CreateMatrix(s, rows, C));
  PetscCall(MatCreateVecs(*C, NULL, g));
  PetscCall(MatGetOwnershipRange(*C, &start, NULL));
  PetscCall(VecGetArrayWrite(*g, &rhs));
  for (size_t r = 0; r < rows.size(); r++) {
    const std::vector<PetscScalar> values(rows[r].values.begin(), rows[r].values.end());
    const PetscInt                 row = start + (PetscInt)r;

    rhs[r] = rows[r].g;
    PetscCall(MatSetValues(*C, 1, &row, (PetscInt)values.size(), rows[r].columns.data(), values.data(), INSERT_VALUES));
  }
  PetscCall(VecRestoreArrayWrite(*g, &rhs));
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A rank has the rows of its secondary nodes */
PetscErrorCode SceneAssembleConstraints(const Scene &s, Mat *C, Vec *g)
{
  std::vector<SceneConstraint> rows;

  PetscFunctionBeginUser;
  for (PetscInt node : s.owned) {
    if (!s.Constrained()) break;
    if (s.pairs == SCENE_PERIODIC) PeriodicRows(s, node, rows);
    if (s.pairs == SCENE_CYCLIC) CyclicRows(s, node, rows);
    for (const SceneTie &tie : s.tie) {
      if (tie.secondary == s.Body(node)) PetscCall(TieRows(s, tie, node, rows));
    }
  }
  PetscCall(SceneCreateConstraints(s, rows, C, g));
  PetscFunctionReturn(PETSC_SUCCESS);
}
