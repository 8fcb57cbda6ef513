#!/usr/bin/env python3
"""Set-up and solve against the limit of memory: what the set-up touches, what an iteration reads; docs/limit.csv and a
part of docs/cost.md.

/usr/bin/python3 docs/study/limit.py [--repeat 5] [--sizes 24,32,48]
    on an otherwise idle machine
/usr/bin/python3 docs/study/limit.py --report
    the text anew from the CSV
"""
import argparse
import os
import re
import time

from common import machine, measured, prose
from common.scaling import chosen, visits

MIB = 1048576.0
COLUMNS = ["n1", "n2", "unknowns", "iterations", "setup", "solve", "matrix_MiB", "setup_pages_MiB", "peak_MiB",
           "read_MiB", "bandwidth_MiB_s", "load"]
LEVEL = re.compile(r"level: (\d+) unknowns, blocks of (\d+), ([\d.]+) of them a row, ([\d.]+) MiB, interpolation "
                   r"([\d.]+)")


def bandwidth(repeat=5):
    """MiB a second of one core that reads an array of 256 MiB, the most of several."""
    import numpy

    array, least = numpy.ones(32 * 1048576), float("inf")
    for _ in range(repeat):
        begin = time.perf_counter()
        numpy.dot(array, array)
        least = min(least, time.perf_counter() - begin)
    return array.nbytes / MIB / least


def read_by_iteration(text):
    """MiB of operators and interpolation that an iteration reads: one product with A, of which half is stored in double
    precision, and a cycle.

    A visit has 5 products (smoothing 2, residual 1, smoothing 2), 4 if it begins at zero, as every second one of a
    coarser level does; in the others the residual is in double precision. Each interpolation is read twice a visit.
    """
    levels = [(int(n), int(b), float(blocks), float(mib), float(p)) for n, b, blocks, mib, p in LEVEL.findall(text)]
    n, b, blocks, _, _ = levels[0]
    total = (blocks + 1) / 2 * (n / b) * (8 * b * b + 4) / MIB
    cycle = "V" if "cycles=v" in text else chosen([(n / b, b, blocks, n / b, 1) for n, b, blocks, _, _ in levels])
    for often, (_, _, _, operator, interpolation) in zip(visits(len(levels), cycle), levels[:-1]):
        total += (5 * often - (often + 1) // 2 + often // 2) * operator + 2 * often * interpolation
    return total


def measure(n1, n2, repeat):
    rows = []
    for _ in range(repeat):
        run = machine.run("-n1 %d -n2 %d -E2 10 -near_nullspace -memory -ksp_view ::ascii_info_detail" % (n1, n2))
        memory = dict(re.findall(r"(\w+_MiB)=([\d.]+)", run["output"]))
        rows.append(dict(run, n1=n1, n2=n2, read_MiB="%.0f" % read_by_iteration(run["output"]),
                         bandwidth_MiB_s="%.0f" % bandwidth(), load="%.2f" % machine.load(), **memory))
        print(", ".join("%s %s" % (key, rows[-1][key]) for key in COLUMNS), flush=True)
    return rows


def write(folder):
    about, rows = measured.read(os.path.join(folder, "limit.csv"))
    lines, fresh, peaks, quotients = [], [], [], []
    for size in dict.fromkeys(row["n1"] for row in rows):
        mine = [row for row in rows if row["n1"] == size]
        low = {key: min(float(row[key]) for row in mine) for key in ("solve", "setup_pages_MiB", "peak_MiB")}
        first = mine[0]
        iteration = low["solve"] / int(first["iterations"])
        limit = float(first["read_MiB"]) / max(float(row["bandwidth_MiB_s"]) for row in rows)
        fresh.append(low["setup_pages_MiB"] / float(first["matrix_MiB"]))
        peaks.append(low["peak_MiB"] / float(first["matrix_MiB"]))
        quotients.append(iteration / limit)
        lines.append(prose.line(
            first["unknowns"], "%.2f" % fresh[-1], "%.2f" % peaks[-1], first["read_MiB"],
            "%.1f" % (1e3 * iteration), "%.1f" % (1e3 * limit), "%.2f" % quotients[-1]))
    text = ["The set-up touches %.2f to %.2f times the bytes of A for the first time. An iteration takes %.2f to %.2f "
            "times as long as reading its operators at the bandwidth of "
            "memory." % (min(fresh), max(fresh), min(quotients), max(quotients)), "",
            *prose.head("unknowns", "fresh memory / A", "peak / A", "MiB read an iteration", "ms an iteration",
                        "ms at the bandwidth", "quotient"), *lines]
    text += ["", "A is AIJ. An iteration is the whole solve, with the check of the answer, over the iterations. The "
             "bandwidth is that of a dot product of 256 MiB on one core. Least of %d runs. Made by `%s` (`twocubes "
             "-E2 10 -near_nullspace`) on %s, load %.1f to %.1f; [limit.csv](limit.csv)." % (
                 len([row for row in rows if row["n1"] == rows[0]["n1"]]), about["command"],
                 about["machine"], min(float(row["load"]) for row in rows), max(float(row["load"]) for row in rows))]
    prose.part(os.path.join(folder, "cost.md"), "limit.py", ["## Against the limit of memory", "", *text])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=5, help="runs (default 5)")
    parser.add_argument("--sizes", default="24,32,48", help="n1, with n2 = 5/6 of it (default 24,32,48)")
    parser.add_argument("--report", action="store_true", help="no runs: the text from the CSV")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"),
                        help="folder of limit.csv and cost.md (default docs)")
    arguments = parser.parse_args()
    if not arguments.report:
        machine.require("numpy")
        rows = [row for n1 in map(int, arguments.sizes.split(","))
                for row in measure(n1, n1 * 5 // 6, arguments.repeat)]
        measured.save(os.path.join(arguments.out, "limit.csv"), measured.provenance(), COLUMNS, rows)
    write(os.path.abspath(arguments.out))


if __name__ == "__main__":
    main()
