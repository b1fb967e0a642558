"""Did a run step across a gap between branches of the positions that constraints allow?

Close to a change point, branches come near to each other and do not meet: the motion bends sharply from one asymptote
to the other. A step that is longer than the bend continues straight on, onto a branch that cannot be reached, with
energy and constraints as they should be. What tells is the orientation of the constraints: the exterior product of the
rows of G is continuous along a motion, and turns by less than a right angle from frame to frame; across a gap, as
across a change point itself, it changes its sign. Halving the distance between the states on both sides, on the
constraints, leads to one place at a change point, and no further than the gap where there is one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.entry import HealthCheck
from symgen.runtime.constraints.frames_code import TURNS, WEIGHTS, LookAtFrames
from symgen.runtime.constraints.levels import Constraints
from symgen.runtime.kept_arrays import lent
from symgen.runtime.positions import Positions

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_MOST_CONSTRAINTS = 30
_STRAIGHT = 0.2  # what rates of both frames may leave of the way between them: the state has not turned there
_MOST_PLACES = 5
_HALVINGS, _GAUSS_STEPS = 40, 12
_CLOSED = 1e-5  # of the coordinates' ranges: nearer than this, branches meet
_ON_CONSTRAINTS = 1e-11  # of what the largest range of a coordinate may change
_ROUND_OFF = 1e-12  # of the largest column
_TINY = 1e-300


def branches(solution: Solution) -> Iterator[HealthCheck]:
    """Yield a failed check if the run is on a branch of the positions that its motion does not lead to."""
    system = solution.system
    nh = system.nh
    if not 0 < nh <= _MOST_CONSTRAINTS or nh >= system.nv or solution.redundant or len(solution.t) < 3:
        return
    precomputed, turned = system.precomputed(solution.p), []
    with lent(system, LookAtFrames, len(precomputed)) as look:
        look.begin(system, precomputed)
        look.see(WEIGHTS, solution.t, solution.states)
        # A coordinate that moves the whole loop along has columns of round-off: these are no directions.
        sizes = look.of.weights
        sizes[:] = np.maximum(sizes, max(_ROUND_OFF**2 * sizes.max(initial=0.0), _TINY))
        weights = 1.0 / sizes
        for first, end in look.look(TURNS, solution.t, solution.states):
            turned += (first - 1 + np.flatnonzero(look.of.turned[: end - first])).tolist()
    places = [k for k in turned if _is_straight(solution, k)][:_MOST_PLACES]
    for k in places:
        gap = _Between(solution, weights).gap(k)
        if gap > _CLOSED:
            yield _entry(solution, k, gap)
            return


def _entry(solution: Solution, frame: int, gap: float) -> HealthCheck:
    t = 0.5 * (solution.t[frame] + solution.t[frame + 1])
    here = Constraints(solution.system, solution.p, float(t))
    rows = here.jacobian(solution.q[frame])
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1), _TINY)[:, None]
    name = here.names[int(np.argmax(np.abs(np.linalg.svd(rows)[0][:, -1])))]
    says = (
        f"at about t = {t:.6g} s a step leads across a gap between branches of the positions ({gap:.2g} of the largest "
        f"coordinate's range), close to where constraint {name!r} follows from the others; the motion turns there: "
        "take method taylor or a smaller rtol, or sizes with which the branches meet"
    )
    return HealthCheck("branch", False, gap, _CLOSED, says)


def _turned(first: np.ndarray, second: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Whether the exterior products of rows are more than a right angle apart, by the formula of Cauchy and Binet."""
    inner = (first * weights) @ np.swapaxes(second, -1, -2)
    if inner.shape[-1] == 1:
        return inner[..., 0, 0] < 0.0
    return np.linalg.det(inner) < 0.0


def _is_straight(solution: Solution, k: int) -> bool:
    """Whether coordinates go from frame k to the next as rates on both sides say."""
    system, (before, after) = solution.system, solution.states[[k, k + 1]]
    rates = evaluate(system, "rhs", solution.p, solution.t[[k, k + 1]], solution.states[[k, k + 1]])
    way = (after - before)[: system.nq]
    expected = 0.5 * (solution.t[k + 1] - solution.t[k]) * rates[:, : system.nq].sum(axis=0)
    return bool(np.linalg.norm(way - expected) <= _STRAIGHT * np.linalg.norm(way))


class _Between:
    """Places on the constraints between two frames."""

    def __init__(self, solution: Solution, weights: np.ndarray):
        self._solution, self._weights = solution, weights
        self._positions = Positions(solution.system)
        q = solution.q
        self._range = max(float((q.max(axis=0) - q.min(axis=0)).max()), _TINY)

    def gap(self, k: int) -> float:
        """Return how near both sides come to each other, in parts of the largest range; 0: nothing divides them."""
        (left, right), times = self._solution.q[[k, k + 1]], list(self._solution.t[[k, k + 1]])
        for _ in range(_HALVINGS):
            t = 0.5 * (times[0] + times[1])
            middle = self._on_constraints(t, 0.5 * (left + right))
            if middle is None:
                break
            if self._divided(times[0], left, t, middle):
                right, times[1] = middle, t
            elif self._divided(t, middle, times[1], right):
                left, times[0] = middle, t
            else:
                return 0.0
        return float(np.abs(right - left).max()) / self._range

    def _rows(self, t: float, q: np.ndarray) -> np.ndarray:
        here = Constraints(self._solution.system, self._solution.p, float(t))
        return here.jacobian(q)[: self._solution.system.nh]

    def _divided(self, t: float, q: np.ndarray, other_t: float, other: np.ndarray) -> bool:
        return bool(_turned(self._rows(t, q), self._rows(other_t, other), self._weights))

    def _on_constraints(self, t: float, q: np.ndarray) -> np.ndarray | None:
        """Return a state near `q` on the constraints; None where none is found."""
        here, scale = Constraints(self._solution.system, self._solution.p, float(t)), np.sqrt(self._weights)
        q = self._positions.normalised(q)
        for _ in range(_GAUSS_STEPS):
            residual, rows = here.position(q), self._rows(t, q)
            if np.all(np.abs(residual) <= _ON_CONSTRAINTS * self._range * np.abs(rows).max()):
                return q
            step = -np.linalg.lstsq(rows * scale, residual, rcond=1e-14)[0]
            q = self._positions.normalised(self._positions.retract(q, scale * step))
            if not np.all(np.isfinite(q)):
                return None
        return None
