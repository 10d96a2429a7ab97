"""Tables of the law that a sweep needs: more than one if an axis changes the law."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from contactlib.parameters import FloatArray
from contactlib.scenario import ScenarioContents
from contactlib.scenario.contact_sections import TABLE_KEYS
from contactlib.scenario.reading import in_file
from contactlib.sweep.axis import Axis
from contactlib.sweep.plan import Plan, ScenarioBuilder
from contactlib.table import CreepForceTable

MOST_TABLES = 64  # a cohesive one takes half a minute


def table_axes(axes: Sequence[Axis], contents: ScenarioContents) -> tuple[int, ...]:
    """Axes that change the law's table."""
    law = contents.vehicle.get("law", {}).get("kind", "carter_griffith")
    keys = {("vehicle", *key.split(".")) for key in TABLE_KEYS[law]}
    return tuple(
        i for i, axis in enumerate(axes) if keys & {(*t.section, t.key) for t in axis.targets}
    )


def law_tables(
    plan: Plan, values: FloatArray, base: CreepForceTable, progress: Callable[[float], object]
) -> dict[tuple[float, ...], bytes]:
    """The law's table for all values of the axes that it depends on."""
    if not plan.table_axes:
        return {(): base.data}
    columns = values[:, plan.table_axes]
    needed, where = np.unique(columns, axis=0, return_index=True)
    if len(needed) > MOST_TABLES:
        names = " and ".join(f"axes.{plan.axes[i].name}" for i in plan.table_axes)
        raise ValueError(
            f"{names}: each of {len(needed)} values needs a table of the law of its own, which is "
            f"built first: at most {MOST_TABLES}, on a grid or from values = [...]"
        )
    builder, tables = ScenarioBuilder(plan), {}
    for done, run in enumerate(where):

        def part(of_one: float, done: int = done) -> None:
            progress((done + of_one) / len(where))

        with in_file(f"run {run}"):
            table = builder.build_table(values[run].tolist(), part)
        tables[builder.table_key(values[run].tolist())] = table.data
    return tables
