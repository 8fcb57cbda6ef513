"""Inner preconditioners compared on the same reduced systems: docs/inner.csv and the tables of docs/inner.md."""
import csv
import os

from . import machine, prose
from .families import HYPRE
from .page import head

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
    ("BoomerAMG, HMIS, symmetric SOR", BOOMERAMG + " %scoarsen_type HMIS %srelax_type_all symmetric-SOR/Jacobi %sagg_nl 0" % (OWN, OWN, OWN)),
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
RANKS = (1, 2, 3, 4)
OVER_RANKS = ("block smoothed aggregation, the default", "BoomerAMG, as the plugin sets it", "GAMG", "ML")
LIMIT = 40  # seconds of a run


def cell(run):
    if not machine.converged(run):
        return run["reason"].replace("DIVERGED_", "").lower()
    return "%d, %.2f s" % (run["iterations"], run["setup"] + run["solve"])


class Study:
    """The runs so far; saved after each, so that an interrupted comparison is not lost."""

    def __init__(self, path, arguments):
        self.path, self.limit, self.repeat, self.rows = path, " -ainsworth_ksp_max_it %d " % arguments.max_it, arguments.repeat, []

    def run(self, problem, inner, ranks, alone, repeat):
        name, program, options = problem
        options += self.limit + (inner[1].replace(NEAR, "") if program == machine.SCENES else inner[1]) + (" -contact 0" if alone else "")
        run = machine.quickest(repeat, options, ranks, LIMIT, program=program)
        row = {"problem": name, "inner": inner[0], "alone": int(alone), "ranks": ranks, "options": options.strip(), "load": "%.1f" % machine.load()}
        row.update({key: run[key] for key in ("iterations", "reason", "setup", "solve")})
        self.rows.append(row)
        with open(self.path, "w", newline="") as file:
            table = csv.DictWriter(file, list(row), lineterminator="\n")
            table.writeheader()
            table.writerows(self.rows)
        print(name, "| alone |" if alone else "|", inner[0], "|", ranks, "|", cell(run), flush=True)
        return run

    def loads(self):
        loads = [float(row["load"]) for row in self.rows]
        return "%.1f to %.1f" % (min(loads), max(loads))


def main(folder, arguments):
    study = Study(os.path.join(folder, "inner.csv"), arguments)
    text = head("", *(title for problem, program, _ in PROBLEMS for title in ((problem, "A alone") if program == machine.TWOCUBES else (problem,))))
    for inner in PRECONDITIONERS:
        cells = []
        for problem in PROBLEMS:
            if problem[1] == machine.TWOCUBES:
                cells += [cell(study.run(problem, inner, 1, alone, study.repeat)) for alone in (False, True)]
            else:
                cells.append("" if inner[0] == WITHOUT_MODES else cell(study.run(problem, inner, 1, False, study.repeat)))
        text.append("| %s | %s |" % (inner[0], " | ".join(cells)))
    text += ["", "## Iterations over ranks", "", *head("", "", *("%d rank%s" % (ranks, "" if ranks == 1 else "s") for ranks in RANKS))]
    for name, program, options in PROBLEMS:
        for inner in PRECONDITIONERS:
            if inner[0] in OVER_RANKS:
                runs = [study.run((name, program, options), inner, ranks, False, 1) for ranks in RANKS]
                text.append("| %s | %s | %s |" % (name, inner[0], " | ".join(str(run["iterations"]) if machine.converged(run) else cell(run) for run in runs)))
    text += ["", "## Options", ""] + ["- %s: `%s`" % (name, options.strip()) for name, options in PRECONDITIONERS if options.strip()]
    text += ["", "The problems:", ""] + ["- %s: `%s %s`" % (name, os.path.basename(program), options) for name, program, options in PROBLEMS]
    about = ["# Inner preconditioners", "", "Which multigrid inside PCAINSWORTH takes the least time, and how much of it is due to the constraints.", "",
             "Made by `%s` on %s; load %s." % (machine.command_line(), machine.describe(), study.loads()),
             "A cell has the iterations to 1e-8, and set-up + solve: the least of %d runs. *A alone* is the same without constraints (`-contact 0`)." % study.repeat,
             "A run has %d seconds. All the runs: [inner.csv](inner.csv)." % LIMIT, ""]
    prose.write(os.path.join(folder, "inner.md"), about + text)
    print("wrote inner.md and inner.csv")
    return 0
