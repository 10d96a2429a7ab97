"""Other programs that run FMUs: a test is skipped where one is missing, but not in CI."""

from __future__ import annotations

import importlib
import os
from typing import Any, NoReturn

import pytest


def missing(what: str) -> NoReturn:
    if os.environ.get("CONTACTLIB_REQUIRE_TOOLS") == "1":
        pytest.fail(what)
    pytest.skip(what)


def module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except (ImportError, OSError) as error:  # OSError: a library that it is linked to
        missing(f"{name} cannot be imported: {error}")
