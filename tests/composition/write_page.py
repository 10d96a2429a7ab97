"""Write the tables of the guide's page on what works together, from what the uses do.

python tests/composition/write_page.py
"""

from __future__ import annotations

import re
import sys
import tempfile
from itertools import combinations
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(p) for p in (ROOT / "tests").iterdir()] + [str(ROOT / "tests")]

from explorer_page import explorer_page  # noqa: E402
from test_uses import PAGE  # noqa: E402
from uses import FEATURES, OF_VEHICLE, USES, Case, cell_of, pair_of, table, together  # noqa: E402


def folder() -> Path:
    return Path(tempfile.mkdtemp())


def main() -> None:
    """Check every cell and write the page anew."""
    with explorer_page() as page:
        uses = {
            feature: {
                name: cell_of(
                    Case(changes, folder()), use, *([page] if use.tools == "browser" else [])
                )
                for name, use in USES.items()
            }
            for feature, changes in FEATURES.items()
        }
    pairs = {
        first: {
            second: pair_of(Case(together(OF_VEHICLE[first], OF_VEHICLE[second]), folder()))
            for one, second in combinations(OF_VEHICLE, 2)
            if one == first
        }
        for first in list(OF_VEHICLE)[:-1]
    }
    parts = re.split(r"(<!-- \(\w+\) -->)", PAGE.read_text(encoding="utf-8"))
    parts[2], parts[6] = (f"\n\n{table(rows)}\n\n" for rows in (uses, pairs))
    PAGE.write_text("".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
