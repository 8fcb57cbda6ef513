"""Plots as SVG, the same bytes for the same numbers."""
import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "ainsworth"
from matplotlib import pyplot  # noqa: E402 (the backend is chosen first)


def save(figure, path):
    """<path>.svg"""
    figure.savefig(path + ".svg", metadata={"Date": None})
    pyplot.close(figure)
