#!/bin/sh
# Installs into a scratch folder, moves it, and uses it from there as a new user would: by pkg-config, by find_package,
# from Python, from the shell. Then uninstalls. The mpiexec of the makefile's check is that of CMake's cache.
# install.sh <sources> <build> <cmake> <python or none> <mpicc> <linked.c> <options of the program>
set -eu
sources=$1 build=$2 cmake=$3 python=$4 mpicc=$5 linked=$6
shift 6
here=$PWD
rm -rf prefix moved away by-pkg-config by-cmake
"$cmake" --install "$build" --prefix "$here/prefix" >/dev/null
mv prefix moved
folder=$(dirname "$(find "$here/moved" -name ainsworth.pc)")
PKG_CONFIG_PATH=$folder${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}
export PKG_CONFIG_PATH
asked() { pkg-config --variable="$1" ainsworth; }
plugin=$(asked plugin)
tutorials=$(asked datadir)/tutorials

mkdir by-pkg-config by-cmake
# shellcheck disable=SC2046 # a list of words
"$mpicc" "$linked" -o by-pkg-config/linked $(pkg-config --cflags --libs ainsworth)
by-pkg-config/linked "$@"
by-pkg-config/linked -dll_append "$plugin" "$@"
# shellcheck disable=SC2046
"$mpicc" "$tutorials/ex1.c" -o by-pkg-config/ex1 $(pkg-config --cflags --libs ainsworth)
sh "$sources/makefiles/quickcheck.sh" "$plugin" by-pkg-config/ex1
# The makefile, but for what CMake does
make -f "$sources/makefiles/Makefile" BUILD="$build" CMAKE=true prefix="$here/none" all check install uninstall

cat >by-cmake/CMakeLists.txt <<EOF
cmake_minimum_required(VERSION 3.20)
project(user LANGUAGES C)
find_package(ainsworth 0.2 REQUIRED)
add_executable(linked "$linked")
target_link_libraries(linked ainsworth::ainsworth)
file(WRITE plugin "\${ainsworth_PLUGIN}")
EOF
"$cmake" -S by-cmake -B by-cmake -DCMAKE_PREFIX_PATH="$here/moved" >/dev/null
"$cmake" --build by-cmake >/dev/null
by-cmake/linked "$@"
test "$(cat by-cmake/plugin)" -ef "$plugin"

# PETSc's own name for it, and names in which PETSc expands variables
AINSWORTH_LIB=$(dirname "$plugin")
export AINSWORTH_LIB
# shellcheck disable=SC2016 # PETSc expands it
by-pkg-config/ex1 -dll_append '${AINSWORTH_LIB}/libpetscainsworth' -ksp_type preonly -pc_type ainsworth
if [ "$python" != none ]; then
  pythondir=$(asked pythondir)
  "$python" "$tutorials/ex1.py" -dll_append "$plugin" -ksp_type preonly -pc_type ainsworth
  PYTHONPATH=$pythondir${PYTHONPATH:+:$PYTHONPATH} "$python" "$sources/tests/loading/module.py"
  if "$python" -c "import matplotlib"; then # the comparison of solvers on files
    rm -rf compared
    mkdir compared
    "$build/bench/twocubes" -n1 3 -n2 3 -write_system compared/my -dll_append "$plugin" -ksp_type preonly \
      -pc_type ainsworth >/dev/null
    env -u AINSWORTH_BUILD "$python" "$(find "$here/moved" -name errortime.py)" --table --solvers ainsworth --last 1 \
      --repeat 1 --block-size 3 --out compared --system compared/my_A.dat compared/my_C.dat compared/my_f.dat |
      grep "^ainsworth .* 1 *$"
  fi
fi
if grep -r -l "$here/prefix" moved; then echo "these name the folder before it was moved"; exit 1; fi

mv moved prefix
(cd "$build" && "$cmake" -P "$sources/makefiles/uninstall.cmake" >/dev/null)
if [ -e prefix ]; then echo "uninstall has left:"; find prefix; exit 1; fi
echo "installed, moved, used, uninstalled"
