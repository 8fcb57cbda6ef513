"""Plots as SVG, the same bytes for the same numbers."""
import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams.update({"svg.hashsalt": "ainsworth", "font.size": 9, "axes.titlesize": "medium"})
from matplotlib import pyplot, ticker  # noqa: E402 (the backend is chosen first)


def check_inside(figure):
    """An error if a title, a label or a legend leaves the figure, which would clip it."""
    box, (width, height) = figure.get_tightbbox(figure.canvas.get_renderer()), figure.get_size_inches()
    if min(box.x0, box.y0, width - box.x1, height - box.y1) < -0.01:
        raise ValueError("something is drawn outside of a figure of %.2f x %.2f inches: %.2f to %.2f by %.2f to "
                         "%.2f" % (width, height, box.x0, box.x1, box.y0, box.y1))


def save(figure, path):
    """<path>.svg"""
    check_inside(figure)
    figure.savefig(path + ".svg", metadata={"Date": None})
    pyplot.close(figure)

WIDTH = 10  # inches of a picture: on a page of 800 pixels its 9 points are 10 of them
STYLES = (  # color, marker, line and hatch: told apart without color, too
    ("#0072b2", "o", "-", ""),
    ("#56b4e9", "s", "--", "//"),
    ("#009e73", "^", "-.", "\\\\"),
    ("#e69f00", "D", "-", "xx"),
    ("#d55e00", "v", "--", "--"),
    ("#cc79a7", "P", ":", "||"),
    ("#8c564b", "<", "-.", "++"),
    ("#7f3c8d", "X", "-", "////"),
    ("#999999", ">", "--", "xxxx"),
    ("#000000", "*", ":", "----"),
    ("#bcbd22", "h", "--", ".."),
)
SOLVERS = ("ainsworth", "ainsworth_gamg", "ainsworth_paper", "elimination", "fieldsplit_full",  # each has its style
           "fieldsplit_gkb", "fieldsplit_selfp", "golub_greif", "minres", "mumps", "mumps_blr")


def style(number, label):
    """Of a curve: the first, which is ours, is bold and filled."""
    color, marker, line, _ = STYLES[number % len(STYLES)]
    weight = {"linewidth": 1.1, "fillstyle": "none"} if number else {"linewidth": 2.2, "fillstyle": "full"}
    return {"color": color, "marker": marker, "linestyle": line, "label": label, "markersize": 6, **weight}


def solver_style(name):
    """Those of a user are points."""
    return style(SOLVERS.index(name), name) if name in SOLVERS else {"color": "#666666", "marker": ".", "label": name}


def bar(number, label):
    color, _, _, hatch = STYLES[number]
    return {"facecolor": color, "hatch": hatch, "edgecolor": "white", "linewidth": 0, "label": label}


def seconds(axis):
    """A logarithmic axis of a decade or two, which powers of ten alone would leave without numbers."""
    axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
    axis.set_major_formatter(ticker.StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(ticker.NullFormatter())


def legend_below(figure, handles):
    """One legend for all panels, below them, in as many columns as fit."""
    renderer = figure.canvas.get_renderer()
    for columns in range(min(len(handles), 5), 0, -1):
        legend = figure.legend(list(handles.values()), list(handles), loc="lower center", ncol=columns)
        extent = legend.get_window_extent(renderer)
        if columns == 1 or extent.width < 0.98 * figure.bbox.width:
            break
        legend.remove()
    figure.tight_layout(rect=(0, extent.y1 / figure.bbox.height, 1, 1))
