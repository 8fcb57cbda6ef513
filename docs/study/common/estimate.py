"""Bounds of the error against the true one, row by row of the monitor, and the seconds that the monitor takes."""
import csv
import os
import statistics

from . import machine, measured, prose
from .errors import exact_solution

VARIANTS = ("weighted", "paper")
TOLERANCE = "1e-10"
FALLEN = 0.1
KINDS = {"without": "", "stop": "-pc_ainsworth_stop energy_error -pc_ainsworth_error_rtol 1e-8",
         "monitor": "-pc_ainsworth_monitor_error csv:"}
SHARP = ["case", "n1", "variant", "iteration", "delay", "natural_norm", "error_lower", "error_upper", "error_true",
         "options"]
COST = ["n1", "run", "kind", "iterations", "setup", "solve"]


def sharp(folder, cases, sizes, keep):
    rows = []
    for case in cases:
        for n1 in sizes:
            with machine.workspace() as workspace:
                options, solution = exact_solution(workspace, keep, case, n1)
                table = os.path.join(workspace, "rows.csv")
                for variant in VARIANTS:
                    run = machine.run("%s -near_nullspace 1 -pc_ainsworth_variant %s -ainsworth_ksp_rtol %s "
                                      "-pc_ainsworth_reference %s -pc_ainsworth_monitor_error "
                                      "csv:%s" % (options, variant, TOLERANCE, solution, table))
                    if not machine.converged(run):
                        raise RuntimeError("%s, %s: %s" % (options, variant, run["reason"]))
                    with open(table, newline="") as file:
                        found = [dict(row, case=case, n1=n1, variant=variant, options=options)
                                 for row in csv.DictReader(file)]
                    rows += found
                    print("%s, n1 %d, %s: %s" % (case, n1, variant, ", ".join(
                        "%s %.3f to %.3f" % (what, low, high) for what, low, high in effectivity(found))), flush=True)
    measured.merge(os.path.join(folder, "sharp.csv"), measured.provenance(), SHARP, rows, ("case", "n1"))


def fallen(rows):
    """The rows from where the true error has fallen by 10."""
    first = float(rows[0]["error_true"])
    start = next(i for i, row in enumerate(rows) if float(row["error_true"]) <= FALLEN * first)
    return rows[start:]


def effectivity(rows):
    """(bound, least quotient with the true error, largest) of the rows that have one."""
    for what in ("lower", "upper"):
        quotients = [float(row["error_" + what]) / float(row["error_true"])
                     for row in fallen(rows) if row["error_" + what]]
        yield what, min(quotients), max(quotients)


def bounds(quotients):
    """(least, largest) over what effectivity() gives of several solves."""
    found = list(quotients)
    return min(low for _, low, _ in found), max(high for _, _, high in found)


def cost(folder, sizes, repeat):
    rows = []
    for n1 in sizes:
        for turn in range(repeat):
            for kind, monitor in KINDS.items():
                with machine.workspace() as workspace:
                    run = machine.run("-n1 %d -n2 %d -E2 10 -near_nullspace 1 %s" % (n1, n1 * 5 // 6, monitor + (
                        os.path.join(workspace, "rows.csv") if monitor.endswith(":") else "")))
                rows.append({"n1": n1, "run": turn, "kind": kind, "iterations": run["iterations"],
                             "setup": run["setup"], "solve": run["solve"]})
        print("n1 %d: %s" % (n1, ", ".join(
            "%s %.3f s" % (kind, min(row["solve"] for row in rows if row["kind"] == kind and row["n1"] == n1))
            for kind in KINDS)), flush=True)
    measured.save(os.path.join(folder, "cost.csv"), measured.provenance(), COST, rows)


def runs(rows):
    """The rows of each solve."""
    answer = {}
    for row in rows:
        answer.setdefault((row["case"], row["n1"], row["variant"]), []).append(row)
    return answer


def summarize_sharp(rows):
    """The extremes of each variant over all systems."""
    text = []
    for variant in VARIANTS:
        found = [list(effectivity(mine)) for (_, _, name), mine in runs(rows).items() if name == variant]
        text.append("- `%s`: the lower bound is %.2f to %.2f times the true error, the upper one %.2f to %.2f "
                    "times." % (
                        (variant,) + bounds(lower for lower, _ in found) + bounds(upper for _, upper in found)))
    return text


def milliseconds(rows, n1):
    """Least and median of an iteration, of each kind."""
    each = {kind: [1e3 * float(row["solve"]) / int(row["iterations"])
                   for row in rows if row["n1"] == n1 and row["kind"] == kind] for kind in KINDS}
    return {kind: (min(values), statistics.median(values)) for kind, values in each.items()}


def summarize_cost(rows):
    times = [milliseconds(rows, n1) for n1 in dict.fromkeys(row["n1"] for row in rows)]
    quotients = {kind: [each[kind][0] / each["without"][0] for each in times] for kind in ("stop", "monitor")}
    return ["- An iteration takes %.3f to %.3f times as long with the estimate, and %.3f to %.3f times with the "
            "monitor." % (
                min(quotients["stop"]), max(quotients["stop"]), min(quotients["monitor"]), max(quotients["monitor"]))]


def write(folder):
    points, here = [], os.path.basename(folder)
    for name, summary in (("sharp", summarize_sharp), ("cost", summarize_cost)):
        path = os.path.join(folder, name + ".csv")
        if os.path.exists(path):
            about, rows = measured.read(path)
            points += summary(rows)
    text = ["The bounds of `-pc_ainsworth_monitor_error` over five kinds of systems, from where the error has fallen "
            "by %g to a tolerance of %s:" % (1 / FALLEN, TOLERANCE), ""] + points
    text += ["", "Made by `/usr/bin/python3 docs/study/refresh.py sharp estimate` on %s; CSVs in [%s/](%s)." % (
        about["machine"], here, here)]
    prose.part(os.path.join(os.path.dirname(folder), "cost.md"), "estimate.py", text)
