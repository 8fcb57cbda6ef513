#!/bin/sh
# ranks.sh scenes solve plugin: fingerprints and iterations must be those of one rank; LAUNCHER starts MPI programs
set -eu
scenes=$1 solve=$2 plugin=$3
start() { ranks=$1; shift; $launcher -n "$ranks" "$@"; }
launcher=$(echo "$LAUNCHER" | tr ';' ' ')

# Jacobi knows nothing of ranks: iterations agree up to rounding
summary() {
  sed -n -e 's/^fingerprint: //p' -e 's/^scene: .* iterations=\([0-9]*\) .*/\1/p' \
    -e 's/.* constraints=\([0-9]*\) .*/\1/p'
}
same() { # name, output on one rank, output on several
  awk -v a="$2" -v b="$3" 'BEGIN {
    n = split(a, x); m = split(b, y)
    if (n != 6 || m != n) exit 1
    for (i = 1; i <= 4; i++) if ((x[i] - y[i])^2 > 1e-16 * x[i]^2) exit 1
    if ((x[5] - y[5])^2 > (1 + .02 * x[5])^2 || x[6] != y[6]) exit 1
  }' || { echo "$1: [$2] on one rank, but [$3]"; exit 1; }
}
for scene in "cube -n 5 -inclusion binary -contrast 100" "square -n 12 -element p2" "plate -n 8 -bend 40" \
  "heat -n 5 -inclusion random" "frame -n 3 -aspect 5" "tets -n 3 -element p1 -constraints 0"; do
  options="-scene $scene -verify -pc_type jacobi"
  # shellcheck disable=SC2086 # words
  one=$(start 1 "$scenes" $options | summary | tr '\n' ' ')
  for how in "2 -partition metis" "3 -partition slab" "4 -partition metis"; do
    # shellcheck disable=SC2086
    several=$(start ${how%% *} "$scenes" $options ${how#* } | summary | tr '\n' ' ')
    same "$scene, $how" "$one" "$several"
  done
  echo "$scene: $one"
done
# with constraints: the matrices alone
for scene in "balls_tied -n 3 -stick 0.5" "periodic -n 3" "three_blocks -n 3" "cyclic -n 4" "plate_block -n 4" \
  "slabs -n 3"; do
  # shellcheck disable=SC2086
  one=$(start 1 "$scenes" -scene $scene -verify -solve 0 | grep '^fingerprint: ')
  for ranks in 2 4; do
    # shellcheck disable=SC2086
    several=$(start $ranks "$scenes" -scene $scene -verify -solve 0 -partition metis | grep '^fingerprint: ')
    same "$scene, $ranks ranks" "${one#* } 0 0" "${several#* } 0 0"
  done
  echo "$scene: $one"
done
# files written by three ranks, solved by two
start 3 "$scenes" -scene balls_tied -n 3 -write_system system -solve 0
start 2 "$solve" -A system_A.dat -C system_C.dat -f system_f.dat -g system_g.dat -dll_append "$plugin" \
  -ksp_type preonly -pc_type ainsworth | grep 'constraints=48 '
echo "ranks: same systems"
