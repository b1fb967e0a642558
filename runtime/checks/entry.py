"""One entry of a health report."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from symgen.runtime.record import record


@record
class HealthCheck:
    """One check of a run.

    Attributes
    ----------
    check : str
        What was checked.
    ok : bool
        False: the result is not to be trusted.
    value, limit : float
        What was found, and where the limit lies.
    says : str
        One sentence: what this means and, where it is not ok, one thing to do.
    note : bool
        Advice, or a cause that may lie behind an objection; by itself nothing against the result, so `ok` is True.
    """

    check: str
    ok: bool
    value: float
    limit: float
    says: str
    note: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return the check as a dictionary."""
        return asdict(self)


def limited(name: str, value: float, limit: float, fine: str, objection: str) -> HealthCheck:
    """Return an entry that is ok where `value` is at most `limit`; NaN is not."""
    ok = bool(value <= limit)
    return HealthCheck(name, ok, float(value), float(limit), fine if ok else objection)


def noted(name: str, value: float, limit: float, says: str) -> HealthCheck:
    """Return an entry that advises."""
    return HealthCheck(name, True, float(value), float(limit), says, note=True)


def advised(name: str, value: float, limit: float, fine: str, advice: str) -> HealthCheck:
    """Return an entry that advises where `value` is not at most `limit`."""
    return limited(name, value, limit, fine, "") if value <= limit else noted(name, value, limit, advice)
