#!/bin/sh
# Which lines of src/ the tests reach, and which error checks they do not:
# sh makefiles/coverage.sh [arguments for ctest]
# In a folder of its own; installs gcovr where it is missing. Fails below 99 % of the lines, or where a PetscCheck() has
# never failed.
. "$(dirname "$0")/common.sh"
command -v gcovr >/dev/null 2>&1 || sh "$root/makefiles/install.sh" tests gcovr
AINSWORTH_BUILD=$build-coverage sh "$root/makefiles/build.sh" -DAINSWORTH_COVERAGE=ON
find "$build-coverage" -name '*.gcda' -delete
say "test with coverage"
cd "$build-coverage"
if [ $# = 0 ]; then set -- -E '_np4$'; fi
ctest -j "$jobs" --output-on-failure "$@"
say "coverage of src/"
# PetscCall(x) is a branch that is taken on errors only: lines and checks are what counts, branches are for reading.
gcovr --root "$root" --filter "$root/src/" --object-directory src --exclude-unreachable-branches \
  --json coverage.json --print-summary --txt coverage.txt --html-details coverage.html --fail-under-line 99
exec python3 "$root/tests/checks.py" coverage.json "$root"
