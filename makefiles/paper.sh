#!/bin/sh
# The paper's own configuration (-pc_ainsworth_variant paper): iterations and residuals of the six M_* on 1 to 4 ranks, and on the
# variations of the two-cube problem. Usage: sh makefiles/paper.sh [further options of twocubes] > docs/paper.md
# Needs a build (sh makefiles/build.sh); a few minutes.
set -eu
. "$(dirname "$0")/common.sh"

twocubes="$build/bench/twocubes -dll_append $build/libainsworth.so -ksp_type preonly -pc_type ainsworth -pc_ainsworth_variant paper -n1 24 -n2 20 -E2 10"

# one run: iterations and both residuals, or the reason of the failure
run() {
  ranks=$1
  shift
  # shellcheck disable=SC2046,SC2086 # the launcher and the command are several words
  OMP_NUM_THREADS=1 $(launcher "$ranks") $twocubes -ainsworth_ksp_converged_reason "$@" 2>&1 |
    awk '/ solve (converged|did not converge)/ { why = $0; its = $NF }
         /^result:/ { for (i = 1; i <= NF; i++) if ($i ~ /residual=/) { split($i, f, "="); r = r " " f[2] } }
         END { if (why ~ /did not/ || r == "") print "failed"; else print its " (" substr(r, 2) ")" }'
}

echo "# The paper's configuration on the two-cube problem"
echo
cat <<'END'
How many iterations does the paper's own configuration (`-pc_ainsworth_variant paper`) take with each of its six
approximations Inv(S) of S^-1 ([method.md](method.md#preconditioning-matrix))?

A cell has the inner iterations and, in brackets, the primal and the constraint residual. The system is
`twocubes -n1 24 -n2 20 -E2 10`, solved by CG to 1e-8 in the natural norm.

## On 1 to 4 ranks

END
echo "| Inv(S) | 1 rank | 2 ranks | 3 ranks | 4 ranks |"
echo "|---|---|---|---|---|"
for pmat in jcb id bj_cc bj_cg cc cg; do
  printf '| %s ' $pmat
  for ranks in 1 2 3 4; do printf '| %s ' "$(run $ranks -pc_ainsworth_pmat $pmat "$@")"; done
  echo "|"
done
echo
echo "## Variations, on 2 ranks"
echo
echo "| | jcb | id | bj_cc | bj_cg | cc | cg |"
echo "|---|---|---|---|---|---|---|"
for variation in "-floating" "-curved 0.15" "-stick 0" "-stick 1" "-contact 0"; do
  printf '| `%s` ' "$variation"
  for pmat in jcb id bj_cc bj_cg cc cg; do printf '| %s ' "$(run 2 $variation -pc_ainsworth_pmat $pmat "$@")"; done
  echo "|"
done
echo
echo 'Made by `sh makefiles/paper.sh`.'
