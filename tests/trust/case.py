"""What a case is, and what becomes of it: runs that are broken, right but in need of a word, or sound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symgen.errors import ModelError
from symgen.runtime.errors import RuntimeModelError

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

REFUSED = "refused"
_RIGHT = 0.01  # largest difference from the reference, of a coordinate's or rate's range


@dataclass(frozen=True)
class Case:
    """One run.

    Attributes
    ----------
    kind : str
        What is wrong with it, or to be said of it; "sound" where nothing is.
    name : str
    run : callable
        () -> Solution; may raise the errors that users get.
    check : str
        The name of the entry that has to say what is wrong, or "refused"; an objection, or a note beside one.
    word : str
        What its sentence has to name: a parameter, constraint, event or coordinate.
    short : bool
        Whether it belongs to the part that the test suite runs.
    reference : callable, optional
        () -> Solution that is right. The run has to agree with it, and nothing may object: what is to be said is
        advice.
    """

    kind: str
    name: str
    run: Callable[[], Solution]
    check: str = ""
    word: str = ""
    short: bool = False
    reference: Callable[[], Solution] | None = None


@dataclass(frozen=True)
class Verdict:
    """What was flagged, and what else was said: check -> sentence; and how far the run is off its reference."""

    flags: dict[str, str]
    told: dict[str, str]
    error: float = 0.0

    def is_right(self, case: Case) -> bool:
        """Return whether a broken run is flagged and its cause named, and a right one is right and not flagged."""
        wanted = case.check != "" and case.reference is None
        if bool(self.flags) != wanted or not self.error <= _RIGHT:
            return False
        says = {**self.told, **self.flags}
        return not case.check or (case.check in says and case.word in says[case.check])


def judge(case: Case) -> Verdict:
    """Run a case and collect what its health report, or the error instead of a result, says."""
    try:
        solution = case.run()
    except (RuntimeModelError, ModelError) as error:
        return Verdict({REFUSED: str(error)}, {})
    flags = {entry.check: entry.says for entry in solution.health if not entry.ok}
    told = {entry.check: entry.says for entry in solution.advice}
    return Verdict(flags, told, _error(solution, case.reference()) if case.reference is not None else 0.0)


def _error(solution: Solution, right: Solution) -> float:
    """Return how far the end of a run is off that of a right one, in parts of what each variable goes through."""
    ranges = np.ptp(right.states, axis=0)
    off = np.abs(solution.states[-1] - right.states[-1])
    return float((off / np.maximum(ranges, 1e-3 * ranges.max())).max())
