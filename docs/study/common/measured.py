"""CSVs whose head, lines of `# key: value`, says how they were made; and the words for a bound that holds or does not.
"""
import csv
import os

from . import machine


def experiment(parser, names):
    """Arguments of a script: one of its experiments, or no runs."""
    group = parser.add_mutually_exclusive_group(required=True)
    group.add_argument("experiment", nargs="?", choices=names)
    group.add_argument("--report", action="store_true", help="no runs: the text from the CSV files")


def provenance():
    return {"command": machine.command_line(), "machine": machine.describe(),
            "load at the end": "%.1f" % machine.load()}


def save(path, about, columns, rows):
    with open(path, "w", newline="") as file:
        file.writelines("# %s: %s\n" % pair for pair in about.items())
        table = csv.DictWriter(file, columns, lineterminator="\n", extrasaction="ignore")
        table.writeheader()
        table.writerows(rows)


def begun(path):
    """Is there a file to add to? refresh.py makes a study anew: what is older than its begin does not count."""
    return os.path.exists(path) and os.path.getmtime(path) >= float(os.environ.get("AINSWORTH_STUDY_BEGAN", 0))


def merge(path, about, columns, rows, key):
    """Saves the rows beside those of other keys that are there, with the commands and machines of both."""
    if begun(path):
        before, found = read(path)
        made = {tuple(str(row[name]) for name in key) for row in rows}
        kept = [row for row in found if tuple(row[name] for name in key) not in made]
        if kept:
            rows = kept + rows
            about = dict(about, **{name: "; ".join(dict.fromkeys(before[name].split("; ") + [about[name]]))
                                   for name in ("command", "machine")})
    save(path, about, columns, rows)


def read(path):
    """The head as a dictionary, and the rows."""
    with open(path, newline="") as file:
        lines = file.readlines()
    about = dict(line[2:].strip().split(": ", 1) for line in lines if line.startswith("# "))
    return about, list(csv.DictReader(line for line in lines if not line.startswith("#")))


def verdict(holds):
    return "pass" if holds else "**miss**"
