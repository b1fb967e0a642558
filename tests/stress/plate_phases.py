"""A block on a shaking plate, integrated phase by phase by SciPy: sticking, and sliding in polar coordinates.

While it slides with speed r in the direction φ, r' = F·d - μ N and φ' = F·d⊥ / r, with the acceleration F that the
plate gives it and d = (cos φ, sin φ). Near rest φ' is stiff, and φ is that of F where sliding begins.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

_AT_REST = 1e-11  # [m/s]
_LOOKS = 4000  # for the end of sticking


@dataclass
class Plate:
    """What moves the block, and how it is held.

    Attributes
    ----------
    pull : callable
        F(t), shape (2,) [m/s²].
    normal : callable
        N(t) [m/s²], of a unit mass.
    sliding, sticking : float
        The coefficients.
    """

    pull: Callable[[float], np.ndarray]
    normal: Callable[[float], float]
    sliding: float
    sticking: float


@dataclass
class Course:
    """What happens: events, the end, and how far from another course it was.

    Attributes
    ----------
    events : list of (str, float)
    place, velocity : ndarray, shape (2,)
    extent : float [m]
        How far from the start the block came.
    margin : float
        Of the friction: by how much a decision between sticking and sliding was taken.
    """

    events: list[tuple[str, float]] = field(default_factory=list)
    place: np.ndarray = field(default_factory=lambda: np.zeros(2))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(2))
    extent: float = 0.0
    margin: float = np.inf


def course(plate: Plate, t_end: float, velocity: tuple[float, float] = (0.0, 0.0)) -> Course:
    """Follow the block from the middle of the plate."""
    found, t = Course(velocity=np.array(velocity, dtype=float)), 0.0
    sticks = not np.any(found.velocity) and _slack(plate, 0.0) > 0.0
    begins = True
    while t < t_end:
        if sticks:
            t = _let_go(plate, t, t_end, found, begins)
            if t >= t_end:
                found.velocity = np.zeros(2)
                return found
            found.events.append(("slip", t))
            found.velocity = np.zeros(2)
        begins = False
        t, stopped = _slide(plate, t, t_end, found)
        if stopped:
            slack = _slack(plate, t)
            found.margin = min(found.margin, abs(slack))
            sticks = slack >= 0.0
            found.events.append(("stick" if sticks else "turn", t))
            found.velocity = np.zeros(2)
    return found


def _slack(plate: Plate, t: float) -> float:
    """What is left of the friction that can hold the block, in parts of it."""
    most = plate.sticking * plate.normal(t)
    return 1.0 - float(np.hypot(*plate.pull(t))) / most


def _let_go(plate: Plate, t: float, t_end: float, found: Course, begins: bool) -> float:
    """Return when it does not hold any more; `t_end` if it does."""
    times = np.linspace(t, t_end, _LOOKS)
    slack = np.array([_slack(plate, x) for x in times])
    over = np.flatnonzero(slack < 0.0)
    last = over[0] if len(over) else len(times)
    if last > 2:
        dips = slack[2:last]
        turning = np.flatnonzero((dips[1:-1] < dips[:-2]) & (dips[1:-1] < dips[2:]))
        found.margin = min([found.margin, *dips[1:-1][turning]])
    if not len(over):
        return t_end
    return t if last == 0 else brentq(lambda x: _slack(plate, x), times[last - 1], times[last], xtol=1e-15)


def _slide(plate: Plate, t: float, t_end: float, found: Course) -> tuple[float, bool]:
    """Slide until it comes to rest, or to the end; returns when that is, and whether it came to rest."""
    size = float(np.hypot(*found.velocity))
    way = found.velocity if size > 0.0 else plate.pull(t)

    def motion(t, y):
        r, c, s = y[0], np.cos(y[1]), np.sin(y[1])
        fx, fy = plate.pull(t)
        return [fx * c + fy * s - plate.sliding * plate.normal(t), (fy * c - fx * s) / r, r * c, r * s]

    def at_rest(t, y):
        return y[0] - 0.9 * _AT_REST

    at_rest.terminal, at_rest.direction = True, -1.0
    start = [max(size, _AT_REST), np.arctan2(way[1], way[0]), *found.place]
    path = solve_ivp(
        motion, (t, t_end), start, "Radau", events=at_rest, rtol=1e-10, atol=[1e-13, 1e-10, 1e-13, 1e-13]
    )
    assert path.success, path.message
    r, angle, *place = path.y[:, -1]
    found.place = np.array(place)
    found.extent = max(found.extent, float(np.hypot(*path.y[2:]).max()))
    found.velocity = r * np.array([np.cos(angle), np.sin(angle)])
    return float(path.t[-1]), path.status == 1
