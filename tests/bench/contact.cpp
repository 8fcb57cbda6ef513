/* Node-to-surface contact: the constraint rows C u = g */
#include "cubes.h"
#include "projection.h"
#include <algorithm>
#include <cmath>
#include <cstdint>

/*
   Which rows there are: the same on all ranks, at a cost that follows the contact surface. Secondary nodes are taken in
   their natural order; the natural number of a row is its place among all rows, before -fraction takes some away.
*/
struct RowPlan {
  /* of each secondary node, and one more: natural number of its first row; three rows stick, one slips */
  std::vector<PetscInt> first;
  std::vector<char>     kept; /* by natural number: not at all, once or twice */
  PetscInt              rows; /* in C */
};

/* A random number in [0,2^64) that depends on its arguments alone (splitmix64) */
static std::uint64_t Random(PetscInt seed, PetscInt stream, PetscInt row)
{
  std::uint64_t z = (std::uint64_t)seed * 0xd1342543de82ef95u + (std::uint64_t)stream * 0x2545f4914f6cdd1du;

  for (int round = 0; round < 2; round++) {
    z += 0x9e3779b97f4a7c15u + (round ? (std::uint64_t)row * 0xbf58476d1ce4e5b9u : 0u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
  }
  return z;
}

static bool Sticks(const CubesMesh &mesh, PetscInt i)
{
  return mesh.options.stick == 1 || (PetscReal)i / mesh.body[1].n[0] < mesh.options.stick;
}

static PetscErrorCode PlanRows(const CubesMesh &mesh, RowPlan *plan)
{
  const CubesOptions &o       = mesh.options;
  const CubesBody    &b       = mesh.body[1];
  PetscInt            natural = 0, keep, twice;

  PetscFunctionBeginUser;
  for (PetscInt j = 0; j <= b.n[1]; j++) {
    for (PetscInt i = 0; i <= b.n[0]; i++) {
      plan->first.push_back(natural);
      if (o.contact) natural += Sticks(mesh, i) ? 3 : 1;
    }
  }
  plan->first.push_back(natural);
  plan->kept.assign(natural, 1);
  keep = (PetscInt)std::round(o.fraction * natural);
  if (keep < natural) { /* those with the smallest random numbers */
    std::vector<std::pair<std::uint64_t, PetscInt>> order;

    for (PetscInt r = 0; r < natural; r++) order.emplace_back(Random(o.seed, 0, r), r);
    std::nth_element(order.begin(), order.begin() + keep, order.end());
    for (PetscInt r = keep; r < natural; r++) plan->kept[order[r].second] = 0;
  }
  PetscCheck(o.duplicate <= keep, mesh.comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Option -duplicate is %" PetscInt_FMT
             ", it must be between 0 and the number of constraint rows, %" PetscInt_FMT,
             o.duplicate, keep);
  twice = o.duplicate;
  for (PetscInt r = 0; r < natural && twice; r++) {
    if (plan->kept[r]) {
      plan->kept[r] = 2;
      twice--;
    }
  }
  plan->rows = keep + o.duplicate;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A floating body may move as a rigid one unless three nodes, not on one line, stick to the other body */
static PetscErrorCode CheckHeld(const CubesMesh &mesh, const RowPlan &plan)
{
  PetscReal x[3][3];
  PetscInt  found = 0;

  PetscFunctionBeginUser;
  for (size_t s = 0; s + 1 < plan.first.size() && found < 3; s++) {
    PetscReal a[3], b[3], area = 0;

    if (plan.first[s + 1] - plan.first[s] < 3 || !plan.kept[plan.first[s]] || !plan.kept[plan.first[s] + 1] ||
        !plan.kept[plan.first[s] + 2])
      continue;
    mesh.Position(mesh.body[1].node + (PetscInt)s, x[found]);
    if (found == 2) {
      for (int c = 0; c < 3; c++) {
        a[c] = x[1][c] - x[0][c];
        b[c] = x[2][c] - x[0][c];
      }
      for (int c = 0; c < 3; c++) area += PetscSqr(a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3]);
      if (area < 1e-20) continue;
    }
    found++;
  }
  PetscCheck(found == 3, mesh.comm, PETSC_ERR_ARG_INCOMP,
             "With -floating the upper body is free to move as a rigid body, as no three nodes off one line stick to "
             "the lower one: take a larger -stick (or "
             "-fraction), with contact");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One row of C, before it is scaled */
struct Row {
  PetscInt    natural, columns[15];
  PetscScalar values[15], g;
  int         size;
};

static void Append(Row &row, PetscInt column, PetscReal value)
{
  if (PetscAbsReal(value) < 1e-14) return;
  row.columns[row.size]  = column;
  row.values[row.size++] = value;
}

/* u_s - sum_p w_p u_p = -gap n, component by component where the node sticks, along the normal n where it slips */
static PetscErrorCode NodeRows(const CubesMesh &mesh, const RowPlan &plan, PetscInt s, std::vector<Row> &rows)
{
  const PetscInt node = mesh.body[1].node + s, count = plan.first[s + 1] - plan.first[s];
  Projection     projection;
  PetscReal      x[3], n[3];

  PetscFunctionBeginUser;
  mesh.Position(node, x);
  PetscCall(ProjectOnPrimary(mesh, x, &projection));
  mesh.Rotate(projection.normal, n);
  for (PetscInt r = 0; r < count; r++) {
    Row row;

    if (!plan.kept[plan.first[s] + r]) continue;
    row.natural = plan.first[s] + r;
    row.size    = 0;
    row.g       = mesh.options.gap == 0 ? 0.0 : -mesh.options.gap * (count == 3 ? n[r] : 1);
    for (int c = 0; c < 3; c++) {
      const PetscReal direction = count == 1 ? n[c] : (c == r ? 1 : 0);

      Append(row, 3 * mesh.number[node] + c, direction);
      for (int p = 0; p < 4; p++)
        Append(row, 3 * mesh.number[projection.node[p]] + c, -projection.weight[p] * direction);
    }
    rows.push_back(row);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 10^u, u uniform in [-rowscale,rowscale] */
static PetscReal RowScale(const CubesOptions &o, PetscInt id)
{
  return o.rowscale == 0 ? 1 : std::pow(10.0, o.rowscale * (2 * (Random(o.seed, 1, id) / 18446744073709551616.0) - 1));
}

/*
   A rank has the rows of its secondary nodes, and then those of them that appear twice. No node of the contact surface
   carries a Dirichlet condition, a body being at least one element high, so neither C nor g has anything to eliminate.
*/
PetscErrorCode CubesAssembleContact(const CubesMesh &mesh, Mat *C, Vec *g)
{
  const PetscInt natives = (PetscInt)mesh.owned.size(), surface = (mesh.body[1].n[0] + 1) * (mesh.body[1].n[1] + 1);
  std::vector<PetscInt> here, there;
  std::vector<Row>      rows;
  PetscScalar          *rhs;
  PetscInt              start;
  size_t                once;
  RowPlan               plan;

  PetscFunctionBeginUser;
  PetscCall(PlanRows(mesh, &plan));
  if (mesh.options.floating) PetscCall(CheckHeld(mesh, plan));
  for (PetscInt s = 0; s < surface; s++) {
    if (mesh.Owns(mesh.body[1].node + s)) PetscCall(NodeRows(mesh, plan, s, rows));
  }
  once = rows.size();
  for (size_t r = 0; r < once; r++) {
    if (plan.kept[rows[r].natural] == 2) {
      Row row = rows[r];

      row.natural += plan.first.back(); /* to be scaled on its own */
      row.g += mesh.options.inconsistent;
      rows.push_back(row);
    }
  }
  for (const Row &row : rows) {
    PetscInt mine = 0;

    for (int c = 0; c < row.size; c++)
      mine += row.columns[c] >= 3 * mesh.start && row.columns[c] < 3 * (mesh.start + natives);
    here.push_back(mine);
    there.push_back(row.size - mine);
  }
  PetscCall(MatCreate(mesh.comm, C));
  PetscCall(MatSetSizes(*C, (PetscInt)rows.size(), 3 * natives, plan.rows, 3 * mesh.nodes));
  PetscCall(MatSetBlockSizes(*C, 1, 3));
  PetscCall(MatSetType(*C, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*C, 0, here.data()));
  PetscCall(MatMPIAIJSetPreallocation(*C, 0, here.data(), 0, there.data()));
  PetscCall(MatSetOption(*C, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscCall(MatCreateVecs(*C, NULL, g));
  PetscCall(MatGetOwnershipRange(*C, &start, NULL));
  PetscCall(VecGetArrayWrite(*g, &rhs));
  for (size_t r = 0; r < rows.size(); r++) {
    const PetscReal scale = RowScale(mesh.options, rows[r].natural);
    const PetscInt  row   = start + (PetscInt)r;

    for (int c = 0; c < rows[r].size; c++) rows[r].values[c] *= scale;
    rhs[r] = scale * rows[r].g;
    PetscCall(MatSetValues(*C, 1, &row, rows[r].size, rows[r].columns, rows[r].values, INSERT_VALUES));
  }
  PetscCall(VecRestoreArrayWrite(*g, &rhs));
  PetscCall(MatAssemblyBegin(*C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*C, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}
