"""Noise at an input: another course of time for each member, the same one whenever and wherever it runs."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.inputs.given import Table
from symgen.runtime.lazy import Late
from symgen.runtime.options import Quantity
from symgen.runtime.record import record

quantities = Late("symgen.runtime.quantities")

_KINDS = ("hold", "linear", "cubic")
_MOST_VALUES = 10**7


@record
class Noise:
    """Independent values of a normal distribution at equal distances in time; see `noise`."""

    deviation: Quantity
    period: Quantity
    mean: Quantity = 0.0
    kind: str = "hold"

    def in_si(self, name: str, unit: str) -> Noise:
        """Return the noise with plain numbers, checked."""

        def number(value: Quantity, of: str) -> float:
            return float(quantities.in_si(value, of, name)) if isinstance(value, str) else float(value)

        found = Noise(
            number(self.deviation, unit), number(self.period, "s"), number(self.mean, unit), self.kind
        )
        numbers = (found.deviation, found.period, found.mean)
        if not (np.isfinite(numbers).all() and found.deviation >= 0.0 and found.period > 0.0):
            raise RuntimeModelError(
                f"{name}: {self}: give a deviation that is not negative, and a positive period"
            )
        if self.kind not in _KINDS:
            raise RuntimeModelError(f"{name}: noise of kind {self.kind!r}: there are {', '.join(_KINDS)}")
        return found

    def table(self, name: str, seed: int, member: int, t_start: float, t_end: float) -> Table:
        """Return a member's course of time: it follows from the seed, the name of the input, and the member's number.

        Raises
        ------
        RuntimeModelError
            The period is too short for the run.
        """
        n = (t_end - t_start) / self.period
        if not n < _MOST_VALUES:
            raise RuntimeModelError(
                f"{name}: noise with a period of {self.period:g} s has {n:.3g} values in a run, more than "
                f"{_MOST_VALUES}: give a longer period, or a shorter run"
            )
        own = int.from_bytes(hashlib.sha256(f"noise {name}".encode()).digest()[:8], "little")
        sequence = np.random.SeedSequence(
            seed, spawn_key=(own & 0xFFFFFFFF, own >> 32, member & 0xFFFFFFFF, member >> 32)
        )
        times = t_start + self.period * np.arange(int(n) + 2)
        drawn = np.random.Generator(np.random.Philox(sequence)).standard_normal(len(times))
        return Table(times, self.mean + self.deviation * drawn, kind=self.kind)

    def __str__(self) -> str:
        return f"noise({self.deviation}, {self.period})"


def noise(deviation: Quantity, period: Quantity, *, mean: Quantity = 0.0, kind: str = "hold") -> Noise:
    """Noise at an input: a value every `period` [s], drawn for each member, that holds until the next one.

    Up to frequencies of about 1/(4 period) its (two-sided) spectral density is deviation² period.

    Parameters
    ----------
    deviation, mean : float or str
        Of the normal distribution, in the unit of the input.
    period : float or str [s]
    kind : {"hold", "linear", "cubic"}
        Between the times of the values: see docs/inputs.md.
    """
    return Noise(deviation, period, mean, kind)


def is_noise(value: Any) -> bool:
    """Whether an input differs from member to member."""
    return isinstance(value, Noise)
