"""Text for messages and terminals, also where parts of it come from untrusted files."""

from __future__ import annotations

import difflib
import traceback
from collections.abc import Collection, Sequence
from importlib import metadata
from pathlib import PurePath

from contactlib.base.writing import PACKAGE

LONGEST_LINE = 1000  # characters
# Exceptions that a user's function may raise. sys.exit would end the program without a message and
# with the status of success.
USERS_ERRORS = (Exception, SystemExit)


def printable(text: str) -> str:
    r"""Spell out control and invisible characters: an escape character becomes ``\x1b``.

    Examples
    --------
    >>> print(printable("\x1b[31mred"))
    \x1b[31mred
    """
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def printable_line(text: str) -> str:
    r"""Return `printable` text as one line: line breaks are spelled out, long text is cut.

    Examples
    --------
    >>> print(printable_line("a\nb"))
    a\nb
    """
    line = printable(text[: LONGEST_LINE + 1]).replace("\n", r"\n").replace("\t", r"\t")
    return line if len(line) <= LONGEST_LINE else f"{line[:LONGEST_LINE]} ..."


def explained(what: str, error: BaseException) -> RuntimeError:
    """One line for an error in a user's function, with its place in his file; `what` failed."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if not f.filename.startswith((str(PACKAGE), "<frozen"))]
    where = f" ({PurePath(own[0].filename).name}, line {own[0].lineno})" if own else ""
    message = f": {printable_line(str(error))}" if str(error) else ""
    return RuntimeError(f"{what}: {type(error).__name__}{message}{where}")


def known_names(word: str, known: Collection[str]) -> str:
    """End of a message on an unknown name: the closest known one, if any, and all of them.

    Examples
    --------
    >>> print(known_names("torqe", ["torque", "creep"]))
    did you mean 'torque'? known: torque, creep
    """
    close = difflib.get_close_matches(word, known, 1)
    meant = f"did you mean {close[0]!r}? " if close else ""
    return f"{meant}known: {', '.join(known)}"


def no_signal(name: object, known: Collection[str], owner: object) -> KeyError:
    """Error on a name that is no signal of `owner`, which may have it as an attribute."""
    own = not callable(getattr(owner, str(name), len))
    hint = f"it is the attribute .{name}" if own else known_names(str(name), known)
    return KeyError(f"no signal {name!r}; {hint}")


def fixed_width(rows: Sequence[Sequence[str]]) -> str:
    """Align cells in columns: the first two, name and unit, to the left, numbers to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if i < 2 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def version() -> str:
    """Version of the installed package; "unreleased" for a checkout that is not installed."""
    try:
        return metadata.version("contactlib-rail")
    except metadata.PackageNotFoundError:
        return "unreleased"
