"""Runs the study: one process per system (solver.py), a time limit per run, one CSV."""
import concurrent.futures
import json
import os
import queue
import re
import subprocess
import sys
import threading

from . import cases, machine, measured

COLUMNS = ["parameter", "value", "options", "unknowns", "constraints", "configuration", "iterations", "reason", "setup",
           "solve", "error", "constraint", "primal"]
REFERENCE_LIMIT = 600
MORE_THAN_FAST = 2.0  # seconds: a run that took longer is not repeated


def worker(job, path):
    """Starts solver.py; its lines come through a queue, None at its end."""
    with open(path, "w") as file:
        json.dump(job, file)
    process = subprocess.Popen([sys.executable, os.path.join(os.path.dirname(os.path.abspath(__file__)), "solver.py"),
                                path], stdout=subprocess.PIPE, stderr=open(path + ".log", "w"), text=True,
                               env=machine.ENVIRONMENT)
    lines = queue.Queue()

    def pump():
        for line in process.stdout:
            if line.startswith("{"):
                lines.put(json.loads(line))
        lines.put(None)

    threading.Thread(target=pump, daemon=True).start()
    return process, lines


def solve(options, configs, repeat, limit, say=lambda text: None):
    """All configurations on one system: its sizes and a list of rows in the order of configs."""
    with machine.workspace() as folder:
        prefix = os.path.join(folder, "system")
        machine.write_system(options, prefix)
        todo = list(enumerate(configs))
        rows, sizes = {}, {}
        while todo:
            job = {"plugin": machine.PLUGIN, "prefix": prefix, "configs": todo, "repeat": repeat,
                   "enough": MORE_THAN_FAST}
            path = os.path.join(folder, "job.json")
            process, lines = worker(job, path)
            allowed, ready = REFERENCE_LIMIT, False
            while todo:
                try:
                    line, reason = lines.get(timeout=allowed), "the solver ended without an answer"
                except queue.Empty:
                    line, reason = None, "time limit of %d s" % allowed
                if line is None:
                    if not ready:
                        process.kill()
                        with open(path + ".log") as file:
                            reason += ": " + (file.read().strip().splitlines() or ["no message"])[-1]
                        raise RuntimeError("no reference solution for %s: %s" % (options, reason))
                    rows[todo.pop(0)[0]] = {"reason": reason}
                    break
                if "number" in line:
                    rows[line["number"]] = line
                    say(configs[line["number"]]["name"])
                    todo = [entry for entry in todo if entry[0] != line["number"]]
                elif "ready" in line:
                    ready, allowed = True, limit
                else:
                    sizes = line
            process.kill()
            process.wait()
        return sizes, [rows[i] for i in range(len(configs))]


def select(configs, options):
    """A alone only where it is regular."""
    return [c for c in configs if "-floating" not in options or c["system"] == "constrained"]


def save(path, arguments, wanted, results):
    """All that is known so far: written after every system, so that an interrupted study is not lost."""
    lines = []
    for parameter, value, options in wanted:
        text = cases.system(arguments.n1, arguments.n2, options)
        sizes, found = results.get(text, ({}, {}))
        for name, row in found.items():
            line = {"parameter": parameter, "value": value, "options": text, "configuration": name}
            line.update({key: sizes[key] for key in ("unknowns", "constraints") if key in sizes})
            for key in ("iterations", "reason"):
                line[key] = row.get(key)
            for key in ("setup", "solve"):
                line[key] = "" if row.get(key) is None else "%.4f" % row[key]
            for key in ("error", "constraint", "primal"):
                line[key] = "" if row.get(key) is None else "%.3e" % row[key]
            lines.append(line)
    measured.save(path, measured.provenance(), COLUMNS, lines)


def stored(path, configs):
    """What the CSV has of these configurations, as study() keeps it."""
    answer, names = {}, [c["name"] for c in configs]
    for row in measured.read(path)[1]:
        if row["configuration"] not in names:
            continue
        sizes, found = answer.setdefault(row["options"], ({}, {}))
        sizes.update({key: row[key] for key in ("unknowns", "constraints") if row[key]})
        found[row["configuration"]] = {key: float(row[key]) if row[key] else None
                                       for key in ("setup", "solve", "error", "constraint", "primal")}
        found[row["configuration"]].update(iterations=row["iterations"] or None, reason=row["reason"])
    return answer


def order(found, names):
    return {name: found[name] for name in names if name in found}


def study(folder, arguments):
    os.makedirs(folder, exist_ok=True)
    configs = cases.configurations(arguments.max_it)
    names = [c["name"] for c in configs]
    wanted = cases.cases(arguments.n1, arguments.n2, arguments.quick)
    systems = {}
    for parameter, value, options in wanted:
        systems.setdefault(cases.system(arguments.n1, arguments.n2, options), []).append((parameter, value))
    path = os.path.join(folder, "stability.csv")
    results, done = stored(path, configs) if arguments.only else {}, [0]
    configs = [c for c in configs if re.search(arguments.only, c["name"])]
    lock = threading.Lock()

    def one(options):
        chosen = select(configs, options)
        try:
            sizes, rows = solve(options, chosen, arguments.repeat, arguments.limit)
        except RuntimeError as error:
            sizes, rows = {}, [{"reason": str(error)} for _ in chosen]
        found = dict(zip((c["name"] for c in chosen), rows))
        if "-floating" in options:
            for name in ("alone", "alone, same x"):
                found[name] = {"reason": "n/a: A is singular"}
        with lock:
            done[0] += 1
            short = ", ".join("%s %s" % (name, row.get("iterations", row["reason"]))
                              for name, row in found.items() if name in ("alone", "weighted auto", "paper jcb"))
            print("%d of %d: %s: %s" % (done[0], len(systems), options, short), flush=True)
            results[options] = (sizes, order(dict(results.get(options, ({}, {}))[1], **found), names))
            save(path, arguments, wanted, results)

    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        list(pool.map(one, systems))
