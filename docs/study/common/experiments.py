"""The paper's three experiments and what they rest on, each at any size; one CSV file each."""
import os
import re
import sys

from . import logview, machine
from .store import Store

# What share of the surface sticks: with it the paper's numbers of rows of C come out, 27 000 for 96 x 96 elements,
# 188 000 for 256 x 256
PROBLEM = "-E2 10 -stick 0.92 -near_nullspace 1"
ALONE = "A alone"


def mesh(size):
    """Options for a size, written as N, N:M, NxZ or NxZ:M, and -contact after it.

    N: elements per edge of the contact surface of the upper body; M: of the lower one, by default seven eighths of N,
    so that the nodes do not meet; Z: elements along the height, by default as many as N. With -contact METIS knows
    which elements touch.
    """
    found = re.fullmatch(r"(\d+)(?:x(\d+))?(?::(\d+))?(-contact)?", size)
    if not found:
        sys.exit("%s is no size: write 96, 96:95, 128x16, 128x16:127 or 128x16-contact" % size)
    n1, nz = int(found.group(1)), int(found.group(2) or 0)
    n2 = int(found.group(3) or round(n1 * 7 / 8))
    text = "-n1 %d -n2 %d" % (n1, n2)
    if nz:
        text += " -nz1 %d -nz2 %d -height %.12g" % (nz, nz, nz / n1)
    if found.group(4):
        text += " -partition contact"
    return text


def plugin(config):
    """Options for 'A alone' or 'variant pmat'."""
    if config == ALONE:
        return "-contact 0"
    variant, pmat = config.split()
    return "-pc_ainsworth_variant %s -pc_ainsworth_pmat %s" % (variant, pmat)


def configs(arguments):
    return [ALONE] + ["%s %s" % (variant, pmat) for variant in arguments.variants for pmat in arguments.pmats]


def number(value, form="%.4g"):
    return None if value is None else form % value


class Experiment:
    """A store, and what every row has in common."""

    def __init__(self, name, key, arguments):
        self.arguments, self.name = arguments, name
        self.store = Store(os.path.join(arguments.out, name + ".csv"), key)
        self.about = {"machine": machine.describe(), "command": machine.command_line()}

    def wanted(self, **key):
        return not (self.arguments.missing and self.store.has(key))

    def missing(self, configurations):
        """(size, ranks, the key and the options of twocubes) of what is wanted."""
        for size in self.arguments.sizes:
            for ranks in self.arguments.ranks:
                for config in configurations:
                    key = {"size": size, "ranks": ranks, "config": config}
                    if self.wanted(**key):
                        yield size, ranks, key, " ".join((mesh(size), PROBLEM, plugin(config)))

    def put(self, row):
        self.store.put(dict(row, load="%.2f" % machine.load(), **self.about))
        shown = {column: value for column, value in row.items() if value is not None and column != "options"}
        print(self.name + ": " + ", ".join("%s %s" % pair for pair in shown.items()), flush=True)

    def best(self, options, ranks, **how):
        """The run with the least set-up + solve of several; a failure is not repeated."""
        return machine.quickest(self.arguments.repeat, options, ranks, self.arguments.limit, **how)

    def record(self, key, options, run):
        """The row of a solve."""
        row = dict(key, unknowns=run["unknowns"], constraints=run["constraints"], iterations=run["iterations"],
                   reason=run["reason"], setup=run["setup"], solve=run["solve"], constraint_residual=run["constraint"])
        if run.get("peak") is not None:
            row["peak_mib"] = "%.0f" % run["peak"]
        row["options"] = options
        self.put(row)


def solves(name, arguments, peak=False):
    """Every size on every number of ranks with every configuration."""
    experiment = Experiment(name, ("size", "ranks", "config"), arguments)
    for _, ranks, key, options in experiment.missing(configs(arguments)):
        experiment.record(key, options, experiment.best(options, ranks, peak=peak))


def strong(arguments):
    """Section 5.2: one large problem, with and without constraints."""
    solves("strong", arguments, peak=True)


def weak(arguments):
    """Section 5.3: the same problem on finer and finer meshes."""
    solves("weak", arguments)


def memory(arguments):
    """Peak memory with and without constraints."""
    solves("memory", arguments, peak=True)


def iterations(arguments):
    """The same problem on more and more ranks, more of them than cores."""
    solves("iterations", arguments)


def cost(arguments):
    """Section 5.4: more and more rows of C, at random; A alone is measured once, at the share 0."""
    experiment = Experiment("cost", ("size", "ranks", "config", "fraction"), arguments)
    for size in arguments.sizes:
        for ranks in arguments.ranks:
            for config in configs(arguments):
                for fraction in arguments.fractions:
                    key = {"size": size, "ranks": ranks, "config": config,
                           "fraction": "0" if config == ALONE else fraction}
                    if experiment.wanted(**key):
                        options = " ".join((mesh(size), PROBLEM, plugin(config), "-fraction " + key["fraction"]))
                        experiment.record(key, options, experiment.best(options, ranks))
                    if config == ALONE:
                        break


def flops(arguments):
    """Operations of the events that assemble M_*, all ranks together."""
    experiment = Experiment("flops", ("size", "config"), arguments)
    for size in arguments.sizes:
        for config in configs(arguments)[1:]:
            if not experiment.wanted(size=size, config=config):
                continue
            options = " ".join((mesh(size), PROBLEM, plugin(config)))
            run = logview.run(options, 1, arguments.limit)
            names = logview.of_setup(run["events"])
            row = {"size": size, "config": config, "unknowns": run["unknowns"], "constraints": run["constraints"],
                   "reason": run["reason"]}
            row.update({name: "%.0f" % run["events"][name]["flops"] for name in names})
            row["all"] = "%.0f" % sum(run["events"][name]["flops"]
                                      for name in names if name != "AinsGramFact") if names else None
            experiment.put(dict(row, options=options))


def setup(arguments):
    """Where the set-up goes: the events of the constraints against the rest of PCSetUp, which is multigrid's, and
    against PCSetUp of A alone.
    """
    experiment = Experiment("setup", ("size", "ranks", "config"), arguments)
    for size, ranks, key, options in experiment.missing(configs(arguments)[1:]):
        runs = []
        for _ in range(arguments.repeat):  # in turns, so that a disturbance meets both
            alone = logview.run(" ".join((mesh(size), PROBLEM, plugin(ALONE))), ranks, arguments.limit)
            runs.append((logview.run(options, ranks, arguments.limit), alone))
        row = dict(key, unknowns=runs[0][0]["unknowns"], constraints=runs[0][0]["constraints"],
                   reason=runs[0][0]["reason"])
        if all(machine.converged(run) for pair in runs for run in pair):
            least = min((run["events"] for run, _ in runs),
                        key=lambda events: logview.get(events, "PCSetUp", "seconds"))
            names = logview.of_setup(least)
            ours, whole = sum(least[name]["seconds"] for name in names), logview.get(least, "PCSetUp", "seconds")
            row.update({name: number(least[name]["seconds"]) for name in names})
            row.update(ours=number(ours), PCSetUp=number(whole), amg=number(whole - ours),
                       share="%.3f" % (ours / (whole - ours)),
                       alone=number(min(logview.get(other["events"], "PCSetUp", "seconds") for _, other in runs)))
        experiment.put(dict(row, options=options))


def messages(arguments):
    """Messages, bytes and reductions of one projection: the difference of a long and a short solve, divided by that of
    the projections.
    """
    experiment = Experiment("messages", ("size", "ranks", "config"), arguments)
    for size, ranks, key, options in experiment.missing(configs(arguments)[1:]):
        short, long = (logview.run(options + " -ainsworth_ksp_rtol " + rtol, ranks, arguments.limit)
                       for rtol in ("1e-3", "1e-8"))
        row = dict(key, unknowns=long["unknowns"], constraints=long["constraints"], iterations=long["iterations"],
                   reason=long["reason"])
        for event in ("AinsProjector", "AinsGramSolve"):
            count, sent, size_sent, reductions = (logview.get(long["events"], event, what)
                                                  - logview.get(short["events"], event, what)
                                                  for what in ("count", "messages", "bytes", "reductions"))
            row[event] = count
            if count:
                row.update({event + "_messages": number(sent / count),
                            event + "_bytes": number(size_sent / count, "%.0f"),
                            event + "_reductions": number(reductions / count)})
        experiment.put(dict(row, options=options))


ALL = {"strong": strong, "weak": weak, "cost": cost, "flops": flops, "setup": setup, "iterations": iterations,
       "messages": messages, "memory": memory}
