"""All settings of one method on one scene, from coarse to fine, as far as that gains something."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.checks.time_scales import time_scales
from symgen.runtime.choose import choose_method
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.options import SMALLEST_RTOL, RunOptions

from .case import Case, Effort, Row, measure

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method

LEVELS = (1e-3, 1e-6, 1e-9, 1e-12)
LOST = 1.0  # an error as large as the motion itself
_TRACKED = 1e-2
_LOOSEST, _TIGHTEST = -2.0, -15.0  # powers of ten of rtol
_STEPS_PER_PERIOD = 3.0
_LEAST_STEPS = 8
_MOST_HALVINGS = 40
_SAME = 1e-9  # settings that differ by no more, relatively, are one
_FAILURES = 4  # tolerances in a row that may fail; steps may be too long many times
_STALE = 3  # settings in a row that may gain nothing, once the error is small
_SMALL = 1e-9


def label(level: float) -> str:
    """Return the name of a level: "1e-3"."""
    return f"1e{round(math.log10(level))}"


def seconds_at(rows: Sequence[Row], level: float) -> float | None:
    """Return the least run time with an error of at most `level`, None where no run is as accurate.

    Between a run that is too coarse and the next finer one that is not, seconds and error are taken to lie on a
    straight line in logarithms; not from runs that have nothing to do with the motion (an error of 1 or more).
    Where the coarsest run is already accurate enough, its own time counts.

    Parameters
    ----------
    rows : sequence of Row
        Neighbouring settings follow each other; none failed.
    """
    found = [row.seconds for row in rows if row.error <= level]
    found += [_between(a, b, level) for a, b in pairwise(rows) if LOST > a.error > level >= b.error]
    return min(found, default=None)


def _between(coarse: Row, fine: Row, level: float) -> float:
    error = max(fine.error, 1e-300)
    part = math.log(coarse.error / level) / math.log(coarse.error / error)
    return math.exp((1.0 - part) * math.log(coarse.seconds) + part * math.log(fine.seconds))


def at_setting(rows: Sequence[Row], setting: float) -> Row | None:
    """Return the run at a setting, on straight lines in logarithms between measured ones; None outside of them."""
    for a, b in pairwise(rows):
        if a.setting * (1.0 + _SAME) >= setting >= b.setting * (1.0 - _SAME):
            part = math.log(a.setting / setting) / math.log(a.setting / b.setting)
            error, seconds = (
                math.exp((1.0 - part) * math.log(max(x, 1e-300)) + part * math.log(max(y, 1e-300)))
                for x, y in ((a.error, b.error), (a.seconds, b.seconds))
            )
            return Row(setting, error, seconds)
    return None


def all_levels(rows: Sequence[Row]) -> dict[str, float | None]:
    """Return the run time at each level."""
    return {label(level): seconds_at(rows, level) for level in LEVELS}


def best_at(times: Mapping[str, Mapping[str, float | None]], level: str) -> tuple[str, float] | None:
    """Return the name and run time of the fastest at a level; the first name where two are equal."""
    reached = [(at[level], name) for name, at in times.items() if at.get(level) is not None]
    if not reached:
        return None
    seconds, name = min(reached)
    return name, seconds


def lost_again(rows: Sequence[Row]) -> list[float]:
    """Return the settings of runs that lost the motion although a coarser one had followed it."""
    tracked, lost = False, []
    for row in rows:
        if tracked and row.error >= LOST:
            lost.append(row.setting)
        tracked = tracked or row.error <= _TRACKED
    return lost


@dataclass
class Curve:
    """Measured runs of a method, coarsest setting first.

    Attributes
    ----------
    quantity : str
        "rtol" or "step".
    says : str
        Why the sweep ended before every error level was reached; why the method does not apply.
    """

    quantity: str
    rows: list[Row] = field(default_factory=list)
    says: str = ""

    def usable(self) -> list[Row]:
        """Return the runs that came to the end."""
        return [row for row in self.rows if row.error is not None]


def tolerances(per_decade: int) -> np.ndarray:
    """Return the values of rtol of a sweep, loosest first."""
    n = int((_LOOSEST - _TIGHTEST) * per_decade)
    values = 10.0 ** np.linspace(_LOOSEST, _TIGHTEST, n + 1)
    return values[values >= 0.999 * SMALLEST_RTOL]


def sweep(case: Case, name: str, effort: Effort) -> Curve:
    """Measure a method on a scene."""
    scene, reference = case.scene, case.reference
    try:
        options = RunOptions(t_end=scene.t_end, method=name)
        method, _ = choose_method(case.system, reference.p, reference.start, options)
    except RuntimeModelError as error:
        return Curve("rtol", says=str(error))
    curve = Curve("rtol" if method.adaptive else "step")
    for setting in _settings(case, method, effort):
        row = measure(case, method, setting, effort)
        curve.rows.append(row)
        curve.says = row.says
        if _over(curve.rows, effort, method.adaptive):
            break
    return curve


def _settings(case: Case, method: Method, effort: Effort) -> Iterator[float]:
    if method.adaptive:
        yield from map(float, tolerances(effort.per_decade))
        return
    nq, start, span = case.system.nq, case.reference.start, case.scene.t_end
    period = time_scales(case.system, case.reference.p, 0.0, start[:nq], start[nq:]).fastest_period
    coarsest = min(period / _STEPS_PER_PERIOD, span / _LEAST_STEPS)
    n = int(np.ceil(span / coarsest))
    # `per_decade` steps to each halving: methods of high order gain much by a little.
    counts = (round(n * 2.0 ** (k / effort.per_decade)) for k in range(_MOST_HALVINGS * effort.per_decade))
    yield from (span / count for count in counts)


def _over(rows: list[Row], effort: Effort, adaptive: bool) -> bool:
    """Whether finer settings are out of reach or gain nothing."""
    last = rows[-1]
    if last.error is None:
        given_up = adaptive and len(rows) >= _FAILURES and all(row.error is None for row in rows[-_FAILURES:])
        return given_up or last.seconds > effort.longest_run
    if 2.0 * last.seconds > effort.longest_run:
        return True
    errors = [row.error for row in rows if row.error is not None]
    if len(errors) <= _STALE or min(errors) > _SMALL:
        return False
    return min(errors[-_STALE:]) > 0.5 * min(errors[:-_STALE])
