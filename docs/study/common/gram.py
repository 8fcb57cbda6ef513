"""Seconds of the factorization of the Gram matrix and of one solve with it, by package, rows and ranks."""
import os
import re
import subprocess

from . import logview, machine, network, prose, store, surface

SOLVE = os.path.join(machine.BUILD, "bench", "solve")
# Ten iterations tell the time of a solve; which preconditioner they have does not matter
OPTIONS = ("-ksp_type preonly -pc_type ainsworth -pc_ainsworth_gram factor -pc_ainsworth_pmat id "
           "-ainsworth_pc_type jacobi -ainsworth_ksp_max_it 10 -ksp_view ::ascii_info_detail")
GRAM = " -ainsworth_gram_pc_type cholesky -ainsworth_gram_pc_factor_mat_solver_type "
PACKAGES = {
    "chosen": "",
    "PETSc, nested dissection": GRAM + "petsc -ainsworth_gram_pc_factor_mat_ordering_type nd",
    "PETSc, AMD": GRAM + "petsc -ainsworth_gram_pc_factor_mat_ordering_type amd",
    "CHOLMOD": GRAM + "cholmod",
    "MUMPS": GRAM + "mumps",
}
WHOLE = "-alone -ksp_type preonly -pc_type cholesky -pc_factor_mat_solver_type mumps -mat_mumps_icntl_14 100"
# Open MPI's ranks that wait leave the core to the others
ENVIRONMENT = dict(machine.ENVIRONMENT, OMPI_MCA_mpi_yield_when_idle="1", OMPI_MCA_hwloc_base_binding_policy="none")
KEY = ("experiment", "surface", "asked", "ranks", "rows_per_rank", "solver")
SHOWN = ("100000", "1000000")  # of the surfaces, in the text
ROWS = {"networks": [3000, 10000, 30000], "packages": [10000, 30000, 100000, 300000, 1000000], "ranks": [100000]}


def run(options, ranks, limit=900):
    with machine.workspace() as folder:
        log = os.path.join(folder, "log.csv")
        command = (machine.launcher(ranks) + [SOLVE, "-dll_append", machine.PLUGIN] + options.split()
                   + ["-log_view", ":%s:ascii_csv" % log])
        try:
            done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=limit,
                                  env=ENVIRONMENT)
        except subprocess.TimeoutExpired:
            return {"reason": "time limit of %d s" % limit}
        events = logview.read(log) if os.path.exists(log) else {}
    solves = logview.get(events, "AinsGramSolve", "count")
    if not solves and "-alone" in command and logview.get(events, "MatSolve", "count"):
        return {"factor": sum(logview.get(events, name, "seconds") for name in ("MatCholFctrSym", "MatCholFctrNum")),
                "solve": logview.get(events, "MatSolve", "seconds"), "reason": ""}
    if not solves:
        return {"reason": "no answer: " + done.stdout[-200:]}
    view = re.search(r"Gram matrix S = C W C': (\d+) connected components?, the largest of (\d+) rows?, on (\d+) "
                     r"ranks?(, which share it)?", done.stdout)
    chosen = re.search(r"factored by (\w+), for (\S+) operations", done.stdout)
    pieces, largest, solving, split = view.groups() if view else ("", "", "", None)
    dropped = re.search(r"(\d+) dependent rows left out", done.stdout)
    return {"factor": logview.get(events, "AinsGramFact", "seconds"),
            "search": logview.get(events, "AinsDependent", "seconds"), "dropped": dropped.group(1) if dropped else "",
            "solve": logview.get(events, "AinsGramSolve", "seconds") / solves,
            "pieces": pieces, "largest": largest, "solving_ranks": solving, "split": bool(split),
            "package": chosen.group(1) if chosen else "", "operations": chosen.group(2) if chosen else "", "reason": ""}


def least(options, ranks, repeat):
    """Of several runs: the least time to factor and the least time to solve."""
    best = {}
    for _ in range(repeat):
        row = run(options, ranks)
        if row["reason"]:
            return row
        for key in ("factor", "solve"):
            row[key] = min(row[key], best.get(key, row[key]))
        best = row
        if row["factor"] > 10:
            break
    return best


def measure(table, arguments, experiment, kind, asked, ranks, rows_per_rank, solver, options, rows, own=True):
    row = {"experiment": experiment, "surface": kind, "asked": asked, "ranks": ranks, "rows_per_rank": rows_per_rank,
           "solver": solver}
    found = least("%s %s -pc_ainsworth_rows_per_rank %d %s" % (options, OPTIONS, rows_per_rank, PACKAGES[solver]) if own
                  else options, ranks, arguments.repeat)
    row = dict(row, rows=rows, **found)
    row.update(load="%.1f" % machine.load(), machine=machine.describe(), command=machine.command_line())
    for key in ("factor", "search", "solve"):
        if key in row:
            row[key] = "%.3g" % row[key]
    table.put(row)
    print(", ".join(str(row.get(key, ""))
                    for key in KEY + ("rows", "factor", "solve", "package", "operations", "reason")), flush=True)


def open_table(folder):
    return store.Store(os.path.join(folder, "gram.csv"), KEY)


def packages(arguments):
    table = open_table(arguments.out)
    for kind in arguments.surface:
        for asked in arguments.rows or ROWS["packages"]:
            with machine.workspace() as folder:
                options, rows = surface.save(folder, surface.edge(asked), kind == "turned")
                for solver in PACKAGES:
                    measure(table, arguments, "packages", kind, asked, 1, 10 ** 9, solver, options, rows)


def networks(arguments):
    """Networks with a way out, by package and beside MUMPS on the whole system; and closed ones and ties, in which rows
    depend on others.
    """
    table = open_table(arguments.out)
    for kind in network.KINDS:
        for asked in arguments.rows or ROWS["networks"]:
            if asked > 10000 and kind == "random network":
                continue  # the factor has m^3 / 10 operations
            for what in ("open", "closed", "ties"):
                with machine.workspace() as folder:
                    options, whole, rows = network.save(folder, what, kind, asked)
                    for solver in PACKAGES if what == "open" else ["chosen"]:
                        measure(table, arguments, "networks", "%s, %s" % (kind, what), asked, 1, 10 ** 9, solver,
                                options, rows)
                    if what == "open":
                        measure(table, arguments, "networks", "%s, %s" % (kind, what), asked, 1, 10 ** 9,
                                "MUMPS, whole system", "%s %s" % (whole, WHOLE), rows, False)


def ranks(arguments):
    table = open_table(arguments.out)
    for kind in arguments.surface:
        for asked in arguments.rows or ROWS["ranks"]:
            with machine.workspace() as folder:
                options, rows = surface.save(folder, surface.edge(asked), kind == "turned")
                for count in arguments.ranks:
                    for rows_per_rank in arguments.rows_per_rank if count > 1 else [10 ** 9]:
                        measure(table, arguments, "ranks", kind, asked, count, rows_per_rank, "chosen", options, rows)


def milliseconds(row, key):
    if not row or not row.get(key):
        return (row or {}).get("reason", "")
    value = 1e3 * float(row[key])
    return "%.0f" % value if value >= 100 else "%.2g" % value


def table(rows):
    """Set-up and solve of each package: the surface in one piece, and the largest networks."""
    shown = [name for name in PACKAGES if name not in ("chosen", "PETSc, nested dissection")] + ["MUMPS, whole system"]
    keys = dict.fromkeys((row["surface"], row["asked"]) for row in rows if row["experiment"] == "packages"
                         and row["surface"] == "turned" and row["asked"] in SHOWN)
    keys.update({(surface, asked): None for surface, asked in {
        row["surface"]: row["asked"] for row in rows if row["experiment"] == "networks"
        and row["surface"].endswith(", open") and not row["surface"].startswith("random")}.items()})
    text = prose.head("S of", "rows", "operations", *shown)
    for kind, asked in keys:
        mine = {row["solver"]: row
                for row in rows if (row["surface"], row["asked"]) == (kind, asked) and row["experiment"] != "ranks"}
        cells = ["%s, %s" % (milliseconds(mine.get(solver), "factor"),
                             milliseconds(mine.get(solver), "solve")) if solver in mine else "" for solver in shown]
        text.append(prose.line("surface" if kind == "turned" else kind.replace(", open", ""), mine["chosen"]["rows"],
                         mine["chosen"]["operations"], *cells))
    return text


def search(rows):
    """The search for dependent rows as a part of the factorizations before and after it."""
    quotients = [float(row["search"]) / float(row["factor"]) for row in rows if row["experiment"] == "networks"
                 and not row["surface"].endswith(", open") and row["search"] and float(row["factor"])]
    return "%.2f to %.2f" % (min(quotients), max(quotients)) if quotients else "?"


def write(folder):
    rows = open_table(folder).rows
    loads = [float(row["load"]) for row in rows]
    text = ["Milliseconds on one rank: the factorization, then one solve, of about 50. The surface is turned, so that "
            "S is one piece; S of a network is its Laplacian. *Whole system* is [A C'; C 0].", ""] + table(rows)
    text += ["", "The search for dependent rows takes %s times as long as the factorizations, with up to two dependent "
             "rows of three. Made by `python3 docs/study/gram.py packages`, `networks` and `ranks` on %s, load %.1f to "
             "%.1f; [gram.csv](gram.csv) has all orderings, sizes and numbers of ranks." % (
                 search(rows), rows[0]["machine"], min(loads), max(loads))]
    prose.part(os.path.join(folder, "cost.md"), "gram.py", text)
