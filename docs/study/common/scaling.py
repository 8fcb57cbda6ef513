"""Counts of PCBLOCKSA's levels and of S on many ranks, and the model that predicts seconds from them."""
import math
import os
import re

from . import logview, machine, store

SYSTEMS = {"small": "-n1 24 -n2 20", "large": "-n1 40 -n2 34"}
OPTIONS = ("-near_nullspace -partition contact -ksp_type preonly -pc_type ainsworth -ainsworth_ksp_rtol 1e-8 "
           "-ainsworth_ksp_converged_reason -ksp_view ::ascii_info_detail")
KEY = ("label", "system", "constraints", "ranks")
LEVEL = re.compile(r"level: (\d+) unknowns, blocks of (\d+), ([\d.]+) of them a row,(?: [\d.]+ MiB, interpolation "
                   r"[\d.]+,)?(?: at most (\d+) rows a rank,)? on (\d+) ranks?")


def constants():
    """The numbers of src/multigrid/path.h, src/projection/polynomial.h and src/base/machine.h, under their names there.
    """
    found = {}
    for name in ("multigrid/path.h", "projection/polynomial.h", "base/machine.h"):
        with open(os.path.join(machine.ROOT, "src", *name.split("/"))) as file:
            text = file.read()
        found.update((key, float(number))
                     for key, number in re.findall(r"(\w+)\s*=\s*([\d.]+(?:e-?\d+)?)\s*[,;]", text))
    return found


NUMBERS = constants()
RATE, MESSAGE = NUMBERS["rate"], NUMBERS["message"]
BLOCKS, SHRINK, NEIGHBORS = (NUMBERS["AinsworthPathBlocks"], NUMBERS["AinsworthPathShrink"],
                             NUMBERS["AinsworthPathNeighbors"])
FEWEST, PRODUCTS, BORDER = (NUMBERS["AinsworthPathFewest"], NUMBERS["AinsworthPathProducts"],
                            NUMBERS["AinsworthPathBorder"])
COARSEST, MODES = 600, 6  # -pc_blocksa_coarse_eq_limit, unknowns of a node of a coarser level
FINE_BLOCKS, FINE_BS = 25.0, 3  # of a row of A


def run(system, constraints, ranks, plugin):
    """One row of scaling.csv."""
    options = SYSTEMS[system] + ("" if constraints else " -contact 0")
    with machine.workspace() as folder:
        log = os.path.join(folder, "log.csv")
        answer = machine.run("%s -log_view :%s:ascii_csv" % (options, log), ranks, 1800, plugin=plugin,
                             defaults=OPTIONS)
        events = logview.read(log) if os.path.exists(log) else {}
    text = answer.pop("output", "")
    levels = [list(map(float, level[:3]))
              + [float(level[3] or math.ceil(float(level[0]) / float(level[1]) / float(level[4]))), float(level[4])]
              for level in LEVEL.findall(text)]
    gram = re.search(r"Gram matrix S = C W C': (.*)", text)
    count = lambda name, key: logview.get(events, name, key)
    return {"unknowns": answer["unknowns"], "rows": answer["constraints"], "iterations": answer["iterations"],
            "reason": answer["reason"], "setup": answer["setup"], "solve": answer["solve"],
            "levels": ";".join(" ".join("%g" % number for number in level) for level in levels),
            "cycles": "".join(re.findall(r"cycles=(\w)", text)), "gram": gram.group(1) if gram else "",
            "setup_reductions": count("PCSetUp", "reductions"), "solve_reductions": count("PCApply", "reductions"),
            "setup_messages": count("PCSetUp", "messages"), "solve_messages": count("PCApply", "messages"),
            "solve_bytes": count("PCApply", "bytes"), "projections": count("AinsProjector", "count"),
            "gram_seconds": count("AinsGramMat", "seconds") + count("AinsGramFact", "seconds")}


def study(arguments):
    table = store.Store(os.path.join(os.path.abspath(arguments.out), "scaling.csv"), KEY)
    for system in arguments.systems:
        for ranks in arguments.ranks:
            for constraints in (1, 0):
                best = None
                for _ in range(arguments.repeat if ranks <= 2 else 1):
                    row = run(system, constraints, ranks, os.path.abspath(arguments.plugin))
                    if best is None or (row["solve"] and row["setup"] + row["solve"] < best["setup"] + best["solve"]):
                        best = row
                table.put(dict({"label": arguments.label, "system": system, "constraints": constraints, "ranks": ranks},
                               **best, load="%.1f" % machine.load(), machine=machine.describe()))
                print("%s %s, %s constraints, %d ranks: %s iterations, set-up %s s, solve %s "
                      "s" % (arguments.label, system, "with" if constraints else "no", ranks, best["iterations"],
                             best["setup"], best["solve"]), flush=True)


def levels_of(row):
    """Nodes, unknowns of a node, blocks of a row, nodes of the busiest rank, ranks: of each level, the finest first."""
    found = [list(map(float, level.split())) for level in row["levels"].split(";")]
    return [(unknowns / bs, bs, blocks, busy, ranks) for unknowns, bs, blocks, busy, ranks in found]


def visits(n, cycle):
    """Of n levels, the finest first. twice: the coarser ones twice; W: each twice as often as the one above it, the
    coarsest as often as that; V: once.
    """
    if cycle == "V" or n == 1:
        return [1] * n
    if cycle == "W":
        return [2**min(l, n - 2) for l in range(n)]
    return [1] + [2] * (n - 1)


def product_seconds(entries, ranks):
    """AinsworthPathProduct() of src/multigrid/path.h."""
    return entries / RATE + min(ranks - 1, NEIGHBORS) * MESSAGE


def chosen(levels):
    """The cycle of these levels by AinsworthPathPrefersW() of src/multigrid/path.h."""
    each = [PRODUCTS * product_seconds(nodes * blocks * bs * bs / ranks, ranks)
            for nodes, bs, blocks, _, ranks in levels[:-1]]
    each.append((levels[-1][0] * levels[-1][1]) ** 2 / RATE)

    def seconds(cycle):
        return sum(often * time for often, time in zip(visits(len(levels), cycle), each))
    return "W" if seconds("W") <= NUMBERS["AinsworthPathMostOfW"] * seconds("twice") else "twice"


def path(levels, cycle):
    """Entries that the busiest rank multiplies in a cycle, level by level: PRODUCTS products for each visit; the
    coarsest level is solved by its factor.
    """
    entries = []
    for l, ((nodes, bs, blocks, busy, _), often) in enumerate(zip(levels, visits(len(levels), cycle))):
        last = l + 1 == len(levels) and l
        entries.append(often * ((nodes * bs) ** 2 if last else PRODUCTS * busy * blocks * bs * bs))
    return entries


def ideal(levels, ranks, cycle):
    """The same with each level spread evenly over all ranks."""
    return sum(often * PRODUCTS * nodes * blocks * bs * bs / ranks
               for (nodes, bs, blocks, _, _), often in zip(levels, visits(len(levels), cycle)))


def coarser(busy, owners):
    """Nodes of the next level where owners have so many of this one each."""
    return owners * math.ceil(busy / SHRINK + (BORDER if owners > 1 else 0))


def best_group(nodes, ranks):
    """AinsworthPath() of src/multigrid/path.h: seconds of a visit of a level and all below, and ranks of the level."""
    if nodes * MODES <= COARSEST:
        return (nodes * MODES) ** 2 / RATE, 1
    best, group = (math.inf, 1), 1
    while True:
        owners = -(-ranks // group)
        busy = math.ceil(nodes / owners)
        seconds = PRODUCTS * product_seconds(busy * BLOCKS * MODES * MODES, owners)
        if owners == 1 or busy >= FEWEST:
            best = min(best, (seconds + best_group(coarser(busy, owners), owners)[0], owners))
        if owners == 1:
            return best
        group += max(1, group // 2)


def predicted_levels(unknowns, ranks, rule):
    """Levels of a part with so many unknowns. now: by best_group(); before: fewer than 150 nodes a rank were gathered,
    600 to a rank.
    """
    nodes = unknowns / FINE_BS
    levels = [(nodes, FINE_BS, FINE_BLOCKS, math.ceil(nodes / ranks), ranks)]
    owners = ranks
    while levels[-1][0] * levels[-1][1] > COARSEST:
        nodes = coarser(levels[-1][0] / owners, owners)
        if rule == "now":
            owners = best_group(nodes, owners)[1]
        elif nodes < 150 * owners:
            owners = -(-owners // -(-owners // max(1, int(nodes / 600))))
        levels.append((nodes, MODES, BLOCKS, math.ceil(nodes / owners), owners))
    return levels


def reduction(ranks):
    """Seconds of one: a tree."""
    return MESSAGE * math.log2(ranks) if ranks > 1 else 0.0


def iteration(levels, ranks, cycle, rate, coarse_everywhere):
    """Seconds of an iteration without constraints, term by term. The finest level is in single precision, which counts
    half; one product with A comes with it. Coarser levels count as in double precision, which few products with them
    are.
    """
    entries = path(levels, cycle)
    first = levels[0][3] * levels[0][2] * levels[0][1] ** 2 / rate
    messages = sum(often * PRODUCTS * min(level[4] - 1, NEIGHBORS)
                   for level, often in zip(levels[:-1], visits(len(levels), cycle)))
    if coarse_everywhere:
        messages += visits(len(levels), cycle)[-1] * (ranks - 1)
    return {"finest level": 0.5 * entries[0] / rate + first, "coarser levels": sum(entries[1:-1]) / rate,
            "coarsest level": entries[-1] / rate if len(levels) > 1 else 0.0, "messages": messages * MESSAGE,
            "reductions": 4 * reduction(ranks)}
