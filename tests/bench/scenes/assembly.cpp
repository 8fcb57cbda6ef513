/* A and f from the rows of each node, with the Dirichlet conditions eliminated symmetrically */
#include "scene.h"
#include <algorithm>
#include <memory>

/* Exact: no allocation happens while A is filled, and no space is left */
static PetscErrorCode CreateMatrix(const Scene &s, SceneRows &rows, Mat *A)
{
  const PetscInt        n = (PetscInt)s.owned.size(), bs = s.bs;
  std::vector<PetscInt> diagonal(bs * n), other(bs * n, 0), around;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++) {
    const bool fixed = s.Fixed(s.owned[i]);
    PetscInt   here = 0, there = 0;

    if (!fixed) {
      PetscCall(rows.Neighbors(s.owned[i], around));
      for (PetscInt node : around) {
        if (!s.Fixed(node)) (s.Owns(node) ? here : there) += bs;
      }
    }
    for (PetscInt c = 0; c < bs; c++) {
      diagonal[bs * i + c] = fixed ? 1 : here;
      other[bs * i + c]    = there;
    }
  }
  PetscCall(MatCreate(s.comm, A));
  PetscCall(MatSetSizes(*A, bs * n, bs * n, bs * s.nodes, bs * s.nodes));
  PetscCall(MatSetBlockSize(*A, bs));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*A, 0, diagonal.data()));
  PetscCall(MatMPIAIJSetPreallocation(*A, 0, diagonal.data(), 0, other.data()));
  PetscCall(MatSetOption(*A, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   A body force, and on top of it one at random, so that every mode has its part; none where the constraints or the
   boundary load the body
*/
static void Load(const Scene &s, PetscInt node, PetscReal volume, PetscScalar load[])
{
  const PetscReal body[6] = {0.3, 0.2, -1, 0, 0, 0};
  const bool      none    = s.options.patch || (s.pairs == SCENE_PERIODIC && s.Constrained());

  for (int c = 0; c < s.bs; c++)
    load[c] = none ? 0.0
                   : volume * ((s.bs == 1 ? 1 : body[c]) + 2 * SceneRandom(s.options.seed, 1, node * s.bs + c) - 1);
}

/* One node's rows: columns in the order of the system's numbers, so that none is moved while it is filled */
struct Filled {
  std::vector<std::pair<PetscInt, PetscInt>> order; /* the system's number of a neighbor, and its place in the row */
  std::vector<PetscInt>                      columns;
  std::vector<PetscScalar>                   values;
};

static PetscErrorCode SetRow(const Scene &s, PetscInt node, const SceneRow &row, Filled &work, Mat A,
                             PetscScalar load[])
{
  const PetscInt bs = s.bs, first = bs * s.number[node];
  PetscInt       rows[6], width;

  PetscFunctionBeginUser;
  Load(s, node, row.volume, load);
  work.order.clear();
  for (size_t k = 0; k < row.node.size(); k++) {
    const PetscReal *K = &row.block[k * bs * bs];

    if (!s.Fixed(node) && !s.Fixed(row.node[k])) work.order.emplace_back(s.number[row.node[k]], (PetscInt)k);
    else if (s.Fixed(node) && row.node[k] != node) continue;
    else if (s.options.patch) { /* what the imposed displacement does to this node */ PetscReal x[3], u[3];

      s.Position(row.node[k], x);
      s.Linear(x, u);
      for (PetscInt r = 0; r < bs; r++) {
        for (PetscInt c = 0; c < bs; c++) {
          if (row.node[k] == node) load[r] += r == c ? K[(bs + 1) * r] * u[r] : 0;
          else load[r] -= K[bs * r + c] * u[c];
        }
      }
    }
    if (s.Fixed(node)) { /* an uncoupled row whose solution is the imposed value */
      for (PetscInt c = 0; c < bs; c++) {
        PetscCall(MatSetValue(A, first + c, first + c, K[(bs + 1) * c], INSERT_VALUES));
        if (!s.options.patch) load[c] = 0;
      }
    }
  }
  if (s.Fixed(node)) PetscFunctionReturn(PETSC_SUCCESS);
  std::sort(work.order.begin(), work.order.end());
  width = bs * (PetscInt)work.order.size();
  work.columns.resize(width);
  work.values.resize(bs * width);
  for (size_t k = 0; k < work.order.size(); k++) {
    for (PetscInt c = 0; c < bs; c++) {
      work.columns[k * bs + c] = bs * work.order[k].first + c;
      for (PetscInt r = 0; r < bs; r++)
        work.values[r * width + k * bs + c] = row.block[(work.order[k].second * bs + r) * bs + c];
    }
  }
  for (PetscInt r = 0; r < bs; r++) rows[r] = first + r;
  PetscCall(MatSetValues(A, bs, rows, width, work.columns.data(), work.values.data(), INSERT_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SceneAssemble(const Scene &s, Mat *A, Vec *f)
{
  SceneRows   *made;
  SceneRow     row;
  Filled       work;
  PetscScalar *rhs;

  PetscFunctionBeginUser;
  if (s.physics == SCENE_BEAMS) PetscCall(SceneRowsOfBeams(s, &made));
  else PetscCall(SceneRowsOfCells(s, &made));
  const std::unique_ptr<SceneRows> rows(made);
  PetscCall(CreateMatrix(s, *rows, A));
  PetscCall(MatCreateVecs(*A, NULL, f));
  PetscCall(VecGetArrayWrite(*f, &rhs));
  for (size_t i = 0; i < s.owned.size(); i++) {
    PetscCall(rows->Compute(s.owned[i], row));
    PetscCall(SetRow(s, s.owned[i], row, work, *A, rhs + i * s.bs));
  }
  PetscCall(VecRestoreArrayWrite(*f, &rhs));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  if (!s.Singular()) PetscCall(MatSetOption(*A, MAT_SPD, PETSC_TRUE));
  if (s.options.nearNullSpace) {
    MatNullSpace modes;

    PetscCall(SceneGetRigidModes(s, &modes));
    if (modes) PetscCall(MatSetNearNullSpace(*A, modes));
    PetscCall(MatNullSpaceDestroy(&modes));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
