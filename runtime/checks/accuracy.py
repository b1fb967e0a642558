"""How far a run is off: an entry of the health report."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.entry import HealthCheck, noted
from symgen.runtime.checks.error_estimate import (
    LARGEST_ERROR,
    LEAST_FRAMES,
    ErrorEstimate,
    estimate,
    followed,
)
from symgen.runtime.checks.work import SHORT, operations_of_run
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.failures import state_names
from symgen.runtime.lazy import Late
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

schedule = Late("symgen.runtime.inputs.schedule")

_SHARE = 0.012  # of the run's operations, for a companion; those of a long run take up to 2.5 times as much
# Operations that nobody waits for: some milliseconds beside runs of as many, one beside those of more than twice that.
_CHEAP, _CHEAP_AT_LEAST = 2e7, 4e6
_MORE_THAN_WHOLE, _MOST_OF_SAMPLED = 3.0, 2e9  # of a run with sampled controllers: half a second
_HARDLY_RESOLVED = 1e3  # times atol: ranges below this
# An error that is not there, and is all there is so shortly afterwards, in parts of the run, has not grown.
_LOST, _SMALL_ERROR, _AT_ONCE_SHARE = 0.5, 1e-3, 0.05
_AT_ONCE = "the error comes at once, as where a step goes over something that its stages do not meet"


@record
class AccuracyCheck(HealthCheck):
    """The entry of a run that is right.

    Attributes
    ----------
    sees_drift : bool
        Whether its error has what the drift of the energy makes of the motion up to the end.
    sees_all : bool
        Whether a companion went beside all of the run.
    """

    sees_drift: bool = False
    sees_all: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return the check as a dictionary, as all others are."""
        known = super().to_dict()
        del known["sees_drift"], known["sees_all"]
        return known


def accuracy(solution: Solution) -> Iterator[HealthCheck]:
    """Yield the estimated error of a run, in parts of what each coordinate and rate does.

    Parameters
    ----------
    solution : Solution
        With a regular end.
    """
    # Without a log of steps it is a recording.
    if len(solution.t) < LEAST_FRAMES or not len(solution.step_log):
        return
    if getattr(solution.system, "samplers", ()):
        yield from _with_samplers(solution)
        return
    found = estimate(solution, _allowed(operations_of_run(solution)))
    if found is not None:
        yield _entry(solution, found)


def _with_samplers(solution: Solution) -> Iterator[HealthCheck]:
    """Yield the estimated error of a run with sampled controllers.

    What they said is held as it was. Only where errors are large then are they called again, in a loop with the
    companion: they act on its errors.
    """
    held = replace(solution, system=solution.system.as_recorded())
    operations = operations_of_run(held)
    # Calls of Python take longer than a companion to its end, and parts of so many pieces show no growth.
    allowed = max(_allowed(operations), min(_MORE_THAN_WHOLE * operations, _MOST_OF_SAMPLED))
    found = estimate(held, allowed)
    if found is None:
        return
    entry = _entry(held, found)
    if entry.ok:
        yield replace(entry, says=f"{entry.says}, with what sampled controllers said held as it was")
        return
    called = _called_again(solution, allowed)
    if called is not None:
        yield _entry(solution, called)
        return
    says = (
        "not estimated: with what sampled controllers said held as it was, errors exceed "
        f"{LARGEST_ERROR:.0%} from t = {found.until(LARGEST_ERROR):.4g} s on, and whether the controllers act against "
        "them was not to be found by calling them again (what they remember belongs into `memory`); compare a run "
        f"with {_tighter(solution, 0)}"
    )
    yield noted("accuracy", found.largest, LARGEST_ERROR, says)


def _called_again(solution: Solution, operations: float) -> ErrorEstimate | None:
    """Return what a companion says that sampled controllers act on; None where they are not what they were.

    A function that keeps something elsewhere than in `memory` does not begin as it began before.
    """
    if not _begin_alike(solution):
        return None
    system = solution.system.anew()
    try:
        schedule.first_samples(system, solution.p, float(solution.t[0]), solution.states[0])
        found = followed(replace(solution, system=system), operations)
    except RuntimeModelError:
        return None
    return found if found.known and _begin_alike(solution) else None


def _begin_alike(solution: Solution) -> bool:
    """Whether sampled controllers, called with the state at the start, say what they said then, to the last bit."""
    t, system = float(solution.t[0]), solution.system.anew()
    said = solution.system.samplers
    if any(sampler.times[0] != t for sampler in said):
        return False
    try:
        schedule.first_samples(system, solution.p, t, solution.states[0])
    except RuntimeModelError:
        return False
    return all(np.array_equal(a.values[0], b.values[0]) for a, b in zip(system.samplers, said, strict=True))


def _allowed(operations: float) -> float:
    """Return the operations that a companion may take beside a run of so many: short runs are followed to their end."""
    cheap = _CHEAP * min(1.0, SHORT / max(operations, 1.0)) ** 2
    return max(_SHARE * operations, cheap, _CHEAP_AT_LEAST)


def _rebounds_fade(solution: Solution) -> bool:
    """Whether a stop gives back a part of the speed, so that ever smaller rebounds become rest."""
    n = sum(switch["kind"] == "stop" for switch in solution.system.switches)
    if not n:
        return False
    end = np.ascontiguousarray(solution.states[-1:])
    back = evaluate(solution.system, "switches", solution.p, solution.t[-1:], end)[0, 1 : 2 * n : 2]
    return bool(((back > 0.0) & (back < 1.0)).any())


def _entry(solution: Solution, found: ErrorEstimate) -> HealthCheck:
    column = int(np.argmax(found.relative.max(axis=0)))
    name, error = state_names(solution.system)[column], found.largest
    off = (
        f"{name} is off by about {error:.2g} of its range"
        if error < 1.0
        else f"{name} is off by its whole range"
    )
    said = off if found.known else f"{off} at the end, as parts of the run, integrated again, say"
    if error <= LARGEST_ERROR:
        beyond = ""
        if found.unseen:
            beyond = f"; what {found.unseen} jumps of rates beyond these make of it is not known"
            if _rebounds_fade(solution):
                # A rebound that is taken for rest is as fast as a fall over an error of the gap.
                of_rest = min(float(np.sqrt(solution.rtol)), LARGEST_ERROR)
                error = max(error, of_rest)
                beyond += f": where ever smaller rebounds become rest, about {of_rest:.1g}"
        return AccuracyCheck(
            "accuracy", True, error, LARGEST_ERROR, f"at most, {said}{beyond}",
            sees_drift=found.known or found.has_drift, sees_all=found.known,
        )  # fmt: skip
    beyond = f"by more than {LARGEST_ERROR:.0%} from t = {found.until(LARGEST_ERROR):.4g} s on"
    says = f"{said}, and {beyond}: take {_remedy(solution, found, column)}, or end the run before"
    if found.rate is not None:
        tenfold = np.log(10.0) / found.rate
        says += (
            f"; errors grow tenfold every {tenfold:.2g} s: the motion is chaotic or unstable, and `symgen check` says "
            "up to when digits hold"
        )
    return HealthCheck("accuracy", False, error, LARGEST_ERROR, says)


def _remedy(solution: Solution, found: ErrorEstimate, column: int) -> str:
    scale = None if solution.step else found.gone_over(LARGEST_ERROR)
    if scale is None:
        tighter = _tighter(solution, column)
        return (
            f"{tighter}, or shorter steps (max_step): {_AT_ONCE}"
            if _comes_at_once(solution, found)
            else tighter
        )
    return f"steps of at most {scale:.2g} s (max_step): longer ones went over something as short as that"


def _comes_at_once(solution: Solution, found: ErrorEstimate) -> bool:
    """Whether the whole motion of a run of adaptive steps is lost from one frame to the next few: no tolerance is."""
    if solution.step or found.largest < _LOST:
        return False
    span = max(
        _AT_ONCE_SHARE * float(found.t[-1] - found.t[0]), 2.0 * float(np.diff(found.t).max(initial=0.0))
    )
    return found.until(LARGEST_ERROR) - found.until(_SMALL_ERROR) <= span


def _tighter(solution: Solution, column: int) -> str:
    if solution.step:
        return f"a smaller step than {solution.step:g} s"
    if np.ptp(solution.states[:, column]) < _HARDLY_RESOLVED * solution.atol:
        return f"a smaller atol than {solution.atol:g} (which is much of that range)"
    largest = float(np.abs(solution.states[:, column]).max())
    if solution.atol > solution.rtol * largest:
        return f"a smaller atol than {solution.atol:g} (rtol {solution.rtol:g} of its largest value is less than that)"
    return f"a smaller rtol than {solution.rtol:g}"
