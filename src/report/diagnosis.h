/* What a diagnosis finds, facts and advice in one list, which a reader gets as text and a program as JSON (docs/diagnose.md) */
#ifndef AINSWORTH_DIAGNOSIS_H
#define AINSWORTH_DIAGNOSIS_H

#include "../petsccompat.h"
#include <string>
#include <vector>

/* Advice comes the worst first */
typedef enum {
  AINSWORTH_FACT,
  AINSWORTH_COSTLY,   /* it could be had for less */
  AINSWORTH_DOUBTFUL, /* a mistake, as a rule */
  AINSWORTH_FATAL     /* there is no solution, or none was found */
} AinsworthFindingType;

struct AinsworthFinding {
  AinsworthFindingType type;
  std::string          key, value, sentence; /* value: as JSON */
  bool                 printed;
};

struct AinsworthDiagnosis {
  std::string                   file; /* of the JSON; empty: none */
  std::vector<AinsworthFinding> findings;
  bool                          finished = false; /* what a set-up has to tell has been told */
};

std::string AinsworthJSON(PetscInt);
std::string AinsworthJSON(PetscReal);
std::string AinsworthJSON(const char[]);

/* An object, of names and values that are JSON already */
template <typename... Rest>
std::string AinsworthJSON(const char name[], const std::string &value, const Rest &...rest)
{
  const std::string member = AinsworthJSON(name) + ": " + value;

  if constexpr (sizeof...(rest) > 0) return "{" + member + ", " + AinsworthJSON(rest...).substr(1);
  else return "{" + member + "}";
}

/* Not collective, but the same on all ranks; what was found already is not added again */
PETSC_INTERN void AinsworthDiagnosisAdd(AinsworthDiagnosis *, AinsworthFindingType, const char key[], const std::string &value, const char sentence[], ...)
  PETSC_ATTRIBUTE_FORMAT(5, 6);
/* What may be the cause of a failure, and is more than doubtful after one */
void AinsworthDiagnosisConfirm(AinsworthDiagnosis *, const char key[]);
/* New facts under a title; new advice, or that there is none; all of it as JSON. Only the last is collective */
PetscErrorCode AinsworthDiagnosisPrintFacts(AinsworthDiagnosis *, MPI_Comm, const char title[]);
PetscErrorCode AinsworthDiagnosisPrintAdvice(AinsworthDiagnosis *, MPI_Comm);
PetscErrorCode AinsworthDiagnosisSave(const AinsworthDiagnosis *, MPI_Comm, PetscBool agree);

#endif
