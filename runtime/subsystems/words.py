"""What a run of subsystems says about itself: methods, steps, what was shared, what slept."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symgen.runtime.subsystems.subsystem import Subsystem

_MOST_NOTES = 5


def say(found: Sequence[Subsystem], n_kinds: int) -> Iterator[str]:
    """Yield the notes on a run of `n_kinds` kinds of subsystems."""
    n, steps = sum(len(s.titles) for s in found), [s.run.n_steps for s in found]
    yield (
        f"subsystems: {n} of {n_kinds} kind{'s' * (n_kinds > 1)}, each integrated by itself with its own steps, "
        f"{min(steps)} to {max(steps)} of them"
    )
    yield from _choices(found, n)
    twins = sum(len(s.columns) - 1 for s in found)
    if twins:
        yield f"subsystems: {twins} of {n} start and move as others do, and took no steps of their own"
    groups = [s for s in found if len(s.titles) > len(s.columns)]
    if groups:
        joined = sum(len(s.titles) for s in groups)
        yield (
            f"subsystems: {joined} of {n} in {len(groups)} groups of equal ones side by side, each with the steps of "
            "its fastest"
        )
    asleep = [s.run.asleep_from for s in found for _ in s.titles if np.isfinite(s.run.asleep_from)]
    if asleep:
        yield f"asleep: {len(asleep)} of {n} subsystems at rest, the first from t = {min(asleep):.6g} s on"
    own = [f"{s.name}: {note}" for s in found for note in s.run.notes]
    yield from own[:_MOST_NOTES]
    if len(own) > _MOST_NOTES:
        yield f"and {len(own) - _MOST_NOTES} notes more about subsystems"


def _choices(found: Sequence[Subsystem], n: int) -> Iterator[str]:
    """What was chosen, once for all subsystems of which the same is said but for numbers."""
    groups: dict[tuple[str, str], list[tuple[str, Subsystem]]] = {}
    for subsystem in found:
        for note in subsystem.choice.notes:
            groups.setdefault((note.split(":")[0], subsystem.choice.method.name), []).append(
                (note, subsystem)
            )
    for group in groups.values():
        note, first = group[0]
        count = sum(len(subsystem.titles) for _, subsystem in group)
        yield (
            note if count == n else f"{note} ({count} of {n} subsystems, the first is the {first.titles[0]})"
        )
