#!/usr/bin/env python3
"""One cycle as the preconditioner of an outer method, against an iteration of the reduced solve, by -log_view, in
interleaved runs.

python3 docs/study/onecycle.py [--repeat 5] [--n1 24] [--ranks 1]      on an otherwise idle machine
"""
import argparse
import re
import statistics

from common import logview, machine

LOOSE, STRICT = 1e-4, 1e-11  # tolerances of two solves, which differ by iterations alone


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5, help="rounds (default 5)")
    parser.add_argument("--n1", type=int, default=24,
                        help="cells along an edge of the lower cube (default 24); the upper one has four fewer")
    parser.add_argument("--ranks", type=int, default=1, help="ranks (default 1)")
    arguments = parser.parse_args()
    machine.require()
    system = "-n1 %d -n2 %d -E2 10 -near_nullspace 1 " % (arguments.n1, arguments.n1 - 4)
    quotients, seconds = [], []
    for _ in range(arguments.repeat):
        # the event PCApply is that of the outermost preconditioner
        few, many = (logview.run(system + "-ainsworth_ksp_rtol %g" % rtol, arguments.ranks) for rtol in (LOOSE, STRICT))
        iteration = ((many["events"]["PCApply"]["seconds"] - few["events"]["PCApply"]["seconds"])
                     / (many["iterations"] - few["iterations"]))
        outer = logview.run(system + "-ksp_type fgmres -ksp_rtol 1e-8 -ksp_converged_reason "
                            "-ainsworth_ksp_type preonly", arguments.ranks)
        applications = int(re.search(r"Linear solve converged due to \w+ iterations (\d+)", outer["output"]).group(1))
        seconds.append((outer["events"]["PCApply"]["seconds"] / applications, iteration))
        quotients.append(seconds[-1][0] / seconds[-1][1])
        print("an application %.2f ms, an iteration %.2f ms: %.2f" % (
            1e3 * seconds[-1][0], 1e3 * seconds[-1][1], quotients[-1]), flush=True)
    print("%d iterations of FGMRES; quotient: least %.2f, median %.2f; load "
          "%.1f" % (applications, min(quotients), statistics.median(quotients), machine.load()))


if __name__ == "__main__":
    main()
