"""In which directions frictions in planes begin to slide, where no way of sharing a load is left to them.

Just there forces are in balance, and each is opposite to the velocity of its place: of all motions that what is held
allows, it is the one on which friction takes least for what the load gives, Σ L_k |u_k| for a load that gives 1 (the
upper bound of limit analysis; Drucker, Coulomb friction, plasticity, and limit loads, J. Appl. Mech. 21 (1954)). The
forces show it to the root of what is left to the limit only, the motion to round-off.
"""

from __future__ import annotations

import numpy as np

_DEPENDENT = 1e-10  # of the largest compliance: no motion
_NEWTON_STEPS = 60
_SOLVED = 1e-14  # of the friction: what a step would still gain
_PARTS = 0.5 ** np.arange(30)  # of a step
_AT_REST = 1e-6  # of the fastest: a place about which others turn has no direction


def onset_directions(
    compliance: np.ndarray, free: np.ndarray, held: np.ndarray, pairs: np.ndarray, levels: np.ndarray
) -> np.ndarray | None:
    """Return the unit vectors along which frictions begin to slide, shape (k, 2); None where nothing is that near.

    What takes no part of the load and is held by others has none: (0, 0).

    Parameters
    ----------
    compliance : ndarray, shape (n, n)
        Of the rows of stops and frictions.
    free : ndarray, shape (n,)
        Their accelerations without forces of these.
    held : ndarray of bool, shape (n,)
        Rows that do not move, independent of each other.
    pairs : ndarray of int, shape (k, 2)
        The rows of each friction that slides.
    levels : ndarray, shape (k,) [N]
        The largest force of each.
    """
    rows = pairs.ravel()
    own, pulled = compliance[np.ix_(rows, rows)], free[rows]
    if held.any():
        cross = compliance[np.ix_(held, rows)]
        through = np.linalg.solve(compliance[np.ix_(held, held)], cross)
        own, pulled = own - cross.T @ through, pulled - through.T @ free[held]
    values, ways = np.linalg.eigh(own)
    moves = values > _DEPENDENT * compliance.diagonal()[rows].max()
    ways = ways[:, moves]
    gain = ways.T @ pulled / values[moves]  # what the load gives to each of these motions
    start = ways.T @ pulled
    if not gain @ start > 0.0:
        return None
    motion = _cheapest(ways.reshape(len(pairs), 2, -1), levels, gain, start / (gain @ start))
    speeds = np.einsum("kri,i->kr", ways.reshape(len(pairs), 2, -1), motion)
    sizes = np.linalg.norm(speeds, axis=1)
    at_rest = ~(sizes > _AT_REST * sizes.max())
    if (at_rest & (levels > 0.0)).any():
        return None
    return np.where(at_rest[:, None], 0.0, speeds / np.where(at_rest, 1.0, sizes)[:, None])


def _cheapest(ways: np.ndarray, levels: np.ndarray, gain: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return the motion with the least Σ L |u| among those whose gain is that of a first one: by Newton's method."""
    others = np.linalg.svd(gain[None])[2][1:].T

    def lost(motion: np.ndarray) -> float:
        return float(levels @ np.linalg.norm(ways @ motion, axis=1))

    for _ in range(_NEWTON_STEPS):
        speeds = ways @ motion
        sizes = np.maximum(np.linalg.norm(speeds, axis=1), 1e-300)
        units = speeds / sizes[:, None]
        along = np.einsum("kri,kr->ki", ways, units)
        slope = others.T @ (levels @ along)
        bends = np.einsum("k,kri,krj->ij", levels / sizes, ways, ways) - (along.T * levels / sizes) @ along
        step = -np.linalg.lstsq(others.T @ bends @ others, slope, rcond=None)[0]
        here = lost(motion)
        if not -slope @ step > _SOLVED * here:
            break
        for part in _PARTS:
            if lost(motion + part * (others @ step)) < here + 0.1 * part * (slope @ step):
                break
        else:
            break
        motion = motion + part * (others @ step)
    return motion
