"""Where and by how much two recorded runs differ, and how fast they part."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from symgen.runtime.checks.growth import growth_rate
from symgen.runtime.errors import ModuleError
from symgen.runtime.exchange import Exchange
from symgen.runtime.module import read_module
from symgen.runtime.names import motion_records, rate_labels
from symgen.runtime.recording.reader import blamed_on, check_fits
from symgen.runtime.recording.schema import RecordingError
from symgen.runtime.recording.states_alone import with_energies
from symgen.runtime.system import System

from .reader import read_recording
from .recording import Recording

_SAME_TIME = 1e-12  # of the time that both runs cover
_SMALL = 1e-3  # of the largest quantity of its unit: what stays below has no scale of its own
_SETTINGS = ("method", "constraints", "rtol", "atol")
_OPTIONS = ("step", "t_start", "t_end", "max_step", "breaks")


@dataclass(frozen=True)
class Setting:
    """Something that was set otherwise: what, and both values; None where a run does not have it."""

    name: str
    first: Any
    second: Any


@dataclass(frozen=True)
class Difference:
    """How one quantity differs.

    Attributes
    ----------
    name, unit : str
    largest : float
        Largest difference, in the quantity's unit.
    t : float [s]
        Where that is.
    relative : float
        The same in parts of the quantity's scale: its largest value in both runs, at least 1/1000 of the largest of
        its unit; of the energy, what the motion exchanges.
    t_first : float or None [s]
        Where it first exceeds the tolerance.
    """

    name: str
    unit: str
    largest: float
    t: float
    relative: float
    t_first: float | None


@dataclass(frozen=True)
class Comparison:
    """Two runs compared at their common times.

    Attributes
    ----------
    first, second : Path
    tolerance : float
    n_common : int
        Frames at common times.
    t_begin, t_end : float [s]
        The first and last of these.
    settings : tuple of Setting
    differences : tuple of Difference
        Of coordinates, rates and energy that both runs have, as in the first model.
    only_first, only_second : tuple of str
        Coordinates that one of them does not have.
    growth : float or None [1/s]
        Rate at which the largest relative difference grows, exp(growth t), fitted between round-off and saturation; of
        a chaotic motion, its largest Lyapunov exponent. None where differences do not grow long enough to tell.
    """

    first: Path
    second: Path
    tolerance: float
    n_common: int
    t_begin: float
    t_end: float
    settings: tuple[Setting, ...]
    differences: tuple[Difference, ...]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]
    growth: float | None

    @property
    def equal(self) -> bool:
        """Whether both runs have the same coordinates, which agree within the tolerance everywhere."""
        agree = all(difference.t_first is None for difference in self.differences)
        return agree and not (self.only_first or self.only_second)

    @property
    def worst(self) -> Difference:
        """The quantity of the largest relative difference."""
        return max(self.differences, key=lambda d: d.relative if np.isfinite(d.relative) else np.inf)

    @property
    def summary(self) -> str:
        """One sentence."""
        span = f"at {self.n_common} common times from {self.t_begin:.6g} to {self.t_end:.6g} s"
        others = [*self.only_first, *self.only_second]
        if others:
            return f"different coordinates: only one of the runs has {', '.join(others)}"
        if self.equal:
            found = (
                "equal to the last bit" if self.worst.largest == 0.0 else f"equal within {self.tolerance:g}"
            )
            return f"{found} {span}"
        first = min((d for d in self.differences if d.t_first is not None), key=lambda d: d.t_first)
        return (
            f"different: {first.name} by more than {self.tolerance:g} from t = {first.t_first:.6g} s on; "
            f"{self.worst.name} most, by {self.worst.relative:.2g} of its size, {span}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as JSON can say it."""
        result = asdict(self)
        result |= {"first": str(self.first), "second": str(self.second)}
        return {"equal": self.equal, "says": self.summary, **result}


def compare(first: str | Path, second: str | Path, *, tolerance: float = 1e-6) -> Comparison:
    """Compare two recordings of runs.

    Parameters
    ----------
    first, second : path-like
    tolerance : float
        Of relative differences, see `Difference.relative`.

    Raises
    ------
    RecordingError
        One of them cannot be read, or they have no coordinates or times in common.
    """
    with blamed_on(f"{first}, {second}"):
        return _comparison(first, second, tolerance)


def _comparison(first: str | Path, second: str | Path, tolerance: float) -> Comparison:
    a, b = read_recording(first), read_recording(second)
    systems = _system(a), _system(b)
    for recording, system in ((a, systems[0]), (b, systems[1])):
        check_fits(recording, system)
    a, b = with_energies(a, systems[0]), with_energies(b, systems[1])
    rows = _common_frames(a, b)
    t = a.t[rows[0]]
    named_a, named_b = _quantities(a, systems[0], rows[0]), _quantities(b, systems[1], rows[1])
    _turn_alike(named_a, named_b, systems[0])
    shared = [name for name in named_a if name in named_b]
    own = [_names_of_motion(system) for system in systems]
    if set(own[0]).isdisjoint(own[1]):
        raise RecordingError(
            f"{first} and {second} have no coordinate in common: there is nothing to compare"
        )
    units = {name: unit for name, (unit, _) in named_a.items()}
    values = {name: (named_a[name][1], named_b[name][1]) for name in shared}
    scales = _scales(units, values)
    if _ENERGY in scales:
        scales[_ENERGY] = max(_exchanged(a), _exchanged(b)) or 1.0
    relative = {name: np.abs(x - y) / scales[name] for name, (x, y) in values.items()}
    differences = tuple(
        _difference(name, units[name], *values[name], relative[name], t, tolerance) for name in shared
    )
    moving = [relative[name] for name in shared if name != _ENERGY]
    return Comparison(
        first=a.path,
        second=b.path,
        tolerance=tolerance,
        n_common=len(t),
        t_begin=float(t[0]),
        t_end=float(t[-1]),
        settings=tuple(_settings(a, b)),
        differences=differences,
        only_first=tuple(name for name in own[0] if name not in own[1]),
        only_second=tuple(name for name in own[1] if name not in own[0]),
        growth=growth_rate(t, np.max(moving, axis=0)),
    )


_ENERGY = "T + V"


def _names_of_motion(system: System) -> list[str]:
    """Coordinates, then states."""
    names = [record["name"] for _, record in motion_records(system.coordinates, system.integrals)]
    return names + [system.rates[k]["name"] for k in system.states]


def _system(recording: Recording) -> System:
    try:
        return System(read_module(recording.module_text + "\n"))
    except ModuleError as error:
        raise RecordingError(f"{recording.path}: the recorded module cannot be read: {error}") from error


def _common_frames(a: Recording, b: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Return the frames of both at equal times; of several at one time, the last, after resets."""
    last_a, last_b = (np.append(np.flatnonzero(np.diff(r.t) > 0.0), len(r.t) - 1) for r in (a, b))
    near = _SAME_TIME * max(a.t[-1] - a.t[0], b.t[-1] - b.t[0])
    place = np.searchsorted(b.t[last_b], a.t[last_a] - near).clip(max=len(last_b) - 1)
    same = np.abs(b.t[last_b][place] - a.t[last_a]) <= near
    if not same.any():
        raise RecordingError(
            f"{a.path} and {b.path} have no frames at common times: record both with the same --fps"
        )
    if same.sum() == 1 < min(len(last_a), len(last_b)):
        raise RecordingError(
            f"{a.path} and {b.path} have one frame at a common time, t = {a.t[last_a[same]][0]:.6g} s, which says "
            "nothing of their motion: record both with the same --fps"
        )
    return last_a[same], last_b[place[same]]


def _quantities(recording: Recording, system: System, rows: np.ndarray) -> dict[str, tuple[str, np.ndarray]]:
    """Return units and values of all that is compared, by name."""
    named: dict[str, tuple[str, np.ndarray]] = {}
    for k, record in motion_records(system.coordinates, system.integrals):
        named[record["name"]] = record["unit"], recording.q[rows, k].copy()
    labels = rate_labels(system.coordinates, system.rates)
    for k, (label, record) in enumerate(zip(labels, system.rates, strict=True)):
        named[label] = record["unit"], recording.v[rows, k]
    if recording.energy.shape == (len(recording.t), 3):
        named[_ENERGY] = "J", recording.energy[rows, 2]
    return named


def _turn_alike(named_a: dict, named_b: dict, system: System) -> None:
    """Give quaternions of the second run the sign of the first's: q and -q are one rotation."""
    for place in system.quaternions:
        names = [record["name"] for record in system.coordinates[place : place + 4]]
        if all(name in named_b for name in names):
            sign = np.sign(sum(named_a[name][1] * named_b[name][1] for name in names))
            for name in names:
                named_b[name][1][:] *= np.where(sign < 0.0, -1.0, 1.0)


def _scales(units: dict[str, str], values: dict[str, tuple[np.ndarray, np.ndarray]]) -> dict[str, float]:
    largest = {name: float(np.abs(np.concatenate(pair)).max()) for name, pair in values.items()}
    of_unit: dict[str, float] = {}
    for name, size in largest.items():
        of_unit[units[name]] = max(of_unit.get(units[name], 0.0), size)
    return {name: max(size, _SMALL * of_unit[units[name]]) or 1.0 for name, size in largest.items()}


def _exchanged(recording: Recording) -> float:
    return Exchange(recording.energy[:, :2]).size


def _difference(
    name: str, unit: str, x: np.ndarray, y: np.ndarray, relative: np.ndarray, t: np.ndarray, tolerance: float
) -> Difference:
    absolute = np.abs(x - y)
    worst = int(np.argmax(np.where(np.isnan(absolute), np.inf, absolute)))
    above = np.flatnonzero(~(relative <= tolerance))  # nan is above
    first = float(t[above[0]]) if len(above) else None
    return Difference(name, unit, float(absolute[worst]), float(t[worst]), float(relative[worst]), first)


def _settings(a: Recording, b: Recording) -> list[Setting]:
    found = [Setting("model", a.name, b.name)] if a.name != b.name else []
    if a.name == b.name and _equations(a) != _equations(b):
        found.append(Setting("equations", "of the first", "of the second"))
    found += [Setting(key, getattr(a, key), getattr(b, key)) for key in _SETTINGS]
    found += [Setting(key, a.options.get(key), b.options.get(key)) for key in _OPTIONS]
    for values_a, values_b in ((a.parameters, b.parameters), (a.inputs, b.inputs)):
        found += [
            Setting(name, values_a.get(name), values_b.get(name))
            for name in dict.fromkeys([*values_a, *values_b])
        ]
    if a.inputs_over_time != b.inputs_over_time:
        found.append(Setting("inputs over time", *(", ".join(r.inputs_over_time) or None for r in (a, b))))
    found += [
        Setting(key, a.versions.get(key), b.versions.get(key)) for key in sorted({*a.versions, *b.versions})
    ]
    found.append(Setting("status", a.status, b.status))
    found += _event_counts(a, b)
    return [setting for setting in found if setting.first != setting.second]


def _event_counts(a: Recording, b: Recording) -> list[Setting]:
    """Return how often each event fired in the time that both runs have, to within a last frame."""
    last = min(a.t[-1], b.t[-1])
    counts = [Counter(event.name for event in r.events if event.t <= last) for r in (a, b)]
    return [
        Setting(f"events {name}", *(c[name] for c in counts)) for name in sorted({*counts[0], *counts[1]})
    ]


def _equations(recording: Recording) -> str:
    """Return the functions of the module, without its header."""
    return recording.module_text[recording.module_text.find("\n@njit") :]
