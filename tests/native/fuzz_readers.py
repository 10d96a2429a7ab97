"""Fuzz what reads untrusted files in Python: ``python tests/native/fuzz_readers.py --seconds N``.

Needs atheris. Starts from the shipped models, scenarios, sweeps and measurements, a log and a
table. The first byte of an input chooses the reader. Any exception but a ValueError or an OSError
of one line that names the file ends the run, and so do a warning, two minutes for one file and
2 GB; the input is kept. Printed are executions, and lines of the readers that were reached as
atheris counts them.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path += map(str, (Path(__file__).parents[1], *Path(__file__).parents[1].iterdir()))

atheris: Any = importlib.import_module("atheris")  # not a dependency of anything else here

with atheris.instrument_imports(include=["contactlib", "tomllib"]):
    from broken_files import MODELS, READERS, kind_of, refusal

    import contactlib as cl

KINDS = tuple(READERS)


def write_seeds(folder: Path) -> None:
    """A good file of every kind, the byte of its reader before it."""

    def write(kind: str, name: str, data: bytes) -> None:
        (folder / f"{kind}_{name}").write_bytes(bytes([KINDS.index(kind)]) + data)

    for path in (*MODELS.glob("*.toml"), *MODELS.glob("*.csv")):
        write(kind_of(path), path.stem, path.read_bytes())
    header = b"time [s],omega_1 [rad/s],brake_torque_1 [kN.m],speed [km/h],distance_1\n"
    write("log", "braking", header + b"0,20,1,36,0\n0.01,19.9,1,36,0.1\n0.02,19.8,1,35.9,0.2\n")
    table = cl.load_model("models/roller_rig.toml").wheelset.element.table
    write("table", "line", table.data)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--corpus", type=Path, default=Path("fuzz_corpus/readers"))
    given = parser.parse_args()
    given.corpus.mkdir(parents=True, exist_ok=True)
    scratch = tempfile.TemporaryDirectory()
    seeds, file = Path(scratch.name) / "seeds", Path(scratch.name) / "made.toml"
    seeds.mkdir()
    write_seeds(seeds)

    def read(data: bytes) -> None:
        if not data:
            return
        kind = KINDS[data[0] % len(KINDS)]
        file.write_bytes(data[1:])
        refusal(kind, file)

    options = [f"-max_total_time={given.seconds}", f"-artifact_prefix={given.corpus}-"]
    options += ["-max_len=8192", "-len_control=0", "-timeout=120", "-rss_limit_mb=2048"]
    options += ["-print_final_stats=1"]
    atheris.Setup([sys.argv[0], *options, str(given.corpus), str(seeds)], read)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
