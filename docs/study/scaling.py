#!/usr/bin/env python3
"""Many ranks on few cores: counts of each level, a model of the seconds, and what binds: docs/scaling.csv, pictures in
docs/scaling/, a part of docs/scaling.md.

/usr/bin/python3 docs/study/scaling.py run [--systems small large] [--ranks 1 2 8 32 64 128 256]
    two cubes, ranks that share the cores
/usr/bin/python3 docs/study/scaling.py run --label before --plugin FILE
    the same with another build of the plugin
/usr/bin/python3 docs/study/scaling.py --report
    text and pictures from the CSV
Counts do not depend on how many cores there are; seconds of 1 and 2 ranks need an otherwise idle machine. Needs a build
(AINSWORTH_BUILD, default build/), Debian's python3-matplotlib, and 16 GB for 256 ranks.
"""
import argparse
import os

from common import machine, measured


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    measured.experiment(parser, ("run",))
    parser.add_argument("--systems", nargs="+", default=["small"], choices=("small", "large"),
                        help="75 000 and 335 000 unknowns (default small)")
    parser.add_argument("--ranks", nargs="+", type=int, default=[1, 2, 8, 32, 64, 128, 256])
    parser.add_argument("--label", default="now", help="of the build (default now)")
    parser.add_argument("--plugin", default=machine.PLUGIN, help="libainsworth.so to run (default that of the build)")
    parser.add_argument("--repeat", type=int, default=3,
                        help="runs on 1 and 2 ranks, of which the quickest counts (default 3)")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"),
                        help="folder of scaling.csv and scaling.md (default docs)")
    arguments = parser.parse_args()
    machine.require("matplotlib")
    from common import scaling, scalingpage
    if not arguments.report:
        scaling.study(arguments)
    scalingpage.write(os.path.abspath(arguments.out))


if __name__ == "__main__":
    main()
