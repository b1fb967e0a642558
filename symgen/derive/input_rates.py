"""Inputs in velocity constraints: accelerations need how fast they change, which is an input of its own."""

from __future__ import annotations

from dataclasses import replace

from ..model.description import Description, Input
from ..model.expression_tree import names_in


def inputs_held(d: Description) -> set[str]:
    """The inputs that velocity constraints mention, through definitions too."""
    inputs = {u.name for u in d.inputs}
    found: set[str] = set()
    for c in d.velocity_constraints if inputs else ():
        found |= names_in(c.expression)
    for name, expression in reversed(d.definitions):
        if name in found:
            found |= names_in(expression)
    return found & inputs


def with_input_rates(d: Description, more: frozenset[str] = frozenset()) -> Description:
    """The description with an input for the rate of each one that a velocity constraint has, and of some `more`."""
    held = inputs_held(d) | more
    if not held:
        return d
    taken = {x.name for x in (*d.inputs, *d.parameters, *d.coordinates, *d.constants, *d.rates)}
    made: list[Input] = []
    for u in d.inputs:
        if u.name not in held:
            continue
        name = f"{u.name}_rate"
        while name in taken:
            name += "_"
        made.append(Input(name, None if u.unit is None else f"({u.unit})/s", rate_of=u.name))
    return replace(d, inputs=(*d.inputs, *made))
