"""Momenta that the equations keep, and by how much runs fail to (Noether 1918: each belongs to a symmetry).

Which ones stay depends on parameters too (no gravity, no damping), so the equations are asked with those of the run:
the momentum ξ·∂T/∂v in a direction ξ is kept if its derivative along the motion vanishes, also beside the run.

Directions of motion that may leave a system as it is: along a coordinate, or all bodies moved as one rigid whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, evaluate
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.checks.horizon import Comparison
    from symgen.runtime.solution import Solution
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
        if int(j) in system.states:
            continue
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
    if positions.quaternions:
        rows[:, :nq] = [positions.retract(q, step) for q, step in zip(rows[:, :nq], every, strict=True)]
    else:
        rows[:, :nq] += every
    return rows


_STATES = 3  # at which conservation is tested
_BESIDE = 0.2  # how far these are from the run, in parts of the variables' sizes
_LEAST_SIZE = 0.1  # of the largest variable of its kind
_MOVED = 1e-2  # in parts of the sizes, by differences along the motion
_KEPT = (
    1e-7  # derivative over the time in which the state changes by its size, in parts of the momentum's scale
)
_MOST_TIMES = 60  # at which momenta are computed


@dataclass(frozen=True)
class Momentum:
    """A momentum that stays.

    Attributes
    ----------
    name : str
    start : float
        In units of the model.
    drift : tuple of float
        Of each run, coarsest first: the largest change, in parts of the most that the kinetic energy allows.
    """

    name: str
    start: float
    drift: tuple[float, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the entry as a dictionary."""
        return {"name": self.name, "start": self.start, "drift": list(self.drift)}


def momenta(runs: list[Solution], compared: Comparison) -> tuple[Momentum, ...]:
    """Return the conserved momenta of the runs; none where events, stops or inputs over time act."""
    first = runs[0]
    system, p = first.system, first.p
    if any(run.events for run in runs) or first.forms is not None or system.input_descriptions:
        return ()
    at = np.unique(np.linspace(0, len(compared.t) - 1, _MOST_TIMES).astype(int))
    t, states = compared.t[at], compared.states[:, at]
    found = []
    for name, direction in _conserved(system, p, t, states[-1]):
        values, scales = zip(*(_momentum(system, p, t, rows, direction) for rows in states), strict=True)
        scale = max(float(np.max(scales)), np.finfo(float).tiny)
        drift = tuple(float(np.abs(value - value[0]).max() / scale) for value in values)
        found.append(Momentum(name, float(values[-1][0]), drift))
    return tuple(found)


def _conserved(
    system: System, p: np.ndarray, t: np.ndarray, states: np.ndarray
) -> list[tuple[str, Direction]]:
    """Return the directions whose momenta stay, those of coordinates first; what follows from others is left out."""
    beside = _NeighbouringStates(system, p, t, states)
    if not beside.usable:
        return []
    found = [(name, along) for name, along in coordinate_directions(system) if beside.keeps(along)]
    single = np.array([along(beside.t[:1], beside.states[:1])[0] for _, along in found]).reshape(
        -1, system.nv
    )
    for name, along in whole_directions(system, p):
        rates = along(beside.t, beside.states)
        if rates is None:
            continue
        constant = np.abs(rates - rates[0]).max() < _KEPT
        if constant and not np.abs(rates[0][~single.any(axis=0)]).max(initial=0.0) > _KEPT:
            continue
        if beside.keeps(along):
            found.append((name, along))
    return found


class _NeighbouringStates:
    """Some states near those of a run, each with states before and behind it on the line that it moves along."""

    def __init__(self, system: System, p: np.ndarray, t: np.ndarray, states: np.ndarray):
        self._system, self._p = system, p
        nq = system.nq
        positions, rng = Positions(system), np.random.default_rng(1)
        size = np.abs(states).max(axis=0)
        for part in (slice(0, nq), slice(nq, None)):
            size[part] = np.maximum(size[part], _LEAST_SIZE * size[part].max(initial=0.0))
        size[size == 0.0] = 1.0
        rows = np.linspace(0, len(t) - 1, _STATES).astype(int)
        self.t = t[rows]
        self.states = states[rows] + _BESIDE * size * rng.uniform(-1.0, 1.0, (len(rows), len(size)))
        self.states[:, :nq] = [positions.normalised(q) for q in self.states[:, :nq]]
        v = self.states[:, nq:]
        a = accelerations_and_multipliers(system, p, self.t, self.states)[0]
        # The time in which rates, or coordinates, change by their size.
        sizes_of_rates = size[nq:]
        speed = np.maximum(np.abs(a) / sizes_of_rates, np.abs(v) / positions.per_rate(size[:nq], 1.0)).max(
            axis=1
        )
        self.usable = bool(np.all(np.isfinite(speed)))
        self._time = 1.0 / np.maximum(speed, 1e-300)
        h = _MOVED * self._time[:, None]
        self._moved = [
            (weight / _MOVED, self._ahead(positions, k * h * v, k * h * a)) for k, weight in CENTRAL
        ]

    def _ahead(self, positions: Positions, dq: np.ndarray, dv: np.ndarray) -> np.ndarray:
        nq = self._system.nq
        q = [positions.retract(q, step) for q, step in zip(self.states[:, :nq], dq, strict=True)]
        return np.hstack([q, self.states[:, nq:] + dv])

    def keeps(self, direction: Direction) -> bool:
        """Return whether the momentum in a direction has no derivative along the motion."""
        change, scale = np.zeros(len(self.t)), np.zeros(len(self.t))
        for weight, states in self._moved:
            value, bound = _momentum(self._system, self._p, self.t, states, direction)
            change, scale = change + weight * value, np.maximum(scale, bound)
        return bool(np.all(np.abs(change) <= _KEPT * scale) and np.all(scale > 0.0))


def _momentum(
    system: System, p: np.ndarray, t: np.ndarray, states: np.ndarray, direction: Direction
) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ·∂T/∂v, and the most that T allows it to be, √(2 T ξ·M ξ): shape (n,) each.

    T is a polynomial of second degree in the rates: its differences are derivatives, whatever the step.
    """
    rates = direction(t, states)
    if rates is None:
        return np.full(len(t), np.nan), np.zeros(len(t))
    v = states[:, system.nq :]
    size = np.abs(rates).max(axis=1)
    step = np.abs(v).max(axis=1) / np.where(size > 0.0, size, 1.0)
    step[step == 0.0] = 1.0
    kinetic = []
    for sign in (-1.0, 0.0, 1.0):
        moved = states.copy()
        moved[:, system.nq :] += sign * step[:, None] * rates
        kinetic.append(evaluate(system, "energy", p, t, moved)[:, 0])
    below, here, above = kinetic
    along = np.maximum(above - 2.0 * here + below, 0.0)
    return (above - below) / (2.0 * step), np.sqrt(2.0 * np.maximum(here, 0.0) * along) / step
