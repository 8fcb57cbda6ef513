"""The bounds that the defaults keep: iterations beyond those without constraints, residuals, energy errors."""
import os

from . import cases, machine, measured, prose, runs
from .measured import verdict

STIFFNESS = ("1e-6", "1e-3", "1", "10", "1e3", "1e6")
NEAR = "-near_nullspace 1 "  # rigid-body modes on A
SIZE = NEAR + "-n1 24 -n2 20 "
MORE = 3  # iterations than A alone
REFINEMENT = ((12, 10), (24, 20), (48, 40))
SHAPES = (("plain", ""), ("turned, stick 0", " -rotate 20,35,50 -stick 0"), ("curved 0.15", " -curved 0.15"))
CONSTRAINT_BOUND, ERROR_BOUND = 1e-12, 1e-7
COMPARED = (("E2 1e-6", "-E2 1e-6"), ("E2 10", "-E2 10"), ("E2 1e6, rowscale 2", "-E2 1e6 -rowscale 2"),
            ("turned, stick 0", "-rotate 20,35,50 -stick 0"),
            ("curved 0.15, turned, stick 0.5", "-rotate 20,35,50 -curved 0.15 -stick 0.5"))  # with a direct solution
LINE = "%-62s %6s %8s %9s %7s %6s  %-11s %s"


def groups():
    """(title, [(label, options)])"""
    answer = [
        ("flat interface", [("E2 " + e, "-E2 " + e) for e in STIFFNESS]),
        ("flat interface, rows scaled by 10^u, u in [-2,2]",
         [("E2 %s, rowscale 2" % e, "-E2 %s -rowscale 2" % e) for e in STIFFNESS]),
        ("curved interface", [("E2 %s, curved 0.15" % e, "-E2 %s -curved 0.15" % e) for e in STIFFNESS]),
        ("turned by 20, 35, 50 degrees",
         [("turned, stick " + s, "-rotate 20,35,50 -stick " + s) for s in ("0.5", "0", "1")]),
        ("curved and turned",
         [("curved 0.15, turned, stick " + s, "-rotate 20,35,50 -curved 0.15 -stick " + s) for s in ("0.5", "0", "1")]),
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


COLUMNS = ["group", "case", "options", "alone", "iterations", "reason", "more", "bound", "pass", "constraint",
           "constraint_pass", "error"]


def measure(rows, group, label, options, bound=""):
    alone, run = without(options), machine.run(options)
    good = machine.converged(run) and machine.converged(alone)
    more = run["iterations"] - alone["iterations"] if good else ""
    row = {"group": group, "case": label, "options": options, "alone": alone["iterations"],
           "iterations": run["iterations"], "reason": run["reason"], "more": more, "bound": bound,
           "pass": good and (not bound or more <= bound), "constraint": run["constraint"],
           "constraint_pass": good and run["constraint"] <= CONSTRAINT_BOUND}
    rows.append(row)
    print(LINE % (label, row["alone"], row["iterations"], more if good else row["reason"], bound,
                  verdict(row["pass"]) if bound else "", run["constraint"], verdict(row["constraint_pass"])),
          flush=True)


def study(path):
    rows = []
    print(LINE % ("", "alone", "solve", "more", "bound", "", "constraint", ""))
    for title, entries in groups():
        for label, options in entries:
            measure(rows, title, label, SIZE + options, MORE)
    for shape, extra in SHAPES:
        for n1, n2 in REFINEMENT:
            measure(rows, "refinement, " + shape, "%s, n1 %d, n2 %d" % (shape, n1, n2),
                    NEAR + "-n1 %d -n2 %d" % (n1, n2) + extra)
    for label, extra in COMPARED:
        config = {"name": "default", "system": "constrained", "options": ""}
        found = runs.solve(cases.system(24, 20, NEAR + extra), [config], 1, 600)[1][0]
        good = (found.get("error") or 1) <= ERROR_BOUND
        rows.append({"group": "energy error", "case": label, "options": SIZE + extra, "reason": found["reason"],
                     "pass": good, "error": "%.1e" % found["error"] if found.get("error") is not None else ""})
        print("energy error, %s: %s: %s" % (label, found.get("error", found["reason"]), verdict(good)), flush=True)
    measured.save(path, {"command": machine.command_line(), "machine": machine.describe()}, COLUMNS, rows)


def span(rows, key, form="%s"):
    numbers = [float(row[key]) for row in rows if row[key]]
    return " to ".join(form % number for number in dict.fromkeys((min(numbers), max(numbers)))) if numbers else ""


def main(folder, report):
    """The checks from the CSV; the exit status."""
    path = os.path.join(folder, "acceptance.csv")
    if not report:
        study(path)
    about, rows = measured.read(path)
    table, checks = [], [(row["case"], row["pass"] == "True") for row in rows if row["bound"]] + [
        (row["case"], row["constraint_pass"] == "True") for row in rows if row["constraint_pass"]]
    for title, _ in groups():
        mine = [row for row in rows if row["group"] == title]
        table.append("| %s | %d | %s | %s | %s |" % (title, len(mine), span(mine, "alone", "%.0f"),
                                                     span(mine, "iterations", "%.0f"),
                                                     verdict(all(row["pass"] == "True" for row in mine))))
    for shape, _ in SHAPES:
        mine = [row for row in rows if row["group"] == "refinement, " + shape]
        if all(row["more"] for row in mine):
            growth, alone = (int(mine[-1][key]) / int(mine[0][key]) for key in ("iterations", "alone"))
            holds = growth <= max(alone, 1.0)  # A alone may take fewer on finer meshes
            checks.append(("refinement, " + shape, holds))
            table.append("| refinement, %s | %d | %s | %s | %s |" % (shape, len(mine), *(
                ", ".join(row[key] for row in mine) for key in ("alone", "iterations")), verdict(holds)))
    errors = [row for row in rows if row["group"] == "energy error"]
    checks += [("energy error, " + row["case"], row["pass"] == "True") for row in errors]
    missed = [name for name, good in checks if not good]
    # others are in the table
    told = [name for name in missed if name not in {row["case"] for row in rows if row["bound"]}
            and not name.startswith("refinement")]
    text = ["## Iterations", "",
            "%d of %d bounds of the defaults hold.%s C x = g holds to %s, bound %g. The energy error against MUMPS is "
            "at most %s, bound %g." % (
                len(checks) - len(missed), len(checks), " Missed: %s." % "; ".join(told) if told else "",
                "%.0e" % max(float(row["constraint"]) for row in rows if row["constraint"]), CONSTRAINT_BOUND,
                "%.1e" % max(float(row["error"]) for row in errors if row["error"]), ERROR_BOUND), "",
            "| | systems | A alone | iterations | at most %d more; refinement: no growth |" % MORE,
            "|---|---|---|---|---|"] + table
    text += ["", "E2/E1 is 1e-6 to 1e6; refinement is n1 = 12, 24, 48. Made by `%s` (`twocubes %s`, 1 rank, to 1e-8 in "
             "the natural norm) on %s; "
             "[acceptance.csv](acceptance.csv)." % (about["command"], SIZE.strip(), about["machine"])]
    prose.part(os.path.join(folder, "cost.md"), "stability.py --acceptance", text)
    return machine.MISSED if missed else 0
