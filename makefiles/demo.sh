#!/bin/sh
# Installs, builds, and solves the two-cube contact problem on 2 ranks: sh makefiles/demo.sh [further options of the program]
. "$(dirname "$0")/common.sh"
sh "$root/makefiles/install.sh"
sh "$root/makefiles/build.sh"
OMP_NUM_THREADS=1
export OMP_NUM_THREADS
# shellcheck disable=SC2046 # the launcher is several words
set -- $(launcher 2) "$build/tutorials/twocubes" -n1 24 -n2 20 -E2 10 \
  -dll_append "$build/libainsworth.so" -ksp_type preonly -pc_type ainsworth \
  -ainsworth_ksp_monitor -ainsworth_ksp_converged_reason "$@"
say "two cubes in contact: the program does not know the plugin, the options do"
echo "\$ $*"
exec "$@"
