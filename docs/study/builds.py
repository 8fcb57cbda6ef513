#!/usr/bin/env python3
"""Two builds in turns on the same systems: iterations, and seconds of the one divided by those of the other. Prints a
table.

python3 docs/study/builds.py <other build folder> [--repeat 3] [--only <regular expression>]
    on an otherwise idle machine
This build is AINSWORTH_BUILD, default build/. Both plugins are loaded by the same twocubes, that of this build.
"""
import argparse
import os
import re
import statistics

from common import acceptance, errors, machine


def systems():
    """(name, options, ranks): where the set-up goes, overhead, the bounds of the defaults, error against time."""
    for n1, n2 in ((32, 28), (48, 40)):
        for ranks in (1, 2):
            yield "overhead, n1 %d" % n1, "-E2 10 %s-n1 %d -n2 %d" % (acceptance.NEAR, n1, n2), ranks
    for ranks in (1, 2):
        yield ("setup, 64 x 16", "-n1 64 -n2 56 -nz1 16 -nz2 16 -height 0.25 -E2 10 -stick 0.92 " + acceptance.NEAR,
               ranks)
    for title, entries in acceptance.groups():
        for label, options in entries:
            yield title + ": " + label, acceptance.SIZE + options, 1
    for case in ("base", "curved"):
        for tolerance in ("1e-6", "1e-10"):
            yield ("error against time, %s, %s" % (case, tolerance),
                   "-n1 24 -n2 20 %s%s -ainsworth_ksp_rtol %s" % (acceptance.NEAR, errors.CASES[case][1], tolerance), 1)


def quotient(new, old, key, of):
    return of(run[key] for run in new) / of(run[key] for run in old)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", help="folder of the other build")
    parser.add_argument("--repeat", type=int, default=3, help="runs of each build (default 3)")
    parser.add_argument("--only", default="", help="systems whose name has this in it (a regular expression)")
    arguments = parser.parse_args()
    machine.require()
    builds = [(machine.TWOCUBES, os.path.join(folder, "libainsworth.so"))
              for folder in (machine.BUILD, os.path.abspath(arguments.other))]
    print("%s; load %.1f" % (machine.describe(), machine.load()))
    print("%-75s %5s %10s %10s %10s" % ("least of %d, median; this / other" % arguments.repeat, "ranks", "iterations",
                                        "least", "median"))
    least, iterations = [], []
    for name, options, ranks in systems():
        if not re.search(arguments.only, name):
            continue
        runs = [[], []]
        for _ in range(arguments.repeat):
            for i, (program, plugin) in enumerate(builds):
                run = machine.run(options, ranks, program=program, plugin=plugin)
                if machine.converged(run):
                    runs[i].append(dict(run, total=run["setup"] + run["solve"]))
        if not all(runs):
            print("%-75s %5d %s" % (name, ranks, "this build fails" if not runs[0] else "the other build fails"),
                  flush=True)
            continue
        least.append(quotient(*runs, "total", min))
        iterations.append(runs[0][0]["iterations"] - runs[1][0]["iterations"])
        print("%-75s %5d %10s %10.3f %10.3f" % (name, ranks,
                                                "%d, %d" % (runs[0][0]["iterations"], runs[1][0]["iterations"]),
                                                least[-1], quotient(*runs, "total", statistics.median)), flush=True)
    if least:
        print("%d systems: seconds %.3f to %.3f, median %.3f; iterations %+d to %+d; load %.1f" % (
            len(least), min(least), max(least), statistics.median(least), min(iterations), max(iterations),
            machine.load()))


if __name__ == "__main__":
    main()
