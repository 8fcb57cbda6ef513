#include "saddle.h"
#include "../loops.h"
#include "../objects.h"
#include <vector>

/* Gets the matrix that M is a transpose view of; NULL if M is no such view */
PetscErrorCode AinsworthGetTransposed(Mat M, Mat *T, PetscBool *hermitian)
{
  PetscErrorCode (*get)(Mat, Mat *);
  PetscErrorCode (*getHermitian)(Mat, Mat *);

  PetscFunctionBegin;
  *T = NULL;
  PetscCall(PetscObjectQueryFunction((PetscObject)M, "MatTransposeGetMat_C", &get));
  PetscCall(PetscObjectQueryFunction((PetscObject)M, "MatHermitianTransposeGetMat_C", &getHermitian));
  *hermitian = (PetscBool)(getHermitian != NULL);
  if (getHermitian) PetscCall((*getHermitian)(M, T));
  else if (get) PetscCall((*get)(M, T));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the first part of M without access to its rows and without a converter, for which MatConvert() would multiply by every unit vector; or NULL */
PetscErrorCode AinsworthFindOpaque(Mat M, Mat *opaque)
{
  Mat       part;
  MatType   type;
  PetscInt  nr, nc;
  PetscBool hermitian, nest, has;

  PetscFunctionBegin;
  *opaque = NULL;
  PetscCall(AinsworthGetTransposed(M, &part, &hermitian));
  PetscCall(PetscObjectTypeCompare((PetscObject)M, MATNEST, &nest));
  if (part) PetscCall(AinsworthFindOpaque(part, opaque));
  else if (nest) {
    PetscCall(MatNestGetSize(M, &nr, &nc));
    for (PetscInt k = 0; k < nr * nc && !*opaque; k++) {
      PetscCall(MatNestGetSubMat(M, k / nc, k % nc, &part));
      if (part) PetscCall(AinsworthFindOpaque(part, opaque));
    }
  } else {
    PetscCall(MatHasOperation(M, MATOP_GET_ROW, &has));
    PetscCall(MatGetType(M, &type));
    for (const char *target : {"aij", "seqaij", "mpiaij"}) {
      char name[128];
      PetscErrorCode (*convert)(void);

      PetscCall(PetscSNPrintf(name, sizeof(name), "MatConvert_%s_%s_C", type, target));
      PetscCall(PetscObjectQueryFunction((PetscObject)M, name, &convert));
      if (convert) has = PETSC_TRUE;
    }
    if (!has) *opaque = M;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthCheckEntries - raises an error if a part of a block, such as a shell, has inaccessible entries that would take many products to find

   name and letter denote the block in the message. opaque: there is such a part.
*/
PetscErrorCode AinsworthCheckEntries(Mat M, const char name[], const char letter[], PetscBool *opaque)
{
  const PetscInt few = 1000;
  Mat            part;
  MatType        type;
  PetscInt       n;

  PetscFunctionBegin;
  PetscCall(AinsworthFindOpaque(M, &part));
  *opaque = (PetscBool)(part != NULL);
  if (!part) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetSize(part, NULL, &n));
  PetscCall(MatGetType(part, &type));
  PetscCheck(n <= few, PetscObjectComm((PetscObject)M), PETSC_ERR_SUP,
             "%s, %s, %s type %s, which does not give its entries, and %" PetscInt_FMT
             " products would be needed to find them: pass an assembled matrix, of MATAIJ for instance (MatCompositeMerge() makes one of a composite)",
             name, letter, part == M ? "has" : "has a part of", type, n);
  PetscCall(PetscInfo(M, "%s, %s: the entries of type %s are found by %" PetscInt_FMT " products\n", name, letter, type, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Calls MatConvert(), which increases the state of a MATMPIBAIJ and of the parts of a MATNEST although their values do not change, and restores the states */
static PetscErrorCode ConvertUnchanged(Mat M, PetscInt n, const Mat parts[], Mat *aij)
{
  std::vector<PetscObjectState> states(n + 1);

  PetscFunctionBegin;
  for (PetscInt k = 0; k <= n; k++)
    if (k == n || parts[k]) PetscCall(PetscObjectStateGet(k < n ? (PetscObject)parts[k] : (PetscObject)M, &states[k]));
  PetscCall(MatConvert(M, MATAIJ, MAT_INITIAL_MATRIX, aij));
  for (PetscInt k = 0; k <= n; k++)
    if (k == n || parts[k]) PetscCall(PetscObjectStateSet(k < n ? (PetscObject)parts[k] : (PetscObject)M, states[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode NestToAIJ(Mat, Mat *);

/* Gets M, or a copy, as AIJ; supports transpose views and nested MatNests, which MatConvert() does not */
static PetscErrorCode ToAIJ(Mat M, Mat *aij)
{
  Mat       source, copy;
  PetscBool is, nest, hermitian;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)M, &is, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(PetscObjectTypeCompare((PetscObject)M, MATNEST, &nest));
  PetscCall(AinsworthGetTransposed(M, &source, &hermitian));
  if (is) PetscCall(AinsworthShare(M, aij));
  else if (source) {
    PetscCall(ToAIJ(source, &copy));
    PetscCall((hermitian ? MatHermitianTranspose : MatTranspose)(copy, MAT_INITIAL_MATRIX, aij));
    PetscCall(MatDestroy(&copy));
  } else if (nest) PetscCall(NestToAIJ(M, aij));
  else PetscCall(ConvertUnchanged(M, 0, NULL, aij));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode NestToAIJ(Mat M, Mat *aij)
{
  PetscInt nr, nc;
  Mat      nest;

  PetscFunctionBegin;
  PetscCall(MatNestGetSize(M, &nr, &nc));
  std::vector<IS>  rows(nr), cols(nc);
  std::vector<Mat> blocks(nr * nc, NULL);

  PetscCall(MatNestGetISs(M, rows.data(), cols.data()));
  for (PetscInt k = 0; k < nr * nc; k++) {
    Mat block;

    PetscCall(MatNestGetSubMat(M, k / nc, k % nc, &block));
    if (block) PetscCall(AinsworthGetAIJ(block, &blocks[k]));
  }
  PetscCall(AinsworthMergeAIJ(PetscObjectComm((PetscObject)M), rows, cols, blocks, aij));
  if (!*aij) {
    PetscCall(MatCreateNest(PetscObjectComm((PetscObject)M), nr, rows.data(), nc, cols.data(), blocks.data(), &nest));
    PetscCall(ConvertUnchanged(nest, nr * nc, blocks.data(), aij));
    PetscCall(MatDestroy(&nest));
  }
  for (Mat &block : blocks) PetscCall(MatDestroy(&block));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   AinsworthGetAIJ - gets M itself if it is AIJ, otherwise a converted copy; to be destroyed by the caller. Collective

   On one rank, gets the diagonal block of a MATMPIAIJ: products and factorizations need the sequential type.
*/
PetscErrorCode AinsworthGetAIJ(Mat M, Mat *aij)
{
  PetscBool   mpi;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCall(ToAIJ(M, aij));
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)M), &size));
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)*aij, MATMPIAIJ, &mpi));
  if (mpi && size == 1) {
    Mat parallel = *aij, block;

    PetscCall(MatGetDiagonalBlock(parallel, &block));
    PetscCall(AinsworthShare(block, aij));
    PetscCall(MatDestroy(&parallel));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the entrywise absolute value of an AIJ matrix */
PetscErrorCode AinsworthAbsoluteAIJ(Mat M, Mat *absolute)
{
  Mat             block[2];
  const PetscInt *ghosts;
  PetscInt        n;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(M, MAT_COPY_VALUES, absolute));
  PetscCall(AinsworthAIJGetParts(*absolute, block, &ghosts, &n));
  for (Mat part : block) {
    MatInfo      info;
    PetscScalar *v;

    if (!part) continue;
    PetscCall(MatGetInfo(part, MAT_LOCAL, &info));
    PetscCall(MatSeqAIJGetArray(part, &v));
    for (PetscInt k = 0; k < (PetscInt)info.nz_used; k++) v[k] = PetscAbsScalar(v[k]);
    PetscCall(MatSeqAIJRestoreArray(part, &v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthCreateAIJ - creates an AIJ matrix from its local rows, with n local columns. Collective */
PetscErrorCode AinsworthCreateAIJ(MPI_Comm comm, PetscInt n, const AinsworthEntries &rows, Mat *aij)
{
  const PetscInt    column = 0, *j = rows.columns.empty() ? &column : rows.columns.data(); /* avoid null pointers */
  const PetscScalar value = 0.0, *a = rows.values.empty() ? &value : rows.values.data();

  PetscFunctionBegin;
  PetscCall(MatCreate(comm, aij));
  PetscCall(MatSetSizes(*aij, (PetscInt)rows.start.size() - 1, n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetType(*aij, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(*aij, rows.start.data(), j, a));
  PetscCall(MatMPIAIJSetPreallocationCSR(*aij, rows.start.data(), j, a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the null space and the near null space that the program attached */
PetscErrorCode AinsworthCopyNullSpaces(Mat from, Mat to)
{
  MatNullSpace nullsp, near;

  PetscFunctionBegin;
  PetscCall(MatGetNullSpace(from, &nullsp));
  PetscCall(MatGetNearNullSpace(from, &near));
  PetscCall(MatSetNullSpace(to, nullsp));
  PetscCall(MatSetNearNullSpace(to, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the sum of |entry|^power of each row of M; power is 1 or 2 */
PetscErrorCode AinsworthRowSums(Mat M, int power, Vec sums)
{
  Mat          R;
  PetscScalar *s;

  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(M, &R));
  PetscCall(VecGetArrayWrite(sums, &s));
  PetscCall(AinsworthForRows(R, [=](const AinsworthMatRow &row) {
    PetscReal sum = 0.0;

    for (PetscInt k = 0; k < row.n; k++) sum += power == 2 ? PetscSqr(PetscAbsScalar(row.a[k])) : PetscAbsScalar(row.a[k]);
    s[row.local] = sum;
  }));
  PetscCall(VecRestoreArrayWrite(sums, &s));
  PetscCall(MatDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts, for each unknown, the rows of C with more than `length` entries that contain it. Collective */
PetscErrorCode AinsworthCountRows(Mat C, PetscInt length, Vec *counts)
{
  PetscInt                 rstart, rend;
  std::vector<PetscScalar> ones;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(C, counts, NULL));
  PetscCall(MatGetOwnershipRange(C, &rstart, &rend));
  for (PetscInt i = rstart; i < rend; i++) {
    PetscInt        n;
    const PetscInt *columns;

    PetscCall(MatGetRow(C, i, &n, &columns, NULL));
    if (n > length) {
      ones.resize(PetscMax(ones.size(), (size_t)n), 1.0);
      PetscCall(VecSetValues(*counts, n, columns, ones.data(), ADD_VALUES));
    }
    PetscCall(MatRestoreRow(C, i, &n, &columns, NULL));
  }
  PetscCall(VecAssemblyBegin(*counts));
  PetscCall(VecAssemblyEnd(*counts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Samples up to `enough` rows of each rank, evenly spaced, that have `least` to `most` entries; number: of all such rows on all ranks. Collective */
PetscErrorCode AinsworthSampleRows(Mat M, PetscInt least, PetscInt most, PetscInt enough, IS *sample, PetscInt *number)
{
  std::vector<PetscInt> found, taken;

  PetscFunctionBegin;
  PetscCall(AinsworthForRows(M, [&](const AinsworthMatRow &row) {
    if (row.n >= least && row.n <= most) found.push_back(row.number);
  }));
  *number = (PetscInt)found.size();
  enough  = PetscMin(enough, *number);
  for (PetscInt k = 0; k < enough; k++) taken.push_back(found[(2 * k + 1) * found.size() / (2 * enough)]);
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, number, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)M)));
  PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)M), enough, taken.data(), PETSC_COPY_VALUES, sample));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a copy of M with its columns scaled */
PetscErrorCode AinsworthScaleColumns(Mat M, Vec scale, Mat *scaled)
{
  PetscFunctionBegin;
  PetscCall(MatDuplicate(M, MAT_COPY_VALUES, scaled));
  PetscCall(MatDiagonalScale(*scaled, NULL, scale));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes diag(C W C'); scales by W^{1/2} before squaring, to avoid overflow and underflow */
PetscErrorCode AinsworthRowSquares(Mat C, Vec weight, Vec sums)
{
  Vec root;
  Mat scaled;

  PetscFunctionBegin;
  PetscCall(AinsworthVecClone(weight, &root));
  PetscCall(VecSqrtAbs(root));
  PetscCall(AinsworthScaleColumns(C, root, &scaled));
  PetscCall(AinsworthRowSums(scaled, 2, sums));
  PetscCall(MatDestroy(&scaled));
  PetscCall(VecDestroy(&root));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes |x' M x| */
PetscErrorCode AinsworthFormValue(Mat M, Vec x, PetscReal *value)
{
  PetscScalar product;
  Vec         Mx;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, &Mx));
  PetscCall(MatMult(M, x, Mx));
  PetscCall(VecDot(Mx, x, &product));
  PetscCall(VecDestroy(&Mx));
  *value = PetscAbsScalar(product);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* AinsworthGetRows - appends the adjoints of some rows of a matrix, whose global numbers all ranks know. Collective */
PetscErrorCode AinsworthGetRows(Mat M, const std::vector<PetscInt> &numbers, std::vector<Vec> *rows)
{
  PetscInt rstart, rend;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(M, &rstart, &rend));
  for (PetscInt number : numbers) {
    Vec row;

    PetscCall(MatCreateVecs(M, &row, NULL));
    if (number >= rstart && number < rend) {
      PetscInt           n;
      const PetscInt    *columns;
      const PetscScalar *values;

      PetscCall(MatGetRow(M, number, &n, &columns, &values));
      PetscCall(VecSetValues(row, n, columns, values, INSERT_VALUES));
      PetscCall(MatRestoreRow(M, number, &n, &columns, &values));
    }
    PetscCall(VecAssemblyBegin(row));
    PetscCall(VecAssemblyEnd(row));
    if (PetscDefined(USE_COMPLEX)) PetscCall(VecConjugate(row));
    rows->push_back(row);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
