#!/usr/bin/env python3
"""Constraints of engineering models against as many ties of pairs of unknowns: docs/models.csv and a part of
docs/cost.md.

python3 docs/study/models.py [--slaves 1000,10000] [--repeat 3] [--only mean rbe3]      100000 needs 8 GB
Each model and the ties take turns on the same mesh, one rank; seconds of the processor are the least of the runs. One
run more compares with MUMPS. Rows of other models and numbers of slaves that are there stay. --report: no runs.
"""
import argparse
import math
import os
import re
import statistics
import sys

from common import machine, measured, prose

BOUND = 1.15
COLUMNS = ["slaves", "model", "options", "unknowns", "constraints", "longest", "shared", "iterations", "setup", "solve",
           "peak", "error", "quotient_setup", "quotient_iterations", "quotient_peak"]


def models(slaves):
    """Name and options; a single spider has half of its nodes on either side."""
    edge = round(math.sqrt(slaves / 6))
    return [("cyclic", ""), ("mortar", ""), ("mean", ""), ("mean", "-floating"), ("rbe3", "-patch %d" % edge),
            ("rbe3", "-patch 4"), ("rbe2", "-patch %d" % edge), ("rbe2", "-patch 4"),
            ("rigid", "-patch %d" % edge), ("periodic", ""), ("strain", ""), ("chain", ""), ("redundant", "")]


def mesh(slaves):
    """As many nodes on the interface as ties need, cubic elements, and at most 18 layers of them."""
    n = math.ceil(math.sqrt(slaves / 3)) - 1
    layers = max(4, min(n, 18 if slaves <= 1000 else 8 if slaves <= 10000 else 4))
    return "-n1 %d -n2 %d -nz1 %d -nz2 %d -height %g" % (n, n, layers, layers, layers / n)


def run(name, options, slaves, check):
    text = "-model %s -slaves %d %s %s -near_nullspace%s" % (
        name, slaves, options, mesh(slaves), " -check -ainsworth_ksp_rtol 1e-10" if check else "")
    answer = machine.run(text, program=machine.MODELS, peak=not check)
    if not machine.converged(answer):
        sys.exit("models %s: %s" % (text, answer["reason"]))
    answer["iterations"] = sum(map(int, re.findall(r"due to \w+ iterations (\d+)", answer["output"])))
    for key in ("longest", "shared"):
        answer[key] = int(re.search(r"\b%s=(\d+)" % key, answer["output"]).group(1))
    for key in ("setup", "solve"):
        answer[key] = float(re.search(r"\b%s_processor_s=(\S+)" % key, answer["output"]).group(1))
    return answer


def compare(slaves, arguments):
    rows = []
    for name, options in [("ties", "")] + models(slaves):
        if arguments.only and name not in arguments.only:
            continue
        found, ties = [], []
        for _ in range(arguments.repeat):
            found.append(run(name, options, slaves, False))
            ties.append(run("ties", "", slaves, False))
        row = dict(found[0], slaves=slaves, model=name, options=options, error="")
        for key in ("setup", "solve", "peak"):
            row[key] = min(answer[key] for answer in found)
        for key in ("setup", "iterations", "peak"):
            row["quotient_" + key] = "%.2f" % (row[key] / min(answer[key] for answer in ties))
        if slaves <= arguments.check:
            row["error"] = re.search(r"check: error=(\S+)", run(name, options, slaves, True)["output"]).group(1)
        row.update(setup="%.3f" % row["setup"], solve="%.3f" % row["solve"], peak="%.0f" % row["peak"])
        print(", ".join("%s %s" % (key, row[key]) for key in COLUMNS), flush=True)
        rows.append(row)
    return rows


def name(row):
    return ("`%s`" % (row["model"] + " " + row["options"]).strip(), int(row["slaves"]))


def write(folder):
    about, rows = measured.read(os.path.join(folder, "models.csv"))
    rows = [row for row in rows if row["model"] != "ties"]
    text = ["Against as many ties of pairs of nodes, on 1000 to 100000 slaves:", "",
            "| quotient | median | least | most | above %g |" % BOUND, "|---|---|---|---|---|"]
    for title, key in (("iterations", "quotient_iterations"), ("set-up", "quotient_setup"),
                       ("memory", "quotient_peak")):
        numbers = [float(row[key]) for row in rows]
        high = {}
        for row in sorted((row for row in rows if float(row[key]) > BOUND), key=lambda row: -float(row[key])):
            high.setdefault(name(row)[0], []).append(row[key])
        text.append("| %s | %.2f | %.2f | %.2f | %s |" % (
            title, statistics.median(numbers), min(numbers), max(numbers),
            "; ".join("%s %s" % (model, ", ".join(found)) for model, found in high.items())))
    errors = [float(row["error"]) for row in rows if row["error"]]
    text += ["", "The error against MUMPS is at most %.0e with a tolerance of 1e-10. Made by `python3 "
             "docs/study/models.py` on %s, one rank, processor seconds, load %s at the end; [models.csv](models.csv) "
             "has the commands and all models." % (
                 max(errors), about["machine"], about["load at the end"])]
    prose.part(os.path.join(folder, "cost.md"), "models.py", text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--slaves", default="1000,10000")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", nargs="+", metavar="MODEL", help="these models; all without it",
                        choices=list(dict.fromkeys(["ties"] + [name for name, _ in models(1000)])))
    parser.add_argument("--check", type=int, default=1000,
                        help="up to so many slaves the solution is compared with MUMPS")
    parser.add_argument("--report", action="store_true", help="no runs")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"), help="folder of models.csv and cost.md")
    arguments = parser.parse_args()
    if not arguments.report:
        machine.require()
        rows = []
        for slaves in map(int, arguments.slaves.split(",")):
            rows += compare(slaves, arguments)
            measured.merge(os.path.join(arguments.out, "models.csv"), measured.provenance(), COLUMNS, rows,
                           ("slaves", "model", "options"))
    write(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
