#!/bin/sh
# Checks the project against other PETScs and other Debians: sh makefiles/compat.sh [what...], by default all of
#   complex int64 int64-complex   Debian's other builds of PETSc, in folders build-<what>: compiled with -Werror, loading and smoke tests
#   bookworm trixie               Debian 12 and 13 from nothing, each in a folder of its own: demo.sh and check.sh as on a bare
#                                 machine, then complex
# The last two need root. AINSWORTH_SYSTEMS chooses where they are kept (default: /var/tmp/ainsworth); a second run reuses them.
. "$(dirname "$0")/common.sh"
systems=${AINSWORTH_SYSTEMS:-/var/tmp/ainsworth}
if [ $# = 0 ]; then set -- complex int64 int64-complex bookworm trixie; fi

apt_install() { # package
  if installed "$1"; then return; fi
  apt update
  apt install --no-install-recommends "$1"
}

variant() { # name package folder
  say "$1: PETSc of $2"
  apt_install "$2"
  PETSC_DIR=/usr/lib/petscdir/$3 PETSC_ARCH='' AINSWORTH_BUILD=$build-$1 sh "$root/makefiles/build.sh" -DAINSWORTH_WERROR=ON
  (cd "$build-$1" && ctest -j "$jobs" --output-on-failure -L 'loading|smoke')
}

system() { # release
  say "$1: from nothing, in $systems/$1"
  if [ "$(id -u)" != 0 ]; then echo "compat.sh: $1 needs root" >&2; return 1; fi
  apt_install debootstrap
  folder=$systems/$1
  if [ ! -e "$folder/etc/debian_version" ] || [ -d "$folder/debootstrap" ]; then
    # The mirror is the one that this machine uses itself.
    # shellcheck disable=SC2016 # apt-get expands it
    mirror=$(apt-get indextargets --format '$(SITE)' 'Created-By: Packages' | grep -v security | head -n 1)
    mkdir -p "$folder"
    debootstrap --variant=minbase "$1" "$folder" "$mirror"
  fi
  # Names and ways of downloading are this machine's, too.
  cp -L /etc/resolv.conf /etc/hosts "$folder/etc/"
  apt-config dump | grep -E '^Acquire::(http|https|Check-|Retries)' >"$folder/etc/apt/apt.conf.d/90host" || true
  mkdir -p "$folder/project" "$folder/build"
  # In a mount namespace of its own nothing stays mounted afterwards; the project is read-only there.
  # shellcheck disable=SC2016 # the inner shell expands it
  unshare --mount sh -eu -c '
    mount -t proc proc "$1/proc"
    mount --rbind /dev "$1/dev"
    mount --rbind /sys "$1/sys"
    mount --bind "$2" "$1/project"
    mount -o remount,bind,ro "$1/project"
    inside() { chroot "$folder" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 AINSWORTH_BUILD=/build sh "$@"; }
    folder=$1
    inside /project/makefiles/demo.sh
    inside /project/makefiles/check.sh
    inside /project/makefiles/compat.sh complex
  ' sh "$folder" "$root"
}

failed=
for what in "$@"; do
  # A subshell with its own errexit: one failure must not hide what the others say.
  set +e
  case $what in
    complex)         (set -e; variant complex       libpetsc-complex-dev   petsc-complex) ;;
    int64)           (set -e; variant int64         libpetsc64-real-dev    petsc64-real) ;;
    int64-complex)   (set -e; variant int64-complex libpetsc64-complex-dev petsc64-complex) ;;
    bookworm|trixie) (set -e; system "$what") ;;
    *)               echo "compat.sh: unknown: $what" >&2; false ;;
  esac
  code=$?
  set -e
  if [ $code != 0 ]; then failed="$failed $what"; fi
done
say "compat: $*"
if [ -n "$failed" ]; then echo "failed:$failed"; exit 1; fi
echo "all good"
