/* The connected components of the Gram matrix, found from the rows of C before it is formed */
#ifndef AINSWORTH_LABELS_H
#define AINSWORTH_LABELS_H

#include "../base/arrays.h"
#include "../base/objects.h"
#include <vector>

/* AIJ rows that are linked if they have a column in common */
struct AinsworthLinks {
  Mat  M;
  Vec  weight = NULL;  /* columns where it is zero link nothing; NULL: all link */
  bool square = false; /* column i links to row i as well */
};

/* Labels each local row by the smallest row of its component */
class AinsworthLabels {
public:
  PetscInt              rstart = 0;
  std::vector<PetscInt> label;   /* of the local rows */
  std::vector<PetscInt> entries; /* of the local rows */
  /* the rank that owns most of the unknowns of each local row of the first matrix, this one if it has none */
  std::vector<PetscInt> home;

  /* Labels the components within each rank. All matrices have the same rows. Collective */
  PetscErrorCode open(const std::vector<AinsworthLinks> &links);
  /* Merges components across ranks. Collective */
  PetscErrorCode connect();

private:
  /* The columns of one matrix; a row stands for all that have the column, -1 if none has */
  struct Columns {
    AinsworthRef<PetscSF> sf; /* from columns to where they are on other ranks; NULL on one rank */
    std::vector<PetscInt> own, others;
  };
  MPI_Comm              comm = MPI_COMM_NULL;
  std::vector<Columns>  all;
  std::vector<PetscInt> parent; /* of local rows, toward the first of its component on this rank */

  PetscInt       find(PetscInt row);
  void           link(PetscInt row, PetscInt *stands);
  PetscErrorCode add(const AinsworthLinks &links, Columns *columns);
  PetscErrorCode findHomes(Mat M, const PetscScalar *const weight[2]);
};

#endif
