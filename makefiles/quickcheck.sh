#!/bin/sh
# Does an installed plugin work? The first example on one and on two ranks: quickcheck.sh <libainsworth.so> <ex1>
# The forces in the ties of ex1 add up to the force that pulls, which is 1.
set -eu
. "$(dirname "$0")/common.sh"
plugin=$1 ex1=$2
for ranks in 1 2; do
  command=$(launcher $ranks)
  # shellcheck disable=SC2086 # the launcher is several words
  if ! said=$(OMP_NUM_THREADS=1 $command "$ex1" -dll_append "$plugin" -ksp_type preonly -pc_type ainsworth 2>&1); then
    printf '%s\n' "$said" "failed on $ranks rank(s): $command $ex1 -dll_append $plugin" >&2
    exit 1
  fi
  case $said in
    *"the ties carry 1.00000"*) echo "ex1 on $ranks rank(s): $said" ;;
    *) printf '%s\n' "$said" "wrong on $ranks rank(s): the ties should carry 1.000000" >&2; exit 1 ;;
  esac
done
