"""Whether a bushing turned so far that its angles, and its torque with them, jump to the other side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.checks.entry import HealthCheck, limited

if TYPE_CHECKING:
    from symgen.runtime.solution import Solution

_HALF_A_TURN = 180.0  # degrees
_MOST_ABOUT_Y = 90.0


def bushings(solution: Solution) -> HealthCheck:
    """Return an entry on the angles of bushings at frames: those of successive rotations about x, y and z.

    About x and z they end at half a turn, where they go on from minus that; about y at a quarter turn, where the other
    two jump. A bushing that is wound up further pushes the wrong way.
    """
    poses = evaluate(solution.system, "poses", solution.p, solution.t, np.ascontiguousarray(solution.states))
    worst, says = 0.0, "no bushing turns half about x or z, nor a quarter about y"
    for record in solution.system.source.header["bushings"]:
        angles = np.degrees(_angles(poses, record))
        jumps = np.abs(np.diff(angles[:, [0, 2]], axis=0)).max(axis=1, initial=0.0)
        if (jumps > _HALF_A_TURN).any():
            frame = int(np.argmax(jumps > _HALF_A_TURN)) + 1
            return limited(
                "bushings", 1.0, 0.0, "",
                f"bushing {record['name']!r} turns beyond half a turn about x or z, or {_MOST_ABOUT_Y:g} degrees about "
                f"y, before t = {solution.t[frame]:.6g} s, where its torque jumps to the other side: use a spring of "
                "an angle, or hold it by stops",
            )  # fmt: skip
        worst = max(worst, float((np.abs(angles) / [_HALF_A_TURN, _MOST_ABOUT_Y, _HALF_A_TURN]).max()))
    return limited("bushings", 0.0, 0.0, f"{says}: they turn to {worst:.2g} of that at most", "")


def _angles(poses: np.ndarray, record: dict[str, Any]) -> np.ndarray:
    """Return angles of successive rotations about x, y, z from the first frame to the second, shape (n, 3) [rad]."""
    first, second = (
        _turned(poses, body) @ np.reshape(axes, (3, 3))
        for body, axes in zip(record["bodies"], record["axes"])
    )
    r = np.einsum("nki,nkj->nij", first, second)
    return np.stack(
        [
            np.arctan2(-r[:, 1, 2], r[:, 2, 2]),
            np.arcsin(np.clip(r[:, 0, 2], -1.0, 1.0)),
            np.arctan2(-r[:, 0, 1], r[:, 0, 0]),
        ],
        axis=1,
    )


def _turned(poses: np.ndarray, body: int) -> np.ndarray:
    """Return rotation matrices of a body at frames, body to world; -1 is the world."""
    if body < 0:
        return np.broadcast_to(np.eye(3), (len(poses), 3, 3))
    return poses[:, 12 * body + 3 : 12 * body + 12].reshape(-1, 3, 3)
