#!/usr/bin/env python3
"""The paper's experiments with the defaults, beside A alone: docs/results.csv, a picture, and a part of docs/cost.md.

/usr/bin/python3 docs/study/results.py [--sizes 24-contact ... 96:96] [--shares 0 0.25 0.5 0.75 1]
    5.2 and 5.3: finer and finer meshes; 5.4: set-up and solve against the number of constraints
/usr/bin/python3 docs/study/results.py --report
    text and picture from the CSV

A size is N, N:M, NxZ or NxZ:M, with or without -contact after it: N elements per edge of the contact surface of the
upper body, M of the lower one (default seven eighths of N: the nodes do not meet), Z along the height (default N);
-contact: METIS knows which elements touch. Needs a build (AINSWORTH_BUILD, default build/) and Debian's
python3-matplotlib; seconds need an otherwise idle machine.
"""
import argparse
import os
import re
import sys

from common import machine, measured, prose

# The paper's share of the surface: 27 000 rows of C for 96 x 96 elements, 188 000 for 256 x 256
PROBLEM = "-E2 10 -stick 0.92 -near_nullspace 1"
SIZES = ["24-contact", "48-contact", "96-contact", "96:96"]
SHARED, RANKS, SHARES = "128x16-contact", 2, ["0", "0.25", "0.5", "0.75", "1"]
BOUND, MORE = 1.35, 2
COLUMNS = ["size", "share", "constraints", "unknowns", "iterations", "setup", "solve", "peak", "alone_iterations",
           "alone_setup", "alone_solve", "alone_peak", "load", "options"]


def mesh(size):
    """Options of twocubes for a size."""
    found = re.fullmatch(r"(\d+)(?:x(\d+))?(?::(\d+))?(-contact)?", size)
    if not found:
        sys.exit("%s is no size: write 96, 96:95, 128x16, 128x16:127 or 128x16-contact" % size)
    n1, nz = int(found.group(1)), int(found.group(2) or 0)
    text = "-n1 %d -n2 %d" % (n1, int(found.group(3) or round(n1 * 7 / 8)))
    if nz:
        text += " -nz1 %d -nz2 %d -height %.12g" % (nz, nz, nz / n1)
    return text + " -partition contact" * bool(found.group(4))


def solved(options, limit):
    """A run, or an error."""
    run = machine.run(options, RANKS, limit, peak=True)
    if not machine.converged(run):
        sys.exit("twocubes %s: %s" % (options, run["reason"]))
    return run


def measure(path, arguments):
    """Saved after each run; A alone is measured once for each size."""
    rows = []
    for size, shares in [(size, ["1"]) for size in arguments.sizes] + [(SHARED, arguments.shares)]:
        options = "%s %s" % (mesh(size), PROBLEM)
        alone = solved(options + " -contact 0", arguments.limit)
        for share in shares:
            run = solved(options + " -fraction " + share, arguments.limit)
            for prefix, values in (("", run), ("alone_", alone)):
                run.update({prefix + name: values[name] for name in ("iterations", "setup", "solve")})
                run[prefix + "peak"] = "%.0f" % values["peak"]
            rows.append(dict(run, size=size, share=share, load="%.2f" % machine.load(), options=options))
            print(", ".join("%s %s" % (name, rows[-1][name]) for name in COLUMNS[:-1]), flush=True)
            measured.save(path, measured.provenance(), COLUMNS, rows)


def seconds(row, prefix=""):
    return float(row[prefix + "setup"]) + float(row[prefix + "solve"])


def quotient(row):
    """Seconds over those of A alone."""
    return seconds(row) / seconds(row, "alone_")


def of_shares(rows):
    return [row for row in rows if row["size"] == SHARED]


def picture(rows, path):
    """Stacked bars over the share of the rows; A alone is the dashed line, its set-up the dotted one."""
    from common import plots
    figure, panel = plots.pyplot.subplots(figsize=(plots.WIDTH / 2, 2.8))
    for i, row in enumerate(rows):
        panel.bar(i, float(row["setup"]), **plots.bar(0, "set-up" if i == 0 else None))
        panel.bar(i, float(row["solve"]), bottom=float(row["setup"]), **plots.bar(3, "solve" if i == 0 else None))
        panel.annotate(row["iterations"], (i, seconds(row)), xytext=(0, 2), textcoords="offset points", ha="center",
                       va="bottom", zorder=3, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})
    panel.axhline(seconds(rows[0], "alone_"), color="k", linestyle="--", linewidth=1, label="A alone")
    panel.axhline(float(rows[0]["alone_setup"]), color="k", linestyle=":", linewidth=1, label="its set-up")
    panel.set_xticks(range(len(rows)))
    panel.set_xticklabels(["%g" % (100 * float(row["share"])) for row in rows])
    panel.set_xlabel("share of the rows of C [%]; above the bars: iterations")
    panel.set_ylabel("seconds")
    panel.margins(y=0.15)
    handles, labels = panel.get_legend_handles_labels()
    plots.legend_below(figure, dict(zip(labels, handles)))
    plots.save(figure, path)


def write(folder):
    about, rows = measured.read(os.path.join(folder, "results.csv"))
    shares = of_shares(rows)
    memory = [float(row["peak"]) / float(row["alone_peak"]) for row in rows]
    text = ["## Larger problems, more constraints", "",
            "The paper's experiments with the defaults, on %d ranks: cubes, or flat boxes, of E2/E1 = 10, where 92 %% "
            "of the surface sticks. With *contact* METIS knows which elements touch. The paper reports 30 to 33 "
            "iterations for 5.5 million unknowns on 32 to 512 tasks, 18 to 23 on finer and finer meshes, and 22 to 24 "
            "over shares of 188 000 constraints." % RANKS, "",
            *prose.head("elements per edge", "unknowns", "constraints", "iterations, A alone", "set-up + solve [s]",
                        "A alone [s]", "quotient")]
    for row in rows:
        if row["size"] != SHARED:
            text.append(prose.line(
                row["size"], row["unknowns"], row["constraints"], "%(iterations)s, %(alone_iterations)s" % row,
                "%(setup)s + %(solve)s" % row, "%(alone_setup)s + %(alone_solve)s" % row, "%.2f" % quotient(row)))
    text += ["", "Over shares of the rows, %s unknowns (%s); bounds: %g times the seconds of A alone, and %d more "
             "iterations:" % (shares[0]["unknowns"], SHARED, BOUND, MORE), "",
             *prose.head("share of the rows", "constraints", "iterations", "set-up [s]", "solve [s]", "/ A alone",
                         "bounds")]
    for row in shares:
        holds = quotient(row) <= BOUND and int(row["iterations"]) <= int(row["alone_iterations"]) + MORE
        text.append(prose.line(*(row[name] for name in ("share", "constraints", "iterations", "setup", "solve")),
                               "%.2f" % quotient(row), measured.verdict(holds)))
    loads = [float(row["load"]) for row in rows]
    text += ["", "![Set-up and solve over the share of the rows](results.svg)", "",
             "The largest takes %.2f GiB; all take %.2f to %.2f times the memory of A alone. Made by `%s` on %s, load "
             "%.1f to %.1f; [results.csv](results.csv)." % (
                 max(float(row["peak"]) for row in rows) / 1024, min(memory), max(memory), about["command"],
                 about["machine"], min(loads), max(loads))]
    picture(shares, os.path.join(folder, "results"))
    prose.part(os.path.join(folder, "cost.md"), "results.py", text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", nargs="*", default=SIZES, help="sizes (default %s)" % " ".join(SIZES))
    parser.add_argument("--shares", nargs="*", default=SHARES, help="shares of the rows of C, of %s (default %s)" % (
                        SHARED, " ".join(SHARES)))
    parser.add_argument("--limit", type=int, default=3600, help="seconds that one run may take (default 3600)")
    parser.add_argument("--report", action="store_true", help="no runs")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"), help="folder (default docs)")
    arguments = parser.parse_args()
    if not arguments.report:
        machine.require("matplotlib")
        measure(os.path.join(arguments.out, "results.csv"), arguments)
    write(os.path.abspath(arguments.out))


if __name__ == "__main__":
    main()
