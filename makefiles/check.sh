#!/bin/sh
# Installs, builds with warnings as errors, runs every test: sh makefiles/check.sh [arguments for ctest]
. "$(dirname "$0")/common.sh"
sh "$root/makefiles/install.sh" tests
# Without an own PETSc everything is there, so no test may be left out.
if [ $own_petsc = 0 ]; then all=ON; else all=OFF; fi
sh "$root/makefiles/build.sh" -DAINSWORTH_WERROR=ON -DBUILD_TESTING=ON -DAINSWORTH_ALL_TESTS=$all
say "test"
cd "$build"
exec ctest -j2 --output-on-failure "$@"
