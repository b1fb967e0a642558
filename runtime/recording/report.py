"""What `verify` found in a recording."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes
    ----------
    name : str
    ok : bool or None
        None: could not be checked; `says` tells why.
    value, limit : float
        What was found; what it must not exceed.
    says : str
    """

    name: str
    ok: bool | None
    value: float
    limit: float
    says: str


@dataclass(frozen=True)
class Report:
    """What `verify` found.

    Attributes
    ----------
    path : Path
    complete : bool
        False for a run that was cut short.
    n_frames : int
    t_last : float [s]
    checks : tuple of Check
    """

    path: Path
    complete: bool
    n_frames: int
    t_last: float
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether no check failed. A recording that was cut short can be ok: see `complete`."""
        return all(check.ok is not False for check in self.checks)

    @property
    def summary(self) -> str:
        """One sentence."""
        frames = f"{self.n_frames} frame{'s' * (self.n_frames != 1)} up to t = {self.t_last:.9g} s"
        failed = [check.name for check in self.checks if check.ok is False]
        state = f"complete: {frames}" if self.complete else f"incomplete: {frames}; the run was cut short"
        return f"{state}; failed: {', '.join(failed)}" if failed else f"{state}; all checks passed"

    def to_dict(self) -> dict[str, Any]:
        """Return the report as JSON can say it."""
        checks = [asdict(check) for check in self.checks]
        head = {"path": str(self.path), "ok": self.ok, "complete": self.complete, "says": self.summary}
        return {**head, "frames": self.n_frames, "t": self.t_last, "checks": checks}
