#!/bin/sh
# Two elastic bodies in contact, solved and drawn, and error against run time for a few solvers:
# sh makefiles/demo.sh [options of the program]
. "$(dirname "$0")/common.sh"
build=$build-demo
say "demo: installs Debian's packages where they are missing (with PETSc 1 to 2 GB, minutes), compiles and computes."
say "Together some minutes, twenty on a slow machine; a line every 15 seconds says how far it is."
say "All that it writes is in $build, less than 160 MB."
sh "$root/makefiles/install.sh" demo
begin=$(date +%s)
say "compiles the plugin and the programs"
AINSWORTH_BUILD=$build AINSWORTH_TARGET=demo
export AINSWORTH_BUILD AINSWORTH_TARGET
# Without the tests, and without what debuggers read
with_progress "$build.log" sh "$root/makefiles/build.sh" -DBUILD_TESTING=OFF -DCMAKE_BUILD_TYPE=Release ||
  { cat "$build.log"; exit 1; }
mv "$build.log" "$build/build.log"
OMP_NUM_THREADS=1
export OMP_NUM_THREADS
# shellcheck disable=SC2046 # the launcher is several words
set -- $(launcher 2) "$build/bench/twocubes" -n1 24 -n2 20 -E2 10 -near_nullspace -view_vtu "$build/bodies.vtu" \
  -dll_append "$build/libainsworth.so" -ksp_type preonly -pc_type ainsworth \
  -ainsworth_ksp_monitor -ainsworth_ksp_converged_reason "$@"
say "two cubes in contact: the program does not know the plugin, the options do"
echo "\$ $*"
"$@"
finish() {
  say "$(($(date +%s) - begin)) s since the packages were there, $(du -sm "$build" | cut -f 1) MB in $build"
  say "next: docs/tutorial.md, from your own program to ainsworth"
}
if ! /usr/bin/python3 -c 'import matplotlib' 2>/dev/null; then
  say "no pictures: there is no matplotlib for /usr/bin/python3. For ParaView: $build/bodies.vtu"
  finish
  exit 0
fi
say "the deformed bodies with the contact pressure"
/usr/bin/python3 "$root/docs/study/bodies.py" "$build/bodies.vtu" "$build/bodies.png"
help="python3 docs/study/errortime.py --help"
say "seconds to an error, a small problem (more solvers and sizes, your own matrices: $help)"
if ! AINSWORTH_BUILD=$build /usr/bin/python3 "$root/docs/study/errortime.py" --table --out "$build/error-vs-time" \
  --cases base --n1 12 --repeat 1 --last 8 \
  --solvers ainsworth ainsworth_paper elimination fieldsplit_selfp golub_greif minres mumps; then
  say "no comparison of solvers: it needs a PETSc with MUMPS"
fi
echo "          $build/bodies.png"
finish
