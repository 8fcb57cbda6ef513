/* Block matrices of small lattices of nodes, the same on any number of ranks */
#ifndef TESTS_LATTICE_H
#define TESTS_LATTICE_H

#include "dense.h"

/*
   Nodes on a grid of two or three directions, each coupled to its neighbors, diagonal ones among them. Blocks of 2 and
   3: a truss, whose bars feel rigid motions not at all; others: a stiffness for each pair that feels constants not at
   all. Nodes are numbered layer by layer along the last direction; the first layer is held.
*/
struct Lattice {
  PetscInt  bs = 3, n = 4, layers = 6; /* n nodes along the other directions */
  PetscReal contrast = 1.0;            /* stiffness of the upper half of the layers */
  bool      apart    = false;          /* the halves are not coupled; both are held */
  bool      floating = false;          /* nothing holds the lattice, of two parts the upper one */
  bool      alone    = false;          /* every seventh node has nothing but its diagonal */
  enum {
    EVEN,
    HOLE,  /* rank 1 has nothing */
    SMALL, /* rank 1 has one node */
    LAST   /* all on the last rank */
  } layout = EVEN;

  PetscInt dim() const { return bs == 2 ? 2 : 3; }
  PetscInt nodes() const { return (bs == 2 ? n : n * n) * layers; }
};

PetscErrorCode LatticeCreate(const Lattice &, Mat *A);
/* S A S*, S diagonal: blocks are no longer symmetric, and no modes are kept */
PetscErrorCode LatticeScale(Mat A);
/* dim coordinates of each node of this rank */
PetscErrorCode LatticeCoordinates(const Lattice &, Mat A, std::vector<PetscReal> &);
/* rigid motions, or constants where blocks are neither of 2 nor of 3 */
PetscErrorCode LatticeSetNearNullSpace(const Lattice &, Mat A);
/*
   sum of stiffness v v', each v on some unknowns of two nodes, first and last ones of the lattice: few rows, with
   neighbors that A does not have
*/
PetscErrorCode SurfaceCreate(const Lattice &, Mat A, PetscReal stiffness, PetscInt pairs, Mat *D);
PetscErrorCode SumCreate(Mat A, Mat D, Mat *sum); /* MATCOMPOSITE */
/* CG with PCBLOCKSA, options read */
PetscErrorCode MultigridCreate(Mat, KSP *);
PetscErrorCode LayoutName(const Lattice &, const char **);

#endif
