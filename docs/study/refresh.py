#!/usr/bin/env python3
"""Makes the figures of the pages again, study by study, from the code as it is; docs/studies.csv has all studies.

/usr/bin/python3 docs/study/refresh.py --list           each study: minutes, its files, and whether it is of this code
/usr/bin/python3 docs/study/refresh.py                  all that are of older code; hours. Begun again, it goes on
/usr/bin/python3 docs/study/refresh.py contact lu       these
/usr/bin/python3 docs/study/refresh.py --minutes 60     what fits into an hour, the oldest first

Needs a build of the committed code (AINSWORTH_BUILD, default build/) and an otherwise idle machine. What a study prints
is in <build>/studies/. A study that fails leaves its files as they were, and the others go on; what it measured is
in <build>/studies/, too.
"""
import argparse
import csv
import datetime
import hashlib
import os
import re
import shlex
import subprocess
import sys
import time

from common import machine

TABLE = os.path.join(machine.ROOT, "docs", "studies.csv")
COLUMNS = ("study", "minutes", "code", "date", "machine", "files", "commands", "check")


def git(*arguments):
    """The output of a command of git."""
    return subprocess.run(["git", "-C", machine.ROOT, *arguments], check=True, stdout=subprocess.PIPE,
                          text=True).stdout.strip()


def code(revision="HEAD"):
    """What identifies the sources, without their comments and layout."""
    if git("status", "--porcelain", "--", "src", "include"):
        sys.exit("src or include has changes that are not committed: whose figures would these be?")
    digest = hashlib.sha1()
    for name in git("ls-tree", "-r", "--name-only", revision, "--", "src", "include").split():
        text = re.sub(r"/\*.*?\*/|//[^\n]*", "", git("show", revision + ":" + name), flags=re.DOTALL)
        digest.update((name + "".join(text.split())).encode())
    return digest.hexdigest()[:10]


def read():
    """The rows of the table."""
    with open(TABLE, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def write(rows):
    """Replaces the table."""
    with open(TABLE, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def run(row, folder):
    """Runs the commands of a study; true if all end well, though a bound may be missed. Its tables begin empty."""
    files = row["files"].split()
    began = time.time()
    environment = dict(machine.ENVIRONMENT, AINSWORTH_STUDY_BEGAN=str(began))
    with open(os.path.join(folder, row["study"] + ".log"), "w", encoding="utf-8") as log:
        for command in row["commands"].split("; "):
            log.write("$ %s\n" % command)
            log.flush()
            ended = subprocess.run(["/usr/bin/python3"] + shlex.split(command), cwd=machine.ROOT, stdout=log,
                                   stderr=subprocess.STDOUT, env=environment, check=False)
            if ended.returncode not in (0, machine.MISSED):
                with open(os.path.join(folder, row["study"] + ".diff"), "w", encoding="utf-8") as kept:
                    kept.write(git("diff", "--", *files) + "\n")
                git("checkout", "--", *files)
                return False
        old = [name for name in files if name.endswith(".csv")
               and os.path.getmtime(os.path.join(machine.ROOT, name)) < began]
        log.write("".join("%s was not made\n" % name for name in old))
    return not old


def main():
    """See above."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("studies", nargs="*")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--minutes", type=float, default=float("inf"))
    chosen = parser.parse_args()
    now, rows = code(), read()
    unknown = set(chosen.studies) - {row["study"] for row in rows}
    if unknown:
        sys.exit("no study: " + " ".join(sorted(unknown)))
    if chosen.list:
        for row in rows:
            print("%-12s %4s min  %s  %s" % (row["study"], row["minutes"],
                                             "of this code" if row["code"] == now else "of " + (row["date"] or "?"),
                                             row["files"]))
        return
    made = [row for row in rows if row["commands"].startswith("docs/study/")]
    for row in rows:
        if row["study"] in chosen.studies and row not in made:
            sys.exit("%s is made by hand: %s" % (row["study"], row["commands"]))
    wanted = [row for row in made if row["study"] in chosen.studies] if chosen.studies else sorted(
        (row for row in made if row["code"] != now), key=lambda row: row["date"])
    folder = os.path.join(machine.BUILD, "studies")
    os.makedirs(folder, exist_ok=True)
    begin, failed = time.monotonic(), []
    for number, row in enumerate(wanted):
        spent = (time.monotonic() - begin) / 60
        if spent + float(row["minutes"] or 0) > chosen.minutes:
            continue
        print("%d of %d: %s, about %s min; %.0f min so far, load %.1f" % (number + 1, len(wanted), row["study"],
                                                                        row["minutes"] or "?", spent,
                                                                        machine.load()), flush=True)
        started = time.monotonic()
        if not run(row, folder):
            failed.append(row["study"])
            print("failed: see %s.log" % os.path.join(folder, row["study"]), flush=True)
            continue
        row.update(minutes="%.0f" % max(1, (time.monotonic() - started) / 60), code=now,
                   date=datetime.date.today().isoformat(), machine=machine.describe())
        write(rows)
    subprocess.run([sys.executable, os.path.join(machine.ROOT, "docs", "study", "figures.py")], check=True)
    if failed:
        sys.exit("failed: " + " ".join(failed))


if __name__ == "__main__":
    main()
