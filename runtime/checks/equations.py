"""Whether the functions that a run used are those of one model: each against `residual`, at states along the run.

`rhs` solves M a = f + Gᵀλ and G a = γ by code of its own, in a form that depends on the
model's size. What it gets wrong in the same way each time need not show in steps, energies or constraints.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate, projected, right_hand_sides
from symgen.runtime.checks.entry import HealthCheck, limited
from symgen.runtime.lazy import Late
from symgen.runtime.names import rate_labels
from symgen.runtime.positions import Positions
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
_CHANGE = 1e-5  # relative, of all that enters, to see how large the terms are of which sums are made
_LEAST_RATIO = (
    1e-6  # of pivots; below, equations of constraints may contradict each other within their tolerance
)
_LARGEST_MATRIX = 200  # rates


def equations(solution: Solution) -> Iterator[HealthCheck]:
    """Yield one entry: the largest that is left of any equation, in parts of its terms, and where."""
    rows = sample_rows(len(solution.t), _STATES)
    rows = rows[np.isfinite(solution.states[rows]).all(axis=1)]
    worst = (0.0, "", 0.0, "")
    for system, p, of in _forms(solution, rows):
        t, states = solution.t[of], solution.states[of, : system.nq + system.nv]
        for found in _Held(system, p, t, states).all():
            worst = max(worst, found, key=lambda entry: entry[0] if np.isfinite(entry[0]) else np.inf)
    if solution.parts is not None and len(rows):
        worst = max(worst, *_parts(solution, rows), key=lambda entry: entry[0])
    value, name, t, function = worst
    where = f"{name} at t = {t:.6g} s" if name else "all states"
    yield limited(
        "equations", value, _LIMIT, f"what is left of the equations of motion is {value:.2g} of their terms, at most",
        f"the equations of motion do not hold: `{function}` and `residual` disagree by {value:.2g} of the terms in "
        f"{where}; derive the module again, do not edit it, and report it if that does not help",
    )  # fmt: skip


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


def _parts(solution: Solution, rows: np.ndarray) -> Iterator[tuple[float, str, float, str]]:
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
            yield float(relative.max()), f"the subsystem of {subsystem.name}", float(t[i]), "rhs"


class _Held:
    """The equations of one form of a model at some states, held against `residual`.

    It is linear in accelerations and multipliers, so what it makes of some of them shows M, G and γ as well.
    """

    def __init__(self, system: System, p: np.ndarray, t: np.ndarray, states: np.ndarray):
        self.system, self.p, self.t, self.states = system, p, t, states
        nq, nv = system.nq, system.nv
        self.rhs = right_hand_sides(system, p, t, states)
        if self._dependent().any():
            # Off the constraints, accelerations that dependent ones ask for contradict each other: none fits them all.
            self.states = projected(system, p, t, states)
            self.rhs = right_hand_sides(system, p, t, self.states)
        self.a, self.lam = self.rhs[:, nq : nq + nv], self.rhs[:, system.ny : system.ny + system.m]
        # Terms that cancel do so no more with other weights.
        self.probes = [self.a, *self._weighted(self.a)]
        reactions = [self.lam, *self._weighted(self.lam)] if system.m else []
        no_a, no_lam = 0.0 * self.a, 0.0 * self.lam
        pairs = [(no_a, no_lam), (self.a, self.lam), *((a, no_lam) for a in self.probes)]
        self.zero, self.left, *found = self._residuals([*pairs, *((no_a, lam) for lam in reactions)])
        found = [one - self.zero for one in found]
        self.inertia, self.reactions = found[: len(self.probes)], found[len(self.probes) :]
        self.scale = self._scale()

    def _dependent(self) -> np.ndarray:
        """In which states constraints depend on each other, shape (n,)."""
        if not self.system.m:
            return np.zeros(len(self.t), dtype=bool)
        return ~(self.rhs[:, -1] >= _LEAST_RATIO) | bool(self.system.dependent)

    def _weighted(self, values: np.ndarray) -> Iterator[np.ndarray]:
        """Yield the numbers of each state with weights between -1 and 1."""
        n = values.shape[1]
        for weights in quasi_random(_PROBES * n).reshape(_PROBES, n):
            yield weights * values

    def _residuals(self, pairs: list[tuple[np.ndarray, np.ndarray]]) -> list[np.ndarray]:
        """What `residual` makes of several accelerations and multipliers in the same states, in one go."""
        y = np.vstack([np.hstack([self.states, a, lam]) for a, lam in pairs])
        rows = evaluate(self.system, "residual", self.p, np.concatenate([self.t] * len(pairs)), y)
        n = len(self.t)
        return [rows[k * n : (k + 1) * n] for k in range(len(pairs))]

    def _scale(self) -> np.ndarray:
        """The size of each equation's terms.

        That is what stands in it, and what small relative changes of all that enters would change: forces in
        balance are sums of terms that are larger, and solutions of nearly singular equations have more round-off.
        """
        scale = np.abs(self.zero) + sum(map(np.abs, [*self.inertia, *self.reactions]))
        for k in (1, 2):
            states, p = self._changed(k)
            moved = _Moved(self, states, p)
            with np.errstate(invalid="ignore", over="ignore"):
                terms = np.abs(moved.zero - self.zero) + np.abs(moved.left - self.left)
            scale += np.where(np.isfinite(terms), terms, 0.0) / _CHANGE
        nv = self.system.nv
        if self.system.m:
            free = [(a, 0.0 * self.lam) for a in self._weighted(self._free(scale[:, :nv]))]
            scale[:, nv:] += sum(np.abs(one - self.zero)[:, nv:] for one in self._residuals(free))
        for block in (scale[:, :nv], scale[:, nv:]):
            if block.shape[1]:
                np.maximum(block, _SMALLEST * block.max(axis=1, keepdims=True), out=block)
        return scale

    def _free(self, forces: np.ndarray) -> np.ndarray:
        """About how fast forces would make each rate change alone: what constraints hold is what is left of that."""
        weights = next(self._weighted(np.ones_like(self.a)))
        (made,) = self._residuals([(weights, 0.0 * self.lam)])
        masses = np.abs(made - self.zero)[:, : self.system.nv] / np.abs(weights)
        return np.where(masses > 0.0, forces / np.where(masses > 0.0, masses, 1.0), 0.0)

    def _changed(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        n, n_set = self.states.shape[1], self.system.n_settable
        numbers = quasi_random(k * (n + n_set))[-(n + n_set) :]
        p = self.p.copy()
        p[:n_set] *= 1.0 + _CHANGE * numbers[n:]
        return self.states * (1.0 + _CHANGE * numbers[:n]), p

    def all(self) -> Iterator[tuple[float, str, float, str]]:
        """Yield for each function the largest deviation in parts of an equation's terms, the equation, and the time."""
        system, nv = self.system, self.system.nv
        left = self.left.copy()
        if system.m:
            left[~(self.rhs[:, -1] >= _LEAST_RATIO), nv:] = 0.0
            left[:, [nv + k for k in system.dependent]] = 0.0
        yield self._worst("rhs", left, self.scale)
        yield self._moves()
        known = set(system.compiled)
        if "mass_matrix" in known and nv <= _LARGEST_MATRIX:
            M = evaluate(system, "mass_matrix", self.p, self.t, self.states).reshape(-1, nv, nv)
            for a, inertia in zip(self.probes, self.inertia, strict=True):
                off = (M @ a[:, :, None])[:, :, 0] - inertia[:, :nv]
                size = (np.abs(M) @ np.abs(a)[:, :, None])[:, :, 0] + self.scale[:, :nv]
                yield self._worst("mass_matrix", off, size)
        if "forces" in known and not any(switch.get("normal") for switch in system.switches):
            off = evaluate(system, "forces", self.p, self.t, self.states) + self.zero[:, :nv]
            yield self._worst("forces", off, self.scale[:, :nv])
        if "gamma" in known:
            off = evaluate(system, "gamma", self.p, self.t, self.states) + self.zero[:, nv:]
            yield self._worst("gamma", off, self.scale[:, nv:], nv)
        if "constraint_jacobian" in known and nv <= _LARGEST_MATRIX:
            G = evaluate(system, "constraint_jacobian", self.p, self.t, self.states).reshape(-1, system.m, nv)
            for a, inertia in zip(self.probes, self.inertia, strict=True):
                off = (G @ a[:, :, None])[:, :, 0] - inertia[:, nv:]
                size = (np.abs(G) @ np.abs(a)[:, :, None])[:, :, 0] + self.scale[:, nv:]
                yield self._worst("constraint_jacobian", off, size, nv)

    def _moves(self) -> tuple[float, str, float, str]:
        """How far `rhs` is from dq/dt = N v, with N as quaternions are turned."""
        system = self.system
        q, v = self.states[:, : system.nq], self.states[:, system.nq :]
        rates = Positions(system).derivatives(q, v)
        off = np.abs(self.rhs[:, : system.nq] - rates)
        size = np.maximum(np.abs(rates), _SMALLEST * np.abs(v).max(axis=1, initial=0.0, keepdims=True))
        relative = np.where(off > 0.0, off / np.where(size > 0.0, size, 1.0), 0.0)
        if not relative.size or not np.isfinite(relative).all():
            return 0.0, "", 0.0, "rhs"
        i, j = np.unravel_index(np.argmax(relative), relative.shape)
        return float(relative[i, j]), f"the rate of {system.coordinates[j]['name']}", float(self.t[i]), "rhs"

    def _worst(
        self, function: str, off: np.ndarray, size: np.ndarray, first: int = 0
    ) -> tuple[float, str, float, str]:
        off = np.where(np.isfinite(off) & np.isfinite(size), np.abs(off), 0.0)
        relative = np.where(off > 0.0, off / np.where(size > 0.0, size, 1.0), 0.0)
        if not relative.size:
            return 0.0, "", 0.0, function
        i, j = np.unravel_index(np.argmax(relative), relative.shape)
        system = self.system
        names = [f"the equation of {name}" for name in rate_labels(system.coordinates, system.rates)]
        names += [f"constraint {record['name']!r}" for record in system.constraints]
        return float(relative[i, j]), names[first + j], float(self.t[i]), function


class _Moved:
    """What is left of the same equations with accelerations and multipliers of slightly other states and parameters."""

    def __init__(self, held: _Held, states: np.ndarray, p: np.ndarray):
        system = held.system
        rhs = right_hand_sides(system, p, held.t, states)
        a, lam = rhs[:, system.nq : system.nq + system.nv], rhs[:, system.ny : system.ny + system.m]
        (self.left,) = held._residuals([(a, lam)])
        self.zero = evaluate(system, "residual", p, held.t, np.hstack([states, 0.0 * a, 0.0 * lam]))
