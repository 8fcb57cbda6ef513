/* The table of scenes: their names and the defaults of their options */
#ifndef TUTORIALS_SCENES_LIST_H
#define TUTORIALS_SCENES_LIST_H

#include "scene.h"

struct SceneKind {
  const char *name;
  int         element, inclusion, count;
  PetscReal   contrast;
  PetscInt    n;
  PetscReal   aspect, bend, stick;
};

/* Those before are of one body and have no constraints */
const int SCENE_FIRST_TIED = 9;

extern const SceneKind sceneKinds[];
extern const int       sceneKindCount;

/* From s.options: name, dim, physics, bodies and ties, nodes and cells */
void SceneAddBodies(Scene &s);

#endif
