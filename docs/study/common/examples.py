"""docs/examples.csv: small runs whose iterations and errors pages name."""
import os
import sys

from . import machine, measured

PMATS = ("jcb", "id", "bj_cc", "bj_cg", "cc", "cg")  # with the paper's variant, and on
VARIATIONS = ("-floating", "-curved 0.15", "-stick 0", "-stick 1", "-contact 0")
PATH = os.path.join(machine.ROOT, "docs", "examples.csv")


def put(name, ranks, command, iterations, results):
    """results: words key=value."""
    row = {"name": name, "ranks": ranks, "command": command, "iterations": " ".join(map(str, iterations)),
        "results": " ".join(results)}
    print("%s, %s ranks: %s; %s" % (name, ranks, row["iterations"], row["results"]), flush=True)
    about = {"command": "python3 " + os.path.relpath(os.path.abspath(sys.argv[0]), machine.ROOT),
        "machine": machine.describe()}
    measured.merge(PATH, about, list(row), [row], ("name", "ranks"))


def read(folder):
    """By name and ranks: iterations, and a dictionary of the results."""
    rows = measured.read(os.path.join(folder, "examples.csv"))[1]
    return {(row["name"], int(row["ranks"])): (list(map(int, row["iterations"].split())),
            dict(word.split("=", 1) for word in row["results"].split())) for row in rows}
