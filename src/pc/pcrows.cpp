/* The multipliers' rows of a matrix without fields, named by -pc_ainsworth_multiplier_rows */
#include "pcainsworth.h"
#include "../base/lists.h"

static const char option[] = "-pc_ainsworth_multiplier_rows";

/* Reads "5" or "5-9", as in PETSc's arrays of integers: 5 to 8 */
static bool ReadRange(const std::string &word, PetscInt range[2])
{
  const char *text = word.c_str();
  char       *end;

  if (word.empty() || word.find_first_not_of("0123456789-") != std::string::npos || word[0] == '-') return false;
  range[0] = (PetscInt)strtoll(text, &end, 10);
  range[1] = range[0] + 1;
  if (!*end) return true;
  text     = end + 1;
  range[1] = (PetscInt)strtoll(text, &end, 10);
  return *text && !*end;
}

/* Splits a list of ranges; empty if it is none, and so the name of a file */
static std::vector<PetscInt> ReadRanges(const std::string &text)
{
  std::vector<PetscInt> ranges;

  for (size_t from = 0, to; from <= text.size(); from = to + 1) {
    PetscInt range[2];

    to = std::min(text.find(',', from), text.size());
    if (!ReadRange(text.substr(from, to - from), range)) return {};
    ranges.insert(ranges.end(), range, range + 2);
  }
  return ranges;
}

/* Loads the index set of a file, on all ranks; collective */
static PetscErrorCode Load(MPI_Comm comm, const char file[], std::vector<PetscInt> *rows)
{
  PetscViewer viewer;
  IS          is, all;

  PetscFunctionBegin;
  PetscCall(PetscViewerCreate(comm, &viewer));
  PetscCall(PetscViewerSetType(viewer, PETSCVIEWERBINARY));
  PetscCall(PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE)); /* its options would stay in the program's database */
  PetscCall(PetscViewerFileSetMode(viewer, FILE_MODE_READ));
  PetscCall(PetscViewerFileSetName(viewer, file));
  PetscCall(ISCreate(comm, &is));
  PetscCall(ISLoad(is, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(ISAllGather(is, &all));
  PetscCall(AinsworthISToList(all, rows));
  PetscCall(ISDestroy(&all));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthNameRows_Private - makes the two fields of mat, of the rows of the text and of the others; collective */
PetscErrorCode PCAinsworthNameRows_Private(Mat mat, const std::string &text, AinsworthSaddleInputs *in)
{
  MPI_Comm              comm   = PetscObjectComm((PetscObject)mat);
  std::vector<PetscInt> ranges = ReadRanges(text), rows;
  PetscInt              N, first, end;
  PetscBool             nest;
  AinsworthRef<IS>      primal, multipliers;
  IS                    is;

  PetscFunctionBegin;
  PetscCall(AinsworthIsNest(mat, &nest));
  PetscCheck(!nest, comm, PETSC_ERR_ARG_WRONG,
             "%s names rows of one matrix, and this is a MatNest: use -pc_ainsworth_multiplier_fields", option);
  PetscCall(MatGetSize(mat, &N, NULL));
  PetscCall(MatGetOwnershipRange(mat, &first, &end));
  if (ranges.empty()) {
    PetscCall(Load(comm, text.c_str(), &rows));
    for (PetscInt row : rows) ranges.insert(ranges.end(), {row, row + 1});
    rows.clear();
  }
  for (size_t k = 0; k < ranges.size(); k += 2) {
    PetscCheck(ranges[k] >= 0 && ranges[k] < ranges[k + 1] && ranges[k + 1] <= N, comm, PETSC_ERR_ARG_OUTOFRANGE,
               "%s names rows %" PetscInt_FMT " to %" PetscInt_FMT ", the matrix has rows 0 to %" PetscInt_FMT, option,
               ranges[k], ranges[k + 1] - 1, N - 1);
    for (PetscInt row = PetscMax(ranges[k], first); row < PetscMin(ranges[k + 1], end); row++) rows.push_back(row);
  }
  AinsworthSortUnique(&rows);
  PetscCall(ISCreateGeneral(comm, (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, &is));
  multipliers = AinsworthOwn(is);
  PetscCall(ISComplement(multipliers, first, end, &is));
  primal     = AinsworthOwn(is);
  in->fields = {
    {"primal",      primal,      primal     },
    {"multipliers", multipliers, multipliers}
  };
  in->definedBy = "named by an option";
  in->chosenBy  = option;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
   PCAinsworthGetFields - gets the places of x and of the multipliers in the solution

   Not Collective

   Input Parameter:
.  pc - the preconditioner, after `PCSetUp()`

   Output Parameters:
+  primal      - the rows of x, in the numbering of the program's matrix; pass `NULL` if not needed
-  multipliers - the rows of the multipliers; pass `NULL` if not needed

   Level: intermediate

   Note:
   Do not destroy the index sets; the next set-up may replace them.

   Errors:
   `PETSC_ERR_ARG_WRONG` if the type of pc is not `PCAINSWORTH`, `PETSC_ERR_ORDER` before `PCSetUp()`.

.seealso: `PCAINSWORTH`, `PCFieldSplitSetIS()`
@*/
PetscErrorCode PCAinsworthGetFields(PC pc, IS *primal, IS *multipliers)
{
  PC_Ainsworth *data = NULL;

  PetscFunctionBegin;
  PetscCall(PCAinsworthGetDataOrError_Private(pc, &data));
  PetscCheck(data->saddle, PetscObjectComm((PetscObject)pc), PETSC_ERR_ORDER,
             "Call PCSetUp() before PCAinsworthGetFields()");
  if (primal) *primal = data->saddle->cols[0];
  if (multipliers) *multipliers = data->saddle->cols[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}
