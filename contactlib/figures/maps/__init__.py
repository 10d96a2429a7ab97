"""Figures of a sweep: one for each outcome, of a kind that suits its axes.

An outcome over one parameter is drawn as lines, over two as a map, over three as a row of maps;
random samples are drawn as a distribution, with the most influential parameters.
"""

from __future__ import annotations

import json
import os
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from contactlib.figures.files import PICTURES, save_pictures
from contactlib.figures.maps.curves import curve_figure
from contactlib.figures.maps.layout import FAILED, RUN, layout
from contactlib.figures.maps.meaning import words
from contactlib.figures.maps.planes import plane_figure
from contactlib.figures.maps.samples import sample_figure
from contactlib.figures.style import setting
from contactlib.files.model import build_model

if TYPE_CHECKING:
    from xarray import Dataset

__all__ = ["draw_maps", "map_figure"]

MARKED = (
    "Marks and key: the median (5th to 95th percentile). "
    "A rank correlation shows rising or falling dependence only, not a rise and fall."
)


def draw_maps(
    dataset: Dataset, folder: str | os.PathLike[str], formats: Sequence[str] = PICTURES
) -> list[Path]:
    """Draw each outcome of a sweep.

    Parameters
    ----------
    dataset : xarray.Dataset
        As for `map_figure`.
    folder : path
        Folder for the files, created if missing. A file has the name of its outcome.
    formats : sequence of str, optional
        Suffixes of the files, each a format that matplotlib writes. Default: PNG and SVG.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ValueError
        If an outcome's name is not an identifier, or matplotlib does not write a format.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for outcome, values in dataset.data_vars.items():
        if outcome != FAILED and values.dims:
            if not str(outcome).isidentifier():  # it may come from any file
                raise ValueError(f"outcome {outcome!r} must be an identifier: it names a file")
            figure = map_figure(dataset, str(outcome))
            written += save_pictures(figure, folder, str(outcome), formats)
    return written


def map_figure(dataset: Dataset, outcome: str) -> Figure:
    """Draw one outcome of a sweep.

    Parameters
    ----------
    dataset : xarray.Dataset
        Outcomes over the axes of a grid, or over ``run`` with the sampled parameters as
        coordinates; outcomes of runs also have the dimension ``controller``. Outcomes and
        coordinates have ``units`` and ``long_name``. A variable ``failed`` is not zero where a run
        failed. The attributes ``title`` and ``source`` go into title and caption.
    outcome : str
        Name of a variable of the dataset.

    Returns
    -------
    Figure
        Infinite outcomes, outcomes without a value and failed runs have marks of their own.

    Raises
    ------
    ValueError
        If there is no such outcome, or it is a single number.
    """
    if outcome not in dataset.data_vars or not dataset[outcome].dims:
        known = [str(name) for name, values in dataset.data_vars.items() if values.dims]
        raise ValueError(f"outcome = {outcome!r} must be one of: {', '.join(known)}")
    sweep, source = (_plain(dataset.attrs.get(key, "")) for key in ("title", "source"))
    described = _plain(dataset[outcome].attrs.get("long_name", ""))
    constants = _constants(dataset)
    name = words(dataset[outcome]).name
    title = f"{name[:1].upper()}{name[1:]}{': ' if sweep else ''}{sweep}"
    if RUN in dataset[outcome].dims:
        caption = _sentences(described, MARKED, source, constants)
        return sample_figure(dataset, outcome, title=title, caption=caption)
    chosen = layout(dataset, outcome)
    draw = plane_figure if len(chosen.axes) == 2 else curve_figure
    return draw(chosen, title=title, caption=_sentences(described, chosen.note, source, constants))


def _plain(text: object) -> str:
    """Text from a file, with dollar signs kept from starting a formula."""
    return str(text).replace("$", r"\$")


def _sentences(*texts: str) -> str:
    """Join the texts that are not empty into a caption; each ends with one full stop."""
    given = (re.sub(r"[ \t\r\n]+", " ", text).strip().rstrip(" .") for text in texts)
    return " ".join(
        f"{text[:1].upper()}{text[1:]}{'' if text[-1] in '!?' else '.'}" for text in given if text
    )


def _constants(dataset: Dataset) -> str:
    """Parameters of the wheelset that the sweep's attributes contain, if its law is at hand."""
    try:
        vehicle = json.loads(str(dataset.attrs.get("vehicle", "{}")))
        if "law" in vehicle:  # it may take long to solve, or lie in a file that is not there
            return ""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the sweep gave them
            wheelset = build_model(vehicle, Path(), None, lambda _: None).wheelset
            return f"Unless varied: {setting(wheelset)}"
    except (ValueError, TypeError, AttributeError):  # the dataset may come from any file
        return ""
