"""The mistakes of a file: collected while it is read, and reported together."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from typing import Any, Self, TypeVar, cast

Made = TypeVar("Made")
MAX_LINES = 50  # of mistakes in one report


class ModelError(ValueError):
    """A model, scenario or sweep file that cannot be used.

    Attributes
    ----------
    lines : tuple of str
        A line for each mistake, in the order of the file, with its place and the reason.
    """

    def __init__(self, *lines: str) -> None:
        super().__init__("\n".join(lines))
        self.lines = lines


def lines_of(error: ValueError) -> tuple[str, ...]:
    """Mistakes that an error reports; a text of several lines is one mistake."""
    return error.lines if isinstance(error, ModelError) else (str(error),)


class Mistakes:
    """Collects the mistakes of a file or section: leaving its block raises them all at once.

    Parameters
    ----------
    data : mapping, optional
        The file's contents, whose keys set the order of the mistakes; missing keys come last.
    """

    def __init__(self, data: Mapping[str, Any] | None = None) -> None:
        self._order = {key: place for place, key in enumerate(data or ())}
        self._lines: list[str] = []

    def of(self, function: Callable[..., Made], *given: Any, **named: Any) -> Made:
        """Result of a function; without one it is None, and leaving the block raises."""
        if len(self._lines) > MAX_LINES:  # enough: an untrusted file must not take longer
            return cast(Made, None)
        try:
            return function(*given, **named)
        except ValueError as error:
            self._lines += lines_of(error)
        return cast(Made, None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, ValueError):
            self._lines += lines_of(error)
        elif error is not None:
            return
        if self._lines:
            last = len(self._order)
            heads = [re.split(r"[. :]", line, maxsplit=1)[0] for line in self._lines]
            places = [self._order.get(head, last) for head in heads]
            order = sorted(range(len(places)), key=places.__getitem__)
            lines = dict.fromkeys(self._lines[i] for i in order)
            raise ModelError(*(line for line in lines if not _is_renamed(line, lines))) from None


def _is_renamed(line: str, lines: Collection[str]) -> bool:
    """Whether a line reports a missing key that another line reports as misspelt."""
    where, missing, _ = line.partition(" is missing")
    key = re.split(r"[. ]", where)[-1]
    section, meant = where.removesuffix(key), f"did you mean {key!r}?"
    return bool(missing) and any(o.startswith(section) and meant in o for o in lines)
