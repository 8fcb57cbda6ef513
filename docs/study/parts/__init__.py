"""Constrained, unstructured parts as a mesher makes them. Units are mm, N, MPa and tonne."""
from importlib import import_module

# module and function
PARTS = {
    "flange": ("flange", "make"),
    "rodrbe3": ("rod", "make_rbe3"),
    "rodrbe2": ("rod", "make_rbe2"),
    "sector": ("sector", "make"),
    "cell": ("cell", "make"),
    "cellmean": ("cell", "make_mean"),
    "rebars": ("rebars", "make"),
    "housing": ("housing", "make"),
    "laminate": ("laminate", "make"),
}


def make(name, h, order):
    """The part of this name with elements of about h [mm], linear (1) or quadratic (2)."""
    module, function = PARTS[name]
    return getattr(import_module("." + module, __name__), function)(h, order)
