#include "coarsen.h"

/* Sums up the entries of one block row; other: whether each of its unknowns has a nonzero entry off the diagonal */
template <int BS>
static void SurveyRow(const AinsworthBlockMat &A, PetscInt i, AinsworthBlockSurvey *survey, std::vector<char> &other)
{
  const AinsworthBlockRows &rows = A.rows;
  const PetscInt            bs   = BS ? BS : rows.br;
  const PetscScalar        *a    = A.row(i);

  for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++, a += bs * bs) {
    const bool diagonal = rows.j[k] == i;
    PetscReal  sum      = 0.0;

    for (PetscInt r = 0; r < bs; r++)
      for (PetscInt c = 0; c < bs; c++) {
        const PetscScalar v = a[r * bs + c];

        sum += PetscRealPart(v * PetscConj(v));
        other[r] |= v != 0.0 && !(diagonal && r == c);
      }
    survey->square[k] = sum;
    for (PetscInt r = 0; diagonal && r < bs; r++) survey->diagonal[i * bs + r] = PetscAbsScalar(a[r * bs + r]);
  }
}

/* Reads all values of a matrix once */
AinsworthBlockSurvey::AinsworthBlockSurvey(const AinsworthBlockMat &A)
  : square(A.rows.j.size(), 0.0), diagonal((size_t)A.rows.n * A.rows.br, 0.0), held(diagonal.size(), 0)
{
  const PetscInt    bs = A.rows.br;
  std::vector<char> other(bs);

  for (PetscInt i = 0; i < A.rows.n; i++) {
    std::fill(other.begin(), other.end(), 0);
    AinsworthDispatch(bs, [&](auto B) { SurveyRow<B()>(A, i, this, other); });
    for (PetscInt r = 0; r < bs; r++) held[i * bs + r] = !other[r];
  }
}
