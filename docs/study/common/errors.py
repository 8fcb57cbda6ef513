"""Runs tutorials/benchmark/errortime.cpp for each solver and system, draws work-precision diagrams, writes the text. Every number comes from the CSVs."""
import glob
import math
import os
import subprocess

from . import machine, measured, prose

ERRORTIME = os.path.join(machine.BUILD, "tutorials", "errortime")
SOLVERS = os.path.join(machine.ROOT, "tutorials", "benchmark", "solvers")
CASES = {
    "base": ("E2/E1 = 10", "-E2 10"),
    "soft": ("E2/E1 = 1e-3", "-E2 1e-3"),
    "curved": ("curved interface", "-E2 10 -curved 0.15"),
    "turned": ("turned slip interface", "-E2 10 -rotate 20,35,50 -stick 0"),
    "incompressible": ("nearly incompressible, Poisson's ratio 0.49", "-E2 10 -nu1 0.49 -nu2 0.49"),
}
COLUMNS = ["solver", "tolerance", "setup_s", "solve_s", "iterations", "memory_mb", "energy_error", "multiplier_error", "primal_residual", "constraint_residual", "reason"]
LEVELS = (1e-4, 1e-6, 1e-8)
OURS = "ainsworth"
STYLES = (("o", "-"), ("s", "--"), ("^", "-."), ("D", ":"), ("v", "-"), ("P", "--"), ("X", "-."), ("<", ":"), (">", "-"), ("*", "--"))


def option_files(chosen):
    if chosen is None:
        return sorted(glob.glob(os.path.join(SOLVERS, "*.opts")))
    return [name if os.path.exists(name) else os.path.join(SOLVERS, name + ".opts") for name in chosen]


def comment(name):
    """The line that says how this solver is set up."""
    path = os.path.join(SOLVERS, name + ".opts")
    if not os.path.exists(path):
        return ""
    with open(path) as file:
        return file.readline().lstrip("# ").strip()


def reason(output, code):
    """Why a run has no answer, in one line."""
    lines = [line.split("PETSC ERROR:", 1)[1].strip() for line in output.splitlines() if "PETSC ERROR:" in line]
    lines = [line for line in lines if line and not line.startswith("---")]
    return ("; ".join(lines[:2]) or "ended with code %d" % code).replace(",", ";")


def run(path, options, arguments, reference):
    """The rows of one solver, as dictionaries of strings; a failure is the last of them."""
    name = os.path.splitext(os.path.basename(path))[0]
    command = machine.launcher(arguments.ranks) + [ERRORTIME, "-dll_append", machine.PLUGIN] + options.split()
    command += ["-options_file", path, "-name", name, "-reference", reference, "-first", str(arguments.first), "-last", str(arguments.last),
                "-step", str(arguments.step), "-repetitions", str(arguments.repeat), "-enough", str(arguments.enough)]
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=arguments.limit, env=machine.ENVIRONMENT)
        output, why = done.stdout, reason(done.stdout, done.returncode) if done.returncode else None
    except subprocess.TimeoutExpired as expired:
        output, why = (expired.stdout or b"").decode(), "time limit of %d s" % arguments.limit
    lines = output.splitlines()
    rows = [dict(zip(COLUMNS, line.split(","))) for line in lines if line.startswith(name + ",") and line.count(",") == len(COLUMNS) - 1]
    if why:
        rows.append(dict.fromkeys(COLUMNS, ""))
        rows[-1].update(solver=name, reason="failed: " + why)
    sizes = next((line[2:] for line in lines if line.startswith("# unknowns=")), None)
    return rows, sizes


def write_exact(path, options, ranks=1):
    """The exact solution, by a run of its own, so that its memory is nobody's."""
    command = machine.launcher(ranks) + [ERRORTIME] + options.split() + "-ksp_type preonly -pc_type none -first 1 -last 1 -repetitions 1".split() + ["-reference", path]
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=machine.ENVIRONMENT)
    if not os.path.exists(path):
        raise RuntimeError("no exact solution for " + options)


def exact_solution(workspace, keep, case, n1, ranks=1):
    """The options of a system and the file of its exact solution, in the folder where solutions are kept, if there is one."""
    options = "-n1 %d -n2 %d %s" % (n1, n1 * 5 // 6, CASES[case][1])
    if keep:
        os.makedirs(keep, exist_ok=True)
    path = os.path.join(os.path.abspath(keep or workspace), "%s-%d-%d.dat" % (case, n1, ranks))
    if not os.path.exists(path):
        write_exact(path, options, ranks)
    return options, path


def measure(folder, arguments):
    os.makedirs(folder, exist_ok=True)
    paths = option_files(arguments.solvers)
    for case in arguments.cases:
        for n1 in arguments.n1:
            found, sizes = [], "unknown"
            with machine.workspace() as workspace:
                options, reference = exact_solution(workspace, arguments.references, case, n1, arguments.ranks)
                for path in paths:
                    rows, said = run(path, options, arguments, reference)
                    found, sizes = found + rows, said or sizes
                    print("%s, n1 %d: %s: %d rows, %s" % (case, n1, rows[-1]["solver"] if rows else path, len(rows), rows[-1]["reason"] if rows else "nothing"), flush=True)
            about = dict(measured.provenance(), options=options, ranks=arguments.ranks, sizes=sizes)
            path = os.path.join(folder, "%s-%d.csv" % (case, n1))
            if arguments.solvers:
                measured.merge(path, about, COLUMNS, found, ("solver",))
            else:
                measured.save(path, about, COLUMNS, found)


class System:
    """One CSV."""

    def __init__(self, path):
        self.path, (self.about, rows) = path, measured.read(path)
        self.case, size = os.path.splitext(os.path.basename(path))[0].rsplit("-", 1)
        self.n1 = int(size)
        self.rows = {}
        for row in sorted(rows, key=lambda row: row["solver"]):
            self.rows.setdefault(row["solver"], []).append(row)

    def title(self):
        return "%s, n1 = %d" % (CASES[self.case][0], self.n1)

    def points(self, solver):
        """(seconds, error, did it converge) of the rows that have an answer, in the order of the tolerances."""
        answer = []
        for row in self.rows.get(solver, []):
            if row["energy_error"]:
                error = float(row["energy_error"])
                if error < float("inf"):
                    answer.append((float(row["setup_s"]) + float(row["solve_s"]), error, row["reason"].startswith("CONVERGED")))
        return answer

    def seconds_to(self, solver, level):
        """Where the line of the diagram first comes down to this error; None: never."""
        points = self.points(solver)
        good = [seconds for seconds, error, _ in points if error <= level]
        for (before, above, _), (after, below, _) in zip(points, points[1:]):
            if above > level >= below > 0:
                share = math.log(above / level) / math.log(above / below)
                good.append(before * (after / before) ** share)
        return min(good) if good else None

    def failure(self, solver):
        last = self.rows[solver][-1]
        return None if last["reason"].startswith("CONVERGED") else last["reason"]


def draw(system):
    from . import plots
    figure, axes = plots.pyplot.subplots(figsize=(9, 6))
    failed = []
    for i, solver in enumerate(system.rows):
        points = system.points(solver)
        marker, line = STYLES[i % len(STYLES)]
        ours = solver.startswith(OURS)
        if points:
            axes.plot([p[0] for p in points], [p[1] for p in points], marker=marker, linestyle=line, linewidth=2.2 if ours else 1.1, markersize=7, fillstyle="full" if ours else "none", label=solver)
            lost = [p for p in points if not p[2]]
            axes.plot([p[0] for p in lost], [p[1] for p in lost], color="k", marker="x", linestyle="none", markersize=11)
        if system.failure(solver):
            failed.append("%s: %s" % (solver, system.failure(solver)[:90]))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("set-up and solve [s]")
    axes.set_ylabel("relative error in the energy norm")
    axes.set_title(system.title() + ", " + system.about["sizes"].replace("=", " "), fontsize=10)
    axes.grid(True, which="major", alpha=0.4)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.01, 0.5))
    if failed:
        figure.text(0.01, 0.005, "\n".join(failed), fontsize=6)
    figure.tight_layout(rect=(0, 0.02 + 0.015 * len(failed), 1, 1))
    plots.save(figure, os.path.splitext(system.path)[0])


def seconds(value):
    return "" if value is None else "%.3g" % value


def table(system):
    lines = ["| | " + " | ".join("s to %.0e" % level for level in LEVELS) + " | least error | iterations at the end | memory, MB | |", "|" + "---|" * (len(LEVELS) + 5)]
    for solver, rows in system.rows.items():
        points, answered = system.points(solver), [row for row in rows if row["energy_error"]]
        last = answered[-1] if answered else {"iterations": "", "memory_mb": ""}
        lines.append("| %s | %s | %s | %s | %s | %s |" % (
            solver, " | ".join(seconds(system.seconds_to(solver, level)) for level in LEVELS), "%.0e" % min(p[1] for p in points) if points else "",
            last["iterations"], last["memory_mb"], system.failure(solver) or ""))
    return lines


def verdicts(system):
    """Where a peer is as fast as ours or faster, at the three levels of error; the direct solver apart."""
    lines = []
    for level in LEVELS:
        ours = system.seconds_to(OURS, level)
        if ours is None:
            lines.append("at %.0e ours gives no answer" % level)
            continue
        faster = ["%s (%s s against %s s)" % (solver, seconds(system.seconds_to(solver, level)), seconds(ours)) for solver in system.rows
                  if not solver.startswith(OURS) and system.seconds_to(solver, level) is not None and system.seconds_to(solver, level) <= ours]
        lines.append("at %.0e %s" % (level, "faster than ours: " + ", ".join(faster) if faster else "none is faster than ours"))
    return "; ".join(lines) + "."


def growth(systems):
    """How the seconds to 1e-6 grow with the problem."""
    lines = []
    for case in CASES:
        series = sorted((s for s in systems if s.case == case), key=lambda s: s.n1)
        if len(series) < 2:
            continue
        lines += ["", "%s, seconds to 1e-6:" % CASES[case][0], "", "| | " + " | ".join("n1 %d" % s.n1 for s in series) + " |", "|" + "---|" * (len(series) + 1)]
        for solver in series[0].rows:
            lines.append("| %s | %s |" % (solver, " | ".join(seconds(s.seconds_to(solver, 1e-6)) for s in series)))
    return lines


def write(folder):
    systems = [System(path) for path in glob.glob(os.path.join(folder, "*.csv"))]
    systems.sort(key=lambda s: (list(CASES).index(s.case), s.n1))
    here = os.path.basename(folder)
    about, loads = systems[0].about, [float(system.about["load at the end"]) for system in systems]
    text = ["# Error against run time", ""]
    commands = sorted(set(command for system in systems for command in system.about["command"].split("; ")))
    text += ["Made by %s (the text too: every number comes from the CSVs in [%s/](%s)) on %s, %s rank(s), load %s." % (
        " and ".join("`%s`" % command for command in commands), here, here, about["machine"], about["ranks"], "%.1f to %.1f" % (min(loads), max(loads))), ""]
    text += ["Each point is one tolerance of a series down from 1e-1: across, the seconds of set-up and solve together (least of the repetitions; forming the augmented or the eliminated system counts, assembling one matrix for MUMPS does not); down, the true relative error of x in the energy norm, against MUMPS with iterative refinement in extended precision. Seconds to an error are read off the line between the points.",
             "A cross marks a solve that did not converge. Memory is the largest resident memory of the process, with the system and its exact solution in it; the iterations are those of the tightest tolerance, of the inner solver for `ainsworth*`, and not known for `fieldsplit_gkb`.", "",
             "BLAS is OpenBLAS, which `makefiles/install.sh` installs: with Debian's reference BLAS MUMPS takes several times as long.", "",
             "`PCBDDC` is not among the peers: it needs matrices that are not assembled (`MATIS`). `PCHPDDM` needs a PETSc configured with HPDDM.", ""]
    text += ["| solver | |", "|---|---|"] + ["| [%s](../tutorials/benchmark/solvers/%s.opts) | %s |" % (name, name, comment(name)) for name in systems[0].rows] + [""]
    text += ["All solvers but `ainsworth_paper`, `ainsworth_gamg` and `mumps` have the same multigrid, with rigid-body modes: the multigrid of this plugin on A, or, for `golub_greif` and "
             "`elimination`, on the matrix into which they have put the constraints. There its aggregates may grow across the interface. `elimination` needs constraints that can be solved for one "
             "unknown each.", ""]
    for system in systems:
        draw(system)
        name = os.path.splitext(os.path.basename(system.path))[0]
        text += ["## " + system.title(), "", "`%s`, %s: %s" % (system.about["options"], system.about["sizes"], verdicts(system)), "", "![%s](%s/%s.svg)" % (system.title(), here, name), ""] + table(system) + [""]
    grown = growth(systems)
    if grown:
        text += ["## As the problem grows"] + grown
    prose.write(folder + ".md", text)
    for system in systems:
        print("%s and .svg beside it" % system.path)
    print("wrote %s.md" % folder)
