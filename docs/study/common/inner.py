"""Inner preconditioners compared on the same reduced systems: docs/inner.csv and a part of docs/cost.md."""
import os

from . import machine, measured, prose
from .families import HYPRE

NEAR, OWN = " -near_nullspace", "-ainsworth" + HYPRE.replace("-pc", "_pc", 1)
BOOMERAMG = "-ainsworth_pc_type hypre"
WITHOUT_MODES = "the same, no modes"
GAMG = "-ainsworth_pc_type gamg -ainsworth_pc_gamg_threshold 0"
PRECONDITIONERS = (
    ("block smoothed aggregation, the default", NEAR),
    (WITHOUT_MODES, ""),
    ("BoomerAMG, as the plugin sets it", BOOMERAMG),
    ("BoomerAMG, no aggressive level", BOOMERAMG + " %sagg_nl 0" % OWN),
    ("BoomerAMG, HMIS, no aggressive level", BOOMERAMG + " %scoarsen_type HMIS %sagg_nl 0" % (OWN, OWN)),
    ("BoomerAMG, HMIS, symmetric SOR",
     BOOMERAMG + " %scoarsen_type HMIS %srelax_type_all symmetric-SOR/Jacobi %sagg_nl 0" % (OWN, OWN, OWN)),
    ("GAMG", GAMG + NEAR),
    ("GAMG, 4 Chebyshev steps", GAMG + " -ainsworth_mg_levels_ksp_max_it 4" + NEAR),
    ("ML", "-ainsworth_pc_type ml" + NEAR),
)
# name, program, options; scenes always attach modes
PROBLEMS = (
    ("plain", machine.TWOCUBES, "-n1 24 -n2 20 -E2 10"),
    ("turned, slip", machine.TWOCUBES, "-n1 24 -n2 20 -E2 10 -rotate 20,35,50 -stick 0"),
    ("turned, curved, slip", machine.TWOCUBES, "-n1 24 -n2 20 -E2 10 -rotate 20,35,50 -curved 0.15 -stick 0"),
    ("E2/E1 1e-3, curved, slip", machine.TWOCUBES, "-n1 24 -n2 20 -E2 1e-3 -curved 0.15 -stick 0"),
    ("nu = 0.49", machine.TWOCUBES, "-n1 20 -n2 18 -E2 10 -nu1 0.49 -nu2 0.49"),
    ("plate on a block", machine.SCENES, "-scene plate_block -unknowns 40000"),
    ("cyclic sector", machine.SCENES, "-scene cyclic -unknowns 40000"),
    ("balls 1e4, tied", machine.SCENES, "-scene balls_tied -contrast 1e4 -unknowns 40000"),
)
# others: as in the CSV
TITLES = {"block smoothed aggregation, the default": "the default", WITHOUT_MODES: "the default without modes"}
RANKS = (1, 2, 3, 4)
OVER_RANKS = ("block smoothed aggregation, the default", "BoomerAMG, as the plugin sets it", "GAMG", "ML")
LIMIT = 40  # seconds of a run


def cell(row):
    if row is None:
        return ""
    if not row["reason"].startswith("CONVERGED"):
        return row["reason"].replace("DIVERGED_", "").lower()
    return "%s, %.2f" % (row["iterations"], float(row["setup"]) + float(row["solve"]))


def measure(path, arguments):
    """Saved after each run, so that an interrupted comparison is not lost."""
    rows = []

    def run(problem, inner, ranks, alone, repeat):
        name, program, options = problem
        options += " -ainsworth_ksp_max_it %d " % arguments.max_it + (
            inner[1].replace(NEAR, "") if program == machine.SCENES else inner[1]) + (" -contact 0" if alone else "")
        found = machine.quickest(repeat, options, ranks, LIMIT, program=program)
        row = {"problem": name, "inner": inner[0], "alone": int(alone), "ranks": ranks, "options": options.strip(),
               "load": "%.1f" % machine.load()}
        row.update({key: found[key] for key in ("iterations", "reason", "setup", "solve")})
        rows.append(row)
        measured.save(path, {"command": machine.command_line(), "machine": machine.describe(),
                             "repeat": arguments.repeat}, list(row), rows)
        print(name, "| alone |" if alone else "|", inner[0], "|", ranks, "|", cell(row), flush=True)

    for inner in PRECONDITIONERS:
        for problem in PROBLEMS:
            if problem[1] == machine.TWOCUBES or inner[0] != WITHOUT_MODES:
                for alone in (False, True) if problem[1] == machine.TWOCUBES else (False,):
                    run(problem, inner, 1, alone, arguments.repeat)
    for problem in PROBLEMS:
        for inner in PRECONDITIONERS:
            if inner[0] in OVER_RANKS:
                for ranks in RANKS:
                    run(problem, inner, ranks, False, 1)


def write(folder):
    about, rows = measured.read(os.path.join(folder, "inner.csv"))
    index = {}
    for row in rows:
        index.setdefault((row["problem"], row["inner"], row["alone"], row["ranks"]), row)
    loads = [float(row["load"]) for row in rows]
    solved = {inner: [row for (_, name, alone, ranks), row in index.items() if name == inner and alone == "0"
                      and ranks == "1"] for inner, _ in PRECONDITIONERS}
    quickest = [min((row for (name, _, alone, ranks), row in index.items()
                     if (name, alone, ranks) == (problem, "0", "1") and row["reason"].startswith("CONVERGED")),
                    key=lambda row: float(row["setup"]) + float(row["solve"]))["inner"] for problem, _, _ in PROBLEMS]
    counts = ["%s (%d)" % (TITLES.get(name, name), quickest.count(name))
              for name in dict.fromkeys(sorted(quickest, key=quickest.count, reverse=True))]
    pairs = [[index.get((problem, OVER_RANKS[0], alone, "1")) for alone in ("0", "1")]
             for problem, program, _ in PROBLEMS if program == machine.TWOCUBES]
    more = [int(with_["iterations"]) - int(without["iterations"]) for with_, without in pairs if with_ and without]
    over = [[int(index[problem, OVER_RANKS[0], "0", str(ranks)]["iterations"])
             for ranks in RANKS if (problem, OVER_RANKS[0], "0", str(ranks)) in index] for problem, _, _ in PROBLEMS]
    def total(row):
        return float(row["setup"]) + float(row["solve"])

    compared = []
    for inner, _ in PRECONDITIONERS:
        found = [(index.get((problem, inner, "0", "1")), index.get((problem, OVER_RANKS[0], "0", "1")))
                 for problem, _, _ in PROBLEMS]
        quotients = [total(row) / total(default)
                     for row, default in found if row and default and row["reason"].startswith("CONVERGED")]
        if inner in OVER_RANKS[1:] + (WITHOUT_MODES,) and quotients:
            compared.append("%s %.2f to %.2f" % (TITLES.get(inner, inner), min(quotients), max(quotients)))
    text = ["## Inner preconditioners", "",
            "Quickest inside PCAINSWORTH on %d problems with constraints: %s. The default takes %d to %d iterations "
            "more than without constraints; on 1 to %d ranks they differ by at most %d. Seconds over those of the "
            "default: %s. GAMG and ML are built on M_*: their aggregates grow across the interface, and glue bodies "
            "that slip." % (
                len(PROBLEMS), "; ".join(counts), min(more), max(more), RANKS[-1],
                max(max(counted) - min(counted) for counted in over if counted), "; ".join(compared)), "",
            "Made by `%s` on %s, 1 rank, load %.1f to %.1f; [inner.csv](inner.csv) has all runs and "
            "options." % (about["command"], about["machine"], min(loads), max(loads))]
    prose.part(os.path.join(folder, "cost.md"), "stability.py --inner", text)


def main(folder, arguments):
    if not arguments.report:
        measure(os.path.join(folder, "inner.csv"), arguments)
    write(folder)
    return 0
