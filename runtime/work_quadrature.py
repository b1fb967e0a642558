"""Work integrated once more, along the frames of a run, where the one beside the motion leaves the energy unbalanced.

Steps are as long as the motion allows. One that goes evenly, as a crank that is driven at constant speed, allows any
step, while the power of what drives it changes with the angle: no step size control looks at that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import accelerations_and_multipliers, right_hand_sides

if TYPE_CHECKING:
    from symgen.runtime.system import System

_NODES, _WEIGHTS = (
    np.array([-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526]),
    np.array([0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538]),
)  # of Gauss, order 8
_MOST_PARTS = 64  # of an interval between frames
_SETTLED = 1e-10  # change of the work from one refinement to the next, in parts of its size
_MOST_NUMBERS = 4_000_000
_BETTER = 0.1


def work_that_balances(
    system: System, p: np.ndarray, t: np.ndarray, states: np.ndarray, energies: np.ndarray, work: np.ndarray
) -> np.ndarray | None:
    """Return the work along the frames [J] where the energy is balanced far better with it than with `work`, else None.

    Parameters
    ----------
    t, states : ndarray
        Frames of a run whose state never jumped.
    energies : ndarray, shape (n, 2) [J]
    work : ndarray, shape (n,) [J]
    """
    with np.errstate(over="ignore", invalid="ignore"):
        again = work_by_quadrature(system, p, t, states)
    if again is None:
        return None
    off = [np.abs(np.ptp(energies.sum(axis=1) - done)) for done in (work, again)]
    return again if off[1] < _BETTER * off[0] else None


def work_by_quadrature(system: System, p: np.ndarray, t: np.ndarray, states: np.ndarray) -> np.ndarray | None:
    """Return the work done on the system up to each frame [J], shape (n,); None where that cannot be told.

    Between frames the motion is the polynomial through coordinates, rates and accelerations on both sides.

    Parameters
    ----------
    t : ndarray, shape (n,) [s]
        Of frames without jumps of the state between them.
    states : ndarray, shape (n, nq + nv)
    """
    h = np.diff(t)
    if len(t) < 2 or system.quaternions or not np.all(h > 0.0) or not np.all(np.isfinite(states)):
        return None
    a, _ = accelerations_and_multipliers(system, p, t, states)
    before, parts, power = None, 1, system.nq + system.nv
    while parts <= _MOST_PARTS and parts * len(_NODES) * states.size <= _MOST_NUMBERS:
        places = ((np.arange(parts)[:, None] + 0.5 * (1.0 + _NODES)) / parts).ravel()
        weights = np.tile(_WEIGHTS, parts) / (2.0 * parts)
        done = np.zeros(len(h))
        for place, weight in zip(places, weights, strict=True):
            time, state = _between(system, t, states, a, place)
            done += weight * h * right_hand_sides(system, p, time, state)[:, power]
        work = np.append(0.0, np.cumsum(done))
        size = np.abs(done).sum()
        if before is not None and np.abs(work - before).max() <= _SETTLED * size:
            return work
        before, parts = work, 2 * parts
    return before


def _between(
    system: System, t: np.ndarray, states: np.ndarray, a: np.ndarray, place: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return times and states at one place, from 0 to 1, of all intervals: of order 6 in q, and its derivative in v."""
    nq, s, h = system.nq, place, np.diff(t)[:, None]
    q, v = states[:, :nq], states[:, nq:]
    q0, v0, a0, rise = q[:-1], h * v[:-1], 0.5 * h * h * a[:-1], q[1:] - q[:-1]
    # What is left of q, v and a at the end, by powers 3, 4 and 5 of s.
    left = rise - v0 - a0
    slope = h * v[1:] - v0 - 2.0 * a0
    bend = 0.5 * h * h * a[1:] - a0
    c3, c4, c5 = (
        10.0 * left - 4.0 * slope + bend,
        7.0 * slope - 15.0 * left - 2.0 * bend,
        6.0 * left - 3.0 * slope + bend,
    )
    places = q0 + s * (v0 + s * (a0 + s * (c3 + s * (c4 + s * c5))))
    rates = (v0 + s * (2.0 * a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / h
    return t[:-1] + place * h[:, 0], np.hstack([places, rates])
