"""Whether a run's result can be trusted: energy, constraints, steps, finite numbers, a regular end."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.accuracy import accuracy
from symgen.runtime.checks.entry import HealthCheck, advised, limited, noted
from symgen.runtime.checks.equations import equations
from symgen.runtime.checks.stability import stable_radius, stable_step, unstable_rate
from symgen.runtime.checks.steps import MOST_REJECTED, least_steps_in_a_period
from symgen.runtime.checks.time_scales import time_scales_at
from symgen.runtime.checks.wrong_signs import wrong_signs
from symgen.runtime.event_actions import event_times
from symgen.runtime.exchange import energy_limit, largest_leak
from symgen.runtime.failures import state_names
from symgen.runtime.integrate.methods import Method, find_method
from symgen.runtime.lazy import Late
from symgen.runtime.positions import Positions
from symgen.runtime.sampling import sample_rows

if TYPE_CHECKING:
    from symgen.runtime.checks.time_scales import TimeScales
    from symgen.runtime.solution import Solution

blow_up = Late("symgen.runtime.checks.blow_up")
branches = Late("symgen.runtime.checks.branches")
contact_settings = Late("symgen.runtime.contact.settings")
energy_drift = Late("symgen.runtime.checks.energy_drift")
drift_of_constraints = Late("symgen.runtime.constraints.drift")
pushing_friction = Late("symgen.runtime.checks.pushing_friction")
held = Late("symgen.runtime.checks.held")
jacobian = Late("symgen.runtime.checks.jacobian")
levels = Late("symgen.runtime.constraints.levels")
missed_events = Late("symgen.runtime.checks.missed_events")
mode_origin = Late("symgen.runtime.checks.mode_origin")
poles = Late("symgen.runtime.checks.poles")
stiffness = Late("symgen.runtime.checks.stiffness")
stops = Late("symgen.runtime.checks.stops")
subsystems = Late("symgen.runtime.checks.subsystems")
time_resolution = Late("symgen.runtime.checks.time_resolution")
windings = Late("symgen.runtime.checks.windings")
undersampled = Late("symgen.runtime.checks.undersampled")
error_estimate = Late("symgen.runtime.checks.error_estimate")
work_error = Late("symgen.runtime.checks.work_error")

_QUATERNION_LENGTH = 1e-12
_FROM_ROUND_OFF = -np.log(np.finfo(float).eps)  # e-folds
_TINY_STEP = 64 * np.finfo(float).eps
_MOST_TINY = 0.05  # part of the steps
_STATES_FOR_TIME_SCALES = 5
_LARGEST_FOR_TIME_SCALES = 400  # states; eigenvalues cost their cube
_NEAR_DEPENDENCE = 1e-3  # ratio of pivots
_OF_STEPS = ("resolution", "stability")
_OF_DRIFT, _SMALL_DRIFT = ("constraint position", "constraint velocity"), 1e-2
_SEEN_BESIDE = ("stability", "time terms")  # what a companion beside all of a run resolves
_REGULAR_ENDS = ("success", "terminated")


def health_of(solution: Solution) -> list[HealthCheck]:
    """Return the health report of a run, which is worked out once; see `check`."""
    if solution.whole is not None:
        return health_of(solution.whole)
    if "_health" not in solution.__dict__:
        solution.__dict__["_health"] = check(solution)
    return solution.__dict__["_health"]


def objections_to(solution: Solution) -> list[HealthCheck]:
    """Return the entries of the health report that are not ok."""
    return [entry for entry in health_of(solution) if not entry.ok]


def objections_without_companions(solution: Solution) -> list[HealthCheck]:
    """Return the entries that are not ok, and none where none is that needs no other run beside this one.

    How far the motion is off is told by companions, which cost as much as the run. What else objects they may acquit:
    then the whole report has the last word.
    """
    if solution.whole is not None:
        return objections_without_companions(solution.whole)
    if "_health" not in solution.__dict__:
        with np.errstate(all="ignore"):
            found = _checked(solution, with_companions=False)
        if all(entry.ok for entry in found):
            return []
    return objections_to(solution)


def check(solution: Solution) -> list[HealthCheck]:
    """Check a run.

    What is not ok is evidence against the result. What may explain it, or would have been wiser, is a note: steps in
    a period, stability, stiffness, signs of damping and stiffness, rejected and tiny steps. Notes stand beside what
    they may be the cause of, and by themselves say nothing against a result.

    Limits:

    * energy: adaptive methods 1e5 rtol, at least 1e-6 and at most 2e-2; methods of fixed step 2e-2, at
      order 1 5e-2. The error is that of T + V - work, in parts of what the motion exchanges; of fixed steps, where
      the error of the motion is known to be small, in parts of that and the work that passes through it meanwhile; of
      adaptive ones, a note where errors of the states within the tolerance explain it, by way of stiff forces, or
      where it comes by and by over a long run, and what it makes of the motion is known to be small.
    * equations: what `rhs` leaves of M a - f - Gᵀλ, G a - γ (as `residual` has them) and dq/dt - N v at five
      states, 1e-8 of their terms; other functions that the run used likewise.
    * constraints: adaptive methods 100 rtol, at least 1e-8 and at most 1e-4; of fixed step 1e-6; in parts of
      the constraint's change over the coordinates' characteristic sizes, or of its largest velocity term. With
      `baumgarte` up to 1e-2, as a note, where the motion is known to be off by no more than that.
    * quaternions: their lengths 1e-12 from 1, as every state is scaled to that.
    * accuracy: the estimated error at the end, in its own file. Where a run of fixed step cannot be estimated, steps
      that do not resolve its fastest motion, or are not stable on it, are evidence.
    * stability (fixed step): what is unstable must not grow from round-off to the size of the motion; a note where a
      companion beside all of the run has seen that it does not.
    * notes on steps: at most 80 % rejected, at most 5 % at the limit of floating-point time; at fixed step enough of
      them in the fastest period (`steps.py`).
    * rank: constraints that come to depend on each other on the way are reported, with when and which; steps across a
      gap between branches of the positions fail.
    * subsystems integrated by themselves: the limits of energy and rejected steps hold for the worst of them.
    * stops: no gap below zero by more than 10 times what the tolerances leave of the coordinates it depends on.
    * windings: no bushing, nor a spring over an angle of directions, wound up so far that its angle jumps.
    * held: no friction that sticks with a force beyond its limit by more than 2 %, no stop that pulls, at frames.
    * friction: no dry friction with a negative force, at frames.
    * time terms: what time alone does is resolved by a fixed step, and not too much for any; what a step leaves out
      is a note where a companion beside all of the run has seen that it did not matter.
    * missed events, poles (fixed steps), accuracy (the estimated error, of regular ends), and notes on the Jacobian,
      stiffness (explicit methods, many steps), negative damping and stiffness: each in its own file.
    """
    with np.errstate(all="ignore"):  # what is not finite is found by looking for it
        return _checked(solution)


def _checked(solution: Solution, *, with_companions: bool = True) -> list[HealthCheck]:
    method = find_method(solution.method)
    found = [_status(solution), _finite(solution)]
    if solution.status == "failed" or not found[1].ok:
        found += blow_up.blow_up(solution, method)
    if not found[1].ok:
        return found + ([] if method.adaptive else list(_resolution(solution, method)))
    found.append(_energy(solution, method))
    if solution.system.m:
        found += [*_constraints(solution, method), *_rank(solution), *branches.branches(solution)]
    if solution.system.quaternions:
        found.append(_quaternions(solution))
    found += equations(solution)
    found += _steps(solution) if method.adaptive else _resolution(solution, method)
    found += _further(solution, method)
    if with_companions and solution.status in _REGULAR_ENDS:
        found += accuracy(solution)
    for entry in found:
        if entry.check == "accuracy" and entry.ok and not entry.note:
            found = judged_with_work(found, solution, entry.value)
            if getattr(entry, "sees_drift", False):
                found = energy_drift.judged_with_drift(found, solution, entry.value)
            if solution.constraints == "baumgarte":
                found = judged_with_drift(found, entry.value)
            if getattr(entry, "sees_all", False):
                found = _right_all_the_same(found, _SEEN_BESIDE, np.inf)
    return _with_evidence(found)


def _further(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    """Yield the checks that most runs give no cause for; each is loaded where there is one."""
    if solution.system.events:
        yield from missed_events.missed_events(solution)
    if any(switch["kind"] == "stop" for switch in solution.system.switches):
        yield stops.stops(solution)
    if any(switch["kind"] == "friction" for switch in solution.system.switches):
        yield from pushing_friction.pushing_friction(solution)
    if solution.forms is not None:
        yield held.held(solution)
    if solution.system.source.header.get("windings"):
        yield windings.windings(solution)
    if "residual_jacobian" in method.kernels:
        yield from jacobian.jacobian(solution, method)
    if method.adaptive and not method.stiff:
        yield from stiffness.stiffness(solution, method)
    if solution.timetable is not None:
        yield from time_resolution.time_resolution(solution)
    if solution.parts is not None:
        yield from subsystems.subsystems(solution, method)
    if not method.adaptive:
        yield from poles.poles(solution, method)
    yield from wrong_signs(solution)


def judged_with_work(found: list[HealthCheck], solution: Solution, error: float) -> list[HealthCheck]:
    """Judge the energy balance of a motion that is right by the work in it, too.

    Parameters
    ----------
    error : float
        How far the motion is off, as `accuracy` estimates.
    """
    if all(entry.ok for entry in found if entry.check == "energy"):
        return found
    if find_method(solution.method).adaptive:
        return work_error.judged_with_errors_of_work(found, solution, error)
    return judged_with_work_passed(found, solution)


def judged_with_drift(found: list[HealthCheck], error: float) -> list[HealthCheck]:
    """Let drift that stabilisation leaves be a note where the motion is known to be right.

    Companions keep to the constraints: what drift makes of the motion is part of the error that they find.

    Parameters
    ----------
    error : float
        How far the motion is off, as `accuracy` estimates.
    """
    return found if error > _SMALL_DRIFT else _right_all_the_same(found, _OF_DRIFT, _SMALL_DRIFT)


def _right_all_the_same(found: list[HealthCheck], names: tuple[str, ...], most: float) -> list[HealthCheck]:
    """Let objections up to a value be notes, beside a motion that is known to be right."""
    return [
        replace(entry, ok=True, note=True, says=f"{entry.says}; the motion is right all the same (accuracy)")
        if not entry.ok and entry.check in names and entry.value <= most and entry.limit > 0.0
        else entry
        for entry in found
    ]


def judged_with_work_passed(found: list[HealthCheck], solution: Solution) -> list[HealthCheck]:
    """Judge the energy balance of fixed steps by the work that passes through a motion, too, where that is right.

    The drive of a damped motion makes up for what is lost in steps: the balance drifts, and the motion does not. In
    adaptive steps the tolerance leaves far less than that.
    """
    (energy,) = [entry for entry in found if entry.check == "energy"]
    of_run = solution.energy
    if energy.ok or not of_run.exchange.size > 0.0:
        return found
    # States between frames that are further off than any frame are so on their own.
    at_frames = of_run.exchange.relative(of_run.balance - of_run.balance[0]).max()
    between = max(of_run.unscaled_error - at_frames, 0.0)
    value = float(largest_leak(of_run.balance, of_run.work, of_run.exchange.size) + between)
    if not value <= energy.limit:
        return found
    says = (
        f"the energy balance is off by {energy.value:.2g} of what the motion exchanges, and by {value:.2g} where work "
        "that passes through it counts as well"
    )
    passed = replace(energy, ok=True, value=value, says=says)
    return [passed if entry is energy else entry for entry in found]


def _with_evidence(found: list[HealthCheck]) -> list[HealthCheck]:
    """Let steps that are too long for a motion count as evidence where nothing says how large their error is."""
    if any(entry.check == "accuracy" and not entry.note for entry in found):
        return found
    return [
        replace(entry, ok=False, note=False) if entry.note and entry.check in _OF_STEPS else entry
        for entry in found
    ]


def _status(solution: Solution) -> HealthCheck:
    ok = solution.status in _REGULAR_ENDS
    says = f"{solution.status} at t = {solution.t[-1]:.9g} s" if ok else solution.message or solution.status
    return HealthCheck("status", ok, float(solution.t[-1]), float(solution.t_end), says)


def _finite(solution: Solution) -> HealthCheck:
    states = solution.states
    with np.errstate(over="ignore", invalid="ignore"):
        all_finite = np.isfinite(states.sum())  # one number tells, but for sums too large for a float
    bad = np.zeros(0) if all_finite else np.flatnonzero(~np.isfinite(states).all(axis=1))
    if not bad.size:
        return HealthCheck("finite", True, 0.0, 0.0, "all numbers are finite")
    column = int(np.flatnonzero(~np.isfinite(states[bad[0]]))[0])
    name = state_names(solution.system)[column]
    says = f"{name} is not finite from t = {solution.t[bad[0]]:.9g} s on; take smaller steps"
    return HealthCheck("finite", False, float(bad.size), 0.0, says)


def _energy(solution: Solution, method: Method) -> HealthCheck:
    value, limit = solution.energy.unscaled_error, energy_limit(method, solution.rtol)
    if value > limit:
        value *= _share_of_exchange(solution)
    found = f"the energy balance is off by {value:.2g} of what the motion exchanges"
    if solution.energy.taken > solution.energy.max_error:
        found = f"without energy scaling, {found.replace('is off', 'would be off')}"
    remedy = _smaller_tolerance(solution) if method.adaptive else f"a smaller step than {solution.step:g} s"
    return limited("energy", value, limit, found, f"{found}, more than {limit:.2g}: try {remedy}")


def _smaller_tolerance(solution: Solution) -> str:
    """Say which of the two tolerances decides: of what is small in its units, it is the absolute one."""
    largest = float(np.abs(solution.states).max(initial=0.0))
    if solution.atol > solution.rtol * largest:
        return f"a smaller atol than {solution.atol:g}, which counts more than rtol as nothing is above {largest:.2g}"
    return f"a smaller rtol than {solution.rtol:g}"


def _share_of_exchange(solution: Solution) -> float:
    """Return what frames see of the exchange, in parts of all that there is: of a vibration, they may see nothing."""
    exchange = solution.energy.exchange
    between = undersampled.seen_between(solution, error_estimate.method_of(solution))
    if not len(between):
        return 1.0
    times = np.full(len(between), solution.t[0])
    energies = evaluate(solution.system, "energy", solution.p, times, between)
    largest = max(np.abs(energies[:, 0]).max(), np.ptp(energies[:, 1]), exchange.size)
    return float(exchange.size / largest) if exchange.size > 0.0 else 1.0


def _constraints(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    limit = drift_of_constraints.drift_limit(method, solution.rtol)
    if solution.constraints == "none":
        says = (
            "constraints are held on the level of accelerations only, and nothing takes drift back: it grows with "
            "time; this is for seeing it, results are for `constraints = projection`"
        )
        yield noted("constraints not held", float(solution.system.m), 0.0, says)
    for level, drift in drift_of_constraints.constraint_drift(solution).items():
        found = (
            f"constraint {drift.name!r} is off by {drift.relative:.2g} of its scale at t = {drift.t:.6g} s"
        )
        objection = f"{found}, more than {limit:.2g}: use `constraints = projection`, or smaller steps"
        yield limited(f"constraint {level}", drift.relative, limit, f"at most, {found}", objection)
    if solution.redundant:
        names = ", ".join(solution.redundant)
        says = f"{names}: multipliers are not unique, the minimum-norm ones are given"
        yield noted("redundant constraints", len(solution.redundant), 0.0, says)


def _rank(solution: Solution) -> Iterator[HealthCheck]:
    """Report where constraints came near to depending on each other, and which one does."""
    if solution.redundant or not solution.min_pivot_ratio < _NEAR_DEPENDENCE or solution.forms is not None:
        return
    system = solution.system
    pivots = evaluate(system, "rhs", solution.p, solution.t, solution.states)[:, -1]
    frame = int(np.argmin(np.where(np.isnan(pivots), -1.0, pivots)))
    here = levels.Constraints(system, solution.p, float(solution.t[frame]))
    rows = here.jacobian(solution.q[frame], solution.v[frame])
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1), 1e-300)[:, None]
    name = here.names[int(np.argmax(np.abs(np.linalg.svd(rows)[0][:, -1])))]
    says = (
        f"constraint {name!r} nearly follows from the others at about t = {solution.t[frame]:.6g} s (ratio of pivots "
        f"{solution.min_pivot_ratio:.2g}): a dead or change point, where the motion may go on in several ways"
    )
    yield noted("rank", solution.min_pivot_ratio, _NEAR_DEPENDENCE, says)


def _quaternions(solution: Solution) -> HealthCheck:
    off = np.abs(Positions(solution.system).lengths(solution.q) - 1.0)
    frame, which = np.unravel_index(np.argmax(off), off.shape)
    name = solution.system.coordinates[solution.system.quaternions[which]]["name"]
    value, t = float(off[frame, which]), solution.t[frame]
    found = f"the length of the quaternion of {name} is off 1 by {value:.2g} at t = {t:.6g} s"
    objection = f"{found}: its body is distorted; start from a quaternion of unit length"
    return limited("quaternions", value, _QUATERNION_LENGTH, f"at most, {found}", objection)


def _steps(solution: Solution) -> Iterator[HealthCheck]:
    taken, rejected = solution.stats["steps"], solution.stats["rejected"]
    ratio = rejected / max(taken + rejected, 1)
    found = f"{rejected} of {taken + rejected} steps were rejected"
    advice = f"{found}: a discontinuity or noise in the forces defeats the error control; make it an event"
    yield advised("rejected steps", ratio, MOST_REJECTED, found, advice)
    if not len(solution.step_log):
        return
    t, h = solution.step_log[:, 0], solution.step_log[:, 1]
    shortest, span = h.min(), solution.t_end - solution.t_start
    tiny = 0.0
    if not shortest > _TINY_STEP * max(abs(t[0]), abs(t[-1]), span):
        cut = [
            *event_times(solution.events),
            *(sample.t for sample in solution.samples),
            solution.t_end,
        ]
        short = h <= _TINY_STEP * np.maximum(np.abs(t), span)
        # Some end where an event or a stop time is, which may be at once; some go from one side of a choice to the
        # other, each choice once at an instant.
        short &= ~np.isin(t, cut)
        tiny = float(np.count_nonzero(_beyond(short, len(solution.system.jumps)))) / len(h)
    found = f"steps from {shortest:.3g} to {h.max():.3g} s"
    advice = (
        f"{found}: {tiny:.0%} of them can be told from zero only just; rtol may be too small for this model"
    )
    yield advised("step size", tiny, _MOST_TINY, found, advice)


def _beyond(marks: np.ndarray, n: int) -> np.ndarray:
    """Return those marks that at least n marks in a row stand before."""
    place = np.arange(len(marks))
    last_without = np.maximum.accumulate(np.where(marks, -1, place))
    return marks & (place - last_without > n)


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
    needed = least_steps_in_a_period(method)
    if period / h >= needed:
        yield HealthCheck("resolution", True, float(period / h), needed, found)
    else:
        advice = f"only {found}: take a step of at most {period / needed:.2g} s"
        yield noted("resolution", period / h, needed, advice)
    if stable_radius(method) is not None:
        yield _stability(solution, method, scales)


def _stability(solution: Solution, method: Method, scales: list[TimeScales]) -> HealthCheck:
    """Object where an unstable motion grows from round-off to the size of all; one that grows less is a note."""
    h = solution.step
    stable = min(stable_step(method, scale.eigenvalues) for scale in scales)
    found = f"the step is {h:.3g} s, stable up to {stable:.3g} s"
    if h <= stable:
        return HealthCheck("stability", True, h / stable, 1.0, found)
    span = float(solution.t[-1] - solution.t[0])
    folds = span * float(np.mean([unstable_rate(method, h, scale.eigenvalues) for scale in scales]))
    says = (
        f"{found}: the fastest motion, {_cause(solution)}, grows, by e^{folds:.3g} in the run; take a step below "
        f"{stable:.2g} s, or an implicit method"
    )
    if stable == 0.0:
        says = (
            f"{method.name} is unstable on undamped motion at every step, which grows by e^{folds:.3g} in the run; "
            "take verlet, rk4 or dop853"
        )
    ratio = h / stable if stable > 0.0 else np.inf
    grown = not folds < _FROM_ROUND_OFF
    return HealthCheck("stability", not grown, float(ratio), 1.0, says, note=not grown)


def _cause(solution: Solution) -> str:
    """Return what the fastest motion belongs to, at the start, before it has grown."""
    origin = mode_origin.fastest_origin(
        solution.system, solution.p, solution.t[0], solution.q[0], solution.v[0]
    )
    return f"which {origin.spring} makes fast" if origin is not None else "of the model"


def _time_scales(solution: Solution) -> list[TimeScales]:
    rows = _rows_for_time_scales(solution)
    system = solution.system
    p = contact_settings.without_turning(system, solution.p) if system.switches else solution.p
    return time_scales_at(system, p, solution.t[rows], solution.q[rows], solution.v[rows])


def _rows_for_time_scales(solution: Solution) -> np.ndarray:
    """Return frames, spread over the run, but none after it blew up: time scales there are those of garbage."""
    n = len(solution.t)
    if solution.status == "failed" or not np.isfinite(solution.states).all():
        # Half of the time to it: growth shows late.
        n = max(1, (blow_up.first_outgrown(solution) or 2 * n) // 2)
    rows = sample_rows(n, _STATES_FOR_TIME_SCALES)
    return rows[np.isfinite(solution.states[rows]).all(axis=1)]
