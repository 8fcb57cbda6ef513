"""CSVs whose head, lines of `# key: value`, says how they were made; and the words for a bound that holds or does not."""
import csv

from . import machine


def provenance():
    return {"command": machine.command_line(), "machine": machine.describe(), "load at the end": "%.1f" % machine.load()}


def save(path, about, columns, rows):
    with open(path, "w", newline="") as file:
        file.writelines("# %s: %s\n" % pair for pair in about.items())
        table = csv.DictWriter(file, columns, lineterminator="\n", extrasaction="ignore")
        table.writeheader()
        table.writerows(rows)


def read(path):
    """The head as a dictionary, and the rows."""
    with open(path, newline="") as file:
        lines = file.readlines()
    about = dict(line[2:].strip().split(": ", 1) for line in lines if line.startswith("# "))
    return about, list(csv.DictReader(line for line in lines if not line.startswith("#")))


def verdict(holds):
    return "pass" if holds else "**miss**"
