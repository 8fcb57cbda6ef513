/* Choice of the bounded rows that are held at a bound in the next step */
#include "activeset.h"
#include "../base/loops.h"
#include "../saddle/saddle.h"

/* Computes a hash of the present set, the same on any number of ranks; collective */
static PetscErrorCode NumberOfSet(const SNES_AinsworthActiveSet *as, uint64_t *number)
{
  PetscInt rstart;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(as->bounded, &rstart, NULL));
  *number = 0;
  for (PetscInt i : as->rows) *number += AinsworthMixState(0, 4 * (uint64_t)(rstart + i) + (uint64_t)as->hold[i] + 1);
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, number, 1, MPI_UINT64_T, MPI_SUM, PetscObjectComm((PetscObject)as->bounded)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Finds the bound at which each bounded row belongs according to X and F; first: sets the present set from X alone;
   collective
*/
PetscErrorCode AinsworthActiveSetFindWrong(SNES_AinsworthActiveSet *as, Vec X, Vec F, Vec lower, Vec upper, bool first,
                                           std::vector<AinsworthHold> &wanted)
{
  PetscReal now[2] = {0.0, 0.0};

  PetscFunctionBegin;
  PetscCall(AinsworthForEntries({as->bounded, X, F}, [&](PetscInt, PetscScalar b, PetscScalar x, PetscScalar f) {
    if (b == 0.0) return;
    now[0] = PetscMax(now[0], PetscAbsScalar(x));
    now[1] = PetscMax(now[1], PetscAbsScalar(f));
  }));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, now, 2, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)X)));
  as->largest = PetscMax(as->largest, now[1]);
  wanted      = as->hold;
  as->wrong   = 0;
  auto look   = [&](PetscInt i, PetscScalar b, PetscScalar x, PetscScalar f, PetscScalar l, PetscScalar u) {
    const PetscReal at = PetscRealPart(x), force = PetscRealPart(f), low = PetscRealPart(l), high = PetscRealPart(u);
    const PetscReal little = as->tolerance * now[0], slight = as->tolerance * as->largest;

    if (b == 0.0) return;
    if (first) as->hold[i] = at <= low ? HOLD_LOWER : at >= high ? HOLD_UPPER : HOLD_NONE;
    wanted[i] = as->hold[i];
    if (as->hold[i] == HOLD_NONE)
      wanted[i] = at < low - little ? HOLD_LOWER : at > high + little ? HOLD_UPPER : HOLD_NONE;
    else if (low < high && (as->hold[i] == HOLD_LOWER ? force < -slight : force > slight)) wanted[i] = HOLD_NONE;
    as->wrong += wanted[i] != as->hold[i];
  };
  PetscCall(AinsworthForEntries({as->bounded, X, F, lower, upper}, look));
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &as->wrong, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)X)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
   Changes to the next set; collective

   All wrong rows change at once. When a set recurs, linear solves are no longer loose; when one recurs again, only the
   last of the wrong rows changes, until fewer are wrong than ever before.

   This terminates if the Schur complement C A^{-1} C' is positive definite (K. G. Murty, 1974; J. J. Judice and F. M.
   Pires, 1994). *cycles: a set recurred nevertheless
*/
PetscErrorCode AinsworthActiveSetChange(SNES snes, SNES_AinsworthActiveSet *as,
                                        const std::vector<AinsworthHold> &wanted, bool *cycles)
{
  PetscInt last = -1, rstart;
  uint64_t number;

  PetscFunctionBegin;
  *cycles = false;
  if (!as->wrong) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(NumberOfSet(as, &number));
  if (as->single && as->wrong < as->least) {
    as->single = false;
    as->seen.clear();
  }
  if (!as->seen.insert(number).second) {
    *cycles = as->single;
    if (!as->tight) {
      PetscCall(
        PetscInfo(snes, "A set of held multipliers came for the second time: linear solves are exact from here on\n"));
      as->tight = true;
      as->seen  = {number};
      *cycles   = false;
    } else if (!as->single) {
      PetscCall(PetscInfo(
        snes,
        "A set of held multipliers came for the second time: one row changes at a time, until fewer than %" PetscInt_FMT
        " are wrong\n",
        as->least));
      as->single = true;
      as->seen   = {number};
    }
  }
  if (!as->single) as->least = PetscMin(as->least, as->wrong);
  if (!as->single) as->hold = wanted;
  else {
    for (PetscInt i : as->rows)
      if (wanted[i] != as->hold[i]) last = i;
    PetscCall(VecGetOwnershipRange(as->bounded, &rstart, NULL));
    const PetscInt mine = last < 0 ? -1 : rstart + last;
    PetscInt       all  = mine;

    PetscCall(MPIU_Allreduce(MPI_IN_PLACE, &all, 1, MPIU_INT, MPI_MAX, PetscObjectComm((PetscObject)snes)));
    if (all == mine) as->hold[last] = wanted[last];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
