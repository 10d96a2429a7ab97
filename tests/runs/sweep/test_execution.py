"""Sweeps that are shared out, stopped, killed, damaged, and go on: the result stays the same."""

from __future__ import annotations

import importlib.util
import json
import math
import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from command_line import call, done, refused
from sweep_files import SCENARIO, SWEEP, UNCOUNTED, chunks_kept, write_sweep

import contactlib as cl
from contactlib.runs import sweep as sweeps
from contactlib.runs.sweep.ensemble import MIN_CHUNK, default_chunk, read_dataset

posix = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
# More runs, so that there is a middle to be killed in.
LONG = SWEEP.replace("count = 3", "count = 12").replace(', "clearing_time"', "")
DRAWN = (  # six draws of friction at each of four points, until the stop
    LONG.replace("count = 12", "count = 2")
    + '[axes.f]\nfactor_on = "vehicle.friction.kinetic"\ndistribution = "uniform"\nfrom = 0.8\n'
    "to = 1.0\n[sampling]\nruns = 6\nseed = 2\n"
).replace("[axes.patch]", "until_stop = true\n[axes.patch]")
# What is started behind a shell's & inherits an interrupt that is ignored; a user's does not.
INTERRUPTIBLE = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
COMMAND = "import sys; from contactlib.cli.commands import main; main(sys.argv[1:])"
# However slowly the test itself gets on, the sweep does not end before it is stopped.
UNHURRIED = """
import time
from contactlib.runs.sweep.store import ChunkStore

save = ChunkStore.save
ChunkStore.save = lambda *given: (save(*given), time.sleep(0.2))
"""


class CountingExecutor(ThreadPoolExecutor):
    """Threads that remember the first run of every chunk."""

    def __init__(self) -> None:
        super().__init__(2)
        self.chunks: list[int] = []

    def submit(self, function: Any, /, *given: Any, **named: Any) -> Future[Any]:
        self.chunks.append(given[1])
        return super().submit(function, *given, **named)


def file_of(path: Path, folder: Path, **given: Any) -> bytes:
    """The NetCDF file of a sweep run to a folder, whose bytes are all that the result is."""
    cl.ensemble(path, output=folder, **given)
    assert [p.name for p in folder.iterdir() if p.stem == path.stem] == [f"{path.stem}.nc"]
    return (folder / f"{path.stem}.nc").read_bytes()


def chunks_run(path: Path, folder: Path, known: bytes, **given: Any) -> list[int]:
    """First runs of the chunks that are run until the file is the known one."""
    with CountingExecutor() as executor:
        assert file_of(path, folder, executor=executor, **given) == known
    return executor.chunks


def stop_in_the_middle(path: Path, output: Path, **given: Any) -> None:
    def stop(part: float) -> None:
        if part > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        cl.ensemble(path, output=output, chunk=1, workers=2, progress=stop, **given)


def python(code: str, *arguments: object) -> subprocess.Popen[str]:
    given = [sys.executable, "-c", INTERRUPTIBLE + textwrap.dedent(code), *map(str, arguments)]
    return subprocess.Popen(given, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def until(reached: Callable[[], bool], running: subprocess.Popen[str]) -> None:
    while not reached():
        assert running.poll() is None, running.communicate()
        time.sleep(0.01)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_sweep(tmp_path_factory.mktemp("sweep"), LONG)


@pytest.fixture(scope="module")
def known(path: Path) -> bytes:
    """The file of a run in one piece."""
    return file_of(path, path.parent / "known", workers=1, chunk=24)


# ---- who runs it ----------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("text", [LONG, DRAWN])
@pytest.mark.parametrize(("workers", "chunk"), [(1, 1), (2, 5), (8, None)])
def test_threads_processes_chunks_and_stops_do_not_matter(
    tmp_path: Path, workers: int, chunk: int | None, text: str
) -> None:
    path = write_sweep(tmp_path, text)
    known = file_of(path, tmp_path / "known", workers=1, chunk=24)
    stop_in_the_middle(path, tmp_path / "stopped")
    assert file_of(path, tmp_path / "stopped", chunk=chunk) == known
    assert file_of(path, tmp_path / "threads", workers=workers, chunk=chunk) == known
    with sweeps.process_workers(workers) as pool:
        for name, executor in (("a", pool), ("b", pool.executor)):
            assert file_of(path, tmp_path / name, executor=executor, chunk=chunk) == known


def test_a_worker_that_is_another_contactlib_refuses(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = cl.load_sweep(path)
    monkeypatch.setattr("contactlib.runs.sweep.plan.version", lambda: "0.0.0")
    with pytest.raises(RuntimeError, match=r"a worker has contactlib 0\.0\.0"):
        cl.ensemble(sweep)


@pytest.mark.slow
def test_a_dead_worker_process_is_reported_and_costs_no_chunk(
    path: Path, known: bytes, tmp_path: Path
) -> None:
    with sweeps.process_workers(2) as pool:
        processes: dict[int, Any] = pool.executor._processes  # type: ignore[attr-defined]

        def kill_one(part: float) -> None:
            if part > 0.3 and processes:
                next(iter(processes.values())).kill()

        with pytest.raises(RuntimeError, match="start the same sweep again"):
            cl.ensemble(path, executor=pool, output=tmp_path, chunk=1, progress=kill_one)
    kept = chunks_kept(tmp_path)
    assert kept > 7
    assert len(chunks_run(path, tmp_path, known, chunk=1)) == 24 - kept


@pytest.mark.parametrize("runs", [24, 1000, 20_000, 1_000_000])
@pytest.mark.parametrize("duration", [0.6, 20.0, 2000.0])
def test_chunks_are_large_and_every_worker_has_two(path: Path, runs: int, duration: float) -> None:
    sweep = cl.load_sweep(path)
    scenario = replace(sweep.scenario, duration=duration)
    values = np.resize(sweep.values, (runs, sweep.values.shape[1]))
    longer = replace(sweep, scenario=scenario, values=values)
    for workers in (1, 2, 32):
        chunk = default_chunk(longer, workers)
        work = chunk * longer.simulated_time / runs / 15_000.0  # of a core [s]
        if chunk > MIN_CHUNK:
            assert work <= 20.0
            assert chunk <= math.ceil(runs / (2 * workers))  # the last of them may be a small one
        if runs == 1_000_000:
            assert chunk == 2048 or work >= 10.0


# ---- what is kept ---------------------------------------------------------------------------


@pytest.mark.slow
def test_a_killed_sweep_goes_on_and_does_no_chunk_twice(
    path: Path, known: bytes, tmp_path: Path
) -> None:
    code = "import sys, contactlib as cl; cl.ensemble(sys.argv[1], output=sys.argv[2], chunk=1)"
    run = python(UNHURRIED + code, path, tmp_path)
    until(lambda: chunks_kept(tmp_path) > 4, run)
    run.kill()
    run.communicate()
    kept = chunks_kept(tmp_path)
    parts: list[float] = []
    again = chunks_run(path, tmp_path, known, chunk=1, progress=parts.append)
    assert len(set(again)) == len(again) == 24 - kept
    assert parts[0] == kept / 24
    assert parts == sorted(parts)
    assert parts[-1] == 1.0


def test_a_finished_sweep_is_not_run_again(path: Path, known: bytes, tmp_path: Path) -> None:
    assert file_of(path, tmp_path) == known
    (tmp_path / f"{path.stem}.chunks").mkdir()  # as after a kill at the very end
    for _ in range(2):
        assert chunks_run(path, tmp_path, known) == []
    assert chunks_run(path, tmp_path, known, restart=True) != []


def test_a_finished_sweep_is_described_as_it_now_is(tmp_path: Path) -> None:
    folder, mine = tmp_path / "out", write_sweep(tmp_path)
    file_of(mine, folder)
    label = 'label = "friction of the patch"\nvalues'
    text = SWEEP.replace('"Quick"', '"Slow"').replace('"chosen"', '"guessed"')
    mine.write_text("# What it is for.\n" + text.replace("values", label))
    fresh = file_of(mine, tmp_path / "fresh")
    assert b"friction of the patch" in fresh
    assert chunks_run(mine, folder, fresh) == []
    before = (folder / "quick_sweep.nc").stat().st_mtime_ns
    cl.ensemble(mine, output=folder)
    assert (folder / "quick_sweep.nc").stat().st_mtime_ns == before  # nothing to write


def test_a_second_start_on_one_output_gives_the_same(
    path: Path, known: bytes, tmp_path: Path
) -> None:
    def start_again(part: float) -> None:
        for restart in (False, True):
            assert file_of(path, tmp_path, chunk=6, restart=restart) == known

    assert file_of(path, tmp_path, chunk=4, workers=1, progress=start_again) == known


def test_the_results_of_another_sweep_are_not_replaced(path: Path, tmp_path: Path) -> None:
    other = write_sweep(tmp_path, LONG.replace("300.0", "302.0"))

    def restart_another(part: float) -> None:
        if not part:
            cl.ensemble(other, output=tmp_path, restart=True)

    with pytest.raises(ValueError, match="is of another plan: not the same: axis inertia"):
        cl.ensemble(path, output=tmp_path, progress=restart_another)
    results = cl.ensemble(other, output=tmp_path)
    assert results["inertia"].values[-1] == 302.0


@pytest.mark.parametrize("chunk", [2, 5])
def test_chunks_of_another_size_are_used(
    path: Path, known: bytes, tmp_path: Path, chunk: int
) -> None:
    stop_in_the_middle(path, tmp_path)
    chunks = tmp_path / f"{path.stem}.chunks"
    (chunks / "3.chunk").unlink(missing_ok=True)
    kept = {int(file.stem) for file in chunks.glob("*.chunk")}
    expected: list[int] = []
    for run in sorted({*range(24)} - kept):
        if not expected or run >= expected[-1] + chunk or run - 1 in kept:
            expected.append(run)
    assert chunks_run(path, tmp_path, known, chunk=chunk) == expected


def test_a_restart_that_is_killed_goes_on_without_the_results_before(
    tmp_path: Path, known: bytes
) -> None:
    folder = tmp_path / "out"
    mine = write_sweep(tmp_path, LONG.replace("300.0", "302.0"))
    cl.ensemble(mine, output=folder)
    mine.write_text(LONG)
    stop_in_the_middle(mine, folder, restart=True)
    assert file_of(mine, folder) == known


@pytest.mark.parametrize("finished", [False, True])
def test_another_plan_is_refused(tmp_path: Path, finished: bool) -> None:
    mine, folder = write_sweep(tmp_path, LONG), tmp_path / "out"
    (cl.ensemble if finished else stop_in_the_middle)(mine, output=folder)
    mine.write_text(LONG.replace("to = 300.0", "to = 301.0"))
    result = call("sweep", mine, "-o", folder, "--no-maps")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "not the same: axis inertia; discard it with --restart" in result.stderr
    assert "was done before" not in result.stdout
    results = cl.ensemble(mine, output=folder, restart=True)
    assert results["inertia"].values[-1] == 301.0


@pytest.mark.parametrize("harm", ["text", "empty", "cut", "head"])
def test_results_that_are_no_netcdf_file_are_reported_in_a_line(
    path: Path, known: bytes, tmp_path: Path, harm: str
) -> None:
    harmed = {"text": b"notes\n", "empty": b"", "cut": known[: len(known) // 2], "head": known[:9]}
    (tmp_path / f"{path.stem}.nc").write_bytes(harmed[harm])
    result = call("sweep", path, "-o", tmp_path, "--no-maps")
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert "is not a complete NetCDF file: discard it with --restart" in result.stderr
    assert file_of(path, tmp_path, restart=True) == known


def test_any_change_of_what_is_run_is_another_plan(tmp_path: Path) -> None:
    def digest(sweep: str = SWEEP, scenario: str = SCENARIO) -> str:
        loaded = cl.load_sweep(write_sweep(tmp_path, sweep, scenario))
        return loaded.plan.digest(loaded.values)

    changed = [
        (SWEEP.replace("300.0", "301.0"), SCENARIO),
        (SWEEP.replace('"slip_work"', '"distance"'), SCENARIO),
        (SWEEP.replace('"creep_pi", ', ""), SCENARIO),
        (SWEEP.replace('"creep_pi", "open_loop"', '"open_loop", "creep_pi"'), SCENARIO),
        *((f"{line}\n{SWEEP}", SCENARIO) for line in ("redesign = true", "tolerance = 1e-7")),
        *((f"{line}\n{SWEEP}", SCENARIO) for line in ('noise = "independent"', 'step = "1 ms"')),
        (SWEEP, SCENARIO.replace("duration = 0.6", "duration = 0.7")),
        (SWEEP, SCENARIO + "\n[wheelset_changes.wheelset]\ndamping = 6.0\n"),
        (SWEEP, SCENARIO + "recovery_time = 0.3\n"),
    ]
    known = digest()
    assert len({known, *(digest(*pair) for pair in changed)}) == 1 + len(changed)
    assert digest(SWEEP.replace('"Quick"', '"Quicker"')) == known  # a name changes nothing


def test_what_cannot_be_written_is_reported_before_anything_runs(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr("contactlib.runs.sweep.execution.run_many", None)
    with pytest.raises(OSError, match="file"):
        cl.ensemble(path, output=tmp_path / "file" / "below")


# ---- the command ----------------------------------------------------------------------------


def test_command_reports_what_it_does_and_where_the_results_are(
    path: Path, known: bytes, tmp_path: Path
) -> None:
    given = ["sweep", str(path), "-o", str(tmp_path), "--workers", "2", "--chunk", "4"]
    lines = done(*given).output.splitlines()
    assert lines[0] == "Quick: 24 runs of 0.6 s under each of creep_pi, open_loop; 2 workers"
    assert any("s left" in line for line in lines)
    assert any(line.endswith("simulated s per s") for line in lines)
    results = f"{tmp_path / path.stem}.nc and {path.stem}.csv"
    assert lines[-1] == f"The results are in {results}, and maps beside them"
    table = pandas.read_csv(tmp_path / f"{path.stem}.csv", index_col=[0, 1, 2])
    assert table.index.names == ["controller", "patch [1]", "inertia [kg.m2]"]
    work = read_dataset(tmp_path / f"{path.stem}.nc")["slip_work"]
    np.testing.assert_allclose(table["slip_work [J]"], work.values.ravel(), rtol=1e-14)
    assert (tmp_path / "slip_work.png").stat().st_size > 0
    assert (tmp_path / f"{path.stem}.nc").read_bytes() == known
    assert "100% was done before" in done(*given).output
    error = refused("sweep", path, "--cluster", "x", "--workers", "2")
    assert error == "contactlib: --cluster cannot be combined with --processes or --workers\n"


@pytest.mark.slow
@posix
@pytest.mark.parametrize(
    ("number", "how", "status"),
    [
        (signal.SIGINT, [], 130),
        (signal.SIGINT, ["--processes"], 130),
        (signal.SIGTERM, [], 128 + signal.SIGTERM),
    ],
)
def test_ctrl_c_stops_and_the_same_command_goes_on(
    path: Path, known: bytes, tmp_path: Path, number: int, how: list[str], status: int
) -> None:
    given = ["sweep", str(path), "-o", str(tmp_path), "--no-maps", "--chunk", "1", *how]
    run = python(UNHURRIED + COMMAND, *given)
    until(lambda: chunks_kept(tmp_path) > 2, run)
    run.send_signal(number)
    out, err = run.communicate(timeout=30)
    assert run.returncode == status
    assert err == "contactlib: interrupted\n"
    assert f"kept in {tmp_path}; the same command continues" in out
    assert "Traceback" not in out + err
    kept = chunks_kept(tmp_path)
    assert f"{kept / 24:.0%} was done before" in done(*given[:5]).output
    assert (tmp_path / f"{path.stem}.nc").read_bytes() == known


# ---- a cluster ------------------------------------------------------------------------------

needs_distributed = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None, reason="needs distributed"
)

CLUSTER = """
import os, signal, sys
from distributed import Client, LocalCluster
import contactlib as cl
from contactlib.cli.commands import main

path, folder = sys.argv[1:]
options = {"n_workers": 3, "threads_per_worker": 1, "dashboard_address": None}
with LocalCluster(**options) as cluster, Client(cluster) as client:
    victims = list(client.run(os.getpid).values())
    assert len(victims) == 3

    def kill_one(part):
        if part > 0.2 and len(victims) == 3:
            os.kill(victims.pop(), signal.SIGKILL)
            print("killed", flush=True)

    with client.get_executor() as executor:
        cl.ensemble(
            path, executor=executor, workers=3, output=folder, chunk=1, progress=kill_one
        )
    after = set(client.run(os.getpid).values())
    print(len(set(victims) & after), flush=True)
    client.wait_for_workers(3)  # the one that was killed starts again
    where = ["--cluster", cluster.scheduler_address, "-o", folder + "/command"]
    main(["sweep", path, *where, "--no-maps"], standalone_mode=False)
"""


@pytest.mark.slow
@needs_distributed
@posix
def test_a_cluster_that_loses_a_worker_gives_the_same_bits(
    path: Path, known: bytes, tmp_path: Path
) -> None:
    run = python(CLUSTER, path, tmp_path)
    out, err = run.communicate(timeout=120)
    assert run.returncode == 0, err
    assert out.split()[:2] == ["killed", "2"]
    assert "; 3 workers" in out
    for folder in (tmp_path, tmp_path / "command"):
        assert (folder / f"{path.stem}.nc").read_bytes() == known


class Stumbling(Executor):
    """An executor that is not of this machine, and loses the results of some jobs."""

    def __init__(self, losses: int) -> None:
        self._losses = losses

    def submit(self, *given: Any, **options: Any) -> Future[Any]:
        job: Future[Any] = Future()
        call, *arguments = given
        if self._losses > 0:
            self._losses -= 1
            job.set_exception(AttributeError("'str' object has no attribute 'with_traceback'"))
        else:
            job.set_result(call(*arguments, **options))
        return job


def test_results_that_a_cluster_takes_for_an_error_are_fetched_again(
    path: Path, known: bytes, tmp_path: Path
) -> None:
    # As Dask's do if the worker that holds them ends as they come.
    cl.ensemble(path, executor=Stumbling(3), workers=2, chunk=5, output=tmp_path)
    assert (tmp_path / f"{path.stem}.nc").read_bytes() == known
    with pytest.raises(AttributeError, match="with_traceback"):
        cl.ensemble(path, executor=Stumbling(1000), workers=2, chunk=5)


OWN = """
import contactlib as cl

class Mine(cl.SampledController):
    sample_time = 0.01

    def torque(self, measurement):
        return 0.5 * measurement.demand
"""


class Elsewhere(Executor):
    """An executor whose workers lack a module."""

    def __init__(self, lacking: str) -> None:
        self._lacking = lacking

    def submit(self, *given: Any, **options: Any) -> Future[Any]:
        sys.modules.pop(self._lacking, None)
        job: Future[Any] = Future()
        call, *arguments = given
        try:
            job.set_result(call(*arguments, **options))
        except Exception as error:
            job.set_exception(error)
        return job


def test_a_worker_without_a_user_s_module_is_one_sentence(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "known_here_only.py").write_text(OWN)
    with monkeypatch.context() as only_here:
        only_here.syspath_prepend(tmp_path)
        controllers = {"mine": importlib.import_module("known_here_only").Mine()}
    executor = Elsewhere("known_here_only")
    with pytest.raises(RuntimeError) as raised:
        cl.ensemble(path, controllers=controllers, executor=executor, workers=1)
    assert str(raised.value).startswith(
        "a worker cannot load your controllers or metrics: No module named 'known_here_only'; "
        "install their module where the workers are, or send it with distributed.Client"
    )
    assert raised.value.__suppress_context__


def test_an_interrupt_is_one_sentence(path: Path, tmp_path: Path) -> None:
    def stop(part: float) -> None:
        if part > 0.0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as raised:
        cl.ensemble(path, output=tmp_path, chunk=1, progress=stop)
    assert str(raised.value) == (
        f"stopped; finished chunks are kept in {tmp_path}, and the same call continues"
    )
    assert raised.value.__suppress_context__
    assert [entry.name for entry in raised.traceback][1:] == ["ensemble"]


@pytest.mark.slow
def test_processes_import_an_own_controller_s_file(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / "file_of_mine.py").write_text(OWN)
    given = ["sweep", str(path), "--no-maps", "--controller", "file_of_mine.py:Mine"]
    done(*given, "-o", "threads")
    done(*given, "-o", "processes", "--processes", "--workers", "2")
    threads, processes = (Path(f"{folder}/{path.stem}.nc") for folder in ("threads", "processes"))
    assert threads.read_bytes() == processes.read_bytes()
    (tmp_path / "file_of_mine.py").write_text(OWN.replace("Mine", "open_loop"))
    error = refused(*given[:-1], "file_of_mine.py:open_loop")
    assert error == f"contactlib: {path} has a controller open_loop itself: take another name\n"


@pytest.fixture
def dask(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts a process of a cluster on this machine, such as ``dask("scheduler")``."""
    started = []

    def start(*arguments: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "dask", *arguments]
        with (tmp_path / "dask.log").open("a") as log:
            started.append(
                subprocess.Popen(command, stdout=log, stderr=log, text=True, env=UNCOUNTED)
            )
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


@pytest.mark.slow
@needs_distributed
@posix
def test_a_cluster_gets_the_file_of_an_own_controller(
    path: Path,
    tmp_path: Path,
    dask: Callable[..., subprocess.Popen[str]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    file = tmp_path / "scheduler.json"
    host = ("--host", "127.0.0.1", "--no-dashboard")
    scheduler = dask("scheduler", *host, "--port", "0", "--scheduler-file", str(file))
    until(lambda: file.exists() and bool(file.read_text()), scheduler)
    address = json.loads(file.read_text())["address"]
    dask("worker", address, *host, "--nthreads", "1", "--no-nanny")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    Path("file_of_mine.py").write_text(OWN)
    given = ["sweep", str(path), "--no-maps", "--controller", "file_of_mine.py:Mine"]
    run = python(COMMAND, *given, "-o", "cluster", "--cluster", address)
    _, err = run.communicate(timeout=120)
    assert (run.returncode, err) == (0, "")
    done(*given, "-o", "here")
    here, there = (Path(f"{folder}/{path.stem}.nc") for folder in ("here", "cluster"))
    assert here.read_bytes() == there.read_bytes()


@pytest.mark.slow
@needs_distributed
@posix
@pytest.mark.parametrize("end", ["scheduler", "Ctrl-C", "a worker comes"])
def test_a_sweep_that_its_cluster_leaves_reports_it_and_goes_on(
    path: Path,
    known: bytes,
    tmp_path: Path,
    dask: Callable[..., subprocess.Popen[str]],
    monkeypatch: pytest.MonkeyPatch,
    end: str,
) -> None:
    monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT", "5s")  # of one that has gone
    file = tmp_path / "scheduler.json"
    host = ("--host", "127.0.0.1", "--no-dashboard")
    scheduler = dask("scheduler", *host, "--port", "0", "--scheduler-file", str(file))
    until(lambda: file.exists() and bool(file.read_text()), scheduler)
    address = json.loads(file.read_text())["address"]
    plain = ("worker", address, *host, "--nthreads", "1", "--no-nanny")
    worker = dask(*plain)
    given = ["sweep", str(path), "-o", str(tmp_path), "--no-maps", "--chunk", "1"]
    run = python(COMMAND, *given, "--cluster", address)
    until(lambda: chunks_kept(tmp_path) > 2, run)
    if end == "scheduler":
        scheduler.kill()
    else:
        worker.kill()
        assert run.stdout
        for line in run.stdout:
            if line == "No worker is left: waiting for one\n":
                break
        if end == "Ctrl-C":
            run.send_signal(signal.SIGINT)
        else:
            dask(*plain)
    out, err = run.communicate(timeout=120)
    if end == "a worker comes":
        assert (run.returncode, err) == (0, "")
        assert "A worker has come" in out
    else:
        assert run.returncode == (2 if end == "scheduler" else 130)
        assert len(err.splitlines()) == 1
        assert err.startswith("contactlib: ")
        assert chunks_kept(tmp_path) > 2
        assert "was done before" in done(*given).output
    assert (tmp_path / f"{path.stem}.nc").read_bytes() == known
