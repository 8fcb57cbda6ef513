/* The input of a saddle-point problem: one or two matrices, their fields, and which fields are multipliers */
#ifndef AINSWORTH_LAYOUT_H
#define AINSWORTH_LAYOUT_H

#include "split.h"
#include "../base/objects.h"
#include <cstdint>
#include <string>

struct AinsworthSaddleBlocks;

/* A field of the program's vectors: its rows in the right-hand side and its columns in the solution */
struct AinsworthField {
  std::string      name;
  AinsworthRef<IS> rows, cols;
};
typedef std::vector<AinsworthField> AinsworthFields;

/* What the program passed, with what the program, a DM or options define */
struct AinsworthSaddleInputs {
  Mat                      amat = NULL, pmat = NULL;
  AinsworthFields          fields;         /* cover each row once; empty: no fields are defined */
  const char              *definedBy = ""; /* who defined them, in words */
  const char              *chosenBy  = ""; /* the option by which the last field is that of the multipliers, if any */
  std::vector<std::string> multipliers;    /* names or numbers of fields; empty: chosen by sign and shape */
  /* whether rows without a positive diagonal entry are detected as multipliers: 0 never, 1 always */
  PetscInt               detect = PETSC_DECIDE;
  PetscInt               bs     = PETSC_DECIDE; /* block size of A */
  PetscInt               dim    = 0;            /* dimension of the coordinates; 0: none */
  std::vector<PetscReal> coordinates;           /* of the nodes */
  PetscInt               located = 0;           /* how often coordinates were set */
};

/* layoutfields.cpp */
PetscErrorCode AinsworthIsNest(Mat, PetscBool *);
PetscErrorCode AinsworthChooseMatrix(const AinsworthSaddleInputs *, Mat *);
PetscErrorCode AinsworthFindFields(const AinsworthSaddleInputs *, Mat, const AinsworthSaddleBlocks *,
                                   AinsworthSaddleBlocks *);
PetscErrorCode AinsworthJoinFields(MPI_Comm, const AinsworthSaddleBlocks *, AinsworthSaddleBlocks *);

/* layoutnest.cpp */
PetscErrorCode AinsworthNestGetFields(Mat, AinsworthFields *);
PetscErrorCode AinsworthNestHides(Mat, PetscBool *);
PetscErrorCode AinsworthNestFlatten(Mat, AinsworthFields *);
PetscErrorCode AinsworthNestGetPart(Mat, const std::vector<PetscInt> &, const std::vector<PetscInt> &, Mat *);
PetscErrorCode AinsworthNestGetPartState(Mat, const std::vector<PetscInt> &, const std::vector<PetscInt> &, uint64_t *);

/* layoutindexed.cpp */
PetscErrorCode AinsworthExtractBlocks(Mat, const AinsworthSaddleBlocks *, AinsworthSaddleBlocks *);
PetscErrorCode AinsworthExtractPrimal(Mat, const AinsworthSaddleBlocks *, AinsworthSaddleBlocks *);

/* layoutdetect.cpp */
PetscErrorCode AinsworthDetectFields(Mat, AinsworthSaddleBlocks *);
PetscErrorCode AinsworthCheckDetected(const AinsworthSaddleBlocks *);

/* layoutalign.cpp */
PetscErrorCode AinsworthAlignFields(Mat, Vec);

/* layoutskew.cpp */
PetscErrorCode AinsworthFindSides(Mat, Vec *);

/* layoutdm.cpp */
PetscErrorCode AinsworthDMGetFields(DM, Mat, AinsworthFields *);

/* layoutchoice.cpp */
PetscErrorCode AinsworthChooseMultipliers(const AinsworthSaddleInputs *, Mat, AinsworthSaddleBlocks *);

/* layoutsign.cpp: kinds of diagonal entries */
enum AinsworthEntry {
  AINSWORTH_ENTRY_ZERO     = -2,
  AINSWORTH_ENTRY_NEGATIVE = -1,
  AINSWORTH_ENTRY_PLAIN    = 1, /* positive, and the only entry of its row */
  AINSWORTH_ENTRY_POSITIVE = 2
};
PetscErrorCode AinsworthClassifyDiagonal(Mat, Vec);
PetscErrorCode AinsworthFindSign(Mat, IS, Vec *);
PetscErrorCode AinsworthChangeSign(Vec, int, Mat);

/* The name under which a near null space that is made here has its source in words, for views */
constexpr char AinsworthModesSource[] = "AinsworthModesSource";

/* coordinates.cpp */
PetscErrorCode AinsworthSaddleCreateRigidModes(const AinsworthSaddleInputs *, Mat, const AinsworthSaddleBlocks *,
                                               MatNullSpace *);
PetscErrorCode AinsworthDMCreateRigidModes(DM, PetscInt, MatNullSpace *);
PetscErrorCode AinsworthMatCreateRigidModes(Mat, MatNullSpace *);

/* nearnullspace.cpp */
PetscErrorCode AinsworthFindRigidModes(const AinsworthSaddleInputs *, Mat, const AinsworthSaddleBlocks *,
                                       AinsworthSaddleBlocks *);

/* blocksize.cpp */
PetscErrorCode AinsworthFindBlockSize(const AinsworthSaddleInputs *, Mat, const AinsworthSaddleBlocks *,
                                      AinsworthSaddleBlocks *);

#endif
