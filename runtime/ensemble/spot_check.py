"""Whether members that a store or a file holds are those of the model: what varies, and some members run again.

Whoever knows how a store is written can write any numbers into it. Before an ensemble goes on with one, what varies
between members is held against the plan, and members drawn at random are run again, for a second at most: to the last
bit they are what they were.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from symgen.runtime.ensemble.sampling import named_beside
from symgen.runtime.ensemble.verdict import VERDICTS, WORKER_LOST
from symgen.runtime.ensemble.work import run_part

if TYPE_CHECKING:
    from symgen.runtime.ensemble.plan import Plan
    from symgen.runtime.ensemble.zarr_store import ZarrStore

_SECONDS = 1.0
_AT_ONCE = 64  # members
_ROUNDED = 1e-12  # what is drawn may differ by the last bits of another machine's logarithm


def forged_chunks(plan: Plan, kept: Sequence[str], store: ZarrStore, chunks: Sequence[int]) -> list[int]:
    """Return the chunks whose members are not the model's, as far as that is seen.

    One member of each chunk is looked at, then more of each, until the time is over; once a chunk is found, the time
    does not count.
    """
    waiting = list(chunks)
    secrets.SystemRandom().shuffle(waiting)
    forged: set[int] = set()
    until = time.monotonic() + _SECONDS
    for n in (0, 1, _AT_ONCE):
        for k in waiting:
            if k in forged or (n and not forged and time.monotonic() > until):
                continue
            held = {name: store.chunk_of(name, k) for name in store.names}
            if not _agree(plan, kept, held, *store.rows(k), n):
                forged.add(k)
    return sorted(forged)


def is_of_the_model(plan: Plan, kept: Sequence[str], held: Mapping[str, np.ndarray], n: int) -> bool:
    """Whether the first n members, in a file that is read whole, are the model's, as far as that is seen."""
    until = time.monotonic() + _SECONDS
    for at_once in (0, 1, _AT_ONCE, _AT_ONCE, _AT_ONCE):
        if n and (not at_once or time.monotonic() < until) and not _agree(plan, kept, held, 0, n, at_once):
            return False
    return True


def _agree(
    plan: Plan, kept: Sequence[str], held: Mapping[str, np.ndarray], first: int, last: int, n: int
) -> bool:
    """Whether some members, n of those from `first` up to `last`, are those of the model; of none, what varies."""
    if not n:
        wanted = named_beside(plan.members.values(first, last), kept)
        return all(
            held[name].dtype.kind == "f"
            and np.allclose(held[name][: last - first], values, rtol=_ROUNDED, atol=0.0, equal_nan=True)
            for name, values in wanted.items()
        )
    begin = secrets.randbelow(max(last - first - n, 0) + 1)
    rows = slice(begin, min(begin + n, last - first))
    if (held["status"][rows] == WORKER_LOST).any():  # it has ended whoever ran it, and would end this process
        return True
    part = run_part(plan, kept, first + rows.start, first + rows.stop)
    found = {**part.series, **{name: getattr(part.verdicts, name) for name in VERDICTS}}
    return all(
        np.array_equal(values, held[name][rows], equal_nan=values.dtype.kind == "f")
        for name, values in found.items()
    )
