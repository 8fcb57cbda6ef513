#!/bin/sh
# files.sh twocubes solve plugin: writes a system, solves it from its files on 1 and 3 ranks, and once more from Matrix Market copies
# of its vectors' results; x and lambda must be the same
set -eu
twocubes=$1 solve=$2 plugin=$3
options="-dll_append $plugin -ksp_type preonly -pc_type ainsworth -ainsworth_ksp_rtol 1e-12"
mpi() { n=$1; shift; $(echo "$LAUNCHER" | tr ';' ' ') -n "$n" "$@"; }

mpi 2 "$twocubes" -n1 4 -n2 3 -rotate 20,35,50 -gap 0.004 -write_system system $options
mpi 1 "$solve" -A system_A.dat -C system_C.dat -f system_f.dat -g system_g.dat -block_size 3 -x_out x1.mtx -lambda_out l1.mtx $options
mpi 3 "$solve" -A system_A.dat -C system_C.dat -f system_f.dat -g system_g.dat -block_size 3 -x_out x3.mtx -lambda_out l3.mtx $options
for v in x l; do
  # a complex number is two words
  paste ${v}1.mtx ${v}3.mtx | awk '/^%/ { next } !size { size = 1; next }
    { for (k = 1; k <= NF / 2; k++) { d = $k - $(k + NF / 2); if (d < 0) d = -d; a = $k < 0 ? -$k : $k; if (a > big) big = a; if (d > worst) worst = d } }
    END { if (!(big > 0 && worst <= 1e-8 * big)) { print "differs by " worst " of " big; exit 1 } }'
done
echo "files: same solution"
