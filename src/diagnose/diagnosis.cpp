#include "diagnosis.h"
#include <algorithm>
#include <cstdarg>

static const char *const types[] = {"fact", "costly", "doubtful", "fatal"};

std::string AinsworthJSON(PetscInt number)
{
  return std::to_string(number);
}

/* Prints all digits; JSON has neither NaN nor Inf */
std::string AinsworthJSON(PetscReal number)
{
  char text[64];

  if (PetscIsInfOrNanReal(number)) return "null";
  (void)snprintf(text, sizeof(text), "%.17g", (double)number);
  return text;
}

std::string AinsworthJSON(const char text[])
{
  std::string quoted = "\"";

  for (const char *c = text; *c; c++) {
    char code[8];

    (void)snprintf(code, sizeof(code), "\\u%04x", (unsigned)(unsigned char)*c);
    if (*c == '"' || *c == '\\') quoted += std::string("\\") + *c;
    else if ((unsigned char)*c < ' ') quoted += code;
    else quoted += *c;
  }
  return quoted + '"';
}

void AinsworthDiagnosisAdd(AinsworthDiagnosis *d, AinsworthFindingType type, const char key[], const std::string &value,
                           const char sentence[], ...)
{
  char    text[1024];
  va_list arguments;

  va_start(arguments, sentence);
  (void)vsnprintf(text, sizeof(text), sentence, arguments);
  va_end(arguments);
  for (const AinsworthFinding &finding : d->findings)
    if (finding.sentence == text) return;
  d->findings.push_back({type, key, value, text, false});
}

void AinsworthDiagnosisConfirm(AinsworthDiagnosis *d, const char key[])
{
  for (AinsworthFinding &finding : d->findings)
    if (finding.key == key) finding.type = AINSWORTH_FATAL;
}

void AinsworthDiagnosisPutFirst(AinsworthDiagnosis *d, const char key[])
{
  std::stable_partition(d->findings.begin(), d->findings.end(),
                        [=](const AinsworthFinding &finding) { return finding.key == key; });
}

/* Selects the facts, or the advice with the worst first, otherwise in the order found */
static std::vector<AinsworthFinding *> Select(AinsworthDiagnosis *d, bool advice)
{
  std::vector<AinsworthFinding *> selected;

  for (AinsworthFinding &finding : d->findings)
    if ((finding.type != AINSWORTH_FACT) == advice) selected.push_back(&finding);
  std::stable_sort(selected.begin(), selected.end(),
                   [](const AinsworthFinding *a, const AinsworthFinding *b) { return a->type > b->type; });
  return selected;
}

/* Formats a list of findings: as JSON all, as text those not printed yet */
static std::string Write(AinsworthDiagnosis *d, bool advice, bool json)
{
  std::string text;

  for (AinsworthFinding *finding : Select(d, advice)) {
    if (json) {
      text += text.empty() ? "\n" : ",\n";
      text += "    {\"key\": " + AinsworthJSON(finding->key.c_str()) + ", \"value\": " + finding->value;
      if (advice) text += std::string(", \"type\": \"") + types[finding->type] + "\"";
      text += ", \"sentence\": " + AinsworthJSON(finding->sentence.c_str()) + "}";
    } else if (!finding->printed) {
      text += "  " + (advice ? std::string(types[finding->type]) + ": " : std::string()) + finding->sentence + "\n";
      finding->printed = true;
    }
  }
  return text;
}

PetscErrorCode AinsworthDiagnosisPrintFacts(AinsworthDiagnosis *d, MPI_Comm comm, const char title[])
{
  const std::string text = Write(d, false, false);

  PetscFunctionBegin;
  if (!text.empty()) PetscCall(PetscPrintf(comm, "Ainsworth diagnosis, %s\n%s", title, text.c_str()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode AinsworthDiagnosisPrintAdvice(AinsworthDiagnosis *d, MPI_Comm comm)
{
  const bool        healthy = Select(d, true).empty();
  const std::string text    = Write(d, true, false);

  PetscFunctionBegin;
  if (healthy) PetscCall(PetscPrintf(comm, "Ainsworth diagnosis: nothing to complain about\n"));
  else if (!text.empty()) PetscCall(PetscPrintf(comm, "Ainsworth diagnosis, advice\n%s", text.c_str()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Saves all findings as JSON; agree: collective, raises an error on all ranks if the file cannot be written; otherwise
   an error is already being handled
*/
PetscErrorCode AinsworthDiagnosisSave(const AinsworthDiagnosis *d, MPI_Comm comm, PetscBool agree)
{
  AinsworthDiagnosis copy = *d;
  PetscMPIInt        rank, saved = 1;

  PetscFunctionBegin;
  if (d->file.empty()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    const std::string text = "{\n  \"facts\": [" + Write(&copy, false, true) + "\n  ],\n  \"advice\": [" +
                             Write(&copy, true, true) + "\n  ]\n}\n";
    FILE *file = fopen(d->file.c_str(), "w");

    saved = file && fputs(text.c_str(), file) >= 0;
    if (file && fclose(file)) saved = 0;
  }
  if (!agree) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Bcast(&saved, 1, MPI_INT, 0, comm));
  PetscCheck(saved, comm, PETSC_ERR_FILE_OPEN, "-pc_ainsworth_diagnose cannot write the file %s", d->file.c_str());
  PetscFunctionReturn(PETSC_SUCCESS);
}
