#!/usr/bin/env python3
"""Which studies another revision made in the same way, so that they need no new run.

/usr/bin/python3 docs/study/same.py REVISION            all studies that were made with its code
/usr/bin/python3 docs/study/same.py REVISION contact lu these

Builds the revision, then runs a small version of each long study, column `check` of docs/studies.csv, once with it and
twice with the build of this code (AINSWORTH_BUILD, default build/). What these two have in common, iterations and
errors but not seconds, has to be the same in all three: then the study is of this code, too, and docs/studies.csv says
so. Others are to be made again by refresh.py. Seconds may have changed: whoever makes something quicker or slower makes
the study again. What is built and run is in <build>/same.
"""
import argparse
import csv
import os
import shlex
import subprocess
import sys
import time

import refresh
from common import machine

FOLDER = os.path.join(machine.BUILD, "same")


def build(revision):
    """The build folder of a revision, made if it is not there."""
    source = os.path.join(FOLDER, refresh.code(revision))
    made = os.path.join(source, "build")
    if not os.path.exists(os.path.join(source, ".git")):
        subprocess.run(["git", "clone", "-q", machine.ROOT, source], check=True)
        subprocess.run(["git", "-C", source, "checkout", "-q", refresh.git("rev-parse", revision)], check=True)
    print("building %s" % revision, flush=True)
    with open(os.path.join(FOLDER, "build.log"), "w", encoding="utf-8") as log:
        with open(os.path.join(machine.BUILD, "CMakeCache.txt"), encoding="utf-8") as cache:
            petsc = [line for line in cache if line.startswith("PETSC_DIR:")]
        choice = ["-D" + petsc[0].strip()] if petsc else []
        for command in (["cmake", "-S", source, "-B", made, "-DBUILD_TESTING=ON", *choice],
                        ["make", "-C", made, "-j%d" % os.cpu_count()]):
            subprocess.run(command, check=True, stdout=log, stderr=subprocess.STDOUT)
    return made


def tables(checkout, files, began):
    """The rows of the CSVs that are newer than `began`, by file."""
    found = {}
    for name in files:
        path = os.path.join(checkout, name)
        inside = [os.path.join(path, each) for each in os.listdir(path)] if os.path.isdir(path) else [path]
        for each in inside:
            if each.endswith(".csv") and os.path.exists(each) and os.path.getmtime(each) >= began:
                with open(each, newline="", encoding="utf-8") as file:
                    found[os.path.relpath(each, checkout)] = list(
                        csv.DictReader(line for line in file if not line.startswith("#")))
    return found


def run(row, folder, checkout, log):
    """The tables that the small version of a study makes with a build; none if it fails."""
    for command in (["checkout", "-q", "--", "docs"], ["clean", "-fdq", "docs"]):
        subprocess.run(["git", "-C", checkout, *command], check=True)
    began = time.time()
    environment = dict(machine.ENVIRONMENT, AINSWORTH_BUILD=folder, AINSWORTH_STUDY_BEGAN=str(began))
    for command in row["check"].split("; "):
        ended = subprocess.run(["/usr/bin/python3"] + shlex.split(command), cwd=checkout, env=environment, stdout=log,
                               stderr=subprocess.STDOUT, check=False)
        if ended.returncode not in (0, machine.MISSED):
            return {}
    return tables(checkout, row["files"].split(), began)


def differences(old, new):
    """Where a run of another build differs from two of this one in what these have in common."""
    runs = [old] + new
    if not runs[0] or any(table.keys() != runs[0].keys() for table in runs):
        return ["it failed, or made other tables"]
    found = []
    for name in runs[0]:
        rows = [table[name] for table in runs]
        if len({len(each) for each in rows}) > 1:
            found.append("%s: other rows" % name)
            continue
        for column in rows[0][0] if rows[0] else ():
            before, now, again = [[row[column] for row in each] for each in rows]
            changed = [k for k in range(len(now)) if before[k] != now[k]]
            if now == again and changed:
                found.append("%s: %s of row %d is %s, was %s" % (name, column, changed[0] + 1, now[changed[0]],
                                                                 before[changed[0]]))
    return found


def main():
    """See above."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revision")
    parser.add_argument("studies", nargs="*")
    chosen = parser.parse_args()
    before, now, rows = refresh.code(chosen.revision), refresh.code(), refresh.read()
    if before == now:
        sys.exit("%s has the code of this revision" % chosen.revision)
    wanted = [row for row in rows if row["code"] == before and row["check"]
              and (not chosen.studies or row["study"] in chosen.studies)]
    os.makedirs(FOLDER, exist_ok=True)
    checkout = os.path.join(FOLDER, "checkout")
    if not os.path.exists(checkout):
        subprocess.run(["git", "clone", "-q", machine.ROOT, checkout], check=True)
    for command in (["fetch", "-q", machine.ROOT], ["checkout", "-q", "--force", refresh.git("rev-parse", "HEAD")]):
        subprocess.run(["git", "-C", checkout, *command], check=True)
    old = build(chosen.revision)
    other, began = [], time.monotonic()
    for number, row in enumerate(wanted):
        print("%d of %d: %s; %.0f min so far" % (number + 1, len(wanted), row["study"],
                                                 (time.monotonic() - began) / 60), flush=True)
        with open(os.path.join(FOLDER, row["study"] + ".log"), "w", encoding="utf-8") as log:
            made = [run(row, folder, checkout, log) for folder in (old, machine.BUILD, machine.BUILD)]
        found = differences(made[0], made[1:])
        if found:
            other.append(row["study"])
            print("    %s" % "\n    ".join(found), flush=True)
            continue
        row["code"] = now
        refresh.write(rows)
    print("to be made again: " + " ".join(other) if other else "all of them are of this code, too")


if __name__ == "__main__":
    main()
