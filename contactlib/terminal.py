"""Text that came from anywhere, such as a stranger's file, made fit for a terminal."""

from __future__ import annotations

LONGEST_LINE = 1000  # characters


def harmless(text: str) -> str:
    r"""Write out what a terminal would act on or hide: an escape character becomes ``\x1b``.

    Examples
    --------
    >>> print(harmless("\x1b[31mred"))
    \x1b[31mred
    """
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def harmless_line(text: str) -> str:
    r"""The same of one line, which no line break in it can make two, cut where nobody reads on.

    Examples
    --------
    >>> print(harmless_line("a\nb"))
    a\nb
    """
    line = harmless(text[: LONGEST_LINE + 1]).replace("\n", r"\n").replace("\t", r"\t")
    return line if len(line) <= LONGEST_LINE else f"{line[:LONGEST_LINE]} ..."
