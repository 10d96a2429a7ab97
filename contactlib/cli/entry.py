"""Where the command begins: until it runs, and after it, Ctrl-C ends it at once and without a word.

This module imports nothing that takes time.
"""

from __future__ import annotations

import os
import signal
from typing import NoReturn

INTERRUPTED = 128  # exit status of a command that a signal ends, less the signal's number


def leave(number: int, _frame: object) -> NoReturn:
    """End the process as a handler of a signal: nothing is there yet, or any more, to clean up."""
    os._exit(INTERRUPTED + number)


def main() -> None:
    """Run the command ``contactlib``."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored
        signal.signal(signal.SIGINT, leave)
    from contactlib.cli.commands import main as command

    command(prog_name="contactlib")
