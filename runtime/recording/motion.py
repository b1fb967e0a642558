"""Do recorded states solve the equations of motion? Integrate between frames again, with SciPy."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp

from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.constraints.kkt import robust_rhs_address
from symgen.runtime.timing.timetable import step_limits_of

from .quantities import Quantities
from .recording import Recording

if TYPE_CHECKING:
    from symgen.runtime.timing.step_limits import StepLimits

_MOST_EVALUATIONS = 20_000  # of the right-hand side for one interval and method
_LIMIT = 1e3  # differences in units of the run's tolerance: several steps, and interpolation between them
_FIXED_STEP_TOLERANCE = 1e-6  # a method without error control has no tolerance to be held to
_NUDGE = 10.0  # tolerances by which a start is moved, to see how errors grow
_SMALL = 1e-3  # of the largest quantity of its kind: a component that stays below has no scale of its own


@dataclass(frozen=True)
class Reintegration:
    """Differences between recorded and recomputed states.

    Attributes
    ----------
    value, limit : float
        Largest difference, and what it must not exceed, in `unit`.
    unit : str
    times : list of float [s]
        Beginnings of the intervals.
    worst_time : float [s]
    methods : list of str
    skipped : str
        What could not be checked, and why; empty if all could.
    """

    value: float
    limit: float
    unit: str
    times: list[float]
    worst_time: float
    methods: list[str]
    skipped: str


class _TooManyEvaluations(Exception):
    pass


def reintegrate(of: Quantities, recording: Recording, intervals: int, seed: int) -> Reintegration:
    """Integrate some intervals between neighbouring frames, from the recorded state to the recorded state.

    Parameters
    ----------
    of : Quantities
    recording : Recording
    intervals : int
        How many; ones that touch an event are never taken.
    seed : int
    """
    fixed = "step" in recording.options and recording.options["step"] is not None
    rtol = _FIXED_STEP_TOLERANCE if fixed else max(recording.rtol, 1e-13)
    atol = _FIXED_STEP_TOLERANCE * 1e-2 if fixed else max(recording.atol, 1e-16)
    t, y = recording.t, recording.states
    tolerance = atol + rtol * _scales(of, y)
    free = _intervals_without_events(recording)
    random = np.random.default_rng(seed)
    chosen = np.sort(random.choice(free, min(intervals, len(free)), replace=False))
    nudge = _NUDGE * random.choice([-1.0, 1.0], y.shape[1])
    step_limits = step_limits_of(of.system, of.p, float(t[0]), float(t[-1]))
    differences, times, methods, skipped = [], [], [], []
    for i in chosen.astype(int):
        form = of.in_form(recording.settings[i])
        end, method = _integrate(form, step_limits, t[i], t[i + 1], y[i], 1e-2 * tolerance)
        nudged, _ = _integrate(form, step_limits, t[i], t[i + 1], y[i] + nudge * tolerance, 1e-2 * tolerance)
        if end is None or nudged is None:
            skipped.append(f"{t[i]:.9g} s")
            continue
        # Errors of the run's first steps grow by as much as the motion lets them.
        growth = max(1.0, float((np.abs(nudged - end) / tolerance).max()) / _NUDGE)
        differences.append(float((np.abs(end - y[i + 1]) / tolerance).max()) / growth)
        times.append(float(t[i]))
        methods.append(method)
    worst = int(np.argmax(differences)) if differences else 0
    return Reintegration(
        value=max(differences, default=0.0),
        limit=_LIMIT,
        unit="in units of 1e-6 of the motion" if fixed else "in units of the tolerance",
        times=times,
        worst_time=times[worst] if times else 0.0,
        methods=sorted(set(methods)),
        skipped=f"too stiff to be integrated again here: from t = {', '.join(skipped)}" if skipped else "",
    )


def _intervals_without_events(recording: Recording) -> np.ndarray:
    t = recording.t
    free = (np.diff(t) > 0.0) & (recording.settings[1:] == recording.settings[:-1]).all(axis=1)
    for event in recording.events:
        free &= ~((t[:-1] <= event.t) & (event.t <= t[1:]))
        if 0 < event.frame < len(t):
            free[event.frame - 1] = False
    return np.flatnonzero(free)


def _scales(of: Quantities, y: np.ndarray) -> np.ndarray:
    """Return the size of each component over the run, shape (ny,)."""
    n = of.system.nq + of.system.nv
    largest = np.abs(y).max(axis=0)
    for part in (slice(0, of.system.nq), slice(of.system.nq, n), slice(n, None)):
        largest[part] = np.maximum(largest[part], _SMALL * largest[part].max(initial=0.0))
    return largest


def _integrate(
    of: Quantities, step_limits: StepLimits | None, t0: float, t1: float, y0: np.ndarray, atol: np.ndarray
) -> tuple[np.ndarray | None, str]:
    for method in ("DOP853", "Radau"):
        y, times = y0, [t0, *of.system.input_breaks(t0, t1), t1]
        try:
            for start, end in pairwise(times):
                for piece in (
                    [(start, end, np.inf)] if step_limits is None else step_limits.pieces(start, end)
                ):
                    y = _integrate_smooth(of, *piece, y, method, atol)
        except _TooManyEvaluations:
            continue
        if y is not None:
            return y, method
    return None, ""


def _integrate_smooth(
    of: Quantities, t0: float, t1: float, longest: float, y0: np.ndarray | None, method: str, atol: np.ndarray
) -> np.ndarray | None:
    """Integrate by steps of at most `longest` [s] between breaks; None where that fails, or has failed before."""
    if y0 is None:
        return None
    solution = solve_ivp(
        _Derivative(of, t0, t1),
        (t0, t1),
        y0,
        method=method,
        rtol=1e-13 if method == "DOP853" else 1e-11,
        atol=atol,
        max_step=longest,
    )
    return solution.y[:, -1] if solution.success else None


class _Derivative:
    """d/dt of the state (q, v, w); counts its calls and gives up in time."""

    def __init__(self, of: Quantities, t0: float, t1: float):
        system = of.system
        # As in the run: dependent constraints are no obstacle.
        self._address, self._keep = robust_rhs_address(system)
        self._p, self._ny, self._row = (
            system.precomputed_between(of.p, t0, t1),
            system.ny,
            np.zeros(system.n_row),
        )
        self._calls = 0

    def __call__(self, t: float, y: np.ndarray) -> np.ndarray:
        self._calls += 1
        if self._calls > _MOST_EVALUATIONS:
            raise _TooManyEvaluations
        call_kernel(self._address, t, np.ascontiguousarray(y), self._p, self._row)
        return self._row[: self._ny].copy()
