/* Copies of the blocks of a Hermitian matrix of which half is stored */
#ifndef AINSWORTH_HALF_H
#define AINSWORTH_HALF_H

#include "blocks.h"

/* Appends a block of the matrix, unchanged or with its rows and columns scaled */
template <class T>
void AinsworthTakeBlock(PetscInt j, const PetscScalar *a, const PetscReal *rows, const PetscReal *columns,
                        AinsworthBlockRowsOf<T> *taken)
{
  const PetscInt bs = taken->br;

  taken->j.push_back(j);
  AinsworthDispatch(bs, [&](auto B) {
    const PetscInt b = B() ? B() : bs;
    T              scaled[B() ? B() * B() : 1], *to = scaled;

    if (!rows) taken->a.insert(taken->a.end(), a, a + b * b);
    else if (!B())
      for (PetscInt p = 0; p < b * b; p++) taken->a.push_back((T)(a[p] * rows[p / b] * columns[p % b]));
    else {
      for (PetscInt p = 0; p < b; p++)
        for (PetscInt q = 0; q < b; q++) *to++ = (T)(a[p * b + q] * rows[p] * columns[q]);
      taken->a.insert(taken->a.end(), scaled, to);
    }
  });
}

/*
   The blocks between owned nodes on and above the diagonal, the diagonal block first in each row, scaled by w on both
   sides unless it is NULL
*/
template <class T>
class AinsworthUpperHalf {
public:
  std::shared_ptr<AinsworthBlockRowsOf<T>> rows;

  AinsworthUpperHalf(const AinsworthBlockRows &pattern, const PetscReal *scale)
    : rows(std::make_shared<AinsworthBlockRowsOf<T>>(pattern.br, pattern.br)), w(scale)
  {
    const size_t n = (pattern.j.size() + pattern.n) / 2 + 1;

    rows->i.reserve(pattern.n + 1);
    rows->j.reserve(n);
    rows->a.reserve(n * pattern.size() + 4);
  }
  /* Appends the next row from all of its blocks */
  void add(const AinsworthBlockRows &pattern, const PetscScalar *a)
  {
    const PetscInt i = rows->n, first = pattern.i[i], end = pattern.i[i + 1], bs = rows->br;
    auto           take = [&](PetscInt k) {
      AinsworthTakeBlock(pattern.j[k], a + (size_t)(k - first) * pattern.size(), w ? w + i * bs : NULL,
                         w ? w + pattern.j[k] * bs : NULL, rows.get());
    };

    for (PetscInt k = first; k < end; k++)
      if (pattern.j[k] == i) take(k);
    if ((PetscInt)rows->j.size() == rows->i.back()) { /* the matrix has no diagonal block here */
      rows->j.push_back(i);
      rows->a.resize(rows->a.size() + pattern.size(), T(0));
    }
    for (PetscInt k = first; k < end; k++)
      if (pattern.j[k] > i && pattern.j[k] < pattern.n) take(k);
    rows->endRow();
    if (rows->n == pattern.n)
      rows->a.resize(rows->a.size() + 4, T(0)); /* loads of four may read beyond the last block */
  }

private:
  const PetscReal *w;
};

std::shared_ptr<const AinsworthBlockRowsOf<AinsworthSingle>> AinsworthHalfRound(const AinsworthBlockRows &,
                                                                                const PetscReal *);

void AinsworthTakeBlocks(const AinsworthBlockMat &, AinsworthUpperHalf<PetscScalar> *,
                         AinsworthUpperHalf<AinsworthSingle> *, AinsworthBlockMat *);
void AinsworthHalfTake(const AinsworthBlockMat &, AinsworthHalf *);
PetscErrorCode AinsworthHalfAdd(const AinsworthHalf &, const AinsworthHalf &, AinsworthHalf *);

#endif
