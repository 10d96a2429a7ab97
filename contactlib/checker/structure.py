"""Rules on ModelStructure of modelDescription.xml."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from contactlib.checker.description import FLOATS, Description, Unknown, Variable

KINDS: tuple[str, ...] = ("dependent", "constant", "fixed", "tunable", "discrete")
INITIAL_KINDS: tuple[str, ...] = ("dependent", "constant")


def structure_problems(description: Description) -> Iterator[str]:
    """What is wrong with the lists of unknowns and with what they depend on."""
    for name, unknowns in description.structure.items():
        label = description.structure_name(name)
        for key, times in Counter(unknown.key for unknown in unknowns).items():
            if times > 1:
                yield f"{label} lists {_named(description, key)} {times} times"
        for unknown in unknowns:
            if unknown.key in description.by_key:
                for problem in _dependencies(description, name, unknown):
                    yield f"{label} (line {unknown.line}): {problem}"
            else:
                yield f"{label} (line {unknown.line}): {_named(description, unknown.key)}"
    yield from _complete(description)


def _named(description: Description, key: int) -> str:
    variable = description.by_key.get(key)
    if variable is not None:
        return f'"{variable.name}"'
    what = "index" if description.version == 2 else "value reference"
    return f"there is no variable of {what} {key}"


def _listed(description: Description, name: str) -> list[Variable]:
    by_key = description.by_key
    return [by_key[u.key] for u in description.structure[name] if u.key in by_key]


def _complete(description: Description) -> Iterator[str]:
    """Whether each list has what it must have, and nothing else."""
    variables = description.variables
    outputs = [v for v in variables if v.causality == "output"]
    yield from _difference(description, "outputs", outputs, outputs)

    derivatives = _listed(description, "derivatives")
    label = description.structure_name("derivatives")
    for variable in derivatives:
        if variable.derivative is None:
            yield f'{label} lists "{variable.name}", which has no attribute derivative'
            continue
        state = description.by_key.get(variable.derivative)
        if state is not None and state.causality not in ("local", "output"):
            yield f'{label}: state "{state.name}" has causality {state.causality}, must be local'
    for key, times in Counter(v.derivative for v in derivatives).items():
        if key is not None and times > 1:
            yield f"{label} lists {times} derivatives of {_named(description, key)}"
    if "ModelExchange" in description.interfaces or derivatives:
        # The derivative of an input or an output is a remark; that of a local variable, a state.
        known = {v.reference for v in derivatives}
        for v in variables:
            if v.derivative is not None and v.causality == "local" and v.reference not in known:
                yield f'{label} lacks "{v.name}"'

    states = [description.by_key[key] for key in description.states if key in description.by_key]
    unknown = [
        v for v in (*outputs, *derivatives, *states) if v.initial in ("approx", "calculated")
    ]
    unknown += [v for v in variables if v.causality == "calculatedParameter"]
    # Of clocked variables an FMU lists those that it wishes to initialize.
    needed = [v for v in unknown if not v.is_clocked]
    clocked = [v for v in variables if v.is_clocked or v.kind == "Clock"]
    yield from _difference(description, "initial_unknowns", needed, [*unknown, *clocked])
    keys = [u.key for u in description.structure["initial_unknowns"]]
    if description.version == 2 and keys != sorted(keys):
        yield f"{description.structure_name('initial_unknowns')} must be in the order of the index"

    for variable in _listed(description, "event_indicators"):
        if not variable.is_continuous_float:
            label = description.structure_name("event_indicators")
            yield f'{label} lists "{variable.name}", which is no continuous float'
    for variable in _listed(description, "clocked_states"):
        if "previous" not in variable.own:
            label = description.structure_name("clocked_states")
            yield f'{label} lists "{variable.name}", which has no attribute previous'


def _difference(
    description: Description, name: str, needed: list[Variable], allowed: list[Variable]
) -> Iterator[str]:
    label, listed = description.structure_name(name), _listed(description, name)
    present, permitted = {v.key for v in listed}, {v.key for v in allowed}
    for key, variable in {v.key: v for v in needed}.items():
        if key not in present:
            yield f'{label} lacks "{variable.name}"'
    for key, variable in {v.key: v for v in listed}.items():
        if key not in permitted:
            yield (
                f'{label} lists "{variable.name}", which has causality {variable.causality}'
                f"{f' and initial {variable.initial}' if name == 'initial_unknowns' else ''}"
            )


def _dependencies(description: Description, name: str, unknown: Unknown) -> Iterator[str]:
    what = f"dependencies of {_named(description, unknown.key)}"
    keys, kinds = unknown.dependencies, unknown.kinds
    if kinds is not None:
        if keys is None:
            yield f"{what}: dependenciesKind is given without dependencies"
        elif len(kinds) != len(keys):
            yield f"{what}: {len(kinds)} dependenciesKind for {len(keys)} dependencies"
        allowed = INITIAL_KINDS if name == "initial_unknowns" else KINDS
        if description.by_key[unknown.key].kind not in FLOATS:
            allowed = KINDS[:1]
        for kind in sorted(set(kinds) - set(allowed)):
            yield f"{what}: dependenciesKind {kind} must be {' or '.join(allowed)}"
    for key in keys or ():
        known = description.by_key.get(key)
        if known is None:
            yield f"{what}: {_named(description, key)}"
        elif not _is_known(description, name, known):
            yield (
                f'{what}: "{known.name}" is no known, it has causality {known.causality} and '
                f"initial {known.initial}"
            )
    if keys is not None and len(set(keys)) < len(keys):
        yield f"{what}: a variable is listed twice"


def _is_known(description: Description, name: str, variable: Variable) -> bool:
    if variable.causality in ("input", "independent", "parameter", "structuralParameter"):
        return True
    if name == "initial_unknowns":
        return variable.initial == "exact"
    # Discrete states, which FMI 3.0 has among the knowns, are not marked as such.
    discrete_state = description.version == 3 and variable.variability == "discrete"
    return variable.key in description.states or discrete_state
