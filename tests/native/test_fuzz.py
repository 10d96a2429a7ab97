"""The fuzz targets in C, run for a short while; ``tests/native/fuzz.py`` runs them for long."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import fuzz
import pytest
from native_programs import SANITIZED, Build, compiled
from seeds import write_seeds

from contactlib.base.writing import c_sources

pytestmark = pytest.mark.tools
RUNS = {"table": 20_000, "start_values": 500, "fmi": 1_000}


@pytest.fixture(scope="module")
def folder(sanitized: Build) -> Path:
    """Seeds and the resources of FMUs beside the programs; crashes land there too."""
    made = sanitized.folder
    (made / "resources").mkdir()
    write_seeds(made / "seeds", fuzz.export_resources(made / "resources"))
    return made


@pytest.fixture(scope="module")
def programs(sanitized: Build) -> dict[str, Path]:
    return fuzz.programs(sanitized)


def short_run(program: Path, target: str, folder: Path, corpus: Path) -> fuzz.Found:
    return fuzz.fuzzed(
        program,
        folder / "resources",
        f"-runs={RUNS[target]}",
        "-seed=1",
        f"-max_len={fuzz.LONGEST[target]}",
        "-len_control=0",
        str(corpus),
        str(folder / "seeds" / target),
    )


@pytest.mark.parametrize("target", fuzz.TARGETS)
def test_nothing_breaks_in_a_short_run(
    target: str, programs: dict[str, Path], folder: Path, tmp_path: Path
) -> None:
    outcome = short_run(programs[target], target, folder, tmp_path)
    assert not outcome.crashed, outcome.log[-4000:]
    assert outcome.executions >= RUNS[target]
    inputs = len(list((folder / "seeds" / target).iterdir()))
    assert len(list(tmp_path.iterdir())) > inputs  # it gets on from its seeds


@pytest.mark.parametrize(
    ("target", "source", "check"),
    [
        (
            *("table", "creep_table.c"),
            "size != TABLE_HEADER + count * sizeof(double) + layered * sizeof(float)",
        ),
        (
            *("start_values", "rails.c"),
            "!(**number >= 1.0 && **number <= 0.5 * (double)(end - *number - 1))",
        ),
        ("fmi", "component.c", "out_of_range(self->model, &self->start[wheel], values) != NULL"),
    ],
)
def test_a_planted_fault_is_found(
    programs: dict[str, Path],
    sanitized: Build,
    folder: Path,
    tmp_path: Path,
    target: str,
    source: str,
    check: str,
) -> None:
    """A reader no longer checks a table's length, the points of rails or a saved state's values."""
    text = c_sources(source)[0].read_text(encoding="utf-8")
    assert text.count(check) == 1
    (tmp_path / source).write_text(text.replace(check, f"(({check}) && 0)"))
    broken = compiled(tmp_path / source, tmp_path / "broken.o", SANITIZED)
    others = [
        path for path in sanitized.objects if path.name != Path(source).with_suffix(".o").name
    ]
    program = tmp_path / target
    sanitized.link(program, broken, *others, folder / f"fuzz_{target}.o", fuzz.FUZZER)
    corpus = tmp_path / "corpus"
    corpus.mkdir()
    outcome = short_run(program, target, folder, corpus)
    assert outcome.crashed
    assert list(tmp_path.glob("crash-*"))  # what breaks it is kept


def test_the_command_reports_what_it_found(
    programs: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    # Which takes a while.
    monkeypatch.setattr(fuzz, "Build", lambda *_: None)
    monkeypatch.setattr(fuzz, "programs", lambda _, targets: {t: programs[t] for t in targets})
    command = ["fuzz.py", "table", "--seconds", "1", "--corpus", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", command)
    assert fuzz.main() == 0
    output = capsys.readouterr().out
    assert re.fullmatch(r"table: [1-9]\d* executions, .* [1-9]\d* edges, .* no crash\n", output)


def test_the_command_starts_by_itself(tmp_path: Path) -> None:
    command = [sys.executable, str(Path(fuzz.__file__)), "nothing"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 2
    assert "nothing: known targets are table, " in done.stderr
