"""docs/results.md: every number comes from the CSV files, those of the paper apart."""
import csv
import os

from . import charts, paper, prose
from .experiments import ALONE
from .measured import verdict

DEFAULT = "weighted id"  # what auto chooses on a flat interface
SPREAD, ALONE_BOUND, COST_BOUND, COST_ITERATIONS, FLOPS_BOUND, SHARE_BOUND, MEMORY_BOUND, STRONG_MEMORY = 1, 1.25, 1.35, 2, 1.05, 0.15, 1.15, 24


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


def made_by(name, rows):
    """The commands, what they ran on, and how loaded that was."""
    loads = [float(row["load"]) for row in rows]
    former = [row for row in rows if "-near_nullspace" not in row.get("options", "") and "variant paper" not in row["options"] and row.get("setup")]
    note = " Rows whose options in the CSV lack `-near_nullspace` used BoomerAMG (PMIS, Chebyshev), the former default." if former else ""
    return "- %s: %s; %s; load %.1f to %.1f.%s" % (name, ", ".join("`%s`" % text for text in distinct(rows, "command")), "; ".join(distinct(rows, "machine")), min(loads), max(loads), note)


def span(row, key):
    """Mean (least to most) of the ranks that have rows."""
    total = {"A": "unknowns"}.get(key, "constraints")
    ranks = int(row[key + "_ranks"])
    return "%.0f (%s to %s)" % (int(row[total]) / ranks if ranks else 0, row[key + "_least"], row[key + "_most"])


def table(rows, here):
    text = ["## Distribution over many ranks (5.2, table 2)", "",
            "All figures come from the METIS partition of the volume meshes alone (`tests/bench/partitiontable.cpp`); no system is assembled. Each row of C, and of S = C W C', is on the rank of its secondary node. Rows are given as mean (least to most) over the ranks that have some. The second table of each size predicts messages and bytes of one projection x - W C' S^-1 C x. A solve with S on one rank sends nothing itself.", "",
            "- *Spread*: C stays where the program has it. Neighbors exchange x, C x goes to the ranks that solve with S, the solution comes back, and neighbors exchange W C' t.",
            "- *Together*: the rows of C are on the ranks that solve with S. Every rank with constrained unknowns sends them there and gets their change back.",
            "", "![Rows and messages](%s/table.svg)" % here, ""]
    for size in distinct(rows, "size"):
        mine = [row for row in rows if row["size"] == size]
        beside = size.split(":")[0] == str(paper.TABLE2_EDGE)
        text += ["### %s: %s unknowns, %s constraints" % (size, mine[0]["unknowns"], mine[0]["constraints"]), ""]
        text += head("ranks", "rows of A per rank", *(["paper"] if beside else []), "ranks with rows of S", *(["paper"] if beside else []), "rows of S on each", *(["paper"] if beside else []), "regrouped on", "rows on each")
        for row in mine:
            ranks, other = int(row["ranks"]), paper.TABLE2.get(int(row["ranks"])) if beside else None
            cells = [ranks, span(row, "A")] + ([other[0] if other else ""] if beside else [])
            cells += ["%s (%.0f %%)" % (row["C_ranks"], 100 * int(row["C_ranks"]) / ranks)] + (["%d (%.0f %%)" % (other[1], 100 * other[1] / ranks) if other else ""] if beside else [])
            cells += [span(row, "C")] + (["%d (%d to %d)" % other[2:] if other else ""] if beside else []) + [row["grouped_ranks"], span(row, "grouped")]
            text.append(line(*cells))
        text += [""] + head("ranks", "spread: messages", "kB", "at the busiest rank", "together: messages", "kB", "at the busiest rank")
        for row in mine:
            text.append(line(row["ranks"], row["spread_messages"], "%.0f" % (int(row["spread_bytes"]) / 1000), row["spread_busiest"], row["together_messages"], "%.0f" % (int(row["together_bytes"]) / 1000), row["together_busiest"]))
        text.append("")
    return text


def strong(rows, here):
    text = ["## One large problem (5.2)", "", paper.STRONG + " Bounds: at most %g times the iterations of A alone, and %d GiB. Peak memory is the sum over the ranks of the most that each had." % (ALONE_BOUND, STRONG_MEMORY), ""]
    text += head("size", "ranks", "", "unknowns", "constraints", "iterations", "/ A alone", "set-up [s]", "solve [s]", "/ A alone", "peak memory [GiB]", "/ A alone", "bounds")
    for row in rows:
        alone = pick(rows, size=row["size"], ranks=row["ranks"], config=ALONE)
        cells = [row["size"], row["ranks"], row["config"], row["unknowns"], row["constraints"], why(row)]
        if good(row) and good(alone) and row is not alone:
            quotient = int(row["iterations"]) / int(alone["iterations"])
            cells += ["%.2f" % quotient, row["setup"], row["solve"], "%.2f" % (seconds(row) / seconds(alone)), "%.2f" % (value(row, "peak_mib") / 1024), "%.2f" % (value(row, "peak_mib") / value(alone, "peak_mib")),
                      verdict(quotient <= ALONE_BOUND and value(row, "peak_mib") <= 1024 * STRONG_MEMORY)]
        else:
            cells += ["", row["setup"], row["solve"], "", "%.2f" % (value(row, "peak_mib") / 1024) if value(row, "peak_mib") else "", "", ""]
        text.append(line(*cells))
    return text + [""]


def memory(rows, here):
    configs = [config for config in distinct(rows, "config") if config != ALONE]
    text = ["## Peak memory", "", "Bound: %g times that of A alone. `jcb` couples more unknowns than `id`, so the operators of all levels are larger, most of all where the contact surface is a large part of a flat body ([method.md](method.md))." % MEMORY_BOUND, ""]
    text += head("size", "ranks", "unknowns", "constraints", "A alone [GiB]", *(title for config in configs for title in (config + " [GiB]", "/ A alone", "bound")))
    for size, ranks in dict.fromkeys((row["size"], row["ranks"]) for row in rows):
        alone, cells = pick(rows, size=size, ranks=ranks, config=ALONE), []
        for row in (pick(rows, size=size, ranks=ranks, config=config) for config in configs):
            quotient = value(row, "peak_mib") / value(alone, "peak_mib") if good(row) and good(alone) else None
            cells += ["%.2f" % (value(row, "peak_mib") / 1024), "%.2f" % quotient, verdict(quotient <= MEMORY_BOUND)] if quotient else [why(row) if row else "", "", ""]
        constrained = pick(rows, size=size, ranks=ranks, config=configs[0])
        text.append(line(size, ranks, alone["unknowns"], constrained["constraints"], "%.2f" % (value(alone, "peak_mib") / 1024), *cells))
    return text + [""]


def weak(rows, here):
    text = ["## Finer meshes (5.3)", "", paper.WEAK, "", "Here the number of ranks is fixed, and seconds are divided by the unknowns of a rank.", "", "![Iterations and seconds per unknown](%s/weak.svg)" % here, ""]
    text += head("size", "ranks", "", "unknowns", "constraints", "iterations", "set-up [us per unknown of a rank]", "solve [us per unknown of a rank]")
    for row in rows:
        share = 1e6 * int(row["ranks"]) / int(row["unknowns"]) if row["unknowns"] else None
        text.append(line(row["size"], row["ranks"], row["config"], row["unknowns"], row["constraints"], why(row), *("%.1f" % (share * value(row, key)) if good(row) else "" for key in ("setup", "solve"))))
    return text + [""]


def cost(rows, here):
    text = ["## Cost against the number of constraints (5.4)", "", paper.COST, "",
            "Bounds for the defaults (weighted; `auto` takes `id` here): set-up and solve take at most %g times the seconds of A alone, and iterations differ from those of the share 0 by at most %d." % (COST_BOUND, COST_ITERATIONS), "",
            "If METIS partitions the volume meshes alone, the whole contact surface may lie between ranks. Then the coarse matrices of M_* are multiplied across ranks, but not those of A alone, whose bodies do not meet. With `-contact` (`-partition contact`) METIS knows which elements touch, as a partition of the graph of A + C'C does. We recommend this. *Volumes cut* compares with A alone on the other partition, which is better for it. `paper` has BoomerAMG (Falgout coarsening, hybrid Gauss-Seidel), A alone and `weighted` have block smoothed aggregation. The plugin's own part of the set-up is [below](#where-the-set-up-goes).", ""]
    lines, pictures = [], []
    for size in distinct(rows, "size"):
        for ranks in distinct([row for row in rows if row["size"] == size], "ranks"):
            mine = [row for row in rows if (row["size"], row["ranks"]) == (size, ranks)]
            alone = pick(mine, config=ALONE)
            if not good(alone):
                continue
            volumes = pick(rows, size=size.removesuffix("-contact"), ranks=ranks, config=ALONE)
            pictures.append("![Set-up and solve, %s on %s rank%s](%s/%s.svg)" % (size, ranks, "" if ranks == "1" else "s", here, charts.cost_name(size, ranks)))
            none = pick(mine, config=DEFAULT, fraction="0")
            for row in sorted((row for row in mine if row["config"] == DEFAULT), key=lambda row: float(row["fraction"])):
                quotient = seconds(row) / seconds(alone) if good(row) else None
                held = verdict(good(row) and quotient <= COST_BOUND and abs(int(row["iterations"]) - int(none["iterations"])) <= COST_ITERATIONS) if good(none) else ""
                lines.append(line(size, ranks, alone["unknowns"], row["fraction"], row["constraints"], why(row), alone["iterations"], row["setup"], row["solve"], "%.2f" % quotient if quotient else "",
                                  "%.2f" % (seconds(row) / seconds(volumes)) if quotient and volumes is not alone and good(volumes) else "", held))
    text += head("size", "ranks", "unknowns", "share of the rows", "constraints", "iterations", "A alone", "set-up [s]", "solve [s]", "(set-up + solve) / A alone", "/ A alone, volumes cut", "bounds") + lines
    text += ["", "[cost.csv](%s/cost.csv) has the other preconditioning matrices and the paper's form, which the pictures show." % here, ""] + [part for picture in pictures for part in (picture, "")]
    return text


def edge(size):
    return size.split("-")[0].split(":")[0].split("x")


def flops(rows, here):
    sizes = sorted(distinct(rows, "size"), key=lambda size: [int(part) for part in edge(size)])
    growths = {}
    text = ["## Operations in the assembly of M_*", "", "Floating-point operations per row of C, as `-log_view` counts them in the plugin's events of the set-up: all ranks together, without the factorization of S.", "",
            "![Operations](%s/flops.svg)" % here, ""] + head("", *sizes)
    for config in distinct(rows, "config"):
        cells = []
        for size in sizes:
            row = pick(rows, config=config, size=size)
            first = next((other for other in (pick(rows, config=config, size=other) for other in sizes if edge(other)[0] == edge(size)[0]) if other), None)
            if row is not None and row is not first and value(row, "all") and value(first, "all"):
                variant = config.split()[0]
                growths[variant] = max(growths.get(variant, 0.0), value(row, "all") / value(first, "all"))
            cells.append("" if row is None else "%.0f" % (value(row, "all") / int(row["constraints"])) if value(row, "all") else "refused")
        text.append(line(config, *cells))
    held = "; ".join("`%s` %.3f (%s)" % (variant, growth, verdict(growth <= FLOPS_BOUND)) for variant, growth in growths.items())
    text += ["", "If only the volume grows, operations grow at most by these factors, with the bound %g: %s. The penalty of `paper` takes a norm of the whole matrix, that of `weighted` only the rows of C. *Refused*: the types `cc` and `cg` may give a dense matrix. [flops.csv](%s/flops.csv) has each event." % (FLOPS_BOUND, held, here)]
    return text + [""]


def setup(rows, here):
    known = ("size", "ranks", "config", "unknowns", "constraints", "reason", "ours", "PCSetUp", "amg", "share", "alone", "options", "load", "machine", "command")
    names = [column for column in dict.fromkeys(column for row in rows for column in row) if column not in known]
    text = ["## Where the set-up goes", "", "Seconds on the slowest rank. *Ours* is the sum of the plugin's events of the set-up, *multigrid's* the rest of PCSetUp; the bound of their quotient is %g. *A alone* is PCSetUp without constraints, that is, multigrid on A." % SHARE_BOUND, ""]
    text += head("size", "ranks", "", "unknowns", *names, "ours", "PCSetUp", "multigrid's", "ours / multigrid's", "bound", "A alone", "PCSetUp / A alone")
    for row in rows:
        cells = [row["size"], row["ranks"], row["config"], row["unknowns"]] + [row.get(name) for name in names]
        if row.get("share"):
            cells += [row["ours"], row["PCSetUp"], row["amg"], row["share"], verdict(value(row, "share") <= SHARE_BOUND), row["alone"], "%.2f" % (value(row, "PCSetUp") / value(row, "alone"))]
        else:
            cells += [why(row)] + 6 * [""]
        text.append(line(*cells))
    return text + [""]


def iterations(rows, here):
    text = ["## Iterations on more and more ranks", "", "Bound: a difference of at most %d from the fewest ranks. Aggregates do not cross ranks, so iterations depend on the partition." % SPREAD, ""]
    for size in distinct(rows, "size"):
        mine = [row for row in rows if row["size"] == size]
        ranks = sorted(distinct(mine, "ranks"), key=int)
        text += head(size, *("%s rank%s" % (r, "" if r == "1" else "s") for r in ranks), "bound")
        for config in distinct(mine, "config"):
            found = [row for row in (pick(mine, config=config, ranks=r) for r in ranks) if row]
            held = all(map(good, found)) and all(abs(int(row["iterations"]) - int(found[0]["iterations"])) <= SPREAD for row in found)
            cells = [why(row) if row else "" for row in (pick(mine, config=config, ranks=r) for r in ranks)]
            text.append(line(config, *cells, "" if config == ALONE else verdict(held)))
        text.append("")
    return text


def messages(rows, here):
    text = ["## Messages and reductions of a projection", "", "From `-log_view`, all ranks together: the difference between a long and a short solve, divided by the difference of their projections. A projection has one solve with S. *Predicted* is from the partition, as [above](#distribution-over-many-ranks-52-table-2).", ""]
    text += head("size", "ranks", "", "constraints", "messages", "bytes", "reductions", "of them in the solve with S: messages", "bytes", "reductions", "predicted, spread: messages, bytes", "predicted, together: messages, bytes")
    for row in rows:
        cells = [row.get(event + "_" + what, "") for event in ("AinsProjector", "AinsGramSolve") for what in ("messages", "bytes", "reductions")]
        cells += ["%s, %s" % (row[layout + "_messages"], row[layout + "_bytes"]) if row.get(layout + "_messages") else "" for layout in ("spread", "together")]
        text.append(line(row["size"], row["ranks"], row["config"], row["constraints"], *cells))
    return text + [""]


SECTIONS = {"table": table, "strong": strong, "weak": weak, "cost": cost, "flops": flops, "setup": setup, "iterations": iterations, "messages": messages, "memory": memory}


def span_of(numbers):
    low, high = min(numbers), max(numbers)
    return str(low) if low == high else "%s to %s" % (low, high)


def answers(found):
    """What the page begins with."""
    text = []
    mine = {name: [row for row in rows if row.get("config") == DEFAULT and good(row)] for name, rows in found.items() if rows and "reason" in rows[0]}
    if mine.get("strong"):
        row = max(mine["strong"], key=lambda row: int(row["unknowns"]))
        text.append("- One large problem: %s unknowns and %s constraints take %s iterations on %s ranks. %s" % (row["unknowns"], row["constraints"], row["iterations"], row["ranks"], paper.STRONG))
    if mine.get("weak"):
        text.append("- Finer meshes: %s iterations from %s to %s unknowns." % ((span_of([int(row["iterations"]) for row in mine["weak"]]),) + tuple(limit(int(row["unknowns"]) for row in mine["weak"]) for limit in (min, max))))
    quotients = [seconds(row) / seconds(alone) for row, alone in ((row, pick(found["cost"], size=row["size"], ranks=row["ranks"], config=ALONE)) for row in mine.get("cost", ())) if good(alone)]
    if quotients:
        text.append("- More constraints: set-up and solve take %.2f to %.2f times the seconds of A alone." % (min(quotients), max(quotients)))
    return text + ["", "Bounds that are missed are marked **miss**. [The systems](#the-systems) explains sizes such as 24-contact; *A alone* is the same bodies without constraints.", ""]


def write(folder):
    here = os.path.basename(folder)
    found = {name: rows for name, rows in ((name, read(folder, name)) for name in SECTIONS) if rows}
    text = ["# The paper's experiments", "", "The three experiments of [the paper](paper.md) with this plugin (`%s`, its default there):" % DEFAULT, ""] + answers(found)
    for name, rows in found.items():
        text += SECTIONS[name](rows, here)
    text += ["## The systems", "", "Two cubes, or flat boxes, in contact (`tests/bench/twocubes.cpp`, paper section 5.1): linear elasticity, E2/E1 = 10, 92 % of the contact surface sticks. With that share C has as many rows as the paper's.", "",
             "A size N means N elements per edge of the upper body and seven eighths of it for the lower one, so that nodes do not meet. N:M gives the number for the lower body, NxZ the elements along the height of both. With -contact METIS knows which elements touch. With N:N every node meets another, which is the easier case: S is diagonal.", "",
             "The solver is conjugate gradients to 1e-8 in the natural norm with block smoothed aggregation and rigid-body modes; the paper's form has BoomerAMG. *A alone* is `-contact 0`. The paper's own configuration on a small problem: [paper.md](paper.md).", "",
             "## Made by", "", "Each experiment can be run at any size (`/usr/bin/python3 docs/study/results.py --help`). All numbers except the paper's come from the CSV files in [%s/](%s)." % (here, here), ""]
    text += [made_by(name, rows) for name, rows in found.items()]
    charts.draw(folder, found)
    prose.write(folder + ".md", text)
    print("wrote %s.md" % os.path.relpath(folder))
