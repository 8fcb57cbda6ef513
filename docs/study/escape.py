#!/usr/bin/env python3
"""The default against multigrid and a factorization that are chosen by hand: docs/escape.csv and a part of
docs/extremes.md.

python3 docs/study/escape.py [--unknowns 3000,12000,50000] [--repeat 3]
python3 docs/study/escape.py --report                                      the text anew from the CSV
The three take turns on one rank. Seconds are those of the processor from the first call of the solver on; of the runs
the least, and the median in the CSV.
"""
import argparse
import os
import re
import statistics
import sys

from common import machine, measured, prose

SYSTEMS = [  # name, options of scenes, the multigrid of the default
    ("two cubes, Poisson's ratio .3", "balls_tied -inclusion none", "blocksa"),
    ("periodic cell with balls", "periodic", "blocksa"),
    ("periodic cell, Poisson's ratio .4999", "periodic -nu .4999", "blocksa"),
    ("cyclic sector", "cyclic", "blocksa"),
    ("plate on a block", "plate_block", "blocksa"),
    ("Poisson's ratio .499", "balls_tied -inclusion none -nu .499", "blocksa"),
    ("Poisson's ratio .4999", "balls_tied -inclusion none -nu .4999", "blocksa"),
    ("fibers, 1e6", "fibers_tied -contrast 1e6", "blocksa"),
    ("fibers, 1e6, Poisson's ratio .4999", "fibers_tied -contrast 1e6 -nu .4999", "blocksa"),
    ("flat elements 100:1", "balls_tied -inclusion none -aspect 100", "blocksa"),
    ("shell 1:1000 on a block", "plate_block -aspect 1000 -nz 1", "blocksa"),
    ("hinged frame", "hinged", "hypre"),
    ("E random per cell, 1 to 1e6", "balls_tied -inclusion random -contrast 1e6", "blocksa"),
]
CHOICES = ("default", "multigrid", "factorization")
COLUMNS = (["asked", "system", "options", "unknowns", "constraints"]
           + [key + " " + choice for choice in CHOICES for key in ("iterations", "seconds", "median")] + ["quotient"])
BOUND = 1.3
RESOLUTION = 0.005  # seconds: of less there is no quotient


def compare(name, options, multigrid, unknowns, repeat):
    system = "%s -unknowns %d" % (options, unknowns)
    chosen = dict(zip(CHOICES, ("", " -ainsworth_pc_type " + multigrid, " -ainsworth_pc_type cholesky")))
    seconds, row = {choice: [] for choice in CHOICES}, {"asked": unknowns, "system": name, "options": system}
    for _ in range(repeat):
        for choice in CHOICES:
            answer = machine.run("-scene " + system + chosen[choice], program=machine.SCENES, limit=1200)
            if not machine.converged(answer):
                sys.exit("scenes -scene %s%s: %s" % (system, chosen[choice], answer["reason"]))
            seconds[choice].append(float(re.search(r"\bprocessor_s=(\S+)", answer["output"]).group(1)))
            row["iterations " + choice] = " + ".join(re.findall(r"due to \w+ iterations (\d+)", answer["output"]))
            row.update(unknowns=answer["unknowns"], constraints=answer["constraints"])
    least = {choice: min(seconds[choice]) for choice in CHOICES}
    for choice in CHOICES:
        row["seconds " + choice] = "%.3f" % least[choice]
        row["median " + choice] = "%.3f" % statistics.median(seconds[choice])
    best = min(least["multigrid"], least["factorization"])
    row["quotient"] = "%.2f" % (least["default"] / best) if best > RESOLUTION else ""
    print(", ".join("%s %s" % (key, row[key]) for key in COLUMNS), flush=True)
    return row


def write(folder):
    about, rows = measured.read(os.path.join(folder, "escape.csv"))
    known = [row for row in rows if row["quotient"]]
    worst = sorted(known, key=lambda row: -float(row["quotient"]))[:3]
    hard = [row for row in rows if int(row["asked"]) == max(int(row["asked"]) for row in rows)
            and float(row["seconds multigrid"]) > float(row["seconds factorization"])]
    text = ["The default takes at most %g times as long as the better of multigrid and the factorization on %d of %d "
            "systems, and %s at worst: %s. With %s unknowns the factorization is the better one for:" % (
                BOUND, sum(float(row["quotient"]) <= BOUND for row in known), len(known), worst[0]["quotient"],
                "; ".join("%s, %s unknowns, %s" % (row["system"], row["asked"], row["quotient"]) for row in worst),
                max(int(row["asked"]) for row in rows)), "",
            "| system | default | multigrid | factorization |", "|---|---|---|---|"]
    text += ["| %s | %s |" % (row["system"], " | ".join(
        "%s, %s" % (row["iterations " + choice], row["seconds " + choice]) for choice in CHOICES)) for row in hard]
    text += ["", "A cell has iterations, those with multigrid first, and processor seconds of set-up and solve. Made "
             "by `%s` on %s, one rank, load %s at the end; [escape.csv](escape.csv) has all "
             "systems." % (about["command"], about["machine"], about["load at the end"])]
    prose.part(os.path.join(folder, "extremes.md"), "escape.py", text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--unknowns", default="3000,12000,50000")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", default="", help="a regular expression of names; the others stay as they are")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"),
                        help="folder of escape.csv and extremes.md")
    parser.add_argument("--report", action="store_true", help="no runs")
    arguments = parser.parse_args()
    if not arguments.report:
        machine.require()
        for name, options, multigrid in SYSTEMS:
            for unknowns in map(int, arguments.unknowns.split(",")):
                if re.search(arguments.only, name):
                    measured.merge(os.path.join(arguments.out, "escape.csv"), measured.provenance(), COLUMNS,
                                   [compare(name, options, multigrid, unknowns, arguments.repeat)], ("asked", "system"))
    write(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
