#!/usr/bin/env python3
"""What the constraints cost in time: (set-up + solve) of twocubes divided by that of A alone, interleaved runs; writes docs/overhead.md.

python3 docs/study/overhead.py [--repeat 5] [--sizes 32,48] [--ranks 1,2]      on an otherwise idle machine
"""
import argparse
import csv
import os
import statistics
import sys

from common import logview, machine, prose

BOUND = 1.35
EVENTS = ("AinsGramMat", "AinsGramFact", "AinsInvGram", "AinsPMat", "AinsPMatCopy", "BlockSALevels", "AinsRHS", "AinsMultiplier", "AinsProjector", "AinsGramSolve", "AinsMatMult", "PCSetUp", "PCApply", "MatMult", "KSPSolve")
OURS = ("AinsGramMat", "AinsGramFact", "AinsInvGram", "AinsPMat", "AinsPMatCopy")
COLUMNS = ["n1", "n2", "ranks", "run", "contact", "iterations", "reason", "setup", "solve", "processor", "load"]


def options(n1, n2, contact):
    return "-n1 %d -n2 %d -E2 10 -near_nullspace 1%s" % (n1, n2, "" if contact else " -contact 0")


def events(n1, n2, ranks, contact):
    """Seconds of each event on the slowest rank."""
    found = logview.run(options(n1, n2, contact), ranks)["events"]
    return {name: found[name]["seconds"] for name in EVENTS if name in found}


def total(run):
    return run["setup"] + run["solve"]


def measure(n1, n2, ranks, repeat, rows):
    """Pairs of runs; 'processor' without what the program needs to assemble the system and not to solve it."""
    pairs = []
    assembly = {contact: machine.run(options(n1, n2, contact) + " -pc_type none", ranks)["processor"] for contact in (0, 1)}
    for i in range(repeat):
        pair = {}
        for contact in (1, 0):
            run = machine.run(options(n1, n2, contact), ranks)
            if not machine.converged(run):
                sys.exit("twocubes %s: %s" % (options(n1, n2, contact), run["reason"]))
            run["processor"] -= assembly[contact]
            rows.append({"n1": n1, "n2": n2, "ranks": ranks, "run": i, "contact": contact, "iterations": run["iterations"], "reason": run["reason"], "setup": run["setup"], "solve": run["solve"], "processor": "%.2f" % run["processor"], "load": "%.2f" % machine.load()})
            pair[contact] = run
        pairs.append(pair)
        print("n1 %d, %d ranks: %.2f s, A alone %.2f s: %.3f, processor %.3f" % (n1, ranks, total(pair[1]), total(pair[0]), total(pair[1]) / total(pair[0]), pair[1]["processor"] / pair[0]["processor"]), flush=True)
    return pairs


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5, help="pairs of runs (default 5)")
    parser.add_argument("--sizes", default="32,48", help="n1; n2 is seven eighths of 32, five sixths of any other (default 32,48)")
    parser.add_argument("--ranks", default="1,2", help="ranks (default 1,2)")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"), help="folder (default docs)")
    arguments = parser.parse_args()
    machine.require()
    rows, lines, breakdown, quotients, loads = [], [], [], [], [machine.load()]
    for n1 in map(int, arguments.sizes.split(",")):
        n2 = 28 if n1 == 32 else n1 * 5 // 6
        for ranks in map(int, arguments.ranks.split(",")):
            pairs = measure(n1, n2, ranks, arguments.repeat, rows)
            loads.append(machine.load())
            parts = {contact: {key: [pair[contact][key] for pair in pairs] for key in ("setup", "solve")} for contact in (0, 1)}
            both = {contact: [total(pair[contact]) for pair in pairs] for contact in (0, 1)}
            low, middle = min(both[1]) / min(both[0]), statistics.median(both[1]) / statistics.median(both[0])
            quotients.append(low)
            used = {contact: min(pair[contact]["processor"] for pair in pairs) for contact in (0, 1)}
            lines.append("| %d | %d | %d | %d, %d | %.2f + %.2f | %.2f + %.2f | %.2f | %.2f | %s | %s |" % (
                n1, pairs[0][1]["unknowns"], ranks, pairs[0][1]["iterations"], pairs[0][0]["iterations"],
                min(parts[1]["setup"]), min(parts[1]["solve"]), min(parts[0]["setup"]), min(parts[0]["solve"]), low, middle, "%.2f" % (used[1] / used[0]) if ranks == 1 else "", "pass" if low <= BOUND else "**miss**"))
            with_, without = events(n1, n2, ranks, 1), events(n1, n2, ranks, 0)
            ours = sum(with_.get(name, 0) for name in OURS)
            breakdown.append("| %d | %d | %s | %.3f | %.3f | %.3f |" % (n1, ranks, " | ".join("%.3f" % with_.get(name, 0) for name in OURS), with_.get("PCSetUp", 0), with_.get("PCSetUp", 0) - ours, without.get("PCSetUp", 0)))
    text = ["# What the constraints cost in time", "",
            "Set-up and solve of a system with constraints take %.2f to %.2f times the seconds of the same bodies without them (*A alone*). The bound is %g." % (min(quotients), max(quotients), BOUND), "",
            "The system is `twocubes -E2 10 -near_nullspace` with the defaults, A alone the same with `-contact 0`. The runs with and without constraints take turns, %d of each. [overhead.csv](overhead.csv) has all the runs." % arguments.repeat, "",
            "| n1 | unknowns | ranks | iterations, A alone | set-up + solve [s], least | A alone [s], least | quotient of the least | of the medians | of processor time | at most %g |" % BOUND, "|" + "---|" * 10] + lines
    text += ["", "Where the load exceeds the number of cores only the quotient of processor time is reliable. It is given for one rank, because ranks that wait use processor time, too.", "",
             "Made by `%s` on %s; load between %.1f and %.1f." % (machine.command_line(), machine.describe(), min(loads), max(loads))]
    text += ["", "## Where the set-up goes", "", "Seconds on the slowest rank, from `-log_view` of one run. `PCSetUp` contains the events to the left of it, which belong to the constraints; the rest is mostly multigrid. The last column is the set-up of multigrid for A alone.", "",
             "| n1 | ranks | " + " | ".join(OURS) + " | PCSetUp | the rest | PCSetUp of A alone |", "|" + "---|" * (5 + len(OURS))] + breakdown
    with open(os.path.join(arguments.out, "overhead.csv"), "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    prose.write(os.path.join(arguments.out, "overhead.md"), text)
    print("wrote overhead.md and overhead.csv")
    return 0


if __name__ == "__main__":
    sys.exit(main())
