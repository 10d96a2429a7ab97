"""What the guide's page on robustness promises of untrusted files."""

from __future__ import annotations

import dataclasses
import hashlib
import os
import pickle
import re
from base64 import b64encode
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from click.testing import CliRunner
from lxml import html

import contactlib as cl
from contactlib.base.text import printable_line
from contactlib.base.writing import MAX_BYTES, package_folder
from contactlib.cli.commands import main
from contactlib.export import fmu_page, package
from contactlib.files.reading import file_beside
from contactlib.runs.sweep.ensemble import read_dataset

MODELS = package_folder("models")
RIG, SCENARIO, SWEEP, CURVE = (
    (MODELS / name).read_text(encoding="utf-8")
    for name in (
        *("roller_rig.toml", "dry_wet_dry.toml", "wet_patch_sweep.toml"),
        "eurosprinter_engel1998.csv",
    )
)
# Readers of files that name another one, and a text that names "secret".
READERS: dict[str, tuple[Callable[[Path], object], str]] = {
    "model": (cl.load_model, f"{RIG}\n[law]\nkind = 'measured'\nfile = NAME\n"),
    "scenario": (cl.load_scenario, re.sub('wheelset = ".*"', "wheelset = NAME", SCENARIO)),
    "sweep": (cl.load_sweep, re.sub('scenario = ".*"', "scenario = NAME", SWEEP)),
}


# ---- only files in its folder or below are read ---------------------------------------------


@pytest.mark.parametrize("kind", READERS)
def test_only_files_in_the_folder_or_below_are_read(tmp_path: Path, kind: str) -> None:
    read, text = READERS[kind]
    folder = tmp_path / "sent"
    (folder / "s").mkdir(parents=True)
    (tmp_path / "secret").write_text(CURVE)
    (folder / "linked").symlink_to(tmp_path)
    refused = {
        **dict.fromkeys(
            (
                *(f"{tmp_path}/secret", "../secret", "s/../../secret", "//host/secret"),
                *("..\\secret", "s\\..\\..\\secret", "C:secret", "C:\\secret", "\\\\host\\x"),
            ),
            "must lie beside the .* or below",
        ),
        "linked/secret": "a link leads elsewhere",
        "s": "is a folder, not",
        "none": "no such file",
    }
    for name, message in refused.items():
        path = folder / "sent.toml"
        path.write_text(text.replace("NAME", f"'{name}'"), encoding="utf-8")
        with pytest.raises(cl.ModelError, match=message) as raised:
            read(path)
        assert "\n" not in str(raised.value)


@pytest.mark.skipif(os.name != "posix", reason="devices and pipes are files on POSIX only")
def test_neither_pipes_nor_devices_are_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    for name in ("pipe", "zero"):
        with pytest.raises(ValueError, match="is a pipe or a device, not"):
            file_beside("file", name, tmp_path, "the model")


def test_files_beside_and_below_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever the command runs; in a folder that is itself reached by a link."""
    real, sent = tmp_path / "real", tmp_path / "sent"
    (real / "data").mkdir(parents=True)
    (real / "data" / "curve.csv").write_text(CURVE)
    (real / "curve.csv").symlink_to(real / "data" / "curve.csv")
    sent.symlink_to(real)
    monkeypatch.chdir(tmp_path)
    for name in ("data/curve.csv", "curve.csv"):
        assert file_beside("file", name, sent, "the model") == sent / name


# ---- neither pickle nor eval, and no code ----------------------------------------------------


class Trap:
    """Pickled, it is code that makes a file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, ...]:
        return Path.touch, (self.path,)


def test_no_pickle_is_opened(tmp_path: Path) -> None:
    # Calls of eval, exec, pickle and shells in the package are errors of ruff (its rules S).
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


# ---- the explorer page, and what shows a model's text ----------------------------------------

MARKUP = "<img src=x onerror=alert(1)> \"'&lt; ]]> --> </script><script>alert(1)</script> {version}"
WRITERS = re.compile(
    r"\b(inner|outer)HTML|insertAdjacentHTML|document\s*\.\s*write|\beval\b(?! *-)|\bFunction\s*\("
    r"|set(Timeout|Interval)\s*\(\s*[\"'`]|srcdoc|createContextualFragment|DOMParser|\bimport\s*\("
)


def elements(text: str) -> list[tuple[str, dict[str, str]]]:
    """Elements of a page, which has neither handlers nor anything from elsewhere."""
    root = html.document_fromstring(text)
    tags = [(e.tag, dict(e.attrib)) for e in root.iter() if isinstance(e.tag, str)]
    for tag, attributes in tags:
        assert tag not in ("iframe", "object", "embed", "base", "img")
        for name, value in attributes.items():
            assert not name.startswith("on"), (tag, name)
            if name == "src" or (name == "href" and tag != "a"):
                assert value.startswith(("data:", "#")), (tag, name, value)
            assert not value.strip().lower().startswith("javascript:")
    return tags


def test_the_explorer_runs_its_own_script_and_takes_a_model_as_text(tmp_path: Path) -> None:
    model, plain, sent = tmp_path / "model.toml", tmp_path / "plain.html", tmp_path / "sent.html"
    model.write_text(f"# {MARKUP} \u2028 <!-- <script>\n{RIG}", encoding="utf-8")
    cl.export.write_explorer(plain)
    cl.export.write_explorer(sent, model)
    text = sent.read_text(encoding="utf-8")
    tags = [[tag for tag, _ in elements(path.read_text("utf-8"))] for path in (plain, sent)]
    assert tags[0] == tags[1]
    assert MARKUP[:4] not in text
    (script,) = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    assert len(script) > 10_000
    assert WRITERS.findall(script) == []  # in its libraries neither
    (policy,) = (
        attributes["content"]
        for _, attributes in elements(text)
        if attributes.get("http-equiv") == "Content-Security-Policy"
    )
    digest = b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy.startswith("default-src 'none';")
    assert f"script-src 'sha256-{digest}' 'wasm-unsafe-eval';" in policy
    assert not re.search("unsafe-inline|'unsafe-eval'|http", policy)


def test_a_model_s_text_is_text_in_an_fmu(rig: cl.Model) -> None:
    models = [dataclasses.replace(rig, name=text, source=text) for text in (MARKUP, "x")]
    pages = [
        fmu_page.index_page(package.describe(model, "wheelset", False, False)).decode()
        for model in models
    ]
    tags = [[tag for tag, _ in elements(text)] for text in pages]
    assert tags[0] == tags[1]
    assert MARKUP in html.document_fromstring(pages[0]).text_content()


@pytest.mark.parametrize(
    "text", ["\x1b]0;owned\x07", "\x9b2J", "\x08", "\r", "\u202egnp", "\udcff", "\u2028", "\t"]
)
def test_a_terminal_gets_no_orders(text: str, tmp_path: Path) -> None:
    shown = printable_line(f"a{text}b")
    assert shown.isprintable()
    assert shown.startswith("a\\")
    if text.isprintable() or text == "\udcff":
        return
    path, key = tmp_path / "sent.toml", "".join(f"\\U{ord(c):08x}" for c in text)
    path.write_text(f'"{key}\\nall is well" = 1\n{RIG}', encoding="utf-8")
    result = CliRunner().invoke(main, ["table", str(path)], color=True)
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert result.stderr.strip().isprintable()


# ---- files that are too large, or small and long to read -------------------------------------

LONG = {
    "the file is too large: it must have <= 2 MB": "#" + "x" * MAX_BYTES + "\n",
    "its lists or tables are nested too deeply": "a" + ".a" * 100_000 + " = 1\n",
    "more than 10000 of its keys": "".join(f"[k{i}.b.c.d]\n" for i in range(20_000)),
}


@pytest.mark.parametrize("message", LONG)
def test_a_file_that_is_long_to_read_is_refused(tmp_path: Path, message: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(LONG[message] + RIG, encoding="utf-8")
    with pytest.raises(cl.ModelError, match=re.escape(message)):
        cl.load_model(path)


# What once took the square of its length: minutes and more.
SQUARES = {
    "quotes": RIG + "# " + '\\"' * 200_000,
    "comma": RIG + "x = " + "=1" * 200_000,
    "unit": RIG.replace("\nradius =", f'\nradius = "1 a{" " * 1_500_000}b"\nz =', 1),
    "digits": RIG.replace("\nradius =", f'\nradius = "{"1" * 400_000}_"\nz =', 1),
}


@pytest.mark.parametrize("name", SQUARES)
def test_a_file_takes_time_in_proportion(tmp_path: Path, name: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(SQUARES[name], encoding="utf-8")
    with suppress(cl.ModelError):
        cl.load_model(path)
