/* Fields named by the program, with the functions and options of PCFIELDSPLIT, and those of its DM */
#include "pcainsworth.h"
#include "../base/lists.h"

/* Forgets the resolved fields, so that the next set-up resolves them again */
static PetscErrorCode ForgetFields(PC pc, PC_Ainsworth *data)
{
  PetscFunctionBegin;
  data->given.mat = 0;
  PetscCall(PCAinsworthSetStale_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the field of this name, adding it if it is new; without a name the next number is the name */
static PCAinsworthNamedField *Named(PC_Ainsworth *data, const char name[])
{
  const std::string wanted = name ? name : std::to_string(data->given.named.size());

  for (PCAinsworthNamedField &field : data->given.named)
    if (field.name == wanted) return &field;
  data->given.named.push_back({wanted, AinsworthRef<IS>(), {}, {}});
  return &data->given.named.back();
}

static PetscErrorCode PCFieldSplitSetIS_Ainsworth(PC pc, const char name[], IS is)
{
  PC_Ainsworth          *data  = PCAinsworthData_Private(pc);
  PCAinsworthNamedField *field = Named(data, name);
  PetscBool              same  = PETSC_FALSE;

  PetscFunctionBegin;
  if (field->is) PetscCall(ISEqual(field->is, is, &same));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  field->is = AinsworthRetain(is);
  PetscCall(ForgetFields(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCFieldSplitSetFields_Ainsworth(PC pc, const char name[], PetscInt n, const PetscInt rows[],
                                                      const PetscInt cols[])
{
  PC_Ainsworth               *data         = PCAinsworthData_Private(pc);
  PCAinsworthNamedField      *field        = Named(data, name);
  const std::vector<PetscInt> components[] = {
    {rows, rows + n},
    {cols, cols + n}
  };

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++)
    PetscCheck(rows[i] >= 0 && cols[i] >= 0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE,
               "Field %s has the negative component %" PetscInt_FMT, field->name.c_str(), PetscMin(rows[i], cols[i]));
  if (field->rows == components[0] && field->cols == components[1]) PetscFunctionReturn(PETSC_SUCCESS);
  field->rows = components[0];
  field->cols = components[1];
  PetscCall(ForgetFields(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCFieldSplitSetBlockSize_Ainsworth(PC pc, PetscInt bs)
{
  PC_Ainsworth *data = PCAinsworthData_Private(pc);

  PetscFunctionBegin;
  if (data->given.components == bs) PetscFunctionReturn(PETSC_SUCCESS);
  data->given.components = bs;
  PetscCall(ForgetFields(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Restricts the index sets so far to a part of the unknowns, in its numbering */
static PetscErrorCode PCFieldSplitRestrictIS_Ainsworth(PC pc, IS part)
{
  PC_Ainsworth *data = PCAinsworthData_Private(pc);
  PetscInt      local, end;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(part, &local));
  PetscCallMPI(MPI_Scan(&local, &end, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)part)));
  for (PCAinsworthNamedField &field : data->given.named) {
    IS                    embedded, is;
    std::vector<PetscInt> places;

    if (!field.is) continue;
    PetscCall(ISEmbed(field.is, part, PETSC_TRUE, &embedded));
    PetscCall(AinsworthISToList(embedded, &places));
    PetscCall(ISDestroy(&embedded));
    for (PetscInt &place : places) place += end - local;
    PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)part), (PetscInt)places.size(), places.data(),
                              PETSC_COPY_VALUES, &is));
    field.is = AinsworthOwn(is);
  }
  PetscCall(ForgetFields(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes the coordinates of the nodes of A or of the whole matrix, as PCGAMG, or of all of its rows, as PCFIELDSPLIT */
static PetscErrorCode PCSetCoordinates_Ainsworth(PC pc, PetscInt dim, PetscInt n, PetscReal *coordinates)
{
  PC_Ainsworth *data = PCAinsworthData_Private(pc);

  PetscFunctionBegin;
  data->given.inputs.dim = dim;
  data->given.inputs.coordinates.assign(coordinates, coordinates + (size_t)n * dim);
  data->given.inputs.located++;
  PetscCall(PCAinsworthSetStale_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates the index set of some components of the nodes of a matrix, in ascending order */
static PetscErrorCode CreateStrided(Mat mat, PetscInt bs, const std::vector<PetscInt> &components, const char name[],
                                    AinsworthRef<IS> *is)
{
  PetscInt              first, end, n, whole;
  std::vector<PetscInt> rows;
  IS                    set;

  PetscFunctionBegin;
  for (PetscInt c : components)
    PetscCheck(c < bs, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_OUTOFRANGE,
               "Field %s has component %" PetscInt_FMT " of nodes with %" PetscInt_FMT
               ": call PCFieldSplitSetBlockSize() or MatSetBlockSize()",
               name, c, bs);
  PetscCall(MatGetOwnershipRange(mat, &first, &end));
  n     = end - first;
  whole = n - n % bs;
  PetscCall(AinsworthFirstMismatch(PetscObjectComm((PetscObject)mat), &n, &whole));
  PetscCheck(n == whole, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_SIZ,
             "A rank has %" PetscInt_FMT " rows, which are no nodes of %" PetscInt_FMT, n, bs);
  for (PetscInt node = first; node < end; node += bs)
    for (PetscInt c : components) rows.push_back(node + c);
  std::sort(rows.begin(), rows.end());
  PetscCall(
    ISCreateGeneral(PetscObjectComm((PetscObject)mat), (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, &set));
  *is = AinsworthOwn(set);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Resolves the named fields to rows of mat; a field of all other rows is added to a single one, as in PCFIELDSPLIT */
static PetscErrorCode ResolveNamed(PC pc, PC_Ainsworth *data, Mat mat)
{
  PetscInt  bs = data->given.components, size, N, total = 0;
  PetscBool nest;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)mat, MATNEST, &nest));
  if (!bs) PetscCall(MatGetBlockSize(mat, &bs));
  for (const PCAinsworthNamedField &named : data->given.named) {
    AinsworthField field;

    field.name = named.name;
    field.rows = field.cols = named.is;
    if (!named.is && nest) continue; /* the components of a MATNEST are its own fields */
    if (!named.is) {
      PetscCall(CreateStrided(mat, bs, named.rows, named.name.c_str(), &field.rows));
      field.cols = field.rows;
      if (named.cols != named.rows) PetscCall(CreateStrided(mat, bs, named.cols, named.name.c_str(), &field.cols));
    }
    data->given.inputs.fields.push_back(field);
    PetscCall(ISGetSize(field.rows, &size));
    total += size;
  }
  PetscCall(MatGetSize(mat, &N, NULL));
  if (data->given.inputs.fields.size() == 1) {
    PetscInt first, end;
    IS       rest;

    PetscCall(MatGetOwnershipRange(mat, &first, &end));
    PetscCall(ISComplement(data->given.inputs.fields[0].rows, first, end, &rest));
    PetscCall(ISGetSize(rest, &size));
    total += size;
    data->given.inputs.fields.push_back(
      {data->given.inputs.fields[0].name == "1" ? "rest" : "1", AinsworthOwn(rest), AinsworthRef<IS>()});
    data->given.inputs.fields[1].cols = data->given.inputs.fields[1].rows;
  }
  PetscCheck(nest || total == N, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_SIZ,
             "The %" PetscInt_FMT " fields given by PCFieldSplitSetIS() or PCFieldSplitSetFields() have %" PetscInt_FMT
             " rows, the matrix has %" PetscInt_FMT ": each row belongs to one field",
             (PetscInt)data->given.inputs.fields.size(), total, N);
  data->given.inputs.definedBy = "named by the program";
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthUpdateInputs_Private - updates data->given.inputs: named fields, those of the DM, or none; resolved again
   for another matrix or DM
*/
PetscErrorCode PCAinsworthUpdateInputs_Private(PC pc, PC_Ainsworth *data)
{
  PetscObjectId id, number = 0;
  Mat           pmat;
  DM            dm;

  PetscFunctionBegin;
  PetscCall(PCGetOperators(pc, &data->given.inputs.amat, &pmat));
  PetscCall(PCGetDM(pc, &dm));
  data->given.inputs.pmat = pmat;
  PetscCall(PetscObjectGetId((PetscObject)pmat, &id));
  if (dm) PetscCall(PetscObjectGetId((PetscObject)dm, &number));
  if (data->given.mat == id && data->given.dm == number) PetscFunctionReturn(PETSC_SUCCESS);
  data->given.inputs.fields.clear();
  data->given.inputs.chosenBy = "";
  if (!data->given.rows.empty()) PetscCall(PCAinsworthNameRows_Private(pmat, data->given.rows, &data->given.inputs));
  else if (!data->given.named.empty()) PetscCall(ResolveNamed(pc, data, pmat));
  else if (dm) {
    PetscCall(AinsworthDMGetFields(dm, pmat, &data->given.inputs.fields));
    data->given.inputs.definedBy = "of the DM";
  }
  data->given.mat = id;
  data->given.dm  = number;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PCAinsworthComposeFields_Private - composes or removes the functions that programs call for PCFIELDSPLIT */
PetscErrorCode PCAinsworthComposeFields_Private(PC pc, PetscBool compose)
{
  PetscFunctionBegin;
  PetscCall(
    PetscObjectComposeFunction((PetscObject)pc, "PCFieldSplitSetIS_C", compose ? PCFieldSplitSetIS_Ainsworth : NULL));
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, "PCFieldSplitSetFields_C",
                                       compose ? PCFieldSplitSetFields_Ainsworth : NULL));
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, "PCFieldSplitSetBlockSize_C",
                                       compose ? PCFieldSplitSetBlockSize_Ainsworth : NULL));
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, "PCFieldSplitRestrictIS_C",
                                       compose ? PCFieldSplitRestrictIS_Ainsworth : NULL));
  PetscCall(
    PetscObjectComposeFunction((PetscObject)pc, "PCSetCoordinates_C", compose ? PCSetCoordinates_Ainsworth : NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Reads the options of PCFIELDSPLIT for components of nodes; as there, they do not overrule fields that the program has
   named itself
*/
static PetscErrorCode ComponentsFromOptions(PC pc, PC_Ainsworth *data, AinsworthOptionItems PetscOptionsObject)
{
  PetscInt  bs = data->given.components;
  PetscBool set;

  PetscFunctionBegin;
  for (const PCAinsworthNamedField &field : data->given.named)
    if (field.is || field.name.find_first_not_of("0123456789") != std::string::npos) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(
    PetscOptionsInt("-pc_fieldsplit_block_size", "Components of a node", "PCFieldSplitSetBlockSize", bs, &bs, &set));
  if (set) PetscCall(PCFieldSplitSetBlockSize_Ainsworth(pc, bs));
  set = PETSC_TRUE;
  for (int i = 0; set; i++) {
    const std::string name = std::to_string(i), option = "-pc_fieldsplit_" + name + "_fields";
    PetscInt          components[64] = {}, n = 64;

    PetscCall(
      PetscOptionsIntArray(option.c_str(), "Components of a field", "PCFieldSplitSetFields", components, &n, &set));
    if (set) PetscCall(PCFieldSplitSetFields_Ainsworth(pc, name.c_str(), n, components, components));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   PCAinsworthFieldsFromOptions_Private - reads the options for the fields of the multipliers, their detection, and the
   block size
*/
PetscErrorCode PCAinsworthFieldsFromOptions_Private(PC pc, PC_Ainsworth *data, AinsworthOptionItems PetscOptionsObject)
{
  AinsworthSaddleInputs   *in = &data->given.inputs;
  char                    *names[64], rows[PETSC_MAX_PATH_LEN] = "";
  PetscInt                 n = 64, bs  = in->bs;
  PetscBool                set, detect = (PetscBool)(in->detect == 1);
  std::vector<std::string> multipliers;

  PetscFunctionBegin;
  PetscCall(ComponentsFromOptions(pc, data, PetscOptionsObject));
  PetscCall(PetscOptionsStringArray("-pc_ainsworth_multiplier_fields",
                                    "Names or numbers of the fields of the multipliers", PCAINSWORTH, names, &n, &set));
  for (PetscInt i = 0; i < n && set; i++) {
    multipliers.push_back(names[i]);
    PetscCall(PetscFree(names[i]));
  }
  if (set && multipliers != in->multipliers) {
    in->multipliers = multipliers;
    PetscCall(ForgetFields(pc, data));
  }
  PetscCall(PetscOptionsString("-pc_ainsworth_multiplier_rows",
                               "Rows of the multipliers, from 0: first-end,... (end is not one), or a file with an IS",
                               PCAINSWORTH, rows, rows, sizeof(rows), &set));
  if (set && data->given.rows != rows) {
    data->given.rows = rows;
    PetscCall(ForgetFields(pc, data));
  }
  PetscCall(PetscOptionsBool("-pc_ainsworth_detect_saddle_point",
                             "Multipliers are the rows without a positive diagonal entry",
                             "PCFieldSplitSetDetectSaddlePoint", detect, &detect, &set));
  if (set && in->detect != (PetscInt)detect) {
    in->detect = (PetscInt)detect;
    PetscCall(ForgetFields(pc, data));
  }
  PetscCall(PetscOptionsInt("-pc_ainsworth_block_size", "Block size of A, unknowns of a node", "MatSetBlockSize", bs,
                            &bs, &set));
  if (!set || bs == in->bs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(bs > 0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE,
             "-pc_ainsworth_block_size must be positive, not %" PetscInt_FMT, bs);
  in->bs = bs;
  PetscCall(ForgetFields(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}
