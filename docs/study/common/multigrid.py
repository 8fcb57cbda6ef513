"""Measures families of systems with several solvers, in turn: iterations, seconds and memory, one row of
docs/multigrid.csv each.
"""
import os
import statistics
import subprocess
import sys

from . import families, machine, measured

COLUMNS = ["family", "size", "ranks", "solver", "options", "unknowns", "constraints", "iterations", "reason", "setup",
           "setup_median", "solve", "solve_median", "total", "total_median", "runs", "peak", "base", "residual", "load"]
KEY = ("family", "size", "ranks", "solver")
FOREIGN = os.path.join(os.path.dirname(os.path.abspath(__file__)), "foreign.py")


class System:
    """A family at a size: how a run of it begins. Systems of others are written to a folder first."""

    def __init__(self, name, options, size, folder):
        self.name, self.size, self.tied = name, size, families.constrained(name)
        self.program, self.options = machine.SCENES, "%s -unknowns %d" % (options, size)
        if options == "foreign":
            prefix = os.path.join(folder, "foreign")
            done = subprocess.run([sys.executable, FOREIGN, prefix, str(size)], stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True)
            if done.returncode:
                raise RuntimeError("no system of GetFEM (is python3-getfem there?): "
                                   + (done.stdout.strip().splitlines() or ["no message"])[-1])
            self.program, self.options = machine.SOLVE, "-alone -A %s_A.dat -f %s_f.dat -X %s_X.dat" % ((prefix,) * 3)

    def run(self, solver, ranks, limit):
        return machine.run(self.options, ranks, limit, peak=True, program=self.program,
                           defaults=families.options(solver, self.tied))

    def base(self, ranks, limit):
        """MiB of the program that assembles, or reads, and does not solve."""
        if self.program == machine.SOLVE:
            return machine.run(self.options + " -ksp_max_it 0 -pc_type none", ranks, limit, peak=True,
                               program=self.program, defaults="").get("peak")
        return machine.run(self.options + " -solve 0", ranks, limit, peak=True, program=self.program,
                           defaults="").get("peak")


def seconds(run):
    return run["setup"] + run["solve"]


def row(system, ranks, solver, runs, base, loads):
    """The least and the median of the runs; the greatest peak."""
    name, _, options = solver[:3]
    last = runs[-1]
    answer = {"family": system.name, "size": system.size, "ranks": ranks, "solver": name, "options": options,
              "base": "" if not base else "%.0f" % base, "load": "%.1f" % max(loads), "runs": len(runs)}
    answer.update({key: last.get(key) for key in ("unknowns", "constraints", "iterations", "reason")})
    answer["residual"] = "" if last.get("primal") is None else "%.1e" % last["primal"]
    if all(run.get("setup") is not None for run in runs):
        for key, values in (("setup", [run["setup"] for run in runs]), ("solve", [run["solve"] for run in runs]),
                            ("total", [seconds(run) for run in runs])):
            answer[key], answer[key + "_median"] = "%.3f" % min(values), "%.3f" % statistics.median(values)
        answer["peak"] = "%.0f" % max(run["peak"] for run in runs)
    return answer


def say(system, ranks, solver, run, count):
    if machine.converged(run):
        text = "%d iterations, %.2f + %.2f s, %.0f MiB" % (run["iterations"], run["setup"], run["solve"], run["peak"])
    else:
        text = run["reason"]
    print("%s %d, %d rank%s, %s, run %d: %s" % (system.name, system.size, ranks, "" if ranks == 1 else "s", solver[0],
                                                count, text), flush=True)


def measure(system, ranks, solvers, repeat, limit):
    """The solvers take turns; one that fails is not tried again."""
    runs, loads = {solver[0]: [] for solver in solvers}, {solver[0]: [] for solver in solvers}
    base = system.base(ranks, limit)
    for count in range(1, repeat + 1):
        for solver in solvers:
            name, _, options = solver[:3]
            if runs[name] and not machine.converged(runs[name][-1]):
                continue
            loads[name].append(machine.load())
            runs[name].append(system.run(options, ranks, limit))
            say(system, ranks, solver, runs[name][-1], count)
    return [row(system, ranks, solver, runs[solver[0]], base, loads[solver[0]]) for solver in solvers]


def study(path, arguments):
    """Saved after every system, so that an interrupted study is not lost."""
    chosen, solvers = families.families(arguments.families), families.solvers(arguments.solvers)
    total, done = len(chosen) * len(arguments.sizes) * len(arguments.ranks), 0
    for size in arguments.sizes:
        for name, _, options in chosen:
            with machine.workspace() as folder:
                try:
                    system = System(name, options, size, folder)
                except RuntimeError as error:
                    print("%s is left out: %s" % (name, error), flush=True)
                    continue
                for ranks in arguments.ranks:
                    rows = measure(system, ranks, solvers, arguments.repeat, arguments.limit)
                    measured.merge(path, measured.provenance(), COLUMNS, rows, KEY)
                    done += 1
                    print("%d of %d systems done" % (done, total), flush=True)
