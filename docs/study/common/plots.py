"""Plots as SVG, the same bytes for the same numbers."""
import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "ainsworth"
from matplotlib import pyplot  # noqa: E402 (the backend is chosen first)


def save(figure, path):
    """<path>.svg"""
    figure.savefig(path + ".svg", metadata={"Date": None})
    pyplot.close(figure)

# one color, marker and line for each solver on all pages; told apart without color too
SOLVER_STYLES = {
    "ainsworth": ("#0072b2", "o", "-"), "ainsworth_gamg": ("#56b4e9", "s", "--"), "ainsworth_paper": ("#009e73", "^", "-."), "elimination": ("#e69f00", "D", "-"),
    "fieldsplit_full": ("#d55e00", "v", "--"), "fieldsplit_gkb": ("#cc79a7", "P", ":"), "fieldsplit_selfp": ("#d55e00", "<", "-."), "golub_greif": ("#7f3c8d", "X", "-"),
    "minres": ("#999999", ">", "--"), "mumps": ("#000000", "*", ":"),
}


def solver_style(name):
    color, marker, line = SOLVER_STYLES.get(name, ("#666666", ".", "-"))
    ours = name == "ainsworth"
    return {"color": color, "marker": marker, "linestyle": line, "linewidth": 2.2 if ours else 1.1, "markersize": 6, "fillstyle": "full" if ours else "none", "label": name}


def legend_below(figure, handles, columns):
    """One legend for all panels, below them."""
    lines = -(-len(handles) // columns)
    figure.legend(list(handles.values()), list(handles), loc="lower center", ncol=columns, fontsize=9)
    room = (0.3 + 0.22 * lines) / figure.get_size_inches()[1]
    figure.tight_layout(rect=(0, room, 1, 1))
