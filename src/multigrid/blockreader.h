/* The rows of an AIJ matrix as rows of blocks */
#ifndef AINSWORTH_BLOCKREADER_H
#define AINSWORTH_BLOCKREADER_H

#include "blocks.h"
#include "../base/csr.h"

/*
   The rows of an AIJ matrix, whose arrays are open as long as this lives
*/
class AinsworthBlockReader : public AinsworthRowReader {
public:
  AinsworthBlockReader()                                        = default;
  AinsworthBlockReader(const AinsworthBlockReader &)            = delete;
  AinsworthBlockReader &operator=(const AinsworthBlockReader &) = delete;
  ~AinsworthBlockReader() override;

  PetscErrorCode     open(Mat A, PetscInt bs, const std::vector<PetscInt> &order, const std::vector<char> *marked,
                          AinsworthBlockMat *B);
  const PetscScalar *read(const AinsworthBlockRows &pattern, PetscInt row) override;

private:
  /* One of the two parts of the local rows: owned or ghost columns */
  struct Part : AinsworthCSR {
    std::vector<PetscInt> columns; /* new number of each column, ghosts after owned ones; empty if unchanged */
  };

  PetscErrorCode numberUnknowns(PetscInt ng, const PetscInt garray[], std::vector<PetscInt> *ghosts);
  bool           hasFullBlocks(PetscInt node) const;
  void           findColumns(PetscInt node, AinsworthBlockRows *pattern);
  template <class F>
  void forEach(PetscInt node, F) const;

  AinsworthRef<Mat>        mat;
  PetscInt                 bs = 1;
  std::vector<PetscInt>    order; /* the local rows node by node; empty if they are stored so */
  std::vector<Part>        parts;
  std::vector<char>        full; /* nodes whose rows have the same pattern of full blocks, copied without a search */
  std::vector<PetscInt>    at;   /* where in the row being read each place is */
  std::vector<PetscScalar> room; /* the row being read */
};

#endif
