#!/bin/sh
# contact.sh <peers> <python> <plugin>: Hertz' contact, found by an active set and written; then its system in an
# interior-point method (check.py)
set -eu
"$1" -n 8 -write hertz.dat -snes_type ainsworthactiveset -ksp_type preonly -pc_type ainsworth
exec "$2" "$(dirname "$0")/check.py" "$3" hertz.dat:central
