"""One entry of a health report."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
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
    """

    check: str
    ok: bool
    value: float
    limit: float
    says: str

    def to_dict(self) -> dict[str, Any]:
        """Return the check as a dictionary."""
        return asdict(self)


def limited(name: str, value: float, limit: float, fine: str, objection: str) -> HealthCheck:
    """Return an entry that is ok where `value` is at most `limit`; NaN is not."""
    ok = bool(value <= limit)
    return HealthCheck(name, ok, float(value), float(limit), fine if ok else objection)
