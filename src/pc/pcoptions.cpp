#include "pcainsworth.h"

static const char *const redundantTypes[] = {"drop", "error", "AinsworthRedundantType", "AINSWORTH_REDUNDANT_", NULL};
static const char *const stopTypes[]      = {"residual", "energy_error", "AinsworthStopType", "AINSWORTH_STOP_", NULL};
static const char        monitorOption[]  = "-pc_ainsworth_monitor_error";

/* Checks whether an option is given */
static PetscErrorCode IsGiven(PC pc, const char name[], PetscBool *given)
{
  const char  *prefix;
  PetscOptions options;

  PetscFunctionBegin;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscObjectGetOptions((PetscObject)pc, &options));
  PetscCall(PetscOptionsHasName(options, prefix, name, given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a real number above 0 and below a bound */
static PetscErrorCode RealOption(PC pc, AinsworthOptionItems PetscOptionsObject, const char name[], const char help[],
                                 PetscReal below, PetscReal *value)
{
  PetscReal given = *value;
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscOptionsReal(name, help, PCAINSWORTH, given, &given, &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(given > 0.0, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE, "%s must be positive, not %g",
             name, (double)given);
  PetscCheck(given < below, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE,
             "%s must be less than %g, not %g", name, (double)below, (double)given);
  *value = given;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a positive number */
static PetscErrorCode CountOption(PC pc, AinsworthOptionItems PetscOptionsObject, const char name[], const char help[],
                                  PetscInt *value)
{
  PetscInt  given = *value;
  PetscBool set;

  PetscFunctionBegin;
  PetscCall(PetscOptionsInt(name, help, PCAINSWORTH, given, &given, &set));
  PetscCheck(!set || given > 0 || given == *value, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_OUTOFRANGE,
             "%s must be positive, not %" PetscInt_FMT, name, given);
  *value = given;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ChoicesFromOptions(PC pc, PC_Ainsworth *data, AinsworthOptionItems PetscOptionsObject)
{
  AinsworthChoices   now     = data->choices;
  PCAinsworthVariant variant = now.variant;
  PetscReal          factor  = PetscMax(now.pmat.factor, 0.0); /* PETSC_DEFAULT is negative */
  PetscBool          set;

  PetscFunctionBegin;
  PetscCall(PetscOptionsEnum("-pc_ainsworth_variant",
                             "Sets weight, penalty, penalty factor, row scaling and the inner KSP type at once",
                             PCAINSWORTH, PCAinsworthVariants, (PetscEnum)variant, (PetscEnum *)&variant, &set));
  if (set) PCAinsworthChoicesApplyVariant_Private(&now, variant);
  PetscCall(PetscOptionsEnum("-pc_ainsworth_weight", "Diagonal weight W of the projector", PCAINSWORTH,
                             MatAinsworthWeightTypes, (PetscEnum)now.weightType, (PetscEnum *)&now.weightType, NULL));
  PetscCall(PetscOptionsEnum("-pc_ainsworth_penalty", "Diagonal penalty B", PCAINSWORTH, AinsworthPenaltyTypes,
                             (PetscEnum)now.pmat.penalty, (PetscEnum *)&now.pmat.penalty, NULL));
  PetscCall(IsGiven(pc, "-pc_ainsworth_penalty_factor", &set));
  PetscCall(RealOption(pc, PetscOptionsObject, "-pc_ainsworth_penalty_factor",
                       "Factor gamma of the penalty (0: chosen with its type and that of the preconditioning matrix)",
                       PETSC_INFINITY, &factor));
  if (set) now.pmat.factor = factor;
  PetscCall(PetscOptionsEnum("-pc_ainsworth_pmat",
                             "Approximation of the inverse Gram matrix in the preconditioning matrix", PCAINSWORTH,
                             PCAinsworthPmatTypes, (PetscEnum)now.pmat.type, (PetscEnum *)&now.pmat.type, NULL));
  PetscCall(RealOption(pc, PetscOptionsObject, "-pc_ainsworth_pmat_rtol", "Relative tolerance of cg and bj_cg", 1.0,
                       &now.pmat.rtol));
  PetscCall(CountOption(pc, PetscOptionsObject, "-pc_ainsworth_blocks",
                        "Number of blocks of bj_cc and bj_cg (-1: one per 32 constraints)", &now.pmat.blocks));
  PetscCall(CountOption(pc, PetscOptionsObject, "-pc_ainsworth_rows_per_rank",
                        "The Gram matrix is gathered on ceil(constraints / this) ranks", &now.gram.rowsPerRank));
  PetscCall(PetscOptionsEnum("-pc_ainsworth_gram", "How solves with the Gram matrix are done", PCAINSWORTH,
                             AinsworthGramTypes, (PetscEnum)now.gram.type, (PetscEnum *)&now.gram.type, NULL));
  PetscCall(AinsworthMachineSetFromOptions((PetscObject)pc, PetscOptionsObject, "-pc_ainsworth_rate",
                                           "-pc_ainsworth_message", &now.gram.machine));
  PetscCall(PetscOptionsEnum("-pc_ainsworth_redundant", "Rows of C that are linear combinations of others", PCAINSWORTH,
                             redundantTypes, (PetscEnum)now.redundant, (PetscEnum *)&now.redundant, NULL));
  PetscCall(PetscOptionsEnum("-pc_ainsworth_ladder",
                             "The highest rung that may be climbed where the reduced solve gives no answer",
                             PCAINSWORTH, AinsworthLadderTypes, (PetscEnum)now.ladder, (PetscEnum *)&now.ladder, NULL));
  PetscCall(PetscOptionsEnum("-pc_ainsworth_rebuild",
                             "When the inner preconditioner is made anew for other values of A or C", PCAINSWORTH,
                             PCAinsworthRebuildTypes, (PetscEnum)now.rebuild, (PetscEnum *)&now.rebuild, NULL));
  PetscCall(PCAinsworthChoose_Private(pc, data, &now));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Creates the viewer of "csv" and "csv:file", short for PETSc's "ascii::ascii_csv" and "ascii:file:ascii_csv", and of
   "ascii:file:format"

   Viewers of the same file are shared: PETSc would open it twice, and KSPs would overwrite each other. All others are
   left to PETSc, and *viewer is unchanged
*/
static PetscErrorCode ShareViewer(PC pc, const char value[], PetscViewer *viewer, PetscViewerFormat *format)
{
  MPI_Comm  comm = PetscObjectComm((PetscObject)pc);
  char      kind[PETSC_MAX_PATH_LEN], *file, *name = NULL, *mode = NULL;
  PetscBool csv, ascii, known = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(kind, value, sizeof(kind)));
  PetscCall(PetscStrchr(kind, ':', &file));
  if (file) *file++ = 0;
  PetscCall(PetscStrcmp(kind, "csv", &csv));
  PetscCall(PetscStrcmp(kind, "ascii", &ascii));
  if (csv) *format = PETSC_VIEWER_ASCII_CSV;
  else if (ascii && file) {
    PetscCall(PetscStrchr(file, ':', &name));
    if (name) {
      *name++ = 0;
      PetscCall(PetscStrchr(name, ':', &mode));
      PetscCall(PetscEnumFind(PetscViewerFormats, name, (PetscEnum *)format, &known));
    }
  }
  if (csv && !(file && file[0])) {
    PetscCall(PetscViewerASCIIGetStdout(comm, viewer));
    PetscCall(PetscObjectReference((PetscObject)*viewer));
  } else if (file && file[0] && (csv || ascii) && known && !mode) PetscCall(PetscViewerASCIIOpen(comm, file, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks whether the text of an option is that of the last time, and stores it */
static PetscErrorCode SameText(char **last, const char now[], PetscBool *same)
{
  PetscFunctionBegin;
  *same = PETSC_FALSE;
  if (*last) PetscCall(PetscStrcmp(*last, now, same));
  if (*same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(*last));
  PetscCall(PetscStrallocpy(now, last));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MonitorFromOptions(PC pc, AinsworthReportSettings *settings,
                                         AinsworthOptionItems PetscOptionsObject)
{
  const char *const kinds[]                   = {"", "ascii", "csv", "draw"};
  char              value[PETSC_MAX_PATH_LEN] = "", kind[PETSC_MAX_PATH_LEN], *colon;
  PetscBool         set, same, known = PETSC_FALSE;
  PetscViewer       viewer = NULL;
  PetscViewerFormat format = PETSC_VIEWER_DEFAULT;
  const char       *prefix;
  PetscOptions      options;

  PetscFunctionBegin;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscObjectGetOptions((PetscObject)pc, &options));
  PetscCall(PetscOptionsGetString(options, prefix, monitorOption, value, sizeof(value), &set));
  PetscCall(PetscStrncpy(kind, value, sizeof(kind)));
  PetscCall(PetscStrchr(kind, ':', &colon));
  if (colon) *colon = 0;
  for (int i = 0; i < 4 && !known; i++) PetscCall(PetscStrcmp(kind, kinds[i], &known));
  PetscCheck(known, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONG,
             "Option %s is %s: it takes ascii[:file], csv[:file] and draw", monitorOption, value);
  if (set) {
    PetscCall(SameText(&settings->monitor, value, &same));
    if (same) PetscFunctionReturn(PETSC_SUCCESS); /* the file is not started over */
    PetscCall(ShareViewer(pc, value, &viewer, &format));
  }
  if (!viewer)
    PetscCall(PetscOptionsViewer(monitorOption, "Error against run time: also csv[:file]", PCAINSWORTH, &viewer,
                                 &format, &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerDestroy(&settings->viewer));
  settings->viewer = viewer;
  settings->format = format;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReferenceFromOptions(PC pc, AinsworthReportSettings *settings,
                                           AinsworthOptionItems PetscOptionsObject)
{
  char        file[PETSC_MAX_PATH_LEN] = "";
  PetscBool   set, same;
  PetscViewer viewer;
  Vec         reference;

  PetscFunctionBegin;
  PetscCall(PetscOptionsString("-pc_ainsworth_reference", "File of the exact solution (PETSc binary), for the monitor",
                               "PCAinsworthSetReference", file, file, sizeof(file), &set));
  if (!set) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SameText(&settings->file, file, &same));
  if (same) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscViewerCreate(PetscObjectComm((PetscObject)pc), &viewer));
  PetscCall(PetscViewerSetType(viewer, PETSCVIEWERBINARY));
  /* the options of its info file would stay in the program's database */
  PetscCall(PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE));
  PetscCall(PetscViewerFileSetMode(viewer, FILE_MODE_READ));
  PetscCall(PetscViewerFileSetName(viewer, file));
  PetscCall(VecCreate(PetscObjectComm((PetscObject)pc), &reference));
  PetscCall(VecLoad(reference, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(PCAinsworthSetReference(pc, reference));
  PetscCall(VecDestroy(&reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ReportFromOptions(PC pc, PC_Ainsworth *data, AinsworthOptionItems PetscOptionsObject)
{
  AinsworthReportSettings      *settings   = &data->settings;
  const AinsworthReportSettings last       = *settings;
  PetscReal                     eigenvalue = PetscMax(settings->eigenvalue, 0.0); /* PETSC_DEFAULT is negative */
  PetscBool                     given;

  PetscFunctionBegin;
  PetscCall(MonitorFromOptions(pc, settings, PetscOptionsObject));
  PetscCall(ReferenceFromOptions(pc, settings, PetscOptionsObject));
  PetscCall(PetscOptionsEnum("-pc_ainsworth_stop", "What ends the reduced solve", PCAINSWORTH, stopTypes,
                             (PetscEnum)settings->stop, (PetscEnum *)&settings->stop, NULL));
  PetscCall(
    RealOption(pc, PetscOptionsObject, "-pc_ainsworth_error_rtol", "Tolerance of energy_error", 1.0, &settings->rtol));
  PetscCall(IsGiven(pc, "-pc_ainsworth_error_rtol", &given));
  PetscCheck(!given || settings->stop == AINSWORTH_STOP_ENERGY_ERROR, PetscObjectComm((PetscObject)pc),
             PETSC_ERR_ARG_INCOMP, "-pc_ainsworth_error_rtol has no effect without -pc_ainsworth_stop energy_error");
  PetscCall(RealOption(pc, PetscOptionsObject, "-pc_ainsworth_error_eigenvalue",
                       "Lower bound of the spectrum of the preconditioned operator", PETSC_INFINITY, &eigenvalue));
  if (eigenvalue > 0.0) settings->eigenvalue = eigenvalue;
  if (settings->viewer != last.viewer || settings->stop != last.stop || settings->eigenvalue != last.eigenvalue)
    PetscCall(AinsworthReportDestroy(&data->reporting.report));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Reads the options of the inner solver, if set-up has read them before; another method or preconditioner needs another
   set-up
*/
static PetscErrorCode InnerFromOptions(PC pc, PC_Ainsworth *data)
{
  PC        inner;
  char      method[256], type[256];
  PetscBool same[2];

  PetscFunctionBegin;
  if (!data->inner.configured) PetscFunctionReturn(PETSC_SUCCESS);
  if (!data->saddle) { /* the last set-up ended before it had A: the next one reads the options */
    data->inner.configured = PETSC_FALSE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(AinsworthSolverGetInnerPC(data, &inner));
  PetscCall(PetscStrncpy(method, AinsworthTypeName((PetscObject)data->inner.ksp), sizeof(method)));
  PetscCall(PetscStrncpy(type, AinsworthTypeName((PetscObject)inner), sizeof(type)));
  data->inner.configured = PETSC_FALSE;
  PetscCall(AinsworthSolverConfigureKSP(pc, data));
  PetscCall(PetscStrcmp(method, AinsworthTypeName((PetscObject)data->inner.ksp), &same[0]));
  PetscCall(PetscStrcmp(type, AinsworthTypeName((PetscObject)inner), &same[1]));
  if (!same[0] || !same[1]) PetscCall(PCAinsworthSetStale_Private(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads -pc_ainsworth_diagnose, with or without a file */
static PetscErrorCode ReadDiagnose(PC pc, PC_Ainsworth *data, AinsworthOptionItems PetscOptionsObject)
{
  char      file[PETSC_MAX_PATH_LEN] = "";
  PetscBool set, yes, no;

  PetscFunctionBegin;
  PetscCall(PetscOptionsString("-pc_ainsworth_diagnose",
                               "Prints what set-up finds, and advice, [also as JSON to this file]", PCAINSWORTH, file,
                               file, sizeof(file), &set));
  PetscCall(PetscStrInList(file, "true,yes,on,1", ',', &yes));
  PetscCall(PetscStrInList(file, "false,no,off,0", ',', &no));
  if (!set || no) data->diagnosis.reset();
  else if (!data->diagnosis || data->diagnosis->file != (yes ? "" : file)) {
    data->diagnosis.reset(new AinsworthDiagnosis());
    if (!yes) data->diagnosis->file = file;
    /* checks that it can be written */
    PetscCall(AinsworthDiagnosisSave(data->diagnosis.get(), PetscObjectComm((PetscObject)pc), PETSC_TRUE));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode PCSetFromOptions_Ainsworth(PC pc, AinsworthOptionItems PetscOptionsObject)
{
  PC_Ainsworth *data = PCAinsworthData_Private(pc);
  const char   *prefix;

  PetscFunctionBegin;
  PetscOptionsHeadBegin(PetscOptionsObject, "Ainsworth options");
  PetscCall(ChoicesFromOptions(pc, data, PetscOptionsObject));
  PetscCall(PCAinsworthFieldsFromOptions_Private(pc, data, PetscOptionsObject));
  PetscCall(ReportFromOptions(pc, data, PetscOptionsObject));
  PetscCall(ReadDiagnose(pc, data, PetscOptionsObject));
  PetscOptionsHeadEnd();
  PetscCall(PCGetOptionsPrefix(pc, &prefix)); /* it may have been set after this PC was created */
  PetscCall(KSPSetOptionsPrefix(data->inner.ksp, prefix));
  PetscCall(KSPAppendOptionsPrefix(data->inner.ksp, "ainsworth_"));
  PetscCall(InnerFromOptions(pc, data));
  PetscFunctionReturn(PETSC_SUCCESS);
}
