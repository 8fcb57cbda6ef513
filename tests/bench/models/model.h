/*
   Constraints as engineering models have them, on the two cubes of cubes.h: long rows (mean values, RBE3), shared
   unknowns (RBE2, a macroscopic strain), chains, rows that mix components, dependent rows, embedded fibers:

       [ A  C' ] [ u      ]   [ f ]
       [ C  0  ] [ lambda ] = [ g ]

   Unknowns that no mesh has, of reference nodes and fibers, follow those of the cubes on the last rank, three a node.
   Without a spring or a fiber their rows of A are zero. Bodies are held by the Dirichlet conditions of the cubes or,
   with -floating, by these constraints alone.
*/
#ifndef TUTORIALS_MODEL_H
#define TUTORIALS_MODEL_H

#include "../cubes.h"

enum ModelType {
  MODEL_TIES,      /* nodes of the upper interface equal those of the lower one */
  MODEL_CYCLIC,    /* ... turned by -angle about (1,1,1) */
  MODEL_CHAIN,     /* ... by way of -links nodes */
  MODEL_REDUNDANT, /* ... with a third of the rows dependent on the others */
  MODEL_MORTAR,    /* weighted means over windows of 5 x 5 nodes of either side: 50 entries a row */
  MODEL_MEAN,      /* mean translation and rotation of the first nodes of the upper body: six rows */
  MODEL_RBE2,      /* patches of both sides follow a reference node of six unknowns */
  MODEL_RIGID,     /* ... which is eliminated: three nodes of the patch carry the others */
  MODEL_RBE3,      /* the reference node follows the mean of the patches */
  MODEL_PERIODIC,  /* the cubes are periodic in x and y, up to a strain that is unknown */
  MODEL_STRAIN,    /* ... that is given */
  MODEL_FIBERS     /* lines of bars in the upper body, their nodes tied to the centers of its elements */
};

struct ModelOptions {
  PetscInt  type;   /* ModelType */
  PetscInt  slaves; /* unknowns that constraints express by others; 0: all there can be */
  PetscInt  patch;  /* nodes along the edge of a patch of a spider; 0: the interface is one patch */
  PetscInt  links;
  PetscReal angle, spring, contrast;
};

struct ModelRow {
  std::vector<std::pair<PetscInt, PetscReal>> entries; /* column, value */
  PetscReal                                   g;
  bool                                        dependent; /* on other rows */
};

/* A bar between two nodes beyond the cubes, numbered from 0, along y */
struct ModelBar {
  PetscInt  node[2];
  PetscReal stiffness;
};

struct Model {
  const char            *name;
  ModelOptions           options;
  CubesMesh              mesh;
  std::vector<ModelRow>  rows;   /* of this rank */
  PetscInt               slaves; /* there are */
  std::vector<PetscReal> extra;  /* coordinates of the nodes beyond the cubes, on all ranks */
  std::vector<ModelBar>  bars;   /* on all ranks */
  Mat                    A, C;
  Vec                    f, g;
};

PetscErrorCode ModelCreate(MPI_Comm, Model *);
PetscErrorCode ModelDestroy(Model *);
/* Fills rows, slaves, extra and bars */
PetscErrorCode ModelCreateRows(Model *);
/* C and g, without the rows that depend on others where it says so */
PetscErrorCode ModelAssembleRows(const Model &, bool independent, Mat *, Vec *);

#endif
