#!/bin/sh
# Installs, builds, solves the two-cube contact problem on 2 ranks, and draws error against run time for a few solvers on a small one:
# sh makefiles/demo.sh [further options of the program]
. "$(dirname "$0")/common.sh"
sh "$root/makefiles/install.sh" demo
sh "$root/makefiles/build.sh" -DBUILD_TESTING=OFF
OMP_NUM_THREADS=1
export OMP_NUM_THREADS
# shellcheck disable=SC2046 # the launcher is several words
set -- $(launcher 2) "$build/tutorials/twocubes" -n1 24 -n2 20 -E2 10 \
  -dll_append "$build/libainsworth.so" -ksp_type preonly -pc_type ainsworth \
  -ainsworth_ksp_monitor -ainsworth_ksp_converged_reason "$@"
say "two cubes in contact: the program does not know the plugin, the options do"
echo "\$ $*"
"$@"
# An own PETSc may come without Python and without MUMPS, which the exact solution needs.
if [ $own_petsc = 1 ]; then exit 0; fi
say "error against run time, a small problem (all solvers and sizes: python3 docs/study/errortime.py --help)"
AINSWORTH_BUILD=$build /usr/bin/python3 "$root/docs/study/errortime.py" --out "$build/error-vs-time" --cases base --n1 12 --repeat 1 --last 8 \
  --solvers ainsworth ainsworth_paper elimination fieldsplit_selfp golub_greif minres mumps
