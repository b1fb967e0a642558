"""Symbols of technical drawings as lines: springs, dashpots, supports with hatching, centre lines.

Each function returns lines as a list of arrays of points, shape (k, 3). Springs, dashpots and rails reach from 0 to 1
along z, and are stretched to where they are; their widths are in metres.
"""

from __future__ import annotations

import numpy as np

Lines = list[np.ndarray]

_TURNS, _PER_TURN = 7, 20  # of a spring; points of each turn
_STRAIGHT = 0.1  # of a spring's length at either end
_ROUND = 24  # corners of a circle
_HATCHES = 6
SUPPORT_HALF = 0.55  # half the width of a support, of its size
_DASH = (0.16, 0.03, 0.02, 0.03)  # of a centre line: dash, gap, dot, gap; of its length


def frames_along(directions: np.ndarray) -> np.ndarray:
    """Return rotations whose third axis is along the directions, and whose first points to their right in the plane.

    Parameters
    ----------
    directions : ndarray, shape (n, 3)
        Of any length; z stands for those that are too short to have a direction.

    Returns
    -------
    ndarray, shape (n, 3, 3)
    """
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    third = np.where(length > 0.0, directions / np.where(length > 0.0, length, 1.0), [0.0, 0.0, 1.0])
    upright = np.abs(third[:, 2:]) > 0.999
    first = np.cross(third, np.where(upright, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(third, first), third], axis=2)


def coil(radius: float) -> Lines:
    """Return a helical spring."""
    turn = np.linspace(0.0, 1.0, _TURNS * _PER_TURN + 1)
    swell = (
        np.clip(np.minimum(turn, 1.0 - turn) * _TURNS, 0.0, 0.25) * 4.0 * radius
    )  # towards the ends to its axis
    angle = 2.0 * np.pi * _TURNS * turn
    height = _STRAIGHT + (1.0 - 2.0 * _STRAIGHT) * turn
    helix = np.stack([swell * np.cos(angle), swell * np.sin(angle), height], axis=1)
    return [np.vstack([[0.0, 0.0, 0.0], helix, [0.0, 0.0, 1.0]])]


def dashpot(radius: float) -> Lines:
    """Return a damper: a piston in a cylinder that is open on one side."""
    cup, piston, bottom = 0.35, 0.52, 0.7
    plate, quarters = 0.75 * radius, _circle()[:: _ROUND // 4]
    sides = [np.array([[radius * x, radius * y, cup], [radius * x, radius * y, bottom]]) for x, y in quarters]
    cross = [
        np.array([[-plate * x, -plate * y, piston], [plate * x, plate * y, piston]]) for x, y in quarters[:2]
    ]
    return [
        np.array([[0.0, 0.0, 0.0], [0.0, 0.0, piston]]),
        _ring(plate, piston),
        *cross,
        _ring(radius, cup),
        _ring(radius, bottom),
        *sides,
        np.array([[0.0, 0.0, bottom], [0.0, 0.0, 1.0]]),
    ]


def rail(depth: float, spacing: float) -> Lines:
    """Return a line with hatching on its right-hand side.

    Parameters
    ----------
    depth : float [m]
        Of the hatching.
    spacing : float
        Of its lines, of the rail's length.
    """
    n = int(np.clip(1.0 / spacing, 3, 60))
    feet = (np.arange(n) + 0.5) / n
    hatches = [np.array([[0.0, 0.0, z], [depth, 0.0, z - 0.6 / n]]) for z in feet]
    return [np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), *hatches]


def support(place: np.ndarray, size: float, planar: bool, above: bool, depth: float | None = None) -> Lines:
    """Return the support of a joint on the ground.

    Parameters
    ----------
    place : ndarray, shape (3,) [m]
        Of the joint.
    size : float [m]
    planar : bool
        A triangle on a hatched line in the x-y plane; else a pyramid on a hatched square, with z up.
    above : bool
        The ground is above the joint: a ceiling.
    depth : float, optional [m]
        How far below the joint the ground is, if that is known.
    """
    side = -1.0 if above else 1.0
    base, half = -(depth or 0.8 * size), SUPPORT_HALF * size
    if planar:
        hatches = np.linspace(-1.0, 1.0, _HATCHES)
        lines = [np.array([[-half, base], [0.0, 0.0], [half, base]])]
        lines.append(np.array([[-1.4 * half, base], [1.4 * half, base]]))
        lines += [np.array([[x, base], [x - 0.3 * size, base - 0.3 * size]]) for x in 1.3 * half * hatches]
        flat = [np.column_stack([line, np.zeros(len(line))]) for line in lines]
        return [place + line * [1.0, side, 1.0] for line in flat]
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * half
    lines = [np.column_stack([corners, np.full(5, base)])]
    lines += [np.array([[0.0, 0.0, 0.0], [x, y, base]]) for x, y in corners[:4]]
    for offset in np.linspace(-1.5, 1.5, _HATCHES + 1):  # parallel to a diagonal, cut at the square
        low, high = max(-1.0, offset - 1.0), min(1.0, offset + 1.0)
        ends = np.array([[low, offset - low], [high, offset - high]]) * half
        lines.append(np.column_stack([ends, np.full(2, base)]))
    return [place + line * [1.0, 1.0, side] for line in lines]


def gear(radius: float, module: float) -> Lines:
    """Return a toothed wheel about the z axis: its outline, and a line from its hub to show how it turns.

    Parameters
    ----------
    radius : float [m]
        Of the pitch circle.
    module : float [m]
        Teeth are 2 modules deep, and one stands on every pi modules of the pitch circle.
    """
    n_teeth = max(round(2.0 * radius / module), 6)
    angle = 2.0 * np.pi / n_teeth * (np.arange(n_teeth)[:, None] + [-0.27, -0.13, 0.13, 0.27]).ravel()
    reach = np.tile(radius + module * np.array([-1.0, 0.9, 0.9, -1.0]), n_teeth)
    outline = np.column_stack([reach * np.cos(angle), reach * np.sin(angle), 0.0 * angle])
    spoke = np.array([[0.25 * radius, 0.0, 0.0], [0.8 * radius, 0.0, 0.0]])
    return [np.vstack([outline, outline[:1]]), _ring(0.25 * radius, 0.0), spoke]


def centre_line(a: np.ndarray, b: np.ndarray) -> Lines:
    """Return the dash-dotted line between two places, as axes are drawn."""
    marks, at = [], 0.0
    while at < 1.0:
        dash, gap, dot, next_gap = _DASH
        for start, length in ((at, dash), (at + dash + gap, dot)):
            if start < 1.0:
                marks.append((start, min(start + length, 1.0)))
        at += dash + gap + dot + next_gap
    return [np.stack([a + start * (b - a), a + end * (b - a)]) for start, end in marks]


def _circle() -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, _ROUND, endpoint=False)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _ring(radius: float, height: float) -> np.ndarray:
    ring = radius * np.vstack([_circle(), _circle()[:1]])
    return np.column_stack([ring, np.full(len(ring), height)])
