/* Matrices of any type as AIJ matrices */
#include "matrices.h"
#include "layouts.h"
#include "objects.h"
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

/*
   Finds the first part of M without access to its rows and without a converter, for which MatConvert() would multiply
   by every unit vector; or NULL
*/
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
   AinsworthCheckEntries - raises an error if a part of a block, such as a shell, has inaccessible entries that would
   take many products to find

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
             " products would be needed to find them: pass an assembled matrix, of MATAIJ for instance "
             "(MatCompositeMerge() makes one of a composite)",
             name, letter, part == M ? "has" : "has a part of", type, n);
  PetscCall(
    PetscInfo(M, "%s, %s: the entries of type %s are found by %" PetscInt_FMT " products\n", name, letter, type, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Calls MatConvert(), which increases the state of a MATMPIBAIJ and of the parts of a MATNEST although their values do
   not change, and restores the states
*/
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
   Gives the layouts of a matrix its own communicator. They have that of the program, which may be freed before the
   matrix is, as DOLFINx does with that of a mesh; PETSc makes copies of layouts, and from 3.22 on of vectors, with it
*/
static PetscErrorCode KeepLayouts(Mat mat)
{
  PetscLayout layout[2];

  PetscFunctionBegin;
  PetscCall(MatGetLayouts(mat, &layout[0], &layout[1]));
  for (PetscLayout of : layout) of->comm = PetscObjectComm((PetscObject)mat);
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
  PetscCall(KeepLayouts(M));
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

/*
   AinsworthGetHostAIJ - gets M itself if it is AIJ of the host, otherwise a converted copy, whose vectors are those of
   M. Collective

   PETSc's types of devices take vectors of theirs alone; what is made of the constraints is made on the host
*/
PetscErrorCode AinsworthGetHostAIJ(Mat M, Mat *aij)
{
  PetscBool host;
  VecType   type;

  PetscFunctionBegin;
  PetscCall(AinsworthGetAIJ(M, aij));
  PetscCall(AinsworthVecsOnHost(*aij, &host));
  if (host) PetscFunctionReturn(PETSC_SUCCESS);
  Mat device = *aij;

  PetscCall(MatGetVecType(device, &type));
  PetscCall(ConvertUnchanged(device, 0, NULL, aij));
  PetscCall(MatSetVecType(*aij, type));
  PetscCall(MatDestroy(&device));
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
