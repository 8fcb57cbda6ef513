/* Block rows of a distributed Hermitian matrix, the data structure of block smoothed aggregation */
#ifndef AINSWORTH_BLOCKS_H
#define AINSWORTH_BLOCKS_H

#include "../base/lists.h"
#include "../base/objects.h"
#include "../base/unit.h"
#include "kernels.h"
#include <petscsf.h>
#include <memory>
#include <vector>

/* Block CSR: n block rows of br x bc blocks, each block stored by rows */
template <class T>
struct AinsworthBlockRowsOf {
  PetscInt              n = 0, br = 1, bc = 1;
  std::vector<PetscInt> i = {0}, j;
  std::vector<T>        a;

  AinsworthBlockRowsOf() = default;
  AinsworthBlockRowsOf(PetscInt rows, PetscInt columns) : br(rows), bc(columns) { }
  PetscInt size() const { return br * bc; }
  const T *block(PetscInt k) const { return a.data() + (size_t)k * size(); }
  T       *block(PetscInt k) { return a.data() + (size_t)k * size(); }
  void     endRow()
  {
    i.push_back((PetscInt)j.size());
    n++;
  }
};
typedef AinsworthBlockRowsOf<PetscScalar> AinsworthBlockRows;

/*
   Computes y += M x with the values a, for multivectors of width W; ghost holds the entries of x in columns of other
   ranks, xs and ys are the strides between nodes of x and y
*/
template <int R, int C, int W, class S, class T, class V>
AINSWORTH_CLONES inline void AinsworthRowsMultAdd(const AinsworthBlockRowsOf<S> &rows, const T *a, PetscInt local,
                                                  const V *x, const V *ghost, PetscInt xs, PetscInt ys, V *y)
{
  const PetscInt br = R ? R : rows.br, bc = C ? C : rows.bc;

  for (PetscInt i = 0; i < rows.n; i++, y += ys)
    for (PetscInt k = rows.i[i]; k < rows.i[i + 1]; k++, a += br * bc) {
      const PetscInt j    = rows.j[k];
      const V       *from = j < local ? x + (size_t)j * xs : ghost + (size_t)(j - local) * xs;
      AinsworthPrefetch<R * C>(a);
      if constexpr (W == 1) AinsworthMultVecAdd<R, C>(br, bc, a, from, y);
      else AinsworthMultWideAdd<false, false, R, C, W>(br, bc, a, from, y);
    }
}

/* Distribution of the nodes over the ranks */
typedef std::shared_ptr<std::remove_pointer<PetscLayout>::type> AinsworthLayout;

/*
   The nodes of the block columns: owned nodes at places 0 to local - 1, followed by ghosts in ascending order of their
   global numbers
*/
struct AinsworthColumns {
  AinsworthLayout       layout;
  PetscInt              first = 0, local = 0;
  std::vector<PetscInt> ghosts; /* global node numbers */
  AinsworthRef<PetscSF> sf;     /* from owners to ghosts; NULL on one rank */

  PetscErrorCode create(const AinsworthLayout &, std::vector<PetscInt> &&);
  PetscErrorCode createAt(const AinsworthLayout &, std::vector<PetscInt> *);
  PetscErrorCode createMade(const AinsworthLayout &, PetscInt);
  PetscErrorCode findShared(std::vector<char> *) const;
  PetscErrorCode toGhosts(MPI_Datatype, const void *, void *) const;

  PetscInt count() const { return local + (PetscInt)ghosts.size(); }
  bool     owns(PetscInt node) const { return node >= first && node < first + local; }
  PetscInt node(PetscInt place) const { return place < local ? first + place : ghosts[place - local]; }
  PetscInt place(PetscInt node) const;
};

/* Reads block rows that are stored in another form, one at a time, so that they need not be stored a second time */
class AinsworthRowReader {
public:
  virtual ~AinsworthRowReader() = default;
  /* Returns the blocks of a row, whose columns are those of the pattern; the next call overwrites them */
  virtual const PetscScalar *read(const AinsworthBlockRows &pattern, PetscInt row) = 0;
};

struct AinsworthBlockMat {
  AinsworthBlockRows rows; /* square blocks; columns are places in cols */
  AinsworthColumns   cols;
  /* has the values instead of rows.a; NULL if they are stored */
  std::shared_ptr<AinsworthRowReader> reader;

  /* Returns the blocks of a row; if they are not stored, the next call overwrites them */
  const PetscScalar *row(PetscInt i) const
  {
    return reader ? reader->read(rows, i) : rows.a.data() + (size_t)rows.i[i] * rows.size();
  }
  void store();
};

/* A Hermitian matrix: owned blocks on and above the diagonal, which is first in each row, and those in ghost columns */
struct AinsworthHalf {
  std::shared_ptr<const AinsworthBlockRows> upper;
  AinsworthBlockMat                         outside;
};

/* A contribution to a block row: its column as a global node number, its values, and whether their adjoint is meant */
struct AinsworthPiece {
  PetscInt           node    = 0;
  const PetscScalar *values  = NULL;
  bool               adjoint = false;
};

PetscErrorCode AinsworthLayoutCreate(MPI_Comm, PetscInt, AinsworthLayout *);
PetscErrorCode AinsworthBlockMatOpen(Mat, PetscInt, const std::vector<PetscInt> &, const std::vector<char> *,
                                     AinsworthBlockMat *);
PetscErrorCode AinsworthBlockMatOpenHalf(const std::shared_ptr<const AinsworthBlockRows> &, AinsworthBlockRows &&,
                                         const AinsworthColumns &, AinsworthBlockMat *);
PetscErrorCode AinsworthHalfAssemble(const AinsworthLayout &, PetscInt, std::vector<std::vector<AinsworthPiece>> &,
                                     AinsworthHalf *);
PetscErrorCode AinsworthBlocksToAIJ(const AinsworthBlockRows &, const AinsworthColumns &, Mat, Mat *);
PetscErrorCode AinsworthSendRows(PetscSF, const AinsworthBlockRows &, PetscInt, AinsworthBlockRows *);
PetscErrorCode AinsworthRowsToOwners(const AinsworthColumns &, const AinsworthBlockRows &, std::vector<PetscInt> *,
                                     AinsworthBlockRows *);

#endif
