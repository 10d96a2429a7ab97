"""Figures: the only room that imports matplotlib. Every function returns a `Figure`."""

from contactlib.figures.patch import contact_patch, contact_patches
from contactlib.figures.runs import creep_curve, fold_diagram, time_histories
from contactlib.figures.style import save

__all__ = [
    "contact_patch",
    "contact_patches",
    "creep_curve",
    "fold_diagram",
    "save",
    "time_histories",
]
