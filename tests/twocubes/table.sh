#!/bin/sh
# table.sh twocubes partitiontable: the rows that the table foresees for 2 to 4 ranks are those that twocubes has on as many
set -eu
twocubes=$1 table=$2
options="-n1 9 -n2 7 -stick 0.6"
mpi() { n=$1; shift; $(echo "$LAUNCHER" | tr ';' ' ') -n "$n" "$@"; }

# shellcheck disable=SC2086 # several words
"$table" $options -ranks 2,3,4 -csv table.csv
for ranks in 2 3 4; do
  # shellcheck disable=SC2086
  mpi $ranks "$twocubes" $options -view_distribution -pc_type none -ksp_type preonly >twocubes.txt
  awk -F, -v ranks=$ranks '
    $1 == ranks { for (i = 0; i < 2; i++) print "distribution: " (i ? "C" : "A") " has " $(5 + 3 * i) " to " $(6 + 3 * i) " rows on " $(4 + 3 * i) " of " ranks " ranks" }' table.csv >foreseen.txt
  grep '^distribution' twocubes.txt | cmp - foreseen.txt
done
echo "table: as foreseen"
