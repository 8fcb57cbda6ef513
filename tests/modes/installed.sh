#!/bin/sh
# Installs into a scratch folder, moves it, and loads the library for SLEPc from there, which finds the plugin
# beside it:
# installed.sh <build> <cmake> <tutorial> [its options]
set -eu
build=$1 cmake=$2 program=$3
shift 3
rm -rf prefix moved
"$cmake" --install "$build" --prefix "$PWD/prefix" >/dev/null
mv prefix moved
test -e moved/include/slepcainsworth.h
"$program" -dll_append "$(find "$PWD/moved" -name libainsworthslepc.so)" "$@"
