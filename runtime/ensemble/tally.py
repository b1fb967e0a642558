"""How members came out, in numbers that do not grow with theirs: how many failed and why, the worst, first messages."""

from __future__ import annotations

import collections
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.integrate import layout as at

if TYPE_CHECKING:
    from symgen.runtime.ensemble.verdict import Verdicts

MOST_NAMED = 1000


@dataclass
class Tally:
    """What is known of members whose verdicts may be kept nowhere.

    Attributes
    ----------
    n, n_failed, n_doubtful : int
    named : list of int
        Members that failed or are doubtful, the first thousand.
    failed : list of int
        Members without a result, the first thousand.
    causes : Counter of int
        How many members failed, by status.
    messages : dict of int to str
        Why members failed that could not begin or ran by themselves, the first thousand.
    largest_energy_error, largest_residual : float
        Over all members that reached their end.
    """

    n: int = 0
    n_failed: int = 0
    n_doubtful: int = 0
    named: list[int] = field(default_factory=list)
    failed: list[int] = field(default_factory=list)
    causes: collections.Counter[int] = field(default_factory=collections.Counter)
    messages: dict[int, str] = field(default_factory=dict)
    largest_energy_error: float = 0.0
    largest_residual: float = 0.0

    @classmethod
    def of(cls, first: int, verdicts: Verdicts, messages: Mapping[int, str]) -> Tally:
        """Return the tally of members from number `first` on."""
        failed = verdicts.status != at.REACHED_STOP
        there = ~failed

        def largest(values: np.ndarray) -> float:
            known = values[there & np.isfinite(values)]
            return float(known.max(initial=0.0))

        return cls(
            len(failed), int(failed.sum()), int((~verdicts.ok & there).sum()),
            (first + np.flatnonzero(~verdicts.ok)[:MOST_NAMED]).tolist(),
            (first + np.flatnonzero(failed)[:MOST_NAMED]).tolist(),
            collections.Counter(verdicts.status[failed].tolist()), _few(messages),
            largest(verdicts.energy_error), largest(verdicts.constraint_residual),
        )  # fmt: skip

    def add(self, other: Tally) -> None:
        """Take the tally of the members that come next."""
        self.n, self.n_failed = self.n + other.n, self.n_failed + other.n_failed
        self.n_doubtful += other.n_doubtful
        self.named += other.named[: MOST_NAMED - len(self.named)]
        self.failed += other.failed[: MOST_NAMED - len(self.failed)]
        self.causes.update(other.causes)
        if len(self.messages) < MOST_NAMED:
            self.messages = _few({**self.messages, **other.messages})
        self.largest_energy_error = max(self.largest_energy_error, other.largest_energy_error)
        self.largest_residual = max(self.largest_residual, other.largest_residual)


def _few(messages: Mapping[int, Any]) -> dict[int, str]:
    return {int(k): str(messages[k]) for k in sorted(messages)[:MOST_NAMED]}
