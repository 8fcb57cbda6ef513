#!/bin/sh
# The picture of the demo, and solvers compared on matrices in files:
# pictures.sh <folder of the project> <build> <python>
# Without Poisson's effect and friction the pressure between two cubes of one material and mesh is the same everywhere:
# half the push, 0.005.
set -eu
root=$1 build=$2 python=$3
AINSWORTH_BUILD=$build
export AINSWORTH_BUILD
rm -rf error-vs-time system_* bodies.* error.*
"$build/bench/twocubes" -n1 4 -n2 4 -E2 1 -nu1 0 -nu2 0 -stick 0 -view_vtu bodies.vtu -write_system system \
  -dll_append "$build/libainsworth.so" -ksp_type preonly -pc_type ainsworth -pc_ainsworth_monitor_error csv:error.csv
"$python" "$root/docs/study/bodies.py" bodies.vtu bodies.png
test -s bodies.png
"$python" "$root/tutorials/monitor.py" error.csv error.png
test -s error.png
"$python" "$root/docs/study/errortime.py" --system system_A.dat system_C.dat system_f.dat system_g.dat \
  --block-size 3 --solvers ainsworth mumps --last 2 --repeat 1
test -s error-vs-time/diagrams.svg
if "$python" "$root/docs/study/errortime.py" --system system_A.dat system_C.dat system_f.dat \
  --block-size 4 2>refused; then exit 1; fi
cat refused
