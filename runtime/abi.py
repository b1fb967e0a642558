"""ABI 1: which functions a generated module has, and how long their arrays are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

ABI = 1

_ALWAYS = ("rhs", "mass_matrix", "forces", "energy", "residual", "residual_jacobian")
_WITH_CONSTRAINTS = ("constraint_residual", "constraint_jacobian", "gamma")
_RESET = "reset_"


def required_functions(header: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of the functions that a module with this header has."""
    yield from _ALWAYS
    if header["nh"] + header["nn"]:
        yield from _WITH_CONSTRAINTS
    if header["nh"] + header["nn"] or header.get("quaternions"):
        yield "project"
    if header["nq"] != header["nv"]:
        yield "kinematics"
    for key, name in (("bodies", "poses"), ("outputs", "outputs"), ("events", "events")):
        if header[key]:
            yield name
    if any(body["sizes"] for body in header["bodies"]):
        yield "shapes"
    for event in header["events"]:
        if event["action"] == "reset":
            yield _RESET + event["name"]


def array_sizes(header: Mapping[str, Any], function: str) -> tuple[int, int] | None:
    """Return how many values `function` reads from `y` and writes to `out`; None if it is unknown."""
    nq, nv, nh, nw = header["nq"], header["nv"], header["nh"], header["nw"]
    m = nh + header["nn"]
    state, extended = nq + nv, nq + nv + nv + m
    sizes = {
        "rhs": (state, state + nw + m + (m > 0)),
        "mass_matrix": (state, nv * nv),
        "forces": (state, nv),
        "energy": (state, 2),
        "residual": (extended, nv + m),
        "residual_jacobian": (extended, (nv + m) * extended),
        "constraint_residual": (state, nh + m),
        "constraint_jacobian": (state, m * nv),
        "gamma": (state, m),
        "project": (state, state + nh + m),
        "kinematics": (state, nq * nv + nq * nq),
        "poses": (state, 12 * len(header["bodies"])),
        "shapes": (state, sum(body["sizes"] for body in header["bodies"])),
        "outputs": (state, len(header["outputs"])),
        "events": (state, len(header["events"])),
    }
    if function in sizes:
        return sizes[function]
    if function.startswith(_RESET) and any(function == _RESET + event["name"] for event in header["events"]):
        return state, state
    return None
