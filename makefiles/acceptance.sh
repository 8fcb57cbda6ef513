#!/bin/sh
# Measures the bounds that the defaults keep and writes their part of docs/cost.md: sh makefiles/acceptance.sh
. "$(dirname "$0")/common.sh"
AINSWORTH_BUILD=$build exec /usr/bin/python3 "$root/docs/study/stability.py" --acceptance "$@"
