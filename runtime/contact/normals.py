"""What presses where a friction is in proportion to a reaction: a stop, or constraints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.system import System

Normal = tuple[
    int | None, np.ndarray
]  # the number of a stop, or those of constraints; neither if a level is given


def normals_of(system: System) -> list[Normal]:
    """Return what presses for each friction of a model."""
    stops = [switch["name"] for switch in system.switches if switch["kind"] == "stop"]
    constraints = [record["name"] for record in system.constraints]
    normals: list[Normal] = []
    for switch in system.switches:
        if switch["kind"] == "stop":
            continue
        names = switch.get("normal", ())
        on_stop = len(names) == 1 and names[0] in stops
        rows = () if on_stop else [constraints.index(name) for name in names]
        normals.append((stops.index(names[0]) if on_stop else None, np.array(rows, dtype=int)))
    return normals


def smooth_frictions(system: System) -> np.ndarray:
    """Return of each friction of a model whether it never sticks but gives way below some speed."""
    frictions = (switch for switch in system.switches if switch["kind"] == "friction")
    return np.array([switch.get("smooth", False) for switch in frictions], dtype=bool)


def smooth_sense(speeds: np.ndarray, widths: np.ndarray) -> np.ndarray:
    """Return the part of its level that smooth friction has: s / sqrt(s² + w²), from -1 to 1."""
    return speeds / np.hypot(speeds, widths)


def given(normal: Normal) -> bool:
    """Whether a friction's level does not follow from a reaction."""
    return normal[0] is None and len(normal[1]) == 0


def normal_forces(normals: list[Normal], forces: np.ndarray, multipliers: np.ndarray) -> np.ndarray:
    """Return the normal force of each friction, 0 where its level is given.

    Parameters
    ----------
    normals : list of Normal
    forces : ndarray, shape (..., n)
        Of stops, then of frictions.
    multipliers : ndarray, shape (..., m)

    Returns
    -------
    ndarray, shape (..., number of frictions)
    """
    sizes = [
        np.maximum(forces[..., stop], 0.0)
        if stop is not None
        else np.linalg.norm(multipliers[..., rows], axis=-1)
        for stop, rows in normals
    ]
    return np.stack(sizes, axis=-1) if sizes else np.zeros((*forces.shape[:-1], 0))
