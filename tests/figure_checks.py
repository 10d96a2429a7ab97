"""What must hold of every figure, whatever it shows."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D
from matplotlib.text import Annotation, Text
from matplotlib.transforms import Bbox

from contactlib.figures import save_pictures


def style_of(line: Line2D) -> str:
    """Whether a line is solid ("-"), dashed ("--") or dotted (":")."""
    dashes = line._unscaled_dash_pattern[1]  # type: ignore[attr-defined]
    if dashes is None or line.get_linestyle() == "None":
        return "-" if dashes is None else "none"
    return "--" if dashes[0] > 2.0 * dashes[1] else ":"


def lines(axes: Axes, label: str) -> tuple[np.ndarray, np.ndarray, str]:
    """Data of the one line with this label, and its style."""
    (line,) = [line for line in axes.lines if line.get_label() == label]
    x, y = (np.asarray(v, dtype=np.float64) for v in (line.get_xdata(), line.get_ydata()))
    return x, y, style_of(line)


def place(line: Line2D) -> tuple[float, float]:
    """Where the first point of a line is."""
    x, y = (np.asarray(v, dtype=np.float64) for v in (line.get_xdata(), line.get_ydata()))
    return float(x[0]), float(y[0])


def marks(axes: Axes, marker: str) -> list[Line2D]:
    """Lines drawn with this marker."""
    return [line for line in axes.lines if line.get_marker() == marker]


def check_axes(figure: Figure) -> None:
    """Every axis that has a label has a unit; every panel has both labels or shares them.

    The blank side of a colour bar and an axis of words need none.
    """
    assert figure.axes
    for axes in figure.axes:
        labels = [axes.get_xlabel(), axes.get_ylabel()]
        if axes.get_label() == "<colorbar>":
            assert re.search(r"\[.+\]", labels[1]), labels
            continue
        in_words = any(re.search("[a-z]{3}", t.get_text()) for t in axes.get_yticklabels())
        shared = [axes.get_shared_x_axes(), axes.get_shared_y_axes()]
        for label, group in zip(labels, shared, strict=True):
            assert label or in_words or len(group.get_siblings(axes)) > 1
            assert not label or re.search(r"\[.+\]", label), label
        for child in axes.child_axes:
            (label,) = [text for text in (child.get_xlabel(), child.get_ylabel()) if text]
            assert re.search(r"\[.+\]", label), label


def texts(figure: Figure) -> list[tuple[str, Bbox]]:
    """Titles, labels, legends and notes of a figure, and where they stand."""
    placed: list[tuple[str, Bbox]] = []

    def add(text: Text) -> None:
        if text.get_visible() and text.get_text().strip():
            # Of a note only its words: the arrow may cross what it likes.
            box = Text.get_window_extent(text) if isinstance(text, Annotation) else None
            placed.append((text.get_text(), box or text.get_window_extent()))

    for text in [*figure.texts, figure._suptitle, figure._supxlabel]:  # type: ignore[attr-defined]
        if text is not None and text.get_text() not in [name for name, _ in placed]:
            add(text)
    for axes in figure.axes:
        for text in [axes.title, axes._left_title, *axes.texts]:  # type: ignore[attr-defined]
            add(text)
        for part in [axes, *axes.child_axes]:
            add(part.xaxis.label)
            add(part.yaxis.label)
            for axis in (part.xaxis, part.yaxis):
                low, high = sorted(axis.get_view_interval())
                for tick in axis.get_major_ticks():
                    if low <= tick.get_loc() <= high:
                        add(tick.label1 if tick.label1.get_visible() else tick.label2)
        if (legend := axes.get_legend()) is not None:
            placed.append(("legend", legend.get_window_extent()))
    placed += [("legend", legend.get_window_extent()) for legend in figure.legends]
    return placed


def check_layout(figure: Figure) -> None:
    """No text leaves the page or covers another."""
    figure.draw_without_rendering()
    page, placed = figure.bbox, texts(figure)
    for name, box in placed:
        assert page.x0 - 1.0 <= box.x0 <= box.x1 <= page.x1 + 1.0, name
        assert page.y0 - 1.0 <= box.y0 <= box.y1 <= page.y1 + 1.0, name
    for (name, box), (other, at) in combinations(placed, 2):
        wide = min(box.x1, at.x1) - max(box.x0, at.x0)
        high = min(box.y1, at.y1) - max(box.y0, at.y0)
        assert wide <= 1.0 or high <= 1.0, f"{name!r} covers {other!r}"


def check_saved(figure: Figure, folder: Path) -> None:
    """PNG and SVG are written, and are of that kind.

    The figure is drawn as `check_layout` left it.
    """
    figure.set_layout_engine("none")
    png, svg = save_pictures(figure, folder, "figure")
    pixels = imread(png)
    width, height = figure.get_size_inches() * 150.0
    assert np.abs(np.subtract(pixels.shape[:2], (height, width))).max() < 1.0
    grey = pixels[..., :3] @ [0.299, 0.587, 0.114]
    assert grey.min() < 0.2 < 0.9 < grey.max()
    assert ElementTree.parse(svg).getroot().tag.endswith("}svg")


def check_styles(figure: Figure) -> None:
    """Lines of one panel and one colour that differ in meaning differ in dashes or width too."""
    for axes in figure.axes:
        named = [line for line in axes.lines if not str(line.get_label()).startswith("_")]
        looks = [(style_of(line), line.get_linewidth(), line.get_marker()) for line in named]
        black = [str(line.get_color()) == "black" for line in named]
        seen = [(*look, dark) for look, dark in zip(looks, black, strict=True)]
        assert len(set(seen)) == len(seen), [line.get_label() for line in named]


def check_all(figure: Figure, folder: Path) -> None:
    """All of the above."""
    check_axes(figure)
    check_layout(figure)
    check_styles(figure)
    check_saved(figure, folder)
