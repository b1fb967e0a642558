"""What of a result's variance comes from which of the values that vary: Sobol' indices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.record import record
from symgen.runtime.tables import need

if TYPE_CHECKING:
    from symgen.runtime.ensemble.sampling import Members

_CONFIDENCE, _RESAMPLES = 0.95, 200
_LEAST = 16  # members, or rows of a design


@record(eq=False)
class Sensitivity:
    """Sobol' indices of a quantity.

    Attributes
    ----------
    names : list of str
        What is drawn.
    first : ndarray
        Shares of the variance that each makes by itself.
    total : ndarray or None
        Shares that vanish where it is known, what it does together with others included; a design alone tells them.
    first_low, first_high, total_low, total_high : ndarray
        Bounds between which they are with 95 % confidence (bootstrap).
    n : int
        Members that were used, or rows of the design.
    left_out : int
        How many were not, because a member failed.
    """

    names: list[str]
    first: np.ndarray
    first_low: np.ndarray
    first_high: np.ndarray
    total: np.ndarray | None
    total_low: np.ndarray | None
    total_high: np.ndarray | None
    n: int
    left_out: int

    def lines(self) -> list[str]:
        """Return a line for each of the values that vary, the largest first."""
        width = max(map(len, self.names))
        found = []
        for k in np.argsort(-self.first):
            bounds = f"{self.first_low[k]:.3f} to {self.first_high[k]:.3f}"
            line = f"{self.names[k]:<{width}}  {self.first[k]:.3f} ({bounds})"
            if self.total is not None:
                line += f", in all {self.total[k]:.3f} ({self.total_low[k]:.3f} to {self.total_high[k]:.3f})"
            found.append(line)
        return found


def sensitivity(members: Members, values: np.ndarray) -> Sensitivity:
    """Return Sobol' indices of a quantity, one number for each member.

    Of a design "saltelli" both kinds.
    Of plain draws the first ones alone, by SALib (RBD-FAST: Tarantola, Gatelli, Mara 2006; Plischke 2010).

    Raises
    ------
    RuntimeModelError
        Grids multiply beside the draws, nothing is drawn, or nothing varies.
    """
    if members.has_grids or not members.drawn:
        raise RuntimeModelError(
            "sensitivity: it is about what is drawn, such as normal(1, 0.1) and uniform(0, 1), without grids beside"
        )
    return _by_design(members, values) if members.design == "saltelli" else _of_draws(members, values)


def _by_design(members: Members, values: np.ndarray) -> Sensitivity:
    d = len(members.drawn)
    rows = values.reshape(-1, d + 2)
    there = np.isfinite(rows).all(axis=1)
    rows = rows[there]
    _refuse_few(len(rows), rows)
    first, total = _indices(rows)
    generator = np.random.default_rng(members.seed)
    again = np.array(
        [_indices(rows[generator.integers(len(rows), size=len(rows))]) for _ in range(_RESAMPLES)]
    )
    low, high = np.quantile(again, [0.5 - 0.5 * _CONFIDENCE, 0.5 + 0.5 * _CONFIDENCE], axis=0)
    return Sensitivity(
        list(members.drawn), first, low[0], high[0], total, low[1], high[1], len(rows), int((~there).sum())
    )


def _indices(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return first-order and total indices from values at A, at B, and at A with one value from B, in this order.

    Table 2 of Saltelli et al., Computer Physics Communications 181 (2010) 259: (b) for the first, (f) for the total.
    """
    rows = rows - rows[:, :2].mean()
    a, b, mixed = rows[:, :1], rows[:, 1:2], rows[:, 2:]
    variance = rows[:, :2].var()
    return (b * (mixed - a)).mean(axis=0) / variance, 0.5 * ((a - mixed) ** 2).mean(axis=0) / variance


def _of_draws(members: Members, values: np.ndarray) -> Sensitivity:
    need("SALib", "salib", "sensitivity of plain draws (design='saltelli' needs nothing more)")
    from SALib.analyze import rbd_fast

    known = members.values(0, members.n)
    there = np.isfinite(values)
    x = np.column_stack([known[name] for name in members.drawn])[there]
    _refuse_few(len(x), values[there])
    problem = {
        "num_vars": len(members.drawn),
        "names": members.drawn,
        "bounds": [[0.0, 1.0]] * len(members.drawn),
    }
    found = rbd_fast.analyze(problem, x, values[there], conf_level=_CONFIDENCE, seed=members.seed)
    first, half = np.array(found["S1"]), np.array(found["S1_conf"])
    return Sensitivity(
        list(members.drawn), first, first - half, first + half, None, None, None, len(x), int((~there).sum())
    )


def _refuse_few(n: int, values: np.ndarray) -> None:
    if n < _LEAST:
        raise RuntimeModelError(f"sensitivity: {n} members with a result are too few; give n = 1000, say")
    if not np.ptp(values) > 0.0:
        raise RuntimeModelError(
            "sensitivity: all members have the same value, so there is no variance to explain"
        )
