/* Findings of a diagnosis, facts and advice in one list, printed as text and saved as JSON (docs/troubleshooting.md) */
#ifndef AINSWORTH_DIAGNOSIS_H
#define AINSWORTH_DIAGNOSIS_H

#include "../base/petsccompat.h"
#include <string>
#include <vector>

/* In order of severity: advice is printed worst first */
typedef enum {
  AINSWORTH_FACT,
  AINSWORTH_COSTLY,   /* correct, but could be cheaper */
  AINSWORTH_DOUBTFUL, /* usually a mistake */
  AINSWORTH_FATAL     /* there is no solution, or none was found */
} AinsworthFindingType;

struct AinsworthFinding {
  AinsworthFindingType type = {};
  std::string          key, value, sentence; /* value is JSON */
  bool                 printed = false;
};

struct AinsworthDiagnosis {
  std::string                   file; /* JSON output file; empty for none */
  std::vector<AinsworthFinding> findings;
  bool                          finished = false; /* set-up has reported everything */
};

std::string AinsworthJSON(PetscInt);
std::string AinsworthJSON(PetscReal);
std::string AinsworthJSON(const char[]);

/* Returns a JSON object of names and values, which are JSON already */
template <typename... Rest>
std::string AinsworthJSON(const char name[], const std::string &value, const Rest &...rest)
{
  const std::string member = AinsworthJSON(name) + ": " + value;

  if constexpr (sizeof...(rest) > 0) return "{" + member + ", " + AinsworthJSON(rest...).substr(1);
  else return "{" + member + "}";
}

/* Adds a finding unless its sentence is already there; not collective, but called alike on all ranks */
PETSC_INTERN void AinsworthDiagnosisAdd(AinsworthDiagnosis *, AinsworthFindingType, const char key[],
                                        const std::string &value, const char sentence[], ...)
  PETSC_ATTRIBUTE_FORMAT(5, 6);
/* Makes findings with this key fatal: after a failure they are its probable cause */
void AinsworthDiagnosisConfirm(AinsworthDiagnosis *, const char key[]);
/* Puts findings with this key before all others of their severity */
void AinsworthDiagnosisPutFirst(AinsworthDiagnosis *, const char key[]);
/*
   Print new facts under a title, print new advice or that there is none, and save all findings as JSON; only the last
   is collective
*/
PetscErrorCode AinsworthDiagnosisPrintFacts(AinsworthDiagnosis *, MPI_Comm, const char title[]);
PetscErrorCode AinsworthDiagnosisPrintAdvice(AinsworthDiagnosis *, MPI_Comm);
PetscErrorCode AinsworthDiagnosisSave(const AinsworthDiagnosis *, MPI_Comm, PetscBool agree);

#endif
