"""Text that came from anywhere, such as a stranger's file, made fit for a terminal."""

from __future__ import annotations

import re

# What a terminal acts on, what changes the order in which a line is read, and halves of characters.
ACTING = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)

LONGEST_LINE = 1000  # characters


def harmless(text: str) -> str:
    r"""Write out what a terminal would act on: an escape character becomes ``\x1b``.

    Examples
    --------
    >>> print(harmless("\x1b[31mred"))
    \x1b[31mred
    """
    return ACTING.sub(lambda found: ascii(found[0])[1:-1], text)


def harmless_line(text: str) -> str:
    r"""The same of one line, which no line break in it can make two, cut where nobody reads on.

    Examples
    --------
    >>> print(harmless_line("a\nb"))
    a\nb
    """
    line = harmless(text[: LONGEST_LINE + 1]).replace("\n", r"\n")
    return line if len(line) <= LONGEST_LINE else f"{line[:LONGEST_LINE]} ..."
