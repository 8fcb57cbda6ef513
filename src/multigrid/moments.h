/*
   The Lanczos process by moments of Chebyshev polynomials (Sack, Donovan, An algorithm for Gaussian quadrature given
   modified moments, Numer. Math. 18, 1971): all inner products are added up at the end, so that its steps take one
   reduction
*/
#ifndef AINSWORTH_MOMENTS_H
#define AINSWORTH_MOMENTS_H

#include "kernels.h"
#include <vector>

/*
   One step with the polynomials T_k of X = scale A - 1: T_1 = X, T_{k+1} = 2 X T_k - T_{k-1}

   next holds A T_k v, and becomes T_k v of the next step as now becomes that of the last one; with: what T_k v is
   multiplied with, itself or a weight times itself; moments: gets two sums of this rank
*/
template <class V>
void AinsworthMomentsAdvance(PetscReal scale, const V &with, V *before, V *now, V *next,
                             std::vector<PetscReal> *moments)
{
  typedef decltype(std::real(typename V::value_type())) Real;
  const Real                                            once = (Real)scale, twice = (Real)(2.0 * scale), two = 2;
  PetscReal                                             sum[2] = {0.0, 0.0};

  for (size_t l = 0; l < now->size(); l++) {
    const auto X = moments->empty() ? once * (*next)[l] - (*now)[l]
                                    : twice * (*next)[l] - two * (*now)[l] - (*before)[l];

    (*next)[l] = X;
    sum[0] += (PetscReal)std::real(AinsworthConj(with[l]) * (*now)[l]);
    sum[1] += (PetscReal)std::real(AinsworthConj(with[l]) * X);
  }
  moments->insert(moments->end(), sum, sum + 2);
  before->swap(*now);
  now->swap(*next);
}

PetscReal      AinsworthHash(size_t);
PetscErrorCode AinsworthMomentsReduce(MPI_Comm, std::vector<PetscReal> *);
PetscErrorCode AinsworthMomentsFindLargest(const std::vector<PetscReal> &moments, PetscReal *largest);

#endif
