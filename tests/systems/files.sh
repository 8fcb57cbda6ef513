#!/bin/sh
# files.sh systems solve errortime: writes a system whose B is not C and whose D is not zero, and solves it from its
# files on 1 and 3 ranks
set -eu
systems=$1 solve=$2 errortime=$3
mpi() { n=$1; shift; $(echo "$LAUNCHER" | tr ';' ' ') -n "$n" "$@"; }
expect() { grep -E -q "$1" || { echo "expected $1"; exit 1; }; }

mpi 2 "$systems" -only coulomb_compliant -write s
files="-A s_A.dat -B s_B.dat -C s_C.dat -D s_D.dat -f s_f.dat -g s_g.dat"
small='[0-9.]+e-(0[89]|[1-9][0-9])'
for ranks in 1 3; do
  for more in "" "-transpose_block explicit -multipliers first"; do
    mpi $ranks "$solve" $files $more -ksp_type gmres -ksp_gmres_restart 400 -ksp_rtol 1e-12 -pc_type none |
      expect "primal_residual=$small constraint_residual=$small"
  done
  [ -z "$MUMPS" ] || mpi $ranks "$errortime" $files -form aij -ksp_type preonly -pc_type lu \
    -pc_factor_mat_solver_type mumps -tolerance_option none |
    expect ",$small,$small,$small,$small,CONVERGED_"
done
for wrong in "-B s_D.dat" "-D s_C.dat" "-transpose_block none"; do
  if mpi 1 "$solve" $files $wrong -pc_type none >wrong.txt 2>&1; then echo "not refused: $wrong"; exit 1; fi
  grep -E -q "B in file|D in file|-transpose_block none leaves B out" wrong.txt || { cat wrong.txt; exit 1; }
done
echo "files: solved"
