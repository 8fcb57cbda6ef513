#!/bin/sh
# Configures and builds: sh makefiles/build.sh [arguments for cmake]; AINSWORTH_BUILD chooses the folder,
# AINSWORTH_TARGET one target
. "$(dirname "$0")/common.sh"
choose_petsc
# The cache keeps the PETSc of the first configuration: say it again where one was chosen.
if [ -n "${PETSC_DIR:-}" ]; then set -- "-DPETSC_DIR=$PETSC_DIR" "-DPETSC_ARCH=${PETSC_ARCH:-}" "$@"; fi
say "configure and build in $build"
cmake -S "$root" -B "$build" "$@"
cmake --build "$build" --parallel "$jobs" --target "${AINSWORTH_TARGET:-all}"
