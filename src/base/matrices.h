/* Matrices of any type as AIJ matrices, sums, rows and entries of these, and the nodes that their patterns show */
#ifndef AINSWORTH_MATRICES_H
#define AINSWORTH_MATRICES_H

#include "arrays.h"
#include <cstdint>
#include <functional>

/* Mixes a number into another that stands for many */
inline uint64_t AinsworthMixState(uint64_t state, uint64_t number)
{
  state = (state ^ number) * 0xff51afd7ed558ccdu;
  return state ^ (state >> 32);
}

/* entries.cpp: sizes of entries, and rows */
PetscErrorCode AinsworthVecGather(Vec, PetscInt, const PetscInt[], Vec *);
PetscErrorCode AinsworthAbsoluteMult(Mat, Vec, Vec);
PetscErrorCode AinsworthAbsoluteMultTranspose(Mat, Vec, Vec);
PetscErrorCode AinsworthRowSums(Mat, int, Vec);
PetscErrorCode AinsworthRowSquares(Mat, Vec, Vec);
PetscErrorCode AinsworthScaleColumns(Mat, Vec, Mat *);
PetscErrorCode AinsworthAddToOwners(Mat, const PetscScalar[], Vec);
PetscErrorCode AinsworthCountRows(Mat, PetscInt, Vec *);
PetscErrorCode AinsworthSampleRows(Mat, PetscInt, PetscInt, PetscInt, IS *, PetscInt *);
PetscErrorCode AinsworthGetRows(Mat, const std::vector<PetscInt> &, std::vector<Vec> *);
PetscErrorCode AinsworthFormValue(Mat, Vec, PetscReal *);

/* aij.cpp */
PetscErrorCode AinsworthFindOpaque(Mat, Mat *);
PetscErrorCode AinsworthGetTransposed(Mat, Mat *, PetscBool *);
PetscErrorCode AinsworthCheckEntries(Mat, const char[], const char[], PetscBool *);
PetscErrorCode AinsworthGetAIJ(Mat, Mat *);
PetscErrorCode AinsworthGetHostAIJ(Mat, Mat *);
PetscErrorCode AinsworthCopyNullSpaces(Mat, Mat);

/* sum.cpp */
PetscErrorCode AinsworthAddAIJ(PetscScalar, const std::vector<Mat> &, Mat *);
PetscErrorCode AinsworthMakePatternSymmetric(Mat *);
PetscErrorCode AinsworthStoreDiagonal(Mat *);

/* nodes.cpp: part of the nodes that have to agree, and the largest number of their unknowns, that of shells */
constexpr PetscReal AinsworthNodesEnough  = 0.9;
constexpr PetscInt  AinsworthNodesLargest = 6;
struct AinsworthNodeRows {
  bool     votes   = true; /* no row has a single entry, as with Dirichlet conditions */
  bool     same    = true; /* all rows touch the same nodes */
  PetscInt touched = 0;    /* nodes that the first row touches */
  PetscInt entries = 0;    /* of all rows */
};
typedef std::function<void(std::vector<PetscInt> *)> AinsworthToNodes; /* replaces columns by their nodes, ascending */
PetscErrorCode                                       AinsworthBlocksDivide(Mat, PetscInt, PetscBool *);
PetscErrorCode                                       AinsworthGetColumns(Mat, PetscInt, std::vector<PetscInt> *);
PetscErrorCode AinsworthCompareRows(Mat, PetscInt, PetscInt, PetscInt, const AinsworthToNodes &, AinsworthNodeRows *);
PetscErrorCode AinsworthFindNodes(Mat, PetscInt *, std::vector<PetscInt> *);

/* merge.cpp */
PetscErrorCode AinsworthMergeAIJ(MPI_Comm, const std::vector<IS> &, const std::vector<IS> &, const std::vector<Mat> &,
                                 Mat *);

#endif
