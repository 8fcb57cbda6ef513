/*
   Scenes: generated systems of many kinds, on one or several bodies that are grids of cells, assembled in parallel:

       [ A  C' ] [ u      ]   [ f ]
       [ C  0  ] [ lambda ] = [ g ]        or, without constraints, A u = f

   A cell is a bilinear or trilinear element, or is cut into linear or quadratic simplices (Kuhn: 2 triangles, 6
   tetrahedra); a cell of order p has (p+1)^dim nodes. Nodes and cells have a *natural* number, given by index
   arithmetic, body after body, x running fastest. The system is the same on any number of ranks, up to the numbering of
   its unknowns.
*/
#ifndef TUTORIALS_SCENES_SCENE_H
#define TUTORIALS_SCENES_SCENE_H

#include "../compat.h"
#include <petscmat.h>
#include <cstdint>
#include <vector>

enum SceneElement {
  SCENE_Q1,
  SCENE_P1,
  SCENE_P2
};
enum SceneInclusion {
  SCENE_NONE,
  SCENE_BALLS,
  SCENE_FIBERS,
  SCENE_RANDOM,
  SCENE_BINARY,
  SCENE_RODS
};
enum ScenePartition {
  SCENE_SLAB,
  SCENE_METIS
};
/*
   How a box becomes a body: as it is, rolled up about y, with x, y for the radius and the angle, or with cells that
   grow away from the origin
*/
enum SceneMap {
  SCENE_BOX,
  SCENE_BENT,
  SCENE_SECTOR,
  SCENE_GRADED
};
/* What a scene solves for */
enum ScenePhysics {
  SCENE_ELASTIC,
  SCENE_HEAT,
  SCENE_BEAMS
};
/* Which nodes of one body are tied to each other */
enum ScenePairs {
  SCENE_NO_PAIRS,
  SCENE_PERIODIC,
  SCENE_CYCLIC
};

struct SceneOptions {
  PetscInt  scene, element, inclusion, partition;
  PetscInt  n, n2, ny, nz, unknowns, count, seed;
  PetscReal contrast, nu, aspect, bend, angle, stick;
  PetscBool floating, constraints, fixed, patch, nearNullSpace;
};

struct SceneBody {
  int       dim, order;
  PetscInt  n[3];               /* cells along x, y, z; 0 beyond dim */
  PetscReal lo[3], size[3], E;  /* of the box, before the map */
  bool      fixed[3][2], loose; /* faces with a Dirichlet condition; loose: without any */
  int       map;                /* SceneMap */
  PetscReal bend;               /* whole angle of SCENE_BENT [radians] */
  /*
     SCENE_GRADED: what is within a half of the origin in the box comes to lie within near, what is within 1 within far
  */
  PetscReal near, far;
  PetscInt  node, cell; /* natural number of the first node and of the first cell */

  PetscInt Points(int d) const { return order * n[d] + 1; }
  PetscInt Nodes() const { return Points(0) * Points(1) * Points(2); }
  PetscInt CellsAlong(int d) const { return PetscMax(1, n[d]); }
  PetscInt Cells() const { return CellsAlong(0) * CellsAlong(1) * CellsAlong(2); }
  PetscInt Node(PetscInt i, PetscInt j, PetscInt k) const { return node + i + Points(0) * (j + Points(1) * k); }
  PetscInt Cell(PetscInt i, PetscInt j, PetscInt k) const { return cell + i + CellsAlong(0) * (j + CellsAlong(1) * k); }
  void     NodeIndices(PetscInt id, PetscInt ijk[3]) const;
  /* In the box, and where the map puts it */
  void BoxPosition(const PetscInt ijk[3], PetscReal x[3]) const;
  void Map(const PetscReal box[3], PetscReal x[3]) const;
  void Unmap(const PetscReal x[3], PetscReal box[3]) const; /* of SCENE_GRADED */
};

/*
   The face of one body, low or high along an axis, on the opposite face of another: nodes with x < stick stick, the
   others slip
*/
struct SceneTie {
  int       secondary, primary, axis, side;
  PetscReal stick;
};

struct Scene {
  MPI_Comm               comm;
  SceneOptions           options;
  const char            *name;
  int                    dim, bs;
  int                    physics, pairs; /* ScenePhysics, ScenePairs */
  std::vector<SceneBody> body;
  std::vector<SceneTie>  tie;
  PetscInt               nodes, cells; /* of all bodies */
  std::vector<PetscInt>  number;       /* node in the system's numbering, by natural number; the same on all ranks */
  std::vector<PetscInt>  owned;        /* natural numbers of the nodes of this rank, rising */
  PetscInt               start;        /* the system's number of owned[0] */

  int  Body(PetscInt node) const;
  bool Owns(PetscInt node) const { return number[node] >= start && number[node] < start + (PetscInt)owned.size(); }
  bool Fixed(PetscInt node) const; /* carries a Dirichlet condition on all its components */
  bool Singular() const;           /* A alone lets a body move */
  bool Constrained() const { return options.constraints && (pairs || !tie.empty()); }
  void Position(PetscInt node, PetscReal x[3]) const;
  /* The linear field of the patch test and of the periodic cell, zero in the origin, in bs components */
  void Linear(const PetscReal x[3], PetscReal u[3]) const;
  /* Young's modulus, or the conductivity, in cell (i,j,k) of a body */
  PetscReal Modulus(int body, const PetscInt ijk[3]) const;
};

/* A number in [0,1) that depends on its arguments alone */
PetscReal SceneRandom(PetscInt seed, int stream, PetscInt which);

/* The matrix of one cell at unit modulus; not joined: nodes that no simplex has both */
struct SceneCell {
  int                    nodes, bs;
  std::vector<PetscReal> K;
  std::vector<char>      joined;

  PetscReal       *Block(int a, int b) { return &K[(size_t)(a * nodes + b) * bs * bs]; }
  const PetscReal *Block(int a, int b) const { return &K[(size_t)(a * nodes + b) * bs * bs]; }
};

/* Nodes of a body that together give its displacement at a point, with their weights */
struct SceneInterpolation {
  int       size;
  PetscInt  node[10];
  PetscReal weight[10];
};

PetscErrorCode SceneCreate(MPI_Comm, Scene *); /* from the options, with its mesh */
PetscErrorCode ScenePartitionNodes(Scene *);
PetscErrorCode SceneCellCreate(const Scene &, const SceneBody &, const PetscReal corner[8][3], SceneCell *);
PetscErrorCode SceneInterpolate(const Scene &, int body, const PetscReal box[3], SceneInterpolation *);
PetscErrorCode SceneGetCoordinates(const Scene &, Vec *);
PetscErrorCode SceneGetRigidModes(const Scene &, MatNullSpace *); /* NULL for heat */

/*
   Rows of one node: natural numbers of the nodes that it is coupled with, itself among them, and a block for each;
   volume: its share of the body's
*/
struct SceneRow {
  std::vector<PetscInt>  node;
  std::vector<PetscReal> block;
  PetscReal              volume;
};
/* Where the rows come from; Dirichlet conditions are none of its business */
struct SceneRows {
  virtual ~SceneRows() { }
  virtual PetscErrorCode Neighbors(PetscInt node, std::vector<PetscInt> &) = 0;
  virtual PetscErrorCode Compute(PetscInt node, SceneRow &)                = 0;
};
PetscErrorCode SceneRowsOfCells(const Scene &, SceneRows **);
PetscErrorCode SceneRowsOfBeams(const Scene &, SceneRows **);
PetscErrorCode SceneAssemble(const Scene &, Mat *A, Vec *f);
PetscErrorCode SceneAssembleConstraints(const Scene &, Mat *C, Vec *g);

/* One row of C, and of g */
struct SceneConstraint {
  std::vector<PetscInt>  columns;
  std::vector<PetscReal> values;
  PetscReal              g;
};
/* A component of a node; of one with a Dirichlet condition nothing, it is held in the origin */
void SceneAppend(const Scene &, SceneConstraint &, PetscInt node, int component, PetscReal value);
/* From the rows of this rank */
PetscErrorCode SceneCreateConstraints(const Scene &, const std::vector<SceneConstraint> &, Mat *C, Vec *g);

/* Symmetry, rigid modes and more of the assembled matrices, printed */
PetscErrorCode SceneVerify(const Scene &, Mat A, Mat C, Vec f, Vec g);
/* Largest distance from the solution where it is known: the patch test, and the periodic cell without inclusions */
PetscErrorCode SceneVerifySolution(const Scene &, Vec x);

#endif
