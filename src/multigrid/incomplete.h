/* Incomplete Cholesky factors of a level in single precision (docs/multigrid.md) */
#ifndef AINSWORTH_INCOMPLETE_H
#define AINSWORTH_INCOMPLETE_H

#include "product.h"

/*
   (U' + D) D^{-1} (D + U), which has the entries of a matrix wherever its blocks between owned nodes have any: IC(0) by
   blocks, without couplings of ranks (Meijerink, van der Vorst, Math. Comp. 31, 1977)
*/
class AinsworthIncomplete {
public:
  typedef AinsworthBlockRowsOf<AinsworthSingle> Rows;

  /*
     Returns NULL if a pivot is not positive definite; an unknown without entries gets the diagonal 1

     added: NULL, or what is added to the blocks of the upper half; scale: of its unknowns, from both sides
  */
  static std::shared_ptr<const AinsworthIncomplete> create(const std::shared_ptr<const Rows> &upper,
                                                           const AinsworthBlockRows *added, const PetscReal *scale);
  /* Solves in place for a multivector, as those of AinsworthProduct */
  void solve(PetscInt width, AinsworthSingle *x) const;

private:
  std::shared_ptr<const Rows>  pattern;
  std::vector<AinsworthSingle> values; /* in its order: D^{-1}, then the blocks of U */

  void add(const AinsworthBlockRows &, const PetscReal *);
  template <int BS>
  bool factor();
  template <int BS, int W>
  void solveBlocks(AinsworthSingle *x) const;
};

#endif
