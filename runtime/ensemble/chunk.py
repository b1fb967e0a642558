"""Some members from beginning to end, wherever that is: their runs, statistics, tally, and their place in a store.

A chunk is one or more whole blocks, a block one or more whole parts. Statistics are merged part by part within a block,
and block by block by whoever collects: how many blocks a chunk has, and where it ran, changes no bit of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.ensemble import wound
from symgen.runtime.ensemble.packing import pack
from symgen.runtime.ensemble.reduction import Reduction
from symgen.runtime.ensemble.sampling import named_beside
from symgen.runtime.ensemble.single import refuse_given_up
from symgen.runtime.ensemble.tally import Tally
from symgen.runtime.ensemble.verdict import VERDICTS, Verdicts
from symgen.runtime.ensemble.work import Part, run_part
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.integrate import layout as at
from symgen.runtime.record import record

if TYPE_CHECKING:
    from symgen.runtime.ensemble.plan import Plan
    from symgen.runtime.ensemble.zarr_store import ZarrStore

_DEFAULT_STATISTICS = ("mean", "std", "min", "max")
_SMALLEST_PART, _PART = 64, 4096  # members
_PARTS_AT_LEAST = 16  # so that several threads have something to do
_SMALLEST_WITH_SWITCHES = 512  # members that settle together: what that takes hardly grows with their number
_PART_NUMBERS = 1 << 19  # of frames in a part: 4 MB, which caches hold
# A graphics processor is full with some ten thousand threads; larger launches spare this machine's processors work.
_DEVICE_PART, _DEVICE_PART_NUMBERS, _DEVICE_PARTS_AT_LEAST = 1 << 16, 1 << 24, 4
_ONE_BY_ONE = 64  # members of a part that run by themselves
_MOST_BLOCKS = 1 << 16  # merging one takes 50 us, with quantiles and a histogram
_PARTS_OF_BLOCK = 64


def part_size(plan: Plan) -> int:
    """Members that run together: what they are does not depend on it."""
    n = plan.members.n
    if plan.settings is None:
        return max(1, min(_ONE_BY_ONE, n // _PARTS_AT_LEAST))
    numbers = (
        max(len(wound.watched_times(plan)), 1) * plan.system.ny
        + plan.system.n_precomputed
        + plan.system.n_row
    )
    if plan.options.device != "cpu":
        even = -(-n // _DEVICE_PARTS_AT_LEAST)
        return max(_SMALLEST_PART, min(_DEVICE_PART, even, _DEVICE_PART_NUMBERS // max(numbers, 1)))
    even = -(-n // _PARTS_AT_LEAST // 8) * 8
    if plan.system.switches:
        even = max(even, _SMALLEST_WITH_SWITCHES)
    return max(_SMALLEST_PART, min(_PART, even, _PART_NUMBERS // max(numbers, 1)))


def block_size(plan: Plan) -> int:
    """Members whose statistics are merged into one: it follows from the ensemble alone."""
    part = part_size(plan)
    return part * max(1, min(_PARTS_OF_BLOCK, plan.members.n // (part * _MOST_BLOCKS)))


@record(eq=False)
class Wanted:
    """What is wanted of members.

    Attributes
    ----------
    kept : tuple of str
        Series that are kept.
    names : tuple of str
        Series that are kept or reduced.
    reductions : tuple of Reduction
        Empty ones.
    worked_out : dict of str to callable
        What is reduced that has to be worked out first.
    """

    kept: tuple[str, ...]
    names: tuple[str, ...]
    reductions: tuple[Reduction, ...] = ()
    worked_out: Mapping[str, Callable[..., Any]] = field(default_factory=dict)

    def empty(self) -> list[Reduction]:
        """Return reductions that have taken nothing."""
        return [reduction.empty() for reduction in self.reductions]


def read_reductions(given: Mapping[str, Any]) -> tuple[tuple[Reduction, ...], dict[str, Any]]:
    """Return reductions, and functions of those that are worked out, by name."""
    found, functions = [], {}
    for name, wanted in given.items():
        statistics = wanted
        if callable(wanted):
            functions[name], statistics = wanted, _DEFAULT_STATISTICS
        elif isinstance(wanted, tuple) and len(wanted) == 2 and callable(wanted[0]):
            functions[name], statistics = wanted
        if isinstance(statistics, str) or not isinstance(statistics, (list, tuple)):
            statistics = [statistics]
        found.append(Reduction(name, statistics))
    return tuple(found), functions


@record(eq=False)
class Chunk:
    """Members after their runs.

    Attributes
    ----------
    first, last : int
    tally : Tally
    blocks : list of list of Reduction
        Of each block, in the order of `Wanted.reductions`.
    columns : dict of str to ndarray
        What is kept of each, verdicts among it; empty where it is in a store already, or not wanted.
    """

    first: int
    last: int
    tally: Tally
    blocks: list[list[Reduction]]
    columns: dict[str, np.ndarray]


def run_chunk(
    plan: Plan, wanted: Wanted, first: int, last: int, store: ZarrStore | None, gather: bool
) -> Chunk:
    """Run members from `first` up to, not including, `last`.

    Parameters
    ----------
    store : ZarrStore or None
        Where they are written, instead of being returned.
    gather : bool
        Whether what is kept of them is returned.
    """
    part_length, block_length = part_size(plan), block_size(plan)
    tally, blocks, pieces = Tally(), [], []
    for begin in range(first, last, part_length):
        if (begin - first) % block_length == 0:
            blocks.append(wanted.empty())
        part = run_part(plan, wanted.names, begin, min(begin + part_length, last))
        refuse_given_up(plan)
        tally.add(Tally.of(begin, part.verdicts, part.messages))
        _merge(plan, wanted, part, blocks[-1])
        if gather or store is not None:
            pieces.append(_columns(wanted, part))
    columns = {
        name: np.concatenate([piece[name] for piece in pieces]) for name in (pieces[0] if pieces else ())
    }
    if store is not None:
        varied = named_beside(plan.members.values(first, last), wanted.kept)
        store.write(first, {**varied, **columns}, pack(tally.messages, blocks))
        columns = {}
    return Chunk(first, last, tally, blocks, columns)


def stored_chunk(wanted: Wanted, store: ZarrStore, k: int, block_length: int) -> Chunk:
    """Return a chunk that a store has: its tally and statistics.

    Raises
    ------
    RuntimeModelError
        It is damaged.
    """
    first, last = store.rows(k)
    arrays = {
        name: store.chunk_of(name, k) for name in store.names
    }  # all of them: their checksums are looked at
    verdicts = Verdicts(**{name: arrays[name] for name in VERDICTS})
    messages, numbers = store.known(k)
    blocks = []
    try:
        if (verdicts.ok & (verdicts.status != at.REACHED_STOP)).any():
            raise ValueError("some have failed and are ok")
        if wanted.reductions and len(numbers) != -(-(last - first) // block_length):
            raise ValueError("statistics are missing")
        for own in numbers:
            blocks.append(wanted.empty())
            for reduction, values in zip(blocks[-1], own, strict=True):
                reduction.set_numbers(values)
    except (ValueError, IndexError, TypeError) as error:
        raise RuntimeModelError(f"{store.path}: members {first} to {last - 1}: {error}") from None
    return Chunk(first, last, Tally.of(first, verdicts, messages), blocks, {})


def _columns(wanted: Wanted, part: Part) -> dict[str, np.ndarray]:
    return {
        **{name: part.series[name] for name in wanted.kept},
        **{name: getattr(part.verdicts, name) for name in VERDICTS},
    }


def _merge(plan: Plan, wanted: Wanted, part: Part, block: list[Reduction]) -> None:
    for total, reduction in zip(block, reduced(plan, wanted, part), strict=True):
        total.merge(reduction)


def reduced(plan: Plan, wanted: Wanted, part: Part) -> list[Reduction]:
    """Return the statistics of a part."""
    found = wanted.empty()
    for reduction in found:
        function = wanted.worked_out.get(reduction.name)
        values = (
            part.series[reduction.name]
            if function is None
            else _worked_out(plan, reduction.name, function, part)
        )
        reduction.take(values)
    return found


def _worked_out(plan: Plan, name: str, function: Callable[..., Any], part: Part) -> np.ndarray:
    n = len(part.verdicts.status)
    varied = plan.members.values(part.first, part.first + n)
    given = {**part.series, **named_beside(varied, part.series)}
    values = np.asarray(function(given), dtype=float)
    if values.ndim < 1 or len(values) != n:
        raise RuntimeModelError(
            f"reduce: {name}: the function gave an array of shape {values.shape} for {n} members; the first axis "
            "must be that of the members"
        )
    there = part.verdicts.status == at.REACHED_STOP
    return np.where(there.reshape(n, *[1] * (values.ndim - 1)), values, np.nan)
