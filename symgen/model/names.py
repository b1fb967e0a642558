"""Which names a model may use, and the functions of its expressions."""

from __future__ import annotations

import keyword
import re

from symgen.runtime.graph.functions import IN_MODELS

FUNCTION_ARITY: dict[str, tuple[int, int | None]] = {  # fewest and most arguments
    **{name: function.arity for name, function in IN_MODELS.items()},
    "dot": (1, 1),
    "mod": (2, 2),  # the last two are written with others: `ABBREVIATIONS` in functions.py
    "smoothstep": (3, 3),
}
# What can be measured, with the number of names that it takes: `sensors.py`. Models may use these names themselves, as
# a sensor is one only where a parenthesis follows.
SENSOR_ARITY: dict[str, tuple[int, int]] = {
    "position": (2, 3),
    "velocity": (2, 3),
    "acceleration": (1, 3),
    "angular_velocity": (2, 3),
    "angular_acceleration": (2, 3),
    "distance": (2, 2),
    "angle": (2, 3),
    "reaction": (1, 3),
    "power": (1, 1),
}
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z", re.ASCII)
LONGEST_NAME = 100
# What Windows takes for devices, whatever the suffix: no names of files, so no names of models.
DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{k}" for port in ("com", "lpt") for k in range(10))}
RESERVED = {"t": "the time", "pi": "the number pi"}


def name_fault(name: object, element: bool = False) -> str | None:
    """Why `name` cannot be a name in a model, or None.

    `element` names (bodies, loads, constraints, events) do not stand in expressions, so that `t` and
    functions are no trouble there.
    """
    if not isinstance(name, str):
        return f"a name must be text, not {name!r:.60}"
    shown = name if len(name) <= 60 else name[:59] + "…"
    if not NAME.match(name):
        return f"{shown!r} is not a name: ASCII letters, digits and underscores, beginning with a letter"
    if len(name) > LONGEST_NAME:
        return f"the name {shown!r} is longer than {LONGEST_NAME} characters"
    if keyword.iskeyword(name):
        return f"{name!r} is a reserved word of Python"
    if not element and name in RESERVED:
        return f"{name!r} is {RESERVED[name]}"
    if not element and name in FUNCTION_ARITY:
        return f"{name!r} is a function"
    return None


def reference_fault(name: object) -> str | None:
    """Why `name` cannot be what an element is called, or None: what a use of an assembly has is called `c1.rod`."""
    if not isinstance(name, str) or "." not in name:
        return name_fault(name, element=True)
    return next((fault for part in name.split(".") if (fault := name_fault(part, element=True))), None)


def integral_name(state: str) -> str:
    """The name of the coordinate whose rate a state is."""
    return f"{state}_integral"


def model_name_fault(name: object) -> str | None:
    """Why `name` cannot be that of a model, whose files are called like it, or None."""
    if isinstance(name, str) and name.lower() in DEVICES:
        return f"{name!r} is a device on Windows, and no name of a file there"
    return name_fault(name, element=True)
