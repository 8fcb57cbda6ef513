#!/bin/sh
# Checks the project against other PETScs and other Debians: sh makefiles/compat.sh [what...], by default all of
#   real complex int64 int64-complex   Debian's four builds of PETSc, in folders build-<what>: compiled with -Werror and
#                                      without precompiled headers, so that each file has all that it includes; the
#                                      tests of $labels
#   bookworm trixie                    Debian 12 and 13 from nothing, each in a folder of its own: demo.sh and check.sh
#                                      as on a bare machine, the tutorial by a user who is not root, then complex
#   forky sid                          likewise Debian's testing and unstable, only if named
# or against PETSc from source: sh makefiles/compat.sh source DIR [options of PETSc's configure...]
#   configures and compiles the source tree DIR with hypre in the version that this PETSc asks for, and runs all tests
#   with it. Where hypre cannot be had, without it. --download-hypre=FILE, an archive, or git://FOLDER says from where
#   it is taken where there is no network.
# Debians need root. AINSWORTH_SYSTEMS chooses where they are kept (default: /var/tmp/ainsworth); a second run reuses
# them.
. "$(dirname "$0")/common.sh"
systems=${AINSWORTH_SYSTEMS:-/var/tmp/ainsworth}
labels='dense|twocubes|loading'

apt_install() { # package
  if installed "$1"; then return; fi
  apt update
  apt install --no-install-recommends "$1"
}

# Each is loaded into programs of the other three, too, and must refuse.
variant() { # name package folder
  say "$1: PETSc of $2"
  for package in libpetsc-real-dev libpetsc-complex-dev libpetsc64-real-dev libpetsc64-complex-dev; do
    apt_install "$package"
  done
  PETSC_DIR=/usr/lib/petscdir/$3 PETSC_ARCH='' AINSWORTH_BUILD=$build-$1 \
    sh "$root/makefiles/build.sh" -DAINSWORTH_WERROR=ON -DAINSWORTH_PRECOMPILE=OFF
  (cd "$build-$1" && ctest -j "$jobs" --output-on-failure -L "$labels")
}

# PETSc's own configure and make; an arch folder that is there is configured again only where options are given.
configure_petsc() { # folder arch [options]
  petsc=$1 arch=$2
  shift 2
  (cd "$petsc" && ./configure "PETSC_DIR=$petsc" "PETSC_ARCH=$arch" --with-fc=0 --with-x=0 --with-debugging=0 \
    "--with-make-np=$jobs" "$@")
}
source_tree() { # folder [options of configure]
  folder=$(cd "$1" && pwd)
  arch='arch-ainsworth'
  shift
  say "PETSc from source in $folder/$arch"
  if [ $# -gt 0 ] || [ ! -e "$folder/$arch/lib/pkgconfig/petsc.pc" ]; then
    case " $*" in
      *hypre*) configure_petsc "$folder" "$arch" "$@" ;;
      *) configure_petsc "$folder" "$arch" --download-hypre "$@" || configure_petsc "$folder" "$arch" "$@" ;;
    esac
  fi
  make -C "$folder" PETSC_DIR="$folder" PETSC_ARCH="$arch" all
  grep -q '^#define PETSC_HAVE_HYPRE ' "$folder/$arch/include/petscconf.h" ||
    say "this PETSc has no hypre: configure says above why it could not be had"
  folder_of_tests=$build-$(basename "$folder")
  PETSC_DIR=$folder PETSC_ARCH=$arch AINSWORTH_BUILD=$folder_of_tests \
    sh "$root/makefiles/build.sh" -DAINSWORTH_WERROR=ON
  (cd "$folder_of_tests" && ctest -j "$jobs" --output-on-failure)
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
    script=/usr/share/debootstrap/scripts/$1
    # a release that is younger than debootstrap
    if [ ! -e "$script" ]; then script=/usr/share/debootstrap/scripts/sid; fi
    debootstrap --variant=minbase "$1" "$folder" "$mirror" "$script"
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
    inside() {
      chroot "$folder" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 AINSWORTH_BUILD=/build \
        sh "$@"
    }
    folder=$1
    inside /project/makefiles/demo.sh
    inside /project/makefiles/check.sh
    # The tutorial once more, to the letter, by a user who is not root
    chroot "$folder" sh -c "id newcomer >/dev/null 2>&1 || useradd --create-home newcomer; chown -R newcomer /build"
    chroot --userspec=newcomer "$folder" env -i PATH=/usr/bin:/bin HOME=/home/newcomer LC_ALL=C.UTF-8 sh -c \
      "cd /build && ctest -R docs_tutorial --output-on-failure"
    inside /project/makefiles/compat.sh complex
  ' sh "$folder" "$root"
}

if [ "${1:-}" = source ]; then
  if [ ! -x "${2:-}/configure" ]; then echo "compat.sh: source: ${2:-} is no source tree of PETSc" >&2; exit 2; fi
  shift
  source_tree "$@"
  exit
fi
if [ $# = 0 ]; then set -- real complex int64 int64-complex bookworm trixie; fi
failed=
for what in "$@"; do
  # A subshell with its own errexit: one failure must not hide what the others say.
  set +e
  case $what in
    real)            (set -e; variant real          libpetsc-real-dev      petsc-real) ;;
    complex)         (set -e; variant complex       libpetsc-complex-dev   petsc-complex) ;;
    int64)           (set -e; variant int64         libpetsc64-real-dev    petsc64-real) ;;
    int64-complex)   (set -e; variant int64-complex libpetsc64-complex-dev petsc64-complex) ;;
    bookworm|trixie|forky|sid) (set -e; system "$what") ;;
    *)               echo "compat.sh: unknown: $what" >&2; false ;;
  esac
  code=$?
  set -e
  if [ $code != 0 ]; then failed="$failed $what"; fi
done
say "compat: $*"
if [ -n "$failed" ]; then echo "failed:$failed"; exit 1; fi
echo "all good"
