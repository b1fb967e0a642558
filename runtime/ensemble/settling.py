"""Stops and dry friction of many members at an instant: what `contact/switching.py` finds where one of them counts.

One stop or one friction along a line, with all others open or sliding, has closed forms: Newton's law of impact, a
force that is clipped. They are worked out for all members that are at an event, number by number, so that a member's
bits do not depend on the others. What is more than that (several that touch or rest, forces that do not tell) is left
to the full code, member by member.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.contact.instant import _SURELY_SEEN, AHEAD, LIMIT_ROUNDED, ROUNDED, UNDECIDED
from symgen.runtime.contact.local_dynamics import (
    _LED,
    creeping_frictions,
    given,
    normals_of,
    smooth_frictions,
)
from symgen.runtime.contact.settings import Layout
from symgen.runtime.ensemble.evaluate import Evaluator
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.system import System

LARGEST = 24  # rates: mass matrices are factored in full
_NONE = -1
_OF_CLOSED = ("constraint_jacobian", "constraint_residual", "gamma")
_OF_OPEN = ("mass_matrix", "forces", "switches", "energy")


def has_plain_switches(system: System) -> bool:
    """Whether stops and frictions of a model are settled here: free motion, frictions along lines of a given size."""
    return (
        bool(system.switches)
        and not (system.m or system.quaternions or system.jumps or system.input_descriptions)
        and len(system.events) == len(system.switches)
        and system.nq == system.nv <= LARGEST
        and not len(Layout(system).circles)
        and not (smooth_frictions(system) | creeping_frictions(system)).any()
        and all(given(normal) for normal in normals_of(system))
        and not system.sequential_impacts
    )


@dataclass(eq=False)
class Settled:
    """What follows at an instant; the arrays are those that were given, written over.

    Attributes
    ----------
    plain : ndarray of bool, shape (k,)
        Members for which it is known; the others are as they were.
    """

    plain: np.ndarray
    parameters: np.ndarray
    states: np.ndarray


@dataclass(eq=False)
class _Equations:
    """The equations of motion at states of members, as `local_dynamics.LocalDynamics`; n stops and frictions.

    Attributes
    ----------
    rows, responses : ndarray, shape (k, n, nv)
        W, and the accelerations that unit forces cause.
    speeds, free, compliance, alone : ndarray, shape (k, n)
        The last two: of each by itself, and without the inertia of others.
    rates : ndarray, shape (k, nv)
        Accelerations with all open.
    gamma : ndarray, shape (k, n)
        W a of what is held.
    lower : ndarray, shape (k, nv, nv)
        The factor of the mass matrix.
    """

    rows: np.ndarray
    responses: np.ndarray
    speeds: np.ndarray
    free: np.ndarray
    compliance: np.ndarray
    alone: np.ndarray
    rates: np.ndarray
    gamma: np.ndarray
    lower: np.ndarray

    def of(self, which: np.ndarray) -> _Equations:
        """Those of some members."""
        return _Equations(*(getattr(self, field.name)[which] for field in fields(self)))


@dataclass(eq=False)
class _Watched:
    """Gaps, restitutions, and levels of sliding and sticking, shape (k, number of them) each."""

    gaps: np.ndarray
    restitutions: np.ndarray
    sliding: np.ndarray
    static: np.ndarray

    def of(self, which: np.ndarray) -> _Watched:
        """Those of some members."""
        return _Watched(*(getattr(self, field.name)[which] for field in fields(self)))


class Settling:
    """Settles plain events of a model's stops and frictions.

    Parameters
    ----------
    system : System
        `has_plain_switches` of it.
    rtol, atol : float
    """

    def __init__(self, system: System, rtol: float, atol: float) -> None:
        self._system, self._closed, self._layout = system, system.closed, Layout(system)
        self._positions = Positions(system)
        self._rtol, self._atol = rtol, atol
        self._first = system.n_settable
        self._on = np.array(list(self._closed.switched.values()), dtype=int)
        self._rows = np.array(list(self._closed.switched), dtype=int)
        self.n_stops, self.n = self._layout.n_stops, len(self._rows)
        closed = {name: Evaluator(self._closed, name) for name in _OF_CLOSED}
        self._functions = closed | {name: Evaluator(system, name) for name in _OF_OPEN}

    def held(self, parameters: np.ndarray) -> np.ndarray:
        """Which stops are closed and frictions stick, shape (k, n)."""
        settings = parameters[:, self._first :]
        return settings[:, np.concatenate([self._layout.closed, self._layout.stuck])] != 0.0

    def energy(self, parameters: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """T + V, shape (k,) [J]."""
        parts = self._evaluate("energy", parameters, times, states)
        return parts[:, 0] + parts[:, 1]

    def widths(self, parameters: np.ndarray, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """How far below zero gaps and sliding speeds count as zero, as `Instant.bands`; 0 of what is held."""
        rows, speeds = self._kinematics(parameters, times, states)
        slow = self._slow(rows, states)
        allowed = np.concatenate([self._gap_tolerances(rows, states), slow[:, self.n_stops :]], axis=1)
        return np.where(self.held(parameters) | (np.abs(speeds) > slow), 0.0, allowed)

    def sizes_of_gaps(
        self, parameters: np.ndarray, times: np.ndarray, states: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """How much gaps change with coordinates, sums of the magnitudes of their slopes, and how large these are.

        Both have shape (k, number of stops).
        """
        rows = self._kinematics(parameters, times, states)[0][:, : self.n_stops]
        return _row_sums(rows), self.coordinates_of(rows, states)

    def start(self, parameters: np.ndarray, times: np.ndarray, states: np.ndarray) -> Settled:
        """Settle members that begin: gaps are open, and all slides but for one friction at most."""
        here, watched = self._equations(parameters, times, states), self._watched(parameters, times, states)
        plain = _sound(here, states) & (watched.gaps > self._gap_tolerances(here.rows, states)).all(axis=1)
        still = np.abs(here.speeds) <= self._slow(here.rows, states)
        still[:, : self.n_stops] = False
        plain &= still.sum(axis=1) <= 1
        parameters[np.ix_(plain, self._first + self._layout.sense)] = np.sign(
            here.speeds[plain, self.n_stops :]
        )
        number = np.where(still.any(axis=1), np.argmax(still, axis=1), _NONE)
        return self._settle(number, plain, here, watched, parameters, times, states)

    def act(
        self, fired: np.ndarray, parameters: np.ndarray, times: np.ndarray, states: np.ndarray
    ) -> Settled:
        """Act on one event of each member.

        Parameters
        ----------
        fired : ndarray of int, shape (k,)
            Numbers of stops and frictions.
        parameters : ndarray, shape (k, n_p)
            With what holds and slides; it is written over.
        times : ndarray, shape (k,) [s]
        states : ndarray, shape (k, nq + nv)
            It is written over.
        """
        here, watched = self._equations(parameters, times, states), self._watched(parameters, times, states)
        others = np.arange(self.n) != fired[:, None]
        plain = _sound(here, states) & ~(self.held(parameters) & others).any(axis=1)
        near = watched.gaps <= self._gap_tolerances(here.rows, states)
        plain &= ~(near & others[:, : self.n_stops]).any(axis=1)
        slow = np.abs(here.speeds) <= self._slow(here.rows, states)
        plain &= ~(slow & others)[:, self.n_stops :].any(axis=1)
        return self._settle(fired, plain, here, watched, parameters, times, states)

    def _settle(
        self, number: np.ndarray, plain: np.ndarray, here: _Equations, watched: _Watched, parameters: np.ndarray,
        times: np.ndarray, states: np.ndarray,
    ) -> Settled:  # fmt: skip
        before = parameters.copy(), states.copy()
        for i in range(self.n):
            which = np.flatnonzero(plain & (number == i))
            if not len(which):
                continue
            settle = self._settle_stop if i < self.n_stops else self._settle_friction
            p, y = parameters[which], states[which]
            plain[which] = settle(i, here.of(which), watched.of(which), p, times[which], y)
            parameters[which], states[which] = p, y
        plain &= np.isfinite(states).all(axis=1)
        for values, old in zip((parameters, states), before, strict=True):
            values[~plain] = old[~plain]
        return Settled(plain, parameters, states)

    def _settle_stop(
        self, i: int, here: _Equations, watched: _Watched, p: np.ndarray, t: np.ndarray, y: np.ndarray
    ) -> np.ndarray:
        """Settle the stop that has been reached, or presses no longer; returns for which members that is known."""
        closed = self._first + self._layout.closed[i]
        was_closed = p[:, closed] != 0.0
        p[:, closed] = 0.0
        e, speed = watched.restitutions[:, i], here.speeds[:, i]
        plain = _sound(here, y) & ~self._led(here, i) & (e >= 0.0) & (e <= 1.0)
        tolerance = self._slow(here.rows, y)[:, i]
        plain &= np.where(was_closed, np.abs(speed) <= tolerance, speed <= 0.0)
        with np.errstate(all="ignore"):
            impulse = np.where(was_closed | (speed >= 0.0), 0.0, -(1.0 + e) * speed / here.compliance[:, i])
        self._push(y, here, i, impulse)
        speeds = self._evaluate("constraint_residual", p, t, y)
        slow = np.abs(speeds) <= self._slow(here.rows, y)
        plain &= ~slow[:, self.n_stops :].any(axis=1)
        p[:, self._first + self._layout.sense] = np.sign(speeds[:, self.n_stops :])
        here = replace(here, speeds=speeds, gamma=self._evaluate("gamma", p, t, y))
        here, speed = self._with_forces(here, p, t, y), speeds[:, i]
        force, pull = _pressing(here, i)
        flight = np.maximum(speed, 0.0) ** 2
        opens = (pull > 0.0) & (flight > 2.0 * pull * self._gap_tolerances(here.rows, y)[:, i])
        small = UNDECIDED * np.abs(here.free).max(axis=1)
        weak = ~opens & (np.abs(pull) <= small) & (np.abs(here.free[:, i] + pull) <= small)
        weak &= np.abs(speed) <= self._slow(here.rows, y)[:, i]
        balanced = ROUNDED * _product(np.abs(here.rows[:, i]), np.abs(here.rates))
        holds = ~opens & ~weak & (pull > balanced)
        if weak.any():
            later = self._equations(p[weak], *self._later(here, t, y, i, force, weak))
            holds[weak] = later.free[:, i] <= here.free[weak, i]
        p[:, closed] = holds
        self._bring_to_rest(y, here, i, holds)
        return plain

    def _settle_friction(
        self, i: int, here: _Equations, watched: _Watched, p: np.ndarray, t: np.ndarray, y: np.ndarray
    ) -> np.ndarray:
        """Settle the friction that has come to rest, or can no longer hold; returns for which members that is known."""
        j = i - self.n_stops
        stuck, sense = self._first + self._layout.stuck[j], self._first + self._layout.sense[j]
        p[:, stuck] = p[:, sense] = 0.0
        here = self._with_forces(here, p, t, y)
        plain = _sound(here, y) & ~self._led(here, i)
        force, most = self._rubbing(here, watched, i)
        pulled = np.where(np.abs(force) < most, 0.0, here.free[:, i] + here.compliance[:, i] * force)
        sticks = np.abs(force) < (1.0 - 2.0 * LIMIT_ROUNDED) * most
        undecided = ~sticks & (np.abs(pulled) <= UNDECIDED * np.abs(here.free).max(axis=1))
        if undecided.any():
            own, then = p[undecided], self._later(here, t, y, i, force, undecided)
            soon, at_most = self._rubbing(self._equations(own, *then), self._watched(own, *then), i)
            sticks[undecided] = np.abs(soon) < (1.0 - 2.0 * LIMIT_ROUNDED) * at_most
            force[undecided] = soon
        p[:, stuck] = sticks
        onset = np.where(force != 0.0, -np.sign(force), np.sign(pulled))
        p[:, sense] = np.where(sticks, 0.0, onset)
        self._bring_to_rest(y, here, i, sticks)
        return plain & np.isfinite(force)

    def _rubbing(self, here: _Equations, watched: _Watched, i: int) -> tuple[np.ndarray, np.ndarray]:
        """The force that holds a sliding motion, as far as friction can, and how large that can be."""
        most = np.maximum(watched.static[:, i - self.n_stops], 0.0)
        with np.errstate(all="ignore"):
            return np.clip(-here.free[:, i] / here.compliance[:, i], -most, most), most

    def _later(
        self, here: _Equations, t: np.ndarray, y: np.ndarray, i: int, force: np.ndarray, which: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Times and states a moment later, on the way that a force leads, as `Holding._later`."""
        nq, y, t = self._system.nq, y[which], t[which]
        free = np.abs(here.rates[which]).max(axis=1, keepdims=True)
        change = here.rates[which] + here.responses[which, i] * force[which, None]
        change = np.where(np.abs(change) > ROUNDED * free, change, 0.0)
        v = y[:, nq:]
        moving = np.where(np.abs(v) > self._atol + ROUNDED, np.abs(v), 0.0)
        speeds = np.maximum(moving, np.abs(change))
        of_rates = self._positions.per_rate(np.abs(y[:, :nq]), 1.0)
        sizes = np.maximum(np.maximum(1.0, of_rates), np.abs(v))
        reached = (here.rows[which, i] != 0.0) | (here.responses[which, i] != 0.0)
        own = [np.where(reached, values, 0.0).max(axis=1, keepdims=True) for values in (sizes, speeds)]
        with np.errstate(all="ignore"):
            times = np.where(reached, own[0] / own[1], sizes / speeds)
        times = np.where(np.isfinite(times), times, np.inf).min(axis=1)
        ahead = AHEAD * np.where(np.isfinite(times), times, 1.0)
        moved = np.concatenate([y[:, :nq] + ahead[:, None] * v, v + ahead[:, None] * change], axis=1)
        return t + ahead, moved

    def _push(self, y: np.ndarray, here: _Equations, i: int, impulse: np.ndarray) -> None:
        y[:, self._system.nq :] += here.responses[:, i] * impulse[:, None]

    def _bring_to_rest(self, y: np.ndarray, here: _Equations, i: int, which: np.ndarray) -> None:
        """Take what is left of the speed of what is held, at the least kinetic energy."""
        with np.errstate(all="ignore"):
            impulse = np.where(which, -here.speeds[:, i] / here.compliance[:, i], 0.0)
        self._push(y, here, i, impulse)

    def _led(self, here: _Equations, i: int) -> np.ndarray:
        return ~(here.compliance[:, i] > _LED * here.alone[:, i])

    def _evaluate(self, name: str, p: np.ndarray, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        """A function of the model; of its closed form the rows of stops and frictions, all of them switched on."""
        if name in _OF_CLOSED:
            p = p.copy()
            p[:, self._on] = 1.0
        values = self._functions[name](p, t[:, None], y[:, None])[:, 0]
        if name == "constraint_residual":
            values = values[:, self._closed.nh :]
        if name == "constraint_jacobian":
            values = values.reshape(len(p), self._closed.m, self._system.nv)
        return values[:, self._rows] if name in _OF_CLOSED else values

    def _kinematics(self, p: np.ndarray, t: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self._evaluate("constraint_jacobian", p, t, y), self._evaluate("constraint_residual", p, t, y)

    def _equations(self, p: np.ndarray, t: np.ndarray, y: np.ndarray) -> _Equations:
        k, nv = len(p), self._system.nv
        rows, speeds = self._kinematics(p, t, y)
        mass = self._evaluate("mass_matrix", p, t, y).reshape(k, nv, nv)
        inertia = np.diagonal(mass, axis1=1, axis2=2)
        with np.errstate(all="ignore"):
            lower = _cholesky(mass)
            responses = np.stack([_solved(lower, rows[:, i]) for i in range(self.n)], axis=1)
            compliance = np.stack([_product(rows[:, i], responses[:, i]) for i in range(self.n)], axis=1)
            per_inertia = np.where(inertia > 0.0, 1.0 / inertia, 0.0)
            alone = np.stack([_product(rows[:, i] ** 2, per_inertia) for i in range(self.n)], axis=1)
        gamma = self._evaluate("gamma", p, t, y)
        here = _Equations(rows, responses, speeds, gamma, compliance, alone, gamma, gamma, lower)
        return self._with_forces(here, p, t, y)

    def _with_forces(self, here: _Equations, p: np.ndarray, t: np.ndarray, y: np.ndarray) -> _Equations:
        """The same with the forces of other senses of sliding, or at other rates."""
        with np.errstate(all="ignore"):
            rates = _solved(here.lower, self._evaluate("forces", p, t, y))
            free = np.stack([_product(here.rows[:, i], rates) for i in range(self.n)], axis=1) - here.gamma
        return replace(here, rates=rates, free=free)

    def _watched(self, p: np.ndarray, t: np.ndarray, y: np.ndarray) -> _Watched:
        values = self._evaluate("switches", p, t, y)
        frictions = values[:, 2 * self.n_stops :]
        return _Watched(
            values[:, : 2 * self.n_stops : 2], values[:, 1 : 2 * self.n_stops : 2], frictions[:, 1::3],
            frictions[:, 2::3],
        )  # fmt: skip

    def _gap_tolerances(self, rows: np.ndarray, y: np.ndarray) -> np.ndarray:
        """As `Instant._gap_tolerances`."""
        rows = rows[:, : self.n_stops]
        size, sums = self.coordinates_of(rows, y), _row_sums(rows)
        allowed = sums * (self._atol + self._rtol * size)
        return np.maximum(allowed, _SURELY_SEEN * np.finfo(float).eps * sums * size)

    def coordinates_of(self, rows: np.ndarray, y: np.ndarray) -> np.ndarray:
        """As `LocalDynamics.sizes`, shape (k, number of rows)."""
        of_rates = self._positions.per_rate(np.abs(y[:, : self._system.nq]), 1.0)
        return np.where(rows != 0.0, of_rates[:, None], 0.0).max(axis=2, initial=1.0)

    def _slow(self, rows: np.ndarray, y: np.ndarray) -> np.ndarray:
        """As `Instant._speed_tolerances`."""
        v, sizes = np.abs(y[:, self._system.nq :]), np.abs(rows)
        moved = np.stack([_product(sizes[:, i], v) for i in range(self.n)], axis=1)
        return _row_sums(rows) * (self._atol + 1e-15) + max(self._rtol, 1e-15) * moved


def _sound(here: _Equations, y: np.ndarray) -> np.ndarray:
    parts = (here.free, here.compliance, here.speeds, here.rates, y)
    return np.logical_and.reduce([np.isfinite(part).all(axis=1) for part in parts])


def _pressing(here: _Equations, i: int) -> tuple[np.ndarray, np.ndarray]:
    """The force that keeps a gap shut, never below zero, and the acceleration that it takes away."""
    with np.errstate(all="ignore"):
        force = np.maximum(-here.free[:, i] / here.compliance[:, i], 0.0)
    return force, here.compliance[:, i] * force


# Sums over columns, one after another: a member's do not depend on how many members there are.


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    total = a[:, 0] * b[:, 0]
    for j in range(1, a.shape[1]):
        total = total + a[:, j] * b[:, j]
    return total


def _row_sums(rows: np.ndarray) -> np.ndarray:
    total = np.abs(rows[:, :, 0])
    for j in range(1, rows.shape[2]):
        total = total + np.abs(rows[:, :, j])
    return total


def _cholesky(mass: np.ndarray) -> np.ndarray:
    """Return L of M = L Lᵀ, shape (k, n, n); not a number where M is not positive definite."""
    lower, n = np.tril(mass), mass.shape[1]
    for j in range(n):
        for k in range(j):
            lower[:, j:, j] -= lower[:, j:, k] * lower[:, j, k, None]
        lower[:, j, j] = np.sqrt(lower[:, j, j])
        lower[:, j + 1 :, j] /= lower[:, j, j, None]
    return lower


def _solved(lower: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return x of L Lᵀ x = right, shape (k, n)."""
    x, n = right.copy(), right.shape[1]
    for i in range(n):
        for k in range(i):
            x[:, i] -= lower[:, i, k] * x[:, k]
        x[:, i] /= lower[:, i, i]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[:, i] -= lower[:, k, i] * x[:, k]
        x[:, i] /= lower[:, i, i]
    return x
