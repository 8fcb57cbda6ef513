#!/bin/sh
# Builds ainsworth_<version>_<architecture>.deb in the current folder: sh makefiles/packaging/deb.sh
# Needs Debian's dpkg-dev and debhelper, and the packages that makefiles/install.sh lists.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
here=$PWD
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/ainsworth"
cd "$root"
cp -R CMakeLists.txt src include tutorials makefiles docs README.md LICENSE CITATION.cff CHANGELOG.md \
  "$folder/ainsworth/"
cp -R makefiles/packaging/debian "$folder/ainsworth/"
cd "$folder/ainsworth"
version=$(awk '/^#define AINSWORTH_VERSION_(MAJOR|MINOR|SUBMINOR) / { printf "%s%s", dot, $3; dot = "." }' \
  include/petscainsworth.h)
printf '%s\n' "ainsworth ($version) unstable; urgency=medium" '' '  * See CHANGELOG.md.' '' \
  " -- The ainsworth developers <ainsworth@localhost>  $(LC_ALL=C date -R)" >debian/changelog
dpkg-buildpackage -us -uc -b
cp "$folder"/*.deb "$here/"
