#!/usr/bin/env python3
"""The default against multigrid and a factorization that are chosen by hand: docs/escape.csv and the table of docs/models.md.

python3 docs/study/escape.py [--unknowns 3000,12000,50000] [--repeat 3]
The three take turns on one rank. Seconds are those of the processor from the first call of the solver on; of the runs the least, and the median in the CSV.
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
COLUMNS = ["asked", "system", "options", "unknowns", "constraints"] + [key + " " + choice for choice in CHOICES for key in ("iterations", "seconds", "median")] + ["quotient"]
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


def table(rows):
    """A line for each system: the quotients of all sizes, and what the largest took."""
    sizes = sorted({int(row["asked"]) for row in rows})
    lines = ["| system | quotient, %s | of %d: %s |" % (" | ".join(map(str, sizes)), sizes[-1], " | ".join(CHOICES)), "|" + "---|" * (1 + len(sizes) + len(CHOICES))]
    for name in dict.fromkeys(row["system"] for row in rows):
        found = {int(row["asked"]): row for row in rows if row["system"] == name}
        cells = [found[size]["quotient"] if size in found else "" for size in sizes]
        cells += ["%s, %s" % (found[sizes[-1]]["iterations " + choice], found[sizes[-1]]["seconds " + choice]) if sizes[-1] in found else "" for choice in CHOICES]
        lines.append("| %s | %s |" % (name, " | ".join(cells)))
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--unknowns", default="3000,12000,50000")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", default="", help="a regular expression of names; the others stay as they are")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"), help="folder of escape.csv and models.md")
    arguments = parser.parse_args()
    machine.require()
    path = os.path.join(arguments.out, "escape.csv")
    for name, options, multigrid in SYSTEMS:
        for unknowns in map(int, arguments.unknowns.split(",")):
            if re.search(arguments.only, name):
                measured.merge(path, measured.provenance(), COLUMNS, [compare(name, options, multigrid, unknowns, arguments.repeat)], ("asked", "system"))
    about, rows = measured.read(path)
    page = os.path.join(arguments.out, "models.md")
    begin, end = "<!-- begin: generated by docs/study/escape.py, do not edit -->", "<!-- end: generated by docs/study/escape.py -->"
    before, rest = open(page).read().split(begin)
    after = rest.split(end)[1]
    rows.sort(key=lambda row: ([name for name, _, _ in SYSTEMS].index(row["system"]), int(row["asked"])))
    known = [float(row["quotient"]) for row in rows if row["quotient"]]
    kept = sum(quotient <= BOUND for quotient in known)
    lines = [begin, "", "The default takes at most %g times as long as the better of multigrid and the factorization on %d of %d systems. Quotients are its seconds by those of the better one, for about so many unknowns. The last three columns have iterations, and seconds of the processor for set-up and solve. A sum has the iterations with multigrid, then those with the factorization." % (BOUND, kept, len(known)), ""] + table(rows) + [
        "", "Made by `%s` on %s, one rank; load %s at the end. Seconds are the least of the runs; [escape.csv](escape.csv) has each system, and medians." % (about["command"], about["machine"], about["load at the end"]), "", end]
    prose.write(page, (before + "\n".join(lines) + after).split("\n"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
