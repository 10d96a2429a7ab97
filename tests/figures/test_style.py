"""The user's own matplotlib settings, captions, dark backgrounds and file formats."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import figure_checks
import map_data
import matplotlib as mpl
import matplotlib.style
import numpy as np
import pytest
from cycler import cycler
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import same_color, to_rgba
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.lines import Line2D
from matplotlib.text import Annotation, Text
from plain_scenario import controls

import contactlib as cl
from contactlib import figures
from contactlib.figures import PAPER_FIGURES, STABILITY_FIGURES
from contactlib.figures.files import clear_legends
from contactlib.figures.style import add_caption, labelled, new_figure, styled


def line(figure: Figure, label: str) -> Line2D:
    (match,) = [
        candidate
        for candidate in figure.axes[0].lines
        if str(candidate.get_label()).startswith(label)
    ]
    return match


def written(figure: Figure) -> list[Text]:
    """Texts that are there to be read, with arrows of their own."""
    figure.draw_without_rendering()
    return [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]


def runs_of(model: cl.Model) -> list[cl.Result]:
    name = "rig" if model.wheelset.speed_held else "locomotive"
    return [cl.simulate(model.wheelset, control, initial_speed=10.0) for control in controls(name)]


OF_MODEL: dict[str, Callable[[cl.Model], Figure]] = {
    **{
        name: lambda model, kind=kind: kind.draw(model.wheelset, 10.0)  # type: ignore[misc]
        for name, kind in STABILITY_FIGURES.items()
    },
    "creep curve": lambda model: figures.creep_curve(model.wheelset, speed=10.0),
    "histories": lambda model: figures.time_histories(*runs_of(model), title=model.name),
    "fold diagram": lambda model: figures.fold_diagram(
        model.wheelset, *runs_of(model), speed=10.0, title=model.name
    ),
}
DRAWN: dict[str, Callable[[cl.Model], Figure]] = {
    **{f"paper {n}": lambda _, n=n: PAPER_FIGURES[n].draw() for n in (1, 4, 5, 6)},  # type: ignore[misc]
    "patch": lambda _: figures.CONTACT_PATCH.draw(),
    **{name: OF_MODEL[name] for name in ("s_curve", "poles", "gains", "loop", "creep curve")},
    "lines": lambda _: figures.map_figure(map_data.compared().isel(length=0), "utilisation"),
    "samples": lambda _: figures.map_figure(map_data.sampled(), "clearing_time"),
}
SLIDES = {
    **{name: OF_MODEL[name] for name in (*STABILITY_FIGURES, "fold diagram")},
    **{name: DRAWN[name] for name in ("paper 6", "patch")},
}


# ---- the user's settings ----------------------------------------------------------------------

HERS: dict[Any, Any] = {
    "font.size": 15.0,
    "lines.linewidth": 3.5,
    "axes.grid.axis": "x",
    "axes.spines.left": False,
    "grid.color": "#00AA00",
    "axes.prop_cycle": cycler(color=["#111122", "#AA0000"]),
    "savefig.dpi": 40,
}


def test_the_user_s_settings_go_before_those_of_contactlib(tmp_path: Path) -> None:
    with mpl.rc_context(HERS):
        figure = PAPER_FIGURES[4].draw()
        path = figures.save(figure, tmp_path / "x.png")
    (axes,) = figure.axes
    stable, unstable = line(figure, "Carter-Griffith"), line(figure, "unstable")
    assert stable.get_linewidth() == 3.5
    assert same_color(stable.get_color(), "#111122")
    assert same_color(unstable.get_color(), "#AA0000")
    assert not axes.spines["left"].get_visible()
    assert not axes.spines["right"].get_visible()  # which she has not set
    assert all(same_color(grid.get_color(), "#00AA00") for grid in axes.get_xgridlines())
    assert not any(grid.get_visible() for grid in axes.get_ygridlines())
    caption = figure._supxlabel  # type: ignore[attr-defined]
    assert caption.get_fontsize() == pytest.approx(0.9 * 15.0)
    pixels = imread(path)
    assert pixels.shape[:2] == tuple((40.0 * figure.get_size_inches()[::-1]).astype(int))


@pytest.mark.slow
@pytest.mark.parametrize("name", OF_MODEL)
def test_no_text_covers_another_in_the_size_of_slides(rig: cl.Model, name: str) -> None:
    with mpl.style.context(["dark_background", {"font.size": 16.0}]):
        figure_checks.check_layout(OF_MODEL[name](rig))


@pytest.mark.slow
@pytest.mark.parametrize("name", SLIDES)
def test_sixteen_points_are_sixteen_points_of_a_slide(
    rig: cl.Model, tmp_path: Path, name: str
) -> None:
    with mpl.rc_context({"font.size": 16.0}), figures.page_size("16:9"):
        figure = SLIDES[name](rig)
        figures.save_pictures(figure, tmp_path, "slide", ["png"])
        assert figure.get_size_inches() == pytest.approx((13.333, 7.5))
        assert figure.axes[0].xaxis.label.get_fontsize() == 16.0
        figure.set_layout_engine("none")  # as it was written
        figure_checks.check_layout(figure)


@pytest.mark.parametrize(
    ("size", "inches"), [("16:9", (13.333, 7.5)), ("4:3", (10.0, 7.5)), ("5.25x4", (5.25, 4.0))]
)
def test_a_page_has_its_size_inside_only(size: str, inches: tuple[float, ...]) -> None:
    def drawn() -> list[float]:
        return [float(side) for side in new_figure(4.0, 3.0)[0].get_size_inches()]

    with figures.page_size(size):
        assert drawn() == pytest.approx(inches)
        with figures.page_size(None):
            assert drawn() == pytest.approx([4.0, 3.0])
        assert drawn() == pytest.approx(inches)
    assert drawn() == pytest.approx([4.0, 3.0])


@pytest.mark.parametrize("size", ["", "16:10", "7.5", "13.33x", "1x7", "3x200", "1.2.3x4", "axb"])
def test_what_is_no_page_is_refused(size: str) -> None:
    refused = pytest.raises(ValueError, match="must be 16:9, 4:3 or a width and a height in inches")
    with refused, figures.page_size(size):
        pass


def test_a_style_sheet_is_hers_too() -> None:
    with mpl.style.context("fivethirtyeight"):
        expected = mpl.rcParams["lines.linewidth"], mpl.rcParams["axes.facecolor"]
        figure = PAPER_FIGURES[4].draw()
    assert line(figure, "Carter-Griffith").get_linewidth() == expected[0]
    assert same_color(figure.axes[0].get_facecolor(), expected[1])


def test_nothing_of_the_style_is_left_behind() -> None:
    before = dict(mpl.rcParams)
    with styled({"axes.grid": False}):
        pass
    PAPER_FIGURES[2].draw()
    assert dict(mpl.rcParams) == before


# ---- captions ---------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper 4", "patch", "s_curve", "lines", "samples"])
def test_captions_can_be_left_out(name: str, rig: cl.Model) -> None:
    usual = DRAWN[name](rig)
    with figures.captions(False):
        bare = DRAWN[name](rig)
    removed = {text.get_text() for text in written(usual)} - {
        text.get_text() for text in written(bare)
    }
    (caption,) = [text for text in removed if len(text) > 60]
    assert caption.rstrip().endswith(".")
    assert not bare.get_supxlabel()


def test_captions_are_off_inside_only() -> None:
    def caption() -> str:
        figure, _ = new_figure(4.0, 3.0)
        add_caption(figure, "A caption.")
        return figure.get_supxlabel()

    without = figures.captions(False)
    assert caption() == "A caption."  # making the manager changes nothing
    with without:
        assert caption() == ""
        with figures.captions(True):
            assert caption() == "A caption."
        assert caption() == ""
    assert caption() == "A caption."


# ---- dark backgrounds -------------------------------------------------------------------------


def light(colour: Any) -> float:
    return float(np.dot(to_rgba(colour)[:3], [0.299, 0.587, 0.114]))


@pytest.mark.slow
@pytest.mark.parametrize("name", DRAWN)
def test_marks_stand_out_from_a_dark_background(name: str, rig: cl.Model) -> None:
    with mpl.style.context("dark_background"):
        figure = DRAWN[name](rig)
        texts = written(figure)
        drawn = [mark for axes in figure.axes for mark in axes.lines if mark.get_visible()]
    assert light(figure.get_facecolor()) == 0.0
    faint = [text.get_text() for text in texts if light(text.get_color()) < 0.35]
    faint += [f"{mark}" for mark in drawn if light(mark.get_color()) < 0.35]
    for text in texts:
        arrow = text.arrow_patch if isinstance(text, Annotation) else None
        if arrow is not None and light(arrow.get_edgecolor()) < 0.35:
            faint.append(f"arrow of {text.get_text()!r}")
    assert faint == []
    hollow = [mark for mark in drawn if mark.get_marker() == "o" and mark.get_fillstyle() == "full"]
    for mark in hollow:  # filled like its rim, or with the ground
        face = mark.get_markerfacecolor()
        if face != "none":
            assert same_color(face, mark.get_color()) or light(face) == 0.0


@pytest.mark.parametrize("grid", [False, True])
def test_a_grid_stays_behind_on_a_dark_background(grid: bool) -> None:
    with mpl.style.context(["dark_background", {"axes.grid": grid}]):
        figure = PAPER_FIGURES[4].draw()
        written(figure)
        (first, *_) = figure.axes[0].get_xgridlines()
    assert first.get_visible()
    alpha = first.get_alpha()
    assert alpha is not None
    assert alpha < 0.3


# ---- files ------------------------------------------------------------------------------------

STARTS = {
    "eps": b"%!PS-Adobe-3.0 EPSF",
    "jpg": b"\xff\xd8",
    "pdf": b"%PDF",
    "png": b"\x89PNG",
    "ps": b"%!PS",
    "svg": b"<?xml",
    "svgz": b"\x1f\x8b",
    "tiff": b"II*\0",
    "webp": b"RIFF",
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", STARTS)
def test_a_figure_is_written_in_any_format_of_matplotlib(tmp_path: Path, kind: str) -> None:
    figure, axes = new_figure(3.0, 2.0)
    axes.plot([0.0, 1.0], [0.0, 0.5])
    for suffix in (kind, kind.upper()):
        data = figures.save(figure, tmp_path / f"x.{suffix}").read_bytes()
        assert data.startswith(STARTS[kind])


def test_no_other_format_is_written(tmp_path: Path) -> None:
    figure, _ = new_figure(3.0, 2.0)
    known = ", ".join(sorted({*FigureCanvasAgg.get_supported_filetypes(), "csv"}))
    for name in ("x", "x.docx", "x.PNG.exe"):
        with pytest.raises(ValueError, match=f"{name}: the suffix = '.*' must be one of: {known}"):
            figures.save(figure, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_the_lines_of_a_figure_are_written_as_numbers(tmp_path: Path) -> None:
    """Reading them back gives the law, to the last bit."""
    line = r"Carter, $\hat K$ = 0, line"
    text = figures.save(PAPER_FIGURES[5].draw(), tmp_path / "x.csv").read_text()
    rows = csv.DictReader(text.splitlines())
    x, y = np.array([[r["x"], r["y"]] for r in rows if r["line"] == line], float).T
    np.testing.assert_array_equal(y, cl.CarterGriffith(k_hat=0.0).traction_ratio(x))
    figure, axes = new_figure(3.0, 2.0, ncols=2, sharey=True)
    axes[0].plot([0.0, 1.0], [0.5, 0.1])
    labelled(axes[0], "place", "force", "left")
    axes[0].axvline(0.5)
    axes[1].plot([2.0], [3.0], "o", label="a, b")
    axes[1].plot([2.0], [4.0])
    text = figures.save(figure, tmp_path / "y.csv").read_text()
    assert text == (
        "panel,line,x,y\nleft,force over place,0.0,0.5\nleft,force over place,1.0,0.1\n"
        '2,"a, b",2.0,3.0\n2,force over x,2.0,4.0\n'
    )


def test_the_colours_of_a_figure_are_written_as_numbers(tmp_path: Path) -> None:
    """Of points, as on the contact patch, and of areas between them, as on a map."""
    law = cl.CarterGriffith(k_hat=0.0, contact="elliptic")
    text = figures.save(figures.contact_patches(law), tmp_path / "x.csv").read_text()
    rows = [row for row in csv.DictReader(text.splitlines()) if row["line"].startswith("shear")]
    assert {row["panel"].partition(":")[0] for row in rows} == {
        *("Before the peak", "At the peak", "Past the peak")
    }
    x, y, drawn = np.array([[row[c] for c in ("x", "y", "colour")] for row in rows], float).T
    slides = [row["panel"].startswith("Past") for row in rows]  # all of it: Hertz, with b/a = 2
    hertz = np.sqrt(np.maximum(1.0 - x**2 - 0.25 * y**2, 0.0))
    np.testing.assert_allclose(drawn[slides], hertz[slides], atol=1e-7)
    assert (drawn <= hertz + 1e-7).all()
    data = map_data.analysed()[["critical_torque"]]
    (path,) = figures.draw_maps(data, tmp_path, ("csv",))
    rows = [row for row in csv.DictReader(path.read_text().splitlines()) if row["colour"]]
    drawn = np.array([row["colour"] for row in rows], float)
    assert drawn.size == data["critical_torque"].size
    known = np.sort(drawn[np.isfinite(drawn)])
    values = data["critical_torque"].values
    np.testing.assert_allclose(1e3 * known, np.sort(values[np.isfinite(values)]))  # kN.m


def test_a_sweep_s_maps_have_the_formats_that_are_requested(tmp_path: Path) -> None:
    data = map_data.analysed()[["critical_torque"]]
    assert figures.draw_maps(data, tmp_path, ("pdf", "eps")) == [
        tmp_path / "critical_torque.pdf",
        tmp_path / "critical_torque.eps",
    ]


def test_a_legend_keeps_off_the_lines() -> None:
    """It moves to a corner that no line passes."""
    figure, axes = new_figure(4.0, 3.0)
    axes.plot([0.0, 1.0, 1.0], [1.0, 1.0, 0.0], label="over and down on the right")
    legend = axes.legend(loc="upper right")
    clear_legends(figure)
    figure.draw_without_rendering()
    box = legend.get_window_extent()
    (path,) = (line.get_transform().transform_path(line.get_path()) for line in axes.lines)
    assert not path.intersects_bbox(box, filled=False)
    assert axes.bbox.containsx(box.x1)
    assert axes.bbox.containsy(box.y0)
