#!/usr/bin/env python3
"""Tables and sentences that pages have by hand, outside of generated parts: figures from the CSV files are filled in.

/usr/bin/python3 docs/study/figures.py [--report]      there are no runs; an error where a page has no such sentence
"""
import argparse
import math
import os
import re
import sys

from common import examples, machine, measured, prose, report, scalingpage

NUMBER = r"([-+]?\d[\d .]*?(?:e[-+]?\d+)?)"
TITLES = {"kept": "loose solves, one solver", "fresh": "loose solves, new solvers",
    "elimination, blocksa": "elimination, `blocksa`"}
PARTS = {"flange": "flange, six bolts with pretension", "rodrbe3": "connecting rod, mean bearings",
    "sector": "cyclic sector of a bladed disk", "cell": "periodic cell, unknown mean strain",
    "housing": "housing with a mortar joint", "laminate": "laminate joined by springs (D > 0)"}
PROGRAMS = {  # those of the page, and words that are not those of the CSV
    "periodic_dolfinx.py": "periodic elasticity by multipliers: nest, fields named, one matrix alone; "
                           "no block size set",
    "contact_dolfinxmpc.py": None,
    "contact_getfem.py": None,
    "stokes_dealii.cc": None,
    "blocks_sfepy.py": "SfePy's `ls.petsc`: sliding along a tilted side; Biot's sponge, found by signs",
}
SIZES = [("20k", "1", "20 000 unknowns"), ("150k", "1", "150 000 unknowns"), ("150k", "2", "the same, 2 ranks"),
    ("300k", "1", "300 000 unknowns"), ("p2", "1", "P2")]
MODELS = {"ties": "tied cubes", "periodic": "periodic cell, unknown strain"}
FUZZ = {"general": "general, `fuzz -general 1 -cases 50000`, seeds 3411 and 3412",
    "ranks": "the same, and the next two, on 2 to 4 ranks",
    "structured": "structured, `fuzz -structured 1 -cases 3000`, seeds 81 and 82",
    "constraints": "constraints alone, `fuzz`"}


class Page:
    def __init__(self, folder, name):
        self.folder, self.path, self.count = folder, os.path.join(folder, name), 0
        with open(self.path) as file:
            self.text = self.before = file.read()

    def read(self, name):
        return measured.read(os.path.join(self.folder, *name.split("/")))[1]

    def fill(self, sentence, *values):
        """Values in the places {} of a sentence, which may be broken into lines anywhere."""
        pattern = r"\s+".join(re.escape(word).replace(r"\{\}", NUMBER) for word in sentence.split())
        found = list(re.finditer(pattern, self.text))
        if len(found) != 1 or len(found[0].groups()) != len(values):
            sys.exit("%s has %d times, with %d figures: %s" % (self.path, len(found), len(values), sentence))
        for group in range(len(values), 0, -1):
            self.text = self.text[:found[0].start(group)] + str(values[group - 1]) + self.text[found[0].end(group):]
        self.count += 1

    def table(self, head, rows):
        """All the rows below a head."""
        if self.text.count(head + "\n") != 1:
            sys.exit("%s has no table %s" % (self.path, head))
        before, after = self.text.split(head + "\n")
        line, _, after = after.partition("\n")
        after = ("\n" + after).partition("\n\n")[2]  # there may be no row
        self.text = "\n".join([before + head, line, *(prose.line(*row) for row in rows), "", after])
        self.count += 1


def spaced(number):
    return "{:,}".format(int(number)).replace(",", " ")


def short(number, form="%.0e"):
    return re.sub(r"e([-+])0", r"e\1", form % float(number))


def bound(number):
    """One digit, and not below."""
    power = math.floor(math.log10(number))
    digit = math.ceil(number / 10.0**power)
    return "%de%d" % ((1, power + 1) if digit == 10 else (digit, power))


def ends(numbers, form="%d"):
    return form % min(numbers), form % max(numbers)


def total(row, prefix=""):
    return float(row[prefix + "setup"]) + float(row[prefix + "solve"])


def where(rows, **key):
    return [row for row in rows if all(row[name] == value for name, value in key.items())]


def one(rows, **key):
    return where(rows, **key)[0]


def clamped(rows, size, quantity):
    """Of each part with constraints, over those of the same mesh without."""
    found = where(rows, size=size, ranks="1", name="")
    return [quantity(row) / quantity(one(found, part=row["part"], method="clamped"))
        for row in where(found, method="modes")]


def cost(text):
    quotients = [total(row) / total(row, "alone_") for row in text.read("results.csv")]
    study = report.Study(os.path.join(text.folder, "stability", "stability.csv"))
    small = [q for q in (study.relative(row, "seconds") for row in study.systems(report.BEST) if row["converged"]) if q]
    text.fill("take {} to {} times, small ones of {} unknowns up to {} times, ten [parts of a "
        "mesher](multigrid.md#parts-of-a-mesher), where many nodes are constrained, {} to {} times.",
        *ends(quotients, "%.2f"), spaced(next(row for row in study.rows if row["unknowns"])["unknowns"]),
        "%.2f" % max(small), *ends(clamped(text.read("parts.csv"), "150k", total), "%.2f"))


def beside(rows, size, ranks, method, own):
    """Of seven parts, or as many as were measured: seconds over ours, least and most; how many are not solved."""
    seven = [row["part"] for row in where(rows, method="amgcl", size="20k")]
    found = [(row, one(rows, part=row["part"], size=size, ranks=ranks, method=own))
        for row in where(rows, method=method, size=size, ranks=ranks) if row["part"] in seven]
    solved = [total(row) / total(ours) for row, ours in found if row["state"].lower().startswith("converged")]
    cells = ["–".join(dict.fromkeys(ends(solved, "%.1f")))] if solved else []
    if solved and len(found) < 7:
        cells[0] += " (%d part%s)" % (len(found), "s" * (len(found) > 1))
    return ", ".join(cells + ["%d not solved" % (len(found) - len(solved))] * (len(solved) < len(found)))


def multigrid(text):
    rows = text.read("parts.csv")
    ours = where(rows, method="modes", ranks="1", name="")
    text.fill("The iterations are about the same, at 300 000 unknowns {} to {} times as many;",
        *ends(clamped(rows, "300k", lambda row: int(row["iterations"])), "%.2f"))
    text.fill("Bars in concrete take most, {} for {}: they stiffen it, and elimination with the same multigrid "
        "takes {}.",
        *(one(rows, part="rebars", size="300k", method=name)["iterations"]
            for name in ("modes", "clamped", "eliminated")))
    large = [one(rows, part="flange", size="1.6", **key)
        for key in ({"method": "modes", "name": ""}, {"method": "clamped"}, {"method": "modes", "name": "blocks"})]
    text.fill("The flange of {} unknowns takes {} for {}, as a diagonal Inv(S) leaves its coarse functions a little "
        "outside of Ker C: with blocks in [Inv(S)](method.md#preconditioning-matrix) {}, at a dearer set-up.",
        spaced(large[0]["unknowns"]), *(row["iterations"] for row in large))
    text.fill("the set-up takes {} to {} times as long (up to {} at 20 000 unknowns)",
        *ends(clamped(rows, "150k", lambda row: float(row["setup"])), "%.1f"),
        "%.0f" % max(clamped(rows, "20k", lambda row: float(row["setup"]))))
    text.fill("*P2* has quadratic elements and {} to {} unknowns:",
        *(spaced(round(int(n), -3)) for n in ends([int(row["unknowns"]) for row in where(ours, size="p2")])))
    lines = []
    for part, title in PARTS.items():
        def get(method, size="150k", ranks="1"):
            return one(rows, part=part, method=method, size=size, ranks=ranks, name="")
        lines.append([title, get("modes")["unknowns"], get("modes")["iterations"], get("clamped")["iterations"],
                get("modes", ranks="4")["iterations"],
                *("%.2f" % total(get(method)) for method in ("modes", "clamped", "mumps")),
                get("modes", "p2")["iterations"], get("clamped", "p2")["iterations"]])
    text.table("| part | unknowns | iterations | clamped | 4 ranks | seconds | clamped | MUMPS | P2 | clamped |", lines)
    spiders = one(text.read("models.csv"), model="rbe2", options="-patch 4", slaves="100000")
    text.fill("With {} rows of small spiders (RBE2) the set-up takes {} times as long as with ties,",
        spaced(spiders["constraints"]), spiders["quotient_setup"])
    text.fill("The energy error of x is below {} against MUMPS with refinement.",
        bound(max(float(row["error"]) for row in where(rows, method="modes") if row["error"])))
    text.fill("without rigid-body modes ({} to {} iterations).",
        *ends([int(row["iterations"]) for row in where(rows, method="plain")]))
    newer = text.read("parts-3.25.csv")
    peers = ("amgcl", "muelu", "gamg", "boomeramg")
    text.table("| without constraints | AMGCL | MueLu | GAMG | BoomerAMG | 3.25: AMGCL | MueLu | GAMG | BoomerAMG |",
        [[title, *(beside(measured, size, ranks, method, "clamped")
                   for measured in (rows, newer) for method in peers if where(measured, method=method))]
            for size, ranks, title in SIZES if where(rows, size=size, ranks=ranks, method="gamg")])
    others = [(int(one(found, part=row["part"], size=row["size"], ranks=row["ranks"], method="clamped")["iterations"])
               - int(row["iterations"]), row["method"]) for found in (rows, newer) for row in found
        if row["method"] in peers and row["state"].lower().startswith("converged")]
    fewer = [pair for pair in others if pair[0] > 0]
    if {method for _, method in fewer} != {"amgcl"}:
        sys.exit("docs/multigrid.md says that only AMGCL takes fewer iterations")
    text.fill("Only AMGCL takes fewer iterations, on {} of {} systems, at most {} fewer.", len(fewer), len(others),
        max(fewer)[0])
    text.table("| with constraints | MUMPS | augmented | elimination, `blocksa` | GAMG | BoomerAMG |",
        [[title, *(beside(rows, size, ranks, method, "modes")
                   for method in ("mumps", "augmented", "eliminated", "eliminatedgamg", "eliminatedboomeramg"))]
            for size, ranks, title in SIZES if where(rows, size=size, ranks=ranks, method="mumps")])
    best = {row["part"]: min(total(peer) for peer in where(rows, part=row["part"], size="300k", ranks="1")
                             if peer["method"] in ("mumps", "augmented", "eliminated") and peer["setup"]) / total(row)
            for row in where(ours, size="300k")}
    if {part for part in best if best[part] < 2} != {"rebars", "housing", "sector", "laminate"}:
        sys.exit("docs/multigrid.md names other parts where a peer is near")
    text.fill("At 300 000 unknowns the best takes {} to {} times as long on bars, housing, sector and laminate, {} and",
        *ends([quotient for quotient in best.values() if quotient < 2], "%.1f"),
        "%.1f" % min(quotient for quotient in best.values() if quotient >= 2))
    text.fill("With `blocksa` it takes {} to {} iterations at 20 000 unknowns,",
        *ends([int(row["iterations"]) for row in where(rows, size="20k", method="eliminated") if row["iterations"]]))
    text.fill("and {} to {} times the memory.",
        *ends(clamped(rows, "150k", lambda row: float(row["memory"])), "%.1f"))
    hard = [one(text.read("multigrid.csv"), family=family, solver="blocksa", size="50000", ranks="1")
        for family in ("nu499", "nu4999", "random", "shell")]
    text.fill("are hard for it, as for the others: {} to {} iterations at 50 000 unknowns.",
        *ends([int(row["iterations"]) for row in hard]))
    runs = examples.read(text.folder)
    smoothed = ("frame", "flat elements", "flatter elements")
    text.fill("is above 25: {} for a frame, {} and {} for elements of 10:10:1 and 100:100:1.",
        *("%.0f" % float(runs[name, 1][1]["condition"]) for name in smoothed))
    text.fill("Iterations fall from {}, {} and {} to {}, {} and {};",
        *(runs[name + more, 1][0][0] for more in (", Jacobi", "") for name in smoothed))
    text.fill("`scenes -scene beam -unknowns 47000` takes {} iterations with modes, {} without.",
        *(runs[name, 1][0][0] for name in ("beam, modes", "beam")))
    text.fill("a plate of aspect 1000 then takes {} iterations (`scenes", runs["thin plate", 1][0][0])


def percent(row, *keys):
    return ["%.2f" % (100 * abs(float(row["error_" + key]))) for key in keys]


def both(step, prefix=""):
    """Seconds of a step of docs/sequence.csv."""
    return float(step[prefix + "setup_cpu_s"]) + float(step[prefix + "solve_cpu_s"])


def contact(text):
    runs = examples.read(text.folder)
    hertz, peers, friction, sequence, parts = (text.read(name)
        for name in ("contact/hertz.csv", "contact/peers.csv", "contact/friction.csv", "sequence.csv", "parts.csv"))
    plane, sphere, coarse = one(hertz, dim="2", n="128"), one(hertz, dim="3", n="26"), one(hertz, dim="3", n="8")
    text.fill("cylinder on block, {} unknowns | Hertz: half-width 6.215 mm, pressure 3585 MPa | {} %, {} % |",
        spaced(plane["size"]), *percent(plane, "radius", "pressure"))
    text.fill("sphere on block, {} unknowns | Hertz: radius 2.833 mm, pressure 2081 MPa | {} %, {} % |",
        spaced(sphere["size"]), *percent(sphere, "radius", "pressure"))
    text.fill("cubes that slip; cubes that are glued | {}; {} |",
        *(short(runs[name, 1][1]["distance"]) for name in ("slips", "sticks")))
    text.fill("uniform pressure | {} (node-to-surface: {}) |",
        *(short(runs[name, 1][1]["pressure"]) for name in ("mortar", "node")))
    text.fill("bounds of Voigt, Reuss, Hashin | {}; met |", short(runs["cell", 1][1]["elimination"]))
    text.fill(
        "The sphere takes {} processor seconds with n = 8 ({} unknowns, radius off by {} %) and {} with n = 26: {} "
        "steps for the first approach and {} for all later ones, of {} iterations at most.", coarse["cpu_s"],
        coarse["size"], *percent(coarse, "radius"), sphere["cpu_s"], *sphere["steps"].split("+"), sphere["most"])
    first, last = one(friction, n="6"), one(friction, n="24")
    text.fill(
        "With n1 = 6 it takes {} steps, and the tangential force is off by {} % from that of n1 = 24, {}, after {} "
        "steps", first["steps"], "%.2f" % (100 * abs(float(first["tangential"]) / float(last["tangential"]) - 1)),
        short(last["tangential"], "%.4e"), last["steps"])
    text.fill("with `-ainsworth_ksp_rtol 1e-2` and n1 = 16 it takes {} steps and {} iterations instead of {} and {}.",
        *(figure for name in ("friction, loose", "friction")
            for figure in (runs[name, 1][1]["steps"], sum(runs[name, 1][0]))))
    text.fill(
        "On 6 and 5 elements per edge mortar rows have an error of {} ({} iterations), rows for nodes {} ({}); on 4 "
        "and 16, with rows of {} entries, {} ({}) and {} ({}),",
        short(runs["mortar", 1][1]["pressure"]), runs["mortar", 1][0][0],
        short(runs["node", 1][1]["pressure"]), runs["node", 1][0][0], runs["mortar, long", 1][1]["longest"],
        short(runs["mortar, long", 1][1]["pressure"]), runs["mortar, long", 1][0][0],
        "%.0f" % float(runs["node, long", 1][1]["pressure"]), runs["node, long", 1][0][0])
    text.fill("and `-ainsworth_ksp_rtol 1e-11` it takes {} or {} iterations.", *ends(runs["cell", 1][0]))
    mine = [row for row in where(peers, n="12") if row["tolerance"] in ("1e-8", "1e-5", "")
        and "exact" not in row["solver"] and "BoomerAMG" not in row["solver"]]
    ours = float(mine[0]["cpu_s"])
    text.fill("| {} unknowns, tolerance 1e-8 | steps |", spaced(mine[0]["unknowns"]))
    text.table("unknowns, tolerance 1e-8 | steps | iterations | error | processor [s] | relative to ours |", [
        [TITLES.get(row["solver"], row["solver"]), row["steps"],
                row["iterations"] if row["iterations"] not in ("0", row["steps"]) else "",
                short(row["error"]) if float(row["error"]) else "", "%.2f" % float(row["cpu_s"]),
                "%.1f" % (float(row["cpu_s"]) / ours)] for row in mine])
    lines, amgf = [], text.read("amgf.csv")
    for part, title in (("twocubes", "two blocks"), ("flange", PARTS["flange"]), ("sector", PARTS["sector"]),
        ("hertz", "Hertz' sphere")):
        found = [sorted(where(amgf, part=part, method=method),
            key=lambda row: -float(row["name"].split()[1])) for method in ("modes", "amgf", "mumps")]
        seconds = [sum(map(total, rows)) for rows in found]
        counts = [", ".join(row["iterations"] for row in rows) for rows in found]
        lines.append([title, spaced(found[0][0]["unknowns"]), counts[0], counts[1],
            *("%.2f" % s for s in seconds), "%.1f" % (seconds[1] / seconds[0])])
    text.table("| system | unknowns | iterations | AMGF | seconds | AMGF | MUMPS | AMGF / ours |", lines)
    cases = {name: where(sequence, case=name) for name in ("rows75", "rows181", "contact75", "contact181", "values75")}
    whole = [sum(map(both, steps)) / sum(both(step, "new_") for step in steps) for steps in cases.values()]
    text.fill(
        "Every step takes {} or {} iterations, as many as with a new `KSP`. One `KSP` takes {} to {} of the time of "
        "new ones",
        *ends([int(row[key]) for steps in cases.values() for row in steps for key in ("iterations", "new_iterations")]),
        *ends(whole, "%.2f"))
    del cases["values75"]  # its set-up is a part of the solve
    found = {name: [float(step["setup_cpu_s"]) for step in steps] for name, steps in cases.items()}
    later = [seconds / setup[0] for setup in found.values() for seconds in setup[1:]]
    text.fill("from the P'AP and the aggregates of A | {} to {} |", *ends(later, "%.2f"))
    text.fill("of 150 000 unknowns a change of C costs {} to {} of the first set-up.",
        *ends([float(row["change"]) / float(row["setup"])
            for row in where(parts, method="modes", ranks="1", name="", size="150k")], "%.2f"))


def modes(text):
    runs = examples.read(text.folder)
    column = [runs["column %d" % n, 2] for n in (2, 4, 8)]
    text.fill(
        "2, 4 and 8 elements across ({}, {} and {} unknowns) give 1/s = {}, {} and {} after {}, {} and {} iterations;",
        *(said["unknowns"] for _, said in column), *("%.1f" % float(said["eigenvalue"]) for _, said in column),
        *(counts[0] for counts, _ in column))
    lobpcg = [run for (name, _), run in runs.items() if name.startswith("lobpcg")]
    text.fill("takes {} or {} iterations instead of {} to {} for tied cubes.",
        *ends([int(said["0.05"]) for _, said in lobpcg[:3]]), *ends([counts[0] for counts, _ in lobpcg[:3]]))
    text.fill(
        "where `ainsworth` takes {}, it fails with a singular Gram matrix (sigma = 1e-4 and 1e-3), or takes {} and {} "
        "(1e-2 and 1e-1).", lobpcg[3][0][0], lobpcg[3][1]["0.01"], lobpcg[3][1]["0.1"])
    text.table(
        "| unknowns | iterations | seconds | memory [MiB] | MUMPS, seconds | MUMPS, memory [MiB] | "
        "difference of elastic eigenvalues |",
        [[*(row[key] for key in ("unknowns", "iterations", "seconds", "MiB", "MUMPS seconds", "MUMPS MiB")),
            short(float(row["difference"]))] for row in where(text.read("modes/modes.csv"), modes="20")])
    loads = text.read("modes/loads.csv")
    text.fill("the solutions agree to {}:", short(max(float(row["difference"]) for row in loads)))
    text.table("| model | unknowns | 6 loads | 8 | 32 |",
               [[MODELS[model], size, *("%.2f" % float(one(loads, model=model,
        unknowns=size, loads=n)["ratio"]) for n in ("6", "8", "32"))] for model in MODELS
        for size in list(dict.fromkeys(row["unknowns"] for row in where(loads, model=model)))[-2:]])
    text.fill("Each step takes {} or {} iterations;", *runs["steps", 1][0][-2:])
    text.fill("with `-snes_type ksponly` the energy changes by {} %,",
        "%.1f" % (100 * float(runs["steps, ksponly", 1][1]["energy"])))


def method(text):
    runs, flat = examples.read(text.folder), text.read("acceptance.csv")
    counts = {}
    for row in where(text.read("method/compliance.csv"), quantity="iterations"):
        if "n1" in row["system"]:
            counts.setdefault((row["system"], row["ranks"]), []).append(sum(map(int, row["value"].split("+"))))
    text.fill("D between 1e-16 F and 1e16 F takes at most {} times the iterations of D = 0",
        "%.2f" % max(max(found) / found[0] for found in counts.values()))
    text.fill("the defaults take {}. The verification", one(flat, case="E2 10")["iterations"])
    text.table("| Inv(S) | 1 rank | 2 ranks | 3 ranks | 4 ranks |",
        [[pmat, *(runs["paper " + pmat, ranks][0][0] for ranks in (1, 2, 3, 4))]
            for pmat in examples.PMATS])


def scaling(text):
    rows = scalingpage.read(text.folder)
    aims = scalingpage.totals(rows, scalingpage.validation(rows)[0])
    found = [sum(tied.values()) / sum(alone.values()) for _, _, _, rule, alone, tied, _, _ in aims if rule == "now"]
    text.fill("is predicted to take {} times as long as one without:", "%.1f" % max(found))
    runs = examples.read(text.folder)
    text.fill("A W-cycle takes {} iterations on two cubes of 335 000 unknowns, a V-cycle {}. Two visits",
        runs["W-cycle", 1][0][0], runs["V-cycle", 1][0][0])


def layouts(text):
    found = {row["program"]: row for row in text.read("layouts.csv")}
    text.table("| program | system | iterations on 1 and 2 ranks |",
        [["`%s`" % name, words or found[name]["system"], found[name]["iterations on 1 and 2 ranks"]]
            for name, words in PROGRAMS.items()])
    rows = text.read("petscexamples.csv")
    text.fill("{} of PETSc's examples run unchanged, with options alone, in {} to {} iterations:", len(rows),
        *ends([int(count) for row in rows for count in row["iterations"].split(", ")]))
    text.fill("that of their usual solver to {} or better.",
        short(max(float(row["difference"].replace("residual", "")) for row in rows)))


def testing(text):
    fuzz, attack = text.read("testing-fuzz.csv"), text.read("testing-attack.csv")
    chosen = {"general": where(fuzz, seeds="3411 and 3412"),
        "ranks": [row for row in fuzz if row["ranks"] != "1"],
        "structured": where(fuzz, systems="structured", ranks="1"),
        "constraints": where(fuzz, systems="constraints", ranks="1")}
    sums = {name: {key: sum(int(row[key] or 0) for row in rows)
            for key in ("cases", "solved", "with a reason", "refused", "unsolved", "untrue", "wrong")} for name,
        rows in chosen.items()}
    text.table("| systems | cases | solved | with a reason | refused | unsolved | untrue | wrong |",
        [[title, *sums[name].values()] for name, title in FUZZ.items()])
    ours = sums["general"]
    text.fill(
        "Of {} [random systems](#random-systems) {} % are solved, {} % are refused or end with a reason; not solved "
        "although they should be: {}; solved wrongly: {}.", spaced(ours["cases"]),
        "%.1f" % (100 * ours["solved"] / ours["cases"]),
        "%.1f" % (100 * (ours["with a reason"] + ours["refused"]) / ours["cases"]), ours["unsolved"], ours["wrong"])
    groups = {"1": [row for row in attack if row["ranks"] == "1" and not row["tool"]],
        "1, under sanitizers, memcheck or `-malloc_debug`": [row for row in attack if row["tool"]],
        **{ranks: where(attack, ranks=ranks) for ranks in "234"}}
    keys = ("steps", "right", "refused", "unsolved", "wrong", "hang")
    lines = [[name, *(sum(int(row[key]) for row in rows) for key in keys)] for name, rows in groups.items()]
    text.table("| ranks | steps | right | refused | unsolved | wrong | hang |", lines)
    text.fill("Of {} thousand solves after [random actions](#random-sequences-of-actions) {} were wrong and {} hung;",
        round(sum(line[1] for line in lines) / 1000), sum(line[5] for line in lines), sum(line[6] for line in lines))


def extremes(text):
    ours = one(text.read("testing-fuzz.csv"), seeds="3411 and 3412")
    text.fill("Wrong answers to {} [random systems](testing.md#random-systems): {}.", spaced(ours["cases"]),
        ours["wrong"])
    runs = examples.read(text.folder)
    text.fill("missing rigid-body modes up to {} times;",
        "%.0f" % (runs["beam", 1][0][0] / runs["beam, modes", 1][0][0]))


def readme(text):
    text.fill("Without the constraints (`-contact 0`) the solve takes {} iterations.",
        examples.read(text.folder)["A alone", 2][0][0])
    found = [row for row in text.read("lu.csv") if row["program"].startswith("DOLFINx")][-2:]
    values = [("%.2f" % (float(row["setup"]) + float(row["solve"])), row["memory_MiB"]) for row in found]
    text.fill("of {} unknowns it takes {} s and {} MiB, a factorization by MUMPS {} s and {} MiB.",
        found[0]["unknowns"], *values[1], *values[0])


def architecture(text):
    text.fill("[changes.csv](changes.csv) lists {} kinds of changes.", len(text.read("changes.csv")))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--report", action="store_true", help="as without it: there are no runs")
    parser.add_argument("--out", default=os.path.join(machine.ROOT, "docs"),
        help="folder of the pages and CSV files (default docs)")
    folder, count = os.path.abspath(parser.parse_args().out), 0
    pages = {write.__name__ + ".md": write
        for write in (architecture, contact, cost, extremes, layouts, method, modes, multigrid, scaling, testing)}
    for name, write in {"../README.md": readme, **pages}.items():
        text = Page(folder, name)
        write(text)
        if text.text != text.before:
            prose.write(text.path, text.text.split("\n"))
        count += text.count
    print("wrote the part of figures.py: %d sentences and tables" % count)


if __name__ == "__main__":
    main()
