"""Extreme systems and four solvers: a part of docs/extremes.md. Every figure and verdict comes from the CSV."""
import json
import os
import re
import resource
import subprocess
import sys

from . import acceptance, cases, machine, measured, prose

WORKER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "extreme.py")
OPTIONS = os.path.join(machine.ROOT, "tests", "bench", "solvers")
ERROR_BOUND = 1e-6
COLUMNS = ["group", "case", "options", "change", "solvable", "bar", "unknowns", "constraints", "solver", "iterations",
           "reason", "failure", "why", "converged", "error", "displacement", "constraint", "primal"]
SMALL, LARGE, GAP = (12, 10), (24, 20), " -gap 0.003"

# name, title, option file, further options, assembled; programs read a tolerance of their own: it bounds another norm
# in each
SOLVERS = (
    ("mumps", "direct", "mumps.opts", "-mat_mumps_icntl_24 1", True),
    ("fieldsplit", "fieldsplit", "fieldsplit_selfp.opts", "-ksp_rtol 1e-10 -fieldsplit_1_mat_mumps_icntl_24 1", False),
    ("paper", "plugin, `paper`", "ainsworth_paper.opts", "", False),
    ("defaults", "plugin, defaults", "ainsworth.opts", "", False),
)
OURS = "defaults"
# of the option files, but read by tests/bench/errortime.cpp alone
NOT_PETSC = ("-form", "-tolerance_option", "-near_nullspace")


def case(label, options, reference=None, change=None, solvable=True, bar=False):
    """reference: options of a system with the same solution but no dependent rows; change: rows that extreme.py adds;
    bar: the defaults must cope.
    """
    return {"label": label, "options": options, "reference": options if reference is None else reference,
            "change": change or {}, "solvable": solvable, "bar": bar}


def groups():
    turned = "-rotate 20,35,50"
    all_at_once = "-E2 1e-6 -rowscale 6 -curved 0.15 " + turned + GAP
    answer = [
        ("Rows of C", SMALL, [
            case("40 rows twice, g = 0", "-duplicate 40", "", bar=True),
            case("40 rows twice, g not 0", "-duplicate 40" + GAP, GAP, bar=True),
            case("40 rows twice, contradicting g", "-duplicate 40 -inconsistent 1e-3" + GAP, solvable=False, bar=True),
            case("40 copies that differ by 1e-4 in one entry", "", change={"near": 40, "distance": 1e-4}),
            case("40 copies that differ by 1e-7 in one entry", "", change={"near": 40, "distance": 1e-7}),
            case("40 copies that differ by 1e-10 in one entry", "", change={"near": 40, "distance": 1e-10}),
            case("40 zero rows", GAP, change={"zero": 40}, reference=GAP),
            case("40 zero rows, contradicting g", GAP, change={"zero": 40, "zero_g": 1e-3}, solvable=False),
            case("40 rows of multipliers alone", GAP, change={"decoupled": 40}, reference=GAP),
            case("rows scaled by 10^u, u in [-12,12]", "-rowscale 12", bar=True),
        ]),
        ("Materials", SMALL, [
            case("E2 1e-12", "-E2 1e-12", bar=True),
            case("E2 1e12", "-E2 1e12", bar=True),
            case("Poisson's ratio 0.4999", "-nu1 0.4999 -nu2 0.4999", bar=True),
        ]),
        ("Bodies", SMALL, [
            case("floating, stick 0.1", "-floating -stick 0.1", bar=True),
            case("curved, turned", "-curved 0.15 " + turned),
            case("flat elements, 100 : 1", "-height 0.01 -nz1 12 -nz2 10"),
            case("tall elements, 1 : 100", "-height 8 -nz1 1 -nz2 1"),
            case("E2 1e-6, curved, turned, rows scaled by 10^+-6, 40 of them twice", all_at_once + " -duplicate 40",
                 all_at_once),
        ]),
        ("Of the accepted cases those with an energy error", LARGE,
         [case(label, options) for label, options in acceptance.COMPARED]),
    ]
    return answer


def limited(seconds):
    """Processor seconds, so that a loaded machine cuts nothing short."""
    def apply():
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
    return apply


def work(job, folder, limit):
    """The answer of extreme.py, None where there is none, its output, and why there is none."""
    path = os.path.join(folder, "job.json")
    with open(path, "w") as file:
        json.dump(job, file)
    command = [sys.executable, WORKER, path]
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=20 * limit,
                              env=machine.ENVIRONMENT, preexec_fn=limited(limit))
    except subprocess.TimeoutExpired:
        return None, "", "hangs"
    lines = [line for line in done.stdout.splitlines() if line.startswith('{"')]
    if lines:
        return json.loads(lines[-1]), done.stdout, ""
    if done.returncode in (-24, -9):
        return None, done.stdout, "cut at %d s" % limit
    return None, done.stdout, "ended with code %d: %s" % (
        done.returncode, (done.stdout.strip().splitlines() or ["no message"])[-1])


def solver_arguments(file, extra):
    words = extra.split()
    with open(os.path.join(OPTIONS, file)) as lines:
        for line in lines:
            parts = line.split("#")[0].split()
            if parts and parts[0] not in NOT_PETSC:
                words += parts
    return words


def explanation(output):
    """The last line of -info :pc that says why PCAINSWORTH failed."""
    lines = re.findall(r"^\[0\] <pc:ainsworth> \w+\(\): (.*)$|^\[0\] <pc> \w+\(\): (.*)$", output, re.MULTILINE)
    found = [first or second for first, second in lines
             if re.search("no solution exists|cannot be solved|not balanced|is met to|does not see|fail",
                          first or second)]
    return found[-1] if found else ""


def measure(group, size, entry, limit):
    rows = []
    with machine.workspace() as folder:
        prefix, base, exact = (os.path.join(folder, name) for name in ("system", "base", "x.npy"))
        system = cases.system(size[0], size[1], entry["options"])
        machine.write_system(system, prefix)
        sizes = {}
        if entry["solvable"]:
            near = "near" in entry["change"]  # of these rows none is dependent
            machine.write_system(cases.system(size[0], size[1], entry["reference"]), base)
            job = {"plugin": machine.PLUGIN, "prefix": base, "exact": exact, "solver": "",
                   "change": entry["change"] if near else {}}
            sizes, output, why = work(job, folder, 10 * limit)
            if not sizes:
                raise RuntimeError("no direct solution of %s: %s" % (entry["label"], why))
        for name, _, file, extra, assembled in SOLVERS:
            job = {"plugin": machine.PLUGIN, "prefix": prefix, "exact": exact if entry["solvable"] else "",
                   "solver": name, "assembled": assembled, "change": entry["change"],
                   "arguments": solver_arguments(file, extra) + ["-info", ":pc"]}
            answer, output, why = work(job, folder, limit)
            row = dict.fromkeys(COLUMNS, "")
            row.update(group=group, case=entry["label"], options=system,
                       change=json.dumps(entry["change"]) if entry["change"] else "", solvable=entry["solvable"],
                       bar=entry["bar"], solver=name)
            row.update({key: sizes[key] for key in ("unknowns", "constraints") if key in sizes})
            if answer is None:
                row.update(reason=why, converged=False)
            else:
                row.update({key: value for key, value in answer.items() if key in COLUMNS})
                if not answer["converged"]:
                    row["why"] = explanation(output)
                elif not answer["finite"]:
                    row.update(reason="not a number", converged=True)
            for key in ("error", "displacement", "constraint", "primal"):
                row[key] = "" if row[key] in ("", None) else "%.3e" % row[key]
            rows.append({key: str(value) for key, value in row.items()})
            print("%s | %s: %s" % (entry["label"], name, " ".join(cells(rows[-1]))), flush=True)
    return rows


def verdict(row):
    """right, wrong (and silent), or what the solver says."""
    solvable, converged = row["solvable"] == "True", row["converged"] == "True"
    if converged:
        return "right" if solvable and row["error"] and float(row["error"]) <= ERROR_BOUND else "**wrong, silent**"
    if row["reason"].startswith("cut") or row["reason"] == "hangs":
        return row["reason"]
    return "says no: " + (row["failure"].split(",")[0] or row["reason"])


def passes(row):
    """The bar: the solution where there is one, the documented reason where there is none."""
    return verdict(row) == "right" or (row["solvable"] != "True" and "INCONSISTENT_RHS" in row["failure"])


def cells(row):
    return [row["iterations"] or "-", row["error"] and "%.0e" % float(row["error"]) or "-",
            row["constraint"] and "%.0e" % float(row["constraint"]) or "-", verdict(row)]


def write(path, about, rows):
    ours = [row for row in rows if row["solver"] == OURS]
    bar = [row for row in ours if row["bar"] == "True"]
    passed = sum(passes(row) for row in bar)
    counts = {name: [verdict(row) for row in rows if row["solver"] == name] for name, _, _, _, _ in SOLVERS}
    titles = {name: title for name, title, _, _, _ in SOLVERS}
    silent = {name: [row["case"] for row in rows if row["solver"] == name and "silent" in verdict(row)]
              for name in titles}
    text = ["Four solvers on %d systems with dependent, contradictory and badly scaled rows, extreme materials and "
            "shapes:" % len(ours), ""]
    text += ["| | %s |" % " | ".join(title for _, title, _, _, _ in SOLVERS), "|---|" + "---|" * len(SOLVERS)]
    for label, wanted in (("right", lambda v: v == "right"), ("wrong and silent", lambda v: "silent" in v),
                          ("says that it failed", lambda v: v.startswith("says no")),
                          ("cut or hangs", lambda v: v.startswith(("cut", "hangs")))):
        text.append("| %s | %s |" % (label,
                                     " | ".join(str(sum(map(wanted, counts[name]))) for name, _, _, _, _ in SOLVERS)))
    text += ["", "*Right*: the energy error is at most %g. *Wrong and silent*: reported as converged, but no solution "
             "exists, or the error is larger. %s" % (
                 ERROR_BOUND, " ".join("%s: %s." % (titles[name][0].upper() + titles[name][1:], "; ".join(found))
                                       for name, found in silent.items() if found))]
    solved = [row for row in bar if row["solvable"] == "True" and row["error"]]
    text += ["", "%d of %d cases pass that the defaults have to solve or, if no solution exists, to refuse with "
             "`PC_INCONSISTENT_RHS`, in %s to %s iterations, with an energy error of at most %.0e: %s." % (
                 passed, len(bar), min((row["iterations"] for row in bar), key=int),
                 max((row["iterations"] for row in bar), key=int), max(float(row["error"]) for row in solved),
                 "; ".join(row["case"] + ("" if passes(row) else " (**miss**)") for row in bar))]
    text += ["", "*Direct* is MUMPS with detection of null pivots, *fieldsplit* a block factorization with the same "
             "multigrid and `selfp`. The energy error is that against MUMPS on the scaled system without dependent "
             "rows, refined. Made by `python3 docs/study/stability.py --extremes` (two cubes, 12 and 10, or 24 and 20 "
             "elements per edge, one rank) on %s; [extremes.csv](extremes.csv) has all cases." % about["machine"]]
    prose.part(path, "stability.py --extremes", text)
    print("%d of %d pass the bar" % (passed, len(bar)))
    return 0 if passed == len(bar) else machine.MISSED


def main(folder, arguments):
    """Rows of the CSV whose case is not run again stay: --case repeats one."""
    os.makedirs(folder, exist_ok=True)
    path = os.path.join(folder, "extremes.csv")
    about, old = measured.read(path) if os.path.exists(path) else ({}, [])
    rows = []
    for group, size, entries in groups():
        for entry in entries:
            kept = [row for row in old if row["case"] == entry["label"]]
            wanted = not arguments.report and (not arguments.case or re.search(arguments.case, entry["label"]))
            rows += measure(group, size, entry, arguments.limit) if wanted else kept
            if wanted:
                measured.save(path, {"machine": machine.describe()}, COLUMNS,
                              rows + [row for row in old if row["case"] not in {one["case"] for one in rows}])
    about, _ = measured.read(path)
    return write(os.path.join(folder, "extremes.md"), about, rows)
