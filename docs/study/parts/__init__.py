"""Constrained, unstructured parts as a mesher makes them. Units are mm, N, MPa and tonne."""
from importlib import import_module

# module, function
PARTS = {
    "flange": ("flange", "make"),
    "rodrbe3": ("rod", "make_rbe3"),
    "rodrbe2": ("rod", "make_rbe2"),
    "sector": ("sector", "make"),
    "cell": ("cell", "make"),
    "cellmean": ("cell", "make_mean"),
    "rebars": ("rebars", "make"),
    "rebarsturned": ("rebars", "make_turned"),
    "housing": ("housing", "make"),
    "laminate": ("laminate", "make"),
}

# sizes of elements [mm], about these numbers of unknowns; small: 1300 to 8500
SIZES = {size: dict(zip(PARTS, h)) for size, h in {
    "small": (30, 12, 12, 18, 0.08, 0.08, 60, 60, 20, 14),
    "20k": (9, 3, 3, 3.75, 0.057, 0.057, 18.5, 18.5, 6.3, 3.6),
    "150k": (3.6, 1.4, 1.4, 1.7, 0.026, 0.026, 8.6, 8.6, 2.66, 1.4),
    "300k": (2.85, 1.1, 1.1, 1.34, 0.0205, 0.0205, 6.8, 6.8, 2.1, 1.1),
    "p2": (20, 5, 5, 7, 0.09, 0.09, 29, 29, 10, 7),
}.items()}
ORDERS = {"small": 1, "20k": 1, "150k": 1, "300k": 1, "p2": 2}


def make(name, h, order):
    """The part of this name with elements of about h [mm], linear (1) or quadratic (2)."""
    module, function = PARTS[name]
    return getattr(import_module("." + module, __name__), function)(h, order)


def sized(name, size):
    """Elements [mm] and order of a part in a size, which may be that of its linear elements, as 0.2."""
    if size in SIZES:
        return SIZES[size][name], ORDERS[size]
    return float(size), 1
