"""Health of a run by subsystem: what is small in the whole may be large in one of its parts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.exchange import Exchange
from symgen.runtime.integrate import layout as at

if TYPE_CHECKING:
    from symgen.runtime.subsystems.subsystem import Subsystem

_FEWEST_STEPS = 20  # of a subsystem, to speak of a share of rejected ones
_LEAST_ENERGY = 1e-9  # of the largest exchange in the whole: errors of subsystems with less do not matter


class Parts:
    """The subsystems of a run that were integrated by themselves.

    Attributes
    ----------
    found : sequence of Subsystem
    """

    def __init__(self, found: Sequence[Subsystem]):
        self.found = found

    def worst_energy(self) -> tuple[str, float]:
        """Return the subsystem with the largest error of its energy balance, in parts of what it exchanges."""
        errors = {
            title: _error_and_exchange(energies, work, bool(subsystem.system.switches))
            for subsystem in self.found
            for title, energies, work in subsystem.balances()
        }
        largest = max((exchange.size for _, exchange in errors.values()), default=0.0)
        relative = {
            title: float(exchange.relative(error)) * min(1.0, exchange.size / (_LEAST_ENERGY * largest))
            for title, (error, exchange) in errors.items()
            if exchange.size > 0.0
        }
        if not relative:
            return self.found[0].name, 0.0
        return max(relative.items(), key=lambda item: (item[1], item[0]))

    def worst_rejected(self) -> tuple[str, float]:
        """Return the subsystem with the largest share of rejected steps, of those that took some."""
        shares = {"": 0.0}
        for subsystem in self.found:
            taken, rejected = (int(subsystem.run.arrays.counters[index]) for index in (at.STEPS, at.REJECTED))
            if taken + rejected >= _FEWEST_STEPS:
                shares[subsystem.name] = rejected / (taken + rejected)
        return max(shares.items(), key=lambda item: (item[1], item[0]))


def _error_and_exchange(energies: np.ndarray, work: np.ndarray, holds: bool) -> tuple[float, Exchange]:
    """Return the largest error of the energy balance at the frames [J], and what the motion exchanges."""
    balance = energies.sum(axis=1) - work
    return float(np.abs(balance - balance[0]).max()), Exchange(energies, work, holds=holds)
