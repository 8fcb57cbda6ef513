"""Plots as SVG, the same bytes for the same numbers."""
import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "ainsworth"
from matplotlib import pyplot  # noqa: E402 (the backend is chosen first)


def check_inside(figure):
    """An error if a title, a label or a legend leaves the figure, which would clip it."""
    box, (width, height) = figure.get_tightbbox(figure.canvas.get_renderer()), figure.get_size_inches()
    if min(box.x0, box.y0, width - box.x1, height - box.y1) < -0.01:
        raise ValueError("something is drawn outside of a figure of %.2f x %.2f inches: %.2f to %.2f by %.2f to %.2f" % (width, height, box.x0, box.x1, box.y0, box.y1))


def save(figure, path):
    """<path>.svg"""
    check_inside(figure)
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


def legend_below(figure, handles):
    """One legend for all panels, below them, in as many columns as fit."""
    renderer = figure.canvas.get_renderer()
    for columns in range(min(len(handles), 5), 0, -1):
        legend = figure.legend(list(handles.values()), list(handles), loc="lower center", ncol=columns, fontsize=9)
        if columns == 1 or legend.get_window_extent(renderer).width < 0.98 * figure.bbox.width:
            break
        legend.remove()
    room = (0.3 + 0.22 * -(-len(handles) // max(columns, 1))) / figure.get_size_inches()[1]
    figure.tight_layout(rect=(0, room, 1, 1))
