"""What a person finds inside an FMU: page, readable table, icon and licence."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from contextlib import nullcontext
from dataclasses import replace
from html.parser import HTMLParser
from importlib import metadata
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from native_models import with_memory
from plain_scenario import braked_vehicle

import contactlib as cl
from contactlib.base.text import version
from contactlib.export import fmu_page as documentation
from contactlib.export.curve_svg import sample_curve
from contactlib.export.description import MODEL_NAMES, Description
from contactlib.export.fmu_page import TITLES, index_page, readable_table
from contactlib.export.package import describe, fmu
from contactlib.files.model import Missing
from contactlib.kernel import NativeModel

HTML = "{http://www.w3.org/1999/xhtml}"
KINDS = tuple(TITLES)


def described(model: cl.Model, kind: str) -> Description:
    """Description of a kind of FMU; a vehicle has two axles like the model."""
    if kind != "vehicle":
        return Description(model, kind)
    scenario = replace(braked_vehicle(model.wheelset, 2), name=model.name, source=model.source)
    return describe(scenario, kind, False, False)


def page_of(model: cl.Model, kind: str = "force_element", memory: bool = False) -> bytes:
    return index_page(described(with_memory(model) if memory else model, kind))


def with_element(model: cl.Model, element: cl.ForceElement) -> cl.Model:
    return replace(model, wheelset=replace(model.wheelset, element=element))


def tree_of(page: bytes) -> ElementTree.Element:
    return ElementTree.fromstring(page)


def text_of(element: ElementTree.Element) -> str:
    return " ".join("".join(element.itertext()).split())


ZETA = np.linspace(0.001, 0.12, 60)
MU = 0.30 * np.tanh(ZETA / 0.008) * (0.55 + 0.45 * np.exp(-ZETA / 0.05))


def measured(model: cl.Model, zeta: Any = ZETA, mu: Any = MU, name: str = "my.csv") -> cl.Model:
    """The model with a measured curve in place of its law."""
    curve = cl.MeasuredCurve(zeta, mu, name=name)
    contact = model.wheelset.element.contact
    return with_element(model, cl.ForceElement.from_curve(curve, contact, radius=0.5))


@pytest.fixture(scope="module")
def elliptic_model(locomotive: cl.Model) -> cl.Model:
    name = "A <wheel> & its r\u00e9sum\u00e9"
    return replace(locomotive, name=name, source='"made up"', initial_speed=0.01)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("memory", [False, True])
def test_page_is_well_formed_ascii_and_needs_nothing_from_outside(
    elliptic_model: cl.Model, kind: str, memory: bool
) -> None:
    page = page_of(elliptic_model, kind, memory)
    assert page.isascii()
    assert "$" not in page.decode().replace("$$", "")
    root = tree_of(page)  # XML, so each element is closed and each reference known
    assert root.tag == f"{HTML}html"
    assert root.get("lang") == "en"
    assert elliptic_model.name in text_of(root)
    tags = {element.tag.rpartition("}")[2] for element in root.iter()}
    assert not tags & {"script", "link", "img", "iframe", "object", "embed", "base", "use"}
    assert not any(element.get("src") or element.get("href") for element in root.iter())
    style = "".join(element.text or "" for element in root.iter(f"{HTML}style"))
    assert "@import" not in style
    assert "url(" not in style


def test_page_is_what_an_html_parser_sees(rig: cl.Model) -> None:
    """An HTML parser ignores the slash of a void element only: no other may be empty by it."""
    void, foreign = {"meta", "br", "hr", "img", "link"}, {"svg", "math"}
    inside: list[str] = []

    class Parser(HTMLParser):
        def handle_starttag(self, tag: str, attrs: object) -> None:
            inside.append(tag)

        def handle_startendtag(self, tag: str, attrs: object) -> None:
            assert tag in void or foreign & set(inside), tag

        def handle_endtag(self, tag: str) -> None:
            assert inside.pop() == tag

    parser = Parser()
    parser.feed(page_of(rig).decode())
    parser.close()
    assert inside == []


def test_every_variable_is_listed_with_its_unit_limits_and_start(rig: cl.Model) -> None:
    rows = {
        text_of(row[0]): [text_of(cell) for cell in row[1:]]
        for row in tree_of(page_of(rig)).iter(f"{HTML}tr")
    }
    for v in Description(rig, "force_element").variables:
        unit, limits, start, description = rows[v.name]
        micrometres = v.name == "weakening_length"
        factor = 1e6 if micrometres else 1.0
        assert (unit, description) == ("um" if micrometres else v.unit, v.description)
        if isinstance(v.start, bool):
            assert (start, limits) == (str(v.start).lower(), "")
        elif v.start is not None:
            assert float(start) == pytest.approx(factor * v.start, rel=1e-5)
        numbers = [float(n) for n in re.findall(r"[-\d.e+]*\d", limits)]
        given = [factor * n for n in (v.minimum, v.maximum) if n is not None and abs(n) < 1e300]
        assert numbers == (given if v.unit != "Boolean" else [])


@pytest.mark.parametrize("kind", KINDS)
def test_names_in_the_text_are_names_in_the_fmu(locomotive: cl.Model, kind: str) -> None:
    description = replace(described(with_memory(locomotive), kind), arrays=True)
    named = set(re.findall(r"<code>([a-z]+_[a-z_]+)</code>", index_page(description).decode()))
    assert named
    assert named - {*KINDS} <= set(description.by_name)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "wheelset_body"])
def test_page_of_a_contact_with_a_layer_is_about_its_own_law(
    locomotive: cl.Model, kind: str
) -> None:
    element = replace(locomotive.wheelset.element, layer_compliance=3e-13)
    layered, table = with_element(locomotive, element), element.table
    for model, has_layer in ((layered, True), (locomotive, False)):
        description = described(model, kind)
        page = index_page(description).decode()
        rows = {
            text_of(row[0]): text_of(row[1])
            for row in tree_of(page.encode()).iter(f"{HTML}tr")
            if len(row) == 2
        }
        error, with_one = "largest error of Q/(fd P)", f"{table.max_layer_error:.2g}"
        assert rows.get(f"{error} with a layer") == (with_one if has_layer else None)
        plain = f"{error} without one" if has_layer else error
        assert rows[plain] == f"{table.max_error:.2g}"
        assert ("layer ratio" in rows) == has_layer
        with zipfile.ZipFile(io.BytesIO(fmu(description, 2, None))) as archive:
            csv_file = io.StringIO(archive.read("resources/creep_table.csv").decode())
        for row in list(csv.DictReader(csv_file))[::997]:
            ratio = float(row.get("layer_ratio", 0.0))
            assert ratio == pytest.approx(description.element.layer_ratio, rel=1e-8)
            x, k_hat = float(row["normalized_creepage"]), float(row["k_hat"])
            expected = table.traction_ratio(x, k_hat, description.element.layer_ratio)
            assert float(row["traction_ratio"]) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("implicit", [False, True])
def test_page_reports_how_this_fmu_is_coupled(rig: cl.Model, implicit: bool) -> None:
    page = index_page(Description(rig, "force_element", implicit=implicit)).decode()
    assert ("exported implicit" in page) == implicit
    assert ("exported with a held force" in page) == (not implicit)


@pytest.mark.parametrize("kind", ["wheelset", "vehicle"])
def test_page_reports_whether_a_step_may_be_discarded(locomotive: cl.Model, kind: str) -> None:
    description = described(with_memory(locomotive), kind)
    given = description.native_contact, description.start_values, description.wheels
    braked = NativeModel(kind, *given)
    braked.begin()
    braked.set(brake_torque=2e4)  # locks the wheels
    says = "discards" in text_of(tree_of(index_page(description)))
    with pytest.raises(RuntimeError, match="substeps") if says else nullcontext():
        braked.advance(1.0, tolerance=1e-9)


def read_curve(root: ElementTree.Element) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Curves and the marked peak of a page, in the units of its own ticks."""
    svg = next(s for s in root.iter() if s.find(".//*[@class='rising']") is not None)

    def axis(kind: str, place: str) -> tuple[float, float]:
        ticks = [e for e in svg.iter() if e.get("class") == f"tick {kind}"]
        at = [float(e.get(place, "nan")) for e in ticks]
        factor, shift = np.polyfit(at, [float(text_of(e)) for e in ticks], 1)
        return float(factor), float(shift)

    scale = np.array([axis("x", "x"), axis("y", "y")])
    curves = {}
    for kind in ("rising", "falling", "points"):
        path = svg.find(f".//*[@class='{kind}']")
        if path is not None:
            numbers = re.findall(r"[-\d.]+", path.get("d", "").replace("h0", ""))
            points = np.array(numbers, dtype=float).reshape(-1, 2)
            curves[kind] = points * scale[:, 0] + scale[:, 1]
    mark = svg.find(".//*[@class='peak']")
    at = [] if mark is None else [float(mark.get(k, "nan")) for k in ("cx", "cy")]
    return curves, np.array(at) * scale[:, 0] + scale[:, 1] if at else np.array([])


@pytest.mark.parametrize("which", ["rig", "elliptic_model"])
def test_drawn_curve_is_the_element_s(which: str, request: pytest.FixtureRequest) -> None:
    model: cl.Model = request.getfixturevalue(which)
    element = model.wheelset.element
    curves, peak = read_curve(tree_of(page_of(model)))
    for points in curves.values():
        record = element.at_creepage(points[:, 0] / 100.0, speed=max(model.initial_speed, 0.1))
        assert np.abs(points[:, 1] - record["traction_coefficient"]).max() < 1e-5
    zeta = np.linspace(0.5, 2.5, 200_001) * element.saturation_creepage
    drawn = element.at_creepage(zeta, speed=max(model.initial_speed, 0.1))["traction_coefficient"]
    assert peak[0] == pytest.approx(100.0 * zeta[drawn.argmax()], rel=1e-4)
    assert peak[1] == pytest.approx(drawn.max(), rel=1e-4)
    assert np.all(np.diff(curves["rising"][:, 1]) > 0.0)
    assert np.all(np.diff(curves["falling"][:, 1]) <= 0.0)
    assert curves["falling"][0] == pytest.approx(peak)


def test_a_measured_curve_is_drawn_to_its_last_point_with_its_points(rig: cl.Model) -> None:
    """Also if its points, not in order, are those of braking."""
    mu = MU + 0.005 * np.random.default_rng(1).standard_normal(ZETA.size)
    sign = np.where(ZETA > 0.06, -1.0, 1.0)
    model = measured(rig, (sign * ZETA)[::-1], (sign * mu)[::-1])
    root = tree_of(page_of(model))
    curves, _ = read_curve(root)
    drawn = model.wheelset.element.at_creepage(0.12, speed=10.0)["traction_coefficient"]
    assert curves["falling"][-1] == pytest.approx([12.0, float(drawn)], abs=1e-3)
    points = curves["points"]
    expected = np.column_stack([100.0 * ZETA, mu])
    assert points[np.argsort(points[:, 0])] == pytest.approx(expected, abs=2e-2)
    assert "Dots are the measured points" in text_of(root)


def test_a_law_without_a_peak_has_none_drawn(rig: cl.Model) -> None:
    contact = rig.wheelset.element.contact
    friction = cl.Friction(static=0.3, kinetic=0.3, weakening_length=0.0)
    carter = cl.ForceElement(contact, friction, table=rig.wheelset.element.table, radius=0.5)
    curve = sample_curve(carter, speed=5.0)
    assert curve.peak is None
    assert curve.creepage[-1] > 4.0 * carter.saturation_creepage
    assert curve.traction_coefficient[-1] == pytest.approx(0.3)


def test_stable_steps_are_those_of_the_formula(locomotive: cl.Model) -> None:
    wheelset = locomotive.wheelset
    assert wheelset.mass is not None
    element = wheelset.element
    inverse_mass = wheelset.radius**2 / wheelset.inertia + 1.0 / wheelset.mass
    sliding = element.friction.kinetic * element.axle_load
    slope = 0.75 * np.pi  # of Q/(f_d P) over zeta/zeta0, that of an ellipse
    unit_pole = slope * sliding / element.saturation_creepage * inverse_mass  # pole times speed

    def table(memory: bool) -> np.ndarray:
        root = tree_of(page_of(locomotive, memory=memory))
        section = root.find(".//*[@class='steps']")
        assert section is not None
        rows = [[text_of(cell) for cell in row] for row in section.iter(f"{HTML}tr")][1:]
        return np.array(rows, dtype=float)

    speed, sequential, parallel = table(memory=False).T
    reference = np.where(speed > 0.0, speed, 3.0 / 8.0 * element.minimum_speed)
    assert sequential == pytest.approx(2e3 * reference / unit_pole, rel=5e-3)
    assert parallel == pytest.approx(1e3 * reference / unit_pole, rel=5e-3)
    _, sequential, parallel = table(memory=True).T  # no minimum speed
    contact = element.contact
    spring = contact.relaxation_lengths.longitudinal * contact.semi_width
    spring /= max(contact.standing_stiffness, 1.0) * unit_pole
    longest = np.maximum(2e3 * speed / unit_pole, 2e3 * np.sqrt(spring))
    assert sequential == pytest.approx(longest, rel=5e-3)
    assert parallel == pytest.approx(1e3 * speed / unit_pole, rel=5e-3, abs=1e-6)


@pytest.mark.parametrize("kind", ["force_element", "creep_forces"])
def test_the_page_s_own_example_runs(
    locomotive: cl.Model,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    kind: str,
) -> None:
    code = tree_of(page_of(locomotive, kind)).find(".//*[@class='fmpy']")
    assert code is not None
    cl.export_fmu(locomotive, tmp_path / f"{MODEL_NAMES[kind]}.fmu", kind=kind)
    monkeypatch.chdir(tmp_path)
    exec("".join(code.itertext()), {})  # noqa: S102
    force = 2.0 * float(capsys.readouterr().out)  # of both wheels
    omega = 20.6 if kind == "force_element" else 20.1
    element = locomotive.wheelset.element
    assert force == pytest.approx(element.force(omega=omega, speed=10.0), rel=3e-3)


def test_readable_table_is_the_table(table: cl.CreepForceTable) -> None:
    data = readable_table(table)
    assert data.isascii()
    rows = list(csv.DictReader(io.StringIO(data.decode())))
    x, k_hat, ratio, slope = (np.array([float(r[name]) for r in rows]) for name in rows[0])
    assert np.unique(k_hat) == pytest.approx(np.linspace(0.0, table.k_max, 21))
    assert x.min() == 0.0
    assert x.max() == 1e3
    assert np.unique(x)[1] == 1e-3
    assert np.allclose(ratio, table.traction_ratio(x, k_hat), rtol=1e-8, atol=0.0)
    assert np.allclose(slope, table.slope(x, k_hat), rtol=1e-8, atol=1e-300)


def test_an_installed_package_brings_its_licence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class File:
        name = "LICENSE"

        def read_binary(self) -> bytes:
            return b"MIT"

    monkeypatch.setattr(documentation, "PACKAGE", tmp_path / "contactlib")
    monkeypatch.setattr(metadata, "files", lambda name: [File()])
    assert documentation.licence_text() == b"MIT"
    monkeypatch.setattr(metadata, "files", lambda name: None)
    with pytest.raises(FileNotFoundError, match="installed without its LICENSE"):
        documentation.licence_text()


def test_a_checkout_is_unreleased(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(name: str) -> str:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", unknown)
    assert version() == "unreleased"


def test_the_page_of_a_measured_curve_describes_it_alone(rig: cl.Model) -> None:
    element = measured(rig, name="<my>.csv").wheelset.element
    wheel: Any = Missing("no inertia", element=element, radius=0.5)
    root = tree_of(page_of(replace(rig, wheelset=wheel)))
    text = text_of(root)
    assert (
        cl.MeasuredCurve(ZETA, MU, name="<my>.csv").summary in text
    )  # file, points, range, misfit and continuation
    assert "an assumption, and so is what lies below the smallest and beyond the largest" in text
    for other in ("Griffith", "The law is a limit"):
        assert other not in text
    assert "The force for lateral_velocity is an assumption" in text
    assert "effective inverse mass is assumed" in text
    assert "is assumed" not in text_of(tree_of(page_of(rig)))
