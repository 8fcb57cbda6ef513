/* Copies of the blocks of a Hermitian matrix of which half is stored */
#ifndef AINSWORTH_HALF_H
#define AINSWORTH_HALF_H

#include "lowbits.h"

/*
   Appends a block of the matrix, unchanged or with its rows and columns scaled; low: NULL, or gets the bits that values
   in single precision lack
*/
template <class T>
void AinsworthTakeBlock(PetscInt j, const PetscScalar *a, const PetscReal *rows, const PetscReal *columns,
                        AinsworthBlockRowsOf<T> *taken, std::vector<std::int32_t> *low = NULL)
{
  constexpr int parts = sizeof(PetscScalar) / sizeof(PetscReal);
  const size_t  n = taken->a.size(), size = taken->size();

  taken->j.push_back(j);
  taken->a.resize(n + size);
  if (low) low->resize(parts * (n + size));
  AinsworthDispatch(taken->br, [&](auto B) {
    const PetscInt b    = B() ? B() : taken->br;
    T             *to   = taken->a.data() + n;
    std::int32_t  *bits = low ? low->data() + parts * n : NULL;

    for (PetscInt p = 0; p < b; p++)
      for (PetscInt q = 0; q < b; q++) {
        const PetscScalar v = rows ? a[p * b + q] * rows[p] * columns[q] : a[p * b + q];

        to[p * b + q] = (T)v;
        if constexpr (std::is_same<T, AinsworthSingle>::value) {
          if (bits) AinsworthLowBits(v, to[p * b + q], bits + parts * (p * b + q));
        }
      }
  });
}

/*
   The blocks between owned nodes on and above the diagonal, the diagonal block first in each row, scaled by w on both
   sides unless it is NULL; low: the bits that single precision lacks, if asked for
*/
template <class T>
class AinsworthUpperHalf {
public:
  std::shared_ptr<AinsworthBlockRowsOf<T>>   rows;
  std::shared_ptr<std::vector<std::int32_t>> low;

  AinsworthUpperHalf(const AinsworthBlockRows &pattern, const PetscReal *scale, bool split = false)
    : rows(std::make_shared<AinsworthBlockRowsOf<T>>(pattern.br, pattern.br)), w(scale)
  {
    size_t n = pattern.n; /* rows without a diagonal block get one */

    for (PetscInt i = 0; i < pattern.n; i++)
      for (PetscInt k = pattern.i[i]; k < pattern.i[i + 1]; k++) n += pattern.j[k] > i && pattern.j[k] < pattern.n;
    rows->i.reserve(pattern.n + 1);
    rows->j.reserve(n);
    rows->a.reserve(n * pattern.size() + 4);
    if (!split) return;
    low = std::make_shared<std::vector<std::int32_t>>();
    low->reserve((n * pattern.size() + 4) * sizeof(PetscScalar) / sizeof(PetscReal));
  }
  /* Appends the next row from all of its blocks */
  void add(const AinsworthBlockRows &pattern, const PetscScalar *a)
  {
    const PetscInt i = rows->n, first = pattern.i[i], end = pattern.i[i + 1], bs = rows->br;
    auto           take = [&](PetscInt k) {
      const PetscScalar *block = a + (size_t)(k - first) * pattern.size();
      const PetscReal   *wi = w ? w + i * bs : NULL, *wj = w ? w + pattern.j[k] * bs : NULL;

      AinsworthTakeBlock(pattern.j[k], block, wi, wj, rows.get(), low.get());
    };

    for (PetscInt k = first; k < end; k++)
      if (pattern.j[k] == i) take(k);
    if ((PetscInt)rows->j.size() == rows->i.back()) { /* the matrix has no diagonal block here */
      rows->j.push_back(i);
      rows->a.resize(rows->a.size() + pattern.size(), T(0));
      fillLow();
    }
    for (PetscInt k = first; k < end; k++)
      if (pattern.j[k] > i && pattern.j[k] < pattern.n) take(k);
    rows->endRow();
    if (rows->n == pattern.n) {
      rows->a.resize(rows->a.size() + 4, T(0)); /* loads of four may read beyond the last block */
      fillLow();
    }
  }

private:
  const PetscReal *w;

  void fillLow()
  {
    if (low) low->resize(rows->a.size() * sizeof(PetscScalar) / sizeof(PetscReal), 0);
  }
};

std::shared_ptr<const AinsworthBlockRowsOf<AinsworthSingle>> AinsworthHalfRound(const AinsworthBlockRows &,
                                                                                const PetscReal *);

template <class T>
void           AinsworthTakeBlocks(const AinsworthBlockMat &, AinsworthUpperHalf<T> *, AinsworthBlockMat *);
void           AinsworthHalfTake(const AinsworthBlockMat &, AinsworthHalf *);
PetscErrorCode AinsworthHalfAdd(const AinsworthHalf &, const AinsworthHalf &, AinsworthHalf *);

#endif
