"""What a motion exchanges, the scale of its energy balance: kinetic energy, and the change of the potential one.

The zero of V is a matter of taste: a pendulum does not become more accurate where its height is measured from far away,
so |V| is no scale. All that it says is how many digits of the balance round-off leaves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.sampling import sample_rows

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.loop_arrays import LoopArrays
    from symgen.runtime.system import System

# Of the largest energy: the terms of V are rounded, and so are the states that it is evaluated at.
ROUND_OFF = 64.0 * np.finfo(float).eps
# [J]: 1e-30 m/s of a kilogram, which round-off leaves of what stops and frictions hold; nothing else is held, and
# however small its motion is, it is one.
_AT_REST = 1e-60
_ERROR_PER_RTOL, _LEAST_ERROR, _LARGEST_ERROR = 1e5, 1e-6, 2e-2
_ERROR_OF_FIXED_STEPS, _ERROR_OF_ORDER_1 = 2e-2, 5e-2  # about twice the error of an amplitude
_LOOKED_AT = 200  # frames that tell the exchange of a run on its way


class Exchange:
    """The largest |T|, the range of V, and the size of all energies over the states that were shown to it.

    Parameters
    ----------
    energies : ndarray, shape (n, 2), optional [J]
        T and V.
    work : ndarray, shape (n,), optional [J]
    holds : bool
        Whether the model has stops or frictions, which hold what round-off moves.
    """

    def __init__(
        self, energies: np.ndarray | None = None, work: np.ndarray | None = None, *, holds: bool = False
    ):
        self._at_rest = _AT_REST if holds else 0.0
        self._kinetic, self._least, self._most, self._largest = 0.0, np.inf, -np.inf, 0.0
        if energies is not None:
            self.take(energies, work)

    def take(self, energies: np.ndarray, work: np.ndarray | None = None) -> Exchange:
        """Take more states; returns itself."""
        if len(energies):
            kinetic, potential = _ends(energies[:, 0]), _ends(energies[:, 1])
            self._kinetic = max(self._kinetic, -kinetic[0], kinetic[1])
            self._least = min(self._least, potential[0])
            self._most = max(self._most, potential[1])
            self._largest = max(self._largest, self._kinetic, -self._least, self._most)
        if work is not None and len(work):
            least, most = _ends(work)
            self._largest = max(self._largest, -least, most)
        return self

    @property
    def size(self) -> float:
        """The largest |T| or the range of V, whichever is larger [J]."""
        return max(self._kinetic, self._most - self._least) if self._least <= self._most else self._kinetic

    def relative(self, deviation: np.ndarray | float) -> np.ndarray | float:
        """Return deviations of energies [J] in parts of the exchange.

        What round-off of energies much larger than the exchange explains counts in parts of those. Where nothing
        moves, as where friction holds a body, there are no parts: deviations count as they are [J].
        """
        size, off = self.size, np.abs(deviation)
        size = size if size > self._at_rest else 0.0
        if not self._largest > 0.0:
            return off
        rounded = np.minimum(off, ROUND_OFF * self._largest)
        parts = rounded / max(size, self._largest)
        return parts + ((off - rounded) / size if size > 0.0 else off - rounded)


def energy_limit(method: Method, rtol: float) -> float:
    """Return the largest energy error that a run may have, in parts of what the motion exchanges."""
    if method.adaptive:
        return min(_LARGEST_ERROR, max(_LEAST_ERROR, _ERROR_PER_RTOL * rtol))
    return _ERROR_OF_ORDER_1 if method.order == 1 else _ERROR_OF_FIXED_STEPS


def largest_leak(balance: np.ndarray, work: np.ndarray, size: float) -> float:
    """Return the largest change of an energy balance between two times, in parts of what passed in between.

    A driven and damped motion exchanges little and lets much pass through: what its balance is off by grows with that
    work, and no error of the motion does. A change that comes at once still counts in parts of the exchange.

    Parameters
    ----------
    balance, work : ndarray, shape (n,) [J]
        T + V - work, and the work, over time.
    size : float [J]
        What the motion exchanges.
    """
    rows = sample_rows(len(balance), _LOOKED_AT)
    off, passed = balance[rows], np.append(0.0, np.cumsum(np.abs(np.diff(work))))[rows]
    parts = np.abs(off[:, None] - off) / (size + np.abs(passed[:, None] - passed))
    return float(parts.max(initial=0.0))


def _ends(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def energy_error_so_far(
    system: System, arrays: LoopArrays, n_frames: int, t: float, y: np.ndarray, resets: float
) -> float:
    """Return the error of T + V - work that a run has at a state, in parts of what it exchanged on the way there.

    Parameters
    ----------
    system : System
    arrays : LoopArrays
        Of the run: its frames are read.
    n_frames : int
        Frames that it has passed.
    t, y : float, ndarray
        The state.
    resets : float [J]
        What resets of events have added to T + V.
    """
    n = system.nq + system.nv
    rows = sample_rows(n_frames, _LOOKED_AT)
    times, states = np.append(arrays.frame_times[rows], t), np.vstack([arrays.frames[rows], y])
    energies = evaluate(system, "energy", arrays.p, times, states)
    work = states[:, n:].sum(axis=1)
    balance = energies.sum(axis=1) - work
    exchange = Exchange(energies, work, holds=bool(system.switches))
    return float(exchange.relative(balance[-1] - resets - balance[0]))
