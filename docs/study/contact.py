#!/usr/bin/env python3
"""Contact: Hertz' problem over meshes, what a sequence of steps costs, other solvers, friction over meshes; CSVs and
plots in docs/contact.

/usr/bin/python3 docs/study/contact.py [--cylinder 16,32,64,128] [--sphere 8,12,16,20,26] [--sequence 12,16,20]
    [--peers 12,16] [--friction 6,8,12,16,24]
Some minutes; one part alone: --sphere "" --sequence "" and so on.
One rank; seconds of the processor in the solve. The tables of docs/contact.md are printed.
"""
import argparse
import csv
import math
import os
import re
import subprocess
import sys

from common import machine, measured, plots

FOLDER = os.path.join(machine.ROOT, "docs", "contact")
BUILD = os.path.dirname(machine.PLUGIN)
OURS = "-ksp_type preonly -pc_type ainsworth"
EXACT = " -snes_ainsworthactiveset_loose 0"
MUMPS = "-monolithic -ksp_type preonly -pc_type lu -pc_factor_mat_solver_type mumps"
SOLVERS = [("kept", OURS), ("fresh", OURS + " -fresh"), ("kept, all solves exact", OURS + EXACT),
           ("fresh, all solves exact", OURS + EXACT + " -fresh"), ("MUMPS", MUMPS)]
SET = "-snes_type ainsworthactiveset "
ELIMINATION = "-method elimination -ksp_type cg -ksp_norm_type natural -pc_type "
TOLERANCES = ("1e-4", "1e-6", "1e-8")
# name, options, the option of the tolerance, the tolerances
PEERS = [(name, SET + options, "-ainsworth_ksp_rtol", TOLERANCES) for name, options in SOLVERS[:4]] + [
    ("MUMPS", SET + MUMPS, "", ("",)),
    ("elimination, blocksa", ELIMINATION + "blocksa", "-ksp_rtol", TOLERANCES),
    ("elimination, BoomerAMG", ELIMINATION + "hypre", "-ksp_rtol", TOLERANCES),
    ("TAO, PDIPM", "-method tao -tao_type pdipm", "-tao_gatol", ("1", "1e-3", "1e-5"))]


def run(program, options):
    command = [os.path.join(BUILD, "tutorials", program), "-dll_append", machine.PLUGIN] + options.split()
    answer = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                            env=machine.ENVIRONMENT)
    if answer.returncode:
        sys.exit("%s: %s" % (" ".join(command), answer.stdout))
    return answer.stdout


def values(text, line):
    found = re.search(r"^%s: (.*)$" % line, text, re.M).group(1)
    return dict(part.split("=", 1) for part in found.split() if "=" in part)


def hertz(dim, n, options, pressure=None):
    text = run("hertz", "-dim %d -n %d -snes_type ainsworthactiveset "
               "%s%s" % (dim, n, options, " -pressure " + pressure if pressure else ""))
    steps = [int(count) for count in re.findall(r"(\d+) iterations", text)]
    row = dict(values(text, "hertz"), **values(text, "errors"))
    return dict(row, first=steps[0], most=max(steps), solves=len(steps), error_radius=values(text, "errors")["radius"],
                error_pressure=values(text, "errors")["pressure"], error_sink=values(text, "errors")["sink"])


def rate(rows, key):
    """The exponent of the mesh width that fits the errors best."""
    points = [(math.log(float(row["n"])), math.log(abs(float(row[key])))) for row in rows]
    x, y = (sum(p[k] for p in points) / len(points) for k in (0, 1))
    return -sum((p[0] - x) * (p[1] - y) for p in points) / sum((p[0] - x) ** 2 for p in points)


def table(names, rows):
    print("\n| " + " | ".join(names) + " |\n|" + "---|" * len(names))
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")


def percent(text):
    return "%+.2f %%" % (100 * float(text))


def accuracy(arguments):
    rows = []
    for dim, sizes in ((2, arguments.cylinder), (3, arguments.sphere)):
        mine = []
        for n in sizes:
            path = os.path.join(FOLDER, "pressure%d.csv" % dim)
            mine.append(hertz(dim, n, OURS + (" -reach 96" if dim == 2 else ""), path))
            print(mine[-1], flush=True)
        table(["n", "unknowns", "rows in contact", "steps", "iterations", "radius", "pressure", "sinking", "distance",
               "processor [s]"],
              [[r["n"], r["size"], r["active"], r["steps"], r["most"], percent(r["error_radius"]),
                percent(r["error_pressure"]), percent(r["error_sink"]), r["distance"], r["cpu_s"]] for r in mine])
        print("rates: " + ", ".join("%s %.1f" % (key, rate(mine, key))
                                    for key in ("error_radius", "error_pressure", "error_sink", "distance")))
        rows += mine
    measured.save(os.path.join(FOLDER, "hertz.csv"), measured.provenance(),
                  ["dim", "n", "size", "active", "steps", "first", "most", "force", "error_radius", "error_pressure",
                   "error_sink", "distance", "cpu_s"], rows)


def sequence(arguments):
    rows = []
    for n in arguments.sequence:
        for name, options in SOLVERS:
            best = min((hertz(3, n, options) for _ in range(arguments.repeat)), key=lambda row: float(row["cpu_s"]))
            rows.append(dict(best, solver=name))
            print(rows[-1], flush=True)
    table(["unknowns", "solver", "solves", "iterations, first and most", "processor [s]", "of fresh"],
          [[r["size"], r["solver"], r["solves"], "%s, %s" % (r["first"], r["most"]), r["cpu_s"],
            "%.2f" % (float(r["cpu_s"]) / float(next(o["cpu_s"] for o in rows if o["size"] == r["size"]
                                                     and o["solver"] == "fresh")))] for r in rows])
    measured.save(os.path.join(FOLDER, "sequence.csv"), measured.provenance(),
                  ["n", "size", "solver", "solves", "first", "most", "cpu_s"], rows)


def peers(arguments):
    """Whole simulations by all solvers, over their tolerances: error and processor seconds."""
    rows = []
    for n in arguments.peers:
        for name, options, option, tolerances in PEERS:
            for tolerance in tolerances:
                runs = [values(run("peers", "-n %d %s %s %s" % (n, options, option, tolerance)), "peer")
                        for _ in range(arguments.repeat)]
                rows.append(dict(min(runs, key=lambda row: float(row["cpu_s"])), n=n, solver=name, tolerance=tolerance))
                print(rows[-1], flush=True)
    ours = {(n, t): float(next(r["cpu_s"] for r in rows if (r["n"], r["solver"], r["tolerance"]) == (n, "kept", t)))
            for n in arguments.peers for t in TOLERANCES}
    table(["unknowns", "solver", "tolerance", "steps", "iterations", "error", "processor [s]", "of kept at 1e-8"],
          [[r["unknowns"], r["solver"], r["tolerance"], r["steps"], r["iterations"], r["error"], r["cpu_s"],
            "%.2f" % (float(r["cpu_s"]) / ours[r["n"], "1e-8"])] for r in rows])
    measured.save(os.path.join(FOLDER, "peers.csv"), measured.provenance(),
                  ["n", "unknowns", "solver", "tolerance", "steps", "iterations", "error", "depth", "cpu_s"], rows)


def titled(name):
    """As the page says it."""
    return name.replace("kept", "one solver").replace("fresh", "new solvers")


def plot_peers():
    """Error against seconds of the largest size."""
    rows = measured.read(os.path.join(FOLDER, "peers.csv"))[1]
    rows = [row for row in rows if row["n"] == rows[-1]["n"] and float(row["error"]) > 0]
    figure, panel = plots.pyplot.subplots(figsize=(plots.WIDTH, 4.4))
    handles = {}
    for number, name in enumerate(dict.fromkeys(row["solver"] for row in rows)):
        mine = [row for row in rows if row["solver"] == name]
        name = titled(name)
        handles[name], = panel.loglog([float(row["cpu_s"]) for row in mine], [float(row["error"]) for row in mine],
            **plots.style(number, name))
    plots.seconds(panel.xaxis)
    panel.set_xlabel("processor seconds of the simulation")
    panel.set_ylabel("error in the energy norm")
    panel.grid(True, alpha=0.4)
    plots.legend_below(figure, handles)
    plots.save(figure, os.path.join(FOLDER, "peers"))


def friction(arguments):
    rows = []
    print("friction, n1 = 16: " + ", ".join(
        "%s %s s" % (name, min(values(run("friction", "-n1 16 -n2 14 -mu 0.2 " + OURS + more), "friction")["cpu_s"]
                               for _ in range(arguments.repeat)))
        for name, more in (("kept", " -ainsworth_ksp_rtol 1e-2"), ("fresh", " -ainsworth_ksp_rtol 1e-2 -fresh"),
                           ("kept, 1e-8", ""), ("fresh, 1e-8", " -fresh"))), flush=True)
    for n in arguments.friction:
        text = run("friction", "-n1 %d -n2 %d -mu 0.2 %s" % (n, n * 5 // 6, OURS))
        rows.append(dict(values(text, "friction"), n=n,
                         most=max(int(i) for i in re.findall(r"(\d+) iterations", text))))
        print(rows[-1], flush=True)
    last = rows[-1]
    table(["n1", "steps", "stuck, slipped", "iterations", "tangential force", "from the last"],
          [[r["n"], r["steps"], r["stick"] + ", " + r["slip"], r["most"], r["tangential"],
            percent(float(r["tangential"]) / float(last["tangential"]) - 1)] for r in rows])
    measured.save(os.path.join(FOLDER, "friction.csv"), measured.provenance(),
                  ["n", "mu", "steps", "stick", "slip", "open", "most", "normal", "tangential", "law"], rows)


def plot():
    figure, panels = plots.pyplot.subplots(1, 2, figsize=(plots.WIDTH, 4))
    for panel, dim, title in zip(panels, (2, 3), ("cylinder on block", "sphere on block")):
        with open(os.path.join(FOLDER, "pressure%d.csv" % dim), newline="") as file:
            rows = sorted(((float(r["distance"]), float(r["pressure"]), float(r["hertz"]))
                           for r in csv.DictReader(file)))
        edge = max(r[0] for r in rows if r[2] > 0)
        exact = sorted(r for r in rows if r[0] < 1.3 * edge)
        panel.plot([r[0] for r in exact], [r[1] for r in exact], "o", fillstyle="none", color="#0072b2", markersize=4,
                   label="forces of nodes / area")
        panel.plot([r[0] for r in exact], [r[2] for r in exact], "-", color="#d55e00", label="Hertz")
        panel.set_xlabel("distance from the axis [mm]")
        panel.set_ylabel("pressure [MPa]")
        panel.set_title(title)
        panel.grid(True, alpha=0.4)
        panel.legend()
    figure.tight_layout()
    plots.save(figure, os.path.join(FOLDER, "pressure"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, sizes in (("cylinder", "8,16,32,64,128"), ("sphere", "8,12,16,20,26"), ("sequence", "12,16,20"),
                        ("peers", "12,16"), ("friction", "6,8,12,16,24")):
        parser.add_argument("--" + name, default=sizes, type=lambda text: [int(n) for n in text.split(",") if n],
                            help="meshes (default %s)" % sizes)
    parser.add_argument("--repeat", type=int, default=2, help="runs of each sequence (default 2)")
    parser.add_argument("--report", action="store_true", help="no runs: the pictures from the CSV files")
    arguments = parser.parse_args()
    if arguments.report:
        plot()
        plot_peers()
        print("wrote the part of contact.py: pictures")
        return 0
    for name in ("cylinder", "sphere", "sequence", "peers", "friction"):
        if isinstance(getattr(arguments, name), str):
            setattr(arguments, name, [int(n) for n in getattr(arguments, name).split(",")])
    os.makedirs(FOLDER, exist_ok=True)
    if arguments.cylinder and arguments.sphere:
        accuracy(arguments)
        plot()
    if arguments.sequence:
        sequence(arguments)
    if arguments.peers:
        peers(arguments)
        plot_peers()
    if arguments.friction:
        friction(arguments)
    return 0


if __name__ == "__main__":
    sys.exit(main())
