#!/bin/sh
# Sourced by the other scripts: the project's folder, the build folder, which PETSc, how to start MPI programs.
# AINSWORTH_BUILD chooses the build folder (default: build), AINSWORTH_JOBS the parallel jobs (default: the cores),
# MPIEXEC the launcher.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
build=${AINSWORTH_BUILD:-$root/build}
case $build in /*) ;; *) build=$(pwd)/$build ;; esac
# shellcheck disable=SC2034 # used by build.sh
jobs=${AINSWORTH_JOBS:-$(nproc 2>/dev/null || echo 2)}

# Did the user choose a PETSc? Then none is installed, and Debian's is not looked at.
own_petsc=0
if [ -n "${PETSC_DIR:-}" ]; then own_petsc=1; fi
IFS=:
for folder in ${PKG_CONFIG_PATH:-}; do
  if [ -e "$folder/petsc.pc" ] || [ -e "$folder/PETSc.pc" ]; then own_petsc=1; fi
done
unset IFS
# On Debian "petsc" may be any of the installed variants: the real one with 32-bit indices is taken by its own name.
choose_petsc() {
  if [ $own_petsc = 0 ] && [ -d /usr/lib/petscdir/petsc-real ]; then
    PETSC_DIR=/usr/lib/petscdir/petsc-real
    export PETSC_DIR
  fi
}

say() { printf '%s\n' "== $*"; }

# Runs a command that is silent for long: its output goes to a file, and every 15 seconds a line says how far it is.
with_progress() { # file, command ...
  progress_log=$1 progress_begin=$(date +%s) progress_next=15
  shift
  "$@" >"$progress_log" 2>&1 &
  progress_job=$!
  while kill -0 $progress_job 2>/dev/null; do
    sleep 1
    progress_seconds=$(($(date +%s) - progress_begin))
    if [ $progress_seconds -lt $progress_next ]; then continue; fi
    say "$progress_seconds s: $(tail -n 1 "$progress_log" | cut -c 1-100)"
    progress_next=$((progress_seconds + 15))
  done
  wait $progress_job
}

# Debian's packages: root or sudo, no questions, and no output but where something fails.
# shellcheck disable=SC2016 # dpkg-query expands it
installed() { dpkg-query -W -f '${Status}\n' "$1" 2>/dev/null | grep -q '^install ok installed$'; }
apt() {
  if [ "$(id -u)" = 0 ]; then sudo=; else sudo=sudo; fi
  say "apt-get $*"
  log=$(mktemp)
  if with_progress "$log" $sudo env DEBIAN_FRONTEND=noninteractive \
    apt-get -q -y -o Dpkg::Use-Pty=0 -o DPkg::Lock::Timeout=300 "$@"; then code=0; else code=$?; cat "$log"; fi
  rm -f "$log"
  return $code
}

# Open MPI must be told that root, or more ranks than cores, is meant; the others know neither.
launcher() { # ranks
  command=${MPIEXEC:-mpiexec}
  if $command --version 2>&1 | grep -E -q 'Open MPI|OpenRTE'; then
    if [ "$(id -u)" = 0 ]; then command="$command --allow-run-as-root"; fi
    if [ "$1" -gt "$(nproc 2>/dev/null || echo 1)" ]; then command="$command --oversubscribe"; fi
  fi
  echo "$command -n $1"
}
