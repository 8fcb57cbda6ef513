/* What conjugate gradients in Ker C add to a preconditioner for what its matrix M leaves out (docs/method.md) */
#ifndef AINSWORTH_DEFLATION_H
#define AINSWORTH_DEFLATION_H

#include "../base/bordered.h"

/* What M leaves out */
struct AinsworthLeftOut {
  PetscInt              longest = PETSC_MAX_INT; /* rows of C with more entries */
  std::vector<PetscInt> shared;                  /* unknowns that M holds, global numbers, the same on all ranks */
};

/*
   Long rows of C: M^{-1} r is projected onto their kernel along L = M^{-1} C', as if M had been made with them, to
   M^{-1} - L (C L)^{-1} L'. The projector would do so along W C', which is rough and costs an iteration or two per row

   Unknowns that many rows of C share, such as reference nodes and macroscopic strains, which M holds with their slaves:
   with the responses Z in Ker C of the system to motions of single shared unknowns, computed with the above, and Y = Q'
   A Z, Z' Y = I, Q M^{-1} becomes (I - Z Y') Q M^{-1} (I - Y Z') + Z Z'

   The first takes directions away and needs no product with A, the second adds some: neither is a case of the other
*/
class AinsworthDeflation {
public:
  ~AinsworthDeflation();
  AinsworthDeflation()                                      = default;
  AinsworthDeflation(const AinsworthDeflation &)            = delete;
  AinsworthDeflation &operator=(const AinsworthDeflation &) = delete;

  /*
     Computes L, Z and Y, if that has not been done, with the preconditioner M^{-1}, the reduced operator and that in
     Ker C, Q' A. Collective
  */
  PetscErrorCode setUp(PC inner, Mat reduced, Mat operation, const AinsworthLeftOut &left);

  /* Computes z = Q M^{-1} r with the corrections */
  PetscErrorCode apply(PC inner, Mat reduced, Vec r, Vec z) const;
  /*
     The two parts of that: of r comes the `rest`, which may be r, to which M^{-1} is applied, and z becomes Q z with
     the corrections; parts: what the first gives to the second
  */
  PetscErrorCode before(Vec r, std::vector<PetscScalar> *parts, Vec rest) const;
  PetscErrorCode after(Mat reduced, Vec rest, const std::vector<PetscScalar> &parts, Vec z) const;
  bool           empty() const { return motions.empty() && longRows.lifted.empty(); }

private:
  PetscErrorCode move(PC inner, Mat reduced, Mat operation, const std::vector<PetscInt> &shared);
  PetscErrorCode clear();

  AinsworthBordered longRows;
  std::vector<Vec>  motions, forces; /* Z and Y */
  bool              complete = false;
};

#endif
