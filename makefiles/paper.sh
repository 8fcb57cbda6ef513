#!/bin/sh
# The paper's own configuration (-pc_ainsworth_variant paper): iterations of the six M_* on 1 to 4 ranks, and on the
# variations of the two-cube problem: the last section of docs/method.md. Usage: sh makefiles/paper.sh [further options of twocubes]
# Needs a build (sh makefiles/build.sh); a few minutes.
set -eu
. "$(dirname "$0")/common.sh"

twocubes="$build/bench/twocubes -dll_append $build/libainsworth.so -ksp_type preonly -pc_type ainsworth -n1 24 -n2 20 -E2 10"
paper="-pc_ainsworth_variant paper -pc_ainsworth_pmat"

# one run: iterations of the first solve, or that it failed
run() {
  ranks=$1
  shift
  # shellcheck disable=SC2046,SC2086 # the launcher and the command are several words
  OMP_NUM_THREADS=1 $(launcher "$ranks") $twocubes -ainsworth_ksp_converged_reason "$@" 2>&1 |
    awk '/ solve converged/ && its == "" { its = $NF } / solve did not/ { bad = 1 } /^result:/ { done = 1 }
         END { print (its == "" || bad || !done) ? "failed" : its }'
}

cat <<'END'
## The paper's configuration

Iterations of `twocubes -n1 24 -n2 20 -E2 10 -pc_ainsworth_variant paper` by CG to 1e-8 in the natural norm, on 1 to 4
ranks, then variations on 2 ranks. The verification asks for a second, loose solve.
END
echo "The defaults take $(run 1 -near_nullspace "$@"), and $(run 1 -near_nullspace -curved 0.15 "$@") with \`-curved 0.15\`."
echo
echo "| Inv(S) | 1 rank | 2 ranks | 3 ranks | 4 ranks |"
echo "|---|---|---|---|---|"
for pmat in jcb id bj_cc bj_cg cc cg; do
  printf '| %s ' $pmat
  for ranks in 1 2 3 4; do printf '| %s ' "$(run $ranks $paper $pmat "$@")"; done
  echo "|"
done
echo
echo "| | jcb | id | bj_cc | bj_cg | cc | cg |"
echo "|---|---|---|---|---|---|---|"
for variation in "-floating" "-curved 0.15" "-stick 0" "-stick 1" "-contact 0"; do
  printf '| `%s` ' "$variation"
  for pmat in jcb id bj_cc bj_cg cc cg; do printf '| %s ' "$(run 2 $variation $paper $pmat "$@")"; done
  echo "|"
done
echo
echo 'Made by `sh makefiles/paper.sh`.'
