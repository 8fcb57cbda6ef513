"""Inner preconditioners compared on the same reduced systems: docs/inner.md and docs/inner.csv."""
import csv
import os

from . import machine
from .experiments import mesh
from .page import head

NEAR = " -near_nullspace"
HYPRE = "-ainsworth_pc_hypre_boomeramg_"
SMOOTHERS = tuple(("%s, %s" % (coarsening, smoother), "%scoarsen_type %s %srelax_type_all %s" % (HYPRE, coarsening, HYPRE, smoother))
                  for smoother in ("Chebyshev", "symmetric-SOR/Jacobi") for coarsening in ("PMIS", "HMIS"))
PRECONDITIONERS = (
    ("BoomerAMG", ""),
    *SMOOTHERS[1:],  # the first is the default
    ("BoomerAMG, nodal", HYPRE + "nodal_coarsen 6 " + HYPRE + "vec_interp_variant 2" + NEAR),
    ("GAMG", "-ainsworth_pc_type gamg -ainsworth_pc_gamg_threshold 0" + NEAR),
    ("GAMG, 4 Chebyshev steps", "-ainsworth_pc_type gamg -ainsworth_pc_gamg_threshold 0 -ainsworth_mg_levels_ksp_max_it 4" + NEAR),
    ("ML", "-ainsworth_pc_type ml" + NEAR),
)
PROBLEMS = (
    ("plain", ""),
    ("turned, slip", "-rotate 20,35,50 -stick 0"),
    ("turned, curved, slip", "-rotate 20,35,50 -curved 0.15 -stick 0"),
    ("curved", "-curved 0.15"),
    ("nu = 0.49", "-nu1 0.49 -nu2 0.49"),
)
STRENGTHS, PMAX, COARSENINGS, RANKS = ("0.25", "0.5", "0.6", "0.7"), ("4", "6", "0"), ("HMIS", "PMIS", "Falgout"), (1, 2, 4)
PARTITIONED = (("24-contact", (1, 2, 4, 8, 16)), ("48-contact", (1, 2)))  # sizes as in results.py, and numbers of ranks
VARIANTS = (("weighted", ""), ("A alone", " -contact 0"))
SLOW = 5.0  # seconds


def best(options, ranks, repeat):
    """The same run several times, unless it is slow: the least seconds of each part."""
    answer = machine.run(options, ranks, 120)
    for _ in range(repeat - 1):
        if not machine.converged(answer) or answer["setup"] + answer["solve"] > SLOW:
            break
        again = machine.run(options, ranks, 120)
        for key in ("setup", "solve"):
            answer[key] = min(answer[key], again[key] or answer[key])
    return answer


def cell(run):
    if not machine.converged(run):
        return run["reason"].replace("DIVERGED_", "").lower()
    return "%d, %.2f s" % (run["iterations"], run["setup"] + run["solve"])


def columns(ranks):
    return ["%d rank%s" % (r, "" if r == 1 else "s") for r in ranks]


def main(folder, arguments):
    size = "-n1 %d -n2 %d -ainsworth_ksp_max_it %d " % (arguments.n1, arguments.n2, arguments.max_it)
    rows, loads = [], [machine.load()]

    def record(part, problem, inner, variant, ranks, options, repeat=1):
        run = best(size + options, ranks, repeat)
        row = {"part": part, "problem": problem, "inner": inner, "variant": variant, "ranks": ranks, "options": options}
        row.update({key: run[key] for key in ("iterations", "reason", "setup", "solve")})
        rows.append(row)
        with open(os.path.join(folder, "inner.csv"), "w", newline="") as file:  # after every run: an interrupted comparison is not lost
            table = csv.DictWriter(file, list(row), lineterminator="\n")
            table.writeheader()
            table.writerows(rows)
        print(part, problem, inner, variant, ranks, cell(run), flush=True)
        return run

    text = ["# Inner preconditioners", "", "Made by `%s` on %s: iterations, then set-up + solve, the least of %d runs (one where it takes more than %g s); n1 = %d, n2 = %d, E2/E1 = 10." % (
        machine.command_line(), machine.describe(), arguments.repeat, SLOW, arguments.n1, arguments.n2),
        "Variant `weighted`, one rank. `-near_nullspace`: with the rigid-body modes as near null space.", "",
        *head("", "options", *(title for problem, _ in PROBLEMS for title in (problem, "A alone")))]
    for inner, options in PRECONDITIONERS:
        cells = []
        for problem, extra in PROBLEMS:
            for variant, contact in VARIANTS:
                cells.append(cell(record("preconditioner", problem, inner, variant, 1, (extra + " " + options + contact).strip(), arguments.repeat)))
        text.append("| %s | %s | %s |" % (inner, "`%s`" % options if options else "defaults", " | ".join(cells)))
    text += ["", "## Coarsening and smoother", "", "On the plain problem; sizes as in [results.md](results.md). More ranks than cores tell iterations, not seconds."]
    for grid, ranks in PARTITIONED:
        text += ["", *head(grid, "", *columns(ranks))]
        for name, options in SMOOTHERS:
            for variant, contact in VARIANTS:
                cells = [cell(record("smoother", grid, name, variant, r, "%s %s%s" % (mesh(grid), options, contact), 1 if r > 2 else arguments.repeat)) for r in ranks]
                text.append("| %s | %s | %s |" % (name, variant, " | ".join(cells)))
    text += ["", "## Parameters of BoomerAMG", "", "On the plain problem, one run each."]
    for variant in ("weighted", "paper"):
        loads.append(machine.load())
        text += ["", "### Variant `%s`" % variant, "", *head("coarsening", "strong threshold", "P_max", *columns(RANKS))]
        for coarsening in COARSENINGS:
            for strength in STRENGTHS:
                for pmax in PMAX:
                    options = "-pc_ainsworth_variant %s %scoarsen_type %s %sstrong_threshold %s %sP_max %s" % (variant, HYPRE, coarsening, HYPRE, strength, HYPRE, pmax)
                    cells = [cell(record("BoomerAMG", "plain", "%s %s %s" % (coarsening, strength, pmax), variant, ranks, options)) for ranks in RANKS]
                    text.append("| %s | %s | %s | %s |" % (coarsening, strength, pmax, " | ".join(cells)))
    loads.append(machine.load())
    text.insert(3, "The load was between %.1f and %.1f: where it exceeds the cores, trust the iterations more than the seconds." % (min(loads), max(loads)))
    with open(os.path.join(folder, "inner.md"), "w") as file:
        file.write("\n".join(text) + "\n")
    print("wrote inner.md and inner.csv")
    return 0
