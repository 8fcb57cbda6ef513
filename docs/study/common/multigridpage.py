"""A part of docs/multigrid.md, and its plots; every number comes from docs/multigrid.csv and, of the same study with a
newer PETSc, docs/multigrid-3.25.csv.
"""
import os
import statistics

from . import families, machine, measured, prose
from .prose import head, line

NEWER = "-3.25.csv"
SHOWN = "1"  # ranks of tables and plots; others are in a sentence
GROWING = "cube"  # the family that is solved at every size
SHORT = {entry[0]: entry[3] for entry in families.SOLVERS}
TITLES = {entry[0]: entry[1] for entry in families.ALONE + families.TIED + families.SOLVERS}


def distinct(rows, key):
    return list(dict.fromkeys(row[key] for row in rows))


def good(row):
    return row is not None and machine.converged(row)


def order(rows):
    """As families.py and the sizes have it."""
    places = [[entry[0] for entry in entries] for entries in (families.ALONE + families.TIED, families.SOLVERS)]
    known = [row for row in rows if row["family"] in places[0] and row["solver"] in places[1]]
    return sorted(known, key=lambda row: (int(row["size"]), int(row["ranks"]), places[0].index(row["family"]),
                                          places[1].index(row["solver"])))


def total(row):
    return float(row["total"])


def cell(row, best):
    """Iterations and seconds; the quickest in bold, a dash where it does not converge in the time it has."""
    if row is None:
        return ""
    if not good(row):
        return "-"
    text = "%.2f" % total(row)
    return "%s, %s" % (row["iterations"], "**%s**" % text if row is best else text)


def memory(row):
    """MiB on top of the assembled system, over all ranks."""
    return max(0.0, float(row["peak"]) - float(row["base"])) if row["peak"] and row["base"] else None


def panels(rows):
    """Size and ranks, and the rows of both, those with constraints apart."""
    for size, ranks in dict.fromkeys((row["size"], row["ranks"]) for row in rows):
        for tied in (False, True):
            mine = [row for row in rows if (row["size"], row["ranks"]) == (size, ranks)
                    and families.constrained(row["family"]) == tied]
            if mine:
                yield size, ranks, tied, mine


def by_family(rows):
    answer = {}
    for row in rows:
        answer.setdefault(row["family"], {})[row["solver"]] = row
    return answer


def quickest(found):
    solved = [row for row in found.values() if good(row)]
    return min(solved, key=total) if solved else None


HEAD = ("", "solved", "quickest on", "time / this multigrid's: median", "least", "worst",
        "memory / this multigrid's: median")


def summary(rows, version=""):
    """How many each solver solves, and how its time compares with ours."""
    text = []
    for name in distinct(rows, "solver"):
        found = [(system, system[name]) for system in by_family(rows).values() if name in system]
        solved = [(system, row) for system, row in found if good(row)]
        bases = [(system[families.OURS], row) for system, row in solved if families.OURS in system]
        quotients = [total(row) / max(total(base), 1e-3) for base, row in bases if good(base)]
        sizes = [memory(row) / memory(base)
                 for base, row in bases if good(base) and memory(base) and memory(row) is not None]
        text.append(line(TITLES[name] + version, "%d of %d" % (len(solved), len(found)),
                         sum(quickest(system) is row for system, row in solved),
                         *("%.2f" % number(quotients) if quotients else "" for number in (statistics.median, min, max)),
                         "%.2f" % statistics.median(sizes) if sizes else ""))
    return text


def name_of(size, ranks, tied):
    return "%s_%s_%s" % ("tied" if tied else "alone", size, ranks)


def draw(folder, rows):
    """Seconds of each solver on each family; at the right where it fails."""
    from . import plots

    for size, ranks, tied, mine in panels(rows):
        if ranks != SHOWN:
            continue
        systems, solvers = by_family(mine), distinct(mine, "solver")
        seconds = [total(row) for row in mine if good(row)]
        if not seconds or len(systems) < 2:
            continue
        figure, panel = plots.pyplot.subplots(figsize=(plots.WIDTH, 1.4 + 0.25 * len(systems)))
        end, handles = 1.3 * max(seconds), {}
        panel.axvline(end, color="0.7", linewidth=0.8)
        for column, name in enumerate(entry[0] for entry in families.SOLVERS if entry[0] in solvers):
            style = plots.style(list(SHORT).index(name), TITLES[name])  # the same in all pictures
            places = [(float(found[name]["total"]), at)
                      for at, found in enumerate(systems.values()) if name in found and good(found[name])]
            handles[TITLES[name]], = panel.plot([x for x, _ in places], [y for _, y in places],
                **dict(style, linestyle="none"))
            failed = [at for at, found in enumerate(systems.values()) if name in found and not good(found[name])]
            panel.plot([end * 1.2**(column + 1)] * len(failed), failed, **dict(style, label=None, linestyle="none"))
        panel.set_yticks(range(len(systems)))
        panel.set_yticklabels([TITLES[name] for name in systems])
        panel.invert_yaxis()
        panel.set_xscale("log")
        plots.seconds(panel.xaxis)
        panel.set_xlabel("set-up + solve [s]; beyond the line: fails")
        panel.set_title("%s unknowns, %s rank%s" % (size, ranks, "" if ranks == "1" else "s"))
        panel.grid(True, alpha=0.4)
        plots.legend_below(figure, handles)
        plots.save(figure, os.path.join(folder, name_of(size, ranks, tied)))


def growing(rows):
    """The cube alone at every size, on the fewest ranks."""
    solvers = [name for name in SHORT if any(row["family"] == GROWING and row["solver"] == name for row in rows)]
    text, shown = head("unknowns, ranks", *(SHORT[name] for name in solvers)), set()
    for size, ranks, tied, mine in panels(rows):
        found = by_family(mine).get(GROWING)
        if found and size not in shown:
            shown.add(size)
            text.append(line("%s, %s" % (size, ranks), *(cell(found.get(name), quickest(found)) for name in solvers)))
    return text


def others(rows):
    """On more ranks, A alone: how the quickest of the others compares."""
    text = []
    for size, ranks, tied, mine in panels(rows):
        systems = [system for system in by_family(mine).values() if families.OURS in system and len(system) > 1]
        if ranks != SHOWN and len(systems) > 1:
            best = [min(total(row) for name, row in system.items() if name != families.OURS
                        and good(row)) / total(system[families.OURS]) for system in systems]
            text.append("On %s ranks the quickest of the others takes %.2f to %.2f times as long (%d "
                        "systems)." % (ranks, min(best), max(best), len(systems)))
    return " ".join(text)


def since(rows, newer):
    """How the time of our multigrid with the newer PETSc compares with that of before."""
    found = {row["family"]: row for row in newer if row["solver"] == families.OURS and good(row)}
    quotients = [total(found[row["family"]]) / total(row)
                 for row in rows if row["solver"] == families.OURS and row["family"] in found and good(row)]
    return "This multigrid takes %.2f (median), %.2f to %.2f times as long with 3.25 as with 3.18." % (
        statistics.median(quotients), min(quotients), max(quotients))


def write(path):
    """path: of the CSV; the text is beside it, the plots in a folder of the same name."""
    about, rows = measured.read(path)
    rows, stem = order(rows), os.path.splitext(path)[0]
    today, newer = {}, {}
    if os.path.exists(stem + NEWER):
        today, found = measured.read(stem + NEWER)
        newer = {(size, ranks, tied): mine for size, ranks, tied, mine in panels(order(found))}
    os.makedirs(stem, exist_ok=True)
    draw(stem, rows)
    loads = [float(row["load"]) for row in rows]
    text = ["Seconds are set-up + solve to 1e-8, memory is that beyond the assembled system. With constraints the "
            "solver is the inner preconditioner of PCAINSWORTH."]
    for size, ranks, tied, mine in panels(rows):
        if ranks == SHOWN and len(by_family(mine)) > 1:
            text += ["", "%s, about %s unknowns, 1 rank:" % ("With constraints" if tied else "A alone", size),
                     ""] + head(*HEAD) + summary(mine)
            if (size, ranks, tied) in newer:
                text += summary(newer[size, ranks, tied], ", 3.25") + ["", since(mine, newer[size, ranks, tied])]
            text += ["", "![Seconds of each solver on each "
                     "family](%s)" % os.path.join(os.path.basename(stem), name_of(size, ranks, tied) + ".svg")]
    text += ["", others(rows) + " The cube at all sizes, iterations and seconds:", ""] + growing(rows)
    text += ["", "Made by `python3 docs/study/multigrid.py` on %s, load %.1f to %.1f; [multigrid.csv](multigrid.csv) "
             "has each system, the commands and all options." % (about["machine"], min(loads), max(loads))]
    if today:
        text[-1] += " Rows of 3.25: the same on %s; [multigrid-3.25.csv](multigrid-3.25.csv)." % today["machine"]
    prose.part(stem + ".md", "multigrid.py", text)
