"""Check a recording by computing everything again from the model that it carries.

What `verify` found in a recording.

A recorded run as a `Solution`: energies and residuals computed again, the rest as it was recorded.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import solve_ivp

from symgen.runtime.batches import constraint_residuals
from symgen.runtime.checks.health import health_of, judged_with_work
from symgen.runtime.code.bridge import call_kernel
from symgen.runtime.constraints.kkt import robust_rhs_address
from symgen.runtime.errors import ModuleError
from symgen.runtime.event_actions import EventRecord
from symgen.runtime.exchange import Exchange
from symgen.runtime.inputs.given import InputFault
from symgen.runtime.inputs.recorded import drive_as_recorded
from symgen.runtime.module import read_module
from symgen.runtime.recording import schema
from symgen.runtime.recording.reader import blamed_on, read_recording
from symgen.runtime.recording.recording import Quantities, RecordedEvent, Recording
from symgen.runtime.recording.schema import RecordingError
from symgen.runtime.solution import ConstraintResidual, Energy, Solution
from symgen.runtime.system import System
from symgen.runtime.timing.timetable import step_limits_of
from symgen.runtime.work_quadrature import work_that_balances

if TYPE_CHECKING:
    from collections.abc import Iterator

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


def reintegrate(
    of: Quantities, recording: Recording, intervals: int, seed: int, *, with_work: bool = True
) -> Reintegration:
    """Integrate some intervals between neighbouring frames, from the recorded state to the recorded state.

    Parameters
    ----------
    of : Quantities
    recording : Recording
    intervals : int
        How many; ones that touch an event are never taken.
    seed : int
    with_work : bool
        Whether the work beside the motion is compared; where the energy balance counts another, it need not be right.
    """
    fixed = "step" in recording.options and recording.options["step"] is not None
    rtol = _FIXED_STEP_TOLERANCE if fixed else max(recording.rtol, 1e-13)
    atol = _FIXED_STEP_TOLERANCE * 1e-2 if fixed else max(recording.atol, 1e-16)
    t, y = recording.t, recording.states
    tolerance = atol + rtol * _scales(of, y)
    free = _intervals_without_events(recording)
    compared = slice(None if with_work else of.system.nq + of.system.nv)
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
        growth = max(1.0, float((np.abs(nudged - end) / tolerance)[compared].max()) / _NUDGE)
        differences.append(float((np.abs(end - y[i + 1]) / tolerance)[compared].max()) / growth)
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


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes
    ----------
    name : str
    ok : bool or None
        None: could not be checked; `says` tells why.
    value, limit : float
        What was found; what it must not exceed.
    says : str
    """

    name: str
    ok: bool | None
    value: float
    limit: float
    says: str


@dataclass(frozen=True)
class Report:
    """What `verify` found.

    Attributes
    ----------
    path : Path
    complete : bool
        False for a run that was cut short.
    n_frames : int
    t_last : float [s]
    checks : tuple of Check
    """

    path: Path
    complete: bool
    n_frames: int
    t_last: float
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether no check failed. A recording that was cut short can be ok: see `complete`."""
        return all(check.ok is not False for check in self.checks)

    @property
    def summary(self) -> str:
        """One sentence."""
        frames = f"{self.n_frames} frame{'s' * (self.n_frames != 1)} up to t = {self.t_last:.9g} s"
        failed = [check.name for check in self.checks if check.ok is False]
        state = f"complete: {frames}" if self.complete else f"incomplete: {frames}; the run was cut short"
        return f"{state}; failed: {', '.join(failed)}" if failed else f"{state}; all checks passed"

    def to_dict(self) -> dict[str, Any]:
        """Return the report as JSON can say it."""
        checks = [asdict(check) for check in self.checks]
        head = {"path": str(self.path), "ok": self.ok, "complete": self.complete, "says": self.summary}
        return {**head, "frames": self.n_frames, "t": self.t_last, "checks": checks}


_COUNTED = ("steps", "rejected", "rhs", "jacobians", "factorisations", "newton", "projections")


def replay(system: System, recording: Recording, energies: np.ndarray) -> Solution:
    """Return the run as a solution, without samples, states around events, and step log.

    Parameters
    ----------
    system : System
        Loaded from the recorded module.
    recording : Recording
    energies : ndarray, shape (n, 2)
        T and V, computed again.
    """
    # Compiled code takes writable arrays only; the recording's own are not.
    t, p, states = recording.t.copy(), system.with_settings(recording.p), recording.states
    work = _recorded_work(system, recording)
    along = _work_along(system, p, recording, energies, work)
    work = work if along is None else along
    balance = energies.sum(axis=1) - work
    exchange = Exchange(energies, work, holds=bool(system.switches))
    error = float(exchange.relative(np.abs(balance - balance[0]).max()))
    position, velocity = constraint_residuals(system, p, t, states)
    return Solution(
        system=system,
        p=p,
        t=t,
        q=recording.q,
        v=recording.v,
        w=work,
        samples=[],
        events=[],
        energy=Energy(energies[:, 0], energies[:, 1], work, exchange, error),
        constraint_residual=ConstraintResidual(position, velocity, position.max(), velocity.max()),
        step_log=np.zeros((0, 2)),
        stats={name: int(recording.stats.get(name, 0)) for name in _COUNTED},
        status=recording.status,
        message="",
        notes=[],
        method=recording.method,
        constraints=recording.constraints,
        rtol=recording.rtol,
        atol=recording.atol,
        step=recording.options.get("step"),
        t_start=float(t[0]),
        t_end=float(t[-1]),
    )


def _work_along(
    system: System, p: np.ndarray, recording: Recording, energies: np.ndarray, work: np.ndarray
) -> np.ndarray | None:
    """Return the work integrated along the frames, where that balances the energies better, as the run does."""
    if not system.nw:
        return None
    settings, expected = recording.settings, system.n_settings_of_switches
    if settings.shape[1] != expected:
        return None
    jumps = [event.whole or _unknown(event) for event in recording.events]
    forms = Quantities(system, p).forms(settings) if expected else None
    states = np.ascontiguousarray(recording.states[:, : system.nq + system.nv])
    return work_that_balances(system, p, recording.t.copy(), states, energies, work, forms, jumps)


def _unknown(event: RecordedEvent) -> EventRecord:
    """Return an event that leaves the work as it was recorded between the frames about it."""
    none = np.zeros(0)
    return EventRecord(event.name, "", event.t, none, none, none, none, event.energy_change)


def _recorded_work(system: System, recording: Recording) -> np.ndarray:
    """Return the work with that of resets [J], shape (n,)."""
    work = recording.w[:, 0].copy() if system.nw else np.zeros(len(recording.t))
    for event in recording.events:
        work[event.frame :] += event.energy_change
    return work


_SAME = (
    1e-9  # what was recorded and what is computed again; another machine's libm may differ in the last bits
)
_MULTIPLIERS_SAME = 1e-6  # multipliers are worth fewer digits near singular configurations
_EQUATIONS = 1e-6


def verify(path: str | Path, *, intervals: int = 5, seed: int = 0) -> Report:
    """Read a recording and check it from the model, the parameters and the states in it.

    Parameters
    ----------
    path : path-like
    intervals : int
        So many intervals between frames are integrated again, by SciPy.
    seed : int
        Of the choice of intervals.

    Raises
    ------
    RecordingError
        If the file cannot be read at all, or shows no run.
    """
    recording = read_recording(path)
    if "mode" in recording.options:
        raise RecordingError(
            f"{path}: shows a mode, a linear motion that `symgen modes` wrote: there is no run to check"
        )
    with blamed_on(path):
        return _checked(recording, intervals, seed)


def _checked(recording: Recording, intervals: int, seed: int) -> Report:
    checks = [_torn(recording), _bytes(recording), _checksum(recording), _frame_count(recording)]
    system, check = _system(recording)
    checks.append(check)
    if system is not None:
        system, check = _driven(system, recording)
        checks.append(check)
    if system is not None:
        checks += _model_checks(system, recording, intervals, seed)
    n = len(recording.t)
    found = tuple(check for check in checks if check is not None)
    return Report(recording.path, recording.complete, n, float(recording.t[-1]), found)


def _torn(recording: Recording) -> Check | None:
    if not recording.lost:
        return None
    says = f"cut off in the middle of a record: the last {recording.lost} bytes were left out"
    return Check("file", None, float(recording.lost), 0.0, says)


def _bytes(recording: Recording) -> Check | None:
    if not recording.file_sha256:
        return None
    ok = schema.FileDigest(recording.path).extend(recording.file_bytes) == recording.file_sha256
    says = (
        "the file is as it was written"
        if ok
        else "the file is not as it was written: pictures, plots or texts in it were changed or damaged"
    )
    return Check("bytes", ok, float(not ok), 0.0, says)


def _checksum(recording: Recording) -> Check | None:
    if not recording.complete:
        return None
    ok = recording.state_sha256() == recording.sha256
    says = (
        "the states are those that were written"
        if ok
        else "the states are not those that were written: the file was changed"
    )
    return Check("checksum", ok, float(not ok), 0.0, says)


def _frame_count(recording: Recording) -> Check | None:
    if not recording.complete:
        return None
    n, written = len(recording.t), recording.n_frames_written
    return Check("frames", n == written, float(n), float(written), f"{n} frames read, {written} were written")


def _system(recording: Recording) -> tuple[System | None, Check]:
    """Load the recorded module, and hold names and lengths against it."""
    try:
        system = System(read_module(recording.module_text + "\n"))
    except ModuleError as error:
        return None, Check("model", False, 1.0, 0.0, f"the recorded module cannot be read: {error}")
    expected = [[r["name"] for r in records] for records in (system.parameters, system.inputs)]
    got = [list(recording.parameters), list(recording.inputs)]
    widths = [array.shape[1] for array in (recording.q, recording.v, recording.w, recording.multipliers)]
    sizes = [system.nq, system.nv, system.nw, system.m]
    if got != expected:
        says = f"parameters and inputs are {got}, but the model has {expected}"
    elif not np.isfinite(recording.p).all():
        says = "a parameter or input is not a finite number"
    elif widths != sizes:
        says = f"a frame has {widths} coordinates, rates, works and multipliers, but the model has {sizes}"
    else:
        return system, Check(
            "model", True, 0.0, 0.0, f"{system.name}: {len(recording.p)} parameters and inputs agree"
        )
    return None, Check("model", False, 1.0, 0.0, says)


def _driven(system: System, recording: Recording) -> tuple[System | None, Check | None]:
    """Drive the model by the inputs over time that were recorded; None where they are not known."""
    if not recording.inputs_over_time:
        return system, None
    try:
        driven, unknown = drive_as_recorded(system, recording.inputs_over_time)
    except InputFault as fault:
        return None, Check("inputs", False, 1.0, 0.0, str(fault))
    if unknown:
        says = f"the run was cut short before the values of {', '.join(unknown)} were written: nothing more is checked"
        return None, Check("inputs", None, float(len(unknown)), 0.0, says)
    names = ", ".join(recording.inputs_over_time)
    return driven, Check("inputs", True, 0.0, 0.0, f"over time as recorded: {names}")


def _model_checks(system: System, recording: Recording, intervals: int, seed: int) -> list[Check]:
    of = Quantities(system, system.with_settings(recording.p))
    t, y = recording.t.copy(), recording.states
    checks = [_finite(recording), _time(recording)]
    if not checks[0].ok:
        return checks
    energies = of.evaluate("energy", t, y)
    if recording.content != schema.STATES:
        checks.append(_recorded_energies(recording, energies, holds=bool(system.switches)))
    solution = replay(system, recording, energies)
    checks += _health(solution, recording)
    settings, expected = recording.settings, system.n_settings_of_switches
    if settings.shape[1] != expected:
        says = f"a frame has {settings.shape[1]} settings of stops and frictions, the model has {expected}"
        return [*checks, Check("stops and frictions", not recording.complete and None, 1.0, 0.0, says)]
    if system.m:
        checks.append(_multipliers(recording, of.multipliers(t, y, settings)))
    checks.append(_equations(of, recording))
    if recording.inputs_at_frames:
        names = ", ".join(recording.inputs_at_frames)
        says = f"not checked: a controller acted at every instant, whose {names} is known at the frames only"
        checks.append(Check("motion", None, 0.0, 0.0, says))
    else:
        integrated_again = not np.array_equal(solution.w, _recorded_work(system, recording))
        checks.append(_motion(of, recording, intervals, seed, with_work=not integrated_again))
    return checks


def _health(solution: Solution, recording: Recording) -> list[Check]:
    """Return the run's own checks of energy, stops, constraints and quaternions, with what was computed again.

    How right the motion is only the run can tell, from its steps.
    """
    found = health_of(solution)
    for check in recording.health:
        error = check.get("value")
        known = check.get("check") == "accuracy" and check.get("ok") and not check.get("note")
        if known and isinstance(error, int | float):
            found = judged_with_work(found, solution, error)
    again = [
        check
        for check in found
        if check.check in ("energy", "stops", "quaternions") or check.check.startswith("constraint ")
    ]
    return [Check(check.check, bool(check.ok), check.value, check.limit, check.says) for check in again]


def _limited(name: str, value: float, limit: float, says: str) -> Check:
    # Written so that NaN fails.
    return Check(name, bool(value <= limit), float(value), float(limit), says)


def _finite(recording: Recording) -> Check:
    columns = np.column_stack([recording.t, recording.states, recording.multipliers])
    bad = np.flatnonzero(~np.isfinite(columns).all(axis=1))
    says = (
        f"frame {bad[0]} at t = {recording.t[bad[0]]:.9g} s has inf or nan"
        if len(bad)
        else "all numbers are finite"
    )
    return Check("finite", not len(bad), float(len(bad)), 0.0, says)


def _time(recording: Recording) -> Check:
    # An event may have a frame on each of its sides.
    at_event = np.isin(np.arange(1, len(recording.t)), [event.frame for event in recording.events])
    steps = np.diff(recording.t)
    bad = np.flatnonzero((steps < 0.0) | ((steps == 0.0) & ~at_event))
    says = f"time does not advance after frame {bad[0]}" if len(bad) else "time advances from frame to frame"
    return Check("time", not len(bad), float(len(bad)), 0.0, says)


def _recorded_energies(recording: Recording, energies: np.ndarray, *, holds: bool) -> Check:
    if not recording.complete and len(recording.energy) < len(energies):
        energies = energies[: len(recording.energy)]
        if not len(energies):
            return Check(
                "energies as recorded",
                None,
                0.0,
                _SAME,
                "not checked: the file ends before they were written",
            )
    if recording.energy.shape != (len(energies), 3):
        return Check("energies as recorded", False, 1.0, 0.0, "the recorded energies have gaps")
    off = np.abs(recording.energy[:, :2] - energies).max(initial=0.0)
    value = float(Exchange(energies, holds=holds).relative(off))
    says = "difference from T and V computed again, of what the motion exchanges"
    return _limited("energies as recorded", value, _SAME, says)


def _multipliers(recording: Recording, again: np.ndarray) -> Check:
    scale = float(np.abs(again).max(initial=0.0)) or 1.0
    value = np.abs(again - recording.multipliers).max(initial=0.0) / scale
    return _limited(
        "multipliers",
        value,
        _MULTIPLIERS_SAME,
        "difference from multipliers computed again, of the largest of them",
    )


def _equations(of: Quantities, recording: Recording) -> Check:
    """Put accelerations and recorded multipliers into M a − f − Gᵀλ = 0 and G a = γ, where nothing is held or stuck."""
    parts = [_terms(of.in_form(settings), recording, rows) for settings, rows in _forms(of, recording)]
    terms = [np.concatenate(part) for part in zip(*(part for part in parts if part), strict=True)]
    if not terms:
        says = "not checked: a stop is closed or a friction sticks at every frame"
        return Check("equations", None, 0.0, _EQUATIONS, says)
    # The terms by themselves say what is large; dynamics and constraints have different units.
    value = 0.0
    for rows in (slice(0, of.system.nv), slice(of.system.nv, None)):
        scale = max(float(term[:, rows].max(initial=0.0)) for term in terms[1:]) or 1.0
        value = max(value, float(terms[0][:, rows].max(initial=0.0)) / scale)
    return _limited(
        "equations", value, _EQUATIONS, "what is left of the equations of motion, of their largest term"
    )


def _terms(of: Quantities, recording: Recording, rows: np.ndarray) -> list[np.ndarray]:
    """Return magnitudes of what is left of the equations at some frames, and of their terms; [] where more is held."""
    multipliers = recording.multipliers[rows]
    if of.system.m != multipliers.shape[1]:
        return []
    t, q, v = recording.t[rows], recording.q[rows], recording.v[rows]
    a = of.accelerations_and_multipliers(t, recording.states[rows])[0]
    no_a, no_multipliers = np.zeros_like(a), np.zeros_like(multipliers)
    extensions = ((a, multipliers), (no_a, no_multipliers), (a, no_multipliers), (no_a, multipliers))
    return [np.abs(of.evaluate("residual", t, np.hstack([q, v, *extension]))) for extension in extensions]


def _forms(of: Quantities, recording: Recording) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield settings of stops and frictions, and the frames at which they hold."""
    forms = of.forms(recording.settings)
    for k, settings in enumerate(forms.settings):
        yield settings, np.flatnonzero(forms.index == k)


def _motion(of: Quantities, recording: Recording, intervals: int, seed: int, *, with_work: bool) -> Check:
    result = reintegrate(of, recording, intervals, seed, with_work=with_work)
    if not result.times:
        return Check(
            "motion",
            None,
            0.0,
            result.limit,
            f"not checked: {result.skipped or 'there is no interval without an event'}",
        )
    says = (
        f"{len(result.times)} intervals integrated again by {'/'.join(result.methods)}: "
        f"largest difference, {result.unit} (at t = {result.worst_time:.9g} s)"
    )
    return _limited(
        "motion", result.value, result.limit, says + (f"; {result.skipped}" if result.skipped else "")
    )
