"""A part of docs/cost.md: every number comes from the CSV files in docs/results, those of the paper apart."""
import csv
import os

from . import charts, paper, prose
from .experiments import ALONE
from .measured import verdict

DEFAULT = "weighted auto"
SHOWN = ("128x16-contact", "2")  # size and ranks of the table and the picture over shares of the rows
FRACTIONS = ("0", "0.5", "1")  # in the table; the picture has all
COST_BOUND, COST_ITERATIONS = 1.35, 2


def read(folder, name):
    path = os.path.join(folder, name + ".csv")
    if not os.path.exists(path):
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def value(row, key):
    return float(row[key]) if row and row.get(key) else None


def good(row):
    return row is not None and row["reason"].startswith("CONVERGED")


def seconds(row):
    return value(row, "setup") + value(row, "solve")


def why(row):
    """In the place of the iterations."""
    if good(row):
        return row["iterations"]
    reason = row["reason"]
    return reason[7:].split(": ")[0] if reason.startswith("error: ") else reason.replace("DIVERGED_", "").lower()


def distinct(rows, key):
    return list(dict.fromkeys(row[key] for row in rows))


def pick(rows, **key):
    return next((row for row in rows if all(row[name] == text for name, text in key.items())), None)


def head(*columns):
    return ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]


def line(*cells):
    return "| " + " | ".join("" if cell is None else str(cell) for cell in cells) + " |"


def span(numbers, form="%.2f"):
    """From the least to the largest."""
    return " to ".join(dict.fromkeys(form % number for number in (min(numbers), max(numbers)))) if numbers else "?"


def pairs(rows, config=DEFAULT):
    """Rows of a configuration and those of A alone."""
    found = [(row, pick(rows, size=row["size"], ranks=row["ranks"], config=ALONE))
             for row in rows if row["config"] == config]
    return [(row, alone) for row, alone in found if good(row) and good(alone)]


def sizes(found):
    text = head("elements per edge", "unknowns", "constraints", "iterations, A alone", "set-up + solve [s]",
                "A alone [s]", "quotient")
    for row, alone in pairs(found.get("weak", [])) + pairs(found.get("strong", [])):
        text.append(line(row["size"], row["unknowns"], row["constraints"],
                         "%s, %s" % (row["iterations"], alone["iterations"]),
                         *("%s + %s" % (each["setup"], each["solve"]) for each in (row, alone)),
                         "%.2f" % (seconds(row) / seconds(alone))))
    return text


def shares(rows):
    size, ranks = SHOWN
    mine = [row for row in rows if (row["size"], row["ranks"]) == SHOWN]
    alone, none = pick(mine, config=ALONE), pick(mine, config=DEFAULT, fraction="0")
    text = head("share of the rows", "constraints", "iterations", "set-up [s]", "solve [s]", "/ A alone", "bounds")
    for row in sorted((row for row in mine if row["config"] == DEFAULT and good(row) and row["fraction"] in FRACTIONS),
                      key=lambda row: float(row["fraction"])):
        quotient = seconds(row) / seconds(alone)
        text.append(line(row["fraction"], row["constraints"], row["iterations"], row["setup"], row["solve"],
                         "%.2f" % quotient,
                         verdict(quotient <= COST_BOUND
                                 and abs(int(row["iterations"]) - int(none["iterations"])) <= COST_ITERATIONS)))
    return text


def points(found):
    """A sentence for each of the other experiments."""
    text = []
    if found.get("strong"):
        text += ["- *Memory.* The largest takes %s GiB, %s times that of A "
                 "alone." % tuple(span(numbers) for numbers in (
                     [value(row, "peak_mib") / 1024 for row, _ in pairs(found["strong"])],
                     [value(row, "peak_mib") / value(alone, "peak_mib") for row, alone in pairs(found["strong"])]))]
    if found.get("memory"):
        text[-1:] = [" ".join(text[-1:] + ["Smaller ones take %s times." %
            span([value(row, "peak_mib") / value(alone, "peak_mib") for row, alone in pairs(found["memory"])])])]
    if found.get("setup"):
        text.append("- *Set-up.* The plugin's own part is %s of multigrid's." % span(
            [value(row, "share") for row in found["setup"] if row["share"] and row["config"] == DEFAULT], "%.3f"))
    sizes_of = {size: [row for row in found.get("iterations", []) if (row["size"], row["config"]) == (size, DEFAULT)
                       and "-near_nullspace" in row["options"] and good(row)]
                for size in distinct(found.get("iterations", []), "size")}
    for size, mine in sizes_of.items():
        if mine:
            text.append("- *Ranks.* %s iterations on %s ranks (%s elements per "
                        "edge)." % (span([int(row["iterations"]) for row in mine], "%d"),
                                    span([int(row["ranks"]) for row in mine], "%d"), size))
    return text


def write(folder):
    here, names = (os.path.basename(folder),
                   ("strong", "weak", "cost", "flops", "setup", "iterations", "messages", "memory"))
    found = {name: rows for name, rows in ((name, read(folder, name)) for name in names) if rows}
    text = ["## Larger problems, more constraints", "",
            "The paper's experiments with the defaults: cubes, or flat boxes, of E2/E1 = 10, where 92 % of the surface "
            "sticks. With *contact* METIS knows which elements touch. " + paper.ITERATIONS, ""]
    text += sizes(found) + [""]
    if found.get("cost"):
        quotients = [seconds(row) / seconds(alone) for row, alone in pairs(found["cost"])]
        text += ["Over shares of the rows, on three partitions of 1.5 million unknowns, set-up and solve take %s times "
                 "the seconds of A alone. Bounds: %g, and %d more iterations. One of them, on %s ranks with "
                 "*contact*:" % (span(quotients), COST_BOUND, COST_ITERATIONS, SHOWN[1]), ""]
        text += shares(found["cost"]) + ["", "![Set-up and solve over the share of the "
                                         "rows](%s/%s.svg)" % (here, charts.cost_name(*SHOWN)), ""]
        charts.cost(folder, found["cost"], SHOWN)
    text += points(found)
    every = [row for rows in found.values() for row in rows]
    loads = [float(row["load"]) for row in every]
    text += ["", "Made by `python3 docs/study/results.py %s` on %s, load %.1f to %.1f; each row of the CSVs in "
             "[%s/](%s) has its command and load." % (
                 "`, `".join(found), "; ".join(distinct(every, "machine")), min(loads), max(loads), here, here)]
    prose.part(os.path.join(os.path.dirname(folder), "cost.md"), "results.py", text)
