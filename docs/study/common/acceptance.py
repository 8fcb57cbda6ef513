"""The bounds that the defaults keep: iterations beyond those without constraints, residuals, energy errors."""
import csv
import os

from . import cases, machine, prose, runs
from .measured import verdict

STIFFNESS = ("1e-6", "1e-3", "1", "10", "1e3", "1e6")
NEAR = "-near_nullspace 1 "  # rigid-body modes on A
SIZE = NEAR + "-n1 24 -n2 20 "
MORE = 3  # iterations than A alone
REFINEMENT = ((12, 10), (24, 20), (48, 40))
CONSTRAINT_BOUND, ERROR_BOUND = 1e-12, 1e-7
COMPARED = (("E2 1e-6", "-E2 1e-6"), ("E2 10", "-E2 10"), ("E2 1e6, rowscale 2", "-E2 1e6 -rowscale 2"), ("turned, stick 0", "-rotate 20,35,50 -stick 0"),
            ("curved 0.15, turned, stick 0.5", "-rotate 20,35,50 -curved 0.15 -stick 0.5"))  # with a direct solution
LINE = "%-62s %6s %8s %9s %7s %6s  %-11s %s"


def groups():
    """(title, [(label, options)])"""
    answer = [
        ("flat interface", [("E2 " + e, "-E2 " + e) for e in STIFFNESS]),
        ("flat interface, rows scaled by 10^u, u in [-2,2]", [("E2 %s, rowscale 2" % e, "-E2 %s -rowscale 2" % e) for e in STIFFNESS]),
        ("curved interface", [("E2 %s, curved 0.15" % e, "-E2 %s -curved 0.15" % e) for e in STIFFNESS]),
        ("turned by 20, 35, 50 degrees", [("turned, stick " + s, "-rotate 20,35,50 -stick " + s) for s in ("0.5", "0", "1")]),
        ("curved and turned", [("curved 0.15, turned, stick " + s, "-rotate 20,35,50 -curved 0.15 -stick " + s) for s in ("0.5", "0", "1")]),
    ]
    return answer


def without(options, known={}):
    """A alone; the options that only concern constraints make no other run."""
    words, kept = options.split(), []
    while words:
        key, value = words.pop(0), words.pop(0)
        if key not in ("-rowscale", "-stick"):
            kept += [key, value]
    text = " ".join(kept)
    if text not in known:
        known[text] = machine.run(text + " -contact 0")
    return known[text]


def measure(rows, group, label, options, bound=None):
    alone, run = without(options), machine.run(options)
    good = machine.converged(run) and machine.converged(alone)
    more = run["iterations"] - alone["iterations"] if good else None
    row = {"group": group, "case": label, "options": options, "alone": alone["iterations"], "iterations": run["iterations"], "reason": run["reason"], "more": more, "bound": bound,
           "pass": good and (bound is None or more <= bound), "constraint": run["constraint"], "constraint_pass": good and run["constraint"] <= CONSTRAINT_BOUND}
    rows.append(row)
    print(LINE % (label, row["alone"], row["iterations"], more if good else row["reason"], bound or "", verdict(row["pass"]) if bound else "", run["constraint"], verdict(row["constraint_pass"])), flush=True)
    return row


def main(folder):
    rows, refined, errors, text = [], [], [], []
    print(LINE % ("", "alone", "solve", "more", "bound", "", "constraint", ""))
    for title, runs_ in groups():
        for label, options in runs_:
            measure(rows, title, label, SIZE + options, MORE)
    for shape, extra in (("plain", ""), ("turned, stick 0", " -rotate 20,35,50 -stick 0"), ("curved 0.15", " -curved 0.15")):
        series = []
        for n1, n2 in REFINEMENT:
            series.append(measure(rows, "refinement, " + shape, "%s, n1 %d, n2 %d" % (shape, n1, n2), NEAR + "-n1 %d -n2 %d" % (n1, n2) + extra))
        if all(row["more"] is not None for row in series):
            growth, alone = (series[-1][key] / series[0][key] for key in ("iterations", "alone"))
            refined.append((shape, series, growth, alone, growth <= alone))
            print("refinement, %s: grows by %.2f, A alone by %.2f: %s" % (shape, growth, alone, verdict(growth <= alone)))
    for label, extra in COMPARED:
        config = {"name": "default", "system": "constrained", "options": ""}
        found = runs.solve(cases.system(24, 20, NEAR + extra), [config], 1, 600)[1][0]
        good = (found.get("error") or 1) <= ERROR_BOUND
        errors.append((label, found, good))
        print("energy error, %s: %s: %s" % (label, found.get("error", found["reason"]), verdict(good)), flush=True)
    write_csv(os.path.join(folder, "acceptance.csv"), rows)

    checks = [row["pass"] for row in rows if row["bound"]] + [row["constraint_pass"] for row in rows] + [entry[-1] for entry in refined] + [good for _, _, good in errors]
    missed = [row["case"] for row in rows if (row["bound"] and not row["pass"]) or not row["constraint_pass"]]
    missed += ["refinement, " + shape for shape, *_, good in refined if not good] + ["energy error, " + label for label, _, good in errors if not good]
    text = ["# The bounds that the defaults keep", "",
            "The defaults are compared with multigrid on the same bodies without constraints (*A alone*), and with a direct solver. %d of %d checks pass.%s" % (
                sum(checks), len(checks), " Missed: %s." % "; ".join(missed) if missed else ""), "",
            "Each line is `twocubes %s <options> %s`; *A alone* is the same with `-contact 0`. CG runs to 1e-8 in the natural norm, on one rank." % (SIZE.strip(), machine.DEFAULTS), ""]
    for title, _ in groups():
        text += ["## %s: at most %d more than A alone" % (title[0].upper() + title[1:], MORE), "", "| | A alone | iterations | more | | constraint residual | at most %g |" % CONSTRAINT_BOUND, "|---|---|---|---|---|---|---|"]
        text += [table_line(row) for row in rows if row["group"] == title] + [""]
    text += ["## Refinement: no growth beyond that of A alone", "", "| | " + " | ".join("n1 %d" % n1 for n1, _ in REFINEMENT) + " | grows by | A alone | grows by | |", "|---|" + "---|" * (len(REFINEMENT) + 4)]
    for shape, series, growth, alone, good in refined:
        text.append("| %s | %s | %.2f | %s | %.2f | %s |" % (shape, " | ".join(str(row["iterations"]) for row in series), growth, ", ".join(str(row["alone"]) for row in series), alone, verdict(good)))
    text += ["", "## Energy error against MUMPS: at most %g" % ERROR_BOUND, "", "| | error | |", "|---|---|---|"]
    text += ["| %s | %s | %s |" % (label, "%.1e" % found["error"] if found.get("error") is not None else found["reason"], verdict(good)) for label, found, good in errors]
    text += ["", "The direct solution is refined in extended precision.", "",
             "Seconds are compared in [overhead.md](overhead.md). All figures: [acceptance.csv](acceptance.csv). Made by `%s` on %s." % (machine.command_line(), machine.describe())]
    prose.write(os.path.join(folder, "acceptance.md"), text)
    print("%d of %d checks pass" % (sum(checks), len(checks)))
    return 0 if all(checks) else 1


def table_line(row):
    return "| %s | %s | %s | %s | %s | %s | %s |" % (row["case"], row["alone"], row["iterations"], row["reason"] if row["more"] is None else row["more"], verdict(row["pass"]),
                                                        "" if row["constraint"] is None else "%.0e" % row["constraint"], verdict(row["constraint_pass"]))


def write_csv(path, rows):
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
