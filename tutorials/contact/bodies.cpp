/* Two blocks that touch: their cells, their rows of contact and of symmetry, their pictures */
#include "bodies.h"
#include "../../tests/bench/vtufile.h"
#include <cmath>

enum {
  LOWER,
  UPPER
};

static PetscErrorCode CreateScene(MPI_Comm comm, const BodiesOptions &o, Scene *s)
{
  PetscFunctionBeginUser;
  s->comm                  = comm;
  s->options               = SceneOptions();
  s->options.element       = SCENE_Q1;
  s->options.partition     = SCENE_METIS;
  s->options.nu            = o.nu;
  s->options.constraints   = PETSC_TRUE;
  s->options.fixed         = PETSC_TRUE;
  s->options.nearNullSpace = PETSC_TRUE;
  s->name                  = "contact";
  s->dim = s->bs = o.dim;
  s->physics     = SCENE_ELASTIC;
  s->pairs       = SCENE_NO_PAIRS;
  s->nodes = s->cells = 0;
  for (int i = 0; i < 2; i++) {
    SceneBody b = SceneBody();

    b.dim   = o.dim;
    b.order = 1;
    b.E     = o.E[i];
    b.map   = SCENE_GRADED;
    b.near  = o.near;
    b.far   = o.far;
    for (int d = 0; d < o.dim; d++) {
      b.n[d]    = o.n[i];
      b.size[d] = 1;
    }
    if (i == LOWER) b.lo[o.dim - 1] = -1;
    b.fixed[o.dim - 1][i] = true; /* far from the contact */
    b.node                = s->nodes;
    b.cell                = s->cells;
    s->nodes += b.Nodes();
    s->cells += b.Cells();
    s->body.push_back(b);
  }
  PetscCall(ScenePartitionNodes(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A node in a plane of symmetry stays in it */
static void SymmetryRows(const Scene &s, PetscInt node, const PetscInt ijk[3], std::vector<SceneConstraint> &rows)
{
  for (int d = 0; d < s.dim - 1; d++) {
    SceneConstraint row;

    if (ijk[d]) continue;
    SceneAppend(s, row, node, d, 1);
    row.g = 0;
    rows.push_back(row);
  }
}

/* A node of the upper surface does not go below the lower one: sum_p w_p u_p - u <= gap, vertically */
static PetscErrorCode ContactRow(const Bodies &b, PetscInt node, const PetscInt ijk[3],
                                 std::vector<SceneConstraint> &rows, ContactNode *found)
{
  const Scene       &s    = b.scene;
  const SceneBody   &body = s.body[UPPER];
  const int          up   = s.dim - 1;
  PetscReal          box[3], squares = 0;
  SceneInterpolation at;
  SceneConstraint    row;

  PetscFunctionBeginUser;
  s.Position(node, found->x);
  s.body[LOWER].Unmap(found->x, box);
  PetscCall(SceneInterpolate(s, LOWER, box, &at));
  for (int p = 0; p < at.size; p++) SceneAppend(s, row, at.node[p], up, at.weight[p]);
  SceneAppend(s, row, node, up, -1);
  found->area = 1;
  for (int d = 0; d < up; d++) { /* the cells within near are of one size */
    found->area *= 2 * body.near / body.n[d] * (ijk[d] ? 1 : 0.5);
    squares += PetscSqr(found->x[d]);
  }
  found->gap = row.g = squares / (2 * b.options.radius);
  rows.push_back(row);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of nodes of this rank; nodes beyond near are not looked at */
static PetscErrorCode CreateRows(Bodies *b)
{
  const Scene                 &s = b->scene;
  std::vector<SceneConstraint> rows;
  Vec                          g;

  PetscFunctionBeginUser;
  for (PetscInt node : s.owned) {
    const int        body = s.Body(node);
    const SceneBody &own  = s.body[body];
    PetscInt         ijk[3];
    bool             inside;

    if (s.Fixed(node)) continue;
    own.NodeIndices(node, ijk);
    SymmetryRows(s, node, ijk, rows);
    inside = body == UPPER && ijk[s.dim - 1] == 0;
    for (int d = 0; d < s.dim - 1; d++) inside = inside && 2 * ijk[d] <= own.n[d];
    if (!inside) continue;
    ContactNode found;

    found.row = s.bs * (PetscInt)s.owned.size() + (PetscInt)rows.size();
    PetscCall(ContactRow(*b, node, ijk, rows, &found));
    b->node.push_back(found);
  }
  PetscCall(SceneCreateConstraints(s, rows, &b->C, &g));
  PetscCall(VecDestroy(&g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode BodiesCreate(MPI_Comm comm, const BodiesOptions &options, Bodies *b)
{
  Mat          blocks[4];
  PetscScalar *gap, *contact;
  Vec          f;

  PetscFunctionBeginUser;
  b->options = options;
  PetscCall(CreateScene(comm, options, &b->scene));
  PetscCall(SceneAssemble(b->scene, &b->A, &f));
  PetscCall(VecDestroy(&f));
  PetscCall(CreateRows(b));
  PetscCall(MatDuplicate(b->C, MAT_COPY_VALUES, &b->N));
  PetscCall(MatScale(b->N, -1.0));
  blocks[0] = b->A;
  PetscCall(PetscDefined(USE_COMPLEX) ? MatCreateHermitianTranspose(b->C, &blocks[1])
                                      : MatCreateTranspose(b->C, &blocks[1]));
  blocks[2] = b->N;
  blocks[3] = NULL;
  PetscCall(MatCreateNest(comm, 2, NULL, 2, NULL, blocks, &b->J));
  PetscCall(MatDestroy(&blocks[1]));
  PetscCall(MatCreateVecs(b->J, &b->gaps, NULL));
  PetscCall(VecSet(b->gaps, 0.0));
  PetscCall(VecDuplicate(b->gaps, &b->contact));
  PetscCall(VecSet(b->contact, 0.0));
  PetscCall(VecGetArray(b->gaps, &gap));
  PetscCall(VecGetArray(b->contact, &contact));
  for (const ContactNode &node : b->node) {
    gap[node.row]     = node.gap;
    contact[node.row] = 1;
  }
  PetscCall(VecRestoreArray(b->contact, &contact));
  PetscCall(VecRestoreArray(b->gaps, &gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode BodiesDestroy(Bodies *b)
{
  PetscFunctionBeginUser;
  for (Mat *M : {&b->J, &b->A, &b->C, &b->N}) PetscCall(MatDestroy(M));
  PetscCall(VecDestroy(&b->gaps));
  PetscCall(VecDestroy(&b->contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cells whose lowest node is of this rank */
static PetscErrorCode CreatePiece(const Scene &s, VtuPiece *piece, std::vector<PetscInt> *natural)
{
  const int order[2][8] = {
    {0,  1, 3, 2},
    { 0, 1, 3, 2, 4, 5, 7, 6}
  };
  std::vector<std::int64_t> place(s.nodes, -1);
  PetscMPIInt               rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(s.comm, &rank));
  piece->numbers = {
    {"body", {}},
    {"rank", {}}
  };
  for (PetscInt node : s.owned) {
    const int        body = s.Body(node);
    const SceneBody &b    = s.body[body];
    PetscInt         ijk[3];
    bool             last = false;

    b.NodeIndices(node, ijk);
    for (int d = 0; d < s.dim; d++) last = last || ijk[d] == b.n[d];
    if (last) continue;
    for (int c = 0; c < 1 << s.dim; c++) {
      const int      bits   = order[s.dim - 2][c];
      const PetscInt corner = b.Node(ijk[0] + (bits & 1), ijk[1] + (bits >> 1 & 1), ijk[2] + (bits >> 2));

      place[corner] = 0;
      piece->corner.push_back(corner);
    }
    piece->offset.push_back((std::int64_t)piece->corner.size());
    piece->numbers[0].second.push_back(body + 1);
    piece->numbers[1].second.push_back(rank);
    piece->type.push_back(s.dim == 2 ? 9 : 12);
  }
  for (PetscInt node = 0; node < s.nodes; node++) {
    if (place[node] < 0) continue;
    place[node] = (std::int64_t)natural->size();
    natural->push_back(node);
    piece->node.push_back(s.number[node]);
  }
  for (std::int64_t &c : piece->corner) c = place[c];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode BodiesFunction(SNES, Vec X, Vec F, void *ctx)
{
  const Bodies *b = (const Bodies *)ctx;

  PetscFunctionBeginUser;
  PetscCall(MatMult(b->J, X, F));
  PetscCall(VecAXPY(F, 1.0, b->gaps));
  PetscCall(VecAXPY(F, -b->approach, b->contact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode BodiesJacobian(SNES, Vec, Mat, Mat, void *)
{
  PetscFunctionBeginUser;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   The upper body is drawn with its round surface: its gap, which fades with the height, and the approach on top of its
   displacement
*/
PetscErrorCode BodiesViewVTU(const Bodies &b, Vec solution, const char file[])
{
  const Scene          &s  = b.scene;
  const int             up = s.dim - 1;
  std::vector<PetscInt> natural;
  VtuPiece              piece;
  Vec                   u, lambda, force;
  IS                    is[2];

  PetscFunctionBeginUser;
  PetscCall(CreatePiece(s, &piece, &natural));
  piece.vectors = {
    {"displacement",  {}},
    {"contact_force", {}}
  };
  PetscCall(MatNestGetISs(b.J, is, NULL));
  PetscCall(VecGetSubVector(solution, is[0], &u));
  PetscCall(VecGetSubVector(solution, is[1], &lambda));
  PetscCall(VecDuplicate(u, &force));
  PetscCall(MatMultHermitianTranspose(b.N, lambda, force));
  PetscCall(VtuGetVector(s.comm, piece, s.bs, u, &piece.vectors[0].second));
  PetscCall(VtuGetVector(s.comm, piece, s.bs, force, &piece.vectors[1].second));
  PetscCall(VecDestroy(&force));
  PetscCall(VecRestoreSubVector(solution, is[1], &lambda));
  PetscCall(VecRestoreSubVector(solution, is[0], &u));
  for (size_t i = 0; i < natural.size(); i++) {
    PetscReal x[3], squares = 0;

    s.Position(natural[i], x);
    for (int d = 0; d < up; d++) squares += PetscSqr(x[d]);
    if (s.Body(natural[i]) == UPPER) {
      x[up] += squares / (2 * b.options.radius) * PetscSqr(1 - PetscAbsReal(x[up]) / b.options.far);
      piece.vectors[0].second[3 * i + up] -= b.approach;
    }
    for (int d = 0; d < 3; d++) piece.position.push_back((double)x[d] + piece.vectors[0].second[3 * i + d]);
  }
  PetscCall(VtuWrite(s.comm, piece, file));
  PetscFunctionReturn(PETSC_SUCCESS);
}
