"""A part of docs/cost.md: which solver has the smallest error after a given time. Every number comes from the CSVs of
errors.py.
"""
import glob
import math
import os

from . import measured, prose
from .errors import CASES, OWN, on_ranks

LEVELS = (1e-4, 1e-6, 1e-8)
MIDDLE = LEVELS[1]
OURS = "ainsworth"
SHOWN = (OURS, "elimination", "fieldsplit_selfp", "golub_greif", "minres", "mumps")  # in the table
SUMMARY = (["system", "solver"] + ["seconds_to_%.0e" % level for level in LEVELS]
           + ["least_error", "iterations", "memory_mb", "failure"])


class System:
    """One CSV."""

    def __init__(self, path):
        self.path, (self.about, rows) = path, measured.read(path)
        self.name = os.path.splitext(os.path.basename(path))[0]
        case, size = self.name.rsplit("-", 1)
        self.n1, self.ranks = int(size), int(self.about["ranks"])
        self.case = case.removesuffix(on_ranks(self.ranks))
        self.rows = {}
        for row in sorted(rows, key=lambda row: row["solver"]):
            self.rows.setdefault(row["solver"], []).append(row)

    def title(self):
        title = "own system" if self.case == OWN else "%s, n1 = %d" % (CASES[self.case][0], self.n1)
        return title + (", %d ranks" % self.ranks if self.ranks > 1 else "")

    def size(self, what="unknowns"):
        return dict(word.split("=") for word in self.about["sizes"].split() if "=" in word).get(what, "?")

    def points(self, solver):
        """(seconds, error, did it converge) of the rows that have an answer, in the order of the tolerances."""
        answer = []
        for row in self.rows.get(solver, []):
            if row["energy_error"]:
                error = float(row["energy_error"])
                if error < float("inf"):
                    answer.append((float(row["setup_s"]) + float(row["solve_s"]), error,
                                   row["reason"].startswith("CONVERGED")))
        return answer

    def seconds_to(self, solver, level):
        """Where the line of the diagram first comes down to this error; None: never."""
        points = self.points(solver)
        good = [seconds for seconds, error, _ in points if error <= level]
        for (before, above, _), (after, below, _) in zip(points, points[1:]):
            if above > level >= below > 0:
                share = math.log(above / level) / math.log(above / below)
                good.append(before * (after / before) ** share)
        return min(good) if good else None

    def failure(self, solver):
        last = self.rows[solver][-1]
        return None if last["reason"].startswith("CONVERGED") else last["reason"]


def draw(systems, path):
    """Work-precision diagrams, one panel a system."""
    from . import plots
    columns = min(2, len(systems))
    count = -(-len(systems) // columns)
    figure, axes = plots.pyplot.subplots(count, columns, figsize=(plots.WIDTH, 3.2 * count + 0.5), squeeze=False,
        sharey=True)
    panels = list(axes.flat)
    handles = {}
    for panel, system in zip(panels, systems):
        for solver in system.rows:
            points = system.points(solver)
            if points:
                handles[solver], = panel.plot([p[0] for p in points], [p[1] for p in points],
                                              **plots.solver_style(solver))
            lost = [p for p in points if not p[2]]
            panel.plot([p[0] for p in lost], [p[1] for p in lost], color="k", marker="x", linestyle="none",
                       markersize=9)
        panel.set_xscale("log")
        plots.seconds(panel.xaxis)
        panel.set_yscale("log")
        panel.set_title("%s, %s unknowns" % (system.title(), system.size()))
        panel.grid(True, which="major", alpha=0.4)
    for panel in panels[len(systems):]:
        panel.set_visible(False)
    for panel in panels[max(len(systems) - columns, 0):len(systems)]:
        panel.set_xlabel("set-up and solve [s]")
    for row in axes:
        row[0].set_ylabel("relative energy error")
    plots.legend_below(figure, handles)
    plots.save(figure, path)


def heat_map(systems, path):
    """Seconds to 1e-6, shaded by how many times those of the quickest they are."""
    from . import plots
    solvers = list(dict.fromkeys(solver for system in systems for solver in system.rows))
    found = [[system.seconds_to(solver, MIDDLE) if solver in system.rows else None for system in systems]
             for solver in solvers]
    best = [min((row[i] for row in found if row[i]), default=None) for i in range(len(systems))]
    shades = [[math.log10(value / best[i]) if value else float("nan") for i, value in enumerate(row)] for row in found]
    figure, panel = plots.pyplot.subplots(figsize=(plots.WIDTH, 1.6 + 0.4 * len(solvers)))
    colors = plots.pyplot.get_cmap("YlOrRd").copy()
    colors.set_bad("white")
    image = panel.imshow(shades, cmap=colors, vmin=0, vmax=1.5, aspect="auto")
    for i, row in enumerate(found):
        for j, value in enumerate(row):
            panel.text(j, i, seconds(value) or "-", ha="center", va="center",
                color="white" if value and shades[i][j] > 1.0 else "black",
                weight="bold" if value and value == best[j] else "normal")
    panel.set_yticks(range(len(solvers)))
    panel.set_yticklabels(solvers)
    panel.set_xticks(range(len(systems)))
    panel.set_xticklabels([system.title().replace(", ", ",\n") for system in systems], rotation=30, ha="right",
        rotation_mode="anchor")
    bar = figure.colorbar(image, ticks=[0, math.log10(3), 1, 1.5])
    bar.ax.set_yticklabels(["quickest", "3 times", "10 times", "30 times"])
    panel.set_title("seconds to an error of 1e-6 (bold: the quickest; -: not in the time of its series)")
    figure.tight_layout()
    plots.save(figure, path)


def seconds(value):
    return "" if value is None else "%.3g" % value


def summary(systems):
    """One row for each system and solver."""
    lines = []
    for system in systems:
        for solver, rows in system.rows.items():
            points, answered = system.points(solver), [row for row in rows if row["energy_error"]]
            last = answered[-1] if answered else {"iterations": "", "memory_mb": ""}
            line = {"system": system.name, "solver": solver,
                    "least_error": "%.0e" % min(p[1] for p in points) if points else "",
                    "iterations": last["iterations"], "memory_mb": last["memory_mb"],
                    "failure": system.failure(solver) or ""}
            line.update({"seconds_to_%.0e" % level: seconds(system.seconds_to(solver, level)) for level in LEVELS})
            lines.append(line)
    return lines


def verdict(systems):
    """Where another solver is as fast as ours, over all systems and levels."""
    faster = []
    for system in systems:
        for level in LEVELS:
            ours = system.seconds_to(OURS, level) if OURS in system.rows else None
            for solver in system.rows:
                other = system.seconds_to(solver, level)
                if not solver.startswith(OURS) and other is not None and (ours is None or other <= ours):
                    faster.append("%s on %s at %.0e (%s s, ours %s)" % (solver, system.title(), level, seconds(other),
                                                                        seconds(ours) or "never"))
    levels = ", ".join("%.0e" % level for level in LEVELS)
    if not faster:
        return "`%s` is the first to reach an error of %s on all of these %d systems." % (OURS, levels, len(systems))
    return "`%s` is the first to reach an error of %s, except for: %s." % (OURS, levels, "; ".join(faster))


def growth(systems, newer):
    """How the seconds to 1e-6 grow with the problem; newer: of a newer PETSc."""
    lines = []
    for case in CASES:
        series = sorted((s for s in systems if s.case == case and s.ranks == 1), key=lambda s: s.n1)
        if len(series) < 2:
            continue
        heads = ["%s unknowns" % s.size() for s in series]
        others = sorted((s for s in newer if s.case == case), key=lambda s: s.n1)
        heads += ["%s, 3.25" % s.size() for s in others]
        lines += ["", "%s, seconds to 1e-6:" % CASES[case][0], "", "| | " + " | ".join(heads) + " |",
                  "|" + "---|" * (len(heads) + 1)]
        for solver in (solver for solver in series[0].rows if solver in SHOWN):
            lines.append("| %s | %s |" % (solver, " | ".join(seconds(s.seconds_to(solver, MIDDLE))
                                                             for s in series + others)))
    return lines


def pictures(folder):
    """Of all the CSVs of a folder, with seconds.csv; the systems."""
    systems = [System(path) for path in glob.glob(os.path.join(folder, "*-[0-9]*.csv"))]
    systems.sort(key=lambda s: (([OWN] + list(CASES)).index(s.case), s.n1, s.ranks))
    draw(systems, os.path.join(folder, "diagrams"))
    heat_map(systems, os.path.join(folder, "seconds"))
    measured.save(os.path.join(folder, "seconds.csv"), {}, SUMMARY, summary(systems))
    return systems


def show(folder):
    """The pictures, and a table for the terminal: the quickest first."""
    for system in pictures(folder):
        print("\n%s (%s)\n%-20s %15s %12s %11s" % (system.title(), system.about["sizes"].replace("=", " "), "solver",
                                                   "seconds to %.0e" % MIDDLE, "least error", "iterations"))
        lines = {line["solver"]: line for line in summary([system])}
        for solver in sorted(lines, key=lambda solver: system.seconds_to(solver, MIDDLE) or float("inf")):
            line = lines[solver]
            print("%-20s %15s %12s %11s %s" % (solver, line["seconds_to_%.0e" % MIDDLE] or "-",
                                               line["least_error"] or "-", line["iterations"] or "-", line["failure"]))
    print("\npictures: %s, %s" % tuple(os.path.join(folder, name) for name in ("diagrams.svg", "seconds.svg")))


def write(folder):
    systems, here = pictures(folder), os.path.basename(folder)
    text = ["## Other solvers: error against time", "", verdict(systems) + " All but `ainsworth_paper`, "
            "`ainsworth_gamg` and `mumps` use this plugin's multigrid with rigid-body modes.", "",
            "![Seconds to an error of 1e-6](%s/seconds.svg)" % here, "",
            "![Error against seconds, for each system](%s/diagrams.svg)" % here, "",
            "Seconds are set-up and solve, the error is that of x in the energy norm. Each point is one tolerance; a "
            "cross did not converge."]
    newer = [System(path) for path in glob.glob(os.path.join(folder, "3.25", "*-[0-9]*.csv"))]
    text += growth(systems, newer)
    loads = [float(system.about["load at the end"]) for system in systems]
    machines = dict.fromkeys(system.about["machine"] for system in systems)
    text += ["", "Made by `/usr/bin/python3 docs/study/refresh.py errortime` on %s, load %s. Solvers are files of "
             "[solvers/](../tests/bench/solvers); [seconds.csv](%s/seconds.csv) has seconds to %s, errors and "
             "memory, [%s/](%s) each point." % (
                 ", and ".join(machines),
                 "%.1f to %.1f" % (min(loads), max(loads)), here, ", ".join("%.0e" % level for level in LEVELS), here,
                 here) + "".join(" [Columns of 3.25](%s/3.25) are of %s." % (here, machine)
                                 for machine in dict.fromkeys(system.about["machine"] for system in newer))]
    prose.part(os.path.join(os.path.dirname(folder), "cost.md"), "errortime.py", text)
