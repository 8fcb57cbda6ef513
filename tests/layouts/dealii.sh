#!/bin/sh
# Compiles and runs tutorials/foreign/stokes_dealii.cc; 77 without deal.II:
# dealii.sh <its source> <plugin> <cmake> <launcher, words>
set -eu
source=$1 plugin=$2 cmake=$3
shift 3
mkdir -p dealii
cat >dealii/CMakeLists.txt <<END
cmake_minimum_required(VERSION 3.20)
find_package(deal.II 9.4 QUIET)
if(NOT deal.II_FOUND OR NOT DEAL_II_WITH_PETSC OR NOT DEAL_II_WITH_P4EST)
  message(FATAL_ERROR "no deal.II with PETSc and p4est")
endif()
deal_ii_initialize_cached_variables()
project(stokes CXX)
add_executable(stokes_dealii $source)
deal_ii_setup_target(stokes_dealii)
END
if ! "$cmake" -S dealii -B dealii/build -DCMAKE_BUILD_TYPE=Release >dealii/log 2>&1; then
  tail -n 5 dealii/log
  exit 77
fi
"$cmake" --build dealii/build
for ranks in 1 2 3; do
  for mesh in '2 4 1' '3 2 1'; do
    # shellcheck disable=SC2086 # numbers
    "$@" -n $ranks dealii/build/stokes_dealii $mesh -dll_append "$plugin" -ksp_type fgmres -pc_type ainsworth \
      -ainsworth_ksp_converged_reason -ksp_error_if_not_converged -ksp_view
  done
done
