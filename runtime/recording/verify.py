"""Check a recording by computing everything again from the model that it carries."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from runtime.errors import ModuleError
from runtime.system import System, load

from . import motion
from .quantities import Quantities
from .reader import Recording, read_recording
from .replay import replay

if TYPE_CHECKING:
    from runtime.solution import Solution

_SAME = (
    1e-9  # what was recorded and what is computed again; another machine's libm may differ in the last bits
)
_MULTIPLIERS_SAME = 1e-6  # multipliers are worth fewer digits near singular configurations
_EQUATIONS = 1e-6


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
        If the file cannot be read at all.
    """
    recording = read_recording(path)
    checks = [_checksum(recording), _frame_count(recording)]
    system, check = _system(recording)
    checks.append(check)
    if system is not None:
        checks += _model_checks(system, recording, intervals, seed)
    n = len(recording.t)
    found = tuple(check for check in checks if check is not None)
    return Report(recording.path, recording.complete, n, float(recording.t[-1]), found)


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
        system = load(recording.module_text + "\n")
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


def _model_checks(system: System, recording: Recording, intervals: int, seed: int) -> list[Check]:
    of = Quantities(system, recording.p)
    t, y = recording.t.copy(), recording.states
    checks = [_finite(recording), _time(recording)]
    if not checks[0].ok:
        return checks
    energies = of.evaluate("energy", t, y)
    checks.append(_recorded_energies(recording, energies))
    checks += _health(replay(system, recording, energies))
    accelerations, multipliers = of.accelerations_and_multipliers(t, y)
    if system.m:
        checks.append(_multipliers(recording, multipliers))
    checks.append(_equations(of, recording, accelerations))
    checks.append(_motion(of, recording, intervals, seed))
    return checks


def _health(solution: Solution) -> list[Check]:
    """Return the run's own checks of energy, constraints and quaternions, made again with what was computed again."""
    again = [
        check
        for check in solution.health
        if check.check in ("energy", "quaternions") or check.check.startswith("constraint ")
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


def _recorded_energies(recording: Recording, energies: np.ndarray) -> Check:
    if recording.energy.shape != (len(energies), 3):
        return Check("energies as recorded", False, 1.0, 0.0, "the recorded energies have gaps")
    scale = float(np.abs(energies).max(initial=0.0)) or 1.0
    value = np.abs(recording.energy[:, :2] - energies).max(initial=0.0) / scale
    return _limited(
        "energies as recorded", value, _SAME, "difference from T and V computed again, of the largest of them"
    )


def _multipliers(recording: Recording, again: np.ndarray) -> Check:
    scale = float(np.abs(again).max(initial=0.0)) or 1.0
    value = np.abs(again - recording.multipliers).max(initial=0.0) / scale
    return _limited(
        "multipliers",
        value,
        _MULTIPLIERS_SAME,
        "difference from multipliers computed again, of the largest of them",
    )


def _equations(of: Quantities, recording: Recording, a: np.ndarray) -> Check:
    """Put accelerations and recorded multipliers into M a − f − Gᵀλ = 0 and G a = γ."""
    multipliers = recording.multipliers
    no_a, no_multipliers = np.zeros_like(a), np.zeros_like(multipliers)
    terms = [
        np.abs(of.evaluate("residual", recording.t.copy(), np.hstack([recording.q, recording.v, *extension])))
        for extension in ((a, multipliers), (no_a, no_multipliers), (a, no_multipliers), (no_a, multipliers))
    ]
    # The terms by themselves say what is large; dynamics and constraints have different units.
    value = 0.0
    for rows in (slice(0, of.system.nv), slice(of.system.nv, None)):
        scale = max(float(term[:, rows].max(initial=0.0)) for term in terms[1:]) or 1.0
        value = max(value, float(terms[0][:, rows].max(initial=0.0)) / scale)
    return _limited(
        "equations", value, _EQUATIONS, "what is left of the equations of motion, of their largest term"
    )


def _motion(of: Quantities, recording: Recording, intervals: int, seed: int) -> Check:
    result = motion.reintegrate(of, recording, intervals, seed)
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
