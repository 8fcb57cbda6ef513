"""Seconds of the factorization of the Gram matrix and of one solve with it, by package, rows and ranks."""
import os
import re
import subprocess

from . import logview, machine, network, prose, store, surface

SOLVE = os.path.join(machine.BUILD, "bench", "solve")
# Ten iterations tell the time of a solve; which preconditioner they have does not matter
OPTIONS = "-ksp_type preonly -pc_type ainsworth -pc_ainsworth_pmat id -ainsworth_pc_type jacobi -ainsworth_ksp_max_it 10 -ksp_view"
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
ROWS = {"networks": [3000, 10000, 30000], "packages": [10000, 30000, 100000, 300000, 1000000], "ranks": [100000]}


def run(options, ranks, limit=900):
    with machine.workspace() as folder:
        log = os.path.join(folder, "log.csv")
        command = machine.launcher(ranks) + [SOLVE, "-dll_append", machine.PLUGIN] + options.split() + ["-log_view", ":%s:ascii_csv" % log]
        try:
            done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=limit, env=ENVIRONMENT)
        except subprocess.TimeoutExpired:
            return {"reason": "time limit of %d s" % limit}
        events = logview.read(log) if os.path.exists(log) else {}
    solves = logview.get(events, "AinsGramSolve", "count")
    if not solves and "-alone" in command and logview.get(events, "MatSolve", "count"):
        return {"factor": sum(logview.get(events, name, "seconds") for name in ("MatCholFctrSym", "MatCholFctrNum")), "solve": logview.get(events, "MatSolve", "seconds"), "reason": ""}
    if not solves:
        return {"reason": "no answer: " + done.stdout[-200:]}
    view = re.search(r"Gram matrix S = C W C': (\d+) connected components?, the largest of (\d+) rows?, on (\d+) ranks?(, cut by METIS)?", done.stdout)
    chosen = re.search(r"factored by (\w+), for (\S+) operations", done.stdout)
    pieces, largest, solving, split = view.groups() if view else ("", "", "", None)
    dropped = re.search(r"(\d+) dependent rows left out", done.stdout)
    return {"factor": logview.get(events, "AinsGramFact", "seconds"), "search": logview.get(events, "AinsDependent", "seconds"), "dropped": dropped.group(1) if dropped else "", "solve": logview.get(events, "AinsGramSolve", "seconds") / solves,
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
    row = {"experiment": experiment, "surface": kind, "asked": asked, "ranks": ranks, "rows_per_rank": rows_per_rank, "solver": solver}
    found = least("%s %s -pc_ainsworth_rows_per_rank %d %s" % (options, OPTIONS, rows_per_rank, PACKAGES[solver]) if own else options, ranks, arguments.repeat)
    row = dict(row, rows=rows, **found)
    row.update(load="%.1f" % machine.load(), machine=machine.describe(), command=machine.command_line())
    for key in ("factor", "search", "solve"):
        if key in row:
            row[key] = "%.3g" % row[key]
    table.put(row)
    print(", ".join(str(row.get(key, "")) for key in KEY + ("rows", "factor", "solve", "package", "operations", "reason")), flush=True)


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
    """Networks with a way out, by package and beside MUMPS on the whole system; and closed ones and ties, in which rows depend on others."""
    table = open_table(arguments.out)
    for kind in network.KINDS:
        for asked in arguments.rows or ROWS["networks"]:
            if asked > 10000 and kind == "random network":
                continue  # the factor has m^3 / 10 operations
            for what in ("open", "closed", "ties"):
                with machine.workspace() as folder:
                    options, whole, rows = network.save(folder, what, kind, asked)
                    for solver in PACKAGES if what == "open" else ["chosen"]:
                        measure(table, arguments, "networks", "%s, %s" % (kind, what), asked, 1, 10 ** 9, solver, options, rows)
                    if what == "open":
                        measure(table, arguments, "networks", "%s, %s" % (kind, what), asked, 1, 10 ** 9, "MUMPS, whole system", "%s %s" % (whole, WHOLE), rows, False)


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


def line(*cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def made_by(rows):
    commands = sorted({row["command"] for row in rows})
    loads = [float(row["load"]) for row in rows]
    return ["Made by", ""] + ["    " + command for command in commands] + ["", "on %s." % rows[0]["machine"],
            "The load was between %.1f and %.1f: compare within a row only, and trust large ratios only." % (min(loads), max(loads)), ""]


def headline(rows):
    """What the choice of the plugin takes for about 100000 rows, on one rank."""
    row = next((row for row in rows if (row["surface"], row["asked"], row["solver"]) == ("turned", "100000", "chosen")), None)
    if row is None:
        return ""
    return "- For %s rows on one rank the set-up takes %s ms and a solve %s ms. The solution of a whole system needs two solves an iteration, about 50 in all.\n" % (row["rows"], milliseconds(row, "factor"), milliseconds(row, "solve"))


def package_table(rows, kind):
    text = ["### Surface %s" % kind, "", line("rows", "operations", *(solver for solver in PACKAGES if solver != "chosen"), "chosen"), "|---|---|" + "---|" * len(PACKAGES)]
    for asked in sorted({int(row["asked"]) for row in rows}):
        mine = {row["solver"]: row for row in rows if int(row["asked"]) == asked}
        chosen = mine.get("chosen", {})
        cells = ["%s, %s" % (milliseconds(mine.get(solver), "factor"), milliseconds(mine.get(solver), "solve")) for solver in PACKAGES if solver != "chosen"]
        text.append(line(chosen.get("rows", ""), chosen.get("operations", ""), *cells, "%s: %s, %s" % (chosen.get("package", ""), milliseconds(chosen, "factor"), milliseconds(chosen, "solve"))))
    return text + [""]


def network_table(rows):
    solvers = [solver for solver in PACKAGES if solver != "chosen"] + ["MUMPS, whole system"]
    text = [line("network", "rows", "operations", *solvers, "chosen"), "|---|---|---|" + "---|" * (len(solvers) + 1)]
    for kind, asked in dict.fromkeys((row["surface"], row["asked"]) for row in rows if row["surface"].endswith(", open")):
        mine = {row["solver"]: row for row in rows if (row["surface"], row["asked"]) == (kind, asked)}
        chosen = mine.get("chosen", {})
        cells = ["%s, %s" % (milliseconds(mine.get(solver), "factor"), milliseconds(mine.get(solver), "solve")) for solver in solvers]
        text.append(line(kind.replace(" network, open", ""), chosen.get("rows", ""), chosen.get("operations", ""), *cells, "%s: %s, %s" % (chosen.get("package", ""), milliseconds(chosen, "factor"), milliseconds(chosen, "solve"))))
    return text + [""]


def search_table(rows):
    text = [line("constraints", "rows", "dependent rows", "search, ms", "both factorizations, ms"), "|---|---|---|---|---|"]
    closed = [row for row in rows if not row["surface"].endswith(", open")]
    for row in ({row["surface"]: row for row in closed}).values():  # the largest of each
        kind, what = row["surface"].split(" network, ")
        text.append(line("%s of a %s network" % ("balances" if what == "closed" else "ties", kind), row["rows"], row.get("dropped", ""), milliseconds(row, "search"), milliseconds(row, "factor")))
    return text + [""]


def rank_table(rows, kind, asked):
    text = ["### %s rows, surface %s" % (rows[0]["rows"], kind), "", line("ranks", "rows per rank", "pieces", "ranks that solve", "cut by METIS", "operations, busiest", "factor, ms", "solve, ms"), "|---|---|---|---|---|---|---|---|"]
    for row in rows:
        text.append(line(row["ranks"], "all" if row["rows_per_rank"] == str(10 ** 9) else row["rows_per_rank"], row.get("pieces", ""), row.get("solving_ranks", ""), "yes" if row.get("split") == "True" else "no",
                         row.get("operations", ""), milliseconds(row, "factor"), milliseconds(row, "solve")))
    return text + [""]


INTRODUCTION = """# The factorization of the Gram matrix

Which package factors S = C W C', and what does that cost?

- The plugin chooses by the predicted number of operations: PETSc's own Cholesky factorization below 1e7, CHOLMOD above.
%s- In networks CHOLMOD takes less time than MUMPS takes for the whole system.
- On bodies that are flat along their interface S may be 30 %% of the set-up and more ([in parallel](#in-parallel)).

All times are milliseconds, the least of several runs: first the set-up, then one solve. The set-up is the event AinsGramFact, which contains the ordering and the prediction. The solve is AinsGramSolve. [gram.csv](gram.csv) has all the runs.

"""


CHOICES = """## What was chosen

**Package.** CHOLMOD from 1e7 operations on. Near there PETSc's factorization in the AMD ordering has the shorter solves and CHOLMOD the shorter set-up, on networks and in space several times shorter. Below, both are short, and PETSc's reports a failure without an error. MUMPS' solves take longer than the others' at every size here; it is used from 2e9 operations on where CHOLMOD is missing.

**Ordering.** AMD. Nested dissection by METIS is counted as well where AMD needs 500 operations for each entry of the factor. This happens in space, not on surfaces, where nested dissection would save less than its own time. CHOLMOD gets the ordering that was counted.

**Rows per rank.** A rank gets 25000 rows where pieces can be shared out whole. On 100352 rows in three pieces the busiest rank then has 4.3e8 operations instead of 7e8, and on 2 ranks the factorization and the solves take about half of the time. Where ranks share a piece, by MUMPS, a solve takes several times as long as CHOLMOD's on one rank. So a piece is cut only where it has more than 16 times the rows per rank, 400000, and where PETSc has MUMPS, which factors the parts. It was not measured whether many ranks gain above that: the runs had two cores.

""".splitlines()


PACKAGES_TEXT = """## Packages

Two bodies touch on a flat square. Half of the surface sticks and half slips. The surface lies along the axes, or is turned by 20, 35 and 50 degrees. Along the axes S falls into three pieces, one for each component; turned, it is one piece. The volumes are left out: A is a diagonal matrix. Operations are those of the Cholesky factor in the AMD ordering, as predicted.

""".splitlines()


NETWORKS = """## Networks

C has a row for each node of a network, the balance of its flows; the unknowns are the flows of the branches. S is the Laplacian of the network. The networks are a grid in the plane, a power grid (a tree and half as many lines again), a random graph, and a grid in space. *MUMPS, whole system* is the LDL' factorization of [A C'; C 0]: first its analysis and factorization, then one solve.
""".splitlines() + [""]


SEARCH = """### Dependent rows

In closed networks, which no flow leaves, one balance depends on the others. Ties have a row x_i = x_j for each branch; all rows that close a loop depend on others. The search is the event AinsDependent; S is factored before and after it. A is a diagonal over two decades. The largest network of each kind is shown.
""".splitlines() + [""]


RANKS_TEXT = """## Rows per rank

`-pc_ainsworth_rows_per_rank` is varied. With more ranks than cores the ranks share the cores: operations and ratios then tell more than times.

""".splitlines()


def by_hand(folder):
    """The section of the page that no CSV has: single runs in parallel."""
    with open(os.path.join(folder, "gram.md")) as page:
        found = re.search(r"### In parallel\n.*?\n(?=## )", page.read(), re.S)
    return found.group(0).split("\n")[:-1] if found else []


def write(folder):
    rows = open_table(folder).rows
    one = [row for row in rows if row["experiment"] == "packages"]
    text = (INTRODUCTION % headline(one)).splitlines() + CHOICES
    nets = [row for row in rows if row["experiment"] == "networks"]
    many = [row for row in rows if row["experiment"] == "ranks"]
    if one:
        text += PACKAGES_TEXT
        for kind in dict.fromkeys(row["surface"] for row in one):
            text += package_table([row for row in one if row["surface"] == kind], kind)
        text += made_by(one) + by_hand(folder)
    if nets:
        text += NETWORKS + network_table(nets) + SEARCH + search_table(nets) + made_by(nets)
    if many:
        text += RANKS_TEXT
        for kind in dict.fromkeys(row["surface"] for row in many):
            for asked in dict.fromkeys(row["asked"] for row in many if row["surface"] == kind):
                text += rank_table([row for row in many if row["surface"] == kind and row["asked"] == asked], kind, asked)
        text += made_by(many)
    prose.write(os.path.join(folder, "gram.md"), text)
    print("wrote %s" % os.path.relpath(os.path.join(folder, "gram.md")))
