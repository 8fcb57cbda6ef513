#!/bin/sh
# Installs into a scratch folder, builds a program with nothing but pkg-config, and runs it:
# install.sh <cmake> <build> <source> <mpicc> <options of the program>
set -eu
cmake=$1 build=$2 source=$3 mpicc=$4
shift 4
prefix=$PWD/prefix
rm -rf "$prefix"
"$cmake" --install "$build" --prefix "$prefix" >/dev/null
folder=$(dirname "$(find "$prefix" -name ainsworth.pc)")
PKG_CONFIG_PATH=$folder${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}
export PKG_CONFIG_PATH
plugin=$(pkg-config --variable=plugin ainsworth)
# A PETSc outside the system's folders is found by its path, as by every program that uses it.
# shellcheck disable=SC2046 # a list of words
"$mpicc" "$source" -o program -Wl,-rpath,"$(dirname "$plugin")" $(pkg-config --libs-only-L ainsworth | sed 's/-L/-Wl,-rpath,/g') \
  $(pkg-config --cflags --libs ainsworth)
./program "$@"
./program -dll_append "$plugin" "$@"
