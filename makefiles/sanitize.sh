#!/bin/sh
# Tests with the address, leak and undefined-behaviour sanitizers, in a folder of its own:
# sh makefiles/sanitize.sh [arguments for ctest]
# Without arguments: the random systems on 1 and 2 ranks, some minutes with the build. All of the mathematics:
# sh makefiles/sanitize.sh -L 'dense|fuzz'
. "$(dirname "$0")/common.sh"
if [ $# = 0 ]; then
  set -- -R '^fuzz.*_np[12]$'
  AINSWORTH_TARGET=fuzz_programs
  export AINSWORTH_TARGET
fi
AINSWORTH_BUILD=$build-sanitize sh "$root/makefiles/build.sh" -DAINSWORTH_SANITIZE=address,undefined
say "test with sanitizers"
cd "$build-sanitize"
# PETSc's own allocation checks are no help beside the sanitizer's, and slow.
exec env PETSC_OPTIONS='-malloc_debug 0' ctest -j "$jobs" --output-on-failure "$@"
