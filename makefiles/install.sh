#!/bin/sh
# Installs with apt what is missing here: sh makefiles/install.sh [build | demo | tests] [further packages]
#   build   to compile the plugin (the default)      demo    and what makefiles/demo.sh draws with
#   tests   and what the tests compare with
# What is there is taken, from wherever it comes: tools in PATH, a PETSc that PETSC_DIR or PKG_CONFIG_PATH names, with
# its MPI and METIS.
. "$(dirname "$0")/common.sh"
what=build
case ${1:-} in build|demo|tests) what=$1; shift ;; esac

# A chosen PETSc has its own MPI, and often METIS.
petscvariables=${PETSC_DIR:-}/${PETSC_ARCH:-}/lib/petsc/conf/petscvariables
has_petsc() {
  [ $own_petsc = 1 ] || [ -d /usr/lib/petscdir/petsc-real ] ||
    pkg-config --exists petsc 2>/dev/null || pkg-config --exists PETSc 2>/dev/null
}
has_metis() {
  grep -q '^METIS_LIB *= *[^ ]' "$petscvariables" 2>/dev/null || pkg-config --exists metis 2>/dev/null ||
    echo '#include <metis.h>' | ${CXX:-c++} -E -x c++ - >/dev/null 2>&1
}
has_program() { command -v "$1" >/dev/null 2>&1; }
has_module() { /usr/bin/python3 -c "import $1" >/dev/null 2>&1; }

# PETSc's examples are in a package whose name carries the version of the PETSc at hand; any name of its kind before
# apt-get update
examples() {
  name=$(apt-cache depends libpetsc-real-dev 2>/dev/null |
    sed -n 's/.*Depends: libpetsc-real\([0-9.]*\)-dev$/libpetsc\1-dev-examples/p' | head -n 1)
  echo "${name:-libpetsc-dev-examples}"
}

# A line for each thing that is missing: the package of Debian, and what it is for
missing() {
  has_program cmake || echo cmake
  has_program make || echo make
  has_program "${CXX:-c++}" || echo g++
  has_program pkg-config || echo pkg-config
  has_petsc || echo libpetsc-real-dev
  has_metis || echo libmetis-dev
  if [ $own_petsc = 0 ]; then has_program mpiexec || echo openmpi-bin; fi
  for package in "$@"; do has_program "$package" || installed "$package" || echo "$package"; done
  if [ "$what" = build ]; then return; fi
  has_program python3 || echo python3
  if [ "$what" = tests ]; then [ -e /usr/include/eigen3/Eigen/Dense ] || echo libeigen3-dev; fi
  if [ $own_petsc = 1 ]; then return; fi
  has_module numpy || echo python3-numpy
  has_module matplotlib || echo python3-matplotlib
  # MUMPS is four times as fast as with Debian's reference BLAS.
  installed libopenblas0-pthread || installed libopenblas0-serial || installed libopenblas0-openmp ||
    echo libopenblas0-serial
  if [ "$what" = demo ]; then return; fi
  pkg-config --exists slepc 2>/dev/null || echo slepc-dev
  has_module petsc4py || echo python3-petsc4py
  has_module slepc4py || echo python3-slepc4py
  has_module scipy || echo python3-scipy
  has_module gmsh || echo python3-gmsh
  installed "$(examples)" || examples
}

list=$(missing "$@" | tr '\n' ' ')
if [ -z "$list" ]; then exit 0; fi
if ! has_program apt-get; then
  echo "install.sh: missing, by the names that Debian gives them: $list" >&2
  echo "install.sh: there is no apt-get here." \
    "Install them by other means, and say PETSC_DIR where PETSc is not found." >&2
  exit 1
fi
if [ "$(id -u)" != 0 ] && ! has_program sudo; then
  echo "install.sh: missing: $list" >&2
  echo "install.sh: you are not root, and there is no sudo." \
    "Have an administrator run: apt-get install --no-install-recommends $list" >&2
  exit 1
fi
apt update
list=$(missing "$@" | tr '\n' ' ')
# shellcheck disable=SC2086 # a list of words
apt install --no-install-recommends $list
