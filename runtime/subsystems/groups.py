"""Equal subsystems integrated side by side, a few at a time, with common steps: one loop then works for all of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.batches import evaluate
from symgen.runtime.choose import EXPLICIT, SERIES
from symgen.runtime.subsystems.gain import STEPS_PER_RADIAN, usual_time
from symgen.runtime.subsystems.side_by_side import can_stand_side_by_side, side_by_side
from symgen.runtime.subsystems.subsystem import Subsystem

if TYPE_CHECKING:
    from symgen.runtime.subsystems.settings import Settings

_MEMBERS = 8  # doubles of the widest vectors in use; the same on all machines, and so are results
# Steps of all members together that are worth a kernel of their own, for a member of no operations and for each of its
# operations: a series of eight takes 0.3 s and 6 ms per operation to compile, once, and spares each step 0.4 µs.
_WORTH = {SERIES: (300_000, 6_000), EXPLICIT: (30_000, 600)}
_LARGEST = 200  # operations of a member's rhs: larger ones fill vectors by themselves
_MOST_SPREAD = 1.2  # of a group's rates, so that the slowest takes little more steps than by itself


class Group(Subsystem):
    """Equal subsystems with common steps, each as accurate as by itself.

    Parameters
    ----------
    members : sequence of Subsystem
        Of one system and one method, each without twins.
    """

    def __init__(self, members: Sequence[Subsystem]):
        first, n = members[0], len(members)
        n_own = len(first.system.parameters)
        fastest = max(members, key=lambda member: member.choice.rate)
        super().__init__(
            side_by_side(first.system, n),
            np.concatenate([*(m.p[:n_own] for m in members), *(m.p[n_own:] for m in members)]),
            first.t_start,
            _by_vectors(first, [m.state for m in members]),
            replace(first.choice, rate=fastest.choice.rate),
        )
        self.members = members
        self.titles = [title for member in members for title in member.titles]
        self.columns = [_by_vectors(first, [m.columns[0] for m in members])]
        # The error of a step is measured by the root of the mean of squares: n times tighter squares hold for each.
        # Series are measured by their largest term.
        self.tolerance = 1.0 if self.choice.method.name == SERIES else _of_each(n)

    def prepare(
        self, times: np.ndarray, shown: np.ndarray, stops: Sequence[float], settings: Settings
    ) -> None:
        """Make a run from the start, as `Subsystem.prepare` does."""
        super().prepare(times, shown, stops, settings)
        self.run.tolerance_after = _of_each(len(self.members)) / self.tolerance

    def balances(self) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
        """Yield what `Subsystem.balances` says of each member; the work of forces is known of all together only."""
        if self.system.nw:
            yield from super().balances()
            return
        run, n = self.run, self.run.n_frames
        times, rows, places = run.arrays.frame_times[:n], run.arrays.frames[:n], self._places()
        for member, columns in zip(self.members, places, strict=True):
            yield (
                member.titles[0],
                evaluate(member.system, "energy", member.p, times, np.ascontiguousarray(rows[:, columns])),
                np.zeros(n),
            )

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{len(self.members)} subsystems side by side, the first of them the {self.titles[0]}"

    def _places(self) -> np.ndarray:
        """Where each member's state is in that of the group, shape (members, nq + nv)."""
        nq, nv, n = self.members[0].system.nq, self.members[0].system.nv, len(self.members)
        q, v = np.arange(n * nq).reshape(n, nq), n * nq + np.arange(n * nv).reshape(n, nv)
        return np.hstack([q, v])


def _of_each(n: int) -> float:
    """The tolerance for the root of the mean of squares over n members that holds for each, in parts of its own."""
    return 1.0 / math.sqrt(n)


def _by_vectors(first: Subsystem, rows: Sequence[np.ndarray]) -> np.ndarray:
    """Rows over (q, v) as one over all q, then all v."""
    nq, table = first.system.nq, np.array(rows)
    return np.concatenate([table[:, :nq].ravel(), table[:, nq:].ravel()])


def in_groups(found: Sequence[Subsystem]) -> list[Subsystem]:
    """Join subsystems of one kind whose steps are of like length into groups; the others stay as they are.

    Returns
    -------
    list of Subsystem
        In the order of their first members.
    """
    kinds: dict[tuple[int, str], list[Subsystem]] = {}
    for subsystem in found:
        if _has_no_twins_and_moves(subsystem):
            key = id(subsystem.system), subsystem.choice.method.name
            kinds.setdefault(key, []).append(subsystem)
    group_of: dict[int, Group] = {}
    span = usual_time(found)
    for members in kinds.values():
        if not can_stand_side_by_side(members[0].system):
            continue
        chunks = list(_chunks(members))
        for chunk in chunks if _are_worth_it(chunks, span) else ():
            group_of |= dict.fromkeys(map(id, chunk), Group(chunk))
    return list(dict.fromkeys(group_of.get(id(subsystem), subsystem) for subsystem in found))


def _has_no_twins_and_moves(subsystem: Subsystem) -> bool:
    choice = subsystem.choice
    return (
        choice.method.name in (SERIES, EXPLICIT)
        and len(subsystem.columns) == 1
        and subsystem.system.operations.get("rhs", 0) <= _LARGEST
        and not subsystem.is_asleep
    )


def _are_worth_it(chunks: Sequence[Sequence[Subsystem]], span: float) -> bool:
    """Whether groups take so many steps that they are estimated to spare the time to compile their kernel."""
    if not chunks:
        return False
    first = chunks[0][0]
    least, per_operation = _WORTH[first.choice.method.name]
    rates = sum(member.choice.rate for chunk in chunks for member in chunk)
    return STEPS_PER_RADIAN * rates * span >= least + per_operation * first.system.operations.get("rhs", 0)


def _chunks(members: Sequence[Subsystem]) -> Iterator[list[Subsystem]]:
    """Members of like rates, as many as make a group."""
    members = sorted(members, key=lambda member: member.choice.rate)
    start = 0
    while start + _MEMBERS <= len(members):
        chunk = members[start : start + _MEMBERS]
        if chunk[-1].choice.rate <= _MOST_SPREAD * chunk[0].choice.rate:
            yield chunk
            start += _MEMBERS
        else:
            start += 1
