"""Draws what -pc_ainsworth_monitor_error csv:error.csv has written: python3 monitor.py error.csv error.png (needs
matplotlib)
"""
import csv
import sys

import matplotlib
matplotlib.use("Agg")
from matplotlib import pyplot  # noqa: E402 (the backend is chosen first)

with open(sys.argv[1]) as file:
    rows = [row for row in csv.DictReader(file) if row["solve"] != "solve"]
figure, panel = pyplot.subplots(figsize=(6.4, 4), layout="constrained")
for name, style in (("error_upper", "v-"), ("error_true", "k."), ("error_lower", "^-"), ("primal_residual", "--")):
    points = [(float(row["seconds"]), float(row[name])) for row in rows if row[name]]
    if points:
        panel.semilogy(*zip(*points), style, markersize=4, label=name.replace("_", " "))
panel.set_xlabel("seconds")
panel.legend()
figure.savefig(sys.argv[2])
