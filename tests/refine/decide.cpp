/* The decision of iterative refinement, as a table of states */
#include "system.h"

static const PetscReal none = PETSC_MAX_REAL, open = 1e-6;

struct Line {
  const char            *name;
  AinsworthProgress      state; /* excess, before, moved, last, settles, steps */
  AinsworthProgressState next;
};

/* clang-format off */
static const Line table[] = {
  {"met and settled",                  {1.0,    none, none, none, true,  0},  AINSWORTH_CONVERGED},
  {"nothing left and settled",         {0.0,    none, none, none, true,  0},  AINSWORTH_CONVERGED},
  {"unmet at first",                   {1.001,  none, none, none, true,  0},  AINSWORTH_WORKING},
  {"unmet and not settled at first",   {1e9,    none, none, none, false, 0},  AINSWORTH_WORKING},
  {"infinite at first",                {none,   none, none, none, false, 0},  AINSWORTH_WORKING},
  {"met but not settled at first",     {0.5,    none, none, none, false, 0},  AINSWORTH_WORKING},
  {"no move counts without a step",    {0.5,    none, 0.0,  none, false, 0},  AINSWORTH_WORKING},
  {"unmet with progress",              {10.0,   20.0, 1.0,  none, true,  1},  AINSWORTH_WORKING},
  {"unmet with progress, still",       {10.0,   20.0, 0.0,  none, false, 5},  AINSWORTH_WORKING},
  {"unmet without enough progress",    {10.0,   19.9, 1e-9, none, true,  1},  AINSWORTH_NO_PROGRESS},
  {"unmet without progress",           {10.0,   10.0, 1.0,  3.0,  false, 3},  AINSWORTH_NO_PROGRESS},
  {"worse",                            {10.0,   1.0,  1.0,  3.0,  true,  3},  AINSWORTH_NO_PROGRESS},
  {"infinite and stays so",            {none,   none, none, none, false, 1},  AINSWORTH_NO_PROGRESS},
  {"met now and settled by itself",    {1.0,    1.5,  1.0,  none, true,  1},  AINSWORTH_CONVERGED},
  {"moved just as far as it may",      {0.5,    0.5,  open, none, false, 1},  AINSWORTH_CONVERGED},
  {"moved a bit farther",              {0.5,    0.5,  1.01e-6, none, false, 1}, AINSWORTH_WORKING},
  {"moved by the first step",          {0.5,    0.5,  0.3,  none, false, 1},  AINSWORTH_WORKING},
  {"moves half as far",                {0.5,    0.5,  0.1,  0.2,  false, 2},  AINSWORTH_WORKING},
  {"moves more than half as far",      {0.5,    0.5,  0.11, 0.2,  false, 2},  AINSWORTH_NO_PROGRESS},
  {"moves as far again",               {0.5,    0.5,  0.2,  0.2,  false, 4},  AINSWORTH_NO_PROGRESS},
  {"nine steps with progress",         {10.0,   30.0, 0.1,  0.3,  false, 9},  AINSWORTH_WORKING},
  {"ten steps with progress",          {10.0,   30.0, 0.1,  0.3,  false, 10}, AINSWORTH_NO_PROGRESS},
  {"ten steps, met, moves less",       {0.5,    0.5,  0.1,  0.3,  false, 10}, AINSWORTH_NO_PROGRESS},
  {"ten steps, met and still",         {0.5,    0.5,  1e-7, 0.3,  false, 10}, AINSWORTH_CONVERGED}
};
/* clang-format on */

PetscErrorCode TestDecide()
{
  PetscFunctionBeginUser;
  for (const Line &line : table) {
    Case("decide: %s", line.name);
    PetscCall(CheckInt("the decision", AinsworthDecide(line.state, open), line.next));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
