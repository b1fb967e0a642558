"""What the energy that a run has lost or gained by and by makes of its motion: its frequency depends on its energy.

A part of a long run, integrated again, shows how its phase is off there; what the energy will have become by the end
shows in nothing that comes before. But the balance of the whole run is known. A motion that begins with a little more
energy runs ahead of, or behind, the one that does not: by how much two companions tell. What of that adds up over the
run, as its energy drifts, is an estimate of its error that has nothing to do with how errors grow in a part of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate, right_hand_sides
from symgen.runtime.checks.growth import slope
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.checks.entry import HealthCheck
    from symgen.runtime.solution import Solution

_WINDOWS = 8  # of a run: its energy wavers within a period
_MORE, _MORE_KINETIC = (
    1e-4,
    1e-2,
)  # of the exchange, and at most of T, that the motion beside begins with more
_SMALL, _LARGEST = 1e-2, 1e-2  # errors of the motion, and of the balance
_PARTS = 50  # of a run, in none of which the balance may change by more than its limit
_LEAST_DRIFT, _CLEAR = 1e-12, 10.0  # of the exchange, and times what medians of windows are known to
_EARLY = 0.5  # of a part: where a state is taken that moves
_LEAST_FRAMES, _LEAST_TIMES = 3, 32
_NEAR = 0.1  # in parts of what variables do: so far apart a motion is along another one
_LEAST_FITTED, _FITS = 8, 0.2  # frames, and what may be left of a phase error, in parts of it

# From a frame of a part on: times, and motions from the two states that are given, shape (n, nq + nv).
Beside = Callable[[int, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


class EnergyDrift:
    """How the energy of a run drifts.

    Attributes
    ----------
    t : ndarray, shape (n,) [s]
    drift : ndarray, shape (n,) [J]
        By which the energy is more than at the start, without what it wavers by.
    size : float [J]
        What the motion exchanges.
    is_clear : bool
        Whether that stands out of what the energy wavers by, as it does within each period with fixed steps.
    """

    def __init__(self, solution: Solution):
        self._solution, self.t = solution, solution.t
        parts = np.array_split(np.arange(len(self.t)), _WINDOWS)
        middles = [float(np.median(self.t[part])) for part in parts]
        means = np.array([float(np.median(solution.energy.balance[part])) for part in parts])
        # From the middle of the first window to the start, and of the last one to the end, as between these.
        slope = np.diff(means)[[0, -1]] / np.diff(middles)[[0, -1]]
        ends = (
            means[0] - slope[0] * (middles[0] - self.t[0]),
            means[-1] + slope[1] * (self.t[-1] - middles[-1]),
        )
        places = [float(self.t[0]), *middles, float(self.t[-1])]
        wavers = max(float(np.std(solution.energy.balance[part])) / np.sqrt(len(part)) for part in parts)
        self.drift = np.interp(self.t, places, [0.0, *(means - ends[0]), ends[1] - ends[0]])
        self.size, self.is_clear = solution.energy.exchange.size, bool(np.ptp(self.drift) > _CLEAR * wavers)

    def phase_errors(
        self, t: np.ndarray, states: np.ndarray, of_run: np.ndarray, sizes: np.ndarray, beside: Beside
    ) -> Phase | None:
        """Return what errors this makes up to some times; None where nothing tells.

        Parameters
        ----------
        t, states, of_run : ndarray, shape (n,), (n, nq + nv), (n, nq + nv)
            A part of the run from its start, by a companion and by the run.
        sizes : ndarray, shape (nq + nv,)
            What errors are measured by.
        beside : callable
        """
        system, p = self._solution.system, self._solution.p
        too_small = not np.abs(self.drift).max() > _LEAST_DRIFT * self.size
        if len(t) < _LEAST_FRAMES or too_small or not self.is_clear:
            return None
        early = slice(0, max(int(_EARLY * len(t)), 1))
        kinetic = evaluate(system, "energy", p, t[early], states[early])[:, 0]
        begin = int(np.argmax(kinetic))
        more = min(_MORE * self.size, _MORE_KINETIC * kinetic[begin])
        if not more > 0.0:
            return None
        start = states[begin].copy()
        start[system.nq :] *= np.sqrt(1.0 + more / kinetic[begin])
        times, slower, faster = beside(begin, states[begin], start)
        beyond = np.flatnonzero(~(np.abs(faster - slower) <= _NEAR * sizes).all(axis=1))
        near = slice(0, int(beyond[0]) if beyond.size else len(times))
        times, slower, faster = times[near], slower[near], faster[near]
        if len(times) < _LEAST_TIMES:
            return None
        ahead, larger, fastest = self._ahead(times, slower, faster, sizes)
        own, _, _ = self._ahead(t, states, of_run, sizes)
        if not (np.isfinite(ahead).all() and np.isfinite(own).all()):
            return None
        larger = larger / more * np.maximum.accumulate(np.abs(self.drift))
        passed = np.append(0.0, np.cumsum(0.5 * (self.drift[1:] + self.drift[:-1]) * np.diff(self.t)))
        drifted = slope(times, ahead) / more * passed
        rest = own - np.interp(t, self.t, drifted)
        since = t - t[0]
        steady = float(since @ rest / (since @ since))  # what steps make of the phase by themselves
        left = float(np.sqrt(np.mean((rest - steady * since) ** 2)))
        whole = np.maximum.accumulate(np.abs(steady * (self.t - self.t[0]) + drifted)) * fastest
        is_all = len(t) >= _LEAST_FITTED and left <= _FITS * float(np.abs(own).max())
        by_drift = np.maximum.accumulate(np.abs(drifted)) * fastest
        return Phase(self.t, np.maximum(by_drift, larger), np.maximum(whole, larger) if is_all else None)

    def _ahead(
        self, t: np.ndarray, states: np.ndarray, others: np.ndarray, sizes: np.ndarray
    ) -> tuple[np.ndarray, float, float]:
        """Return by what time another motion is ahead [s]; what else it is off by, and the rates [1/s], at most.

        Both in parts of what variables do.
        """
        rates = right_hand_sides(self._solution.system, self._solution.p, t, states)[:, : len(sizes)] / sizes
        off = (others - states) / sizes
        ahead = np.sum(off * rates, axis=1) / np.sum(rates**2, axis=1)
        return ahead, float(np.abs(off - ahead[:, None] * rates).max()), float(np.abs(rates).max())


def judged_with_drift(found: list[HealthCheck], solution: Solution, error: float) -> list[HealthCheck]:
    """Let an energy balance that drifts by and by over many steps be a note, where the motion is right all the same.

    Limits of the balance are for runs of a hundred thousand steps at most; each further step may lose as much again. A
    balance that is off at once stays an objection, and so does one that the motion shows.

    Parameters
    ----------
    found : list of HealthCheck
        `energy` among them.
    error : float
        How far the motion is off, with what the drift makes of it, in parts of what each variable does.
    """
    (energy,) = [entry for entry in found if entry.check == "energy"]
    conservative = (
        solution.system.structure["conservative"] and not solution.system.nw and not solution.events
    )
    if energy.ok or not conservative or error > _SMALL or not energy.value <= _LARGEST:
        return found
    balance = solution.energy.balance
    parts = [
        balance[max(part[0] - 1, 0) : part[-1] + 1]
        for part in np.array_split(np.arange(len(balance)), _PARTS)
    ]
    changes = np.array([float(np.ptp(part)) for part in parts])
    if len(balance) < _PARTS or solution.energy.exchange.relative(changes.max()) > energy.limit:
        return found
    says = (
        f"the energy balance is off by {energy.value:.2g} of what the motion exchanges: it drifts by and by, over "
        f"{solution.stats['steps']} steps, and what that makes of the motion is small (accuracy)"
    )
    passed = replace(energy, ok=True, note=True, says=says)
    return [passed if entry is energy else entry for entry in found]


@record(eq=False)
class Phase:
    """Errors of a run, in parts of what its variables do.

    Attributes
    ----------
    t : ndarray, shape (n,) [s]
    drifted : ndarray, shape (n,)
        Largest one so far that the drift of the energy makes, of the phase or of how far the motion goes.
    whole : ndarray, shape (n,), or None
        The same with what the phase is off by in each step; None where the part is not off by these two alone.
    """

    t: np.ndarray
    drifted: np.ndarray
    whole: np.ndarray | None
