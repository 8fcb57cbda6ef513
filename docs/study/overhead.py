#!/usr/bin/env python3
"""What the constraints cost in time: (set-up + solve) of twocubes divided by that of A alone, interleaved runs;
docs/overhead.csv and a part of docs/cost.md.

python3 docs/study/overhead.py [--repeat 5] [--sizes 32,48] [--ranks 1,2]      on an otherwise idle machine
python3 docs/study/overhead.py --report                                        the text anew from the CSV
"""
import argparse
import os
import statistics
import sys

from common import machine, measured, prose

BOUND = 1.35
COLUMNS = ["n1", "n2", "unknowns", "ranks", "run", "contact", "iterations", "reason", "setup", "solve", "processor",
           "load"]


def options(n1, n2, contact):
    return "-n1 %d -n2 %d -E2 10 -near_nullspace 1%s" % (n1, n2, "" if contact else " -contact 0")


def measure(n1, n2, ranks, repeat):
    """Pairs of runs; 'processor' without what the program needs to assemble the system and not to solve it."""
    rows = []
    assembly = {contact: machine.run(options(n1, n2, contact) + " -pc_type none", ranks)["processor"]
                for contact in (0, 1)}
    for i in range(repeat):
        for contact in (1, 0):
            run = machine.run(options(n1, n2, contact), ranks)
            if not machine.converged(run):
                sys.exit("twocubes %s: %s" % (options(n1, n2, contact), run["reason"]))
            rows.append(dict(run, n1=n1, n2=n2, ranks=ranks, run=i, contact=contact,
                             processor="%.2f" % (run["processor"] - assembly[contact]), load="%.2f" % machine.load()))
            print(", ".join("%s %s" % (key, rows[-1][key]) for key in COLUMNS), flush=True)
    return rows


def least(rows, contact, key):
    return min(float(row[key]) for row in rows if row["contact"] == contact)


def totals(rows, contact):
    return [float(row["setup"]) + float(row["solve"]) for row in rows if row["contact"] == contact]


def write(folder):
    about, rows = measured.read(os.path.join(folder, "overhead.csv"))
    systems, lines, quotients = {}, [], []
    for row in rows:
        systems.setdefault((row["n1"], row["ranks"]), []).append(row)
    for (n1, ranks), mine in systems.items():
        low, middle = (of(totals(mine, "1")) / of(totals(mine, "0")) for of in (min, statistics.median))
        quotients.append(low)
        first = {contact: next(row for row in mine if row["contact"] == contact) for contact in ("0", "1")}
        lines.append("| %s | %s | %s, %s | %s | %.2f | %.2f | %s |" % (
            first["1"]["unknowns"], ranks, first["1"]["iterations"], first["0"]["iterations"],
            " | ".join("%.2f + %.2f" % tuple(least(mine, contact, key) for key in ("setup", "solve"))
                       for contact in ("1", "0")), low, middle, measured.verdict(low <= BOUND)))
    loads = [float(row["load"]) for row in rows]
    text = ["**Two bodies in contact take %.2f times the seconds of the same bodies without constraints (%.2f to "
            "%.2f).** *A alone* is the system without constraints, solved by the same multigrid." % (
                statistics.median(quotients), min(quotients), max(quotients)), "",
            "| unknowns | ranks | iterations, A alone | set-up + solve [s], least | A alone [s], least | quotient | of "
            "the medians | at most %g |" % BOUND, "|" + "---|" * 8] + lines
    text += ["", "Made by `%s` (`twocubes -E2 10 -near_nullspace`; `-contact 0` in turns) on %s, load %.1f to %.1f; "
             "[overhead.csv](overhead.csv)." % (about["command"], about["machine"], min(loads), max(loads))]
    prose.part(os.path.join(folder, "cost.md"), "overhead.py", text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5, help="pairs of runs (default 5)")
    parser.add_argument("--sizes", default="32,48",
                        help="n1; n2 is seven eighths of 32, five sixths of any other (default 32,48)")
    parser.add_argument("--ranks", default="1,2", help="ranks (default 1,2)")
    parser.add_argument("--report", action="store_true", help="no runs")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"), help="folder (default docs)")
    arguments = parser.parse_args()
    if not arguments.report:
        machine.require()
        rows = []
        for n1 in map(int, arguments.sizes.split(",")):
            for ranks in map(int, arguments.ranks.split(",")):
                rows += measure(n1, 28 if n1 == 32 else n1 * 5 // 6, ranks, arguments.repeat)
                measured.save(os.path.join(arguments.out, "overhead.csv"), measured.provenance(), COLUMNS, rows)
    write(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
