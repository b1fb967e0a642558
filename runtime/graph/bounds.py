"""What numbers of a model have to be: known to descriptions, which are checked, and to modules, whose runs are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

_ROUND_OFF = 1e-9  # of the largest moment of inertia

# What modules say, and what goes behind "has to be".
ZERO_OR_MORE, POSITIVE, ONE_OR_MORE = "zero or more", "positive", "one or more"
FROM_0_TO_1, ZERO = "from 0 to 1", "zero"
BELOW, NOT_BELOW = "below", "at least"  # the next number
TENSOR = "a tensor without negative moments"


def _has_negative_moment(
    xx: float, yy: float, zz: float, xy: float = 0.0, xz: float = 0.0, yz: float = 0.0
) -> bool:
    """Whether a tensor of inertia has a negative principal moment."""
    # In parts of the largest, whose cube may be out of range.
    largest = max(xx, yy, zz, abs(xy), abs(xz), abs(yz)) or 1.0
    xx, yy, zz, xy, xz, yz = (entry / largest for entry in (xx, yy, zz, xy, xz, yz))
    minors = (xx * yy - xy * xy, xx * zz - xz * xz, yy * zz - yz * yz)
    determinant = xx * minors[2] - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    return min(minors) < -_ROUND_OFF or determinant < -_ROUND_OFF


# Whether numbers break a bound.
_BROKEN: dict[str, Callable[..., Any]] = {
    ZERO_OR_MORE: lambda x: x < 0.0,
    POSITIVE: lambda x: x <= 0.0,
    ONE_OR_MORE: lambda x: x < 1.0,
    FROM_0_TO_1: lambda x: not 0.0 <= x <= 1.0,
    ZERO: lambda x: x != 0.0,
    BELOW: lambda x, y: x >= y,
    NOT_BELOW: lambda x, y: x < y,
    TENSOR: _has_negative_moment,
}
#: How many numbers a bound is about.
NUMBERS = {name: (1,) for name in _BROKEN} | {BELOW: (2,), NOT_BELOW: (2,), TENSOR: (3, 6)}


def is_broken(bound: str, *numbers: float) -> bool:
    """Whether numbers are not what they have to be: as many as `NUMBERS` says of the bound, one of its keys."""
    return bool(_BROKEN[bound](*numbers))


def words(bound: str, numbers: Sequence[float]) -> str:
    """Return what goes behind "has to be"."""
    return f"{bound} {numbers[1]:g}" if bound in (BELOW, NOT_BELOW) else bound
