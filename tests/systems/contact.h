/* Two elastic blocks, one on the other, whose meshes do not match */
#ifndef TESTS_SYSTEMS_CONTACT_H
#define TESTS_SYSTEMS_CONTACT_H

#include "systems.h"

/*
   The lower block is held at its bottom; the top of the upper one slides without friction on what presses it, so that
   contact alone holds it up
*/
struct Blocks {
  Matrix A, normal, tangent; /* gaps of the upper block's nodes over the lower one, and slips */
  Vector f;
};
/* elements along the interface; stiffness of the upper block over that of the lower */
Blocks BlocksMake(int lower, int upper, double stiffness);
void   ContactMake(Saddle &, const Blocks &); /* frictionless: B = C, D = 0 */

#endif
