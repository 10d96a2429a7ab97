"""What was made before and is wanted again: for scenarios that differ in little."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from typing import Any, TypeVar

from contactlib.parameters import Parameters
from contactlib.scenario.reading import read_section

Made = TypeVar("Made")
Section = TypeVar("Section", bound=Parameters)
EMPTY: dict[str, Any] = {}


class Kept:
    """Remembers what each thing was made from last, and does not make it again from the same.

    The same are the very same objects, or equal floats: contents of a file that are changed have
    to be copied on the way to the change, and nothing else.
    """

    def __init__(self) -> None:
        self._made: dict[Hashable, tuple[tuple[Any, ...], Any]] = {}

    def __call__(self, what: Hashable, make: Callable[..., Made], *given: Any) -> Made:
        """The thing of this name, which `make` makes of what is given."""
        known = self._made.get(what)
        if known is None or any(_differ(*pair) for pair in zip(known[0], given, strict=True)):
            self._made[what] = known = given, make(*given)
        made: Made = known[1]
        return made

    def section(self, name: str, kind: type[Section], data: Mapping[str, Any]) -> Section:
        """Section of a file as the parameters `kind`; without keys if the file has none."""
        found: Section = self(("section", name), _read, name, kind, data.get(name, EMPTY))
        return found


def _differ(one: Any, other: Any) -> bool:
    return one is not other and not (type(one) is type(other) is float and one == other)


def _read(name: str, kind: type[Section], table: object) -> Section:
    return read_section(name, kind, {name: table})
