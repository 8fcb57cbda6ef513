/* Gathers the Gram matrix on one rank; cuts and orders its graph with METIS */
#ifndef AINSWORTH_GRAPH_H
#define AINSWORTH_GRAPH_H

#include "../base/csr.h"
#include <vector>

void           AinsworthGraphComponents(const AinsworthCSR &, std::vector<PetscInt> *);
PetscErrorCode AinsworthGraphGather(Mat, bool, Mat **);
PetscErrorCode AinsworthGraphOfNodes(const std::vector<Mat> &, PetscInt, Mat **);
PetscErrorCode AinsworthGraphCut(Mat, PetscInt, IS *);
PetscErrorCode AinsworthGraphDissect(Mat, MatOrderingType, IS *, IS *);

#endif
