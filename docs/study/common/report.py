"""The study in words, tables and plots. Every number comes from the CSV."""
import os
import statistics

from . import measured, prose

ALONE = "alone"
SAME = "alone, same x"
BEST = "weighted auto"
PAPER = "paper jcb"
TITLES = {ALONE: "A alone", SAME: "A alone, same x"}
PLOTTED = (ALONE, BEST, "weighted jcb", PAPER)
STYLES = {ALONE: ("k", "--", "o", "none"), BEST: ("#0072b2", "-", "s", "full"), "weighted jcb": ("#009e73", "-.", "^", "none"), PAPER: ("#d55e00", ":", "D", "full")}


class Study:
    def __init__(self, path):
        self.about, self.rows = measured.read(path)
        for row in self.rows:
            for key in ("iterations", "unknowns", "constraints"):
                row[key] = int(row[key]) if row[key] else None
            for key in ("setup", "solve", "error", "constraint", "primal"):
                row[key] = float(row[key]) if row[key] else None
            row["converged"] = row["reason"].startswith("CONVERGED") and "," not in row["reason"]
            row["seconds"] = None if row["setup"] is None else row["setup"] + row["solve"]
        self.parameters = list(dict.fromkeys(row["parameter"] for row in self.rows))
        self.configurations = list(dict.fromkeys(row["configuration"] for row in self.rows))
        self.index = {(row["parameter"], row["value"], row["configuration"]): row for row in self.rows}

    def values(self, parameter):
        return list(dict.fromkeys(row["value"] for row in self.rows if row["parameter"] == parameter))

    def get(self, parameter, value, configuration):
        return self.index.get((parameter, value, configuration))

    def systems(self, configuration):
        """One row per system, the base not counted once per parameter."""
        return list({row["options"]: row for row in self.rows if row["configuration"] == configuration}.values())

    def relative(self, row, key, to=ALONE):
        """This row's iterations or seconds divided by those of A alone."""
        other = self.get(row["parameter"], row["value"], to)
        if not other or not other["converged"] or not row["converged"] or not other[key]:
            return None
        return row[key] / other[key]


def name(row):
    return "%s %s" % (row["parameter"], row["value"])


def title(configuration):
    return TITLES.get(configuration, configuration)


def cell(row):
    if row is None:
        return ""
    if row["converged"]:
        return str(row["iterations"])
    reason = row["reason"]
    if reason.startswith("n/a"):
        return "n/a"
    if "MAX_IT" in reason or "DIVERGED_ITS" in reason:
        return "> %d" % row["iterations"]
    return "**%s**" % reason.replace("DIVERGED_", "").lower().replace("_", " ")


def spread(numbers, form="%.2f"):
    return "%s (median), %s (worst)" % (form % statistics.median(numbers), form % max(numbers))


def sentences(study):
    weighted, paper = study.systems(BEST), study.systems(PAPER)
    worked = [row for row in weighted if row["converged"]]
    quotients = [(study.relative(row, "iterations"), row) for row in worked]
    quotients = [(q, row) for q, row in quotients if q is not None]
    worst = max(quotients, key=lambda pair: pair[0])
    above = [row for q, row in quotients if q > 1.25]
    answer = []
    text = "With the defaults (weighted, `auto`) %d of %d systems converge, in %d to %d iterations; divided by those of A alone: %s, the worst at %s; " % (
        len(worked), len(weighted), min(r["iterations"] for r in worked), max(r["iterations"] for r in worked), spread([q for q, _ in quotients]), name(worst[1]))
    lost = [row for row in weighted if not row["converged"]]
    text += "more than 1.25 times A alone: " + ", ".join(name(r) for r in above) if above else "none needs more than 1.25 times A alone"
    answer.append(text + ("; no convergence: " + ", ".join(name(r) for r in lost) if lost else "") + ".")
    same = [q for q in (study.relative(row, "iterations", SAME) for row in worked) if q is not None]
    if same:
        answer.append("A alone is solved with the program's right-hand side, as `twocubes -contact 0` does, whose solution is simple; when A alone has to find the very x of the constrained problem, the same quotient is %s." % spread(same))
    good = [row for row in paper if row["converged"]]
    bad = [row for row in paper if not row["converged"]]
    quotients = [q for q in (study.relative(row, "iterations") for row in good) if q is not None]
    text = "The paper's form (`paper`, `jcb`) converges on %d of %d, in %d to %d iterations, %s times those of A alone" % (
        len(good), len(paper), min(r["iterations"] for r in good), max(r["iterations"] for r in good), spread(quotients))
    answer.append(text + ("; it fails at " + ", ".join(name(r) for r in bad) + "." if bad else "."))
    errors = [row for row in worked if row["error"] is not None]
    high = max(errors, key=lambda row: row["error"])
    paper_high = max((row for row in good if row["error"] is not None), key=lambda row: row["error"])
    constraint = max(worked, key=lambda row: row["constraint"] or 0)
    answer.append("The relative energy error against the direct solution, at rtol 1e-8 in the natural norm, is at most %.1e (%s) with the defaults and %.1e (%s) with the paper's form where it converges; C x = g holds to %.1e (%s)." % (
        high["error"], name(high), paper_high["error"], name(paper_high), constraint["constraint"], name(constraint)))
    times = [q for q in (study.relative(row, "seconds") for row in worked) if q is not None]
    each = []
    for configuration in study.configurations:
        if configuration.startswith("weighted ") and configuration != BEST:
            rows = study.systems(configuration)
            part = [q for q in (study.relative(row, "iterations") for row in rows) if q is not None]
            failed = sum(not row["converged"] for row in rows)
            if part:
                each.append("`%s` %.2f%s" % (configuration.split()[1], max(part), " and %d failures" % failed if failed else ""))
    answer.append("Set-up and solve together take %s times as long as those of A alone on these small systems (docs/overhead.md has larger ones); the worst iterations of the other preconditioning matrices, weighted, divided by those of A alone: %s." % (spread(times), ", ".join(each)))
    return answer


def table(study, parameter):
    configurations = [c for c in study.configurations if any(study.get(parameter, v, c) for v in study.values(parameter))]
    lines = ["| " + " | ".join([parameter] + [title(c) for c in configurations]) + " |", "|" + "---|" * (len(configurations) + 1)]
    for value in study.values(parameter):
        lines.append("| " + " | ".join([value] + [cell(study.get(parameter, value, c)) for c in configurations]) + " |")
    worst = []
    for c in configurations:
        errors = [row["error"] for row in (study.get(parameter, v, c) for v in study.values(parameter)) if row and row["converged"] and row["error"] is not None]
        worst.append("%.0e" % max(errors) if errors else "")
    lines.append("| *worst energy error* | " + " | ".join(worst) + " |")
    return lines


def time_table(study):
    """Per configuration, over all systems where it and A alone converge."""
    lines = ["| | converged | iterations / A alone: median | worst | seconds / A alone: median | worst | worst energy error | worst constraint residual |", "|" + "---|" * 8]
    for c in study.configurations:
        rows = study.systems(c)
        if c in (ALONE, SAME):
            rows = [row for row in rows if not row["reason"].startswith("n/a")]
        its = [q for q in (study.relative(row, "iterations") for row in rows) if q is not None]
        times = [q for q in (study.relative(row, "seconds") for row in rows) if q is not None]
        errors = [row["error"] for row in rows if row["converged"] and row["error"] is not None]
        residuals = [row["constraint"] for row in rows if row["converged"] and row["constraint"] is not None]
        lines.append("| %s | %d of %d | %s | %s | %s | %s | %s | %s |" % (
            title(c), sum(row["converged"] for row in rows), len(rows),
            "%.2f" % statistics.median(its) if its else "", "%.2f" % max(its) if its else "",
            "%.2f" % statistics.median(times) if times else "", "%.2f" % max(times) if times else "",
            "%.0e" % max(errors) if errors else "", "%.0e" % max(residuals) if residuals else ""))
    return lines


def plot(study, folder, file_name, what, top, label):
    from . import plots
    columns = 3
    count = -(-len(study.parameters) // columns)
    figure, axes = plots.pyplot.subplots(count, columns, figsize=(4.2 * columns, 2.9 * count), squeeze=False)
    panels = [axes[i // columns][i % columns] for i in range(count * columns)]
    for panel, parameter in zip(panels, study.parameters):
        values = study.values(parameter)
        for configuration in PLOTTED:
            color, line, marker, fill = STYLES[configuration]
            points, failed = [], []
            for i, value in enumerate(values):
                row = study.get(parameter, value, configuration)
                y = what(study, row) if row and row["converged"] else None
                points.append(float("nan") if y is None else y)
                if row and not row["converged"] and not row["reason"].startswith("n/a"):
                    failed.append(i)
            panel.plot(range(len(values)), points, color=color, linestyle=line, marker=marker, fillstyle=fill, markersize=5, label=title(configuration))
            if failed:
                panel.plot(failed, [top] * len(failed), color=color, linestyle="none", marker="x", markersize=8)
        panel.set_yscale("log")
        panel.set_xticks(range(len(values)))
        panel.set_xticklabels(values, fontsize=7)
        panel.set_title(parameter, fontsize=9)
        panel.grid(True, which="major", alpha=0.4)
        low, high = panel.get_ylim()
        if what is iterations:
            panel.set_ylim(min(low, 5), max(high, 100))
        else:
            panel.set_ylim(min(low, 0.7), max(high, 10))
    for panel in panels[len(study.parameters):]:
        panel.set_visible(False)
    for row in axes:
        row[0].set_ylabel(label, fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=len(labels), fontsize=9, title="x: no convergence", title_fontsize=8)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    plots.save(figure, os.path.join(folder, file_name))


def iterations(study, row):
    return row["iterations"]


def seconds(study, row):
    return study.relative(row, "seconds")


def write(folder):
    study = Study(os.path.join(folder, "stability.csv"))
    here = os.path.basename(folder)
    plot(study, folder, "iterations", iterations, 1000, "iterations")
    plot(study, folder, "seconds", seconds, 100, "set-up + solve / A alone")
    text = ["# How stable the iterations are", ""]
    text += [line + "\n" for line in sentences(study)]
    earlier = ", the other configurations by an earlier run without `--only`" if "--only" in study.about["command"] else ""
    text += ["Made by `%s`%s (this text too: every number in it comes from [%s/stability.csv](%s/stability.csv)) on %s, load %s." % (
        study.about["command"], earlier, here, here, study.about["machine"], study.about["load at the end"]), ""]
    base = next(row for row in study.rows if row["parameter"] == "E2/E1" and row["unknowns"])
    text += ["Two cubes (`tutorials/benchmark/twocubes.cpp`), around a base of %d unknowns and %d constraints with E2/E1 = 10, Poisson's ratio 0.3, half of the contact surface sticking and the other half slipping; one parameter is changed at a time." % (
        base["unknowns"], base["constraints"]),
             "All run on one rank, `-ksp_type preonly -pc_type ainsworth` and the two options named in the head of the column; block smoothed aggregation with rigid-body modes, rtol 1e-8 in the natural norm, at most `--max-it` iterations (default 1000); the paper's form has BoomerAMG with Falgout coarsening and hybrid Gauss-Seidel, as the plugin's defaults do.",
             "*A alone* is the same matrix without constraints, with the same right-hand side and the same inner solver; *A alone, same x* has the right-hand side that gives the solution of the constrained problem. A floating body leaves A alone singular: n/a. Duplicated rows, E2/E1 of 1e-12 and other extremes, against other solvers: [extremes.md](extremes.md).",
             "The energy error is sqrt((x-x\\*)'A(x-x\\*) / x\\*'A x\\*), x\\* from MUMPS on the saddle-point matrix with refinement in extended precision. Seconds are the least of the repetitions (`--repeat`); a run of more than two seconds is not repeated.", ""]
    text += ["![Iterations over each parameter](%s/iterations.svg)" % here, "", "![Set-up and solve relative to A alone](%s/seconds.svg)" % here, "", "## All systems together", ""]
    text += time_table(study) + ["", "## Iterations, one parameter at a time", ""]
    for parameter in study.parameters:
        text += table(study, parameter) + [""]
    prose.write(folder + ".md", text)
    print("wrote %s.md" % folder)
