"""How rates are called: `dot(x)` where they are the derivative of x, otherwise by a name of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from symgen.runtime.abi import closed_header

Records = Sequence[Mapping[str, Any]]


def rate_labels(coordinates: Records, rates: Records) -> list[str]:
    """Return what users read for each rate, such as `dot(theta)` or `ball_wx`."""
    names = {record["name"] for record in coordinates}
    return [f"dot({r['name']})" if r["name"] in names else r["name"] for r in rates]


def acceleration_labels(coordinates: Records, rates: Records) -> list[str]:
    """Return what users read for the derivative of each rate, such as `dot(dot(theta))` or `dot(ball_wx)`."""
    return [f"dot({label})" for label in rate_labels(coordinates, rates)]


def rate_indices(coordinates: Records, rates: Records, quaternions: Sequence[int]) -> dict[str, int]:
    """Return where each rate is, by its name and by that of the coordinate whose derivative it is.

    Parameters
    ----------
    quaternions : sequence of int
        Where in q each quaternion begins; its four coordinates have no rates of their own.
    """
    indices = {record["name"]: index for index, record in enumerate(rates)}
    for i, record in enumerate(coordinates):
        before = [place for place in quaternions if place <= i]
        if not before or i >= before[-1] + 4:
            indices.setdefault(record["name"], i - len(before))
    return indices


def integral_places(header: Mapping[str, Any]) -> tuple[int, ...]:
    """Return where in q the coordinates are whose rates are first-order states."""
    states = set(header.get("states", ()))
    if not states:
        return ()
    rates = rate_indices(header["coordinates"], header["rates"], header.get("quaternions", ()))
    return tuple(i for i, record in enumerate(header["coordinates"]) if rates.get(record["name"]) in states)


def motion_records(records: Records, left_out: Sequence[int]) -> list[tuple[int, Mapping[str, Any]]]:
    """Return records with their places, without those at some places: coordinates without integrals of states."""
    return [(place, record) for place, record in enumerate(records) if place not in left_out]


def inside_dot(name: str) -> str:
    """Return x for `dot(x)`, other names as they are."""
    return name[4:-1] if name.startswith("dot(") and name.endswith(")") else name


def result_label(header: Mapping[str, Any], function: str, place: int) -> str:
    """Return what a function of a module writes at a place of `out`, in words; empty where there are none."""
    if function.startswith("closed_"):
        return result_label(closed_header(header), function.removeprefix("closed_"), place)
    coordinates, rates = header["coordinates"], header["rates"]
    constraints = [record["name"] for record in header["constraints"]]
    equations = [f"the equation of {name}" for name in rate_labels(coordinates, rates)]
    equations += [f"constraint {name}" for name in constraints]
    words = {
        "forces": [f"the force on {name}" for name in rate_labels(coordinates, rates)],
        "energy": ["kinetic energy", "potential energy"],
        "residual": equations,
        "gamma": equations[len(rates) :],
        "solve": [
            *acceleration_labels(coordinates, rates),
            *(f"the multiplier of {name}" for name in constraints),
            *["ratio of pivots"] * len(constraints),
        ],
        "outputs": [record["name"] for record in header["outputs"]],
        "events": [record["name"] for record in header["events"]],
        "rhs": [
            *(f"dot({record['name']})" for record in coordinates),
            *acceleration_labels(coordinates, rates),
            *["power"] * header["nw"],
            *(f"the multiplier of {name}" for name in constraints),
            "ratio of pivots",
        ],
    }
    widths = {"mass_matrix": len(rates), "constraint_jacobian": len(rates)}
    widths["residual_jacobian"] = len(coordinates) + len(rates) + len(equations)
    if function in widths:
        return "row {}, column {}".format(*divmod(place, widths[function]))
    known = words.get(function, ())
    return known[place] if place < len(known) else ""
