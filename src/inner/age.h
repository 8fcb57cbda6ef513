/*
   Whether a preconditioner of an earlier matrix is kept, from counts of iterations (docs/contact.md). Plain C++,
   without MPI and PETSc
*/
#ifndef AINSWORTH_AGE_H
#define AINSWORTH_AGE_H

/* What a solver has taken since its preconditioner was made */
struct AinsworthAge {
  /* Solves are counted separately for each number of decades of reduction, up to this many */
  static const int decades = 17;

  int    took[decades] = {};  /* iterations of the first solve for so many decades; -1 if none yet */
  int    last          = -1;  /* iterations of the last solve; -1 before the first one */
  int    solves        = 0;   /* since the matrix changed */
  double extra         = 0.0; /* iterations in excess of the first solve: of the last of these solves */
  double more          = 0.0; /* of all of them */

  AinsworthAge();
};

int    AinsworthAgeDecades(double rtol);
double AinsworthAgeFirst(const AinsworthAge &, int decades);
void   AinsworthAgeCount(AinsworthAge *, int iterations, int decades, bool old);
bool   AinsworthAgeKeeps(const AinsworthAge &, double price);
double AinsworthAgeLimit(const AinsworthAge &, int decades, double price);

#endif
