"""Whether a run's result can be trusted: energy, constraints, steps, finite numbers, a regular end."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from runtime.checks.stability import stable_radius
from runtime.constraints.drift import constraint_drift
from runtime.failures import state_names
from runtime.integrate.methods import Method, find_method
from runtime.positions import Positions

if TYPE_CHECKING:
    from runtime.checks.time_scales import TimeScales
    from runtime.solution import Solution

_ENERGY_PER_RTOL, _LEAST_ENERGY, _LARGEST_ENERGY = 1e4, 1e-6, 1e-2
_FIXED_STEP_ENERGY = {"low order": 1e-2, "high order": 1e-3}
_DRIFT_PER_RTOL, _LEAST_DRIFT, _LARGEST_DRIFT = 1e2, 1e-8, 1e-4
_FIXED_STEP_DRIFT = 1e-6
_QUATERNION_LENGTH = 1e-12
_MOST_REJECTED = 0.8
_TINY_STEP = 64 * np.finfo(float).eps
_MOST_TINY = 0.05  # part of the steps; events and stop times cut some steps short
_STEPS_PER_PERIOD = 20.0
_STATES_FOR_TIME_SCALES = 5
_LARGEST_FOR_TIME_SCALES = 400  # states; eigenvalues cost their cube
_REGULAR_ENDS = ("success", "terminated")


@dataclass(frozen=True)
class HealthCheck:
    """One check of a run.

    Attributes
    ----------
    check : str
        What was checked.
    ok : bool
        False: the result is not to be trusted.
    value, limit : float
        What was found, and where the limit lies.
    says : str
        One sentence: what this means and, where it is not ok, one thing to do.
    """

    check: str
    ok: bool
    value: float
    limit: float
    says: str

    def to_dict(self) -> dict[str, Any]:
        """Return the check as a dictionary."""
        return asdict(self)


def check(solution: Solution) -> list[HealthCheck]:
    """Check a run.

    Limits:

    * energy: adaptive methods 1e4 rtol, at least 1e-6 and at most 1e-2; methods of fixed step 1e-2 up to
      order 2, 1e-3 above. The error is that of T + V - work, in parts of the largest |T|, |V|.
    * constraints: adaptive methods 100 rtol, at least 1e-8 and at most 1e-4; of fixed step 1e-6; in parts of
      the constraint's change over the coordinates' characteristic sizes, or of its largest velocity term.
    * quaternions: their lengths 1e-12 from 1, as every state is scaled to that.
    * steps: at most 80 % rejected, at most 5 % at the limit of floating-point time.
    * resolution (fixed step): at least 20 steps in the fastest period, and inside the region of stability.
    """
    found = [_status(solution), _finite(solution)]
    if not found[1].ok:
        return found
    method = find_method(solution.method)
    found.append(_energy(solution, method))
    if solution.system.m:
        found += _constraints(solution, method)
    if solution.system.quaternions:
        found.append(_quaternions(solution))
    if method.adaptive:
        found += _steps(solution)
    else:
        found += _resolution(solution, method)
    return found


def _status(solution: Solution) -> HealthCheck:
    ok = solution.status in _REGULAR_ENDS
    says = f"{solution.status} at t = {solution.t[-1]:.9g} s" if ok else solution.message or solution.status
    return HealthCheck("status", ok, float(solution.t[-1]), float(solution.t_end), says)


def _finite(solution: Solution) -> HealthCheck:
    states = np.hstack([solution.q, solution.v])
    bad = np.flatnonzero(~np.isfinite(states).all(axis=1))
    if not bad.size:
        return HealthCheck("finite", True, 0.0, 0.0, "all numbers are finite")
    column = int(np.flatnonzero(~np.isfinite(states[bad[0]]))[0])
    name = state_names(solution.system)[column]
    says = f"{name} is not finite from t = {solution.t[bad[0]]:.9g} s on; take smaller steps"
    return HealthCheck("finite", False, float(bad.size), 0.0, says)


def _limited(name: str, value: float, limit: float, fine: str, objection: str) -> HealthCheck:
    # Written so that NaN is not ok.
    ok = bool(value <= limit)
    return HealthCheck(name, ok, float(value), float(limit), fine if ok else objection)


def energy_limit(method: Method, rtol: float) -> float:
    """Return the largest energy error that a run may have, in parts of the largest |T|, |V|."""
    if method.adaptive:
        return min(_LARGEST_ENERGY, max(_LEAST_ENERGY, _ENERGY_PER_RTOL * rtol))
    return _FIXED_STEP_ENERGY["low order" if method.order <= 2 else "high order"]


def _energy(solution: Solution, method: Method) -> HealthCheck:
    value, limit = solution.energy.max_error, energy_limit(method, solution.rtol)
    found = f"the energy balance is off by {value:.2g} of the largest energy"
    remedy = (
        f"a smaller rtol than {solution.rtol:g}"
        if method.adaptive
        else f"a smaller step than {solution.step:g} s"
    )
    return _limited("energy", value, limit, found, f"{found}, more than {limit:.2g}: try {remedy}")


def _constraints(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    limit = (
        min(_LARGEST_DRIFT, max(_LEAST_DRIFT, _DRIFT_PER_RTOL * solution.rtol))
        if method.adaptive
        else _FIXED_STEP_DRIFT
    )
    for level, drift in constraint_drift(solution).items():
        found = (
            f"constraint {drift.name!r} is off by {drift.relative:.2g} of its scale at t = {drift.t:.6g} s"
        )
        objection = f"{found}, more than {limit:.2g}: use `constraints = projection`, or smaller steps"
        yield _limited(f"constraint {level}", drift.relative, limit, f"at most, {found}", objection)
    if solution.redundant:
        names = ", ".join(solution.redundant)
        says = f"{names}: multipliers are not unique, the minimum-norm ones are given"
        yield HealthCheck("redundant constraints", True, float(len(solution.redundant)), 0.0, says)


def _quaternions(solution: Solution) -> HealthCheck:
    off = np.abs(Positions(solution.system).lengths(solution.q) - 1.0)
    frame, which = np.unravel_index(np.argmax(off), off.shape)
    name = solution.system.coordinates[solution.system.quaternions[which]]["name"]
    value, t = float(off[frame, which]), solution.t[frame]
    found = f"the length of the quaternion of {name} is off 1 by {value:.2g} at t = {t:.6g} s"
    objection = f"{found}: its body is distorted; start from a quaternion of unit length"
    return _limited("quaternions", value, _QUATERNION_LENGTH, f"at most, {found}", objection)


def _steps(solution: Solution) -> Iterator[HealthCheck]:
    taken, rejected = solution.stats["steps"], solution.stats["rejected"]
    ratio = rejected / max(taken + rejected, 1)
    found = f"{rejected} of {taken + rejected} steps were rejected"
    objection = f"{found}: a discontinuity or noise in the forces defeats the error control; make it an event"
    yield _limited("rejected steps", ratio, _MOST_REJECTED, found, objection)
    if not len(solution.step_log):
        return
    t, h = solution.step_log[:, 0], solution.step_log[:, 1]
    tiny = float(np.mean(h <= _TINY_STEP * np.maximum(np.abs(t), solution.t_end - solution.t_start)))
    found = f"steps from {h.min():.3g} to {h.max():.3g} s"
    objection = (
        f"{found}: {tiny:.0%} of them can be told from zero only just; rtol may be too small for this model"
    )
    yield _limited("step size", tiny, _MOST_TINY, found, objection)


def _resolution(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    if solution.system.nq + solution.system.nv > _LARGEST_FOR_TIME_SCALES or solution.step is None:
        return
    scales = _time_scales(solution)
    h = solution.step
    fastest = max((scale.motion if method.stiff else scale.fastest for scale in scales), default=0.0)
    if fastest <= 0.0:
        return
    period = 2.0 * np.pi / fastest
    found = f"{period / h:.3g} steps in the fastest period, which is {period:.3g} s"
    needed = min(_STEPS_PER_PERIOD, 0.7 * method.steps_per_period)
    ok = bool(period / h >= needed)
    objection = f"only {found}: take a step of at most {period / needed:.2g} s"
    yield HealthCheck("resolution", ok, float(period / h), needed, found if ok else objection)
    radius = stable_radius(method)
    if radius is not None:
        found = f"step times fastest rate is {h * fastest:.3g}, stable up to {radius:g}"
        objection = f"{found}: unstable; take a step below {radius / fastest:.2g} s, or an implicit method"
        yield _limited("stability", h * fastest, radius, found, objection)


def _time_scales(solution: Solution) -> list[TimeScales]:
    from runtime.checks.time_scales import time_scales

    rows = np.unique(np.linspace(0, len(solution.t) - 1, _STATES_FOR_TIME_SCALES).astype(int))
    return [
        time_scales(solution.system, solution.p, solution.t[i], solution.q[i], solution.v[i]) for i in rows
    ]
