"""Bounds of the error against the true one, row by row of the monitor, and the seconds that the monitor takes."""
import csv
import os
import statistics

from . import machine, measured, prose
from .errors import CASES, exact_solution
from .measured import verdict

VARIANTS = ("weighted", "paper")
TOLERANCE = "1e-10"
FALLEN, FACTOR, ROUNDING, COST_BOUND = 0.1, 2.0, 1e-6, 1.02
KINDS = {"without": "", "stop": "-pc_ainsworth_stop energy_error -pc_ainsworth_error_rtol 1e-8", "monitor": "-pc_ainsworth_monitor_error csv:"}
SHARP = ["case", "n1", "variant", "iteration", "delay", "natural_norm", "error_lower", "error_upper", "error_true", "options"]
COST = ["n1", "run", "kind", "iterations", "setup", "solve"]


def sharp(folder, cases, sizes, keep):
    rows = []
    for case in cases:
        for n1 in sizes:
            with machine.workspace() as workspace:
                options, solution = exact_solution(workspace, keep, case, n1)
                table = os.path.join(workspace, "rows.csv")
                for variant in VARIANTS:
                    run = machine.run("%s -near_nullspace 1 -pc_ainsworth_variant %s -ainsworth_ksp_rtol %s -pc_ainsworth_reference %s -pc_ainsworth_monitor_error csv:%s" % (options, variant, TOLERANCE, solution, table))
                    if not machine.converged(run):
                        raise RuntimeError("%s, %s: %s" % (options, variant, run["reason"]))
                    with open(table, newline="") as file:
                        found = [dict(row, case=case, n1=n1, variant=variant, options=options) for row in csv.DictReader(file)]
                    rows += found
                    print("%s, n1 %d, %s: %s" % (case, n1, variant, ", ".join("%s %.3f to %.3f" % (what, low, high) for what, low, high in effectivity(found))), flush=True)
    measured.merge(os.path.join(folder, "sharp.csv"), measured.provenance(), SHARP, rows, ("case", "n1"))


def fallen(rows):
    """The rows from where the true error has fallen by 10."""
    first = float(rows[0]["error_true"])
    start = next(i for i, row in enumerate(rows) if float(row["error_true"]) <= FALLEN * first)
    return rows[start:]


def effectivity(rows):
    """(bound, least quotient with the true error, largest) of the rows that have one."""
    for what in ("lower", "upper"):
        quotients = [float(row["error_" + what]) / float(row["error_true"]) for row in fallen(rows) if row["error_" + what]]
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
                    run = machine.run("-n1 %d -n2 %d -E2 10 -near_nullspace 1 %s" % (n1, n1 * 5 // 6, monitor + (os.path.join(workspace, "rows.csv") if monitor.endswith(":") else "")))
                rows.append({"n1": n1, "run": turn, "kind": kind, "iterations": run["iterations"], "setup": run["setup"], "solve": run["solve"]})
        print("n1 %d: %s" % (n1, ", ".join("%s %.3f s" % (kind, min(row["solve"] for row in rows if row["kind"] == kind and row["n1"] == n1)) for kind in KINDS)), flush=True)
    measured.save(os.path.join(folder, "cost.csv"), measured.provenance(), COST, rows)


def made_by(about):
    return ["Made by `%s` on %s; load at the end %s." % (about["command"], about["machine"], about["load at the end"]), ""]


def runs(rows):
    """The rows of each solve."""
    answer = {}
    for row in rows:
        answer.setdefault((row["case"], row["n1"], row["variant"]), []).append(row)
    return answer


def draw(path, rows):
    from . import plots
    figure, panels = plots.pyplot.subplots(1, len(CASES), figsize=(3.2 * len(CASES), 4), sharey=True)
    for axes, case in zip(panels, CASES):
        largest = max((int(row["n1"]) for row in rows if row["case"] == case), default=0)
        for variant, color in zip(VARIANTS, ("C0", "C1")):
            mine = runs(rows).get((case, str(largest), variant), [])
            exact = float(mine[0]["error_true"]) if mine else 1.0
            for what, style in (("true", "-"), ("lower", "v"), ("upper", "^")):
                points = [(int(row["iteration"]), float(row["error_" + what]) / exact) for row in mine if row["error_" + what]]
                axes.semilogy([p[0] for p in points], [p[1] for p in points], style, color=color, fillstyle="none", markersize=5, label="%s, %s" % (variant, what))
        axes.set_title("%s, n1 = %d" % (CASES[case][0], largest), fontsize=8)
        axes.set_xlabel("iteration")
        axes.grid(True, which="major", alpha=0.4)
    panels[0].set_ylabel("energy norm of the error / first")
    panels[-1].legend(fontsize=7)
    figure.tight_layout()
    plots.save(figure, path)


def summarize_sharp(rows):
    """The extremes of each variant over all systems."""
    text = []
    for variant in VARIANTS:
        found = [list(effectivity(mine)) for (_, _, name), mine in runs(rows).items() if name == variant]
        text.append("- `%s`: the lower bound is %.2f to %.2f times the true error, the upper one %.2f to %.2f times." % (
            (variant,) + bounds(lower for lower, _ in found) + bounds(upper for _, upper in found)))
    return text


def write_sharp(folder, about, rows):
    draw(os.path.join(folder, "sharp"), rows)
    here = os.path.basename(folder)
    text = ["## How sharp", "", "Quotients of the bounds of `-pc_ainsworth_monitor_error` and the true energy norm of the error, least to largest. They are taken over all iterations from where the error has fallen by a factor of 10, down to a relative tolerance of %s. The bar: the lower bound is at most the error, and both are within a factor %g of it. The upper bound rests on an estimated eigenvalue and may be below the error." % (TOLERANCE, FACTOR), "",
            "![True error and its bounds](%s/sharp.svg)" % here, "",
            "| | n1 | variant | iterations | lower / true | | upper / true | |", "|" + "---|" * 8]
    each = {}
    for (case, n1, variant), mine in runs(rows).items():
        each.setdefault((case, variant), []).append((int(n1), int(mine[-1]["iteration"]), *effectivity(mine)))
    for (case, variant), found in each.items():
        low, high, least, most = *bounds(lower for _, _, lower, _ in found), *bounds(upper for _, _, _, upper in found)
        sizes, counts = zip(*sorted(entry[:2] for entry in found))
        text.append("| %s | %s | %s | %s | %.4f to %.4f | %s | %.4f to %.4f | %s |" % (
            CASES[case][0], ", ".join(map(str, sizes)), variant, ", ".join(map(str, counts)), low, high, verdict(high <= 1 + ROUNDING and low >= 1 / FACTOR), least, most, verdict(least >= 1 / FACTOR and most <= FACTOR)))
    return text + ["", "The true error is that of `-pc_ainsworth_reference`, with a solution by MUMPS with iterative refinement in extended precision. The last iterate of a solve has no lower bound, because no later step follows.", ""] + made_by(about)


def milliseconds(rows, n1):
    """Least and median of an iteration, of each kind."""
    each = {kind: [1e3 * float(row["solve"]) / int(row["iterations"]) for row in rows if row["n1"] == n1 and row["kind"] == kind] for kind in KINDS}
    return {kind: (min(values), statistics.median(values)) for kind, values in each.items()}


def summarize_cost(rows):
    times = [milliseconds(rows, n1) for n1 in dict.fromkeys(row["n1"] for row in rows)]
    quotients = {kind: [each[kind][0] / each["without"][0] for each in times] for kind in ("stop", "monitor")}
    return ["- An iteration takes %.3f to %.3f times as long with the estimate, and %.3f to %.3f times with the monitor." % (
        min(quotients["stop"]), max(quotients["stop"]), min(quotients["monitor"]), max(quotients["monitor"]))]


def write_cost(about, rows):
    text = ["## What it costs", "", "Milliseconds per iteration of the solve of `twocubes -E2 10 -near_nullspace`: least and median of the runs, which take turns, and quotients with the solve that estimates nothing. "
            "*Stop* is `-pc_ainsworth_stop energy_error`, the estimate alone; *monitor* also computes the residuals of both equations. The bar for the estimate: at most %g times." % COST_BOUND, "",
            "| n1 | without | stop | quotients | | monitor | quotients |", "|" + "---|" * 7]
    for n1 in dict.fromkeys(row["n1"] for row in rows):
        both = milliseconds(rows, n1)
        quotients = {kind: tuple(a / b for a, b in zip(both[kind], both["without"])) for kind in KINDS}
        text.append("| %s | %.2f, %.2f | %.2f, %.2f | %.3f, %.3f | %s | %.2f, %.2f | %.3f, %.3f |" % (
            (n1,) + both["without"] + both["stop"] + quotients["stop"] + (verdict(quotients["stop"][0] <= COST_BOUND),) + both["monitor"] + quotients["monitor"]))
    return text + [""] + made_by(about)


def write(folder):
    here = os.path.basename(folder)
    text = ["# The estimate of the error", "", "How close are the bounds of [report.md](report.md) to the true error, and what do they cost?", ""]
    parts, points = [], []
    for name, part, summary in (("sharp", lambda about, rows: write_sharp(folder, about, rows), summarize_sharp), ("cost", write_cost, summarize_cost)):
        path = os.path.join(folder, name + ".csv")
        if os.path.exists(path):
            about, rows = measured.read(path)
            points += summary(rows)
            parts += part(about, rows)
    text += points + ["- Every number comes from the CSV files in [%s/](%s)." % (here, here), ""] + parts
    prose.write(folder + ".md", text)
    print("wrote %s.md" % folder)
