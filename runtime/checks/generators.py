"""Directions of motion that may leave a system as it is: along a coordinate, or all bodies moved as one rigid whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.system import System

# A direction: times (n,) and states (n, nq + nv) -> rates (n, nv); None where bodies cannot move in that way.
Direction = Callable[[np.ndarray, np.ndarray], np.ndarray | None]

_MOST_RATES = 400
_MOST_RATES_OF_BODIES = 100  # directions of bodies cost the cube of the rates at every state
_SAME = 1e-8  # how well rates must give the motion of a whole
_STEP = 1e-2  # of unknowns of size 1: the differences of sixth order are off by 1e-14 then
CENTRAL = (
    (-3, -1 / 60),
    (-2, 3 / 20),
    (-1, -3 / 4),
    (1, 3 / 4),
    (2, -3 / 20),
    (3, 1 / 60),
)  # Fornberg (1988)


def coordinate_directions(system: System) -> Iterator[tuple[str, Direction]]:
    """Yield each coordinate with a rate of its own, and the direction along it."""
    if system.nv > _MOST_RATES:
        return
    positions = Positions(system)
    for k, j in zip(positions.plain_q, positions.plain_v, strict=True):
        yield f"momentum of {system.coordinates[k]['name']}", _along(int(j), system.nv)


def whole_directions(system: System, p: np.ndarray) -> Iterator[tuple[str, Direction]]:
    """Yield shifts along the axes of the world and turns about them, of all bodies together."""
    if not system.has("poses") or system.nv > _MOST_RATES_OF_BODIES:
        return
    for axis, letter in enumerate("xyz"):
        yield f"linear momentum, {letter}", _whole(system, p, axis, turning=False)
    for axis, letter in enumerate("xyz"):
        yield f"angular momentum about {letter}", _whole(system, p, axis, turning=True)


def _along(rate: int, nv: int) -> Direction:
    return lambda t, states: np.tile(np.eye(nv)[rate], (len(t), 1))


def _whole(system: System, p: np.ndarray, axis: int, *, turning: bool) -> Direction:
    unit = np.eye(3)[axis]

    def direction(t: np.ndarray, states: np.ndarray) -> np.ndarray | None:
        poses, by_rates = _pose_derivatives(system, p, t, states)
        position, rotation = poses[..., :3], poses[..., 3:].reshape(*poses.shape[:2], 3, 3)
        moved = np.zeros_like(poses)
        if turning:
            moved[..., :3] = np.cross(unit, position)
            moved[..., 3:] = np.cross(unit, rotation, axisb=2, axisc=2).reshape(*poses.shape[:2], 9)
        else:
            moved[..., :3] = unit
        found = np.zeros((len(t), system.nv))
        for i, (wanted, columns) in enumerate(zip(moved, by_rates, strict=True)):
            # What never moves is scenery, and the attitude of what never turns that of a point.
            can = np.abs(columns).max(axis=2) > _SAME
            part = np.zeros_like(can)
            part[:, :3] = can.any(axis=1)[:, None]
            part[:, 3:] = can[:, 3:].any(axis=1)[:, None]
            a, b = columns[part], wanted[part]
            found[i] = np.linalg.lstsq(a, b, rcond=1e-10)[0]
            if not b.any() or np.abs(a @ found[i] - b).max() > _SAME * np.abs(b).max():
                return None
        return found

    return direction


def _pose_derivatives(
    system: System, p: np.ndarray, t: np.ndarray, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return poses, shape (n, bodies, 12), and their derivatives by what rates move, shape (n, bodies, 12, nv)."""
    nv, n = system.nv, len(CENTRAL)
    steps = np.array([k * _STEP * unit for unit in np.eye(nv) for k, _ in CENTRAL])
    rows = _moved(system, states, steps)
    values = evaluate(system, "poses", p, np.repeat(t, len(steps)), rows).reshape(len(t), nv, n, -1)
    weights = np.array([weight for _, weight in CENTRAL]) / _STEP
    by_rates = np.einsum("njkx,k->nxj", values, weights)
    poses = evaluate(system, "poses", p, t, states)
    return poses.reshape(len(t), -1, 12), by_rates.reshape(len(t), poses.shape[1] // 12, 12, nv)


def _moved(system: System, states: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return each state moved by each step, shape (n * number of steps, nq + nv)."""
    positions, nq = Positions(system), system.nq
    rows = np.repeat(states, len(steps), axis=0)
    every = np.tile(steps, (len(states), 1))
    if positions.turns:
        rows[:, :nq] = [positions.move(q, step) for q, step in zip(rows[:, :nq], every, strict=True)]
    else:
        rows[:, :nq] += every
    return rows
