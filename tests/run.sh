#!/bin/sh
# Runs one command and judges its output:
# run.sh [--pass ERE]... [--fail ERE]... [--fails] [--strict] [--skips] -- command...
#   --pass    the output must match            --fail    the output must not match
#   --fails   the command must fail            --strict  no leak and no unused option of PETSc in the output
#   --skips   a command that ends with 77, which is PETSC_ERR_PLIB elsewhere, has not what it needs
set -u
pass='' fail='' fails=0 strict=0 skips=0 newline='
'
while [ $# -gt 0 ]; do
  case $1 in
    --pass)   pass=$pass$2$newline; shift 2 ;;
    --fail)   fail=$fail$2$newline; shift 2 ;;
    --fails)  fails=1; shift ;;
    --strict) strict=1; shift ;;
    --skips)  skips=1; shift ;;
    --)       shift; break ;;
    *)        echo "run.sh: unknown argument $1" >&2; exit 2 ;;
  esac
done

# Open MPI waits two seconds for the other ranks of a program that fails; here they fail together.
OMPI_MCA_odls_base_sigkill_timeout=0
export OMPI_MCA_odls_base_sigkill_timeout

log=$(mktemp) || exit 2
trap 'rm -f "$log"' EXIT
echo "\$ $*"
"$@" >"$log" 2>&1 </dev/null
code=$?
cat "$log"
if [ $skips = 1 ] && [ $code = 77 ]; then exit 77; fi

bad=0
complain() { echo "run.sh: $*"; bad=1; }
if [ $fails = 0 ] && [ $code != 0 ]; then complain "exit code $code"; fi
if [ $fails = 1 ] && [ $code = 0 ]; then complain "exit code 0 where a failure was expected"; fi
# A crash or a time-out is never the failure that was expected.
if [ $fails = 1 ] && grep -E -q 'Segmentation fault|SEGV|Sanitizer: ' "$log"; then complain "crashed"; fi
if [ $strict = 1 ]; then
  if grep -E -q '\[ *[0-9]+\] *[0-9]+ bytes ' "$log"; then complain "memory was not freed"; fi
  if grep -E -q 'Option left:|WARNING! There are options' "$log"; then complain "options were not used"; fi
fi
judge() { # what regular-expressions: grep each line of the list in the output
  echo "$2" | while IFS= read -r regex; do
    [ -n "$regex" ] || continue
    if grep -E -q -e "$regex" "$log"; then found=1; else found=0; fi
    if [ "$1" = pass ] && [ $found = 0 ]; then echo "run.sh: expected in the output: $regex"; fi
    if [ "$1" = fail ] && [ $found = 1 ]; then echo "run.sh: not expected in the output: $regex"; fi
  done
}
verdict=$(judge pass "$pass"; judge fail "$fail")
if [ -n "$verdict" ]; then echo "$verdict"; bad=1; fi
exit $bad
