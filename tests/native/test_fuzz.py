"""The fuzz targets in C, run for a short while; ``tests/native/fuzz.py`` runs them for long."""

from __future__ import annotations

import re
import shutil
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
    found = short_run(programs[target], target, folder, tmp_path)
    assert not found.crashed, found.log[-4000:]
    assert found.executions >= RUNS[target]
    inputs = len(list((folder / "seeds" / target).iterdir()))
    assert len(list(tmp_path.iterdir())) > inputs  # it gets on from its seeds


# A check of a reader that is gone, and the target that must break by it.
DEFECTS = {
    "length of the table": (
        "table",
        "creep_table.c",
        "if (size != TABLE_HEADER + count * sizeof(double) + layered * sizeof(float))\n"
        '        return "the table\'s length does not fit its number of cells";',
        "",
    ),
    "range of start values": (
        "start_values",
        "component.c",
        "if (misplaced(m, &self->start[w], &self->start[w]) != NULL)",
        "if (m == NULL)",
    ),
    "contents of a saved state": (
        "fmi",
        "component.c",
        "is_possible(self, state) ? keep",
        "(is_possible(self, state) || size > 0) ? keep",
    ),
    "several values are set or none": (
        "fmi",
        "fmi_calls.h",
        "if (setting) component_put(core, references[i], number);",
        "component_put(core, references[i], number); if (setting) continue;",
    ),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_a_check_that_is_gone_is_found(
    defect: str, sanitized: Build, programs: dict[str, Path], folder: Path, tmp_path: Path
) -> None:
    target, name, check, instead = DEFECTS[defect]
    text = c_sources(name)[0].read_text(encoding="utf-8")
    assert text.count(check) == 1
    (tmp_path / name).write_text(text.replace(check, instead), encoding="utf-8")
    source = name if name.endswith(".c") else "fmi2.c"
    if source != name:  # which takes the header beside it
        shutil.copy(c_sources(source)[0], tmp_path)
    replaced = f"{Path(source).stem}.o"
    broken = compiled(tmp_path / source, tmp_path / replaced, SANITIZED, "-Wno-unused-function")
    others = [path for path in sanitized.objects if path.name != replaced]
    program = tmp_path / target
    sanitized.link(program, broken, *others, folder / f"fuzz_{target}.o", fuzz.FUZZER)
    corpus = tmp_path / "corpus"
    corpus.mkdir()
    found = short_run(program, target, folder, corpus)
    assert found.crashed
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
