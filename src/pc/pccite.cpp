/* What -citations prints: the software, and the papers */
#include "pcainsworth.h"

static const char papers
  [] = "@inproceedings{robert_pointselle,\n"
       "  author    = {V. Robert and P. Jolivet and O. Jamond and M. A. Badri},\n"
       "  title     = {Calcul haute performance pour les probl{\\`e}mes de point-selle en m{\\'e}canique du contact},\n"
       "  booktitle = {Colloque National en Calcul de Structures (CSMA)}\n"
       "}\n"
       "@article{ainsworth2001essential,\n"
       "  author  = {M. Ainsworth},\n"
       "  title   = {Essential boundary conditions and multi-point constraints in finite element analysis},\n"
       "  journal = {Computer Methods in Applied Mechanics and Engineering},\n"
       "  volume  = {190},\n"
       "  pages   = {6323--6339},\n"
       "  year    = {2001}\n"
       "}\n";

/* PCAinsworthCite_Private - registers the citations, once */
PetscErrorCode PCAinsworthCite_Private(void)
{
  static PetscBool cited[2] = {PETSC_FALSE, PETSC_FALSE};
  char             software[256];

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(software, sizeof(software),
                          "@misc{ainsworth_plugin,\n"
                          "  author = {{The ainsworth developers}},\n"
                          "  title  = {ainsworth: Ainsworth's projection for saddle-point systems, a {PETSc} plugin},\n"
                          "  note   = {Version %d.%d.%d}\n"
                          "}\n",
                          AINSWORTH_VERSION_MAJOR, AINSWORTH_VERSION_MINOR, AINSWORTH_VERSION_SUBMINOR));
  PetscCall(PetscCitationsRegister(software, &cited[0]));
  PetscCall(PetscCitationsRegister(papers, &cited[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
