"""Print the lowest versions of the dependencies that pyproject.toml allows, for ``pip install -r``.

    python tests/house/lowest.py [EXTRA ...]

Also those of the extras that are named.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

PYPROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"


def lowest(project: dict[str, Any], *extras: str) -> dict[str, str]:
    """The requirements of a ``[project]`` section, each with its bound as its version.

    Where several name a library, the highest bound counts.

    Raises
    ------
    ValueError
        If one has no lower bound.
    """
    optional = project["optional-dependencies"]
    bounds: dict[str, str] = {}
    for requirement in [*project["dependencies"], *(r for e in extras for r in optional[e])]:
        more: dict[str, str] = {}
        if reference := re.fullmatch(rf"{project['name']}\[([\w,-]+)\]", requirement):
            more = lowest({**project, "dependencies": []}, *reference[1].split(","))
        elif bound := re.fullmatch(r"([\w-]+)[>=]=([\d.]+)", requirement):
            more = {bound[1]: bound[2]}
        else:
            raise ValueError(f"{requirement} has no lower bound")
        for name, version in more.items():
            bounds[name] = max(bounds.get(name, "0"), version, key=_numbers)
    return bounds


def _numbers(version: str) -> list[int]:
    return [int(part) for part in version.split(".")]


if __name__ == "__main__":
    bounds = lowest(tomllib.loads(PYPROJECT.read_text())["project"], *sys.argv[1:])
    print(*(f"{name}=={version}" for name, version in bounds.items()), sep="\n")
