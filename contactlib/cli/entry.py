"""Entry point of the command: before and after its run, Ctrl-C ends it at once and silently.

This module imports nothing that takes time.
"""

from __future__ import annotations

import signal

from contactlib.cli.leaving import leave


def main() -> None:
    """Run the command ``contactlib``."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored
        signal.signal(signal.SIGINT, leave)
    from contactlib.cli.commands import main as command

    command(prog_name="contactlib")
