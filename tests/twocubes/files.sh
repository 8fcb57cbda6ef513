#!/bin/sh
# files.sh twocubes solve plugin: writes a system, and solves it from its files on 1 and 3 ranks; x and lambda must be
# the same
set -eu
twocubes=$1 solve=$2 plugin=$3
options="-dll_append $plugin -ksp_type preonly -pc_type ainsworth -ainsworth_ksp_rtol 1e-12"
mpi() { n=$1; shift; $(echo "$LAUNCHER" | tr ';' ' ') -n "$n" "$@"; }

mpi 2 "$twocubes" -n1 4 -n2 3 -rotate 20,35,50 -gap 0.004 -write_system system $options
for n in 1 3; do
  mpi $n "$solve" -A system_A.dat -C system_C.dat -f system_f.dat -g system_g.dat -block_size 3 \
    -x_out x$n.dat -lambda_out l$n.dat $options
done
# After a header of two integers PETSc's files hold doubles, a complex number as two
for v in x l; do
  for n in 1 3; do
    header=$(od -A n -t d4 --endian=big -N 4 $v$n.dat | awk '{ print $1 ? 8 : 16 }')
    od -A n -v -t f8 --endian=big -w8 -j "$header" $v$n.dat > $v$n.txt
  done
  paste ${v}1.txt ${v}3.txt | awk '{
      d = $1 - $2; if (d < 0) d = -d; a = $1 < 0 ? -$1 : $1; if (a > big) big = a; if (d > worst) worst = d }
    END { if (!(big > 0 && worst <= 1e-8 * big)) { print "differs by " worst " of " big; exit 1 } }'
done
echo "files: same solution"
