/*
   Two elastic cubes in contact (V. Robert, P. Jolivet, O. Jamond, M. A. Badri, section 5.1), assembled in parallel:

       [ A  C' ] [ u      ]   [ f ]
       [ C  0  ] [ lambda ] = [ g ]

   Body 0, the lower cube, is the primary one: it fills [0,1]^2 x [-height,0] and its bottom is fixed. Body 1, the upper
   cube, is the secondary one: it fills [0,1]^2 x [0,height] and its top is pushed down. Both are made of Q1 hexahedra
   of linear isotropic elasticity; their meshes need not match. Every interface node of body 1 is projected orthogonally
   on the surface of body 0 and sticks to it (three rows of C) or slips along it (one row, in the direction of the
   normal).

   Nodes, elements and constraint rows have a *natural* number, given by index arithmetic, body 0 first, x running
   fastest. The system is the same on any number of ranks, up to the numbering of its unknowns.
*/
#ifndef TUTORIALS_CUBES_H
#define TUTORIALS_CUBES_H

#include "compat.h"
#include <petscmat.h>
#include <vector>

/*
   What the partition of the elements heeds: the volume meshes alone, as in the paper, or also which elements touch
   across the contact surface
*/
enum CubesPartition {
  CUBES_PARTITION_VOLUME,
  CUBES_PARTITION_CONTACT
};

struct CubesOptions {
  PetscInt  n[2];  /* elements per edge of the interface, body 0 and 1 */
  PetscInt  nz[2]; /* elements along the height */
  PetscReal E[2], nu[2];
  PetscReal height, gamma, gap, stick, curved;
  PetscReal rotate[3]; /* degrees */
  PetscBool floating, free, contact, nearNullSpace;
  PetscReal fraction, rowscale, inconsistent;
  PetscInt  duplicate, seed;
  PetscInt  partition; /* CubesPartition */
};

struct CubesBody {
  PetscInt n[3];          /* elements along x, y, z */
  PetscInt node, element; /* natural number of the first node and of the first element */

  PetscInt Node(PetscInt i, PetscInt j, PetscInt k) const { return node + i + (n[0] + 1) * (j + (n[1] + 1) * k); }
  PetscInt Element(PetscInt i, PetscInt j, PetscInt k) const { return element + i + n[0] * (j + n[1] * k); }
  PetscInt Nodes() const { return (n[0] + 1) * (n[1] + 1) * (n[2] + 1); }
  PetscInt Elements() const { return n[0] * n[1] * n[2]; }
  void     NodeIndices(PetscInt id, PetscInt ijk[3]) const
  {
    id -= node;
    ijk[0] = id % (n[0] + 1);
    ijk[1] = id / (n[0] + 1) % (n[1] + 1);
    ijk[2] = id / (n[0] + 1) / (n[1] + 1);
  }
};

struct CubesMesh {
  MPI_Comm                 comm;
  CubesOptions             options;
  CubesBody                body[2];
  PetscReal                rotation[3][3];
  PetscInt                 nodes, elements; /* of both bodies */
  std::vector<PetscMPIInt> part;            /* rank of each element, by natural number; the same on all ranks */
  /* node in the system's numbering, by natural number; the same on all ranks */
  std::vector<PetscInt> number;
  std::vector<PetscInt> owned; /* natural numbers of the nodes of this rank, rising */
  PetscInt              start; /* the system's number of owned[0] */

  int  Body(PetscInt node) const { return node >= body[1].node; }
  bool Owns(PetscInt node) const { return number[node] >= start && number[node] < start + (PetscInt)owned.size(); }
  PetscMPIInt Rank(PetscInt node) const;
  bool        Fixed(PetscInt node) const; /* carries a Dirichlet condition on its three components */
  /* Position in the frame of the cubes, before -rotate */
  void Position(PetscInt node, PetscReal x[3]) const;
  void Rotate(const PetscReal x[3], PetscReal y[3]) const;
};

struct CubesSystem {
  CubesMesh mesh;
  Mat       A, C;
  Vec       f, g;
};

/* The whole problem */
PetscErrorCode CubesOptionsGet(MPI_Comm, CubesOptions *);
PetscErrorCode CubesSystemCreate(MPI_Comm, const CubesOptions &, CubesSystem *);
PetscErrorCode CubesSystemDestroy(CubesSystem *);

/* Its parts */
PetscErrorCode CubesMeshCreate(MPI_Comm, const CubesOptions &, CubesMesh *);
/* Cuts the mesh anew, in at least as many parts as there are ranks; a system can be assembled if there are no more */
PetscErrorCode CubesMeshPartition(CubesMesh *, PetscMPIInt parts);
PetscErrorCode CubesMeshGetCoordinates(const CubesMesh &, Vec *);
PetscErrorCode CubesAssembleElasticity(const CubesMesh &, Mat *, Vec *);
PetscErrorCode CubesAssembleContact(const CubesMesh &, Mat *, Vec *);

/* The deformed bodies and nodal vectors on them, for ParaView */
PetscErrorCode CubesViewVTU(const CubesMesh &, Vec displacement, Vec force, const char file[]);

#endif
