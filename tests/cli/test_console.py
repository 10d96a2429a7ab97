"""The digits and units in which numbers of the command line are read."""

from __future__ import annotations

import re

import click
import pytest
from command_line import refused

from contactlib.cli.commands import main
from contactlib.cli.console import in_unit

# Python's int and float read these, with digits of Arabic and of full width.
UNUSUAL = ("1_0", "\u0661\u0660", "\uff11\uff10", "1\u0660", "1e\u0661")
# Options whose value is a text, and those that are lists of numbers, which the command reads.
TEXTS = {"author", "cluster", "control", "controller", "controllers", "kind", "model", "output"}
TEXTS |= {"also", "columns", "file", "files", "log", "per_wheel", "platforms", "scenario"}
TEXTS |= {"priors", "signals", "sweep", "version"}
LISTS = {"friction_scale", "load", "speed"}


def test_numbers_have_ascii_digits() -> None:
    numbers = set()
    for command in main.commands.values():
        context = click.Context(command)
        for option in command.params:
            if (isinstance(option, click.Option) and option.is_flag) or option.name in TEXTS:
                continue
            if option.name in LISTS:
                for text in UNUSUAL:
                    error = refused("table", "roller_rig.toml", "-o", "x.csv", option.opts[0], text)
                    assert f"{option.opts[0]} = {text!r}" in error
                continue
            for text in UNUSUAL:
                given = text if option.nargs == 1 else [text] * option.nargs
                with pytest.raises((click.BadParameter, ValueError), match=re.escape(text)):
                    option.process_value(context, given)
            numbers.add(option.name)
    assert numbers >= {"chunk", "error", "seed", "seeds", "trials", "workers"}


def test_a_number_may_name_its_unit() -> None:
    number = in_unit("m")
    option = click.Option(["--length"])
    context = click.Context(main)
    for text in (*UNUSUAL, "\u0665", "5\u0665 mm", "\u0665 mm"):
        with pytest.raises(ValueError, match="--length"):
            number(context, option, text)
    for text in ("5 \u00b5m", "5\u00a0\u03bcm", "5\u202fum", " 5um "):
        assert number(context, option, text) == 5.0 * 1e-6
    assert number(context, option, " 5e-6") == 5e-6
