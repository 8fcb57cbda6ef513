#!/bin/sh
# A parallel test under valgrind's memcheck: sh makefiles/valgrind.sh [program of the build folder [arguments]]
# Without arguments: 40 random systems on 2 ranks. Errors inside of MPI and of its helpers do not count; those of the
# plugin and of the test fail.
. "$(dirname "$0")/common.sh"
command -v valgrind >/dev/null 2>&1 || sh "$root/makefiles/install.sh" tests valgrind
if [ ! -e "$build/libainsworth.so" ]; then sh "$root/makefiles/build.sh"; fi
if [ $# = 0 ]; then set -- tests/fuzz/fuzz -cases 40 -errors 0; fi
log=$(mktemp -d)
trap 'rm -rf "$log"' EXIT
say "valgrind: $*"
OMP_NUM_THREADS=1
export OMP_NUM_THREADS
cd "$build"
# shellcheck disable=SC2046 # the launcher is several words
$(launcher 2) valgrind -q --num-callers=20 --fullpath-after="$root/" --log-file="$log/%p" "$@"
# An error is a paragraph; ours have a line of src/ or tests/ among their callers.
if cat "$log"/* | sed -E 's/^==[0-9]+== ?//' |
  awk -v RS= '/\((src|tests)\// && /Invalid (read|write|free)|uninitialised|Mismatched|overlap/ {
    print $0 "\n"; bad = 1 } END { exit bad }'; then
  echo "no errors of the plugin"
else
  exit 1
fi
