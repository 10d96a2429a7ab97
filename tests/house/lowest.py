"""Print the lowest versions of the dependencies that pyproject.toml allows, for ``pip install -r``.

    python tests/house/lowest.py [EXTRA ...]

Also those of the extras that are named.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PYPROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"


def lowest(project: dict[str, Any], *extras: str) -> Iterator[str]:
    """The requirements of a ``[project]`` section, each with its bound as its version.

    Raises
    ------
    ValueError
        If one has no lower bound.
    """
    optional = project["optional-dependencies"]
    for requirement in [*project["dependencies"], *(r for e in extras for r in optional[e])]:
        if own := re.fullmatch(rf"{project['name']}\[([\w,-]+)\]", requirement):
            yield from lowest({**project, "dependencies": []}, *own[1].split(","))
        elif bound := re.fullmatch(r"([\w-]+)[>=]=([\d.]+)", requirement):
            yield f"{bound[1]}=={bound[2]}"
        else:
            raise ValueError(f"{requirement} has no lower bound")


if __name__ == "__main__":
    print(*lowest(tomllib.loads(PYPROJECT.read_text())["project"], *sys.argv[1:]), sep="\n")
