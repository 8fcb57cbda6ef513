#!/usr/bin/env python3
"""Two builds on the two cubes, models and scenes: reduced solves, their iterations and products with A, by counts of
events. Prints a table.

python3 docs/study/counts.py <other build folder> [--only <regular expression>]
    some minutes; the load of the machine does not matter
This build is AINSWORTH_BUILD, default build/. Each build runs its own programs with its own plugin.
"""
import argparse
import os
import re
import sys

from common import acceptance, machine

EVENTS = {"solves": "AinsRHS", "products": "MatMult", "projections": "AinsProjector"}
MODELS = ("ties", "cyclic", "mortar", "mean", "mean -floating", "rbe3 -patch 6", "rbe3 -patch 4", "rbe2 -patch 6",
          "rbe2 -patch 4", "rigid -patch 6", "periodic", "strain", "chain", "redundant")
SCENES = ("balls_tied", "fibers_tied", "periodic", "three_blocks", "cyclic", "plate_block", "beam_tied", "hinged")


def systems():
    """(name, program, options)"""
    for title, entries in acceptance.groups():
        for label, options in entries:
            yield title + ": " + label, "twocubes", acceptance.NEAR + "-n1 12 -n2 10 " + options
    for near in ("", " -near_nullspace"):
        for model in MODELS:
            yield "model %s%s" % (model, near), "models", "-model %s -n1 9 -n2 9 -slaves 250%s" % (model, near)
        for scene in SCENES:
            yield "scene %s%s" % (scene, near), "scenes", "-scene %s -unknowns 4000%s" % (scene, near)


def count(folder, program, options):
    answer = machine.run(options + " -log_view", program=os.path.join(machine.BUILD, "bench", program),
                         plugin=os.path.join(folder, "libainsworth.so"))
    found = {key: re.search(r"^%s +(\d+) " % event, answer["output"], re.MULTILINE) for key, event in EVENTS.items()}
    return dict({key: int(match.group(1)) if match else 0 for key, match in found.items()},
                iterations=answer["iterations"], reason=answer["reason"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", help="folder of the other build")
    parser.add_argument("--only", default="", help="systems whose name has this in it (a regular expression)")
    arguments = parser.parse_args()
    machine.require()
    keys = ["solves", "iterations", "products", "projections"]
    print(("%-75s" + " %16s" * len(keys)) % tuple(["this, other"] + keys))
    more, runs = 0, 0
    for name, program, options in systems():
        if not re.search(arguments.only, name):
            continue
        ours, other = count(machine.BUILD, program, options), count(os.path.abspath(arguments.other), program, options)
        if not machine.converged(ours) or not machine.converged(other):
            sys.exit("%s: %s, %s" % (name, ours["reason"], other["reason"]))
        print(("%-75s" + " %16s" * len(keys)) % tuple([name] + ["%d, %d" % (ours[key], other[key]) for key in keys]),
              flush=True)
        more += ours["solves"] > other["solves"]
        runs += 1
    print("%d systems, %d with more solves" % (runs, more))


if __name__ == "__main__":
    main()
