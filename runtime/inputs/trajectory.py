"""Trajectories through way-points: polynomials of degree 5 in time, within limits of speed and acceleration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from symgen.runtime.errors import nearest
from symgen.runtime.inputs.given import InputFault
from symgen.runtime.lazy import Late

interpolate = Late("scipy.interpolate")

_DEGREE = 5


class Trajectory:
    """A path through way-points that starts and ends at rest, without acceleration.

    Between way-points it is a spline of degree 5, whose first four derivatives are continuous (de Boor, A Practical
    Guide to Splines, 1978, ch. XIII), or, where it stops at each of them, 10 s³ - 15 s⁴ + 6 s⁵ of the way. Before its
    first time and after its last one it rests.

    Parameters
    ----------
    points : array_like, shape (n, k), n ≥ 2
        A row for each way-point, a column for each coordinate; of one coordinate also shape (n,).
    times : array_like, shape (n,), optional [s]
        When it is at each of them. Left out: as early as `speed` and `acceleration` allow, by one factor for all times.
    speed, acceleration : float or array_like, shape (k,), optional
        Largest magnitudes of rates and of their derivatives: for all coordinates, or for each.
    names : sequence of str, optional
        Of the coordinates, for `path["elbow"]`.
    stops : bool
        Whether it comes to rest at every way-point. A spline goes beyond way-points where these are uneven.

    Attributes
    ----------
    times : ndarray, shape (n,) [s]
    knots : ndarray, shape (m + 1,) [s]
        Ends of the polynomials.
    coefficients : ndarray, shape (m, 6, k)
        coefficients[i, j] times (t - knots[i])^j.

    Raises
    ------
    InputFault
        Way-points or times are no such thing, or it would be faster than its limits.

    Examples
    --------
    >>> path = Trajectory([0.0, 0.4, 1.0], speed=0.5, acceleration=2.0, names=["x"])
    >>> system.run(t_end=path.times[-1], inputs={"x_wanted": path["x"]}, breaks=path.times)
    """

    def __init__(
        self,
        points: Any,
        times: Any = None,
        *,
        speed: Any = None,
        acceleration: Any = None,
        names: Sequence[str] | None = None,
        stops: bool = False,
    ):
        places = _numbers("way-points", points)
        places = places[:, None] if places.ndim == 1 else places
        if places.ndim != 2 or len(places) < 2 or not places.shape[1]:
            raise InputFault(
                f"way-points have shape {places.shape}: give rows of two or more, with a column for each coordinate"
            )
        n, k = places.shape
        limits = [
            _limit(word, value, k) for word, value in (("speed", speed), ("acceleration", acceleration))
        ]
        if names is not None and (len(names) != k or len(set(names)) != k):
            raise InputFault(f"{len(names)} names for way-points of {k} coordinates: give each its own")
        self.names = tuple(names) if names is not None else ()
        self.times = _durations(places, *limits) if times is None else _numbers("times of way-points", times)
        if self.times.shape != (n,) or not (np.diff(self.times) > 0.0).all():
            raise InputFault(f"times of {n} way-points: give as many, each after the one before it")
        self._through(places, stops)
        factor = self._longer(*limits)
        if times is None:
            self.times, self.knots = self.times * factor, self.knots * factor
            self.coefficients /= factor ** np.arange(_DEGREE + 1.0)[:, None]
        elif factor > 1.0 + 1e-9:
            raise InputFault(
                f"way-points at these times are beyond the limits: times have to be {factor:.6g} times as long, "
                "or leave them out"
            )

    def _through(self, places: np.ndarray, stops: bool) -> None:
        """Find the polynomials."""
        if stops:
            width, way = np.diff(self.times)[:, None], np.diff(places, axis=0)
            self.knots, self.coefficients = self.times, np.zeros((len(way), _DEGREE + 1, way.shape[1]))
            self.coefficients[:, 0] = places[:-1]
            for power, factor in ((3, 10.0), (4, -15.0), (5, 6.0)):
                self.coefficients[:, power] = factor * way / width**power
            return
        rest = [(1, np.zeros(places.shape[1])), (2, np.zeros(places.shape[1]))]
        spline = interpolate.make_interp_spline(self.times, places, k=_DEGREE, bc_type=(rest, rest))
        inside = spline.t[_DEGREE:-_DEGREE]
        self.knots, begins = inside, inside[:-1]
        factorials = np.cumprod([1.0, *range(1, _DEGREE + 1)])
        rows = [spline.derivative(j)(begins) if j else spline(begins) for j in range(_DEGREE + 1)]
        self.coefficients = np.ascontiguousarray(np.stack(rows, axis=1) / factorials[:, None])

    def _longer(self, speed: np.ndarray | None, acceleration: np.ndarray | None) -> float:
        """Return how many times as long it has to take to keep to its limits; below 1 where it may be faster."""
        factors = []
        for derivatives, limit in ((1, speed), (2, acceleration)):
            if limit is not None:
                factors.append((self._largest(derivatives) / limit).max() ** (1.0 / derivatives))
        return max(factors, default=1.0)

    def _largest(self, derivatives: int) -> np.ndarray:
        """Return the largest magnitude of a derivative of each coordinate, shape (k,)."""
        found = np.zeros(self.coefficients.shape[2])
        for rows, width in zip(self.coefficients, np.diff(self.knots)):
            for c, row in enumerate(rows.T):
                rate = np.polynomial.Polynomial(row).deriv(derivatives)
                turns = rate.deriv().roots()
                turns = turns[np.isreal(turns)].real
                inside = [x for x in turns if 0.0 < x < width]
                found[c] = max(found[c], *(abs(rate(x)) for x in (0.0, width, *inside)))
        return found

    def __call__(self, t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return positions, rates and accelerations at a time, each of shape (k,)."""
        inside = min(max(float(t), self.knots[0]), self.knots[-1])
        piece = min(int(np.searchsorted(self.knots, inside, side="right")), len(self.knots) - 1) - 1
        since, rows = inside - self.knots[piece], self.coefficients[piece]
        found = []
        for _ in range(3):
            value = np.zeros(rows.shape[1])
            for row in rows[::-1]:
                value = value * since + row
            found.append(value)
            rows = rows[1:] * np.arange(1.0, len(rows))[:, None]
        if inside != t:
            found[1:] = [np.zeros_like(found[0]), np.zeros_like(found[0])]
        return found[0], found[1], found[2]

    def __getitem__(self, coordinate: str | int) -> Callable[[float], float]:
        """Return one coordinate as a function of time, which can be an input."""
        if isinstance(coordinate, str):
            if coordinate not in self.names:
                raise KeyError(
                    f"no coordinate {coordinate!r} of this path: {nearest(coordinate, self.names)}"
                )
            coordinate = self.names.index(coordinate)
        self.coefficients[0, 0, coordinate]  # one that is not there has no function
        return lambda t: float(self(t)[0][coordinate])


def _numbers(what: str, values: Any) -> np.ndarray:
    try:
        found = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputFault(f"{what} cannot be read as numbers") from None
    if not np.isfinite(found).all():
        raise InputFault(f"{what} must be finite")
    return found


def _limit(what: str, value: Any, k: int) -> np.ndarray | None:
    if value is None:
        return None
    found = _numbers(f"the largest {what}", value)
    if found.shape not in ((), (k,)) or not (found > 0.0).all():
        raise InputFault(f"the largest {what}: give a positive number, or one for each of {k} coordinates")
    return np.broadcast_to(found, (k,))


def _durations(places: np.ndarray, speed: np.ndarray | None, acceleration: np.ndarray | None) -> np.ndarray:
    """Return times in proportion to what each way takes: by its speed, else by speeding up and slowing down."""
    way = np.abs(np.diff(places, axis=0))
    if speed is None and acceleration is None:
        raise InputFault("way-points without times: give times, or the largest speed and acceleration")
    needed = (way / speed if speed is not None else np.sqrt(way / acceleration)).max(axis=1)
    if not (needed > 0.0).all():
        k = int(np.argmin(needed > 0.0))
        raise InputFault(f"way-points {k + 1} and {k + 2} are the same: leave one out, or give times")
    return np.concatenate([[0.0], np.cumsum(needed)])
