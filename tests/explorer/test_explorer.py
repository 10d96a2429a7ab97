"""The explorer page from Python and from the command line."""

from __future__ import annotations

import json
import re
import webbrowser
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import contactlib as cl
from contactlib import kernel
from contactlib.base.writing import package_folder
from contactlib.cli.commands import main
from contactlib.export import explorer
from contactlib.export.explorer import PAGE, open_in_browser, packed_table, write_explorer

RIG = (package_folder("models") / "roller_rig.toml").read_text(encoding="utf-8")
GIVEN = re.compile(r'<script type="application/json" id="given-model">(.*?)</script>', re.DOTALL)


def given_model(page: Path) -> str | None:
    """What the browser finds as the model that the page is to start with."""
    (text,) = GIVEN.findall(page.read_text(encoding="utf-8"))
    model: str | None = json.loads(text)
    return model


def explore(*arguments: str, status: int = 0) -> str:
    result = CliRunner().invoke(main, ["explore", *arguments])
    assert result.exit_code == status, result.output
    return result.output


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Addresses that the browser was to open."""
    addresses: list[str] = []

    def note(address: str) -> bool:
        addresses.append(address)
        return True

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(webbrowser, "open", note)
    return addresses


def test_page_is_one_file_that_loads_nothing() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert "default-src 'none'" in text
    assert not re.search(r"<(script|link|img)[^>]*\s(src|href)=|@import|url\(http", text)


def test_command_writes_and_opens_the_page(
    tmp_path: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "a page.html"
    explore("--no-open", "-o", str(path))
    assert opened == []
    assert explore("-o", str(path)) == f"The page is {path}\n"
    explore()
    assert opened == [path.as_uri(), (tmp_path / "contactlib-explorer.html").as_uri()]
    assert path.stat().st_size < 1.2e6
    assert path.read_bytes() == (tmp_path / "contactlib-explorer.html").read_bytes()
    assert given_model(path) is None


@pytest.mark.parametrize(
    ("name", "error"),
    [("x.pdf", "x.pdf: the explorer is a page, whose file ends in .html"), ("none/page.html", "")],
)
def test_page_that_cannot_be_written_is_one_line(tmp_path: Path, name: str, error: str) -> None:
    shown = explore("--no-open", "-o", str(tmp_path / name), status=2)
    assert f"{tmp_path / name}" in shown
    assert error in shown
    assert shown.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["DISPLAY", "WAYLAND_DISPLAY", "BROWSER"])
def test_no_screen_and_no_browser_are_no_error(
    tmp_path: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def fail(_: str) -> bool:
        raise webbrowser.Error("could not locate runnable browser")

    monkeypatch.setattr("sys.platform", "linux")
    for other in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(other, raising=False)
    path = tmp_path / "page.html"
    assert explore("-o", str(path)).splitlines()[-1] == f"The page is {path}"
    assert opened == []
    monkeypatch.setenv(name, "x")
    assert open_in_browser(path)
    for broken in (fail, lambda _: False):
        monkeypatch.setattr(webbrowser, "open", broken)
        shown = explore("-o", str(path))
        assert "No browser" in shown
        assert str(path) in shown


@pytest.mark.parametrize("model", ["locomotive.toml", "models/roller_rig.toml", "coach.toml"])
def test_model_goes_into_the_page(tmp_path: Path, model: str) -> None:
    path = tmp_path / "page.html"
    explore(model, "--no-open", "-o", str(path))
    text = (package_folder("models") / Path(model).name).read_text(encoding="utf-8")
    assert given_model(path) == text
    without = write_explorer(tmp_path / "without.html").read_text(encoding="utf-8")
    assert GIVEN.sub("", path.read_text(encoding="utf-8")) == GIVEN.sub("", without)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ('name = "x"\n', "contact is missing"),
        (RIG.replace("inertia = 250.0", "inertia = -1.0"), "wheelset.inertia = -1.0 is out"),
        (RIG + '[law]\nkind = "cohesive"\n', "law.kind = 'cohesive': the page shows"),
        (RIG.replace('"5 mm"', '"6 mm"\nmemory = true'), "length/semi_width = 2.8"),
        (RIG + '[law]\nkind = "rubber"\n', "law.kind = 'rubber'"),
        (RIG + "[law]\nkind = 5\n", "law.kind = 5"),
        ("law = 5\n" + RIG, "law = 5 must be a section"),
        ('wheelset = "roller_rig.toml"\n[demand]\n', "is a scenario"),
        ("[axes]\n", "is a sweep"),
    ],
)
def test_model_that_cannot_be_shown_is_a_line_for_each_mistake(
    tmp_path: Path, text: str, error: str
) -> None:
    model, path = tmp_path / "model.toml", tmp_path / "page.html"
    model.write_text(text, encoding="utf-8")
    with pytest.raises(cl.ModelError, match=re.escape(error)):
        cl.export.write_explorer(path, model)
    shown = explore(str(model), "-o", str(path), status=2)
    assert all(line.startswith(f"contactlib: {model}: ") for line in shown.splitlines())
    assert not path.exists()


def test_a_page_without_places_for_its_data_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "page.html").write_text("<html></html>")
    monkeypatch.setattr(explorer, "PAGE", tmp_path / "page.html")
    with pytest.raises(RuntimeError, match="must have a place for kernel"):
        explorer.write_explorer(tmp_path / "made.html", "locomotive.toml")
    assert not (tmp_path / "made.html").exists()


def test_layers_that_the_page_would_round_are_refused() -> None:
    contents = kernel.shipped_path("line").read_bytes()[24:-4] + np.float32(0.1).tobytes()
    data = kernel.framed(kernel.TABLE_MAGIC, kernel.TABLE_VERSION, contents)
    with pytest.raises(ValueError, match="coefficient with a layer is not a multiple"):
        packed_table(data)
