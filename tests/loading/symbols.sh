#!/bin/sh
# The strong symbols that a shared library exports, judged: symbols.sh <library>
symbols=$(nm -D --defined-only "$1" | awk '$2 ~ /^[TDBRS]$/ { print $3 }' |
  grep -v -x -E '__bss_start|_edata|_end|_init|_fini')
echo "$symbols"
stray=$(echo "$symbols" |
  grep -v -E -e '^(PetscDLLibraryRegister_(petsc)?ainsworth$|Ainsworth|ainsworthinitializepackage_$)' \
    -e '^(PC|Mat|KSP)[A-Za-z]*(Ainsworth|ProjectedCG)')
if [ -n "$stray" ]; then echo "exported without need:"; echo "$stray"; exit 1; fi
# Without these it is no plugin.
for symbol in PetscDLLibraryRegister_ainsworth PetscDLLibraryRegister_petscainsworth AinsworthInitializePackage; do
  echo "$symbols" | grep -q -x "$symbol" || { echo "not exported: $symbol"; exit 1; }
done
