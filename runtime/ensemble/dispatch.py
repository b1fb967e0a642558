"""Where chunks of an ensemble run: threads here, processes of an executor, or the workers of a Dask cluster."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from symgen.runtime.ensemble.chunk import Chunk, Wanted, run_chunk
from symgen.runtime.ensemble.packing import pack
from symgen.runtime.ensemble.shipping import (
    AHEAD,
    first_line,
    in_order,
    is_dask,
    n_places,
    packed,
    run_packed,
    what_remains,
)
from symgen.runtime.ensemble.single import give_up
from symgen.runtime.ensemble.work import stop_all, work_for
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.ensemble.plan import Plan
    from symgen.runtime.ensemble.zarr_store import ZarrStore

on_dask = Late("symgen.runtime.ensemble.on_dask")


def run_chunks(
    plan: Plan, wanted: Wanted, chunks: Sequence[tuple[int, int]], store: ZarrStore | None, gather: bool
) -> Iterator[Chunk]:
    """Run chunks of members, and yield them in their order.

    Parameters
    ----------
    chunks : sequence of (int, int)
        Members from the first up to, not including, the second.
    store : ZarrStore or None
        Where they are written.
    gather : bool
        Whether what is kept is needed here.
    """
    executor = plan.options.executor
    if executor is None:
        return _in_threads(plan, wanted, chunks, store, gather)
    run = on_dask.run if is_dask(executor) else _by_executor
    return _with_store(store, run(executor, plan, wanted, chunks, store, gather))


def _in_threads(
    plan: Plan, wanted: Wanted, chunks: Sequence[tuple[int, int]], store: ZarrStore | None, gather: bool
) -> Iterator[Chunk]:
    n = n_places(plan.options)
    try:
        # The main thread waits beside them, so that Ctrl-C has an answer at once.
        with ThreadPoolExecutor(n, initializer=work_for, initargs=(plan,)) as executor:
            try:
                yield from in_order(
                    lambda first, last: executor.submit(run_chunk, plan, wanted, first, last, store, gather),
                    chunks, AHEAD * n,
                )  # fmt: skip
            except BaseException:
                stop_all(plan)
                raise
    finally:
        give_up(plan, again=True)


def _with_store(store: ZarrStore | None, chunks: Iterator[Chunk]) -> Iterator[Chunk]:
    """Write what workers have sent that cannot reach the store themselves."""
    for chunk in chunks:
        if store is not None and chunk.columns:
            store.write(chunk.first, chunk.columns, pack(chunk.tally.messages, chunk.blocks))
            chunk = replace(chunk, columns={})
        yield chunk


def _by_executor(
    executor: Any,
    plan: Plan,
    wanted: Wanted,
    chunks: Sequence[tuple[int, int]],
    store: ZarrStore | None,
    gather: bool,
) -> Iterator[Chunk]:
    content = packed(plan, wanted, store, gather)
    places, here = n_places(plan.options), chunks[0] if chunks else (0, 0)
    try:
        for chunk in in_order(
            lambda first, last: executor.submit(run_packed, content, first, last), chunks, AHEAD * places
        ):
            here = chunk.last, plan.members.n
            yield chunk
    except BrokenExecutor as error:
        raise RuntimeModelError(
            f"a process of {type(executor).__name__} was lost while members from {here[0]} on were under way "
            f"({first_line(error)}); {what_remains(plan.options)}"
        ) from None
