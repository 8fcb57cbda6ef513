/* Checks that count, and errors that are caught */
#include "dense.h"
#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <sstream>

std::string unusedOptions;
static int  done = 0, failed = 0;
static char label[512] = "";

void Case(const char *format, ...)
{
  va_list arguments;

  va_start(arguments, format);
  vsnprintf(label, sizeof(label), format, arguments);
  va_end(arguments);
}

/* good: as this rank sees it; the check counts as failed when one rank says so */
static PetscErrorCode Count(bool good, const std::string &message)
{
  int         bad = !good, anywhere;
  PetscMPIInt rank, first, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  first = bad ? rank : size;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, PETSC_COMM_WORLD));
  anywhere = first < size;
  done++;
  failed += anywhere;
  if (anywhere && rank == first) {
    printf("FAILED on rank %d: %s: %s\n", rank, label, message.c_str());
    fflush(stdout);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Check(const char *what, PetscReal got, PetscReal bound)
{
  char message[512];

  PetscFunctionBeginUser;
  snprintf(message, sizeof(message), "%s is %g, more than %g", what, (double)got, (double)bound);
  PetscCall(Count(got <= bound, message)); /* not a number: failed */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckTrue(const char *what, bool got)
{
  PetscFunctionBeginUser;
  PetscCall(Count(got, std::string("not true: ") + what));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckInt(const char *what, PetscInt got, PetscInt expected)
{
  PetscFunctionBeginUser;
  PetscCall(Count(got == expected,
                  std::string(what) + " is " + std::to_string(got) + ", expected " + std::to_string(expected)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckEqual(const char *what, const Dense &got, const Dense &expected, PetscReal tolerance)
{
  char message[512];

  PetscFunctionBeginUser;
  if (got.rows() != expected.rows() || got.cols() != expected.cols()) {
    snprintf(message, sizeof(message), "%s is %d x %d, expected %d x %d", what, (int)got.rows(), (int)got.cols(),
             (int)expected.rows(), (int)expected.cols());
    PetscCall(Count(false, message));
  } else {
    const PetscReal norm = expected.norm(), difference = (got - expected).norm();
    snprintf(message, sizeof(message), "%s: relative difference %g, more than %g (norms %g and %g)", what,
             (double)(difference / norm), (double)tolerance, (double)got.norm(), (double)norm);
    PetscCall(Count(difference <= tolerance * norm, message));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckText(const char *what, const std::string &got, const std::vector<std::string> &parts)
{
  PetscFunctionBeginUser;
  for (const std::string &part : parts)
    PetscCall(Count(got.find(part) != std::string::npos, std::string(what) + ": no \"" + part + "\" in:\n" + got));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode KeepMessage(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type,
                                  const char *message, void *ctx)
{
  if (type == PETSC_ERROR_INITIAL && message) *(std::string *)ctx = message;
  return code;
}

PetscErrorCode CheckError(const char *what, const std::function<PetscErrorCode()> &action, PetscErrorCode code,
                          const std::vector<std::string> &parts)
{
  std::string    message;
  PetscErrorCode got;

  PetscFunctionBeginUser;
  PetscCall(PetscPushErrorHandler(KeepMessage, &message));
  got = action();
  PetscCall(PetscPopErrorHandler());
  PetscCall(CheckInt((std::string("error code of ") + what).c_str(), (PetscInt)got, (PetscInt)code));
  PetscCall(CheckText(what, message, parts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PETSC_EXTERN __attribute__((weak)) void __lsan_do_leak_check(void);

void CheckLeaks()
{
  if (__lsan_do_leak_check) __lsan_do_leak_check();
}

PetscErrorCode ChecksFinish(int *exitcode)
{
  PetscFunctionBeginUser;
  Case("end");
  PetscCall(CheckTrue(("all options were used, unlike " + unusedOptions).c_str(), unusedOptions.empty()));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%d checks, %d failed\n", done, failed));
  *exitcode = failed > 0 || !done;
  CheckLeaks();
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FileText(const char *file, std::string &text)
{
  PetscMPIInt rank;
  int         size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (!rank) {
    std::ostringstream content;
    content << std::ifstream(file).rdbuf();
    text = content.str();
    size = (int)text.size();
    remove(file);
  }
  PetscCallMPI(MPI_Bcast(&size, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  text.resize(size);
  PetscCallMPI(MPI_Bcast(&text[0], size, MPI_CHAR, 0, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ViewText(KSP ksp, std::string &text, PetscViewerFormat format)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(PetscViewerASCIIOpen(PETSC_COMM_WORLD, "view.txt", &viewer));
  PetscCall(PetscViewerPushFormat(viewer, format));
  PetscCall(KSPView(ksp, viewer));
  PetscCall(PetscViewerPopFormat(viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(FileText("view.txt", text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode EventCount(const char *event, PetscInt *count)
{
  PetscLogEvent      id;
  PetscEventPerfInfo info;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventGetId(event, &id));
  PetscCall(PetscLogEventGetPerfInfo(0, id, &info));
  *count = info.count;
  PetscFunctionReturn(PETSC_SUCCESS);
}
