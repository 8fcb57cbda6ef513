#!/bin/sh
# Tests with the address and undefined-behaviour sanitizers, in a folder of its own: sh makefiles/sanitize.sh [arguments for ctest]
# Without arguments: the dense tests on 1 and 3 ranks and the random systems on 1 and 2; some minutes.
. "$(dirname "$0")/common.sh"
AINSWORTH_BUILD=$build-sanitize sh "$root/makefiles/build.sh" -DAINSWORTH_SANITIZE=address,undefined
if [ $# = 0 ]; then set -- -R '^dense_.*_np[13]$|^fuzz_np[12]$'; fi
say "test with sanitizers"
cd "$build-sanitize"
# PETSc's own allocation checks are no help beside the sanitizer's, and slow.
exec env PETSC_OPTIONS='-malloc_debug 0' ctest -j "$jobs" --output-on-failure "$@"
