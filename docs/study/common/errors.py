"""Runs tests/bench/errortime.cpp for each solver and system: one CSV for each system. errorspage.py has the pictures
and the text.
"""
import glob
import os
import re
import shlex
import subprocess
import sys

from . import machine, measured

ERRORTIME = os.path.join(machine.BUILD, "bench", "errortime")
SOLVERS = os.path.join(machine.ROOT, "tests", "bench", "solvers")
CASES = {
    "base": ("E2/E1 = 10", "-E2 10"),
    "soft": ("E2/E1 = 1e-3", "-E2 1e-3"),
    "curved": ("curved interface", "-E2 10 -curved 0.15"),
    "turned": ("turned slip interface", "-E2 10 -rotate 20,35,50 -stick 0"),
    "incompressible": ("nearly incompressible, Poisson's ratio 0.49", "-E2 10 -nu1 0.49 -nu2 0.49"),
}
OWN = "system"  # the name of one that comes from files
COLUMNS = ["solver", "tolerance", "setup_s", "solve_s", "iterations", "memory_mb", "energy_error", "multiplier_error",
           "primal_residual", "constraint_residual", "reason"]


def option_files(chosen):
    if chosen is None:
        return sorted(glob.glob(os.path.join(SOLVERS, "*.opts")))
    return [name if os.path.exists(name) else os.path.join(SOLVERS, name + ".opts") for name in chosen]


def reason(output, code):
    """Why a run has no answer, in one line."""
    lines = [line.split("PETSC ERROR:", 1)[1].strip() for line in output.splitlines() if "PETSC ERROR:" in line]
    lines = [line for line in lines if line and not line.startswith("---")]
    return ("; ".join(lines[:2]) or "ended with code %d" % code).replace(",", ";")


def run(path, options, arguments, reference):
    """The rows of one solver, as dictionaries of strings; a failure is the last of them."""
    name = os.path.splitext(os.path.basename(path))[0]
    command = machine.launcher(arguments.ranks) + [ERRORTIME, "-dll_append", machine.PLUGIN] + shlex.split(options)
    command += ["-options_file", path, "-name", name, "-reference", reference, "-first", str(arguments.first), "-last",
                str(arguments.last),
                "-step", str(arguments.step), "-repetitions", str(arguments.repeat), "-enough", str(arguments.enough)]
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=arguments.limit, env=machine.ENVIRONMENT)
        output, why = done.stdout, reason(done.stdout, done.returncode) if done.returncode else None
    except subprocess.TimeoutExpired as expired:
        output, why = (expired.stdout or b"").decode(), "time limit of %d s" % arguments.limit
    lines = output.splitlines()
    rows = [dict(zip(COLUMNS, line.split(",")))
            for line in lines if line.startswith(name + ",") and line.count(",") == len(COLUMNS) - 1]
    if why:
        rows.append(dict.fromkeys(COLUMNS, ""))
        rows[-1].update(solver=name, reason="failed: " + why)
    sizes = next((line[2:] for line in lines if line.startswith("# unknowns=")), None)
    return rows, sizes


def write_exact(path, options, ranks=1):
    """The exact solution, by a run of its own, so that its memory is nobody's."""
    command = (machine.launcher(ranks) + [ERRORTIME] + shlex.split(options)
               + "-ksp_type preonly -pc_type none -first 1 -last 1 -repetitions 1".split() + ["-reference", path])
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=machine.ENVIRONMENT)
    if not os.path.exists(path):
        raise SystemExit("no exact solution for %s: %s" % (options, reason(done.stdout, done.returncode)))


def exact_solution(workspace, keep, case, n1, ranks=1):
    """The options of a system and the file of its exact solution, in the folder where solutions are kept, if there is
    one.
    """
    options = "-n1 %d -n2 %d %s" % (n1, n1 * 5 // 6, CASES[case][1])
    if keep:
        os.makedirs(keep, exist_ok=True)
    path = os.path.join(os.path.abspath(keep or workspace), "%s-%d-%d.dat" % (case, n1, ranks))
    if not os.path.exists(path):
        write_exact(path, options, ranks)
    return options, path


def series(paths, options, reference, arguments, name):
    """The rows of all solvers, and the sizes of the system."""
    found, sizes = [], "unknown"
    for path in paths:
        rows, said = run(path, options, arguments, reference)
        found, sizes = found + rows, said or sizes
        print("%s: %s: %d rows, %s" % (name, rows[-1]["solver"] if rows else path, len(rows),
                                       rows[-1]["reason"] if rows else "nothing"), flush=True)
    return found, sizes


def on_ranks(ranks):
    """The end of the name of a CSV, before the size."""
    return "_%d_ranks" % ranks if ranks > 1 else ""


def measure(folder, arguments):
    os.makedirs(folder, exist_ok=True)
    paths = option_files(arguments.solvers)
    for case in arguments.cases:
        for n1 in arguments.n1:
            with machine.workspace() as workspace:
                options, reference = exact_solution(workspace, arguments.references, case, n1, arguments.ranks)
                found, sizes = series(paths, options, reference, arguments, "%s, n1 %d" % (case, n1))
            about = dict(measured.provenance(), options=options, ranks=arguments.ranks, sizes=sizes)
            path = os.path.join(folder, "%s-%d.csv" % (case + on_ranks(arguments.ranks), n1))
            if arguments.solvers:
                measured.merge(path, about, COLUMNS, found, ("solver",))
            else:
                measured.save(path, about, COLUMNS, found)


def measure_own(folder, arguments):
    """A system in files, of anybody's."""
    files = (list(zip(("-A", "-C", "-f", "-g"), arguments.system))
             + ([("-X", arguments.coordinates)] if arguments.coordinates else []))
    for _, path in files:
        if not os.path.exists(path):
            raise SystemExit("%s is missing" % path)
    market = [path for _, path in files if path.endswith(".mtx")]
    if market:
        subprocess.run([sys.executable, os.path.join(machine.ROOT, "tests", "bench", "market.py")] + market, check=True)
        files = [(name, re.sub("[.]mtx$", ".dat", path)) for name, path in files]
    options = " ".join("%s %s" % (name, shlex.quote(path)) for name, path in files)
    if arguments.block_size:
        options += " -block_size %d" % arguments.block_size
    os.makedirs(folder, exist_ok=True)
    with machine.workspace() as workspace:
        reference = os.path.join(workspace, "exact.dat")
        write_exact(reference, options, arguments.ranks)
        found, sizes = series(option_files(arguments.solvers), options, reference, arguments, OWN)
    measured.save(os.path.join(folder, OWN + "-0.csv"),
                  dict(measured.provenance(), options=options, ranks=arguments.ranks, sizes=sizes), COLUMNS, found)
