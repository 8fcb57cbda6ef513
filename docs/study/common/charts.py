"""The plots of docs/results.md, as SVG."""
import os

from matplotlib import ticker

from . import paper, plots
from .experiments import ALONE
from .plots import pyplot

COLORS = ("#0072b2", "#009e73", "#d55e00", "#cc79a7", "#e69f00", "#56b4e9")
MARKERS = "os^Dv*"


def save(figure, folder, name):
    figure.tight_layout()
    plots.save(figure, os.path.join(folder, name))


def good(row):
    return row["reason"].startswith("CONVERGED")


def distinct(rows, key):
    return list(dict.fromkeys(row[key] for row in rows))


def logarithmic(panel, label, title):
    panel.set_xscale("log", base=2)
    panel.set_yscale("log", base=2)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_formatter(ticker.StrMethodFormatter("{x:g}"))
    panel.set_xlabel(label)
    panel.set_title(title, fontsize=10)
    panel.grid(True, alpha=0.4)
    panel.legend(fontsize=8)


def table(folder, rows):
    figure, panels = pyplot.subplots(1, 2, figsize=(10, 4))
    for size, color in zip(distinct(rows, "size"), COLORS):
        mine = [row for row in rows if row["size"] == size and int(row["C_ranks"])]
        ranks = [int(row["ranks"]) for row in mine]
        mean = [int(row["constraints"]) / int(row["C_ranks"]) for row in mine]
        reach = [[middle - int(row["C_least"]) for middle, row in zip(mean, mine)], [int(row["C_most"]) - middle for middle, row in zip(mean, mine)]]
        panels[0].errorbar(ranks, mean, reach, color=color, marker="o", capsize=3, label=size)
        panels[1].plot(ranks, [int(row["spread_messages"]) for row in mine], color=color, marker="o", linestyle="--", label=size + ", spread")
        panels[1].plot(ranks, [int(row["together_messages"]) for row in mine], color=color, marker="o", label=size + ", together")
    if any(size.split(":")[0] == str(paper.TABLE2_EDGE) for size in distinct(rows, "size")):
        ranks = list(paper.TABLE2)
        mean = [paper.TABLE2[r][2] for r in ranks]
        reach = [[paper.TABLE2[r][2] - paper.TABLE2[r][3] for r in ranks], [paper.TABLE2[r][4] - paper.TABLE2[r][2] for r in ranks]]
        panels[0].errorbar(ranks, mean, reach, color="k", marker="x", linestyle=":", capsize=3, label="paper, table 2")
    logarithmic(panels[0], "ranks", "rows of S per rank that has some, before regrouping")
    logarithmic(panels[1], "ranks", "messages of one projection")
    save(figure, folder, "table")


def weak_key(row):
    return row["config"], row["ranks"], ", contact" if row["size"].endswith("-contact") else ""


def weak(folder, rows):
    rows = [row for row in rows if good(row)]
    figure, panels = pyplot.subplots(1, 3, figsize=(13, 4))
    for key, color, marker in zip(dict.fromkeys(map(weak_key, rows)), COLORS, MARKERS):
        config, ranks, partition = key
        mine = sorted((row for row in rows if weak_key(row) == key), key=lambda row: int(row["unknowns"]))
        unknowns = [int(row["unknowns"]) for row in mine]
        label = "%s, %s rank%s%s" % (config, ranks, "" if ranks == "1" else "s", partition)
        panels[0].plot(unknowns, [int(row["iterations"]) for row in mine], color=color, marker=marker, fillstyle="none", label=label)
        for panel, phase in zip(panels[1:], ("setup", "solve")):
            panel.plot(unknowns, [1e6 * int(ranks) * float(row[phase]) / int(row["unknowns"]) for row in mine], color=color, marker=marker, fillstyle="none", label=label)
    for panel, title in zip(panels, ("iterations", "set-up [us per unknown of a rank]", "solve [us per unknown of a rank]")):
        panel.set_xscale("log")
        panel.set_ylim(bottom=0)
        panel.set_xlabel("unknowns")
        panel.set_title(title, fontsize=10)
        panel.grid(True, alpha=0.4)
        panel.legend(fontsize=8)
    save(figure, folder, "weak")


def cost_name(size, ranks):
    return "cost_%s_%s" % (size.replace(":", "_"), ranks)


def cost(folder, rows):
    """Stacked bars, a panel for each M_*, one of the variants above the other; A alone is the dashed line, its set-up the dotted one."""
    for size, ranks in dict.fromkeys((row["size"], row["ranks"]) for row in rows):
        mine = [row for row in rows if (row["size"], row["ranks"]) == (size, ranks)]
        alone = next((row for row in mine if row["config"] == ALONE and good(row)), None)
        configs = [config for config in distinct(mine, "config") if config != ALONE]
        if not alone or not configs:
            continue
        variants, pmats = list(dict.fromkeys(c.split()[0] for c in configs)), list(dict.fromkeys(c.split()[1] for c in configs))
        figure, panels = pyplot.subplots(len(variants), len(pmats), figsize=(max(3 * len(pmats), 4), 3.2 * len(variants)), squeeze=False, sharey="row")
        for line, variant in zip(panels, variants):
            for panel, pmat in zip(line, pmats):
                bars = sorted((row for row in mine if row["config"] == "%s %s" % (variant, pmat)), key=lambda row: float(row["fraction"]))
                for i, row in enumerate(bars):
                    if not good(row):
                        panel.text(i, 0, "x", ha="center", va="bottom", color="r")
                        continue
                    set_up, solve = float(row["setup"]), float(row["solve"])
                    panel.bar(i, set_up, color=COLORS[0], label="set-up" if i == 0 else None)
                    panel.bar(i, solve, bottom=set_up, color=COLORS[4], label="solve" if i == 0 else None)
                    panel.text(i, set_up + solve, row["iterations"], ha="center", va="bottom", fontsize=7)
                panel.axhline(float(alone["setup"]) + float(alone["solve"]), color="k", linestyle="--", linewidth=1)
                panel.axhline(float(alone["setup"]), color="k", linestyle=":", linewidth=1)
                panel.set_xticks(range(len(bars)))
                panel.set_xticklabels([row["fraction"] for row in bars], fontsize=7)
                panel.set_title("%s %s" % (variant, pmat), fontsize=9)
            line[0].set_ylabel("seconds")
            line[0].margins(y=0.15)
        panels[0][0].legend(fontsize=7, loc="upper left")
        figure.supxlabel("share of the rows of C; above the bars: iterations; x: failed or refused; dashed: A alone, dotted: its set-up", fontsize=8)
        save(figure, folder, cost_name(size, ranks))


def flops(folder, rows):
    figure, panel = pyplot.subplots(figsize=(7.5, 4.5))
    for config, color, marker in zip(distinct(rows, "config"), COLORS * 2, MARKERS * 2):
        mine = sorted(((int(row["constraints"]), float(row["all"]) / int(row["constraints"])) for row in rows if row["config"] == config and row["all"] and row["constraints"]))
        panel.plot([m for m, _ in mine], [count for _, count in mine], color=color, marker=marker, fillstyle="none", linestyle="-" if config.startswith("weighted") else ":", label=config)
    logarithmic(panel, "constraints", "operations in the assembly of M_*, per constraint")
    panel.legend(fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5))
    save(figure, folder, "flops")


def draw(folder, found):
    for name, chart in (("table", table), ("weak", weak), ("cost", cost), ("flops", flops)):
        if name in found:
            chart(folder, found[name])
