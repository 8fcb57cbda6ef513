"""The plots of docs/cost.md that results.py makes, and what other plots share with them."""
import os

from . import plots
from .experiments import ALONE
from .plots import pyplot


def good(row):
    return row["reason"].startswith("CONVERGED")


def distinct(rows, key):
    return list(dict.fromkeys(row[key] for row in rows))


def cost_name(size, ranks):
    return "cost_%s_%s" % (size.replace(":", "_"), ranks)


def cost(folder, rows, shown):
    """Of one size and number of ranks, (size, ranks): stacked bars, a panel for each M_*, one of the variants above the
    other; A alone is the dashed line, its set-up the dotted one.
    """
    for size, ranks in [shown]:
        mine = [row for row in rows if (row["size"], row["ranks"]) == (size, ranks)]
        alone = next((row for row in mine if row["config"] == ALONE and good(row)), None)
        configs = [config for config in distinct(mine, "config") if config != ALONE]
        if not alone or not configs:
            continue
        variants, pmats = (list(dict.fromkeys(c.split()[0] for c in configs)),
                           list(dict.fromkeys(c.split()[1] for c in configs)))
        figure, panels = pyplot.subplots(len(variants), len(pmats), figsize=(plots.WIDTH, 2.6 * len(variants)),
            squeeze=False, sharey="row")
        most = max(sum(row["config"] == config for row in mine) for config in configs)
        for line, variant in zip(panels, variants):
            for panel, pmat in zip(line, pmats):
                bars = sorted((row for row in mine if row["config"] == "%s %s" % (variant, pmat)),
                              key=lambda row: float(row["fraction"]))
                for i, row in enumerate(bars):
                    if not good(row):
                        panel.text(i, 0, "x", ha="center", va="bottom", color="r")
                        continue
                    set_up, solve = float(row["setup"]), float(row["solve"])
                    panel.bar(i, set_up, **plots.bar(0, "set-up" if i == 0 else None))
                    panel.bar(i, solve, bottom=set_up, **plots.bar(3, "solve" if i == 0 else None))
                    panel.annotate(row["iterations"], (i, set_up + solve), xytext=(0, 2), textcoords="offset points",
                                   ha="center", va="bottom", zorder=3,
                                   # no line strikes it through
                                   bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})
                panel.axhline(float(alone["setup"]) + float(alone["solve"]), color="k", linestyle="--", linewidth=1,
                    label="A alone")
                panel.axhline(float(alone["setup"]), color="k", linestyle=":", linewidth=1, label="its set-up")
                panel.set_xlim(-0.6, most - 0.4)  # bars are as wide in all panels
                panel.set_xticks(range(len(bars)))
                panel.set_xticklabels(["%g" % (100 * float(row["fraction"])) for row in bars])
                panel.set_title("%s %s" % (variant, pmat))
            line[0].set_ylabel("seconds")
            line[0].margins(y=0.15)
        figure.suptitle("Over the share of the rows of C [%]; above the bars: iterations; x: failed or refused",
            fontsize="medium")
        handles, labels = panels[0][0].get_legend_handles_labels()
        plots.legend_below(figure, dict(zip(labels, handles)))
        plots.save(figure, os.path.join(folder, cost_name(size, ranks)))
