"""The C sources under the sanitizers, compiled once for all tests."""

from __future__ import annotations

import fuzz
import pytest
from native_programs import SANITIZED, Build
from outside_tools import missing


@pytest.fixture(scope="session")
def sanitized(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Address, leaks, undefined behaviour; and what tells a fuzzer where it is."""
    folder = tmp_path_factory.mktemp("sanitized")
    if not fuzz.can_fuzz(folder):
        missing("there is no clang with libFuzzer and the sanitizers' runtimes")
    return Build(folder, SANITIZED)
