"""Whether the functions that a run used are those of one model: each against `residual`, at states along the run.

`rhs` solves M a = f + Gᵀλ and G a = γ by code of its own, in a form that depends on the
model's size. What it gets wrong in the same way each time need not show in steps, energies or constraints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate, projected, right_hand_sides
from symgen.runtime.checks.entry import HealthCheck, limited
from symgen.runtime.lazy import Late
from symgen.runtime.names import rate_labels
from symgen.runtime.positions import Positions
from symgen.runtime.record import record
from symgen.runtime.sampling import quasi_random, sample_rows

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution
    from symgen.runtime.system import System

forms = Late("symgen.runtime.contact.forms")

_STATES = 5
_LIMIT = 1e-8  # of the size of an equation's terms
_SMALLEST = (
    1e-6  # size of terms, of the largest in other equations, below which there is nothing but round-off
)
_PROBES = 2  # of other accelerations and multipliers
_CHANGES, _CHANGE = (
    2,
    1e-5,
)  # relative, of all that enters, to see how large the terms are of which sums are made
_LEAST_RATIO = (
    1e-6  # of pivots; below, equations of constraints may contradict each other within their tolerance
)
_LARGEST_MATRIX = 200  # rates


def equations(solution: Solution) -> Iterator[HealthCheck]:
    """Yield one entry: the largest that is left of any equation, in parts of its terms, and where."""
    rows = sample_rows(len(solution.t), _STATES)
    rows = rows[np.isfinite(solution.states[rows]).all(axis=1)]
    worst = _Left()
    for system, p, of in _forms(solution, rows):
        t, states = solution.t[of], solution.states[of, : system.nq + system.nv]
        for found in _Held(system, p, t, states).all():
            worst = max(worst, found, key=lambda left: left.value if np.isfinite(left.value) else np.inf)
    if solution.parts is not None and len(rows):
        worst = max(worst, *_parts(solution, rows), key=lambda left: left.value)
    found = f"what is left of the equations of motion is {worst.value:.2g} of their terms, at most"
    objection = "" if worst.value <= _LIMIT else _objection(worst)
    yield limited("equations", worst.value, _LIMIT, found, objection)


def _objection(worst: _Left) -> str:
    where = f"{worst.name()} at t = {worst.t:.6g} s" if worst.name is not None else "all states"
    return (
        f"the equations of motion do not hold: `{worst.function}` and `residual` disagree by {worst.value:.2g} of the "
        f"terms in {where}; derive the module again, do not edit it, and report it if that does not help"
    )


@record
class _Left:
    """The largest that is left of the equations of a function.

    Attributes
    ----------
    value : float
        In parts of an equation's terms.
    name : callable or None
        What says which equation that is.
    t : float [s]
    function : str
    """

    value: float = 0.0
    name: Callable[[], str] | None = None
    t: float = 0.0
    function: str = ""


def _forms(solution: Solution, rows: np.ndarray) -> Iterator[tuple[System, np.ndarray, np.ndarray]]:
    """Yield the systems that held at frames, with their parameters and those frames: stops and friction switch."""
    if solution.forms is None:
        yield solution.system, solution.p, rows
        return
    index = solution.forms.index[rows]
    for k in sorted(set(index.tolist())):
        p = solution.p.copy()
        p[solution.system.settings_of_switches] = solution.forms.settings[k]
        yield forms.form_of(solution.system, solution.forms.settings[k]), p, rows[index == k]


def _parts(solution: Solution, rows: np.ndarray) -> Iterator[_Left]:
    """Yield how far the accelerations of subsystems that ran by themselves are from those of the whole model."""
    system, t = solution.system, solution.t[rows]
    whole = right_hand_sides(system, solution.p, t, solution.states[rows])[:, : system.nq + system.nv]
    met: set[int] = set()
    for subsystem in solution.parts.found:
        own = subsystem.run.system
        if id(own) in met:
            continue
        met.add(id(own))
        columns = subsystem.columns[0][: own.nq + own.nv]
        apart = right_hand_sides(own, subsystem.run.arrays.p, t, solution.states[rows][:, columns])
        off = np.abs(apart[:, : len(columns)] - whole[:, columns])
        scale = np.maximum(np.abs(whole[:, columns]), 1e-3 * np.abs(whole[:, columns]).max(initial=0.0))
        relative = np.where(off > 0.0, off / np.where(scale > 0.0, scale, 1.0), 0.0)
        if np.isfinite(relative).all() and relative.size:
            i, _ = np.unravel_index(np.argmax(relative), relative.shape)
            name = f"the subsystem of {subsystem.name}"
            yield _Left(float(relative.max()), lambda name=name: name, float(t[i]), "rhs")


class _Held:
    """The equations of one form of a model at some states, held against `residual`.

    It is linear in accelerations and multipliers, so what it makes of some of them shows M, G and γ as well. All of
    that is asked for in one go: each call takes longer than what it is called for.
    """

    def __init__(self, system: System, p: np.ndarray, t: np.ndarray, states: np.ndarray):
        self.system, self.p, self.t, self.states = system, p, t, states
        self.rhs = right_hand_sides(system, p, t, states)
        if self._dependent().any():
            # Off the constraints, accelerations that dependent ones ask for contradict each other: none fits them all.
            self.states = projected(system, p, t, states)
            self.rhs = right_hand_sides(system, p, t, self.states)
        a, lam = self._solved(self.rhs)
        self.weights = _weights(system.nv)
        # Terms that cancel do so no more with other weights.
        self.probes = np.concatenate([a[None], self.weights[:, None] * a])
        reactions = (
            np.concatenate([lam[None], _weights(system.m)[:, None] * lam]) if system.m else lam[:0, None]
        )
        moved = [_Moved(self, k) for k in range(1, _CHANGES + 1)]
        # Nothing; what `rhs` says; accelerations alone; multipliers alone; accelerations of size one; what `rhs` says
        # of slightly other states.
        puts = [(0.0, 0.0), (a, lam), *((a, 0.0) for a in self.probes), *((0.0, lam) for lam in reactions)]
        found = self._residuals([*puts, (self.weights[0], 0.0), *((one.a, one.lam) for one in moved)])
        self.zero, self.left = found[:2]
        added = found[2 : len(puts) + 1] - self.zero
        self.inertia, self._of_one = added[: len(self.probes)], added[-1]
        self.scale = np.abs(self.zero) + np.abs(added[:-1]).sum(axis=0)
        self._take_changes([one.zero for one in moved], found[len(puts) + 1 :])

    def _solved(self, rhs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations and multipliers in rows of `rhs`."""
        nq, nv, ny, m = self.system.nq, self.system.nv, self.system.ny, self.system.m
        return rhs[:, nq : nq + nv], rhs[:, ny : ny + m]

    def _dependent(self) -> np.ndarray:
        """In which states constraints depend on each other, shape (n,)."""
        if not self.system.m:
            return np.zeros(len(self.t), dtype=bool)
        return ~(self.rhs[:, -1] >= _LEAST_RATIO) | bool(self.system.dependent)

    def _residuals(self, puts: Sequence[tuple[np.ndarray | float, np.ndarray | float]]) -> np.ndarray:
        """What `residual` makes of several accelerations and multipliers in the same states, shape (k, n, nv + m)."""
        n, n_state, nv = *self.states.shape, self.system.nv
        y = np.empty((len(puts), n, n_state + nv + self.system.m))
        y[:, :, :n_state] = self.states
        for row, (a, lam) in zip(y, puts):
            row[:, n_state : n_state + nv], row[:, n_state + nv :] = a, lam
        times = np.concatenate([self.t] * len(puts))
        found = evaluate(self.system, "residual", self.p, times, y.reshape(len(times), -1))
        return found.reshape(len(puts), n, -1)

    def _take_changes(self, zeros: list[np.ndarray], lefts: np.ndarray) -> None:
        """Let the size of each equation's terms be what small relative changes of all that enters make of it as well.

        Forces in balance are sums of terms that are larger, and solutions of nearly singular equations have more
        round-off.
        """
        scale, nv = self.scale, self.system.nv
        for zero, left in zip(zeros, lefts):
            with np.errstate(invalid="ignore", over="ignore"):
                terms = np.abs(zero - self.zero) + np.abs(left - self.left)
            scale += np.where(np.isfinite(terms), terms, 0.0) / _CHANGE
        if self.system.m:
            free = self.weights[:, None] * self._free(scale[:, :nv])
            made = self._residuals([(a, 0.0) for a in free]) - self.zero
            scale[:, nv:] += np.abs(made[:, :, nv:]).sum(axis=0)
        for block in (scale[:, :nv], scale[:, nv:]):
            if block.shape[1]:
                np.maximum(block, _SMALLEST * block.max(axis=1, keepdims=True), out=block)

    def _free(self, forces: np.ndarray) -> np.ndarray:
        """About how fast forces would make each rate change alone: what constraints hold is what is left of that."""
        masses = np.abs(self._of_one)[:, : self.system.nv] / np.abs(self.weights[0])
        return np.where(masses > 0.0, forces / np.where(masses > 0.0, masses, 1.0), 0.0)

    def all(self) -> Iterator[_Left]:
        """Yield for each function the largest deviation in parts of an equation's terms, the equation, and the time."""
        system, nv = self.system, self.system.nv
        left = self.left
        if system.m:
            left = left.copy()
            left[~(self.rhs[:, -1] >= _LEAST_RATIO), nv:] = 0.0
            left[:, [nv + k for k in system.dependent]] = 0.0
        yield self._worst("rhs", left, self.scale)
        yield self._moves()
        known = set(system.compiled)
        if "mass_matrix" in known and nv <= _LARGEST_MATRIX:
            yield self._worst_of_matrix("mass_matrix", nv, 0)
        if "forces" in known and not any(switch.get("normal") for switch in system.switches):
            off = evaluate(system, "forces", self.p, self.t, self.states) + self.zero[:, :nv]
            yield self._worst("forces", off, self.scale[:, :nv])
        if "gamma" in known:
            off = evaluate(system, "gamma", self.p, self.t, self.states) + self.zero[:, nv:]
            yield self._worst("gamma", off, self.scale[:, nv:], nv)
        if "constraint_jacobian" in known and nv <= _LARGEST_MATRIX:
            yield self._worst_of_matrix("constraint_jacobian", system.m, nv)

    def _worst_of_matrix(self, function: str, n_rows: int, first: int) -> _Left:
        """Hold a matrix with `n_rows` rows against what `residual` makes of accelerations, from equation `first` on."""
        matrix = evaluate(self.system, function, self.p, self.t, self.states)
        matrix = matrix.reshape(-1, n_rows, self.system.nv)
        own = slice(first, first + n_rows)
        off = (matrix @ self.probes[..., None])[..., 0] - self.inertia[..., own]
        size = (np.abs(matrix) @ np.abs(self.probes)[..., None])[..., 0] + self.scale[:, own]
        return self._worst(function, off, size, first)

    def _moves(self) -> _Left:
        """How far `rhs` is from dq/dt = N v, with N as quaternions are turned."""
        system = self.system
        q, v = self.states[:, : system.nq], self.states[:, system.nq :]
        rates = Positions(system).derivatives(q, v)
        off = np.abs(self.rhs[:, : system.nq] - rates)
        if not off.any():
            return _Left(function="rhs")
        size = np.maximum(np.abs(rates), _SMALLEST * np.abs(v).max(axis=1, initial=0.0, keepdims=True))
        relative = np.where(off > 0.0, off / np.where(size > 0.0, size, 1.0), 0.0)
        if not np.isfinite(relative).all():
            return _Left(function="rhs")
        i, j = np.unravel_index(np.argmax(relative), relative.shape)
        name = f"the rate of {system.coordinates[j]['name']}"
        return _Left(float(relative[i, j]), lambda: name, float(self.t[i]), "rhs")

    def _worst(self, function: str, off: np.ndarray, size: np.ndarray, first: int = 0) -> _Left:
        """Return the largest of `off`, shape (..., n, number of equations), in parts of `size`."""
        off = np.abs(off)
        relative = off / size
        if not np.isfinite(relative.sum()):  # seldom, and three times the work
            off = np.where(np.isfinite(off) & np.isfinite(size), off, 0.0)
            relative = np.where(off > 0.0, off / np.where(size > 0.0, size, 1.0), 0.0)
        if not relative.size:
            return _Left(function=function)
        place = int(np.argmax(relative))
        i, j = divmod(place % relative[(0,) * (relative.ndim - 2)].size, relative.shape[-1])
        return _Left(
            float(relative.flat[place]), lambda: self._equation(first + j), float(self.t[i]), function
        )

    def _equation(self, k: int) -> str:
        """Return the name of an equation."""
        system = self.system
        names = [f"the equation of {name}" for name in rate_labels(system.coordinates, system.rates)]
        return [*names, *(f"constraint {record['name']!r}" for record in system.constraints)][k]


class _Moved:
    """Slightly other states and parameters: what `rhs` says of them, and what forces are left there."""

    def __init__(self, held: _Held, k: int):
        system, n, n_set = held.system, held.states.shape[1], held.system.n_settable
        numbers = quasi_random(k * (n + n_set))[-(n + n_set) :]
        p = held.p.copy()
        p[:n_set] *= 1.0 + _CHANGE * numbers[n:]
        y = np.zeros((len(held.t), n + system.nv + system.m))
        y[:, :n] = held.states * (1.0 + _CHANGE * numbers[:n])
        self.zero = evaluate(system, "residual", p, held.t, y)
        self.a, self.lam = held._solved(right_hand_sides(system, p, held.t, y[:, :n]))


def _weights(n: int) -> np.ndarray:
    """Return weights between -1 and 1 for n numbers of each state, shape (probes, n)."""
    return quasi_random(_PROBES * n).reshape(_PROBES, n)
