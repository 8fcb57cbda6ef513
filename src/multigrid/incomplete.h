/* Incomplete Cholesky factors of a level in single precision (docs/multigrid.md) */
#ifndef AINSWORTH_INCOMPLETE_H
#define AINSWORTH_INCOMPLETE_H

#include "product.h"

/*
   (U' + D) D^{-1} (D + U), which has the entries of a matrix wherever its blocks between owned nodes have any: IC(0) by
   blocks, without couplings of ranks (Meijerink, van der Vorst, Math. Comp. 31, 1977)

   Some nodes may come last, where the factor ends: what solves there, between the two passes, is up to the caller
*/
class AinsworthIncomplete {
public:
  typedef AinsworthBlockRowsOf<AinsworthSingle> Rows;

  /*
     Returns NULL if a pivot is not positive definite; an unknown without entries gets the diagonal 1

     added: NULL, or what is added to the blocks of the upper half; scale: of its unknowns, from both sides; last: marks
     the nodes that come last, or is empty
  */
  static std::shared_ptr<const AinsworthIncomplete> create(const std::shared_ptr<const Rows> &upper,
                                                           const AinsworthBlockRows *added, const PetscReal *scale,
                                                           const std::vector<char> &last);
  /* Solves with U' + D in place for a multivector, as those of AinsworthProduct; nodes that come last get b - U' y */
  void forward(PetscInt width, AinsworthSingle *x) const;
  /* Solves with D^{-1} (D + U) in place, from what nodes that come last have */
  void backward(PetscInt width, AinsworthSingle *x) const;
  bool comesLast(PetscInt node) const { return pattern->i[node] == pattern->i[node + 1]; }

private:
  std::shared_ptr<const Rows>  pattern; /* rows of nodes that come last are empty */
  std::vector<AinsworthSingle> values;  /* in its order: D^{-1}, then the blocks of U */

  void add(const AinsworthBlockRows &, const PetscReal *);
  void moveLast(const std::vector<char> &);
  template <int BS>
  bool factor();
  template <int BS, int W>
  void forwardBlocks(AinsworthSingle *x) const;
  template <int BS, int W>
  void backwardBlocks(AinsworthSingle *x) const;
};

#endif
