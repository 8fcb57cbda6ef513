"""The study in words, tables and plots. Every number comes from the CSV."""
import os
import statistics

from . import measured, prose

ALONE = "alone"
BEST = "weighted auto"
PAPER = "paper jcb"
TITLES = {ALONE: "A alone"}
PLOTTED = (BEST, ALONE, "weighted jcb", PAPER)


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
        """This row's iterations or seconds divided by those of A alone; one iteration of A alone is a factorization,
        which has none to compare.
        """
        other = self.get(row["parameter"], row["value"], to)
        if (not other or not other["converged"] or not row["converged"] or not other[key]
                or (key == "iterations" and other[key] == 1)):
            return None
        return row[key] / other[key]


def name(row):
    return "%s %s" % (row["parameter"], row["value"])


def title(configuration):
    return TITLES.get(configuration, configuration)


def spread(numbers, form="%.2f"):
    return "%s (median) to %s (worst)" % (form % statistics.median(numbers), form % max(numbers))


def sentences(study):
    """From the data of this run."""
    weighted, paper = study.systems(BEST), study.systems(PAPER)
    worked, good = ([row for row in rows if row["converged"]] for rows in (weighted, paper))
    quotients = [(q, row) for q, row in ((study.relative(row, "iterations"), row) for row in worked) if q is not None]
    answer = ["- The defaults converge on %d of %d systems, in %d to %d iterations, %s times those of A alone (%s)." % (
        len(worked), len(weighted), min(r["iterations"] for r in worked), max(r["iterations"] for r in worked),
        spread([q for q, _ in quotients]), name(max(quotients, key=lambda pair: pair[0])[1]))]
    factored = [row for row in study.systems(ALONE) if row["iterations"] == 1]
    if factored:
        answer[0] = answer[0][:-1] + ", but for %s, where A alone is factored." % ", ".join(map(name, factored))
    lost = [row for row in weighted if not row["converged"]]
    if lost:
        answer.append("- They do not converge for: %s." % "; ".join(map(name, lost)))
    high, constraint = (max((row for row in worked if row["error"] is not None), key=lambda row: row["error"]),
                        max(worked, key=lambda row: row["constraint"] or 0))
    answer.append("- The energy error is at most %.1e (%s). C x = g holds to %.1e "
                  "(%s)." % (high["error"], name(high), constraint["constraint"], name(constraint)))
    bad = [row for row in paper if not row["converged"]]
    text = "- The paper's variant (`jcb`) converges on %d of %d, in %s times the iterations of A alone." % (
        len(good), len(paper),
        spread([q for q in (study.relative(row, "iterations") for row in good) if q is not None]))
    answer.append("- Set-up and solve take %s times the seconds of A "
                  "alone." % spread([q for q in (study.relative(row, "seconds") for row in worked) if q is not None]))
    return answer + [text + (" It fails for: %s." % "; ".join(map(name, bad)) if bad else "")]


def draw(study, folder):
    """Every system across, in groups of the parameter that is changed; down: iterations, seconds, and the error."""
    from . import plots
    places, ticks, edges = {}, [], []
    for parameter in study.parameters:
        first = len(places) + len(edges)
        for value in study.values(parameter):
            places[parameter, value] = len(places) + len(edges)
        ticks.append((first + len(places) + len(edges) - 1) / 2)
        edges.append(len(places) + len(edges))
    figure, panels = plots.pyplot.subplots(3, 1, figsize=(plots.WIDTH, 10), sharex=True)
    handles = {}
    for panel, (label, what, top) in zip(panels, (
            ("iterations", lambda row: row["iterations"], 1000),
            ("(set-up + solve) / A alone", lambda row: study.relative(row, "seconds"), 100),
            ("relative energy error", lambda row: row["error"], 1))):
        for number, configuration in enumerate(PLOTTED):
            how = plots.style(number, title(configuration))
            for parameter in study.parameters:
                known = [(places[parameter, value], study.get(parameter, value, configuration))
                         for value in study.values(parameter)]
                points = [(x, what(row)) for x, row in known if row and row["converged"] and what(row)]
                drawn, = panel.plot([x for x, _ in points], [y for _, y in points], **how)
                handles[title(configuration)] = drawn
                lost = [x for x, row in known if row and not row["converged"] and not row["reason"].startswith("n/a")]
                panel.plot(lost, [top] * len(lost), **dict(how, linestyle="none"))
        panel.set_yscale("log")
        panel.set_ylabel(label)
        panel.grid(True, axis="y", which="major", alpha=0.4)
        for edge in edges[:-1]:
            panel.axvline(edge, color="0.8", linewidth=0.8)
    panels[-1].set_xticks(ticks)
    panels[-1].set_xticklabels(["%s: %s to %s" % (parameter, study.values(parameter)[0], study.values(parameter)[-1])
            for parameter in study.parameters], rotation=35, ha="right")
    panels[0].set_title("at the upper edge: no convergence")
    plots.legend_below(figure, handles)
    plots.save(figure, os.path.join(folder, "stability"))


def write(folder):
    study = Study(os.path.join(folder, "stability.csv"))
    here = os.path.basename(folder)
    draw(study, folder)
    base = next(row for row in study.rows if row["parameter"] == "E2/E1" and row["unknowns"])
    earlier = (", the other configurations by an earlier run without `--only`" if "--only" in study.about["command"]
               else "")
    text = ["One parameter at a time changes, from two cubes of %d unknowns, E2/E1 = 10, tolerance "
            "1e-8:" % base["unknowns"], ""] + sentences(study)
    text += ["", "![Iterations, seconds and errors of every system](%s/stability.svg)" % here]
    text += ["", "The energy error is that of x against MUMPS, refined in extended precision. Made by `%s`%s on %s, 1 "
             "rank, load %s; [stability.csv](%s/stability.csv) has each system, and other M_*." % (
                 study.about["command"], earlier, study.about["machine"], study.about["load at the end"], here)]
    prose.part(os.path.join(os.path.dirname(folder), "cost.md"), "stability.py", text)
