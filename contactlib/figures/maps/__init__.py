"""Figures of a sweep: one for each outcome, of the kind that its axes ask for.

Over one parameter an outcome is a line, over two a map, over three a row of maps; of random samples
it is a distribution, with what it depends on.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from contactlib.figures.maps.curves import curve_figure
from contactlib.figures.maps.layout import FAILED, RUN, layout
from contactlib.figures.maps.planes import plane_figure
from contactlib.figures.maps.samples import sample_figure
from contactlib.figures.maps.words import words
from contactlib.figures.style import save_pictures

if TYPE_CHECKING:
    from xarray import Dataset

__all__ = ["draw_maps", "map_figure"]

MARKED = (
    "Marked and named: the median, and what 5 % and 95 % of the runs do not exceed. "
    "A rank correlation shows rising or falling dependence only, not a rise and fall."
)


def draw_maps(dataset: Dataset, folder: str | os.PathLike[str]) -> list[Path]:
    """Draw each outcome of a sweep, as PNG and SVG.

    Parameters
    ----------
    dataset : xarray.Dataset
        As of `map_figure`.
    folder : path
        Where the files go; it is made if it is missing. They are called like the outcomes.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ValueError
        If an outcome's name is not one.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for outcome, values in dataset.data_vars.items():
        if outcome != FAILED and values.dims:
            if not str(outcome).isidentifier():  # it names files, and may come from anywhere
                raise ValueError(f"outcome {outcome!r} is no name of an outcome")
            figure = map_figure(dataset, str(outcome))
            written += save_pictures(figure, folder, str(outcome))
    return written


def map_figure(dataset: Dataset, outcome: str) -> Figure:
    """Draw one outcome of a sweep.

    Parameters
    ----------
    dataset : xarray.Dataset
        Outcomes over the axes of a grid, or over ``run`` with the drawn parameters as coordinates;
        over ``controller`` too where a run was needed. Outcomes and coordinates have ``units`` and
        ``long_name``. A variable ``failed`` is not zero where a run failed. The attributes
        ``title`` and ``source`` go into title and caption.
    outcome : str
        Name of a variable of it.

    Returns
    -------
    Figure
        Where an outcome is infinite, has no value, or its run failed, is marked as that.

    Raises
    ------
    ValueError
        If there is no such outcome, or it is one number.
    """
    if outcome not in dataset.data_vars or not dataset[outcome].dims:
        known = [str(name) for name, values in dataset.data_vars.items() if values.dims]
        raise ValueError(f"outcome must be one of {', '.join(known)}; got {outcome!r}")
    sweep, source = (_plain(dataset.attrs.get(key, "")) for key in ("title", "source"))
    described = _plain(dataset[outcome].attrs.get("long_name", ""))
    name = words(dataset[outcome]).name
    title = f"{name[:1].upper()}{name[1:]}{': ' if sweep else ''}{sweep}"
    if RUN in dataset[outcome].dims:
        caption = _sentences(described, MARKED, source)
        return sample_figure(dataset, outcome, title=title, caption=caption)
    chosen = layout(dataset, outcome)
    draw = plane_figure if len(chosen.axes) == 2 else curve_figure
    return draw(chosen, title=title, caption=_sentences(described, chosen.note, source))


def _plain(text: object) -> str:
    """A text from a file, in which a dollar is a dollar."""
    return str(text).replace("$", r"\$")


def _sentences(*texts: str) -> str:
    """A caption of those texts that are not empty."""
    return " ".join(f"{text[:1].upper()}{text[1:]}".rstrip(".") + "." for text in texts if text)
