/* One constant rotation of the displacement components, into the frame of the dominant contact normal (docs/method.md, frame) */
#ifndef AINSWORTH_FRAME_H
#define AINSWORTH_FRAME_H

#include "../petsccompat.h"

struct AinsworthFrame {
  PetscInt  bs;      /* components of a node, 2 or 3; 0: no rotation, all functions below leave things as they are */
  PetscReal T[3][3]; /* orthogonal: x' = T x at every node */
  PetscReal normal[3];
};

PetscErrorCode AinsworthFrameChoose(Mat, PetscInt, AinsworthFrame *);
PetscErrorCode AinsworthFrameComponentsApart(Mat, PetscInt, PetscBool *);
PetscErrorCode AinsworthFrameRotate(const AinsworthFrame *, PetscBool, Vec);
PetscErrorCode AinsworthFrameRotateRows(const AinsworthFrame *, Mat, Mat *);
PetscErrorCode AinsworthFrameRotateNullSpace(const AinsworthFrame *, Mat, MatNullSpace, MatNullSpace *);

#endif
