"""Subsystems that were integrated by themselves: what is small in the whole may be large in one of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from symgen.runtime.checks.entry import HealthCheck, advised, limited
from symgen.runtime.checks.steps import MOST_REJECTED
from symgen.runtime.exchange import energy_limit

if TYPE_CHECKING:
    from symgen.runtime.integrate.methods import Method
    from symgen.runtime.solution import Solution


def subsystems(solution: Solution, method: Method) -> Iterator[HealthCheck]:
    """Yield what is wrong with the worst subsystem, by energy and by rejected steps; each is named."""
    title, value = solution.parts.worst_energy()
    limit = energy_limit(method, solution.rtol)
    found = f"at most, the energy balance of the {title} is off by {value:.2g} of what it exchanges"
    objection = f"{found}, more than {limit:.2g}: try tighter tolerances or smaller steps"
    yield limited("subsystem energy", value, limit, found, objection)
    if method.adaptive:
        title, value = solution.parts.worst_rejected()
        found = (
            f"at most, {value:.0%} of the steps of the {title} were rejected"
            if title
            else "few steps were taken"
        )
        advice = (
            f"{found}: a discontinuity or noise in its forces defeats the error control; make it an event"
        )
        yield advised("subsystem steps", value, MOST_REJECTED, found, advice)
