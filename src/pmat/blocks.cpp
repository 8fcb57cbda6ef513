#include "pmat.h"
#include <metis.h>
#include <limits>
#include <vector>

/*
   AinsworthBlocksCreate - cuts the graph of a sequential matrix into blocks with METIS

   part[i] is the block of row i; allocated here. Every rank that holds the same S gets the same blocks, so that they do not depend
   on the number of ranks.
*/
PetscErrorCode AinsworthBlocksCreate(Mat S, PetscInt blocks, PetscInt *part)
{
  PetscInt           m, rows;
  const PetscInt    *ia, *ja;
  PetscBool          done;
  std::vector<idx_t> xadj(1, 0), adjncy, where;
  idx_t              nvtxs, ncon = 1, nparts = (idx_t)blocks, cut, options[METIS_NOPTIONS];
  int                status;

  PetscFunctionBegin;
  PetscCall(MatGetSize(S, &m, NULL));
  if (blocks <= 1 || blocks >= m) { /* METIS is not made for one part, nor for parts of one vertex */
    for (PetscInt i = 0; i < m; i++) part[i] = blocks <= 1 ? 0 : i;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(MatGetRowIJ(S, 0, PETSC_FALSE, PETSC_FALSE, &rows, &ia, &ja, &done));
  PetscAssert(done, PETSC_COMM_SELF, PETSC_ERR_PLIB, "The Gram matrix gives no access to its rows");
  PetscCheck(sizeof(idx_t) >= sizeof(PetscInt) || (PetscInt64)ia[m] <= (PetscInt64)std::numeric_limits<idx_t>::max(), PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "The Gram matrix has %" PetscInt_FMT " nonzeros, more than METIS with %d-bit indices can take; use -pc_ainsworth_pmat jcb or id", ia[m],
             (int)(8 * sizeof(idx_t)));
  xadj.reserve(m + 1);
  adjncy.reserve(ia[m]);
  for (PetscInt i = 0; i < m; i++) {
    for (PetscInt k = ia[i]; k < ia[i + 1]; k++)
      if (ja[k] != i) adjncy.push_back((idx_t)ja[k]);
    xadj.push_back((idx_t)adjncy.size());
  }
  PetscCall(MatRestoreRowIJ(S, 0, PETSC_FALSE, PETSC_FALSE, &rows, &ia, &ja, &done));
  nvtxs = (idx_t)m;
  where.resize(m);
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 0;
  adjncy.push_back(0); /* METIS takes no null pointer for a graph without edges */
  status = METIS_PartGraphKway(&nvtxs, &ncon, xadj.data(), adjncy.data(), NULL, NULL, NULL, &nparts, NULL, NULL, options, &cut, where.data());
  PetscCheck(status == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB, "METIS_PartGraphKway() returned %d", status);
  for (PetscInt i = 0; i < m; i++) part[i] = (PetscInt)where[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}
