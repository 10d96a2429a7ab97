"""An untrusted file runs no code, reads nothing outside its folder and orders no terminal."""

from __future__ import annotations

import dataclasses
import hashlib
import os
import pickle
import re
import tomllib
import zipfile
from base64 import b64encode
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import click
import pytest
from click.testing import CliRunner
from lxml import html

import contactlib as cl
from contactlib.base.text import harmless, harmless_line
from contactlib.base.writing import PACKAGE, package_folder
from contactlib.cli.commands import main
from contactlib.cli.console import ConsoleReporter
from contactlib.export import fmi2, fmi3, package
from contactlib.export import page as documentation
from contactlib.files.reading import file_beside
from contactlib.runs.sweep.ensemble import read_dataset

MODELS = package_folder("models")
RIG = (MODELS / "roller_rig.toml").read_text(encoding="utf-8")
SCENARIO = (MODELS / "dry_wet_dry.toml").read_text(encoding="utf-8")
SWEEP = (MODELS / "wet_patch_sweep.toml").read_text(encoding="utf-8")
CURVE = (MODELS / "eurosprinter_engel1998.csv").read_text(encoding="utf-8")
ESCAPE = "\x1b]0;owned\x07\x1b[2J"


# ---- files that a file names ----------------------------------------------------------------


def toml_text(text: str) -> str:
    return '"' + "".join(f"\\U{ord(c):08x}" for c in text) + '"'


VEHICLE, OF_SWEEP = tomllib.loads(SCENARIO)["vehicle"], tomllib.loads(SWEEP)["scenario"]
READERS: dict[str, tuple[str, Callable[[Path], object], str]] = {  # NAME is that of a file
    "law.file": (f"{RIG}\n[law]\nkind = 'measured'\nfile = NAME\n", cl.load_model, CURVE),
    "vehicle": (
        SCENARIO.replace(f'"{VEHICLE}"', "NAME"),
        cl.load_scenario,
        (MODELS / "locomotive.toml").read_text(),
    ),
    "scenario": (SWEEP.replace(f'"{OF_SWEEP}"', "NAME"), cl.load_sweep, SCENARIO),
}


def naming(kind: str, folder: Path, name: str) -> Path:
    """File that names another one."""
    path = folder / "sent.toml"
    path.write_text(READERS[kind][0].replace("NAME", toml_text(name)), encoding="utf-8")
    return path


LEADS_OUT = [
    "{}/secret",
    "../secret",
    "s/../../secret",
    r"..\secret",
    r"s\..\..\secret",
    "C:secret",
]


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize(
    "name", [*LEADS_OUT, r"C:\secret", r"\\host\share\secret", "//host/secret"]
)
def test_a_name_that_leads_out_is_refused(tmp_path: Path, kind: str, name: str) -> None:
    _, read, text = READERS[kind]
    (tmp_path / "secret").write_text(text)
    folder = tmp_path / "sent"
    (folder / "s").mkdir(parents=True)
    path = naming(kind, folder, name.format(tmp_path))
    with pytest.raises(cl.ModelError, match=r"must lie beside the .* or below") as caught:
        read(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("linked", ["file", "folder"])
def test_a_link_that_leads_out_is_refused(tmp_path: Path, kind: str, linked: str) -> None:
    _, read, text = READERS[kind]
    (tmp_path / "secret").write_text(text)
    folder = tmp_path / "sent"
    folder.mkdir()
    try:
        (folder / "x").symlink_to(tmp_path if linked == "folder" else tmp_path / "secret")
    except OSError:
        pytest.skip("this system lets nobody make symbolic links")
    path = naming(kind, folder, "x/secret" if linked == "folder" else "x")
    with pytest.raises(cl.ModelError, match="a link leads elsewhere"):
        read(path)


@pytest.mark.skipif(os.name != "posix", reason="devices and pipes are files on POSIX only")
def test_only_plain_files_are_opened(tmp_path: Path) -> None:
    """Other kinds of file would block for ever, or never end."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    (tmp_path / "folder").mkdir()
    pipe, folder, missing = "is a pipe or a device, not", "is a folder, not", "no such file"
    kinds = {"pipe": pipe, "zero": pipe, "folder": folder, "": folder, ".": folder, "x\0y": missing}
    for name, message in kinds.items():
        with pytest.raises(ValueError, match=message):
            file_beside("file", name, tmp_path, "the model")


@pytest.mark.filterwarnings("ignore::contactlib.InputWarning")
def test_files_beside_and_below_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever the command runs; in a folder that is itself reached by a link."""
    real, elsewhere = tmp_path / "real", tmp_path / "elsewhere"
    (real / "data").mkdir(parents=True)
    elsewhere.mkdir()
    (elsewhere / "curve.csv").write_text("not the one")
    (real / "data" / "curve.csv").write_text(CURVE)
    (real / "curve.csv").symlink_to(real / "data" / "curve.csv")
    (tmp_path / "sent").symlink_to(real)
    monkeypatch.chdir(elsewhere)
    for name in ("data/curve.csv", "curve.csv"):
        assert file_beside("file", name, tmp_path / "sent", "x") == tmp_path / "sent" / name
    element = cl.load_model(
        naming("law.file", tmp_path / "sent", "data/curve.csv")
    ).wheelset.element
    assert element.table.law.startswith("MeasuredCurve")
    changes = "\n[vehicle_changes.law]\nkind = 'measured'\nfile = 'data/curve.csv'\n"
    path = real / "scenario.toml"
    path.write_text(SCENARIO + changes, encoding="utf-8")  # of a vehicle that is shipped
    changed = cl.load_scenario(path).drivetrain.wheelset.element
    assert changed.table.law.startswith("MeasuredCurve")


# ---- no code is read ------------------------------------------------------------------------

# pyproject.toml bans modules and functions that run, load or fetch something; not these builtins.
RUNS = re.compile(r"(?<![\w.])(compile|__import__|input)\(")


def test_no_module_runs_text_or_shares_temporary_files() -> None:
    """No name that can be foreseen, and no mode but that of a file which the user keeps."""
    for path in (*PACKAGE.rglob("*.py"), *package_folder("fmu").glob("*.py")):
        text = path.read_text(encoding="utf-8")
        assert not RUNS.search(text), path
        assert not re.search(r"mktemp\(|gettempdir|[\"']/tmp|[\"']/var/tmp", text), path
        sets_modes = re.search("chmod|copymode", text) is not None
        assert sets_modes == (path.name in {"writing.py", "build_hook.py"}), path


class Trap:
    """Pickled, it is code that makes a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, ...]:
        return Path.touch, (self.path,)


def test_no_pickle_is_opened(tmp_path: Path) -> None:
    sprung, sent = tmp_path / "sprung", tmp_path / "sent"
    trap = pickle.dumps(Trap(sprung))
    sent.write_bytes(trap)
    readers: list[Callable[[Path], object]] = [
        *(cl.load_model, cl.load_scenario, cl.load_sweep, read_dataset),
        *(cl.CreepForceTable.load, cl.TractionData.from_csv),
    ]
    for read in readers:
        with pytest.raises(ValueError, match=r"."):
            read(sent)
    assert not sprung.exists()
    pickle.loads(trap)  # noqa: S301 - it is a trap
    assert sprung.exists()


# ---- what a terminal shows ------------------------------------------------------------------


@pytest.mark.parametrize(
    "text", [ESCAPE, "\x9b2J", "\x08\x08", "\r", "\u202egnp", "\udcff", "\u2028", "\u200b", "\t"]
)
def test_what_a_terminal_acts_on_is_written_out(text: str) -> None:
    shown = harmless_line(f"a{text}b")
    assert shown.isprintable()
    assert shown.startswith("a\\")
    assert harmless("1 \u00b5m\n\t[red]") == "1 \u00b5m\n\t[red]"


def check_complaint(*arguments: str, message: str) -> None:
    """Hold that a command fails with one line on stderr that gives a terminal no orders."""
    result = CliRunner().invoke(main, arguments, color=True)
    assert result.exit_code == 2
    assert "\x1b" not in result.output
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


def test_a_message_is_one_line_without_orders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "sent.toml"
    path.write_text(f"{toml_text(ESCAPE + chr(10) + 'contactlib: all is well [red]')} = 1\n{RIG}")
    message = r"\x1b[2J\ncontactlib: all is well [red] is not a known key"
    check_complaint("table", str(path), message=message)

    # The reader escapes the text of a file, the command that of any other error.
    @click.command()
    def fails() -> None:
        raise ValueError(f"{ESCAPE}\nwell")

    monkeypatch.setitem(main.commands, "fails", fails)
    check_complaint("fails", message=r"\x1b[2J\nwell")


@pytest.mark.parametrize(
    ("command", "text"), [("fmu", RIG), ("simulate", SCENARIO), ("sweep", SWEEP)]
)
def test_a_name_that_heads_a_report_is_one_line(tmp_path: Path, command: str, text: str) -> None:
    path = tmp_path / "sent.toml"
    name = toml_text("x\ncontactlib: all is well")
    path.write_text(re.sub("^name = .*$", lambda _: f"name = {name}", text, flags=re.MULTILINE))
    check_complaint(
        command, str(path), message=r"name = 'x\ncontactlib: all is well' must be one line"
    )


@pytest.mark.parametrize("terminal", ["0", "1"])
def test_the_reporter_shows_names_as_they_are(
    terminal: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    if terminal == "1":
        monkeypatch.setenv("FORCE_COLOR", "1")
        monkeypatch.setenv("TERM", "xterm")
    reporter, name = ConsoleReporter(), f"{ESCAPE}[red]x[/red] :smile:"
    reporter.line(name)
    reporter.heading(name)
    reporter.line(name)
    with reporter.step(name) as progress:
        progress(0.5)
    shown = capsys.readouterr().out
    assert "\x1b]0;" not in shown
    assert "\x1b[2J\x07" not in shown
    assert shown.count(r"\x1b]0;owned\x07\x1b[2J[red]x[/red] :smile:") >= 3


# ---- what is written from a model -----------------------------------------------------------

MARKUP = "<img src=x onerror=alert(1)> \"'&lt; ]]> --> </script><script>alert(1)</script> {version}"


class Elements:
    """Elements and attributes of a page, and its text."""

    def __init__(self, page: str) -> None:
        root = html.document_fromstring(page)
        self.found = [(e.tag, dict(e.attrib)) for e in root.iter() if isinstance(e.tag, str)]
        self.text = root.text_content()


def assert_inert(page: Elements) -> None:
    """No handler and nothing from elsewhere."""
    for tag, attributes in page.found:
        assert tag not in ("iframe", "object", "embed", "base", "img")
        for name, value in attributes.items():
            assert not name.startswith("on"), (tag, name)
            if name == "src" or (name == "href" and tag != "a"):
                assert (value or "").startswith(("data:", "#")), (tag, name, value)
            assert not (value or "").strip().lower().startswith("javascript:")


def test_a_model_s_text_is_text_in_what_an_fmu_carries(rig: cl.Model) -> None:
    sent = dataclasses.replace(rig, name=MARKUP, source=MARKUP)
    plain = dataclasses.replace(rig, name="x", source="x")
    for kind in ("force_element", "wheelset"):
        made, known = (package.describe(m, kind, False, False) for m in (sent, plain))
        page, usual = (Elements(documentation.index_page(d).decode()) for d in (made, known))
        assert [tag for tag, _ in page.found] == [tag for tag, _ in usual.found]
        assert "script" not in {tag for tag, _ in page.found}
        assert_inert(page)
        assert MARKUP in page.text
        ElementTree.fromstring(documentation.index_page(made))
        for found in (
            fmi2.model_description(made, [], 1.0, 0.1),
            fmi3.model_description(made, 1.0, 0.1),
        ):
            assert {e.tag for e in ElementTree.fromstring(found).iter()}.isdisjoint(
                {"img", "script"}
            )


def test_a_model_s_text_is_text_in_a_system(rig: cl.Model, tmp_path: Path) -> None:
    mass = dataclasses.replace(rig.wheelset, mass=10e3)
    sent = dataclasses.replace(rig, name=MARKUP, source=MARKUP, wheelset=mass)
    with zipfile.ZipFile(cl.export_ssp(sent, tmp_path / "sent.ssp")) as made:
        texts = [made.read(n) for n in made.namelist() if n.endswith((".ssd", ".ssv", ".xml"))]
    assert texts
    for text in texts:
        tags = {element.tag.rpartition("}")[2] for element in ElementTree.fromstring(text).iter()}
        assert tags.isdisjoint({"img", "script"})


# ---- the explorer page ----------------------------------------------------------------------

PAGE = PACKAGE / "export" / "explorer.html"
WRITERS = re.compile(
    r"\b(inner|outer)HTML|insertAdjacentHTML|document\s*\.\s*write|\beval\b(?! *-)|\bFunction\s*\("
    r"|set(Timeout|Interval)\s*\(\s*[\"'`]|srcdoc|createContextualFragment|DOMParser|\bimport\s*\("
)


def page_parts() -> tuple[Elements, list[str], str]:
    """Elements, scripts that run, and the policy of the page."""
    text = PAGE.read_text(encoding="utf-8")
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    page = Elements(text)
    (policy,) = (
        attributes["content"] or ""
        for tag, attributes in page.found
        if tag == "meta" and attributes.get("http-equiv") == "Content-Security-Policy"
    )
    return page, scripts, policy


def test_the_page_lets_nothing_run_but_its_own_script() -> None:
    page, (script,), policy = page_parts()
    assert "'unsafe-eval'" not in policy
    assert "unsafe-inline" not in policy
    assert "http" not in policy
    assert policy.startswith("default-src 'none';")
    digest = b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}' 'wasm-unsafe-eval';" in policy
    assert_inert(page)


def test_the_page_makes_no_elements_or_code_of_text() -> None:
    """Its libraries, smol-toml and uPlot, do not either."""
    _, (script,), _ = page_parts()
    assert len(script) > 10_000
    assert WRITERS.findall(script) == []
    for path in (Path(__file__).parents[2] / "explorer").glob("[!n]*/*.ts"):
        assert not WRITERS.search(path.read_text(encoding="utf-8")), path


def test_a_model_s_text_ends_no_element_of_the_page(tmp_path: Path) -> None:
    model, path = tmp_path / "model.toml", tmp_path / "page.html"
    model.write_text(f"# {MARKUP} \u2028 <!-- <script>\n{RIG}", encoding="utf-8")
    cl.export.write_explorer(path, model)
    before, after = (Elements(p.read_text(encoding="utf-8")) for p in (PAGE, path))
    assert [tag for tag, _ in before.found] == [tag for tag, _ in after.found]
    assert MARKUP[:4] not in path.read_text(encoding="utf-8")
