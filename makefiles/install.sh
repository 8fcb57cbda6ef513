#!/bin/sh
# Installs with apt what building and testing needs and the machine lacks: sh makefiles/install.sh [further tools]
. "$(dirname "$0")/common.sh"

packages="cmake make g++ pkg-config libmetis-dev libeigen3-dev openmpi-bin libopenmpi-dev $*"
# OpenBLAS takes the place of Debian's reference BLAS: MUMPS is four times as fast with it.
if [ $own_petsc = 0 ]; then packages="$packages libpetsc-real-dev libopenblas0-serial python3 python3-petsc4py python3-numpy python3-matplotlib"; fi

# PETSc's examples are in a package whose name carries the version of the PETSc at hand.
examples() {
  apt-cache depends libpetsc-real-dev 2>/dev/null | sed -n 's/.*Depends: libpetsc-real\([0-9.]*\)-dev$/libpetsc\1-dev-examples/p' | head -n 1
}

missing_packages() {
  missing=
  for package in $packages; do installed "$package" || missing="$missing $package"; done
  if [ $own_petsc = 0 ]; then
    package=$(examples)
    # Not known before the first apt-get update: any name of its kind will do to say that something is missing.
    if [ -z "$package" ]; then missing="$missing libpetsc-dev-examples"; elif ! installed "$package"; then missing="$missing $package"; fi
  fi
}

if ! command -v apt-get >/dev/null 2>&1; then
  for tool in cmake make c++ pkg-config mpiexec "$@"; do
    command -v "$tool" >/dev/null 2>&1 || { echo "install.sh: no apt-get here, and $tool is missing: install it, PETSc and METIS by other means" >&2; exit 1; }
  done
  exit 0
fi

missing_packages
if [ -z "$missing" ]; then exit 0; fi

if [ "$(id -u)" != 0 ] && ! command -v sudo >/dev/null 2>&1; then
  echo "install.sh: missing:$missing. Neither root nor sudo: have them installed by an administrator" >&2
  exit 1
fi
apt update
missing_packages
# shellcheck disable=SC2086 # a list of words
apt install --no-install-recommends $missing
