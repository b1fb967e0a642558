"""Where chunks of an ensemble run: threads here, processes of an executor, or the workers of a Dask cluster.

What another process needs goes out as bytes: which run time made them, then the model's text, the options, and what is
wanted. A worker whose run time is another one refuses, since its members might differ in their last bits.
"""

from __future__ import annotations

import collections
import contextlib
import functools
import importlib.util
import os
import pickle
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symgen.runtime.code import cache, engine
from symgen.runtime.ensemble.chunk import Chunk, Wanted, block_size, pack, run_chunk
from symgen.runtime.ensemble.plan import Plan, make_plan
from symgen.runtime.ensemble.tally import Tally
from symgen.runtime.ensemble.verdict import VERDICTS, WORKER_LOST, Verdicts
from symgen.runtime.ensemble.version import fingerprint
from symgen.runtime.ensemble.work import run_part, stop_all
from symgen.runtime.ensemble.zarr_store import StoreError, ZarrStore
from symgen.runtime.errors import RuntimeModelError
from symgen.runtime.lazy import Late

if TYPE_CHECKING:
    from symgen.runtime.ensemble.options import EnsembleOptions

machine = Late("symgen.runtime.ensemble.machine")

_AHEAD = 2  # chunks under way for each thread or worker
_NOT_SENT = ("executor", "progress", "reduce", "out", "resume", "threads")
_LOST_BEFORE = "its worker was lost, several times"
_lock = threading.Lock()


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
    run = _on_dask if is_dask(executor) else _by_executor
    return _with_store(store, run(executor, plan, wanted, chunks, store, gather))


def n_places(options: EnsembleOptions) -> int:
    """Return how many chunks run at the same time."""
    if options.executor is None:
        return options.threads or len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else [0])
    if is_dask(options.executor):
        return max(1, sum(options.executor.ncores().values()))
    return getattr(options.executor, "_max_workers", None) or os.cpu_count() or 1


def is_dask(executor: Any) -> bool:
    """Whether it is the client of a Dask cluster."""
    return hasattr(executor, "scatter") and hasattr(executor, "ncores")


def _in_threads(
    plan: Plan, wanted: Wanted, chunks: Sequence[tuple[int, int]], store: ZarrStore | None, gather: bool
) -> Iterator[Chunk]:
    n = n_places(plan.options)
    # The main thread waits beside them, so that Ctrl-C has an answer at once.
    with ThreadPoolExecutor(n) as executor:
        try:
            yield from _in_order(
                lambda first, last: executor.submit(run_chunk, plan, wanted, first, last, store, gather),
                chunks, _AHEAD * n,
            )  # fmt: skip
        except BaseException:
            stop_all()
            raise


def _in_order(submit: Callable[[int, int], Any], chunks: Sequence[tuple[int, int]], ahead: int) -> Iterator[Any]:
    waiting: collections.deque[Any] = collections.deque()
    try:
        for chunk in chunks:
            waiting.append(submit(*chunk))
            if len(waiting) >= ahead:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()


def _with_store(store: ZarrStore | None, chunks: Iterator[Chunk]) -> Iterator[Chunk]:
    """Write what workers have sent that cannot reach the store themselves."""
    for chunk in chunks:
        if store is not None and chunk.columns:
            store.write(chunk.first, chunk.columns, pack(chunk.tally.messages, chunk.blocks))
            chunk = replace(chunk, columns={})
        yield chunk


def _by_executor(
    executor: Any, plan: Plan, wanted: Wanted, chunks: Sequence[tuple[int, int]], store: ZarrStore | None, gather: bool
) -> Iterator[Chunk]:
    content = packed(plan, wanted, store, gather)
    places, here = n_places(plan.options), chunks[0] if chunks else (0, 0)
    try:
        for chunk in _in_order(
            lambda first, last: executor.submit(run_packed, content, first, last), chunks, _AHEAD * places
        ):
            here = chunk.last, plan.members.n
            yield chunk
    except BrokenExecutor as error:
        raise RuntimeModelError(
            f"a process of {type(executor).__name__} was lost while members from {here[0]} on were under way "
            f"({_first_line(error)}); what is done before is kept: run the rest with a new one, by out and resume"
        ) from None


def _on_dask(
    client: Any, plan: Plan, wanted: Wanted, chunks: Sequence[tuple[int, int]], store: ZarrStore | None, gather: bool
) -> Iterator[Chunk]:
    """Workers that die are replaced, and what they had is run again, by the scheduler; what kills them is found here."""
    from distributed import CancelledError, KilledWorker

    content = packed(plan, wanted, store, gather, with_code=True)

    def everywhere() -> Any:
        return client.scatter(content, broadcast=True, hash=False)

    def submit(first: int, last: int) -> Any:
        task = client.submit(run_packed, sent[0], first, last, pure=False)
        return _Waiting(task, first, last)

    def result(waiting: _Waiting) -> Chunk:
        for _ in range(3):
            try:
                return waiting.task.result()
            except KilledWorker:
                return _rescued(client, sent[0], plan, wanted, waiting.first, waiting.last)
            except CancelledError:  # all workers that held what was sent are gone
                sent[0] = everywhere()
                waiting = submit(waiting.first, waiting.last)
        raise RuntimeModelError(
            f"the Dask cluster has lost members {waiting.first} to {waiting.last - 1} three times: look at its workers"
        )

    sent = [everywhere()]
    yield from map(result, _in_order(submit, chunks, _AHEAD * n_places(plan.options)))


class _Waiting:
    """A task, and which members it is about; `result` is itself, so that what went wrong is seen by who asks."""

    def __init__(self, task: Any, first: int, last: int) -> None:
        self.task, self.first, self.last = task, first, last

    def result(self) -> _Waiting:
        return self

    def cancel(self) -> None:
        self.task.cancel()


def _rescued(client: Any, sent: Any, plan: Plan, wanted: Wanted, first: int, last: int) -> Chunk:
    """Run a chunk block by block that has ended several workers: members of a block that does so again have failed."""
    from distributed import KilledWorker

    length, parts = block_size(plan), []
    for begin in range(first, last, length):
        end = min(begin + length, last)
        try:
            parts.append(client.submit(run_packed, sent, begin, end, True, pure=False).result())
        except KilledWorker:
            parts.append(_lost(plan, wanted, begin, end))
    return joined(parts)


def _lost(plan: Plan, wanted: Wanted, first: int, last: int) -> Chunk:
    """The chunk of members of which nothing came back."""
    n, shape = last - first, (last - first, *((len(plan.frame_times),) if len(plan.frame_times) else ()))
    verdicts = Verdicts.empty(n)
    verdicts.status[:] = WORKER_LOST
    columns = {**plan.members.values(first, last), **{name: np.full(shape, np.nan) for name in wanted.kept}}
    columns |= {name: getattr(verdicts, name) for name in VERDICTS}
    return Chunk(first, last, Tally.of(first, verdicts, {first: _LOST_BEFORE}), [wanted.empty()], columns)


def joined(chunks: Sequence[Chunk]) -> Chunk:
    """Return chunks that follow each other as one."""
    tally = Tally()
    for chunk in chunks:
        tally.add(chunk.tally)
    names = chunks[0].columns
    columns = {name: np.concatenate([chunk.columns[name] for chunk in chunks]) for name in names}
    return Chunk(chunks[0].first, chunks[-1].last, tally, [b for chunk in chunks for b in chunk.blocks], columns)


def packed(plan: Plan, wanted: Wanted, store: ZarrStore | None, gather: bool, *, with_code: bool = False) -> bytes:
    """Return what another process needs to run members of the ensemble.

    Parameters
    ----------
    with_code : bool
        Whether machine code goes with it, for processors like this one; others compile the text.
    """
    fields = plan.options.__dataclass_fields__
    given = {name: getattr(plan.options, name) for name in fields if name not in _NOT_SENT}
    # What was chosen for the ensemble is not chosen again.
    given |= {"method": plan.method, "step": plan.single.step}
    place = None if store is None else (os.path.abspath(store.path), store.about["token"])
    code = _machine_code(plan, wanted) if with_code else {}
    content = plan.system, given, wanted, place, gather or store is not None, code
    return pickle.dumps((fingerprint(), _pickled(content)))


def _pickled(content: Any) -> bytes:
    try:
        return pickle.dumps(content)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        if importlib.util.find_spec("cloudpickle") is None:
            raise RuntimeModelError(
                f"a function of reduce or inputs cannot be sent to other processes ({_first_line(error)}): define it in "
                "a module, or install cloudpickle"
            ) from None
    import cloudpickle

    return cloudpickle.dumps(content)


def _machine_code(plan: Plan, wanted: Wanted) -> dict[str, bytes]:
    """Return the object code that members of this plan run through, by its key: a few of them run on a copy of it."""
    fresh = pickle.loads(pickle.dumps(plan.system))
    options = replace(plan.options, executor=None, progress=None, method=plan.method, step=plan.single.step)
    for known in (machine.lane_loop, machine.lane_map):
        known.cache_clear()  # what is held already would not be asked for
    with engine.noted() as keys:
        other = make_plan(fresh, options)
        run_part(other, wanted.names, 0, 1)
    found = {key: cache.fetch(folder / f"{key}.o") for key, folder in keys.items()}
    return {key: code for key, code in found.items() if code is not None}


def run_packed(content: bytes, first: int, last: int, gather: bool = False) -> Chunk:
    """Run members in another process.

    Parameters
    ----------
    content : bytes
        From `packed`.
    gather : bool
        Whether what is kept goes back in any case.
    """
    with _lock:
        plan, wanted, store, needed = _unpacked(content)
    chunk = run_chunk(plan, wanted, first, last, None if gather else store, gather or (needed and store is None))
    if chunk.columns:
        chunk = replace(chunk, columns={**plan.members.values(first, last), **chunk.columns})
    return chunk


@functools.lru_cache(maxsize=2)
def _unpacked(content: bytes) -> tuple[Plan, Wanted, ZarrStore | None, bool]:
    made_by, inner = pickle.loads(content)
    if made_by != fingerprint():
        raise RuntimeModelError(
            f"the worker on {socket.gethostname()} has symgen {fingerprint()}, but the ensemble comes from symgen "
            f"{made_by}: members would not be the same; install one version everywhere"
        )
    system, given, wanted, place, needed, code = pickle.loads(inner)
    folder = cache.cache_folder("kernels")
    for key, content_of in code.items():
        if not (folder / f"{key}.o").exists():
            cache.store(folder / f"{key}.o", content_of)
    from symgen.runtime.ensemble.options import EnsembleOptions

    plan = make_plan(system, EnsembleOptions(**given))
    return plan, wanted, None if place is None else _store_at(*place), needed


def _store_at(path: str, token: str) -> ZarrStore | None:
    """Return the client's store where it can be reached from here: a folder of another machine may have its name."""
    with contextlib.suppress(StoreError):
        store = ZarrStore.open(path)
        if store.about["token"] == token and os.access(path, os.W_OK):
            return store
    return None


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0][:200]
