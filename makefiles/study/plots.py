"""Plots as SVG and PNG, the same bytes for the same numbers."""
import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "ainsworth"
from matplotlib import pyplot  # noqa: E402 (the backend is chosen first)


def save(figure, path):
    """<path>.svg and <path>.png"""
    figure.savefig(path + ".svg", metadata={"Date": None})
    figure.savefig(path + ".png", dpi=110)
    pyplot.close(figure)
