"""A part of docs/scaling.md: counts from scaling.csv, seconds by the model of scaling.py."""
import csv
import os

from . import plots, prose
from .prose import head, line
from .scaling import MESSAGE, NUMBERS, RATE, chosen, ideal, iteration, levels_of, path, predicted_levels, reduction

# unknowns, ranks, rows of C: the paper's points, and the aim of a billion
AIMS = [(5.5e6, 512, 26.7e3), (42.5e6, 512, 107e3), (1e9, 12000, 0.88e6)]
ITERATIONS = {"alone": 9, "tied": 10}  # seen on 1 to 256 ranks
SURFACE_ROW = 9.0  # entries of a row of S
SHOWN = ("1", "8", "64", "256")  # ranks, in the first table
STEPS = 1          # of the polynomial, where the private side is not the stiffer one


def read(folder):
    with open(os.path.join(folder, "scaling.csv"), newline="") as file:
        return [row for row in csv.DictReader(file) if row["reason"].startswith("CONVERGED")]


def pick(rows, **key):
    return next((row for row in rows if all(row[name] == str(text) for name, text in key.items())), None)


def cycle_of(row):
    return {"w": chosen(levels_of(row)) if row["label"] == "now" else "W", "v": "V"}[row["cycles"][0]]


def counts(rows):
    """One line for each system and some numbers of ranks."""
    text = head("unknowns", "ranks", "iterations", "without constraints", "ranks of the levels",
                "busiest rank / even spread", "by the model", "messages a rank and iteration",
                "reductions of the set-up")
    shown = [row for row in rows if (row["label"], row["constraints"]) == ("now", "1") and row["ranks"] in SHOWN]
    for row in sorted(shown, key=lambda row: (int(row["unknowns"]), int(row["ranks"]))):
        ranks, alone = int(row["ranks"]), pick(rows, label="now", system=row["system"], constraints=0,
                                               ranks=row["ranks"])
        predicted = predicted_levels(float(row["unknowns"]), ranks, "now")
        over = ["%.1f" % (sum(path(levels, cycle)) / ideal(levels, ranks, cycle))
                for levels, cycle in ((levels_of(row), cycle_of(row)), (predicted, chosen(predicted)))]
        text.append(line(row["unknowns"], ranks, row["iterations"], alone["iterations"] if alone else "",
                         ", ".join("%d" % level[4] for level in levels_of(row)), *over,
                         "%.0f" % (float(row["solve_messages"]) / ranks / int(row["iterations"])),
                         "%.0f" % float(row["setup_reductions"])))
    return text


def rate(rows):
    """Entries a second of this machine, with which the model gives the seconds of 1 rank without constraints."""
    one = pick(rows, label="now", system="small", constraints=0, ranks=1)
    unit = sum(iteration(levels_of(one), 1, cycle_of(one), RATE, False).values())
    return RATE * unit * int(one["iterations"]) / float(one["solve"])


def validation(rows):
    """Predicted / measured seconds of solves on 1 and 2 ranks."""
    here, ratios = rate(rows), []
    for row in rows:
        if row["label"] == "now" and row["constraints"] == "0" and int(row["ranks"]) <= 2:
            predicted = int(row["iterations"]) * sum(
                iteration(levels_of(row), int(row["ranks"]), cycle_of(row), here, False).values())
            ratios.append((int(row["unknowns"]), int(row["ranks"]), predicted / float(row["solve"])))
    return here, ratios


def setup(rows, unknowns, ranks, rate_here):
    """Seconds of a set-up without constraints: that of one rank here, at the model's rate, for as many unknowns, and
    its reductions.
    """
    one, many = (pick(rows, label="now", system="small", constraints=0, ranks=1),
                 max((row for row in rows if row["label"] == "now" and row["constraints"] == "0"),
                     key=lambda row: int(row["ranks"])))
    return (float(one["setup"]) / float(one["unknowns"]) * unknowns / ranks * rate_here / RATE
            + float(many["setup_reductions"]) * reduction(ranks))


def projections(rows_of_c, ranks, unknowns):
    """Seconds of all projections by the polynomial, and by a factor: src/projection/polynomial.h. The surface is on
    ranks^(2/3) ranks.
    """
    surface = min(ranks, max(1.0, ranks ** (2 / 3)))
    entries, solvers = SURFACE_ROW * rows_of_c, -(-int(rows_of_c) // 25000)
    polynomial = NUMBERS["AinsworthProjectionsPolynomial"] * (
        (STEPS + 1) * entries / surface / RATE + 4 * (STEPS + 1) * MESSAGE)
    factor = 0.75 * (rows_of_c / solvers / 70.0) ** (1 / 3) * entries
    factored = rows_of_c / solvers * NUMBERS["AinsworthSecondsPerRow"] + NUMBERS["AinsworthProjectionsFactored"] * (
        2 * factor / solvers / RATE + 2 * surface / solvers * MESSAGE)
    return polynomial, factored


def totals(rows, here):
    """Of each aim: seconds without constraints and with, now and before."""
    found = []
    many = max((row for row in rows if row["label"] == "now" and row["constraints"] == "1"),
               key=lambda row: int(row["ranks"]))
    bare = pick(rows, label="now", system=many["system"], constraints=0, ranks=many["ranks"])
    more = float(many["setup_reductions"]) - float(bare["setup_reductions"])
    for unknowns, ranks, surface in AIMS:
        polynomial, factored = projections(surface, ranks, unknowns)
        today = predicted_levels(unknowns, ranks, "now")
        for rule in ("now", "before"):
            levels = predicted_levels(unknowns, ranks, rule)
            cycle = chosen(levels) if rule == "now" else "W"
            terms = iteration(levels, ranks, cycle, RATE, rule == "before")
            alone = dict({name: ITERATIONS["alone"] * seconds for name, seconds in terms.items()},
                         **{"set-up": setup(rows, unknowns, ranks, here)})
            tied = dict({name: ITERATIONS["tied"] * seconds for name, seconds in terms.items()},
                        **{"set-up": alone["set-up"] + more * reduction(ranks),
                           "S": polynomial if rule == "now" else factored})
            over = sum(path(levels, cycle)) / ideal(today, ranks, chosen(today))
            found.append((unknowns, ranks, surface, rule, alone, tied, over, levels))
    return found


def aims(found):
    text = head("unknowns / ranks, rows of C", "set-up", "levels", "S", "messages, reductions", "total", "/ A alone",
                "busiest rank / even spread")
    base = {(unknowns, ranks): sum(alone.values())
            for unknowns, ranks, _, rule, alone, _, _, _ in found if rule == "now"}
    for unknowns, ranks, surface, rule, alone, tied, over, _ in found:
        if rule != "now":
            continue
        level = sum(tied[name] for name in ("finest level", "coarser levels", "coarsest level"))
        text.append(line("%.3g / %d, %.3g" % (unknowns, ranks, surface), "%.2f" % tied["set-up"], "%.2f" % level,
                         "%.3f" % tied["S"], "%.3f" % (tied["messages"] + tied["reductions"]),
                         "%.2f" % sum(tied.values()), "%.2f" % (sum(tied.values()) / base[unknowns, ranks]),
                         "%.2f" % over))
    return text


def draw(folder, found):
    """Seconds by term, and the path level by level."""
    names = ["set-up", "finest level", "coarser levels", "coarsest level", "messages", "reductions", "S"]
    figure, panels = plots.pyplot.subplots(1, len(AIMS), figsize=(plots.WIDTH, 4))
    for panel, (unknowns, ranks, _) in zip(panels, AIMS):
        bars = ([("A alone", next(alone for u, r, _, rule, alone, _, _, _ in found
                                  if (u, r, rule) == (unknowns, ranks, "now")))]
                + [(rule, tied) for u, r, _, rule, _, tied, _, _ in found if (u, r) == (unknowns, ranks)])
        for place, (_, terms) in enumerate(bars):
            bottom = 0.0
            for number, name in enumerate(names):
                panel.bar(place, terms.get(name, 0.0), bottom=bottom, **plots.bar(number, name if place == 0 else None))
                bottom += terms.get(name, 0.0)
        panel.set_xticks(range(len(bars)))
        panel.set_xticklabels([name for name, _ in bars])
        panel.set_title("%.3g unknowns, %d ranks" % (unknowns, ranks))
    panels[0].set_ylabel("seconds, by the model")
    handles, labels = panels[0].get_legend_handles_labels()
    plots.legend_below(figure, dict(zip(labels, handles)))
    plots.save(figure, os.path.join(folder, "seconds"))
    figure, panels = plots.pyplot.subplots(1, len(AIMS), figsize=(plots.WIDTH, 3.6), sharey=True)
    for panel, (unknowns, ranks, _) in zip(panels, AIMS):
        for shift, rule, number in ((-0.2, "before", 1), (0.2, "now", 0)):
            levels = predicted_levels(unknowns, ranks, rule)
            entries = path(levels, chosen(levels) if rule == "now" else "W")
            panel.bar([level + shift for level in range(len(entries))], entries, width=0.4, **plots.bar(number, rule))
        panel.set_yscale("log")
        panel.set_xlabel("level")
        panel.set_title("%.3g unknowns, %d ranks" % (unknowns, ranks))
        panel.grid(True, axis="y", alpha=0.4)
    panels[0].set_ylabel("entries of the busiest rank in a cycle")
    panels[0].legend()
    figure.tight_layout()
    plots.save(figure, os.path.join(folder, "levels"))


def write(out):
    rows = read(out)
    here, ratios = validation(rows)
    found = totals(rows, here)
    os.makedirs(os.path.join(out, "scaling"), exist_ok=True)
    draw(os.path.join(out, "scaling"), found)
    # the seconds that count
    loads = [float(row["load"]) for row in rows if row["label"] == "now" and int(row["ranks"]) <= 2]
    text = ["Two cubes with 1225 and 3321 constraints, ranks that share two cores:", ""]
    text += counts(rows)
    others = sorted((int(row["ranks"]), row["iterations"])
                    for row in rows if (row["label"], row["constraints"], row["system"]) == ("now", "1", "small")
                    and row["ranks"] not in SHOWN)
    text += [
        "", "The smaller system takes %s iterations on %s "
        "ranks." % (", ".join(count for _, count in others), ", ".join("%d" % ranks for ranks, _ in others)), "",
        "**The model.** An iteration takes the entries that the busiest rank multiplies, level by level, over %.2g a "
        "second, and %.2g s for each message and each step of the tree of a reduction. "
        "With the rate of this machine, %.2g, solves of A alone take %s times the measured seconds, on 1 and 2 ranks. "
        "The path of the busiest rank is that of the model within a fifth at 9 000 unknowns a rank and more; at 5 000 "
        "it is 1.6 times as long, as METIS gives unequal shares." % (
            RATE, MESSAGE, here,
            "%.2f to %.2f" % (min(ratio for _, _, ratio in ratios), max(ratio for _, _, ratio in ratios))), "",
        "No cluster was at hand: these are predictions, of which ratios and the term that binds are claimed. *Before*, "
        "in the pictures, has a W-cycle, levels gathered below 150 nodes a rank, and S factored. Seconds:", ""]
    text += aims(found)
    text += ["", "![Seconds of each term](scaling/seconds.svg)", "",
             "![Entries of the busiest rank on each level](scaling/levels.svg)", "",
             "Made by `/usr/bin/python3 docs/study/scaling.py run`, *before* with `--label before --plugin FILE`, on "
             "%s, load %.1f to %.1f; [scaling.csv](scaling.csv) has all "
             "counts." % (rows[0]["machine"], min(loads), max(loads))]
    prose.part(os.path.join(out, "scaling.md"), "scaling.py", text)
