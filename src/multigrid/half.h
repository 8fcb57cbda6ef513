/* Copies of the blocks of a Hermitian matrix of which half is stored */
#ifndef AINSWORTH_HALF_H
#define AINSWORTH_HALF_H

#include "lowbits.h"

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

/* Appends the bits that single precision lacks of the block that was taken last */
inline void AinsworthTakeLowBits(const PetscScalar *a, const PetscReal *rows, const PetscReal *columns,
                                 const AinsworthBlockRowsOf<AinsworthSingle> &taken, std::vector<std::int32_t> *low)
{
  const PetscInt         bs     = taken.br;
  const AinsworthSingle *single = taken.block((PetscInt)taken.j.size() - 1);

  AinsworthDispatch(bs, [&](auto B) {
    constexpr int  parts = sizeof(PetscScalar) / sizeof(PetscReal);
    const PetscInt b     = B() ? B() : bs;
    const size_t   n     = low->size();
    std::int32_t  *next  = NULL, room[B() ? B() * B() * parts : 1];

    if (!B()) low->resize(n + (size_t)(b * b * parts));
    next = B() ? room : low->data() + n;
    for (PetscInt p = 0; p < b; p++)
      for (PetscInt q = 0; q < b; q++) {
        const PetscScalar v = a[p * b + q] * rows[p] * columns[q];

        *next++ = AinsworthLowBits(PetscRealPart(v), std::real(single[p * b + q]));
        if constexpr (parts > 1) *next++ = AinsworthLowBits(PetscImaginaryPart(v), std::imag(single[p * b + q]));
      }
    if (B()) low->insert(low->end(), room, next);
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
    const size_t n = (pattern.j.size() + pattern.n) / 2 + 1;

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

      AinsworthTakeBlock(pattern.j[k], block, wi, wj, rows.get());
      if constexpr (std::is_same<T, AinsworthSingle>::value)
        if (low) AinsworthTakeLowBits(block, wi, wj, *rows, low.get());
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
