"""Calls of the command line in this process."""

from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner, Result

from contactlib.cli.commands import main


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, [*map(str, arguments)])


def done(*arguments: str | Path) -> Result:
    """The call, which succeeds."""
    result = call(*arguments)
    assert result.exit_code == 0, result.output
    return result


def refused(*arguments: str | Path) -> str:
    """The error of the call, which ends with status 2, in one line."""
    result = call(*arguments)
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    assert result.stderr.count("\n") == 1, result.stderr
    return result.stderr
